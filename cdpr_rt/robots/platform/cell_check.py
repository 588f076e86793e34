"""Comparison of load cells with motors and with the platform's balance of forces.

At a tension t a cell shows z = t + e, and its motor is asked for τ = t + m. If cell i alone is off,
by a, then of the differences and of the balance of forces

    z - τ = a 1_i - m,    W z + w = a W_i + ε

What m usually is, friction and cogging left over and an error of the torque constant, and ε, errors
of mass and geometry and a payload, is known as standard deviations. So a is the weighted mean of
all that tells it, and known to σ_a. What no motor contradicts is a force from outside, as of a hand
that pulls, and no cell. Both sides are low-passed: no motion takes part in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound, jit

MOTOR_SHARE, CONSTANT_SHARE = 0.03, 0.05
"""σ of m: of the motor's rated tension, and of the tension."""
BALANCE_SHARE, ACROSS_SHARE, WEIGHT_SHARE = 0.02, 0.1, 0.5
"""σ of ε, in N: of all tensions' norm; of the weight, across it, and along it and for moments."""
SIGMAS = 4.0
"""From how many σ_a on a cell is named."""
_OWN_SHARE = 0.5
"""Of a, what a cell has to differ from its own motor by."""
_LOWPASS_S, _SETTLING_S = 1.5, 4.0


def balance_std_N(weight_N: float, up: int, scale: FloatArray) -> FloatArray:
    """Return what mass and payload leave of σ of ε, (d,), where direction `up` is vertical.

    `scale` (d,) is how far a unit of each direction counts, the first ones being positions.
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
    """Take in one cycle; return which cell is off the furthest, -1 where none is told apart.

    A cell at a winch shows `rise` (n,) more than z, which is in the middle of its cable as t is.
    `asked` (n,) are the tensions asked for, as late as readings are, `correction` (n,) what is
    added to them. Of `found` (2, n), written, are a and SIGMAS σ_a of each cell; `difference` (n,)
    and `balance` (d,) are z - τ and W z + w, low-passed.
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
    """Names a load cell that is off, once it is; see above."""

    def __init__(
        self,
        names: Sequence[str],
        rated_N: FloatArray,
        std_N: FloatArray,
        scale: FloatArray,
        period_s: float,
    ) -> None:
        """Take the cables' names, and what tensions their motors are rated for (n,).

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
        """Fix the arrays of readings, tensions asked for, and of the platform; see `compare`."""
        self._compare = bound(
            compare, self._period_s, self._rated_N, self._std_N, self._scale, measured_N,
            measured, rise_N, asked_N, correction_N, W, wrench, self._difference, self._balance,
            self._found,
        )  # fmt: skip

    def restart(self) -> None:
        """Begin anew, as after cycles without control; what has been told stays."""
        self._difference[:] = self._balance[:] = 0.0
        self._settling = self._cycles

    def update(self) -> None:
        """Take in one cycle with readings."""
        worst = self._compare()
        if self._settling:
            self._settling -= 1
        elif worst >= 0 and self._named in (-1, worst):
            off_N, allowed_N = self._found[:, worst]
            if abs(off_N) > abs(self._off_N):
                self._named, self._off_N, self._allowed_N = worst, float(off_N), float(allowed_N)

    @property
    def trouble(self) -> str:
        """Which cell is off and by how much at most, an empty text for none; until `clear`."""
        if self._named < 0:
            return ""
        return (
            f"{self._names[self._named]}: its load cell shows {abs(self._off_N):.0f} N "
            f"{'more' if self._off_N > 0.0 else 'less'} than its motor and the balance of forces "
            f"have it, {self._allowed_N:.0f} N may be: tare it, and look at its gain and wiring"
        )

    def clear(self) -> None:
        """Forget which cell was off."""
        self._named, self._off_N = -1, 0.0
