"""Where a map has corners seen, and the sparse derivatives of that; the fit's other terms join it.

Parameters are changed as poses of the platform are: (position + x_p, exp(x_φ) rotation), both along
the axes of the map. Their order is: 6 of each image's camera, 6 of each marker, then 9 of the lens.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from cdpr_rt.calibration.markers.geometry.lens import project, project_with_derivatives
from cdpr_rt.calibration.markers.geometry.rotations import FloatArray, cross_matrices, exponentials
from cdpr_rt.calibration.markers.marker_map import MarkerMap
from cdpr_rt.calibration.markers.observations import Observations

LENS_PARAMETERS = 9
_NEAR_m = 1e-3


@dataclass(frozen=True)
class Estimate:
    """A map together with the lens through which it is seen."""

    map: MarkerMap
    lens: FloatArray

    @property
    def parameters(self) -> int:
        """How many numbers can be changed."""
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


def _points(estimate: Estimate, seen: Observations) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return corners from their markers' middles, from the camera, and in its frame, (n, 4, 3)."""
    map_ = estimate.map
    turned = seen.corners_m @ map_.rotation[seen.marker].transpose(0, 2, 1)
    away = turned + (map_.position_m[seen.marker] - map_.camera_position_m[seen.image])[:, None]
    return turned, away, away @ map_.camera_rotation[seen.image]


def residuals(estimate: Estimate, seen: Observations) -> FloatArray:
    """Return by how much corners are expected right of and below where they were seen, (n, 4, 2).

    In pixels; inf where one would be behind the camera.
    """
    _, _, points = _points(estimate, seen)
    flat = points.reshape(-1, 3)
    behind = flat[:, 2] < _NEAR_m
    safe = np.where(behind[:, None], (0.0, 0.0, 1.0), flat)
    expected = np.where(behind[:, None], np.inf, project(safe, estimate.lens))
    return expected.reshape(-1, 4, 2) - seen.corners_px


def residuals_and_jacobian(estimate: Estimate, seen: Observations) -> tuple[FloatArray, csr_array]:
    """Return `residuals`, flat (8 n,), and their derivatives (8 n, parameters), sparse."""
    k, m = len(estimate.map.names), len(estimate.map.ids)
    n = len(seen)
    turned, away, points = _points(estimate, seen)
    expected, by_point, by_lens = project_with_derivatives(points.reshape(-1, 3), estimate.lens)
    to_camera = estimate.map.camera_rotation[seen.image].transpose(0, 2, 1)
    by_room = by_point.reshape(n, 4, 2, 3) @ to_camera[:, None]
    data = np.concatenate(
        [
            -by_room,
            by_room @ cross_matrices(away),
            by_room,
            -by_room @ cross_matrices(turned),
            by_lens.reshape(n, 4, 2, LENS_PARAMETERS),
        ],
        axis=3,
    )
    columns = np.empty((n, 12 + LENS_PARAMETERS), np.int64)
    columns[:, :6] = 6 * seen.image[:, None] + np.arange(6)
    columns[:, 6:12] = 6 * (k + seen.marker[:, None]) + np.arange(6)
    columns[:, 12:] = 6 * (k + m) + np.arange(LENS_PARAMETERS)
    columns = np.repeat(columns, 8, axis=0)
    starts = np.arange(8 * n + 1) * (12 + LENS_PARAMETERS)
    shape = (8 * n, estimate.parameters)
    jacobian = csr_array((data.ravel(), columns.ravel(), starts), shape=shape)
    return expected.reshape(-1) - seen.corners_px.reshape(-1), jacobian
