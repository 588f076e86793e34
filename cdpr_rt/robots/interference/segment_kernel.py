"""Kernels of distances between segments and boxes, in m; exact but for rounding.

Points are (3,), a box (2, 3) is its least and its greatest coordinates. The nearest points go into
`near` (2, 3), that of what is named first in its first row.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

_CUTS = 60
_PARALLEL = 1e-12
"""Squared sine of an angle below which two segments are taken to be parallel."""


@jit
def segment_to_segment(
    p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray, near: FloatArray
) -> float:
    """Return the distance of the segments p q and r s: ζ of Tremblay (thesis), eq. (3.37).

    The lines' nearest points, where both are on the segments; else one of the nearest points is
    an end.
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
    """Return the distance of the segment p q from a box, 0 where it enters it.

    The square of a point's distance is convex along the segment, and its slope linear between the
    places where the segment crosses planes of the box: the place where it is 0 lies between the
    last such place with a slope below 0 and the first one above.
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
    """Return the distance of a box at a `pose` (4, 3) from one that is not turned; 0 inside.

    Of two boxes apart, an edge of one is at the nearest points. `corners` (8, 3) and `near` are
    overwritten.
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
    """Return how far the segment p q is inside a box: of its points, the most to the next side.

    How far a point is beyond the sides is convex along the segment. Below 0 for one outside.
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
    """Return how far a box at a `pose` (4, 3) overlaps one that is not turned.

    Along the direction, of those square to the sides of either, in which they overlap the least.
    """
    least = math.inf
    for axis in range(6):
        apart, reach = 0.0, 0.0
        for j in range(3):
            # the unit vector, of the room's or the box's axes, times both middles and half sizes
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
    """Write the corners (8, 3) of a box at a pose; bit k of a corner's number is its side."""
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
