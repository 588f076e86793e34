"""Poses that images tell by a map of markers that a calibration has made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdpr_profiles.devices.camera import MarkerSheets
from cdpr_rt.arrays import BoolArray
from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.errors import InvalidRequestError

_MAP_m, _MAP_rad = 5e-4, 5e-4
"""By which a map errs all over alike, which no image tells."""
_PLACED_m = 0.05
"""A marker of which the place is known no better is not in the map."""
_LEAST_MARKERS = 2


def with_seen_poses(
    made: Fit, sheets: MarkerSheets, seen: Observations, sightings: Sequence[Sighting]
) -> Observations:
    """Return observations with poses as the camera measures them, by the map of a fit.

    Images that show fewer than two markers of the map tell nothing. Raises InvalidRequestError
    where none tells anything.
    """
    camera = made.camera
    assert camera is not None  # of a calibration with one
    of_markers = made.camera_std[camera.first_marker :].reshape(-1, 6)
    placed = of_markers[:, :3].max(axis=1) < _PLACED_m
    markers = markers_of_map(camera.ids, placed, sheets, sightings)
    if not len(markers):
        raise InvalidRequestError(
            f"no image shows {_LEAST_MARKERS} markers of the calibration's map: were the sheets "
            "taken away?"
        )
    blind = replace(seen.unmeasured(), used=np.zeros_like(seen.used), markers=markers, jumps=())
    still = replace(camera, held=True)
    there = fit(replace(made.geometry, identified=()), blind, camera=still)
    shown = np.isin(np.arange(seen.poses), markers.image)
    sure = np.einsum("jdd->jd", there.pose_covariance) * max(there.corner_factor, 1.0)
    position = np.where(shown[:, None], there.poses[:, 0], np.nan)
    rotation = np.where(shown[:, None, None], there.poses[:, 1:], np.nan)
    return seen.with_positions(position, np.sqrt(sure[:, :3] + _MAP_m**2)).with_rotations(
        rotation, np.sqrt(sure[:, 3:] + _MAP_rad**2)
    )


def markers_of_map(
    ids: tuple[int, ...],
    placed: BoolArray,
    sheets: MarkerSheets,
    sightings: Sequence[Sighting],
) -> SeenMarkers:
    """Return the markers seen that have a place (m,) in a map of `ids`, of images that show two."""
    number = {marker: k for k, marker in enumerate(ids) if placed[k]}
    rows = [
        (image, number[marker], corners)
        for image, one in enumerate(sightings)
        if one.problem is None
        and sum(marker in number for marker in one.corners_px) >= _LEAST_MARKERS
        for marker, corners in sorted(one.corners_px.items())
        if marker in number
    ]
    return SeenMarkers(
        tuple(one.name for one in sightings),
        ids,
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1] for row in rows], np.int64),
        np.array([row[2] for row in rows], float).reshape(-1, 4, 2),
        np.array([sheets.size_of(marker) for marker in ids]),
    )
