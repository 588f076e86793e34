"""Kernels of one cycle: the platform's pose from motor angles, and the motors' set-points.

Arrays besides those of `cable_kernel` and `pose_search`, of float64:

    motors    (15, n)  THETA, OMEGA observed angle and velocity; LOWPASSED_ONCE, LOWPASSED
                       velocity, by one pole and by both; LENGTH of the cable to its anchor,
                       RATE of it; TENSION in its middle by which it is stretched; STRETCH, its
                       length over that without tension; AT_ZERO, length without tension at the
                       motor's zero; and what does not change: M_PER_RAD paid out, COMPLIANCE
                       1/EA, WEIGHT in N/m, INERTIA of the motor in kg m2. RESIDUAL: normalised,
                       of the length; SETTLED, the same low-passed, NaN before the first
    filters   (4,)     PERIOD, s; OBSERVER, SMOOTHER, rad/s; LOWPASS_SHARE, of low-passed velocity
    rotation  (9,)     of a platform that turns freely, as in `free_rotation_kernel`
    swing     (4,)     of the same platform: ANGLE, rad, from the angle without moment; SPIN, rad/s;
                       AMPLITUDE, rad, and AMPLITUDE_m of an anchor point
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.model import equilibrium_kernel as equilibrium
from cdpr_rt.model import free_rotation_kernel as free
from cdpr_rt.model.cable_kernel import ARC, ERROR, FREE, run_cables, unstretched_length
from cdpr_rt.model.pose import exponential, logarithm
from cdpr_rt.model.pose_search import (
    GRADIENT,
    assemble,
    factorise,
    find_pose,
    largest_jump,
    largest_residual,
    move,
    substitute,
)

THETA, OMEGA, LOWPASSED_ONCE, LOWPASSED, LENGTH, RATE, TENSION, STRETCH, AT_ZERO = range(9)
M_PER_RAD, COMPLIANCE, WEIGHT, INERTIA, RESIDUAL, SETTLED, MOTOR_ROWS = 9, 10, 11, 12, 13, 14, 15
PERIOD, OBSERVER, SMOOTHER, LOWPASS_SHARE, FILTERS = range(5)
ANGLE, SPIN, AMPLITUDE, AMPLITUDE_m, SWING = range(5)
FIXED, TURNS, HANGS = range(3)
"""How an uncontrolled rotation is estimated: not at all, in the plane, or in space."""
JUMP_S = 0.2
"""Time constant with which SETTLED follows RESIDUAL. A slip takes about 30 ms; errors of the
geometry change the residual only as fast as the platform moves."""
_MOST_TURN_rad, _SMALL = 0.02, 1e-4
LAG, REACH_m = 0, 1
LAG_S, _SENSED_S, _MOST_LEARNT = 0.1, 1.0, 0.2
_STANDS_m = 5e-3
"""Height above home up to which a platform counts as standing at home."""
# has the type that Python passes: with a literal, numba would compile the search again
_NO_RESTARTS: int = np.int64(0)  # type: ignore[assignment]


class Hanging(NamedTuple):
    """Arrays for a platform that hangs in space on too few cables, see `equilibrium_kernel`."""

    known: FloatArray
    tensions: FloatArray
    normal: FloatArray
    rows: FloatArray
    settings: FloatArray
    """(2,): time constant LAG with which the rotation follows, s, and REACH_m, the largest distance
    of an anchor point from the centre of mass."""
    home: FloatArray
    """Pose at home, (4, 3), at which the platform stands."""
    scratch: FloatArray
    """(4, 3)"""
    unsensed: FloatArray
    """(4,), zero"""
    measured_N: FloatArray
    """Readings of load cells at the winches, (n,)."""
    measured: BoolArray
    """Whether these readings are valid, (n,)."""
    upward: FloatArray
    """Reading of an inclinometer, (4,)."""


@jit
def observe(motors: FloatArray, position: FloatArray, filters: FloatArray) -> None:
    """Track each motor's angle and velocity: an observer with a double pole at OBSERVER.

    A rotor on its cable oscillates at 10 Hz or more. At these frequencies, latency inverts the
    effect of damping. So the velocity that damps the platform is partly low-passed, by a double
    pole at SMOOTHER.
    """
    period = filters[PERIOD]
    decay = math.exp(-filters[OBSERVER] * period)
    weight = 1.0 - math.exp(-filters[SMOOTHER] * period)
    for i in range(motors.shape[1]):
        predicted = motors[THETA, i] + period * motors[OMEGA, i]
        error = position[i] - predicted
        motors[THETA, i] = predicted + (1.0 - decay * decay) * error
        motors[OMEGA, i] += (1.0 - decay) ** 2 / period * error
        motors[LOWPASSED_ONCE, i] += weight * (motors[OMEGA, i] - motors[LOWPASSED_ONCE, i])
        motors[LOWPASSED, i] += weight * (motors[LOWPASSED_ONCE, i] - motors[LOWPASSED, i])
        omega, omega_filtered = motors[OMEGA, i], motors[LOWPASSED, i]
        damped = omega + filters[LOWPASS_SHARE] * (omega_filtered - omega)
        motors[RATE, i] = motors[M_PER_RAD, i] * damped
        free = motors[AT_ZERO, i] + motors[M_PER_RAD, i] * motors[THETA, i]
        motors[LENGTH, i] = free * motors[STRETCH, i]


@jit
def track_pose(
    motors: FloatArray,
    filters: FloatArray,
    geometry: FloatArray,
    up: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    solver: FloatArray,
    twist: FloatArray,
    rotation: FloatArray,
    swing: FloatArray,
    freedom: int,
    hanging: Hanging,
    position: FloatArray,
) -> tuple[float, int, float, float, int]:
    """Update `pose` and `twist` (6,) from the motors' angles (n,).

    Returns the largest normalised residual of the lengths, m; its cable, -1 if the lengths do not
    identify it; the root mean square of the rates' errors, m/s; the largest jump of a residual, m,
    and its cable, see `largest_jump`. If the cables leave the platform a `freedom` to turn, its
    rotation is that of the equilibrium. Eqs. (2.6) to (2.9), (3.13) to (3.15).
    """
    observe(motors, position, filters)
    if freedom == TURNS:
        _turn_to_equilibrium(motors, filters, geometry, pose, rotation, swing)
    elif freedom == HANGS:
        _hang(motors, filters, geometry, pose, cables, swing, hanging)
    _, _, cost = find_pose(geometry, cables, solver, motors[LENGTH], pose, _NO_RESTARTS)
    stretch(motors, cables, up)
    n, residual, suspect, jump, jumped = motors.shape[1], math.sqrt(cost), -1, 0.0, -1
    for i in range(n):
        cables[ERROR, i] = -motors[RATE, i]
    assemble(cables, solver)
    if factorise(solver, 0.0):
        if cost < math.inf:  # false for nan lengths, which do not agree
            normalised = motors[RESIDUAL]
            residual, suspect = largest_residual(motors[LENGTH], cables, solver, normalised)
            share = filters[PERIOD] / (filters[PERIOD] + JUMP_S)
            jump, jumped = largest_jump(normalised, motors[SETTLED], share)
        for k in range(6):
            twist[k] = solver[GRADIENT, k]
        substitute(solver, twist)
    inconsistency = 0.0
    for i in range(n):
        rate = motors[RATE, i]
        for k in range(6):
            rate -= cables[k, i] * twist[k]
        inconsistency += rate * rate
    return residual, suspect, math.sqrt(inconsistency / n), jump, jumped


@jit
def stretch(motors: FloatArray, cables: FloatArray, up: FloatArray) -> None:
    """Write each cable's STRETCH under its TENSION at the pose of `cables`, if that is known."""
    for i in range(motors.shape[1]):
        sine = 0.0
        for k in range(3):
            sine += cables[k, i] * up[k]
        free, weight, compliance = cables[FREE, i], motors[WEIGHT, i], motors[COMPLIANCE, i]
        tension = motors[TENSION, i] + 0.5 * weight * free * sine  # at the platform
        across = free * math.sqrt(max(1.0 - sine * sine, 0.0))
        length = unstretched_length(across, free * sine, tension, compliance, weight)
        length += cables[ARC, i] / (1.0 + tension * compliance)
        if length > 0.0:
            motors[STRETCH, i] = (free + cables[ARC, i]) / length


@jit
def _hang(
    motors: FloatArray,
    filters: FloatArray,
    geometry: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    swing: FloatArray,
    hanging: Hanging,
) -> None:
    """Turn the platform towards its equilibrium or, at home's height, to its rotation at home.

    The true platform swings about the equilibrium, and follows it no faster than LAG. Only an
    inclinometer shows the amplitude of that swing.
    """
    lag_s = hanging.settings[LAG]
    share = filters[PERIOD] / (filters[PERIOD] + lag_s)
    if not pose[0, 2] > hanging.home[0, 2] + _STANDS_m:
        back = hanging.rows[0]
        _turn_between(hanging.home, pose, hanging.scratch)
        for k in range(6):
            back[k] = 0.0 if k < 3 else share * hanging.scratch[0, k - 3]
        move(pose, back)
        return
    slow = filters[PERIOD] / (filters[PERIOD] + _SENSED_S) if lag_s > 0.0 else 1.0
    equilibrium.say_tensions(
        motors[TENSION], hanging.measured_N, hanging.measured, geometry, cables, hanging.known,
        hanging.tensions, slow,
    )  # fmt: skip
    equilibrium.turn_to_equilibrium(
        geometry, motors[LENGTH], pose, cables, hanging.known, hanging.unsensed, hanging.tensions,
        hanging.normal, hanging.rows, share,
    )  # fmt: skip
    if hanging.upward[0] > 0.0:
        most_Nm = equilibrium.MOST_MOMENT * hanging.known[equilibrium.WEIGHT]
        angle = equilibrium.learn_moment(
            pose, hanging.known, hanging.upward, hanging.rows, min(slow, _MOST_LEARNT),
            most_Nm * hanging.settings[REACH_m],
        )  # fmt: skip
        swing[AMPLITUDE] = max(angle, (1.0 - slow) * swing[AMPLITUDE])
        swing[AMPLITUDE_m] = hanging.settings[REACH_m] * swing[AMPLITUDE]


@jit
def _turn_to_equilibrium(
    motors: FloatArray,
    filters: FloatArray,
    geometry: FloatArray,
    pose: FloatArray,
    rotation: FloatArray,
    swing: FloatArray,
) -> None:
    """Turn the platform about z by one Newton step to the angle at which tensions have no moment.

    The true platform swings about that angle, because it does not follow immediately. Its `swing`
    is computed from the inertia and reported. The phase is too uncertain for use in the control.
    """
    free.rotational_stiffness(geometry, motors[TENSION], pose, rotation)
    if rotation[free.STEEPNESS] > 0.0:
        angle = rotation[free.MOMENT] / rotation[free.STEEPNESS]
        angle = min(max(angle, -_MOST_TURN_rad), _MOST_TURN_rad)
        _swing(filters, rotation, angle, swing)
        free.turn(pose, angle)


@jit
def _swing(filters: FloatArray, rotation: FloatArray, moved: float, swing: FloatArray) -> None:
    """Advance a swing by a cycle in which its centre ψ has moved by the angle `moved`.

    The cable lengths follow ψ, and the platform deviates from ψ by the angle δ: I_s δ̈ = -κ δ - I
    ψ̈, minus damping.
    """
    if rotation[free.STIFFNESS] <= 0.0:
        return
    omega = math.sqrt(rotation[free.STIFFNESS] / rotation[free.SWINGING])
    drag = 2.0 * free.DAMPING_RATIO * omega * swing[SPIN]
    swing[SPIN] -= filters[PERIOD] * (omega * omega * swing[ANGLE] + drag)
    share = rotation[free.INERTIA] / rotation[free.SWINGING]
    swing[ANGLE] += filters[PERIOD] * swing[SPIN] - share * moved
    swing[AMPLITUDE] = math.hypot(swing[ANGLE], swing[SPIN] / omega)
    swing[AMPLITUDE_m] = rotation[free.REACH] * swing[AMPLITUDE]


# Kernels that convert a platform's set-point to a pose, and to the motors' set-points. A set-point
# (d,) has one entry for each controlled direction. These are the coordinates of the origin, and the
# rotation vector φ from the orientation at home, Q = exp(φ) Q_home. This has no singularity at
# angles below half a turn.


@jit
def pose_of_coordinates(
    q: FloatArray, directions: IntArray, home: FloatArray, scratch: FloatArray, pose: FloatArray
) -> None:
    """Write the pose of a set-point `q` (d,); other directions are as at `home` (4, 3)."""
    phi, turn = scratch[0], scratch[1:4]
    for k in range(3):
        phi[k], pose[0, k] = 0.0, home[0, k]
    for k in range(q.size):
        if directions[k] < 3:
            pose[0, directions[k]] = q[k]
        else:
            phi[directions[k] - 3] = q[k]
    exponential(phi, turn)
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += turn[i, k] * home[1 + k, j]
            pose[1 + i, j] = entry


@jit
def poses_of_coordinates(
    q: FloatArray, directions: IntArray, home: FloatArray, scratch: FloatArray, poses: FloatArray
) -> None:
    """Write the poses (m, 4, 3) of set-points (m, d)."""
    for j in range(q.shape[0]):
        pose_of_coordinates(q[j], directions, home, scratch, poses[j])


@jit
def coordinates_of_pose(
    pose: FloatArray, directions: IntArray, home: FloatArray, scratch: FloatArray, q: FloatArray
) -> None:
    """Write the set-point `q` (d,) of a pose: the inverse of `pose_of_coordinates`."""
    _turn_between(pose, home, scratch)
    for k in range(q.size):
        q[k] = pose[0, directions[k]] if directions[k] < 3 else scratch[0, directions[k] - 3]


@jit
def subtract(pose: FloatArray, other: FloatArray, scratch: FloatArray, x: FloatArray) -> None:
    """Write x = pose ⊟ other (6,), as in `pose`: the logarithm map."""
    _turn_between(pose, other, scratch)
    for k in range(3):
        x[k], x[3 + k] = pose[0, k] - other[0, k], scratch[0, k]


@jit
def _turn_between(pose: FloatArray, other: FloatArray, scratch: FloatArray) -> None:
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += pose[1 + i, k] * other[1 + j, k]
            scratch[1 + i, j] = entry
    logarithm(scratch[1:4], scratch[0])


@jit
def _angular_velocity(phi: FloatArray, x: float, y: float, z: float, out: FloatArray) -> None:
    """Write the angular velocity J(φ) (x, y, z) of a rotation vector with this derivative, (3,).

    J(φ) = 1 + (1 - cos θ)/θ² [φ]× + (θ - sin θ)/θ³ [φ]×², θ = |φ|.
    """
    a, b, c = phi[0], phi[1], phi[2]
    square = a * a + b * b + c * c
    angle = math.sqrt(square)
    if angle < _SMALL:
        one, two = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        half = math.sin(0.5 * angle) / angle
        one, two = 2.0 * half * half, (angle - math.sin(angle)) / (square * angle)
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    out[0] = x + one * u + two * (b * w - c * v)
    out[1] = y + one * v + two * (c * u - a * w)
    out[2] = z + one * w + two * (a * v - b * u)


@jit
def move_with(
    shaped: FloatArray,
    directions: IntArray,
    period: float,
    scratch: FloatArray,
    twist: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Write twist and its derivative (6,) for a set-point and its derivatives, `shaped` (3, d)."""
    phi, rate, slope, after = scratch[0], scratch[1], scratch[2], scratch[3]
    turns = False
    for k in range(6):
        twist[k] = acceleration[k] = 0.0
    for k in range(3):
        phi[k] = rate[k] = slope[k] = 0.0
    for k in range(shaped.shape[1]):
        i = directions[k]
        if i < 3:
            twist[i], acceleration[i] = shaped[1, k], shaped[2, k]
        else:
            phi[i - 3], rate[i - 3], slope[i - 3] = shaped[0, k], shaped[1, k], shaped[2, k]
            turns = turns or shaped[1, k] != 0.0 or shaped[2, k] != 0.0
    if turns:
        _angular_velocity(phi, rate[0], rate[1], rate[2], twist[3:6])
        _angular_velocity(phi, slope[0], slope[1], slope[2], acceleration[3:6])
        for k in range(3):
            phi[k] += period * rate[k]
        _angular_velocity(phi, rate[0], rate[1], rate[2], after)
        for k in range(3):
            acceleration[3 + k] += (after[k] - twist[3 + k]) / period


@jit
def motor_references(
    shaped: FloatArray,
    directions: IntArray,
    home: FloatArray,
    period: float,
    geometry: FloatArray,
    motors: FloatArray,
    pose: FloatArray,
    scratch: FloatArray,
    wanted: FloatArray,
    cables: FloatArray,
    twist: FloatArray,
    acceleration: FloatArray,
    error: FloatArray,
    position_rad: FloatArray,
    velocity_rad_s: FloatArray,
    acceleration_rad_s2: FloatArray,
) -> None:
    """Write the commands for a set-point `shaped` (3, d): motion, error, and motors' set-points.

    `wanted` (4, 3) is its pose, `twist` and `acceleration` (6,) its motion, `error` (6,) wanted ⊟
    pose. The set-points of the motors are (n,) each, eqs. (2.2), (2.4), (3.2), (3.11), with the
    stretch of each cable subtracted. If no angle is controlled, the platform is assumed to keep its
    rotation.
    """
    pose_of_coordinates(shaped[0], directions, home, scratch, wanted)
    if directions[directions.size - 1] < 3:
        for i in range(1, 4):
            for j in range(3):
                wanted[i, j] = pose[i, j]
    subtract(wanted, pose, scratch, error)
    move_with(shaped, directions, period, scratch, twist, acceleration)
    run_cables(geometry, wanted, cables)
    for i in range(motors.shape[1]):
        rate, slope = 0.0, 0.0
        for k in range(6):
            rate += cables[k, i] * twist[k]
            slope += cables[k, i] * acceleration[k]
        length = (cables[FREE, i] + cables[ARC, i]) / motors[STRETCH, i]
        position_rad[i] = (length - motors[AT_ZERO, i]) / motors[M_PER_RAD, i]
        velocity_rad_s[i] = rate / motors[M_PER_RAD, i]
        acceleration_rad_s2[i] = slope / motors[M_PER_RAD, i]


@jit
def write_quaternion(pose: FloatArray, out: FloatArray) -> None:
    """Write position x y z and quaternion w x y z, w at least 0, of a pose into `out` (7,)."""
    scratch = out[4:7]
    logarithm(pose[1:4], scratch)
    angle = math.sqrt(scratch[0] ** 2 + scratch[1] ** 2 + scratch[2] ** 2)
    share = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.0
    for k in range(3):
        out[k] = pose[0, k]
        out[4 + k] *= share
    out[3] = math.cos(0.5 * angle)
