"""Kernels of one cycle of a platform's control: set-point shaping, force, torques.

In addition to the known wrench, the cables exert F = D (ė + M^-1 D e/(4 ζ²)) and an integral part.
This is a loop of damping ratio ζ in each mode of the platform. Its bandwidth is ω, or less where
the damping would exceed c at the cables: D = (1/(2 ζ ω) M^-1 + 1/c (J^T J)^-1)^-1. The proportional
part is saturated, the damping is not. Therefore, if the platform is far from its target, it returns
at the speed at which both parts are equal. The integral part has a deadband for errors that
friction can explain, so that the platform stands still at its target. A sigmoid leads into the
deadband, with hysteresis as in Tremblay (thesis), fig. 2.3: leaving it takes twice the error. At
rest, the integral part grows against friction of unknown sign. In motion, friction is compensated,
so this growth is removed when motion begins, up to the friction. Otherwise the platform would jump
in directions in which friction is large relative to the loop's stiffness.

Arrays besides those of the kinematics' kernels: a loop's row of SETTINGS, and its STATE: the
integral part (d,), N and Nm; then the share of its rate that the deadband leaves, 0 to 1; the twist
(d,), low-passed until an encoder's counts no longer look like speed; and the integral part (d,) at
the end of the last motion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.model.cable_kernel import hang, write_tension_rises
from cdpr_rt.platform.body_kernel import write_mass_matrix, write_wrench

STRETCH_SHARE = 0.2
"""Share by which the tensions used for the cables' stretch follow the planned ones, per cycle."""
PLAUSIBLE_m_s = 0.15
"""Largest disagreement of the cables' rates in motion."""
_LOWPASS_S = 0.02
PERIOD, BANDWIDTH, DAMPING, RATIO, INTEGRAL, NULL_DAMPING, ROTOR = range(7)
REGULATOR_N, MOST_N, STICTION_GAIN, STICTION_SPEED, DEADBAND, SETTINGS = range(7, 13)
"""Period, s; the loop's bandwidth, rad/s, and damping, N s/m of a cable; damping ratio; rate of the
integral part, 1/s; damping of cables against each other, N s/m; mass of a rotor, kg, at its cable;
largest proportional and integral part, N; factor of faster integration during stiction, the speed,
m/s, below which that acts, and the error, m, around which the integral part fades out and in."""

POSE_ERROR, WANTED_TWIST, WANTED_ACCELERATION, TWIST = range(4)
"""Rows of a platform's `moves` (4, 6)."""
MASS, TWIST_ERROR = 1, (6, 2)
"""Indices of M (d, d), its lower half, and of the error of the twist (d,) in `scratch`."""


@jit
def shape(past: FloatArray, place: int, wanted: FloatArray, shaped: FloatArray) -> int:
    """Average the set-point over the last cycles, so that its acceleration does not step.

    `past` (k, 3, d) are the last k positions, velocities and accelerations, `wanted` (3, d) the
    present ones, `shaped` (3, d) their mean; `place` is the index of the oldest. Oscillations with
    a period of k cycles are not excited. Bounds, straight lines and the final position do not
    change. Returns the index of the next oldest.
    """
    k, _, d = past.shape
    for j in range(3):
        for i in range(d):
            shaped[j, i] += (wanted[j, i] - past[place, j, i]) / k
            past[place, j, i] = wanted[j, i]
    place += 1
    if place < k:
        return place
    # compute a long-running sum again before rounding errors become visible
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
    """Solve L L^T x = b in place; on entry `x` (d,) is b."""
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
def write_gains(settings: FloatArray, J: FloatArray, scratch: FloatArray) -> None:
    """Write the parts of the loop's gains: A = J^T J, M, and two factors.

    M (d, d) is the mass that the cables move: the platform's in the controlled directions, and the
    rotors' at their cables, M = M_p + m_r A. `J` (n, d) is the Jacobian. On entry [4] of `scratch`
    (7, 7, 7) has M_p; written are [0] A, [1] M, [2] the factor of 2 ζ ω M + c A, [3] that of M,
    all as lower halves.
    """
    n, d = J.shape
    A, M, both, factored = scratch[0], scratch[1], scratch[2], scratch[3]
    share = 2.0 * settings[RATIO] * settings[BANDWIDTH]
    for j in range(d):
        for k in range(j + 1):
            entry = 0.0
            for i in range(n):
                entry += J[i, j] * J[i, k]
            A[j, k] = entry
            M[j, k] = factored[j, k] = scratch[4, j, k] + settings[ROTOR] * entry
            both[j, k] = share * M[j, k] + settings[DAMPING] * entry
    factor(both, d)
    factor(factored, d)


class WinchFriction(NamedTuple):
    """Friction of n winches that is compensated in motion; arrays are (n,)."""

    known_Nm: FloatArray
    faded_in: FloatArray
    """Share of `known_Nm` that is compensated."""
    learnt_Nm: FloatArray
    rad_per_m: FloatArray
    """Motor angle per metre of cable, positive."""


@jit
def correct(
    settings: FloatArray,
    state: FloatArray,
    scale: FloatArray,
    body: FloatArray,
    directions: IntArray,
    geometry: FloatArray,
    cables: FloatArray,
    pose: FloatArray,
    moves: FloatArray,
    scratch: FloatArray,
    J: FloatArray,
    W: FloatArray,
    rise: FloatArray,
    wrench: FloatArray,
    friction: WinchFriction,
    force: FloatArray,
    share: float,
    rate_inconsistency_m_s: float,
) -> None:
    """Write the wrench on the platform without its cables (d,), and the loop's correction (d,).

    `moves` (4, 6) has the rows above. `wrench` is the feed-forward part: weight, weight of the
    cables, and inertia of the wanted motion. `force` is F of the law above. `share` is the part of
    the last cycle's force that was exerted: below 1, the integral part may only decrease. If the
    cables' rates contradict each other by more than motion can explain, for example after a cable
    has broken, the force is reduced. `scale` (d,) is the size in each direction that counts as 1 N,
    or 1 m. `cables` and `pose` are those of the set-point, or of the platform if the loop was
    designed for that. `J` (n, d), `W` (d, n) and `rise` (n,), the excess of tensions at the winches
    over those in the cables' middle, are written from `cables`.
    """
    d, n = W.shape
    for k in range(d):
        for i in range(n):
            J[i, k] = cables[directions[k], i]
            W[k, i] = -J[i, k]
    write_tension_rises(geometry, cables, rise)
    whole, all_of_it = scratch[4, :6, :6], scratch[6, 0, :6]
    write_mass_matrix(body, pose, scratch[5, :4, :3], whole)
    twist, acceleration = moves[WANTED_TWIST], moves[WANTED_ACCELERATION]
    write_wrench(body, whole, scratch[5, :4, :3], twist, acceleration, all_of_it)
    hang(geometry, pose, cables, all_of_it)
    e, v, De, y = scratch[6, 1, :d], scratch[6, 2, :d], scratch[6, 3, :d], scratch[6, 4, :d]
    for k in range(d):
        wrench[k] = all_of_it[directions[k]]
    size, speed, moving = _write_errors(settings, state, scale, directions, moves, e, v)
    for j in range(d):  # select the controlled directions; both lists ascend
        for k in range(j + 1):
            whole[j, k] = whole[directions[j], directions[k]]
    write_gains(settings, J, scratch)
    A, M, both, factored = scratch[0], scratch[1], scratch[2], scratch[3]
    _damp(settings, A, M, both, e, De)
    solve(factored, De, d)
    _damp(settings, A, M, both, De, y)
    _saturate(settings, scale, y)
    _damp(settings, A, M, both, v, De)
    if moving:
        _give_back(state, J, friction)
    _integrate(settings, state, scale, y, size, speed, moving, share)
    trust = min(1.0, (PLAUSIBLE_m_s / max(rate_inconsistency_m_s, PLAUSIBLE_m_s)) ** 2)
    for k in range(d):
        force[k] = trust * (De[k] + y[k]) + state[k]


@jit
def _write_errors(
    settings: FloatArray,
    state: FloatArray,
    scale: FloatArray,
    directions: IntArray,
    moves: FloatArray,
    e: FloatArray,
    v: FloatArray,
) -> tuple[float, float, bool]:
    """Write the errors `e` of the pose and `v` of the twist (d,), and low-pass the twist.

    Returns the size of the pose's error, the square of the low-passed twist, and whether a motion
    is wanted.
    """
    d = e.size
    size, speed, wanted_speed = 0.0, 0.0, 0.0
    lowpass = settings[PERIOD] / (settings[PERIOD] + _LOWPASS_S)
    for k in range(d):
        i = directions[k]
        e[k], v[k] = moves[POSE_ERROR, i], moves[WANTED_TWIST, i] - moves[TWIST, i]
        size += (scale[k] * e[k]) ** 2
        state[d + 1 + k] += lowpass * (moves[TWIST, i] - state[d + 1 + k])
        speed += (scale[k] * state[d + 1 + k]) ** 2
        wanted_speed += abs(moves[WANTED_TWIST, i])
    return math.sqrt(size), speed, wanted_speed > 0.0


@jit
def _saturate(settings: FloatArray, scale: FloatArray, proportional: FloatArray) -> None:
    """Convert D M^-1 D e, `proportional` (d,), to the saturated proportional part."""
    quarter, norm = 0.25 / settings[RATIO] ** 2, 0.0
    for k in range(proportional.size):
        proportional[k] *= quarter
        norm += (proportional[k] / scale[k]) ** 2
    norm = math.sqrt(norm) / settings[REGULATOR_N]
    for k in range(proportional.size):
        proportional[k] /= max(norm, 1.0)


@jit
def _give_back(state: FloatArray, J: FloatArray, friction: WinchFriction) -> None:
    """Remove from the integral part its growth at rest, at most Σ |J_i| friction_i."""
    n, d = J.shape
    for k in range(d):
        most = 0.0
        for i in range(n):
            torque = friction.faded_in[i] * friction.known_Nm[i] + friction.learnt_Nm[i]
            most += abs(J[i, k]) * torque * friction.rad_per_m[i]
        gained = state[k] - state[2 * d + 1 + k]
        state[k] -= min(max(gained, -most), most)


@jit
def _integrate(
    settings: FloatArray,
    state: FloatArray,
    scale: FloatArray,
    proportional: FloatArray,
    error: float,
    speed: float,
    moving: bool,
    share: float,
) -> None:
    """Integrate the proportional part `proportional` (d,); `speed` is a square."""
    d = proportional.size
    threshold = settings[DEADBAND] * (2.0 - state[d])
    state[d] = 1.0 if moving else 1.0 / (1.0 + math.exp(-8.0 * (error / threshold - 1.0)))
    gain = state[d] * settings[INTEGRAL] * settings[PERIOD]
    if not moving:
        gain *= 1.0 + settings[STICTION_GAIN] * math.exp(
            -min(speed / settings[STICTION_SPEED] ** 2, 50.0)
        )
    for k in range(d):
        step, most = gain * proportional[k], settings[MOST_N] * scale[k]
        if share >= 1.0 or step * state[k] < 0.0:
            state[k] = min(max(state[k] + step, -most), most)
        if moving:
            state[2 * d + 1 + k] = state[k]


@jit
def drive(
    settings: FloatArray,
    m_per_rad: FloatArray,
    inertia: FloatArray,
    omega: FloatArray,
    stretching: FloatArray,
    tensions: FloatArray,
    feedforward_tensions: FloatArray,
    rise: FloatArray,
    null: FloatArray,
    compensation: FloatArray,
    most: FloatArray,
    effort: FloatArray,
    null_directions: int,
    reference_slope: FloatArray,
    torque: FloatArray,
) -> bool:
    """Write the motors' torques (n,) for the tensions wanted, with the motors' `compensation`.

    Returns whether a motor's limit was reached.

    `feedforward_tensions` do not include the loop's correction, which only overcomes friction in
    the winches. So they determine the stretch of the cables. Winches pull by `rise` (n,) more than
    the tension in the middle of their cables. The rows of `null` are tensions without a wrench.
    Damping along them prevents oscillations of cables that pull against each other. Otherwise the
    commanded tension of a cable does not depend on its speed, so the mechanism is back-drivable.
    """
    n, limited = tensions.size, False
    for i in range(n):
        stretching[i] += STRETCH_SHARE * (feedforward_tensions[i] - stretching[i])
        effort[i] = tensions[i] + rise[i]
    for k in range(null_directions):
        against = 0.0
        for i in range(n):
            against += null[k, i] * m_per_rad[i] * omega[i]
        for i in range(n):
            effort[i] += settings[NULL_DAMPING] * null[k, i] * against
    for i in range(n):
        effort[i] = inertia[i] * reference_slope[i] - m_per_rad[i] * effort[i]
        torque[i] = min(max(effort[i] + compensation[i], -most[i]), most[i])
        limited = limited or abs(torque[i]) == most[i]
    return limited
