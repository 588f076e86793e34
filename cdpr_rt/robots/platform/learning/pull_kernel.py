"""Kernels that fit what a motor takes up to how it turned while its cable was pulled tight.

The platform stands at home, so that the length of a cable without tension, l, follows from its
tension alone. A tension a is asked for, and the angle θ is seen. With c of cable paid out per
radian, and e = -dl/dt, a motor that slides obeys, in Nm at the motor,

    y = c (l(a) - l(P) - c θ)/e = -(c²/e) θ_P + s c (a - P) + f sign θ̇ + A sin pθ + B cos pθ

with θ_P the angle at which the cable has the tension P, s by how much more the tension grows than
is asked for, f dry friction and (A, B) cogging. Where the platform slides on its stand while it is
pulled harder than before, which makes the cable longer by m(a) λ, with m going from 0 at P to 1 at
the most that is pulled, -(c/e) m λ is to be added. What is added up are the sums of squares and
products of this equation's factors and of y, `sums` (n, 7, 7), lower halves.

Friction turns round with the direction, over the way in which a contact yields before it slides: in
place of sign θ̇ stands z in -1 to 1, dz/dθ = (1 - z sign θ̇)/δ (Dahl, 1968). What an encoder shows to
and fro is no motion: `seen` (2, n) are the least and the greatest angle, as a play has them.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

UNKNOWNS = 5
ANGLE, STEEPER, FRICTION, SINE, COSINE = range(UNKNOWNS)
"""Of each motor; of the cable besides what the platform slides by, and what is measured, y."""
SLID, MEASURED, FACTORS = range(UNKNOWNS, UNKNOWNS + 3)
PRETENSION_N, M_PER_RAD, POLE_PAIRS, ORIGIN, PLAY, MOST_SHARE, MOTOR_ROWS = range(7)
"""Rows of `motors` (6, n): P, c, p, the angle from which θ and θ_P are counted, the play, rad, and
the most that has been asked for, over P."""
HARDEST_SHARE = 1.5
"""What is pulled at most, over P."""
YIELD_rad = 0.006
"""δ: what there is in motors of 1 to 4 Nm; twice or half of it finds much the same."""


@jit
def take(
    motors: FloatArray,
    shares: FloatArray,
    lengths: FloatArray,
    seen: FloatArray,
    yielding: FloatArray,
    turned: FloatArray,
    sums: FloatArray,
    h: FloatArray,
    position: FloatArray,
    tension: FloatArray,
) -> None:
    """Take in the angles (n,) of a cycle at the tensions asked for (n,).

    `lengths` (2, m, n) are l - l(P) and e of each cable at m even `shares` of P. `yielding`
    (n,) are z, `turned` (2, n) by how much each motor has turned this way and that, rad. An angle
    counts by how much it is farther than those before. `h` (7,) is overwritten.
    """
    step = shares[1] - shares[0]
    for i in range(position.size):
        share = tension[i] / motors[PRETENSION_N, i]
        motors[MOST_SHARE, i] = max(motors[MOST_SHARE, i], share)
        theta = position[i] - motors[ORIGIN, i]
        way = _farther(motors[PLAY, i], seen, theta, i)
        side = math.copysign(1.0, way)
        way = abs(way)
        z = yielding[i] + way / YIELD_rad * (side - yielding[i])
        yielding[i] = min(max(z, -1.0), 1.0)
        at = (share - shares[0]) / step
        if way == 0.0 or not 0.0 <= at < shares.size - 1:
            continue
        k = int(at)
        upper = at - k
        length = (1.0 - upper) * lengths[0, k, i] + upper * lengths[0, k + 1, i]
        e = (1.0 - upper) * lengths[1, k, i] + upper * lengths[1, k + 1, i]
        if e <= 0.0:  # cables that do not stretch tell nothing
            continue
        c, angle = motors[M_PER_RAD, i], motors[POLE_PAIRS, i] * position[i]
        h[ANGLE], h[STEEPER] = -c * c / e, c * (tension[i] - motors[PRETENSION_N, i])
        h[FRICTION], h[SINE], h[COSINE] = yielding[i], math.sin(angle), math.cos(angle)
        harder = (motors[MOST_SHARE, i] - 1.0) / (HARDEST_SHARE - 1.0)
        h[SLID] = -c / e * min(max(harder, 0.0), 1.0)
        h[MEASURED] = c * (length - c * theta) / e
        turned[0 if side > 0.0 else 1, i] += way
        for j in range(FACTORS):
            for m in range(j + 1):
                sums[i, j, m] += way * h[j] * h[m]


@jit
def _farther(play: float, seen: FloatArray, theta: float, i: int) -> float:
    """Move the play of motor i along; return by how much it is farther than before, signed."""
    way = 0.0
    if theta > seen[1, i]:
        way = theta - seen[1, i]
        seen[1, i], seen[0, i] = theta, max(seen[0, i], theta - play)
    elif theta < seen[0, i]:
        way = theta - seen[0, i]
        seen[0, i], seen[1, i] = theta, min(seen[1, i], theta + play)
    return way
