"""Detection of oscillations of the platform's loop.

If damping, stiffness, mass or delays in files are wrong, a loop designed to be stable may make the
winches oscillate as long as they have power. The commands are bounded, so often no limit is
exceeded, but the true tensions are not bounded. The oscillation is detected from the motors'
angles, which have hardly any noise. In motion cogging also excites the winches, so thresholds are
higher.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound, jit

AT_REST, ALWAYS = 0, 1
"""The two cases of detection: while the set-point rests, and at any time."""
RESERVE_SHARES, LEAST_COUNTS = (0.5, 1.5), 4.0
"""Smallest amplitude of an oscillation, in each case: the motion that changes the cable's tension
by this share of the reserve while the platform stands still, but at least this number of encoder
counts."""
LEAST_Hz, LASTS_S = 5.0, (3.0, 1.0)
"""Lowest frequency, and shortest duration without a pause in each case, so that ringing after a
motion is not reported."""
MEAN, SIDE, SINCE, CHANGES, LASTING, ROWS = range(6)
"""Rows of each motor: mean distance from its set-point, rad; last side of that mean, ±1; time since
the last change of sides, s; number of changes since the oscillation began, and its duration, s."""


@jit
def swinging(
    period_s: float,
    lasts_s: tuple[float, float],
    threshold_rad: FloatArray,
    position_rad: FloatArray,
    velocity: FloatArray,
    rows: FloatArray,
    setpoint_rad: FloatArray,
) -> tuple[int, int]:
    """Process one cycle; return the case and the motor with the largest oscillation, -1 for none.

    `position_rad` and `setpoint_rad` are (n,), `velocity` (d,) is the set-point's. `threshold_rad`
    (2, n) and `rows` (2, ROWS, n), kept from cycle to cycle, are those of each case.
    """
    share = LEAST_Hz * period_s / (1.0 + LEAST_Hz * period_s)
    case, found, most, moves = ALWAYS, -1, 0.0, False
    for k in range(velocity.size):
        moves = moves or velocity[k] != 0.0
    for j in range(2):
        for i in range(position_rad.size):
            off = position_rad[i] - setpoint_rad[i]
            if moves and j == AT_REST:
                rows[j, :, i] = 0.0
                rows[j, MEAN, i] = off
                continue
            rows[j, MEAN, i] += share * (off - rows[j, MEAN, i])
            off = (off - rows[j, MEAN, i]) / threshold_rad[j, i]
            rows[j, SINCE, i] += period_s
            rows[j, LASTING, i] += period_s
            if rows[j, SINCE, i] > 0.5 / LEAST_Hz:
                rows[j, SIDE, i] = rows[j, CHANGES, i] = rows[j, LASTING, i] = 0.0
            if abs(off) > 1.0 and off * rows[j, SIDE, i] <= 0.0:
                rows[j, SIDE, i] = math.copysign(1.0, off)
                rows[j, SINCE, i] = 0.0
                rows[j, CHANGES, i] += 1.0
            if rows[j, LASTING, i] >= lasts_s[j] and abs(off) > most:
                case, found, most = j, i, abs(off)
    return case, found


class Oscillation:
    """Reports that the loop oscillates; see above."""

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

        `threshold_m` (2, n) are the amplitudes at rest and at any time, in metres of cable;
        `m_per_rad` (n,) is the cable that a rad of the motor winds.
        """
        self._names, self._threshold_m = tuple(names), threshold_m
        self._rows = np.zeros((2, ROWS, len(names)))
        threshold_rad = threshold_m / np.abs(m_per_rad)
        self._swinging = bound(
            swinging, period_s, LASTS_S, threshold_rad, position_rad, velocity, self._rows,
            then=(position_rad,),
        )  # fmt: skip
        self._found: tuple[int, int, float] | None = None

    def update(self, setpoint_rad: FloatArray) -> None:
        """Process one cycle with the motors' set-points (n,)."""
        case, found = self._swinging(setpoint_rad)
        if found >= 0 and self._found is None:
            changes, lasting_s = self._rows[case, [CHANGES, LASTING], found]
            self._found = case, found, 0.5 * float(changes / lasting_s)

    @property
    def trouble(self) -> str:
        """Text on the winch that oscillates, or ""; until `clear`."""
        if self._found is None:
            return ""
        case, i, frequency_Hz = self._found
        return (
            f"{self._names[i]}: the control loop oscillates at this winch: for "
            f"{LASTS_S[case]:g} s at {frequency_Hz:.0f} Hz by more than "
            f"{1e3 * self._threshold_m[case, i]:.2f} mm of cable to either side, and "
            "tensions may leave their bounds: switch the power off, and check stiffness "
            "and damping of the cables, the mass of the platform and the delays of the "
            "drives in their files"
        )

    def clear(self) -> None:
        """Clear the result."""
        self._found = None
        self._rows[:] = 0.0
