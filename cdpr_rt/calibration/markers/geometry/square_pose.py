"""The two poses in which a square can be that is seen at four corners.

A square far away is seen almost as well tilted the other way round. Both are wanted: other images,
or other markers of the same image, tell which it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.geometry.lens import directions
from cdpr_rt.calibration.markers.geometry.rotations import cross_matrices, exponentials
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

_STEPS = 8
_DAMPING = 1e-9


@dataclass(frozen=True)
class SquarePoses:
    """Two poses of each of n squares in the camera's frame, the better one first."""

    rotation: FloatArray
    """(n, 2, 3, 3)."""
    position_m: FloatArray
    """(n, 2, 3), of their middles."""
    error: FloatArray
    """(n, 2), root of the mean square over coordinates, in units of X/Z."""


def square_poses(seen: SeenMarkers, lens: FloatArray) -> SquarePoses:
    """Return the poses of all squares that were seen.

    Those that follow from the homography and its derivative at the square's middle (Collins and
    Bartoli 2014, infinitesimal plane-based pose estimation), then least squares from both.
    """
    n = len(seen)
    points = directions(seen.corners_px.reshape(-1, 2), lens).reshape(n, 4, 2)
    corners = seen.corners_m
    H = _homographies(corners[..., :2], points)
    rotations, positions, errors = [], [], []
    for first in _rotations(H):
        R, t, error = _refined(first, _positions(first, corners, points), corners, points)
        rotations.append(R)
        positions.append(t)
        errors.append(error)
    R, t, error = (np.stack(part, axis=1) for part in (rotations, positions, errors))
    order = np.argsort(error, axis=1)
    rows = np.arange(n)[:, None]
    return SquarePoses(R[rows, order], t[rows, order], error[rows, order])


def _homographies(plane: FloatArray, points: FloatArray) -> FloatArray:
    """Return H (n, 3, 3) with points ~ H (plane, 1), its last entry 1; exact for four points."""
    n = len(plane)
    A = np.zeros((n, 8, 8))
    X, x, y = plane, points[..., 0], points[..., 1]
    A[:, 0::2, 0:2], A[:, 0::2, 2] = X, 1.0
    A[:, 1::2, 3:5], A[:, 1::2, 5] = X, 1.0
    A[:, 0::2, 6:8], A[:, 1::2, 6:8] = -x[..., None] * X, -y[..., None] * X
    h = np.linalg.solve(A, points.reshape(n, 8, 1))[..., 0]
    return np.concatenate([h, np.ones((n, 1))], axis=1).reshape(n, 3, 3)


def _rotations(H: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the two rotations (n, 3, 3) that a homography allows."""
    n = len(H)
    p = H[:, :2, 2]
    J = H[:, :2, :2] - p[:, :, None] * H[:, None, 2, :2]
    # turns the axis of the camera to where the middle is seen
    ray = np.column_stack([p, np.ones(n)])
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    axis = np.column_stack([-ray[:, 1], ray[:, 0], np.zeros(n)])
    sine = np.linalg.norm(axis, axis=1)
    turn = np.arctan2(sine, ray[:, 2]) / np.where(sine > 0.0, sine, 1.0)
    to_ray = exponentials(axis * turn[:, None])
    B = to_ray[:, :2, :2] - p[:, :, None] * to_ray[:, None, 2, :2]
    A = np.linalg.solve(B, J)
    A = A / np.linalg.svd(A, compute_uv=False)[:, 0][:, None, None]
    rest = np.eye(2) - A.transpose(0, 2, 1) @ A
    b0 = np.sqrt(np.maximum(rest[:, 0, 0], 0.0))
    b1 = np.copysign(np.sqrt(np.maximum(rest[:, 1, 1], 0.0)), rest[:, 0, 1])
    both = []
    for sign in (1.0, -1.0):
        first = np.column_stack([A[:, :, 0], sign * b0])
        second = np.column_stack([A[:, :, 1], sign * b1])
        columns = np.stack([first, second, np.cross(first, second)], axis=2)
        left, _, right = np.linalg.svd(to_ray @ columns)
        both.append(left @ right)
    return both[0], both[1]


def _positions(R: FloatArray, corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return the positions (n, 3) that fit best, linear: (R c + t) × (x, y, 1) = 0."""
    n = len(R)
    turned = corners @ R.transpose(0, 2, 1)
    A = np.zeros((n, 8, 3))
    A[:, :4, 0] = A[:, 4:, 1] = 1.0
    A[:, :4, 2], A[:, 4:, 2] = -points[..., 0], -points[..., 1]
    right = np.concatenate(
        [
            points[..., 0] * turned[..., 2] - turned[..., 0],
            points[..., 1] * turned[..., 2] - turned[..., 1],
        ],
        axis=1,
    )
    AT = A.transpose(0, 2, 1)
    return np.asarray(np.linalg.solve(AT @ A, AT @ right[..., None])[..., 0])


def _refined(
    R: FloatArray, t: FloatArray, corners: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rotations, positions and errors after a few steps of least squares."""
    n = len(R)
    best = np.full(n, np.inf)
    best_R, best_t = R.copy(), t.copy()
    for step in range(_STEPS + 1):
        turned = corners @ R.transpose(0, 2, 1)
        at = turned + t[:, None]
        z = np.where(at[..., 2] > 1e-6, at[..., 2], np.inf)
        residual = at[..., :2] / z[..., None] - points
        error = np.sqrt(np.mean(residual**2, axis=(1, 2)))
        error = np.where((at[..., 2] > 1e-6).all(axis=1), error, np.inf)
        better = error < best
        best[better], best_R[better], best_t[better] = error[better], R[better], t[better]
        if step == _STEPS:
            break
        by_point = np.zeros((n, 4, 2, 3))
        by_point[..., 0, 0] = by_point[..., 1, 1] = 1.0 / z
        by_point[..., :, 2] = -at[..., :2] / (z**2)[..., None]
        J = np.concatenate([by_point, -by_point @ cross_matrices(turned)], axis=3).reshape(n, 8, 6)
        JT = J.transpose(0, 2, 1)
        normal = JT @ J
        scale = np.einsum("nii->ni", normal)
        normal += (_DAMPING * scale + 1e-15)[:, :, None] * np.eye(6)
        move = -np.linalg.solve(normal, JT @ residual.reshape(n, 8, 1))[..., 0]
        t = t + move[:, :3]
        R = exponentials(move[:, 3:]) @ R
    return best_R, best_t, best
