"""Projection through a lens, and stacks of rotations."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray

_NOT_MOVED = np.zeros(3)


def camera_matrix(lens: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) of a lens (fx, fy, cx, cy, k1, k2, p1, p2, k3)."""
    fx, fy, cx, cy = lens[:4]
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def project(points: FloatArray, lens: FloatArray) -> FloatArray:
    """Return the pixels (n, 2) at which the camera sees points (n, 3) of its frame."""
    # OpenCV would always compute derivatives too, which takes thirty times as long
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
    import cv2  # noqa: PLC0415  # needs an extra

    n = len(points)
    if not n:
        return np.zeros((0, 2)), np.zeros((0, 2, 3)), np.zeros((0, 2, 9))
    matrix = camera_matrix(lens)
    pixels, derivatives = cv2.projectPoints(points, _NOT_MOVED, _NOT_MOVED, matrix, lens[4:])
    # the columns are a rotation and a translation of all points, then the lens
    by = np.asarray(derivatives, float).reshape(n, 2, 15)
    return np.asarray(pixels, float).reshape(n, 2), by[..., 3:6], by[..., 6:]


# Stacks of rotations: exponential and logarithm by scipy, and the matrix of a cross product.


def exponentials(vectors: FloatArray) -> FloatArray:
    """Return the rotations (n, 3, 3) of vectors (n, 3), rad."""
    return np.asarray(Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix())


def logarithms(rotations: FloatArray) -> FloatArray:
    """Return the rotation vectors (n, 3), rad, of rotations (n, 3, 3)."""
    return np.asarray(Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec())


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Return the rotation R (k, k) with the largest trace of R^T `matrix` (Kabsch)."""
    left, _, right = np.linalg.svd(matrix)
    sign = np.append(np.ones(len(matrix) - 1), np.sign(np.linalg.det(left @ right)))
    return np.asarray((left * sign) @ right)


def angles(rotations: FloatArray) -> FloatArray:
    """Return the angles of rotations (..., 3, 3), rad."""
    half = 0.5 * (np.trace(rotations, axis1=-2, axis2=-1) - 1.0)
    return np.asarray(np.arccos(np.clip(half, -1.0, 1.0)))


def cross_matrices(v: FloatArray) -> FloatArray:
    """Return [v]× (..., 3, 3) with [v]× w = v × w."""
    out: Any = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 1, 0] = -v[..., 2], v[..., 2]
    out[..., 0, 2], out[..., 2, 0] = v[..., 1], -v[..., 1]
    out[..., 1, 2], out[..., 2, 1] = -v[..., 0], v[..., 0]
    return np.asarray(out)
