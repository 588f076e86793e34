"""A map of markers and the poses of the camera that saw them; how two maps differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.geometry.rotations import logarithms
from cdpr_rt.calibration.markers.seen_markers import CORNERS
from cdpr_rt.errors import InvalidRequestError


@dataclass(frozen=True)
class MarkerMap:
    """Poses of m markers and of the camera in k images, all in the frame of the map.

    That is the frame of the marker `reference`, or of the layout where markers of known places
    were given. A marker or image without a place has nan.
    """

    ids: tuple[int, ...]
    reference: int
    size_m: FloatArray
    """(m,)."""
    position_m: FloatArray
    """Of the markers' middles, (m, 3)."""
    rotation: FloatArray
    """From a marker's frame to the map's, (m, 3, 3)."""
    names: tuple[str, ...]
    """Of the images."""
    camera_position_m: FloatArray
    """(k, 3)."""
    camera_rotation: FloatArray
    """From the camera's frame to the map's, (k, 3, 3)."""

    @property
    def placed(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether each marker has a place, (m,)."""
        return np.isfinite(self.position_m[:, 0])

    @property
    def located(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether the camera has a place in each image, (k,)."""
        return np.isfinite(self.camera_position_m[:, 0])

    def corners_m(self) -> FloatArray:
        """Return the markers' corners in the frame of the map, (m, 4, 3)."""
        flat = CORNERS * self.size_m[:, None, None]
        return np.asarray(flat @ self.rotation.transpose(0, 2, 1) + self.position_m[:, None])

    def seen_from(self, marker: int) -> MarkerMap:
        """Return the map in the frame of another marker; raises InvalidRequestError."""
        if marker not in self.ids or not self.placed[self.ids.index(marker)]:
            raise InvalidRequestError(f"marker {marker} has no place in the map")
        k = self.ids.index(marker)
        return self.moved(self.rotation[k].T, -self.rotation[k].T @ self.position_m[k], marker)

    def moved(self, turn: FloatArray, shift: FloatArray, reference: int) -> MarkerMap:
        """Return the map transformed by x -> `turn` x + `shift`."""
        return MarkerMap(
            self.ids,
            reference,
            self.size_m,
            self.position_m @ turn.T + shift,
            turn @ self.rotation,
            self.names,
            self.camera_position_m @ turn.T + shift,
            turn @ self.camera_rotation,
        )


@dataclass(frozen=True)
class MapDifference:
    """Differences of a map from another in the frame of one marker: thesis, figures 3.20, 3.21."""

    ids: tuple[int, ...]
    distance_m: FloatArray
    """Of each marker's middle from that of the reference marker, (m,)."""
    position_error_m: FloatArray
    """Of the middles, (m,)."""
    corner_error_m: FloatArray
    """Of the corners, along the axes of the reference marker, (m, 4, 3)."""
    rotation_error_rad: FloatArray
    """(m,)."""


def difference(map_: MarkerMap, other: MarkerMap, reference: int | None = None) -> MapDifference:
    """Return how `map_` differs from `other` where both have the marker `reference` at its place.

    Raises InvalidRequestError where one of them does not have it.
    """
    reference = map_.reference if reference is None else reference
    a, b = map_.seen_from(reference), other.seen_from(reference)
    common = [
        marker
        for marker in a.ids
        if marker in b.ids and a.placed[a.ids.index(marker)] and b.placed[b.ids.index(marker)]
    ]
    i, j = ([one.ids.index(marker) for marker in common] for one in (a, b))
    off = a.position_m[i] - b.position_m[j]
    turn = logarithms(a.rotation[i] @ b.rotation[j].transpose(0, 2, 1))
    return MapDifference(
        tuple(common),
        np.linalg.norm(b.position_m[j], axis=1),
        np.linalg.norm(off, axis=1),
        a.corners_m()[i] - b.corners_m()[j],
        np.linalg.norm(turn, axis=1),
    )


def best_fit(points: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R, t with `others` ≈ R `points` + t, both (n, 3): Umeyama 1991, least squares."""
    middle, other = points.mean(axis=0), others.mean(axis=0)
    a, b = points - middle, others - other
    left, _, right = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    turn = left @ (sign[:, None] * right)
    return turn, other - turn @ middle
