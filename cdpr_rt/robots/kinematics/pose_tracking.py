"""Kernels of one cycle: a platform's pose and twist from its motors' angles.

Arrays besides those of `cable_kernel` and `normal_equations`, of float64:

    motors    (13, n)  THETA, OMEGA observed angle and velocity; LAGGING, CALM: velocity low-passed
                       once and twice; LENGTH of the cable to its anchor, RATE of it; TENSION by
                       which it is taken to be stretched; STRETCH, its length over that without
                       tension; AT_ZERO, length without tension at the motor's zero; and what does
                       not change: M_PER_RAD paid out, COMPLIANCE 1/EA, WEIGHT in N/m, INERTIA of
                       the motor in kg m2
    filters   (4,)     PERIOD, s; OBSERVER and SMOOTHER, rad/s; SMOOTH, share of the smooth velocity
"""

from __future__ import annotations

import math

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.kinematics.cable_kernel import ANCHOR, ARC, ERROR, FREE
from cdpr_rt.robots.kinematics.cable_model import unstretched_length
from cdpr_rt.robots.kinematics.normal_equations import GRADIENT, assemble, factorise, substitute
from cdpr_rt.robots.kinematics.pose_search import find_pose

THETA, OMEGA, LAGGING, CALM, LENGTH, RATE, TENSION, STRETCH, AT_ZERO = range(9)
M_PER_RAD, COMPLIANCE, WEIGHT, INERTIA, MOTOR_ROWS = 9, 10, 11, 12, 13
PERIOD, OBSERVER, SMOOTHER, SMOOTH, FILTERS = range(5)
_MOST_TURN_rad = 0.02


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
        motors[LAGGING, i] += weight * (motors[OMEGA, i] - motors[LAGGING, i])
        motors[CALM, i] += weight * (motors[LAGGING, i] - motors[CALM, i])
        fast, calm = motors[OMEGA, i], motors[CALM, i]
        motors[RATE, i] = motors[M_PER_RAD, i] * (fast + filters[SMOOTH] * (calm - fast))
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
    turns: bool,
    position: FloatArray,
) -> tuple[float, float]:
    """Bring `pose` and `twist` (6,) up to the motors' angles (n,); return the residuals.

    They are root mean squares over the cables: of what their lengths are off, m, and of what their
    rates are off, m/s. `turns` is
    whether the platform turns freely in its plane: then it goes to where its tensions have no
    moment. Eqs. (2.6) to (2.9), (3.13) to (3.15).
    """
    observe(motors, position, filters)
    if turns:
        _turn_to_equilibrium(motors, geometry, pose)
    _, _, cost = find_pose(geometry, motors[LENGTH], pose, cables, solver, 0)
    stretch(motors, cables, up)
    n = motors.shape[1]
    for i in range(n):
        cables[ERROR, i] = -motors[RATE, i]
    assemble(cables, solver)
    if factorise(solver, 0.0):
        for k in range(6):
            twist[k] = solver[GRADIENT, k]
        substitute(solver, twist)
    apart = 0.0
    for i in range(n):
        rate = motors[RATE, i]
        for k in range(6):
            rate -= cables[k, i] * twist[k]
        apart += rate * rate
    return math.sqrt(cost / n), math.sqrt(apart / n)


@jit
def stretch(motors: FloatArray, cables: FloatArray, up: FloatArray) -> None:
    """Write each cable's STRETCH under its TENSION at the pose of `cables`, where it can be had."""
    for i in range(motors.shape[1]):
        sine = 0.0
        for k in range(3):
            sine += cables[k, i] * up[k]
        free, tension, compliance = cables[FREE, i], motors[TENSION, i], motors[COMPLIANCE, i]
        across = free * math.sqrt(max(1.0 - sine * sine, 0.0))
        length = unstretched_length(across, free * sine, tension, compliance, motors[WEIGHT, i])
        length += cables[ARC, i] / (1.0 + tension * compliance)
        if length > 0.0:
            motors[STRETCH, i] = (free + cables[ARC, i]) / length


@jit
def _turn_to_equilibrium(motors: FloatArray, geometry: FloatArray, pose: FloatArray) -> None:
    """Turn the platform about z by one Newton step to where tensions have no moment about it."""
    moment, slope = 0.0, 0.0
    for i in range(motors.shape[1]):
        x = pose[1, 0] * geometry[ANCHOR, i] + pose[1, 1] * geometry[ANCHOR + 1, i]
        y = pose[2, 0] * geometry[ANCHOR, i] + pose[2, 1] * geometry[ANCHOR + 1, i]
        wx, wy = geometry[0, i] - pose[0, 0] - x, geometry[1, i] - pose[0, 1] - y
        rho = math.sqrt(wx * wx + wy * wy)
        wx, wy = wx / rho, wy / rho
        across, along = x * wy - y * wx, -y * wx + x * wy
        tension = motors[TENSION, i]
        moment += tension * across
        slope -= tension * (x * wx + y * wy + (x * x + y * y - along * across) / rho)
    if slope < 0.0:
        angle = min(max(-moment / slope, -_MOST_TURN_rad), _MOST_TURN_rad)
        cosine, sine = math.cos(angle), math.sin(angle)
        for k in range(3):
            a, b = pose[1, k], pose[2, k]
            pose[1, k], pose[2, k] = cosine * a - sine * b, sine * a + cosine * b
