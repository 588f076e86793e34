"""Kernels of clearances at poses, and of the first contact on a straight line, without gaps.

The method is that of Tremblay (thesis), eqs. (3.27), (3.36), (3.37), with conservative advancement.
At a position on the way, each pair of bodies has a distance d, along the unit vector n between its
nearest points. Both bodies of a pair are convex. They stay more than the clearance c apart until an
end of one of them has moved along n by d - c plus its distance behind the nearest point. With the
speed g of an end along n and a bound h of its acceleration, both per share s of the way, they stay
apart for

    s up to 2 m / (g + √(g² + 2 h m)),  m = d - c + distance behind

    way  (7, 3)   rows START and STEP of the position, TURNED and TURN of the rotation vector,
                  and a rotation BASE: p = START + s STEP, Q = exp(TURNED + s TURN) BASE

For points at b in the platform's frame the speed is at most |STEP| + |TURN| |b|, and by Duhamel's
formula the acceleration is at most |TURN|² |b|.

    ends    (2, n, 3)    where the free part of each cable begins (at its exit point or the tangent
                         of its pulley) and where it ends, in the room
    points  (4, 3)       ends of the segments of a pair, without the parts that are left out
    near    (2, 3)       the nearest points of the pair

Next to a point that a cable shares with the other body, `least` metres of it are left out, but at
most half of the cable. The bits EXIT and ANCHOR of TRIMMED mark the ends at which this is done.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.model.cable_kernel import ANCHOR as ANCHORS
from cdpr_rt.model.cable_kernel import AXIS, CABLE_ROWS, FREE, RADIUS, TINY, run_cables
from cdpr_rt.model.pose import exponential

# Kernels of distances between segments and boxes, in m; exact except for rounding. Points are (3,).
# A box (2, 3) has its least and its greatest coordinates as rows. The nearest points are written to
# `near` (2, 3): the first row belongs to the first body.

_CUTS = 60
_PARALLEL = 1e-12
"""Squared sine of an angle below which two segments are taken to be parallel."""


@jit
def segment_to_segment(
    p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray, near: FloatArray
) -> float:
    """Return the distance of the segments p q and r s: ζ of Tremblay (thesis), eq. (3.37).

    If the nearest points of the two lines are on the segments, they are the result. Otherwise one
    of the nearest points is an end of a segment.
    """
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = s[0] - r[0], s[1] - r[1], s[2] - r[2]
    wx, wy, wz = p[0] - r[0], p[1] - r[1], p[2] - r[2]
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    uv = ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    along, other = -1.0, -1.0
    left = uu * vv - uv * uv
    if left > _PARALLEL * uu * vv:
        along, other = (uv * vw - vv * uw) / left, (uu * vw - uv * uw) / left
    if not (0.0 <= along <= 1.0 and 0.0 <= other <= 1.0):
        least = math.inf
        for k in range(4):
            if k < 2:
                a = float(k)
                b = _within((vw + a * uv) / vv) if vv > 0.0 else 0.0
            else:
                b = float(k - 2)
                a = _within((b * uv - uw) / uu) if uu > 0.0 else 0.0
            x, y, z = wx + a * ux - b * vx, wy + a * uy - b * vy, wz + a * uz - b * vz
            square = x * x + y * y + z * z
            if square < least:
                least, along, other = square, a, b
    near[0, 0], near[0, 1], near[0, 2] = p[0] + along * ux, p[1] + along * uy, p[2] + along * uz
    near[1, 0], near[1, 1], near[1, 2] = r[0] + other * vx, r[1] + other * vy, r[2] + other * vz
    return _apart(near)


@jit
def segment_to_box(p: FloatArray, q: FloatArray, box: FloatArray, near: FloatArray) -> float:
    """Return the distance of the segment p q from a box, 0 if it enters it.

    The squared distance of a point is convex along the segment. Its slope is linear between the
    points at which the segment crosses the planes of the box. So the slope is zero between the last
    crossing at which it is below 0 and the first one at which it is above 0.
    """
    low, high = 0.0, 1.0
    low_slope, high_slope = _slope(p, q, box, low), _slope(p, q, box, high)
    share = 0.0
    if low_slope < 0.0 < high_slope:
        for k in range(3):
            step = q[k] - p[k]
            if step == 0.0:
                continue
            for side in range(2):
                there = (box[side, k] - p[k]) / step
                if low < there < high:
                    slope = _slope(p, q, box, there)
                    if slope < 0.0:
                        low, low_slope = there, slope
                    else:
                        high, high_slope = there, slope
        share = low + (high - low) * low_slope / (low_slope - high_slope)
    elif low_slope < 0.0:
        share = 1.0
    for k in range(3):
        x = p[k] + share * (q[k] - p[k])
        near[0, k], near[1, k] = x, min(max(x, box[0, k]), box[1, k])
    return _apart(near)


@jit
def box_to_box(
    pose: FloatArray, box: FloatArray, other: FloatArray, corners: FloatArray, near: FloatArray
) -> float:
    """Return the distance of a box at a `pose` (4, 3) from an axis-aligned box; 0 if they overlap.

    If two boxes are apart, one of the nearest points is on an edge of its box. `corners` (8, 3) and
    `near` are overwritten.
    """
    least = math.inf
    _place_corners(pose, box, corners)
    for i in range(8):
        for k in range(3):
            if not i >> k & 1:
                least = min(least, segment_to_box(corners[i], corners[i | 1 << k], other, near))
    for i in range(8):
        for j in range(3):
            # the other box's corner, in this one's frame
            corners[i, j] = 0.0
            for k in range(3):
                corners[i, j] += pose[1 + k, j] * (other[i >> k & 1, k] - pose[0, k])
    for i in range(8):
        for k in range(3):
            if not i >> k & 1:
                least = min(least, segment_to_box(corners[i], corners[i | 1 << k], box, near))
    return least


@jit
def segment_depth(p: FloatArray, q: FloatArray, box: FloatArray) -> float:
    """Return the largest depth of a point of the segment p q inside a box, below 0 if outside.

    How far a point is beyond the sides of the box is a convex function along the segment.
    """
    low, high = 0.0, 1.0
    for _ in range(_CUTS):
        third = (high - low) / 3.0
        if _beyond(p, q, box, low + third) < _beyond(p, q, box, high - third):
            high -= third
        else:
            low += third
    return -_beyond(p, q, box, 0.5 * (low + high))


@jit
def box_depth(pose: FloatArray, box: FloatArray, other: FloatArray) -> float:
    """Return how far a box at a `pose` (4, 3) overlaps an axis-aligned box.

    This is the least overlap along the face normals of both boxes.
    """
    least = math.inf
    for axis in range(6):
        apart, reach = 0.0, 0.0
        for j in range(3):
            # projections on an axis of the room or of the box: both middles and half sizes
            n = pose[1 + j, axis - 3] if axis > 2 else (1.0 if j == axis else 0.0)
            apart += n * (pose[0, j] - 0.5 * (other[0, j] + other[1, j]))
            reach += abs(n) * 0.5 * (other[1, j] - other[0, j])
        for k in range(3):
            along = 0.0
            for j in range(3):
                n = pose[1 + j, axis - 3] if axis > 2 else (1.0 if j == axis else 0.0)
                along += n * pose[1 + j, k]
            apart += along * 0.5 * (box[0, k] + box[1, k])
            reach += abs(along) * 0.5 * (box[1, k] - box[0, k])
        least = min(least, reach - abs(apart))
    return least


@jit
def _beyond(p: FloatArray, q: FloatArray, box: FloatArray, share: float) -> float:
    """Return how far a point of p q is beyond a side of a box, below 0 within all of them."""
    most = -math.inf
    for k in range(3):
        x = p[k] + share * (q[k] - p[k])
        most = max(most, box[0, k] - x, x - box[1, k])
    return most


@jit
def _place_corners(pose: FloatArray, box: FloatArray, corners: FloatArray) -> None:
    """Write the corners (8, 3) of a box at a pose; bit k of an index is the side along axis k."""
    for i in range(8):
        for j in range(3):
            corners[i, j] = pose[0, j]
            for k in range(3):
                corners[i, j] += pose[1 + j, k] * box[i >> k & 1, k]


@jit
def _slope(p: FloatArray, q: FloatArray, box: FloatArray, share: float) -> float:
    """Return half the derivative of a point's squared distance from a box along p q."""
    slope = 0.0
    for k in range(3):
        step = q[k] - p[k]
        x = p[k] + share * step
        slope += step * (max(x - box[1, k], 0.0) - max(box[0, k] - x, 0.0))
    return slope


@jit
def _within(share: float) -> float:
    return min(max(share, 0.0), 1.0)


@jit
def _apart(near: FloatArray) -> float:
    x, y, z = near[1, 0] - near[0, 0], near[1, 1] - near[0, 1], near[1, 2] - near[0, 2]
    return math.sqrt(x * x + y * y + z * z)


KIND, FIRST, SECOND, TRIMMED = range(4)
CABLES, CABLE_BODY, CABLE_BOX, BODY_BOX = range(4)
EXIT, ANCHOR = 1, 2
TRIM_TIMES: Final = 10.0
"""Length that is left out, as a multiple of the clearance: two cables from one point are then clear
of each other if the angle between them is more than 1/10 rad (5.7 deg)."""


class Scene(NamedTuple):
    """Cables, platform and boxes of a robot, and the pairs of these bodies to be checked."""

    geometry: FloatArray
    """(10, n), as in `cable_kernel`."""
    boxes: FloatArray
    """(1 + k, 2, 3): the platform's body in its own frame, then boxes of the room."""
    pairs: IntArray
    """(q, 4), columns KIND, FIRST, SECOND, TRIMMED."""
    clearance: float
    """Distance below which a pair is in contact, m."""
    trim: float
    """Length of a cable that is left out next to a shared point, m."""


@jit
def write_clearances(
    scene: Scene, poses: FloatArray, clearances: FloatArray, nearest: IntArray
) -> None:
    """Write the least distance (m,) over all pairs, and that pair's index, at poses (m, 4, 3)."""
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
    """Write both ends of the free parts of the cables at a pose, and `cables`."""
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

    For a cable and the body the points are in the platform's frame, otherwise in the room's.
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
    """Return the penetration depth of the overlapping pair `k`; 0 for two cables."""
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
    """Write the ends of a cable without the parts that are left out."""
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


# Kernel of the first contact on a way.

START, STEP, TURNED, TURN, BASE, WAY_ROWS = 0, 1, 2, 3, 4, 7
TOUCH_m: Final = 1e-6
"""Distance above the clearance below which a pair is in contact."""
_LEAVING: Final = 0.9
"""Share of its initial distance that a pair in contact at the start has to keep."""
_LEAVES: Final = 4.0
"""Longest motion of the platform after which overlapping bodies must be apart, in clearances."""
_WATCHES: Final = 32
"""Number of checks during that motion."""
_DEEPER: Final = 0.05
"""Increase of the depth that is allowed during that motion, in clearances, for rounding and
play."""
_SPEED, _ACCELERATION, _EXIT, _FAR, _FREE, _HOLDS, _RATES = range(7)
_TOGETHER = 0.02
"""Pairs whose next check is due within this share of the way are checked together."""
MOST_LOOKS: Final = 20_000
_SMALL = 1e-4


class _Look(NamedTuple):
    """Work arrays for one position on the way, overwritten at each position."""

    pose: FloatArray
    twist: FloatArray
    """(2, 3)"""
    points: FloatArray
    """(4, 3), and `near` (2, 3), of the pair being checked, as in `distance`."""
    near: FloatArray
    rates: FloatArray
    """(7, n): bounds of speeds and accelerations of each cable's ends."""
    moves: FloatArray
    """(4, 3): distance behind the nearest point, speed along n, and acceleration of both ends of
    both bodies of the pair."""


@jit
def first_contact(scene: Scene, way: FloatArray, most_looks: int) -> tuple[float, int, float, bool]:
    """Return the share of the way at which a pair comes into contact, the pair, and its distance.

    Returns 2.0 and -1 if there is no contact. A pair in contact at the start must not come much
    closer, and must be clear at the end. Things that overlap at the start must not overlap more.
    They must be clear before the platform has moved by _LEAVES clearances, and stay clear. A pair
    that `most_looks` checks do not prove clear counts as in contact. The last value returned is
    whether the contact is certain.
    """
    allowed = np.empty(scene.pairs.shape[0])
    allowed[:] = scene.clearance
    share, pair, apart, known = _advance(scene, way, most_looks, allowed)
    if pair < 0:
        pair, apart = _still_near(scene, way, allowed)
        share = 2.0 if pair < 0 else 1.0
    return share, pair, apart, known


@jit
def _advance(
    scene: Scene, way: FloatArray, most_looks: int, allowed: FloatArray
) -> tuple[float, int, float, bool]:
    """Return the first contact on the way; write the distances that pairs have to keep."""
    geometry, clearance = scene.geometry, scene.clearance
    n, count = geometry.shape[1], scene.pairs.shape[0]
    look = _Look(
        np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3)), np.empty((2, 3)),
        np.empty((_RATES, n)), np.empty((4, 3)),
    )  # fmt: skip
    pose, twist, points, near, rates, _ = look
    cables, ends = np.empty((CABLE_ROWS, n)), np.empty((2, n, 3))
    corners, scratch = np.empty((8, 3)), np.empty((4, 3))
    until, least = np.zeros(count), np.empty(count)
    least[:] = -math.inf
    body_speed = _write_speeds(geometry, scene.boxes, way, rates)
    share, looks, fastest = 0.0, 0, body_speed
    for i in range(n):
        fastest = max(fastest, rates[_SPEED, i])
    leaves = _LEAVES * clearance / (fastest + TINY)
    while share < 1.0:
        place_on(way, share, scratch, pose, twist)
        write_ends(geometry, pose, cables, ends)
        _write_exit_speeds(geometry, pose, way, cables, ends, rates)
        for k in range(count):
            if until[k] > share + _TOGETHER:
                continue
            apart = distance(scene, k, pose, ends, points, near, corners)
            if looks == 0:
                allowed[k] = _to_keep(apart, clearance)
            if allowed[k] < 0.0 and share < leaves:
                if not apart > 0.0:
                    apart = -depth(scene, k, pose, ends, points)
                if apart < least[k]:
                    return share, k, max(apart, 0.0), True
                least[k] = max(least[k], apart - _DEEPER * clearance)
                until[k] = min(share + leaves / _WATCHES, leaves)
                continue
            if allowed[k] < 0.0:
                allowed[k] = clearance  # the overlap must have ended
            if apart - allowed[k] >= TOUCH_m and looks < most_looks:
                kept = _clear_for(scene, k, apart, allowed[k], way, body_speed, look)
                until[k] = share + kept
            elif until[k] <= share:
                return share, k, apart, apart - allowed[k] < TOUCH_m
        share = 1.0
        for k in range(count):
            share = min(share, until[k])
        looks += 1
    return 2.0, -1, math.inf, True


@jit
def _still_near(scene: Scene, way: FloatArray, allowed: FloatArray) -> tuple[int, float]:
    """Return the first pair in contact at the start that is not clear at the end, -1 for none."""
    n, clearance = scene.geometry.shape[1], scene.clearance
    pose, twist, scratch, points = (
        np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3)), np.empty((4, 3)),
    )  # fmt: skip
    near, corners, ends = np.empty((2, 3)), np.empty((8, 3)), np.empty((2, n, 3))
    place_on(way, 1.0, scratch, pose, twist)
    write_ends(scene.geometry, pose, np.empty((CABLE_ROWS, n)), ends)
    for k in range(scene.pairs.shape[0]):
        if allowed[k] < clearance:
            apart = distance(scene, k, pose, ends, points, near, corners)
            if not apart >= clearance:
                return k, apart
    return -1, math.inf


@jit
def _to_keep(apart: float, clearance: float) -> float:
    """Return the distance that a pair has to keep, below 0 if it overlaps at the start."""
    return clearance if apart >= clearance + TOUCH_m else _LEAVING * apart - TOUCH_m


@jit
def place_on(
    way: FloatArray, share: float, scratch: FloatArray, pose: FloatArray, twist: FloatArray
) -> None:
    """Write the pose at a share of the way, and its derivative by the share: twist (2, 3).

    `scratch` (4, 3) is overwritten.

    For a rotation vector φ with derivative φ' the angular velocity is φ' + (1 - cos θ)/θ² φ × φ' +
    (θ - sin θ)/θ³ φ × (φ × φ').
    """
    phi, turn = scratch[0], scratch[1:4]
    for k in range(3):
        phi[k] = way[TURNED, k] + share * way[TURN, k]
        twist[0, k] = way[STEP, k]
        pose[0, k] = way[START, k] + share * way[STEP, k]
    exponential(phi, turn)
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += turn[i, k] * way[BASE + k, j]
            pose[1 + i, j] = entry
    x, y, z = phi[0], phi[1], phi[2]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    first, second = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    if angle > _SMALL:
        first, second = (1.0 - math.cos(angle)) / square, (angle - math.sin(angle)) / square / angle
    tx, ty, tz = way[TURN, 0], way[TURN, 1], way[TURN, 2]
    cx, cy, cz = y * tz - z * ty, z * tx - x * tz, x * ty - y * tx
    twist[1, 0] = tx + first * cx + second * (y * cz - z * cy)
    twist[1, 1] = ty + first * cy + second * (z * cx - x * cz)
    twist[1, 2] = tz + first * cz + second * (x * cy - y * cx)


@jit
def size_of(vector: FloatArray) -> float:
    """Return the length of a vector (3,)."""
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@jit
def _write_speeds(
    geometry: FloatArray, boxes: FloatArray, way: FloatArray, rates: FloatArray
) -> float:
    """Write bounds of anchor points' speeds and accelerations; return the bound of the body's."""
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    for i in range(geometry.shape[1]):
        arm = size_of(geometry[ANCHORS : ANCHORS + 3, i])
        rates[_SPEED, i], rates[_ACCELERATION, i] = step + turn * arm, turn * turn * arm
    furthest = 0.0
    for k in range(3):
        furthest += max(abs(boxes[0, 0, k]), abs(boxes[0, 1, k])) ** 2
    return step + turn * math.sqrt(furthest)


@jit
def _write_exit_speeds(
    geometry: FloatArray,
    pose: FloatArray,
    way: FloatArray,
    cables: FloatArray,
    ends: FloatArray,
    rates: FloatArray,
) -> None:
    """Write speed bounds for the starts of the free parts, and the share for which all bounds hold.

    The start is the point at which a cable leaves its pulley. Let r be the pulley's radius, e the
    anchor's distance from the swivel axis, v its speed, and l the length of the free part. The
    start then moves at r (2 v/e + v/l) at most. The bounds hold while e and l are at least half of
    their present values. In the platform's frame the start also moves because the platform turns.
    """
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    for i in range(geometry.shape[1]):
        v, r, free = rates[_SPEED, i], geometry[RADIUS, i], cables[FREE, i]
        speed, least = 0.0, free
        if r > 0.0:
            along, square = 0.0, 0.0
            for k in range(3):
                apart = ends[1, i, k] - geometry[k, i]
                along += apart * geometry[AXIS + k, i]
                square += apart * apart
            beside = math.sqrt(max(square - along * along, 0.0))
            if beside > 0.0 and free > 0.0:
                speed = r * v * (4.0 / beside + 2.0 / free)
                least = min(beside, free) / (1.0 + 2.0 * r / free)
            else:
                least = 0.0
        rates[_EXIT, i] = speed
        rates[_HOLDS, i], rates[_FREE, i] = 0.5 * least / (v + speed + TINY), free
        far = 0.0
        for k in range(3):
            far += (ends[0, i, k] - pose[0, k]) ** 2
        rates[_FAR, i] = speed + step + turn * (math.sqrt(far) + step + speed)


@jit
def _clear_for(
    scene: Scene,
    k: int,
    apart: float,
    allowed: float,
    way: FloatArray,
    body_speed: float,
    look: _Look,
) -> float:
    """Return the share of the way, from here, for which pair `k` keeps its allowed distance."""
    pair, rates, moves = scene.pairs[k], look.rates, look.moves
    if pair[KIND] == BODY_BOX:
        return (apart - allowed) / (body_speed + TINY)
    moves[:] = 0.0
    least, others = float(rates[_HOLDS, pair[FIRST]]), 1
    _write_moves(pair, 0, apart, scene.trim, way, look)
    if pair[KIND] == CABLES:
        least, others = min(least, rates[_HOLDS, pair[SECOND]]), 2
        _write_moves(pair, 1, apart, scene.trim, way, look)
    for a in range(2):
        for b in range(2, 2 + others):
            left = apart - allowed + moves[a, 0] + moves[b, 0]
            g, h = moves[a, 1] + moves[b, 1], moves[a, 2] + moves[b, 2]
            if a == 1 and b == 3 and pair[TRIMMED] & ANCHOR != 0:
                g = min(g, _apart_at_anchor(scene, pair, way, rates))
            least = min(least, 2.0 * left / (g + math.sqrt(g * g + 2.0 * h * left) + TINY))
    return least


@jit
def _swings(rates: FloatArray, i: int, trim: float) -> float:
    """Return a bound of the speed of a cable's point at distance `trim` from an end, about that
    end.
    """
    return trim * 2.0 * float(rates[_SPEED, i] + rates[_EXIT, i]) / float(rates[_FREE, i])


@jit
def _apart_at_anchor(scene: Scene, pair: IntArray, way: FloatArray, rates: FloatArray) -> float:
    """Return how fast two cables that share an anchor may approach each other near it.

    Without this bound, a way of many metres would need one check per trimmed length.
    """
    speed = size_of(way[TURN]) * scene.clearance
    for row in range(2):
        i = pair[FIRST + row]
        if 4.0 * scene.trim > rates[_FREE, i]:
            return math.inf
        speed += _swings(rates, i, scene.trim)
    return speed


@jit
def _write_moves(
    pair: IntArray, row: int, apart: float, trim: float, way: FloatArray, look: _Look
) -> None:
    """Write how both ends of a pair's first or second (`row` 1) body, a cable, may move."""
    pose, twist, points, near, rates, moves = look
    i, sign = pair[FIRST + row], (1.0 - 2.0 * row) / apart
    nx, ny = sign * (near[1, 0] - near[0, 0]), sign * (near[1, 1] - near[0, 1])
    nz = sign * (near[1, 2] - near[0, 2])
    own, both = near[row], rates[_SPEED, i] + rates[_EXIT, i]
    for end in range(2):
        x = points[2 * row + end]
        behind = nx * (own[0] - x[0]) + ny * (own[1] - x[1]) + nz * (own[2] - x[2])
        trimmed = pair[TRIMMED] & (ANCHOR if end else EXIT) != 0
        speed, bend = 0.0, 0.0
        if pair[KIND] == CABLE_BODY:
            if end == 0:
                speed = rates[_FAR, i]
            elif trimmed:
                speed = trim * (size_of(way[TURN]) + 2.0 * both / rates[_FREE, i])
                if 4.0 * trim > rates[_FREE, i]:
                    speed = rates[_FAR, i]
        elif trimmed:
            speed = 2.0 * both
            if 4.0 * trim <= rates[_FREE, i]:
                speed = (rates[_SPEED, i] if end else rates[_EXIT, i]) + _swings(rates, i, trim)
        elif end == 0:
            speed = rates[_EXIT, i]
        else:
            rx, ry, rz = x[0] - pose[0, 0], x[1] - pose[0, 1], x[2] - pose[0, 2]
            wx, wy, wz = twist[1, 0], twist[1, 1], twist[1, 2]
            along = nx * (twist[0, 0] + wy * rz - wz * ry)
            along += ny * (twist[0, 1] + wz * rx - wx * rz)
            along += nz * (twist[0, 2] + wx * ry - wy * rx)
            speed, bend = max(along, 0.0), rates[_ACCELERATION, i]
        moves[2 * row + end, 0] = max(behind, 0.0)
        moves[2 * row + end, 1], moves[2 * row + end, 2] = speed, bend


# Kernel for every cycle: whether a short straight line leads into contact. Let a pair be d0 and d1
# apart at the ends of a part of the way, and let the points of its two bodies together move by at
# most l. Then the least distance between the ends is at least (d0 + d1 - l) / 2. If that is too
# little, the way is divided into more parts.

_NOTHING_m: Final = 1e-9


@jit
def nears(
    scene: Scene,
    way: FloatArray,
    arm: float,
    cables: FloatArray,
    ends: FloatArray,
    poses: FloatArray,
    scratch: FloatArray,
    before: FloatArray,
    parts: int,
) -> int:
    """Return a pair that comes into contact on a `way`, as in `contact_kernel`, -1 for none.

    A pair in contact at the start of the way may separate, but not approach. If `parts` is 0, only
    the end of the way is checked. `arm` is the distance of the platform's farthest point from its
    origin. `cables`, `ends` (2, 2, n, 3), `poses` (3, 4, 3), `scratch` (5, 8, 3) and `before`
    (pairs,) are overwritten.
    """
    points, near, corners, scratch, twist = (
        scratch[0, :4], scratch[1, :2], scratch[2], scratch[3, :4], scratch[4, :2],
    )  # fmt: skip
    pairs, clearance = scene.pairs, scene.clearance
    moved = size_of(way[STEP]) + arm * size_of(way[TURN])
    for j in range(2):
        place_on(way, float(j), scratch, poses[j], twist)
        write_ends(scene.geometry, poses[j], cables, ends[j])
    close = False
    for k in range(pairs.shape[0]):
        now = distance(scene, k, poses[0], ends[0], points, near, corners)
        then = distance(scene, k, poses[1], ends[1], points, near, corners)
        before[k] = -1.0
        if now >= clearance and then >= clearance:
            if parts > 0 and now + then - _together(pairs[k], moved) < 2.0 * clearance:
                before[k], close = now, True
            continue
        if now <= 0.0 and then <= 0.0:
            now = -depth(scene, k, poses[0], ends[0], points)
            then = -depth(scene, k, poses[1], ends[1], points)
        if then < clearance and not then >= now - _NOTHING_m:
            return k
    for j in range(1, parts + 1 if close else 0):
        place_on(way, j / parts, scratch, poses[2], twist)
        write_ends(scene.geometry, poses[2], cables, ends[0])
        for k in range(pairs.shape[0]):
            if before[k] >= 0.0:
                now = distance(scene, k, poses[2], ends[0], points, near, corners)
                if now + before[k] - _together(pairs[k], moved / parts) < 2.0 * clearance:
                    return k
                before[k] = now
    return -1


@jit
def _together(pair: IntArray, moved: float) -> float:
    """Return the sum of the motions of a pair's bodies if the platform's points move by `moved`."""
    return moved if pair[KIND] in (BODY_BOX, CABLE_BOX) else 2.0 * moved
