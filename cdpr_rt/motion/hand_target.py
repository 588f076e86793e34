"""A platform's target as a hand moves it, within the workspace and the way it takes to stop."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.motion.rotations import multiply, to_quaternion, to_rotation_vector

FREE, AT_EDGE, ON_STAND = 0, 1, 2
"""Reason why a target does not follow the hand."""
LEAD_S = 0.3
"""Longest time for which a platform that is slower than the hand may run on after it."""
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
    """Write the target's rotation, turned as the hand was about the room's axes `about`."""
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
    """Keep the rotation vector in `goal` within `angle`, or what it is beyond that already."""
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
    """Write into `goal` the target (d,) moved as the hand was since `last`; return what limits it.

    The coordinates (k,) move by `scale` times the hand's displacement, within the box from `low` to
    `high`; the rotation vector (d - k,) turns with it, within `angle`. `pose` and `last` are the
    hand's poses (7,), the last one is overwritten; `about` (d - k,) which axes are turned about;
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
        # on its stand the platform is not dragged sideways
        if stands and i != up:
            edge = ON_STAND if moved != 0.0 else edge
            moved = 0.0
        goal[i] = target[i] + (moved if math.isfinite(moved) else 0.0)
    for i in range(last.size):
        last[i] = pose[i]
    for i in range(goal.size):
        # a platform slower than the stream must not run on after the stream has stopped
        reach = speed[i] * (0.5 * speed[i] / acceleration[i] + LEAD_S)
        goal[i] = min(max(goal[i], position[i] - reach), position[i] + reach)
    for i in range(k):
        # outside the box, as the stand may be, it is not pulled into it
        least, most = min(low[i], target[i]), max(high[i], target[i])
        if goal[i] < least or goal[i] > most:
            edge = max(edge, AT_EDGE)
            goal[i] = min(max(goal[i], least), most)
    return max(edge, _limit_turn(k, angle, target, goal))
