"""Downhill simplex search for a handful of parameters (Nelder and Mead, 1965)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_rt.exchange import FloatArray

_CLOSE = 0.01


def minimise(
    cost: Callable[[FloatArray], float], start: FloatArray, step: float, evaluations: int
) -> tuple[FloatArray, float]:
    """Return where `cost` is smallest near `start` (n,), and its value there.

    The first simplex reaches `step` along each axis; the search ends when all its corners lie
    within a hundredth of that, or after `evaluations`.
    """
    corners = np.vstack([start, start + step * np.eye(start.size)])
    values = np.array([cost(c) for c in corners])
    used = values.size

    while used < evaluations:
        order = np.argsort(values)
        corners, values = corners[order], values[order]
        if np.max(np.abs(corners[1:] - corners[0])) < _CLOSE * step:
            break
        middle = corners[:-1].mean(axis=0)

        def moved(
            factor: float, middle: FloatArray = middle, worst: FloatArray = corners[-1]
        ) -> tuple[FloatArray, float]:
            point = middle + factor * (worst - middle)
            return point, cost(point)

        best = moved(-1.0)
        used += 1
        if best[1] < values[0]:
            best = min(best, moved(-2.0), key=lambda found: found[1])
            used += 1
        elif best[1] >= values[-2]:
            best = min(best, moved(-0.5 if best[1] < values[-1] else 0.5), key=lambda f: f[1])
            used += 1
        if best[1] < values[-1]:
            corners[-1], values[-1] = best
        else:  # nothing helped: draw all corners towards the best
            corners[1:] = 0.5 * (corners[1:] + corners[0])
            values[1:] = [cost(c) for c in corners[1:]]
            used += values.size - 1
    low = int(np.argmin(values))
    return corners[low], float(values[low])
