"""Kernels that fit what a motor takes up to how it turned while its cable was pulled tight.

The platform stands at home, so that the length of a cable without tension, l, follows from its
tension alone. A tension a is asked for, and the angle θ is seen. With c of cable paid out per
radian, and e = -dl/dt, a motor that slides obeys, in Nm at the motor,

    y = c (l(a) - l(P) - c θ)/e = -(c²/e) θ_P + s c (a - P) + f sign θ̇ + A sin pθ + B cos pθ

with θ_P the angle at which the cable has the tension P, s by how much more the tension grows than
is asked for, f dry friction and (A, B) cogging. What is added up are the sums of squares and
products of this equation's factors and of y, `sums` (n, 6, 6), lower halves.

Friction has its direction only once a motor has slid for some way. `turned` (2, n) are the least
and the greatest angle of the way before that, as a play has them.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

UNKNOWNS = 5
ANGLE, STEEPER, FRICTION, SINE, COSINE = range(UNKNOWNS)
PRETENSION_N, M_PER_RAD, POLE_PAIRS, ORIGIN, MOTOR_ROWS = range(5)
"""Rows of `motors` (4, n): P, c, p, and the angle from which θ and θ_P are counted."""
PLAY_rad = 0.015
"""A motor has slid, and friction all of its size, once it has turned by so much."""


@jit
def take(
    motors: FloatArray,
    shares: FloatArray,
    lengths: FloatArray,
    turned: FloatArray,
    sums: FloatArray,
    slid: FloatArray,
    h: FloatArray,
    position: FloatArray,
    tension: FloatArray,
) -> None:
    """Take in the angles (n,) of a cycle at the tensions asked for (n,).

    `lengths` (2, m, n) are l - l(P) and e of each cable at m even `shares` of P. `slid` (2, n) is
    by how much each motor has slid this way and that, rad. An angle counts by how much it is
    farther than those before. `h` (6,) is overwritten.
    """
    step = shares[1] - shares[0]
    for i in range(position.size):
        theta = position[i] - motors[ORIGIN, i]
        side, way = _slides(turned, theta, i)
        at = (tension[i] / motors[PRETENSION_N, i] - shares[0]) / step
        if side == 0 or not 0.0 <= at < shares.size - 1:
            continue
        k = int(at)
        upper = at - k
        length = (1.0 - upper) * lengths[0, k, i] + upper * lengths[0, k + 1, i]
        e = (1.0 - upper) * lengths[1, k, i] + upper * lengths[1, k + 1, i]
        if e <= 0.0:  # cables that do not stretch tell nothing
            continue
        c, angle = motors[M_PER_RAD, i], motors[POLE_PAIRS, i] * position[i]
        h[ANGLE], h[STEEPER] = -c * c / e, c * (tension[i] - motors[PRETENSION_N, i])
        h[FRICTION], h[SINE], h[COSINE] = side, math.sin(angle), math.cos(angle)
        h[UNKNOWNS] = c * (length - c * theta) / e
        slid[0 if side > 0 else 1, i] += way
        for j in range(UNKNOWNS + 1):
            for m in range(j + 1):
                sums[i, j, m] += way * h[j] * h[m]


@jit
def _slides(turned: FloatArray, theta: float, i: int) -> tuple[int, float]:
    """Move the play of motor i along; return the direction in which it slides, 0 for none.

    And by how much it is farther than before.
    """
    side, way = 0, 0.0
    if theta > turned[1, i]:
        side, way = (1 if theta - turned[0, i] >= PLAY_rad else 0), theta - turned[1, i]
        turned[1, i] = theta
        turned[0, i] = max(turned[0, i], theta - PLAY_rad)
    elif theta < turned[0, i]:
        side, way = (-1 if turned[1, i] - theta >= PLAY_rad else 0), turned[0, i] - theta
        turned[0, i] = theta
        turned[1, i] = min(turned[1, i], theta + PLAY_rad)
    return side, way
