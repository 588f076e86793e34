"""Whether the platform's loop oscillates by itself.

A loop that works uses the reserve between planned tensions and their bounds for friction and
errors, which change slowly. One that is not stable, as its cables damp less than they were taken
to, its platform weighs otherwise, or answers come later, asks a cable for much more and for much
less in turn, for as long as it has power. What it asks for is bounded; what cables truly pull with
is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound, jit

RESERVE_SHARE = 0.5
"""Of the reserve, how far from their mean tensions have to go to either side."""
LEAST_Hz, LASTS_S = 5.0, 1.0
"""From which frequency on, and for how long without a pause, they have to alternate."""
MEAN, SIDE, SINCE, CHANGES, LASTING, ROWS = range(6)
"""Of each cable: mean of what the loop asks for, N; the side on which it was last, ±1; how long
ago it changed sides, s; how often it has since it alternates, and for how long that is, s."""


@jit
def alternating(
    period_s: float,
    threshold_N: float,
    tension: FloatArray,
    feedforward: FloatArray,
    rows: FloatArray,
) -> int:
    """Take in one cycle; return which cable's tension alternates, -1 for none.

    What the loop asks for are the tensions (n,) beyond those that carry the platform. `rows`
    (ROWS, n) are kept from cycle to cycle.
    """
    found, share = -1, LEAST_Hz * period_s / (1.0 + LEAST_Hz * period_s)
    for i in range(tension.size):
        asked_N = tension[i] - feedforward[i]
        rows[MEAN, i] += share * (asked_N - rows[MEAN, i])
        off_N = asked_N - rows[MEAN, i]
        rows[SINCE, i] += period_s
        rows[LASTING, i] += period_s
        if rows[SINCE, i] > 0.5 / LEAST_Hz:
            rows[SIDE, i] = rows[CHANGES, i] = rows[LASTING, i] = 0.0
        if abs(off_N) > threshold_N and off_N * rows[SIDE, i] <= 0.0:
            rows[SIDE, i] = 1.0 if off_N > 0.0 else -1.0
            rows[SINCE, i] = 0.0
            rows[CHANGES, i] += 1.0
        if rows[LASTING, i] >= LASTS_S:
            found = i
    return found


class Oscillation:
    """Tells that the loop oscillates, once it does; see above."""

    def __init__(
        self,
        names: Sequence[str],
        reserve_N: float,
        tension_N: FloatArray,
        feedforward_N: FloatArray,
        period_s: float,
    ) -> None:
        """Take the cables' names, and the arrays of tensions (n,) that others write."""
        self._names, self._threshold_N = tuple(names), RESERVE_SHARE * reserve_N
        self._rows = np.zeros((ROWS, len(names)))
        self._named, self._frequency_Hz = -1, 0.0
        self._alternating = bound(
            alternating, period_s, self._threshold_N, tension_N, feedforward_N, self._rows
        )

    def update(self) -> None:
        """Take in one cycle."""
        found = self._alternating()
        if found >= 0 and self._named < 0:
            self._named = found
            changes, lasting_s = self._rows[CHANGES, found], self._rows[LASTING, found]
            self._frequency_Hz = 0.5 * float(changes / lasting_s)

    @property
    def trouble(self) -> str:
        """Which cable's tension alternates and how, an empty text for none; until `clear`."""
        if self._named < 0:
            return ""
        return (
            f"the platform's loop oscillates by itself, at {self._frequency_Hz:.0f} Hz: for "
            f"{LASTS_S:g} s it has asked {self._names[self._named]} for {self._threshold_N:.0f} N "
            "more and less than on average, and true tensions may leave their bounds: take the "
            "power; do cables stretch and damp, platform weigh and drives answer as files say?"
        )

    def clear(self) -> None:
        """Forget that it did."""
        self._named = -1
        self._rows[:] = 0.0
