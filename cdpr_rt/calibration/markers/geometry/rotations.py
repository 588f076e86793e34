"""Stacks of rotations: exponential and logarithm by scipy, and the matrix of a cross product."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray


def exponentials(vectors: FloatArray) -> FloatArray:
    """Return the rotations (n, 3, 3) of vectors (n, 3), rad."""
    return np.asarray(Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix())


def logarithms(rotations: FloatArray) -> FloatArray:
    """Return the rotation vectors (n, 3), rad, of rotations (n, 3, 3)."""
    return np.asarray(Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec())


def angles(rotations: FloatArray) -> FloatArray:
    """Return by how much rotations (..., 3, 3) turn, rad."""
    half = 0.5 * (np.trace(rotations, axis1=-2, axis2=-1) - 1.0)
    return np.asarray(np.arccos(np.clip(half, -1.0, 1.0)))


def cross_matrices(v: FloatArray) -> FloatArray:
    """Return [v]× (..., 3, 3) with [v]× w = v × w."""
    out: Any = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 1, 0] = -v[..., 2], v[..., 2]
    out[..., 0, 2], out[..., 2, 0] = v[..., 1], -v[..., 1]
    out[..., 1, 2], out[..., 2, 1] = -v[..., 0], v[..., 0]
    return np.asarray(out)
