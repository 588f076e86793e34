"""Reprojection of a map's corners with sparse derivatives, and the fit's other residuals.

Parameters are changed as poses of the platform are: (position + x_p, exp(x_φ) rotation), both along
the axes of the map. Their order is: 6 of each image's camera, 6 of each marker, then 9 of the lens.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.geometry.lens import project, project_with_derivatives
from cdpr_rt.calibration.markers.geometry.rotations import cross_matrices, exponentials
from cdpr_rt.calibration.markers.marker_map import MarkerMap
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

LENS_PARAMETERS = 9
_NEAR_m = 1e-3


@dataclass(frozen=True)
class Estimate:
    """A map together with the lens through which it is seen."""

    map: MarkerMap
    lens: FloatArray

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return 6 * len(self.map.names) + 6 * len(self.map.ids) + LENS_PARAMETERS

    def changed(self, step: FloatArray) -> Estimate:
        """Return this estimate with a step (parameters,) made."""
        k, m = len(self.map.names), len(self.map.ids)
        camera = step[: 6 * k].reshape(k, 6)
        marker = step[6 * k : 6 * (k + m)].reshape(m, 6)
        moved = replace(
            self.map,
            camera_position_m=self.map.camera_position_m + camera[:, :3],
            camera_rotation=exponentials(camera[:, 3:]) @ self.map.camera_rotation,
            position_m=self.map.position_m + marker[:, :3],
            rotation=exponentials(marker[:, 3:]) @ self.map.rotation,
        )
        return Estimate(moved, self.lens + step[6 * (k + m) :])


@dataclass(frozen=True)
class Corners:
    """n markers as they are expected in images, and the derivatives of that.

    Cameras and markers are changed by (position + x_p, exp(x_φ) rotation) along the map's axes.
    """

    off_px: FloatArray
    """Predicted less seen corners, to the right and down, (n, 4, 2)."""
    by_camera: FloatArray
    """(n, 8, 6)"""
    by_marker: FloatArray
    """(n, 8, 6)"""
    by_lens: FloatArray
    """(n, 8, 9)"""
    by_size: FloatArray
    """By the relative size of the sheets, (n, 8, 1)."""


@dataclass(frozen=True)
class Views:
    """n markers of a map and the cameras that see them; a row is one marker in one image."""

    corners_m: FloatArray
    """In the marker's frame, (n, 4, 3)."""
    corners_px: FloatArray
    """(n, 4, 2)."""
    marker_position_m: FloatArray
    marker_rotation: FloatArray
    camera_position_m: FloatArray
    camera_rotation: FloatArray

    def _points(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return corners from markers' middles, from cameras, and in their frames, (n, 4, 3)."""
        turned = self.corners_m @ self.marker_rotation.transpose(0, 2, 1)
        away = turned + (self.marker_position_m - self.camera_position_m)[:, None]
        return turned, away, away @ self.camera_rotation

    def off_px(self, lens: FloatArray) -> FloatArray:
        """Return `Corners.off_px`, inf where a corner would be behind the camera."""
        flat = self._points()[2].reshape(-1, 3)
        behind = flat[:, 2] < _NEAR_m
        safe = np.where(behind[:, None], (0.0, 0.0, 1.0), flat)
        expected = np.where(behind[:, None], np.inf, project(safe, lens))
        return expected.reshape(-1, 4, 2) - self.corners_px

    def corners(self, lens: FloatArray) -> Corners:
        """Return how far corners are off, with the derivatives of that."""
        n = len(self.corners_px)
        turned, away, points = self._points()
        expected, by_point, by_lens = project_with_derivatives(points.reshape(-1, 3), lens)
        to_camera = self.camera_rotation.transpose(0, 2, 1)
        by_room = by_point.reshape(n, 4, 2, 3) @ to_camera[:, None]
        by_camera = np.concatenate([-by_room, by_room @ cross_matrices(away)], axis=3)
        by_marker = np.concatenate([by_room, -by_room @ cross_matrices(turned)], axis=3)
        return Corners(
            expected.reshape(n, 4, 2) - self.corners_px,
            by_camera.reshape(n, 8, 6),
            by_marker.reshape(n, 8, 6),
            by_lens.reshape(n, 8, LENS_PARAMETERS),
            (by_room @ turned[..., None]).reshape(n, 8, 1),
        )


def _views(estimate: Estimate, seen: SeenMarkers) -> Views:
    map_ = estimate.map
    return Views(
        seen.corners_m,
        seen.corners_px,
        map_.position_m[seen.marker],
        map_.rotation[seen.marker],
        map_.camera_position_m[seen.image],
        map_.camera_rotation[seen.image],
    )


def residuals(estimate: Estimate, seen: SeenMarkers) -> FloatArray:
    """Return by how much corners are expected right of and below where they were seen, (n, 4, 2).

    In pixels; inf where one would be behind the camera.
    """
    return _views(estimate, seen).off_px(estimate.lens)


def residuals_and_jacobian(estimate: Estimate, seen: SeenMarkers) -> tuple[FloatArray, csr_array]:
    """Return `residuals`, flat (8 n,), and their derivatives (8 n, parameters), sparse."""
    k, m = len(estimate.map.names), len(estimate.map.ids)
    n = len(seen)
    corners = _views(estimate, seen).corners(estimate.lens)
    data = np.concatenate([corners.by_camera, corners.by_marker, corners.by_lens], axis=2)
    columns = np.empty((n, 12 + LENS_PARAMETERS), np.int64)
    columns[:, :6] = 6 * seen.image[:, None] + np.arange(6)
    columns[:, 6:12] = 6 * (k + seen.marker[:, None]) + np.arange(6)
    columns[:, 12:] = 6 * (k + m) + np.arange(LENS_PARAMETERS)
    columns = np.repeat(columns, 8, axis=0)
    starts = np.arange(8 * n + 1) * (12 + LENS_PARAMETERS)
    shape = (8 * n, estimate.parameters)
    jacobian = csr_array((data.ravel(), columns.ravel(), starts), shape=shape)
    return corners.off_px.reshape(-1), jacobian
