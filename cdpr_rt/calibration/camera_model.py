"""Fitted parameters of a camera: pose on the platform, size of sheets, lens, and markers.

The order of parameters is: position and rotation of the camera on the platform (6), relative size
of all sheets (1), lens parameters with a standard deviation (up to 9), and position and
rotation of each marker (6 each). Rotations change by exp(x) R.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Self

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera_geometry import cross_matrices, exponentials, logarithms
from cdpr_rt.calibration.marker_bundle import LENS_PARAMETERS, CornerTerms, Views, cauchy_cost
from cdpr_rt.calibration.marker_map import SeenMarkers

SIZE, LENS = 6, 7
"""Indices of the relative size of the sheets, and of the lens, among the parameters."""
UNKNOWN_HAND_EYE_STD: Final = (0.5, 0.5, 0.5, 1.0, 1.0, 1.0)
"""Prior standard deviations of a camera's unknown pose on the platform, m and rad."""
_FREE = 10.0
"""Standard deviation of an unknown parameter, m and rad, so large that it has little weight."""


@dataclass(frozen=True)
class CameraKnowledge:
    """Prior knowledge of a camera and its markers."""

    position_m: FloatArray
    """Position of the camera on the platform, (3,)."""
    rotation: FloatArray
    """Rotation from its frame to the platform's, (3, 3)."""
    hand_eye_std: FloatArray
    """Standard deviations of both, m and rad, (6,)."""
    size_std: float
    """Relative standard deviation of the size that all sheets share."""
    lens: FloatArray
    """Prior values of the lens parameters, (9,)."""
    lens_std: FloatArray
    """Standard deviations of the lens parameters, (9,); 0 for fixed ones."""
    known: BoolArray
    """Whether the pose of each marker is known, (m,)."""
    marker_position_m: FloatArray
    """Positions of the markers, (m, 3); used if known."""
    marker_rotation: FloatArray
    marker_std: FloatArray
    """Standard deviations of marker poses, m and rad, (m, 6)."""
    sigma_px: float
    """Standard deviation used to weight corners; includes noise and errors of the sheets."""
    noise_px: float
    """Noise of corners, used to find outliers."""


@dataclass(frozen=True)
class CameraModel:
    """A camera on a platform, and m markers in the room."""

    position_m: FloatArray
    rotation: FloatArray
    size_change: float
    """Relative deviation from the given size, common to all sheets."""
    lens: FloatArray
    ids: tuple[int, ...]
    marker_position_m: FloatArray
    """(m, 3)"""
    marker_rotation: FloatArray
    """(m, 3, 3)"""
    knowledge: CameraKnowledge
    held: bool = False
    """Whether the camera is fixed and has no parameters."""

    def with_hand_eye(self, position_m: FloatArray, rotation: FloatArray, std: FloatArray) -> Self:
        """Return this knowledge with a hand-eye transform known to `std` (6,), m and rad."""
        known = replace(self.knowledge, position_m=position_m, rotation=rotation, hand_eye_std=std)
        return replace(self, knowledge=known)

    @cached_property
    def free_lens(self) -> IntArray:
        """Indices of the fitted parameters of the lens."""
        return np.flatnonzero(self.knowledge.lens_std > 0.0)

    @property
    def first_marker(self) -> int:
        """Index of the markers' first parameter."""
        return LENS + len(self.free_lens)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return 0 if self.held else self.first_marker + 6 * len(self.ids)

    def known_std(self) -> FloatArray:
        """Return the prior standard deviations of the parameters, (size,)."""
        known = self.knowledge
        of_markers = np.where(known.known[:, None], known.marker_std, _FREE)
        lens = known.lens_std[self.free_lens]
        every = np.concatenate([known.hand_eye_std, [known.size_std], lens, of_markers.ravel()])
        return every[: self.size]

    def off_known(self) -> FloatArray:
        """Return the differences of the parameters from their prior values, (size,)."""
        known = self.knowledge
        out = np.zeros(self.first_marker + 6 * len(self.ids))
        out[:3] = self.position_m - known.position_m
        out[3:SIZE] = logarithms(self.rotation @ known.rotation.T)[0]
        out[SIZE] = self.size_change
        out[LENS : self.first_marker] = (self.lens - known.lens)[self.free_lens]
        own = out[self.first_marker :].reshape(-1, 6)
        if known.known.any():
            there = known.known
            own[there, :3] = self.marker_position_m[there] - known.marker_position_m[there]
            turned = self.marker_rotation[there] @ known.marker_rotation[there].transpose(0, 2, 1)
            own[there, 3:] = logarithms(turned)
        return out[: self.size]

    def changed(self, step: FloatArray) -> CameraModel:
        """Return this camera changed by a step (size,)."""
        if self.held:
            return self
        lens = self.lens.copy()
        lens[self.free_lens] += step[LENS : self.first_marker]
        of_markers = step[self.first_marker :].reshape(-1, 6)
        return replace(
            self,
            position_m=self.position_m + step[:3],
            rotation=exponentials(step[3:SIZE])[0] @ self.rotation,
            size_change=self.size_change + float(step[SIZE]),
            lens=lens,
            marker_position_m=self.marker_position_m + of_markers[:, :3],
            marker_rotation=exponentials(of_markers[:, 3:]) @ self.marker_rotation,
        )

    def camera_poses(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the camera's positions (N, 3) and rotations (N, 3, 3) for platforms (N, 4, 3)."""
        return poses[:, 0] + poses[:, 1:] @ self.position_m, poses[:, 1:] @ self.rotation

    def views(self, seen: SeenMarkers, poses: FloatArray) -> Views:
        """Return the views of the camera on a platform at poses (N, 4, 3), one for each image."""
        position, rotation = self.camera_poses(poses)
        return Views(
            (1.0 + self.size_change) * seen.corners_m,
            seen.corners_px,
            self.marker_position_m[seen.marker],
            self.marker_rotation[seen.marker],
            position[seen.image],
            rotation[seen.image],
        )


# Terms of markers' corners in the fit: residuals, derivatives and their normal equations. A corner
# is seen at π(R_c^T (t_m + R_m s c - p_c)) with p_c = p + Q h and R_c = Q R_h for a platform at (p,
# Q) and a camera at (h, R_h) on it. If D is the derivative by the camera's pose, the derivatives by
# the platform's twist and by the camera's pose on it are D [1, -[Q h]×; 0, 1] and D [Q, 0; 0, Q]. A
# corner's residual is its distance over its standard deviation, with Cauchy's loss of width c = 3
# noise deviations: c² log(1 + (d/c)²), that is the weight 1/(1 + (d/c)²).


def corner_residuals(camera: CameraModel, seen: SeenMarkers, poses: FloatArray) -> FloatArray:
    """Return the residuals of corners, px, (n, 4, 2); inf behind the camera."""
    return camera.views(seen, poses).off_px(camera.lens)


def corner_cost(camera: CameraModel, off_px: FloatArray, robust: bool) -> float:
    """Return the contribution of corners to the sum of squares."""
    known = camera.knowledge
    squares = cauchy_cost(off_px, known.noise_px) if robust else float((off_px**2).sum())
    return squares / known.sigma_px**2


def corner_terms(camera: CameraModel, seen: SeenMarkers, poses: FloatArray) -> CornerTerms:
    """Return terms over standard deviations for a platform at poses (N, 4, 3), one per image.

    The shared parameters are the camera's pose on the platform, the size of the sheets and the
    lens.
    """
    terms = camera.views(seen, poses).terms(camera.lens)
    sigma, Q = camera.knowledge.sigma_px, poses[:, 1:]
    carried = np.tile(np.eye(6), (len(poses), 1, 1))
    carried[:, :3, 3:] = -cross_matrices(Q @ camera.position_m)
    own = np.zeros((len(poses), 6, 6))
    own[:, :3, :3] = own[:, 3:, 3:] = Q
    by_lens, by_size = np.split(terms.by_shared, [LENS_PARAMETERS], axis=2)
    by_size = by_size / (1.0 + camera.size_change)
    shared = [terms.by_pose @ own[seen.image], by_size, by_lens[..., camera.free_lens]]
    return CornerTerms(
        terms.residual / sigma,
        terms.by_pose @ carried[seen.image] / sigma,
        np.concatenate(shared, axis=2) / sigma,
        terms.by_marker / sigma,
    )
