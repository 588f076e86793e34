"""Kernels that learn from a platform's motion what its motors take up of their torque.

Of each motor: dry friction, and cogging of as many periods a turn as it has pole pairs. What they
take up is missing at the platform. With v = q̇_d - q̇ and M = M_p + m_r A, the platform under the
loop's force F and the motors' corrections u (n,), all low-passed by L(s) = ω/(s + ω), obeys

    L F + M ω (v - L v) + Σ J_i/g_i L u_i = Σ J_i/g_i L φ_i·w_i + c,  φ = (sign θ̇_d, sin pθ, cos pθ)

and a Kalman filter finds w (n, 3), Nm, from one of these d equations a cycle. u is all that was
added, whoever asked for it. c (d,) is a wrench that stays for seconds: a payload, errors of mass
and torque constants, a hand that pulls. It is far more uncertain than w, so that what does not
change its sign with the motion is taken for c, not for friction. w is bounded. The filter's states
x (m,), m = 3 n + d, are w, row by row, and c; beyond what motion tells they return to 0: ẋ = -x/T +
noise, of which without a measurement a standard deviation σ would come.

`filters` (4 n + 2 d,) are φ row by row, u, F and v, low-passed.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

TERMS = 3
PERIOD, POLE, REVERSAL, LATENCY, NOISE_N, SETTINGS = range(6)
"""Period, s; ω, rad/s; the motor's speed, rad/s, above which its friction has all of its sign; how
late a torque acts, s; standard deviation of one cycle's equation, N."""
SIGMA, FADING, STATE_ROWS = range(3)
"""Rows of `states` (2, m): σ and T of each."""
_SHARE = 0.95
_DECIDED = 0.5
_SIGMAS = 3.0


@jit
def write_learnt(
    settings: FloatArray,
    pole_pairs: FloatArray,
    most: FloatArray,
    x: FloatArray,
    theta: FloatArray,
    omega: FloatArray,
    terms: FloatArray,
    torque: FloatArray,
    reference: FloatArray,
) -> None:
    """Write φ into `terms` (n, 3), and the torques (n,) that make up for what was learnt.

    `reference` (n,) is the wanted speed of the motors, `most` (3, n) what friction, cogging, and
    both together are at most. A little of the friction is left: with too much of it made up for,
    the platform would run ahead.
    """
    for i in range(torque.size):
        angle = pole_pairs[i] * (theta[i] + settings[LATENCY] * omega[i])
        terms[i, 0] = min(max(reference[i] / settings[REVERSAL], -1.0), 1.0)
        terms[i, 1], terms[i, 2] = math.sin(angle), math.cos(angle)
        friction = _SHARE * x[TERMS * i]
        sine, cosine = x[TERMS * i + 1], x[TERMS * i + 2]
        size = math.sqrt(sine * sine + cosine * cosine)
        share = 1.0 if size <= most[1, i] else most[1, i] / size
        both = friction * terms[i, 0] + share * (sine * terms[i, 1] + cosine * terms[i, 2])
        torque[i] = min(max(both, -most[2, i]), most[2, i])


@jit
def learn(
    settings: FloatArray,
    states: FloatArray,
    scale: FloatArray,
    m_per_rad: FloatArray,
    J: FloatArray,
    M: FloatArray,
    v: FloatArray,
    force: FloatArray,
    terms: FloatArray,
    added: FloatArray,
    most: FloatArray,
    filters: FloatArray,
    x: FloatArray,
    P: FloatArray,
    scratch: FloatArray,
    direction: int,
    usable: bool,
) -> int:
    """Take in one cycle: `x` (m,) and their covariance `P` (m, m); return the next direction.

    `most` (3, n) bounds friction and cogging. Of M (d, d) the lower half counts. `usable` is
    whether the force was exerted. Where it was not, no motor has to turn, or neither friction nor
    cogging can be what is seen, nothing is learnt. `scratch` (2, m) is overwritten.
    """
    n, d = J.shape
    w = TERMS * n
    usable = _low_pass(settings, terms, added, force, v, filters, usable)
    _fade(settings, states, 0 if usable else w, x, P)
    if not usable:
        return direction
    h, Ph = scratch[0], scratch[1]
    measured = filters[w + n + direction]
    for k in range(d):
        accelerated = settings[POLE] * (v[k] - filters[w + n + d + k])
        measured += M[max(k, direction), min(k, direction)] * accelerated
    h[:] = 0.0
    for i in range(n):
        lever = J[i, direction] / m_per_rad[i]
        measured += lever * filters[w + i]
        for j in range(TERMS):
            h[TERMS * i + j] = lever * filters[TERMS * i + j]
    h[w + direction] = 1.0
    noise = settings[NOISE_N] * scale[direction]
    if _take_in(measured, noise * noise, h, Ph, x, P):
        for i in range(n):
            x[TERMS * i] = min(max(x[TERMS * i], 0.0), most[0, i])
            for j in range(1, TERMS):
                x[TERMS * i + j] = min(max(x[TERMS * i + j], -most[1, i]), most[1, i])
    following: int = (direction + 1) % d
    return following


@jit
def _take_in(
    y: float, S: float, h: FloatArray, Ph: FloatArray, x: FloatArray, P: FloatArray
) -> bool:
    """Correct `x` and `P` by a measurement y = h·x of variance `S`; return False for an outlier.

    `Ph` (m,) is overwritten.
    """
    innovation = y
    for i in range(x.size):
        Ph[i] = 0.0
        for k in range(x.size):
            Ph[i] += P[i, k] * h[k]
        S += h[i] * Ph[i]
        innovation -= h[i] * x[i]
    if not innovation * innovation < _SIGMAS * _SIGMAS * S:
        return False
    for i in range(x.size):
        x[i] += Ph[i] * innovation / S
        for k in range(x.size):
            P[i, k] -= Ph[i] * Ph[k] / S
    return True


@jit
def _low_pass(
    settings: FloatArray,
    terms: FloatArray,
    added: FloatArray,
    force: FloatArray,
    v: FloatArray,
    filters: FloatArray,
    usable: bool,
) -> bool:
    """Bring `filters` up to date, or begin anew; return whether a motor was wanted to turn."""
    n, d = added.size, v.size
    w = TERMS * n
    if not usable:
        filters[: w + n + d] = 0.0
        for k in range(d):
            filters[w + n + d + k] = v[k]
        return False
    share = settings[PERIOD] * settings[POLE] / (1.0 + settings[PERIOD] * settings[POLE])
    moving = False
    for i in range(n):
        for j in range(TERMS):
            filters[TERMS * i + j] += share * (terms[i, j] - filters[TERMS * i + j])
        filters[w + i] += share * (added[i] - filters[w + i])
        moving = moving or abs(filters[TERMS * i]) > _DECIDED
    for k in range(d):
        filters[w + n + k] += share * (force[k] - filters[w + n + k])
        filters[w + n + d + k] += share * (v[k] - filters[w + n + d + k])
    return moving


@jit
def _fade(
    settings: FloatArray, states: FloatArray, first: int, x: FloatArray, P: FloatArray
) -> None:
    """Let the states from `first` on return to 0 by one cycle, and their variances to σ²."""
    for i in range(first, x.size):
        keep = 1.0 - settings[PERIOD] / states[FADING, i]
        x[i] *= keep
        for k in range(x.size):
            P[i, k] *= keep
            P[k, i] *= keep
        P[i, i] += (1.0 - keep * keep) * states[SIGMA, i] ** 2
