"""Whether the platform's loop oscillates by itself at rest.

Where files have damping, stiffness, mass or delays wrong, a loop that was designed to be stable may
swing its winches to and fro for as long as it has power. What it asks for is bounded, so that
nothing trips; what the cables truly pull with is not. It is told from the motors' angles, which
noise and cogging do not move, and only while the set-point rests: in motion they may be driven.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound, jit

RESERVE_SHARE, LEAST_COUNTS = 0.5, 4.0
"""How far a winch has to swing to either side of its mean: what changes its cable's tension by this
share of the reserve, where the platform stands still, and no less than so many counts."""
LEAST_Hz, LASTS_S = 5.0, 3.0
"""From which frequency on, and for how long without a pause: what rings out is none."""
MEAN, SIDE, SINCE, CHANGES, LASTING, ROWS = range(6)
"""Of each motor: mean angle, rad; the side on which it was last, ±1; how long ago it changed sides,
s; how often it has since it swings, and for how long that is, s."""


@jit
def swinging(
    period_s: float,
    threshold_rad: FloatArray,
    position_rad: FloatArray,
    velocity: FloatArray,
    rows: FloatArray,
) -> int:
    """Take in one cycle; return which motor swings the furthest of those that do, -1 for none.

    `threshold_rad` and `position_rad` are (n,), `velocity` (d,) is the set-point's. `rows`
    (ROWS, n) are kept from cycle to cycle.
    """
    found, most, share = -1, 0.0, LEAST_Hz * period_s / (1.0 + LEAST_Hz * period_s)
    moves = False
    for k in range(velocity.size):
        moves = moves or velocity[k] != 0.0
    for i in range(position_rad.size):
        if moves:
            rows[MEAN, i] = position_rad[i]
            rows[SIDE, i] = rows[SINCE, i] = rows[CHANGES, i] = rows[LASTING, i] = 0.0
            continue
        rows[MEAN, i] += share * (position_rad[i] - rows[MEAN, i])
        off = (position_rad[i] - rows[MEAN, i]) / threshold_rad[i]
        rows[SINCE, i] += period_s
        rows[LASTING, i] += period_s
        if rows[SINCE, i] > 0.5 / LEAST_Hz:
            rows[SIDE, i] = rows[CHANGES, i] = rows[LASTING, i] = 0.0
        if abs(off) > 1.0 and off * rows[SIDE, i] <= 0.0:
            rows[SIDE, i] = math.copysign(1.0, off)
            rows[SINCE, i] = 0.0
            rows[CHANGES, i] += 1.0
        if rows[LASTING, i] >= LASTS_S and abs(off) > most:
            found, most = i, abs(off)
    return found


class Oscillation:
    """Tells that the loop oscillates, once it does; see above."""

    def __init__(
        self,
        names: Sequence[str],
        threshold_m: FloatArray,
        m_per_rad: FloatArray,
        position_rad: FloatArray,
        velocity: FloatArray,
        period_s: float,
    ) -> None:
        """Take the cables' names, and the arrays of angles (n,) and of the set-point's velocity.

        `threshold_m` (n,) is how far each has to swing, in metres of its cable, of which a rad of
        the motor winds `m_per_rad` (n,).
        """
        self._names, self._threshold_m = tuple(names), threshold_m
        self._rows = np.zeros((ROWS, len(names)))
        self._named, self._frequency_Hz = -1, 0.0
        threshold_rad = threshold_m / np.abs(m_per_rad)
        self._swinging = bound(
            swinging, period_s, threshold_rad, position_rad, velocity, self._rows
        )

    def update(self) -> None:
        """Take in one cycle."""
        found = self._swinging()
        if found >= 0 and self._named < 0:
            self._named = found
            changes, lasting_s = self._rows[CHANGES, found], self._rows[LASTING, found]
            self._frequency_Hz = 0.5 * float(changes / lasting_s)

    @property
    def trouble(self) -> str:
        """Which winch swings and how, an empty text for none; until `clear`."""
        if self._named < 0:
            return ""
        return (
            f"{self._names[self._named]}: the platform's loop swings this winch by itself, for "
            f"{LASTS_S:g} s at {self._frequency_Hz:.0f} Hz by more than "
            f"{1e3 * self._threshold_m[self._named]:.2f} mm of cable to either side, and tensions "
            "may leave their bounds: take the power; do cables stretch and damp, the platform "
            "weigh and drives answer as their files say?"
        )

    def clear(self) -> None:
        """Forget that it did."""
        self._named = -1
        self._rows[:] = 0.0
