"""A platform's target that follows an input device, within workspace and braking distance."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

# Rotation vectors and unit quaternions (w x y z), compiled.

_SMALL_rad = 1e-9


@jit
def to_quaternion(phi: FloatArray, q: FloatArray) -> None:
    """Write the quaternion `q` (4,) of the rotation by the vector `phi` (3,), rad."""
    angle = math.sqrt(phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2)
    share = math.sin(0.5 * angle) / angle if angle > _SMALL_rad else 0.5
    q[0] = math.cos(0.5 * angle)
    for i in range(3):
        q[1 + i] = share * phi[i]


@jit
def to_rotation_vector(q: FloatArray, phi: FloatArray) -> None:
    """Write the rotation vector `phi` (3,), rad, up to π long, of the quaternion `q` (4,)."""
    size = math.sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    sign = 1.0 if q[0] >= 0.0 else -1.0
    share = 2.0
    if size > _SMALL_rad:
        share = 2.0 * math.atan2(size, sign * q[0]) / size
    for i in range(3):
        phi[i] = sign * share * q[1 + i]


@jit
def multiply(p: FloatArray, q: FloatArray, inverted: bool, out: FloatArray) -> None:
    """Write the product p q, or with `inverted` p q*, into `out` (4,), which must be another
    array.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    if inverted:
        x, y, z = -x, -y, -z
    out[0] = p[0] * w - p[1] * x - p[2] * y - p[3] * z
    out[1] = p[0] * x + p[1] * w + p[2] * z - p[3] * y
    out[2] = p[0] * y - p[1] * z + p[2] * w + p[3] * x
    out[3] = p[0] * z + p[1] * y - p[2] * x + p[3] * w


FREE, AT_EDGE, ON_STAND = 0, 1, 2
"""Reasons why a target does not follow the input device."""
LEAD_S = 0.3
"""Longest time for which a slower platform may continue after the hand has stopped."""
_BELOW_m = 1e-3


@jit
def _turn(
    k: int,
    about: IntArray,
    pose: FloatArray,
    last: FloatArray,
    target: FloatArray,
    scratch: FloatArray,
    goal: FloatArray,
) -> None:
    """Write the target's rotation, rotated like the hand about the room's axes `about`."""
    delta, vector, here, there = scratch[0], scratch[1], scratch[2], scratch[3]
    multiply(pose[3:], last[3:], True, delta)
    to_rotation_vector(delta, here[:3])
    vector[:] = there[:] = 0.0
    for j in range(about.size):
        vector[about[j]] = here[about[j]]
        there[about[j]] = target[k + j]
    to_quaternion(vector[:3], delta)
    to_quaternion(there[:3], here)
    multiply(delta, here, False, there)
    to_rotation_vector(there, vector[:3])
    for j in range(about.size):
        goal[k + j] = vector[about[j]]


@jit
def _limit_turn(k: int, angle: float, target: FloatArray, goal: FloatArray) -> int:
    """Limit the rotation vector in `goal` to `angle`, or to the target's if that is larger."""
    turned = had = 0.0
    for i in range(k, goal.size):
        turned += goal[i] ** 2
        had += target[i] ** 2
    turned, most = math.sqrt(turned), max(angle, math.sqrt(had))
    if not turned > most:
        return FREE
    for i in range(k, goal.size):
        goal[i] *= most / turned
    return AT_EDGE


@jit
def lead(
    scale: float,
    pose: FloatArray,
    last: FloatArray,
    about: IntArray,
    low: FloatArray,
    high: FloatArray,
    angle: float,
    speed: FloatArray,
    acceleration: FloatArray,
    position: FloatArray,
    target: FloatArray,
    scratch: FloatArray,
    goal: FloatArray,
) -> int:
    """Write the target (d,), moved by the hand's motion since `last`, into `goal`; return its
    limit.

    The coordinates (k,) move by `scale` times the hand's displacement, within the box from `low` to
    `high`. The rotation vector (d - k,) turns with the hand, within `angle`. `pose` and `last` are
    the hand's poses (7,); `last` is overwritten. `about` (d - k,) are the axes of rotation.
    `scratch` (4, 4) is overwritten.
    """
    k, up, edge = low.size, low.size - 1, FREE
    stands = position[up] < low[up] - _BELOW_m
    for i in range(goal.size):
        goal[i] = target[i]
    if about.size > 0 and not stands:
        _turn(k, about, pose, last, target, scratch, goal)
    for i in range(k):
        moved = scale * (pose[i] - last[i])
        # do not drag the platform sideways on its stand
        if stands and i != up:
            edge = ON_STAND if moved != 0.0 else edge
            moved = 0.0
        goal[i] = target[i] + (moved if math.isfinite(moved) else 0.0)
    for i in range(last.size):
        last[i] = pose[i]
    for i in range(goal.size):
        # a platform that is slower than the stream must not continue after the stream has stopped
        reach = speed[i] * (0.5 * speed[i] / acceleration[i] + LEAD_S)
        goal[i] = min(max(goal[i], position[i] - reach), position[i] + reach)
    for i in range(k):
        # do not pull the platform into the box if it is outside, for example on its stand
        least, most = min(low[i], target[i]), max(high[i], target[i])
        if goal[i] < least or goal[i] > most:
            edge = max(edge, AT_EDGE)
            goal[i] = min(max(goal[i], least), most)
    return max(edge, _limit_turn(k, angle, target, goal))
