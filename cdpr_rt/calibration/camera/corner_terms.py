"""Terms of markers' corners in the fit: residuals, derivatives and their normal equations.

A corner is seen at π(R_c^T (t_m + R_m s c - p_c)) with p_c = p + Q h and R_c = Q R_h for a platform
at (p, Q) and a camera at (h, R_h) on it. With the derivative D by the camera's pose, those by the
platform's twist and by the camera's place on it are

    D [1, -[Q h]×; 0, 1]    and    D [Q, 0; 0, Q]

A corner's residual is its distance over its standard deviation, with Cauchy's loss of width
c = 3 noise deviations: c² log(1 + (d/c)²), that is the weight 1/(1 + (d/c)²).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.camera.camera_model import LENS, SIZE, CameraModel
from cdpr_rt.calibration.markers.geometry.rotations import cross_matrices
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

_WIDTH = 3.0


@dataclass(frozen=True)
class CornerTerms:
    """n markers in images: residuals over standard deviations, and blocks of derivatives."""

    residual: FloatArray
    """(n, 8)"""
    by_pose: FloatArray
    """By the platform's twist, (n, 8, 6)."""
    by_camera: FloatArray
    """By what all images share: the camera on the platform, size, lens; (n, 8, C)."""
    by_marker: FloatArray
    """(n, 8, 6)"""


def corner_residuals(camera: CameraModel, seen: SeenMarkers, poses: FloatArray) -> FloatArray:
    """Return how far corners are off, px, (n, 4, 2); inf behind the camera."""
    return camera.views(seen, poses).off_px(camera.lens)


def corner_weights(camera: CameraModel, off_px: FloatArray) -> FloatArray:
    """Return the weights (n, 4) of corners that are so far off."""
    squares = (off_px**2).sum(axis=2)
    return np.asarray(1.0 / (1.0 + squares / (_WIDTH * camera.knowledge.noise_px) ** 2))


def corner_cost(camera: CameraModel, off_px: FloatArray, robust: bool) -> float:
    """Return what corners add to the sum of squares."""
    known = camera.knowledge
    squares = (off_px**2).sum(axis=2)
    if robust and np.isfinite(squares).all():
        width = (_WIDTH * known.noise_px) ** 2
        squares = width * np.log1p(squares / width)
    return float(squares.sum()) / known.sigma_px**2


def corner_terms(camera: CameraModel, seen: SeenMarkers, poses: FloatArray) -> CornerTerms:
    """Return residuals and derivatives of a platform at poses (N, 4, 3), one for each image."""
    n, sigma = len(seen), camera.knowledge.sigma_px
    corners = camera.views(seen, poses).corners(camera.lens)
    Q = poses[:, 1:]
    carried = np.tile(np.eye(6), (len(poses), 1, 1))
    carried[:, :3, 3:] = -cross_matrices(Q @ camera.position_m)
    own = np.zeros((len(poses), 6, 6))
    own[:, :3, :3] = own[:, 3:, 3:] = Q
    by_camera = np.empty((n, 8, camera.first_marker))
    by_camera[..., :SIZE] = corners.by_camera @ own[seen.image]
    by_camera[..., SIZE:LENS] = corners.by_size / (1.0 + camera.size_change)
    by_camera[..., LENS:] = corners.by_lens[..., camera.free_lens]
    return CornerTerms(
        corners.off_px.reshape(n, 8) / sigma,
        corners.by_camera @ carried[seen.image] / sigma,
        by_camera / sigma,
        corners.by_marker / sigma,
    )


@dataclass(frozen=True)
class CornerNormals:
    """Blocks of the normal equations of corners, with P parameters of the camera and N poses."""

    H: FloatArray
    """(P, P)"""
    E: FloatArray
    """(N, P, 6)"""
    C: FloatArray
    """(N, 6, 6)"""
    by_parameter: FloatArray
    """Gradients, (P,) and (N, 6)."""
    by_pose: FloatArray


def corner_normals(
    camera: CameraModel, seen: SeenMarkers, terms: CornerTerms, weights: FloatArray, poses: int
) -> CornerNormals:
    """Return Σ J^T w J and Σ J^T w r, of which each marker in an image fills a few blocks."""
    root = np.repeat(np.sqrt(weights), 2, axis=1)[..., None]
    shared = camera.first_marker
    if camera.held:
        J = terms.by_pose * root
    else:
        J = np.concatenate([terms.by_pose, terms.by_camera, terms.by_marker], axis=2) * root
    JT = np.swapaxes(J, 1, 2)
    G, g = JT @ J, (JT @ (terms.residual[..., None] * root))[..., 0]
    C, by_pose = _sum(seen.image, poses, G[:, :6, :6]), _sum(seen.image, poses, g[:, :6])
    size, markers = camera.size, len(camera.ids)
    H, E, gradient = np.zeros((size, size)), np.zeros((poses, size, 6)), np.zeros(size)
    if not camera.held:
        E[:, :shared] = _sum(seen.image, poses, G[:, 6 : 6 + shared, :6])
        of_markers = E[:, shared:].reshape(poses, markers, 6, 6)
        of_markers[seen.image, seen.marker] = G[:, 6 + shared :, :6]
        across = _sum(seen.marker, markers, G[:, 6 + shared :, 6:])
        H[:shared, :shared] = G[:, 6 : 6 + shared, 6 : 6 + shared].sum(axis=0)
        H[shared:, :shared] = across[..., :shared].reshape(-1, shared)
        H[:shared, shared:] = H[shared:, :shared].T
        own = H[shared:, shared:].reshape(markers, 6, markers, 6)
        each = np.arange(markers)
        own[each, :, each] = across[..., shared:]
        gradient[:shared] = g[:, 6 : 6 + shared].sum(axis=0)
        gradient[shared:] = _sum(seen.marker, markers, g[:, 6 + shared :]).ravel()
    return CornerNormals(H, E, C, gradient, by_pose)


def _sum(number: IntArray, count: int, blocks: FloatArray) -> FloatArray:
    """Return the sums (count, ...) of blocks (n, ...) with the same number."""
    n = len(number)
    picks: Any = csr_array((np.ones(n), (number, np.arange(n))), shape=(count, n))
    return np.asarray(picks @ blocks.reshape(n, -1)).reshape(count, *blocks.shape[1:])
