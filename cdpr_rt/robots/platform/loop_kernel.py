"""Kernels of one cycle of a platform's control: set-point shaping, force, torques.

Arrays besides those of the kinematics' kernels: a loop's row of SETTINGS, and its STATE: the
integral part (d,), N and Nm; behind it how much it is AWAKE, 0 to 1; and the twist (d,), low-passed
until an encoder's counts are no speed any more.
"""

from __future__ import annotations

import math

from cdpr_rt.core.exchange import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.platform.body_kernel import write_mass_matrix, write_wrench

_STRETCH_SHARE = 0.2
_PLAUSIBLE_m_s = 0.15
_CALMING_S = 0.02
PERIOD, BANDWIDTH, DAMPING, RATIO, INTEGRAL, LOOSE, ROTOR = range(7)
REGULATOR_N, MOST_N, BREAKING, STUCK, DEAD, SETTINGS = range(7, 13)
"""Period, s; the loop's bandwidth, rad/s, and damping, N s/m of a cable; damping ratio; rate of the
integral part, 1/s; damping of cables against each other, N s/m; mass of a rotor, kg, as its cable
feels it; the most that the proportional and the integral part ask for, N; by how much faster what
sticks is integrated, the speed, m/s, below which it does, and the error, m, around which the
integral part fades out and in."""


@jit
def shape(past: FloatArray, place: int, wanted: FloatArray, shaped: FloatArray) -> int:
    """Average the set-point over the last cycles, so that its acceleration does not step.

    `past` (k, 3, d) are the last k positions, velocities and accelerations, `wanted` (3, d) the
    present ones, `shaped` (3, d) their mean; `place` is where the oldest is. What swings k cycles a
    period is not set swinging; bounds, straight ways and the place of rest stay as they were.
    Returns the place of what is the oldest next.
    """
    k, _, d = past.shape
    for j in range(3):
        for i in range(d):
            shaped[j, i] += (wanted[j, i] - past[place, j, i]) / k
            past[place, j, i] = wanted[j, i]
    place += 1
    if place < k:
        return place
    # a sum that goes on for days is begun anew before rounding shows
    for j in range(3):
        for i in range(d):
            total = 0.0
            for n in range(k):
                total += past[n, j, i] - past[0, j, i]
            shaped[j, i] = past[0, j, i] + total / k
    return 0


@jit
def factor(A: FloatArray, d: int) -> None:
    """Replace the lower half of A (d, d), positive definite, by its Cholesky factor."""
    for j in range(d):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = math.sqrt(max(A[j, j], 1e-300))
        for i in range(j + 1, d):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]


@jit
def solve(L: FloatArray, x: FloatArray, d: int) -> None:
    """Solve L L^T x = b in place; `x` (d,) is b beforehand."""
    for j in range(d):
        for k in range(j):
            x[j] -= L[j, k] * x[k]
        x[j] /= L[j, j]
    for j in range(d - 1, -1, -1):
        for k in range(j + 1, d):
            x[j] -= L[k, j] * x[k]
        x[j] /= L[j, j]


@jit
def _multiply(A: FloatArray, x: FloatArray, d: int, out: FloatArray) -> None:
    for i in range(d):
        out[i] = 0.0
        for k in range(d):
            out[i] += A[max(i, k), min(i, k)] * x[k]


@jit
def _damp(
    settings: FloatArray, A: FloatArray, M: FloatArray, L: FloatArray, x: FloatArray, y: FloatArray
) -> None:
    """Write y = D x (d,), D = (1/(2 ζ ω) M^-1 + 1/c A^-1)^-1, with `L` the factor of its sum."""
    d = x.size
    _multiply(A, x, d, y)
    for i in range(d):
        y[i] *= settings[DAMPING]
    solve(L, y, d)
    _multiply(M, y, d, L[-1])
    share = 2.0 * settings[RATIO] * settings[BANDWIDTH]
    for i in range(d):
        y[i] = share * L[-1, i]


@jit
def write_gains(settings: FloatArray, J: FloatArray, room: FloatArray) -> None:
    """Write what the loop's gains are made of: A = J^T J, M, and two factors.

    M (d, d) is the mass that the cables move: the platform's in the controlled directions, and the
    rotors' as their cables feel them, M = M_p + m_r A. `J` (n, d) is the Jacobian. Of `room`
    (7, 7, 7) [4] has M_p; written are [0] A, [1] M, [2] the factor of 2 ζ ω M + c A, [3] that of M,
    lower halves all.
    """
    n, d = J.shape
    A, M, both, factored = room[0], room[1], room[2], room[3]
    share = 2.0 * settings[RATIO] * settings[BANDWIDTH]
    for j in range(d):
        for k in range(j + 1):
            entry = 0.0
            for i in range(n):
                entry += J[i, j] * J[i, k]
            A[j, k] = entry
            M[j, k] = factored[j, k] = room[4, j, k] + settings[ROTOR] * entry
            both[j, k] = share * M[j, k] + settings[DAMPING] * entry
    factor(both, d)
    factor(factored, d)


@jit
def correct(
    settings: FloatArray,
    state: FloatArray,
    scale: FloatArray,
    body: FloatArray,
    directions: IntArray,
    cables: FloatArray,
    pose: FloatArray,
    moves: FloatArray,
    room: FloatArray,
    J: FloatArray,
    W: FloatArray,
    wrench: FloatArray,
    force: FloatArray,
    share: float,
    apart: float,
) -> None:
    """Write what acts on the platform besides its cables (d,), and the loop's correction (d,).

    `moves` (4, 6) are error of the pose, wanted twist, wanted acceleration and twist. `wrench` is
    known beforehand: weight, and what the wanted motion takes. `force` is what the cables are to
    exert besides, F = D (ė + M^-1 D e/(4 ζ²)) and an integral part: in each mode of the platform a
    loop of damping ratio ζ, whose bandwidth is ω, or less where its damping would ask for more than
    c of the cables. The proportional part is saturated, not the damping: far from its target the
    platform comes back at the speed at which both are equal. `share` is how much of the last
    cycle's force could be had: while it was not all, nothing is integrated that asks for more.
    `apart` is by how much the cables' rates contradict each other, m/s: where that is more than
    motion can explain, as of a cable that has broken, the force is not to follow it.
    `scale` (d,) is what of each direction counts as much as 1 N, or 1 m.

    The integral part goes to sleep by a sigmoid where the error is within what cannot be told from
    friction, so that the platform stands still at its target; two thresholds, as in Tremblay
    (thesis), fig. 2.3: once asleep it takes twice the error to wake it. `J` (n, d) and `W` (d, n)
    are written from `cables`.
    """
    d, n = W.shape
    for k in range(d):
        for i in range(n):
            J[i, k] = cables[directions[k], i]
            W[k, i] = -J[i, k]
    body_room, whole = room[5, :4, :3], room[4, :6, :6]
    write_mass_matrix(body, pose, body_room, whole)
    all_of_it = room[6, 0, :6]
    write_wrench(body, whole, body_room, moves[1], moves[2], all_of_it)
    e, v, De, y = room[6, 1, :d], room[6, 2, :d], room[6, 3, :d], room[6, 4, :d]
    size, speed, wanted_speed = 0.0, 0.0, 0.0
    calming = settings[PERIOD] / (settings[PERIOD] + _CALMING_S)
    for k in range(d):
        i = directions[k]
        wrench[k] = all_of_it[i]
        e[k], v[k] = moves[0, i], moves[1, i] - moves[3, i]
        size += (scale[k] * e[k]) ** 2
        state[d + 1 + k] += calming * (moves[3, i] - state[d + 1 + k])
        speed += (scale[k] * state[d + 1 + k]) ** 2
        wanted_speed += abs(moves[1, i])
    for j in range(d):  # of all directions those that are controlled; both ascend
        for k in range(j + 1):
            whole[j, k] = whole[directions[j], directions[k]]
    write_gains(settings, J, room)
    A, M, both, factored = room[0], room[1], room[2], room[3]
    _damp(settings, A, M, both, e, De)
    solve(factored, De, d)
    _damp(settings, A, M, both, De, y)
    quarter = 0.25 / settings[RATIO] ** 2
    _damp(settings, A, M, both, v, De)
    much = 0.0
    for k in range(d):
        y[k] *= quarter
        much += (y[k] / scale[k]) ** 2
    much = math.sqrt(much) / settings[REGULATOR_N]
    for k in range(d):
        y[k] /= max(much, 1.0)
    _integrate(settings, state, scale, y, math.sqrt(size), speed, wanted_speed > 0.0, share)
    trust = min(1.0, (_PLAUSIBLE_m_s / max(apart, _PLAUSIBLE_m_s)) ** 2)
    for k in range(d):
        force[k] = trust * (De[k] + y[k]) + state[k]


@jit
def _integrate(
    settings: FloatArray,
    state: FloatArray,
    scale: FloatArray,
    pull: FloatArray,
    error: float,
    speed: float,
    moving: bool,
    share: float,
) -> None:
    """Integrate the proportional part `pull` (d,); `speed` is a square."""
    d = pull.size
    threshold = settings[DEAD] * (2.0 - state[d])
    state[d] = 1.0 if moving else 1.0 / (1.0 + math.exp(-8.0 * (error / threshold - 1.0)))
    gain = state[d] * settings[INTEGRAL] * settings[PERIOD]
    if not moving:
        gain *= 1.0 + settings[BREAKING] * math.exp(-min(speed / settings[STUCK] ** 2, 50.0))
    for k in range(d):
        step, most = gain * pull[k], settings[MOST_N] * scale[k]
        if share >= 1.0 or step * state[k] < 0.0:
            state[k] = min(max(state[k] + step, -most), most)


@jit
def drive(
    settings: FloatArray,
    m_per_rad: FloatArray,
    inertia: FloatArray,
    omega: FloatArray,
    stretching: FloatArray,
    tensions: FloatArray,
    carried: FloatArray,
    null: FloatArray,
    known: FloatArray,
    most: FloatArray,
    effort: FloatArray,
    null_directions: int,
    reference_slope: FloatArray,
    torque: FloatArray,
) -> None:
    """Write the motors' torques (n,) for the tensions wanted, and what is known of the motors.

    `carried` are the tensions without the loop's correction, which is there to overcome friction
    in the winches: with those the cables are stretched. The rows of `null` are tensions that move
    nothing: cables that pull against each other are damped along them, so that they do not sing. A
    cable is asked for its tension whatever its speed: the mechanism is back-drivable.
    """
    n = tensions.size
    for i in range(n):
        stretching[i] += _STRETCH_SHARE * (carried[i] - stretching[i])
        effort[i] = tensions[i]
    for k in range(null_directions):
        against = 0.0
        for i in range(n):
            against += null[k, i] * m_per_rad[i] * omega[i]
        for i in range(n):
            effort[i] += settings[LOOSE] * null[k, i] * against
    for i in range(n):
        effort[i] = inertia[i] * reference_slope[i] - m_per_rad[i] * effort[i]
        torque[i] = min(max(effort[i] + known[i], -most[i]), most[i])
