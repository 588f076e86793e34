"""Kernels of one cycle: a platform's set-point as a pose, and as its motors' set-points.

A set-point is (d,), one entry for each controlled direction: coordinates of the origin, and the
rotation vector φ from the orientation at home, Q = exp(φ) Q_home. For angles below half a turn
that is singular nowhere.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.kinematics.cable_kernel import ARC, FREE, run_cables
from cdpr_rt.robots.kinematics.pose import exponential, logarithm
from cdpr_rt.robots.kinematics.pose_tracking import AT_ZERO, M_PER_RAD, STRETCH

_SMALL = 1e-4


@jit
def pose_of_coordinates(
    q: FloatArray, directions: IntArray, home: FloatArray, scratch: FloatArray, pose: FloatArray
) -> None:
    """Write the pose of a set-point `q` (d,); what is not controlled is as at `home` (4, 3)."""
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
    """Write x = pose ⊟ other (6,), as of `pose`: the logarithm map."""
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
    """Write the angular velocity J(φ) (x, y, z) of a rotation vector that changes so, (3,).

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
    """Write twist and its derivative (6,) of a set-point `shaped` (3, d) with its derivatives."""
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
    """Write what a set-point `shaped` (3, d) asks for: motions, error, and the motors' set-points.

    `wanted` (4, 3) is its pose, `twist` and `acceleration` (6,) how it moves, `error` (6,) wanted
    ⊟ pose. The motors' are (n,) each, eqs. (2.2), (2.4), (3.2), (3.11), with the stretch of each
    cable taken off. Where no angle is controlled the platform is taken to stay as it is turned.
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
