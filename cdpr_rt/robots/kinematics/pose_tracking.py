"""Kernels of one cycle: a platform's pose and twist from its motors' angles.

Arrays besides those of `cable_kernel` and `normal_equations`, of float64:

    motors    (13, n)  THETA, OMEGA observed angle and velocity; LOWPASSED_ONCE, LOWPASSED
                       velocity, by one pole and by both; LENGTH of the cable to its anchor,
                       RATE of it; TENSION in its middle by which it is stretched; STRETCH, its
                       length over that without tension; AT_ZERO, length without tension at the
                       motor's zero; and what does not change: M_PER_RAD paid out, COMPLIANCE
                       1/EA, WEIGHT in N/m, INERTIA of the motor in kg m2
    filters   (4,)     PERIOD, s; OBSERVER, SMOOTHER, rad/s; LOWPASS_SHARE, of low-passed velocity
    rotation  (9,)     of a platform that turns freely, as of `free_rotation_kernel`
    swing     (4,)     likewise: ANGLE, rad from where its tensions have no moment; SPIN, rad/s;
                       AMPLITUDE, rad, and AMPLITUDE_m of an anchor point
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.kinematics import free_rotation_kernel as free
from cdpr_rt.robots.kinematics.cable_kernel import ARC, ERROR, FREE
from cdpr_rt.robots.kinematics.cable_model import unstretched_length
from cdpr_rt.robots.kinematics.normal_equations import (
    GRADIENT,
    assemble,
    factorise,
    largest_residual,
    substitute,
)
from cdpr_rt.robots.kinematics.pose_search import find_pose

THETA, OMEGA, LOWPASSED_ONCE, LOWPASSED, LENGTH, RATE, TENSION, STRETCH, AT_ZERO = range(9)
M_PER_RAD, COMPLIANCE, WEIGHT, INERTIA, MOTOR_ROWS = 9, 10, 11, 12, 13
PERIOD, OBSERVER, SMOOTHER, LOWPASS_SHARE, FILTERS = range(5)
ANGLE, SPIN, AMPLITUDE, AMPLITUDE_m, SWING = range(5)
_MOST_TURN_rad = 0.02
# of the type that comes from Python: for a literal numba compiles the search anew
_NO_RESTARTS: int = np.int64(0)  # type: ignore[assignment]


@jit
def observe(motors: FloatArray, position: FloatArray, filters: FloatArray) -> None:
    """Track each motor's angle and velocity: an observer with a double pole at OBSERVER.

    A rotor on its cable swings at some ten Hz and above, where latency turns damping into its
    reverse: what is to damp the platform is in part low-passed by a double pole at SMOOTHER.
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
    turns: bool,
    position: FloatArray,
) -> tuple[float, int, float]:
    """Bring `pose` and `twist` (6,) up to the motors' angles (n,).

    Returns the largest normalised residual of the lengths, m, its cable, -1 where the lengths do
    not tell which it is, and the root mean square of what the rates are off, m/s. `turns` is
    whether the platform turns freely in its plane: then it goes to where its tensions have no
    moment. Eqs. (2.6) to (2.9), (3.13) to (3.15).
    """
    observe(motors, position, filters)
    if turns:
        _turn_to_equilibrium(motors, filters, geometry, pose, rotation, swing)
    _, _, cost = find_pose(geometry, cables, solver, motors[LENGTH], pose, _NO_RESTARTS)
    stretch(motors, cables, up)
    n, residual, suspect = motors.shape[1], math.sqrt(cost), -1
    for i in range(n):
        cables[ERROR, i] = -motors[RATE, i]
    assemble(cables, solver)
    if factorise(solver, 0.0):
        if cost < math.inf:  # lengths that are no numbers do not agree
            residual, suspect = largest_residual(motors[LENGTH], cables, solver)
        for k in range(6):
            twist[k] = solver[GRADIENT, k]
        substitute(solver, twist)
    inconsistency = 0.0
    for i in range(n):
        rate = motors[RATE, i]
        for k in range(6):
            rate -= cables[k, i] * twist[k]
        inconsistency += rate * rate
    return residual, suspect, math.sqrt(inconsistency / n)


@jit
def stretch(motors: FloatArray, cables: FloatArray, up: FloatArray) -> None:
    """Write each cable's STRETCH under its TENSION at the pose of `cables`, where it can be had."""
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
def _turn_to_equilibrium(
    motors: FloatArray,
    filters: FloatArray,
    geometry: FloatArray,
    pose: FloatArray,
    rotation: FloatArray,
    swing: FloatArray,
) -> None:
    """Turn the platform about z by one Newton step to where tensions have no moment about it.

    The true one swings about there, since it does not follow at once: its `swing` is computed from
    its inertia, and is told; where it is at an instant is not known well enough to be used.
    """
    free.rotational_stiffness(geometry, motors[TENSION], pose, rotation)
    if rotation[free.STEEPNESS] > 0.0:
        angle = rotation[free.MOMENT] / rotation[free.STEEPNESS]
        angle = min(max(angle, -_MOST_TURN_rad), _MOST_TURN_rad)
        _swing(filters, rotation, angle, swing)
        free.turn(pose, angle)


@jit
def _swing(filters: FloatArray, rotation: FloatArray, moved: float, swing: FloatArray) -> None:
    """Advance a swing by a cycle in which its middle ψ has moved by an angle.

    With lengths that follow ψ, the platform is turned from there by δ: I_s δ̈ = -κ δ - I ψ̈, less a
    damping.
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
