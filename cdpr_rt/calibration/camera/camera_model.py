"""Fitted parameters of a camera: its place on the platform, the size of sheets, lens, markers.

The order of its parameters is: position and rotation of the camera on the platform (6), relative
size of all sheets (1), of the lens those with a standard deviation (up to 9), and position and
rotation of each marker (6 each). Rotations change by exp(x) R.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.markers.geometry.rotations import exponentials, logarithms
from cdpr_rt.calibration.markers.reprojection import Views
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

SIZE, LENS = 6, 7
"""Indices of the relative size of the sheets, and of the lens, among the parameters."""
_FREE = 10.0
"""Standard deviation of what nothing is known of, m and rad: next to no observation."""


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
    """Relative, of the size of all sheets alike."""
    lens: FloatArray
    """(9,)"""
    lens_std: FloatArray
    """(9,), 0 for what is held."""
    known: BoolArray
    """Markers whose place is known, (m,)."""
    marker_position_m: FloatArray
    """(m, 3); counts where known."""
    marker_rotation: FloatArray
    marker_std: FloatArray
    """m and rad, (m, 6)."""
    sigma_px: float
    """By which corners are weighted: noise, and what sheets are off by themselves."""
    noise_px: float
    """Noise of corners, by which outliers are found."""


@dataclass(frozen=True)
class CameraModel:
    """A camera on a platform, and m markers in the room."""

    position_m: FloatArray
    rotation: FloatArray
    size_change: float
    """Relative, of all sheets against the size told."""
    lens: FloatArray
    ids: tuple[int, ...]
    marker_position_m: FloatArray
    """(m, 3)"""
    marker_rotation: FloatArray
    """(m, 3, 3)"""
    knowledge: CameraKnowledge
    held: bool = False
    """Whether it is taken as it is, and has no parameters."""

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
        """Return the standard deviations of what is known of the parameters before, (size,)."""
        known = self.knowledge
        of_markers = np.where(known.known[:, None], known.marker_std, _FREE)
        lens = known.lens_std[self.free_lens]
        every = np.concatenate([known.hand_eye_std, [known.size_std], lens, of_markers.ravel()])
        return every[: self.size]

    def off_known(self) -> FloatArray:
        """Return by how much parameters are off what was known of them, (size,)."""
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
        """Return this with a step (size,) made."""
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
        """Return positions (N, 3) and rotations (N, 3, 3) of the camera, of platforms (N, 4, 3)."""
        return poses[:, 0] + poses[:, 1:] @ self.position_m, poses[:, 1:] @ self.rotation

    def views(self, seen: SeenMarkers, poses: FloatArray) -> Views:
        """Return what the camera sees from a platform at poses (N, 4, 3), one for each image."""
        position, rotation = self.camera_poses(poses)
        return Views(
            (1.0 + self.size_change) * seen.corners_m,
            seen.corners_px,
            self.marker_position_m[seen.marker],
            self.marker_rotation[seen.marker],
            position[seen.image],
            rotation[seen.image],
        )
