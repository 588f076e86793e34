"""Feedback of measured tensions: what the motors give beyond what their torque constants say.

A cable's tension t is what the loop asks for, a, less what friction and cogging take up and torque
constants are off, d, plus a correction b of this feedback: t = a - d + b. With ḃ = k (a - t), t
becomes a - d s/(s + k), whatever the loop does with a: it neither disturbs the loop nor is it
disturbed. a is low-passed as the reading is.

A cell may lie without being silent. What the loop's force leaves of the reserve between planned
tensions and their bounds is all that b may take: whatever a cell says, a + b is within the bounds.
What is learnt of the motors may be wrong as well: with it, b stays within what that may be at most.
"""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound, jit
from cdpr_rt.robots.platform.cell_check import CellCheck
from cdpr_rt.robots.platform.learning.motor_learning import MOST_RESERVE_SHARE
from cdpr_rt.robots.tension.tension_split import FAST

RATE_1_s = 2.0
"""k: slower by far than amplifiers filter and readings are old, some 0.1 s together."""
LAG_S, FALL_BACK_S = 0.07, 1.0
SHARE, TOGETHER_SHARE = 1.0 - FAST, 2.0 * MOST_RESERVE_SHARE
"""Of the reserve, up to which tensions are corrected, and shifted by that and what is learnt."""


@jit
def follow(
    period_s: float,
    reserve_N: float,
    measured_N: FloatArray,
    measured: BoolArray,
    rise: FloatArray,
    m_per_rad: FloatArray,
    learnt: FloatArray,
    lagging: FloatArray,
    correction: FloatArray,
    torque: FloatArray,
    applied: FloatArray,
    asked: FloatArray,
) -> bool:
    """Bring corrections (n,), N, up to date with a cycle, and write their torques (n,), Nm.

    They stay within a share of the reserve, and return to 0 while there is no reading; the torques
    together with those that were `learnt` (n,) within a larger one. What that leaves of the
    corrections is `applied` (n,), N, written. Cells sit at the winches, where tensions are by
    `rise` (n,) above those asked for, which are those in the middle of the cables. Returns whether
    there is any reading.
    """
    read, most_N = False, SHARE * reserve_N
    for i in range(asked.size):
        lagging[i] += period_s / (LAG_S + period_s) * (asked[i] - lagging[i])
        read = read or measured[i]
        if measured[i]:
            correction[i] += RATE_1_s * period_s * (lagging[i] + rise[i] - measured_N[i])
            correction[i] = min(max(correction[i], -most_N), most_N)
        else:
            correction[i] -= period_s / FALL_BACK_S * correction[i]
        together = TOGETHER_SHARE * reserve_N * abs(m_per_rad[i])
        both = learnt[i] - m_per_rad[i] * correction[i]
        torque[i] = min(max(both, -together), together) - learnt[i]
        applied[i] = -torque[i] / m_per_rad[i]
    return read


class CellFeedback:
    """Corrects the torques of n motors by the tensions that load cells measure; see above."""

    def __init__(
        self,
        measured_N: FloatArray,
        measured: BoolArray,
        m_per_rad: FloatArray,
        reserve_N: float,
        period_s: float,
        check: CellCheck,
        W: FloatArray,
        wrench: FloatArray,
        learnt_Nm: FloatArray,
        rise_N: FloatArray,
    ) -> None:
        """Take the arrays of readings (n,), which are written elsewhere, and whether they hold.

        `reserve_N` is what planned tensions keep from their bounds. W (d, n) and the `wrench` (d,)
        besides the cables' are those of the cycle, by which `check` holds the readings; `learnt_Nm`
        (n,) is what is added besides for what was learnt of the motors, `rise_N` (n,) by what
        tensions at the winches are above those in the middle of their cables.
        """
        n = m_per_rad.size
        self.torque_Nm = np.zeros(n)
        """What is added for it, (n,)."""
        self._lagging, self._correction, applied = np.zeros((3, n))
        self._follow = bound(
            follow, period_s, reserve_N, measured_N, measured, rise_N, m_per_rad, learnt_Nm,
            self._lagging, self._correction, self.torque_Nm, applied, then=(np.zeros(n),),
        )  # fmt: skip
        self.check = check
        check.bind(measured_N, measured, rise_N, self._lagging, applied, W, wrench)

    def restart(self, asked_N: FloatArray) -> None:
        """Begin anew, with tensions asked for (n,)."""
        self._lagging[:] = asked_N
        self._correction[:] = self.torque_Nm[:] = 0.0
        self.check.restart()

    def update(self, asked_N: FloatArray) -> None:
        """Bring `torque_Nm` up to date with the tensions asked for in the last cycle, (n,)."""
        if self._follow(asked_N):
            self.check.update()
