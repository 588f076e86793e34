"""Projection through a lens with the distortion of Brown and Conrady, its derivatives, its inverse.

Intrinsics are an array (9,): fx, fy, cx, cy, k1, k2, p1, p2, k3, as in `CameraIntrinsics`.
"""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray

_INVERSE_STEPS = 30
_INVERSE_END = 1e-12


def project(points: FloatArray, lens: FloatArray) -> FloatArray:
    """Return the pixels (n, 2) at which points (n, 3) of the camera's frame are seen."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    s = x * x + y * y
    radial = 1.0 + s * (k1 + s * (k2 + s * k3))
    u = x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x)
    v = y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y
    return np.column_stack([fx * u + cx, fy * v + cy])


def project_with_derivatives(
    points: FloatArray, lens: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pixels (n, 2), their derivatives by the points (n, 2, 3) and by `lens` (n, 2, 9)."""
    z = points[:, 2]
    x, y = points[:, 0] / z, points[:, 1] / z
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    s = x * x + y * y
    radial = 1.0 + s * (k1 + s * (k2 + s * k3))
    slope = 2.0 * (k1 + s * (2.0 * k2 + 3.0 * s * k3))  # of `radial` by x, over x
    u = x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x)
    v = y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y
    ux = fx * (radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x)
    uy = fx * (slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y)
    vx = fy * (slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y)
    vy = fy * (radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x)
    by_point = np.empty((len(points), 2, 3))
    by_point[:, 0, 0], by_point[:, 0, 1] = ux / z, uy / z
    by_point[:, 1, 0], by_point[:, 1, 1] = vx / z, vy / z
    by_point[:, 0, 2] = -(x * ux + y * uy) / z
    by_point[:, 1, 2] = -(x * vx + y * vy) / z
    by_lens = np.zeros((len(points), 2, 9))
    by_lens[:, 0, 0], by_lens[:, 1, 1] = u, v
    by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
    for k, power in ((4, s), (5, s * s), (8, s * s * s)):
        by_lens[:, 0, k], by_lens[:, 1, k] = fx * x * power, fy * y * power
    by_lens[:, 0, 6], by_lens[:, 1, 6] = fx * 2.0 * x * y, fy * (s + 2.0 * y * y)
    by_lens[:, 0, 7], by_lens[:, 1, 7] = fx * (s + 2.0 * x * x), fy * 2.0 * x * y
    return np.column_stack([fx * u + cx, fy * v + cy]), by_point, by_lens


def directions(pixels: FloatArray, lens: FloatArray) -> FloatArray:
    """Return X/Z, Y/Z (n, 2) that are seen at pixels (n, 2), by fixed-point iteration."""
    wanted = (pixels - lens[2:4]) / lens[:2]
    found = wanted.copy()
    ideal = np.concatenate([(1.0, 1.0, 0.0, 0.0), lens[4:]])
    for _ in range(_INVERSE_STEPS):
        off = wanted - project(np.column_stack([found, np.ones(len(found))]), ideal)
        found += off
        if not np.abs(off).max(initial=0.0) > _INVERSE_END:
            break
    return found
