"""Feedback of measured tensions: corrections of the motors' torques.

A cable's tension is t = a - d + b: the commanded tension a, minus the loss d due to friction,
cogging and errors of torque constants, plus the correction b of this feedback. With ḃ = k (a - t),
t becomes a - d s/(s + k) for every a that the loop commands. So feedback and loop do not disturb
each other. a is low-passed like the reading.

A cell may send wrong readings. So b may only use a part of the reserve between planned tensions and
their bounds: the part that the loop's force leaves. Then a + b is within the bounds for every
reading. The learnt torques may be wrong too, so b together with them stays within a maximum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound, jit
from cdpr_rt.model.tension_split import FAST
from cdpr_rt.platform.motor_learning import MOST_RESERVE_SHARE

# Comparison of load cells with motors and with the platform's balance of forces. At a tension t a
# cell shows z = t + e, and its motor is commanded τ = t + m. If only cell i is wrong, by a, then
# the differences are z - τ = a 1_i - m, and the balance of forces is W z + w = a W_i + ε. m is due
# to uncompensated friction and cogging and errors of the torque constant, ε to errors of mass and
# geometry and a payload. Their usual standard deviations are known. So a is the weighted mean of
# all data, with the standard deviation σ_a. If no motor contradicts the cells, the cause is an
# external force, such as a hand that pulls, and no cell. Both sides are low-passed, so motion has
# no effect.

MOTOR_SHARE, CONSTANT_SHARE = 0.03, 0.05
"""σ of m, as shares of the motor's rated tension and of the tension."""
BALANCE_SHARE, ACROSS_SHARE, WEIGHT_SHARE = 0.02, 0.1, 0.5
"""σ of ε, in N: as a share of the norm of all tensions; as a share of the weight, horizontally; the
same vertically and for moments."""
SIGMAS = 4.0
"""A cell is reported if its error exceeds this number of σ_a."""
_OWN_SHARE = 0.5
"""Share of the error a by which the cell must differ from its own motor."""
_LOWPASS_S, _SETTLING_S = 1.5, 4.0


def balance_std_N(weight_N: float, up: int, scale: FloatArray) -> FloatArray:
    """Return the part of σ of ε due to mass and payload, (d,); direction `up` is vertical.

    `scale` (d,) is the length that corresponds to a unit of each direction; positions come first.
    """
    std_N = WEIGHT_SHARE * weight_N * scale
    std_N[:up] = ACROSS_SHARE * weight_N
    return std_N


@jit
def compare(
    period_s: float,
    rated_N: FloatArray,
    std_N: FloatArray,
    scale: FloatArray,
    measured_N: FloatArray,
    measured: BoolArray,
    rise: FloatArray,
    asked: FloatArray,
    correction: FloatArray,
    W: FloatArray,
    wrench: FloatArray,
    difference: FloatArray,
    balance: FloatArray,
    found: FloatArray,
) -> int:
    """Process one cycle; return the cell with the largest error, -1 if none can be identified.

    A cell at a winch shows `rise` (n,) more than z, because z and t apply to the middle of the
    cable. `asked` (n,) are the commanded tensions, delayed like the readings. `correction` (n,) is
    added to them. The rows of `found` (2, n) are written: a and SIGMAS σ_a of each cell.
    `difference` (n,) and `balance` (d,) are z - τ and W z + w, low-passed.
    """
    d, n = W.shape
    share, square, whole = period_s / (_LOWPASS_S + period_s), 0.0, True
    for i in range(n):
        if measured[i]:
            off = measured_N[i] - rise[i] - asked[i] - correction[i]
            difference[i] += share * (off - difference[i])
            square += (measured_N[i] - rise[i]) ** 2
        else:
            whole, difference[i] = False, 0.0
    for k in range(d):
        off = wrench[k]
        for i in range(n):
            off += W[k, i] * (measured_N[i] - rise[i])
        balance[k] = balance[k] + share * (off - balance[k]) if whole else 0.0
    worst, most = -1, 1.0
    for i in range(n):
        of_motor = (MOTOR_SHARE * rated_N[i]) ** 2 + (CONSTANT_SHARE * asked[i]) ** 2
        off, weight = difference[i] / of_motor, 1.0 / of_motor
        if whole:
            for k in range(d):
                of_direction = (BALANCE_SHARE * scale[k]) ** 2 * square + std_N[k] ** 2
                off += W[k, i] * balance[k] / of_direction
                weight += W[k, i] ** 2 / of_direction
        found[0, i], found[1, i] = off / weight, SIGMAS / math.sqrt(weight)
        much = abs(found[0, i]) / found[1, i]
        own = abs(difference[i]) > _OWN_SHARE * abs(found[0, i])
        if measured[i] and own and much > most:
            worst, most = i, much
    return worst


class CellCheck:
    """Reports a load cell with wrong readings; see above."""

    def __init__(
        self,
        names: Sequence[str],
        rated_N: FloatArray,
        std_N: FloatArray,
        scale: FloatArray,
        period_s: float,
    ) -> None:
        """Take the cables' names, and the rated tensions of their motors (n,).

        `std_N` (d,) is that of `balance_std_N`, for the same `scale`.
        """
        self._names, self._rated_N = tuple(names), rated_N
        self._std_N, self._scale, self._period_s = std_N, scale, period_s
        self._named, self._off_N, self._allowed_N = -1, 0.0, 0.0
        self._difference, self._balance = np.zeros(len(names)), np.zeros(scale.size)
        self._found = np.zeros((2, len(names)))
        self._settling = self._cycles = round(_SETTLING_S / period_s)

    def bind(
        self,
        measured_N: FloatArray,
        measured: BoolArray,
        rise_N: FloatArray,
        asked_N: FloatArray,
        correction_N: FloatArray,
        W: FloatArray,
        wrench: FloatArray,
    ) -> None:
        """Bind the arrays of readings, commanded tensions, and of the platform; see `compare`."""
        self._compare = bound(
            compare, self._period_s, self._rated_N, self._std_N, self._scale, measured_N,
            measured, rise_N, asked_N, correction_N, W, wrench, self._difference, self._balance,
            self._found,
        )  # fmt: skip

    def restart(self) -> None:
        """Begin again, for example after cycles without control; the result stays."""
        self._difference[:] = self._balance[:] = 0.0
        self._settling = self._cycles

    def update(self) -> None:
        """Process one cycle with readings."""
        worst = self._compare()
        if self._settling:
            self._settling -= 1
        elif worst >= 0 and self._named in (-1, worst):
            off_N, allowed_N = self._found[:, worst]
            if abs(off_N) > abs(self._off_N):
                self._named, self._off_N, self._allowed_N = worst, float(off_N), float(allowed_N)

    @property
    def trouble(self) -> str:
        """Text on the wrong cell and its largest error, or ""; until `clear`."""
        if self._named < 0:
            return ""
        return (
            f"{self._names[self._named]}: its load cell shows {abs(self._off_N):.0f} N "
            f"{'more' if self._off_N > 0.0 else 'less'} than its motor and the balance of forces "
            f"give, {self._allowed_N:.0f} N allowed: tare it, and check its gain and wiring"
        )

    def clear(self) -> None:
        """Clear the result."""
        self._named, self._off_N = -1, 0.0


RATE_1_s = 2.0
"""k, much slower than amplifier filters and the age of readings, together about 0.1 s."""
LAG_S, FALL_BACK_S = 0.07, 1.0
SHARE, TOGETHER_SHARE = 1.0 - FAST, 2.0 * MOST_RESERVE_SHARE
"""Shares of the reserve that limit the correction, and the correction plus the learnt part."""


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
    """Update corrections (n,), N, by a cycle, and write their torques (n,), Nm.

    Corrections stay within a share of the reserve, and return to 0 while there is no reading.
    Corrections plus `learnt` torques (n,) stay within a larger share. The corrections that remain
    are written to `applied` (n,), N. Cells are at the winches; tensions there exceed the commanded
    ones, in the middle of the cables, by `rise` (n,). Returns whether there is any reading.
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
        """Take the arrays of readings (n,) and of their validity, which other parts write.

        `reserve_N` is the reserve of planned tensions to their bounds. W (d, n) and `wrench` (d,),
        without that of the cables, belong to the cycle; `check` compares the readings with them.
        `learnt_Nm` (n,) is added for learnt losses of the motors, `rise_N` (n,) is the excess of
        tensions at the winches over those in the middle of their cables.
        """
        n = m_per_rad.size
        self.torque_Nm = np.zeros(n)
        """Torque added by the correction, (n,)."""
        self._lagging, self._correction, applied = np.zeros((3, n))
        self._follow = bound(
            follow, period_s, reserve_N, measured_N, measured, rise_N, m_per_rad, learnt_Nm,
            self._lagging, self._correction, self.torque_Nm, applied, then=(np.zeros(n),),
        )  # fmt: skip
        self.check = check
        check.bind(measured_N, measured, rise_N, self._lagging, applied, W, wrench)

    def restart(self, asked_N: FloatArray) -> None:
        """Begin again, with the commanded tensions (n,)."""
        self._lagging[:] = asked_N
        self._correction[:] = self.torque_Nm[:] = 0.0
        self.check.restart()

    def update(self, asked_N: FloatArray) -> None:
        """Update `torque_Nm` by the tensions commanded in the last cycle, (n,)."""
        if self._follow(asked_N):
            self.check.update()
