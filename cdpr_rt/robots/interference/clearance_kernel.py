"""Kernels of the clearances of cables, platform and boxes at poses, in m.

    ends    (2, n, 3)    where the free part of each cable begins (at its exit point or the tangent
                         of its pulley) and where it ends, in the room
    points  (4, 3)       ends of the segments of a pair, as far as they count
    near    (2, 3)       their nearest points

Of a cable the `least` metres next to a point that it shares are left out: TRIMMED has bits EXIT
and ANCHOR. At most half of it is.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interference.segment_kernel import (
    box_depth,
    box_to_box,
    segment_depth,
    segment_to_box,
    segment_to_segment,
)
from cdpr_rt.robots.kinematics.cable_kernel import ANCHOR as ANCHORS
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, FREE, run_cables

KIND, FIRST, SECOND, TRIMMED = range(4)
CABLES, CABLE_BODY, CABLE_BOX, BODY_BOX = range(4)
EXIT, ANCHOR = 1, 2
TRIM_TIMES: Final = 10.0
"""Length that is left out, as a multiple of the clearance: cables that leave a point at more than
1/10 rad (5.7 deg) from each other are clear of each other."""


class Scene(NamedTuple):
    """Cables, platform and boxes of a robot, and the pairs of them that are compared."""

    geometry: FloatArray
    """(10, n), as of `cable_kernel`."""
    boxes: FloatArray
    """(1 + k, 2, 3): the platform's body in its own frame, then boxes of the room."""
    pairs: IntArray
    """(q, 4), columns KIND, FIRST, SECOND, TRIMMED."""
    clearance: float
    """Distance below which a pair is in contact, m."""
    trim: float
    """Length of a cable that is left out next to a point that it shares, m."""


@jit
def write_clearances(
    scene: Scene, poses: FloatArray, clearances: FloatArray, nearest: IntArray
) -> None:
    """Write the least distance of all pairs (m,), and which pair it is, at poses (m, 4, 3)."""
    n = scene.geometry.shape[1]
    cables, ends = np.empty((CABLE_ROWS, n)), np.empty((2, n, 3))
    points, near, corners = np.empty((4, 3)), np.empty((2, 3)), np.empty((8, 3))
    for j in range(clearances.size):
        write_ends(scene.geometry, poses[j], cables, ends)
        clearances[j], nearest[j] = math.inf, -1
        for k in range(scene.pairs.shape[0]):
            apart = distance(scene, k, poses[j], ends, points, near, corners)
            if not apart >= clearances[j]:
                clearances[j], nearest[j] = apart, k


@jit
def write_ends(
    geometry: FloatArray, pose: FloatArray, cables: FloatArray, ends: FloatArray
) -> None:
    """Write where the free parts of the cables begin and end at a pose; `cables` as well."""
    run_cables(geometry, pose, cables)
    for i in range(geometry.shape[1]):
        for k in range(3):
            anchor = pose[0, k]
            for j in range(3):
                anchor += pose[1 + k, j] * geometry[ANCHORS + j, i]
            ends[0, i, k], ends[1, i, k] = anchor - cables[FREE, i] * cables[k, i], anchor


@jit
def distance(
    scene: Scene,
    k: int,
    pose: FloatArray,
    ends: FloatArray,
    points: FloatArray,
    near: FloatArray,
    corners: FloatArray,
) -> float:
    """Return the distance of pair `k`; write its points and nearest points.

    Those of a cable and the body are in the platform's frame, all others in the room's.
    """
    pair, boxes, trim = scene.pairs[k], scene.boxes, scene.trim
    kind, first, second = pair[KIND], pair[FIRST], pair[SECOND]
    if kind == BODY_BOX:
        return box_to_box(pose, boxes[0], boxes[second], corners, near)
    _take(ends, first, pair[TRIMMED], trim, points[:2])
    if kind == CABLES:
        _take(ends, second, pair[TRIMMED], trim, points[2:])
        return segment_to_segment(points[0], points[1], points[2], points[3], near)
    if kind == CABLE_BODY:
        _into_platform(pose, points[0])
        _into_platform(pose, points[1])
        return segment_to_box(points[0], points[1], boxes[0], near)
    return segment_to_box(points[0], points[1], boxes[second], near)


@jit
def depth(scene: Scene, k: int, pose: FloatArray, ends: FloatArray, points: FloatArray) -> float:
    """Return the penetration depth of pair `k`, which is not apart; 0 for two cables."""
    pair, boxes, trim = scene.pairs[k], scene.boxes, scene.trim
    kind, first, second = pair[KIND], pair[FIRST], pair[SECOND]
    if kind == CABLES:
        return 0.0
    if kind == BODY_BOX:
        return box_depth(pose, boxes[0], boxes[second])
    _take(ends, first, pair[TRIMMED], trim, points[:2])
    if kind == CABLE_BODY:
        _into_platform(pose, points[0])
        _into_platform(pose, points[1])
        return segment_depth(points[0], points[1], boxes[0])
    return segment_depth(points[0], points[1], boxes[second])


@jit
def _take(ends: FloatArray, i: int, trimmed: int, trim: float, points: FloatArray) -> None:
    """Write the ends of a cable as far as it counts."""
    square = 0.0
    for k in range(3):
        square += (ends[1, i, k] - ends[0, i, k]) ** 2
    share = min(trim / max(math.sqrt(square), trim), 0.5)
    at_exit = share if trimmed & EXIT else 0.0
    at_anchor = share if trimmed & ANCHOR else 0.0
    for k in range(3):
        start, step = ends[0, i, k], ends[1, i, k] - ends[0, i, k]
        points[0, k], points[1, k] = start + at_exit * step, ends[1, i, k] - at_anchor * step


@jit
def _into_platform(pose: FloatArray, point: FloatArray) -> None:
    x, y, z = point[0] - pose[0, 0], point[1] - pose[0, 1], point[2] - pose[0, 2]
    for k in range(3):
        point[k] = pose[1, k] * x + pose[2, k] * y + pose[3, k] * z
