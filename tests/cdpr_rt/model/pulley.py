"""A cable over a swivel pulley that stands upright, by looking for where it leaves the pulley."""

from __future__ import annotations

import math

import numpy as np


def over_a_pulley(exit_m: np.ndarray, radius_m: float, point_m: np.ndarray) -> tuple[float, float]:
    """Return the length from exit point to point and the slope angle at which it ends there, rad.

    The cable comes up (last coordinate) at the exit point. Of 200000 places on the circle it leaves
    at the one where the rest is the straightest continuation.
    """
    way = np.asarray(point_m, float) - np.asarray(exit_m, float)
    end = np.array([math.hypot(*way[:-1]), way[-1]])
    wound = np.linspace(1e-3, 1.5 * math.pi, 200_001)
    leaves = radius_m * np.stack([1.0 - np.cos(wound), np.sin(wound)], axis=-1)
    along = np.stack([np.sin(wound), np.cos(wound)], axis=-1)
    rest = end - leaves
    size = np.linalg.norm(rest, axis=1)
    best = int(((rest * along).sum(axis=1) / size).argmax())
    return radius_m * float(wound[best]) + float(size[best]), math.atan2(
        rest[best, 1], rest[best, 0]
    )
