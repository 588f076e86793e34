"""From what images showed to where the fit of cables and camera begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr_profiles.devices.camera import rotation_vector_rad
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera.camera_model import CameraKnowledge, CameraModel
from cdpr_rt.calibration.camera.corner_terms import corner_residuals
from cdpr_rt.calibration.camera.hand_eye import Rigid, rigid_places, turned_camera
from cdpr_rt.calibration.estimation.fit import fit
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.markers.geometry.rotations import angles, exponentials
from cdpr_rt.calibration.markers.map_fit import MapFit, aligned, fit_map, known_places
from cdpr_rt.calibration.markers.marker_map import MarkerMap
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.calibration.readings.camera_data import CameraSetup, HandEye
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.errors import InvalidRequestError

_UNKNOWN_STD = (0.5, 0.5, 0.5, 1.0, 1.0, 1.0)
"""Prior standard deviation of a camera's unknown place on the platform, m and rad."""
_LIKELY_deg, _LIKELY_SIGMAS = 15.0, 6.0
"""Largest likely error of the camera's rotation: by a robot's file turns are known only roughly."""
_ROOM_m, _ROOM_rad = 0.2, 0.15
"""A layout of known markers that lies no further off than this by the robot's file is in its room.
"""


@dataclass(frozen=True)
class CameraStart:
    """A marker map, the model of the camera that goes with it, and what was observed."""

    map: MapFit
    camera: CameraModel
    geometry: CableGeometry
    seen: Observations
    known_room: bool
    """Whether places of markers are known in the room's frame."""


def camera_start(
    geometry: CableGeometry,
    seen: Observations,
    setup: CameraSetup,
    sightings: Sequence[Sighting],
) -> CameraStart:
    """Return where to begin, with an image for each pose of `seen`.

    Raises InvalidRequestError and BundleError where images tell no map or not where the camera is.
    """
    return start_on_map(geometry, seen, setup, map_of_images(setup, sightings))


def map_of_images(setup: CameraSetup, sightings: Sequence[Sighting]) -> MapFit:
    """Return the map that images alone tell; raises InvalidRequestError and BundleError."""
    # known places join the fit as what they are, measured; there they only tell the frame
    return fit_map(sightings, setup.intrinsics, setup.sheets.model_copy(update={"known": ()}))


def start_on_map(
    geometry: CableGeometry, seen: Observations, setup: CameraSetup, found: MapFit
) -> CameraStart:
    """Return where to begin on a map of the images of `seen`; raises InvalidRequestError."""
    rough = fit(geometry, seen)
    map_ = found.map
    if known := known_places(map_, setup.sheets)[0]:
        map_ = aligned(map_, setup.sheets)[0]
    there = np.flatnonzero(map_.located)
    hand_eye, room = _places(rough.poses, map_, there, setup)
    known_room = bool(known) and _is_small(room, map_)
    if known_room:
        room = Rigid(np.eye(3), np.zeros(3))
    map_ = map_.moved(room.rotation, room.position_m, map_.reference)
    markers = found.seen.keep(map_.placed[found.seen.marker] & map_.located[found.seen.image])
    start = _platform_poses(rough.poses, map_, there, hand_eye, geometry)
    model = _model(setup, found, map_, hand_eye, room)
    before_camera = np.isfinite(corner_residuals(model, markers, start)).all(axis=(1, 2))
    markers = markers.keep(np.asarray(before_camera))
    return CameraStart(
        found,
        model,
        rough.geometry,
        replace(seen, start=start, markers=markers),
        known_room,
    )


def _places(
    platform: FloatArray, map_: MarkerMap, there: IntArray, setup: CameraSetup
) -> tuple[Rigid, Rigid]:
    """Return the camera's place on the platform, and that of the map in the room."""
    cameras = Rigid(map_.camera_rotation[there], map_.camera_position_m[there])
    told = setup.hand_eye
    if told is None:
        turn = turned_camera(platform[there, 1:], cameras.rotation)
        return rigid_places(platform[there], cameras, turn, None)
    turn = exponentials(np.array(rotation_vector_rad(told.rotation_deg)))[0]
    _require_likely(turn, platform[there, 1:], cameras.rotation, told)
    return rigid_places(platform[there], cameras, turn, np.array(told.position_m))


def _require_likely(
    turn: FloatArray, platform: FloatArray, camera: FloatArray, told: HandEye
) -> None:
    """Raise InvalidRequestError where the platform's turns tell another rotation of the camera."""
    try:
        seen = turned_camera(platform, camera)
    except InvalidRequestError:  # it hardly turns: only what was told is known
        return
    off_deg = math.degrees(angles(seen.T @ turn))
    most_deg = max(_LIKELY_deg, _LIKELY_SIGMAS * told.rotation_std_deg)
    if off_deg > most_deg:
        raise InvalidRequestError(
            f"hand_eye.rotation_deg: value {list(told.rotation_deg)}: the platform's turns tell "
            f"another, {off_deg:.0f} deg off; allowed: up to {most_deg:.0f} deg; without it the "
            "turns alone tell how the camera sits"
        )


def _is_small(room: Rigid, map_: MarkerMap) -> bool:
    """Return whether the map is nearly where the robot's file would have it."""
    at = map_.camera_position_m[map_.located]
    moved = at @ room.rotation.T + room.position_m - at
    return bool(
        np.median(np.linalg.norm(moved, axis=1)) < _ROOM_m and angles(room.rotation) < _ROOM_rad
    )


def _platform_poses(
    rough: FloatArray,
    map_: MarkerMap,
    there: IntArray,
    hand_eye: Rigid,
    geometry: CableGeometry,
) -> FloatArray:
    """Return poses (N, 4, 3) by the camera where it was, of platforms with all six directions."""
    poses = rough.copy()
    if len(geometry.free) == 6:
        Q = map_.camera_rotation[there] @ hand_eye.rotation.T
        poses[there, 1:] = Q
        poses[there, 0] = map_.camera_position_m[there] - Q @ hand_eye.position_m
    return poses


def _model(
    setup: CameraSetup, found: MapFit, map_: MarkerMap, hand_eye: Rigid, room: Rigid
) -> CameraModel:
    lens = np.array(setup.intrinsics.parameters)
    told = setup.hand_eye
    std = np.array(_UNKNOWN_STD)
    if told is not None:
        std = np.repeat([told.position_std_m, np.radians(told.rotation_std_deg)], 3)
    sigmas = setup.intrinsics.sigmas
    noise = found.bundle.sigma_px
    position, rotation, known = _layout(setup, map_, room)
    turn_std = 2.0 * setup.known_std_m / map_.size_m
    knowledge = CameraKnowledge(
        hand_eye.position_m,
        hand_eye.rotation,
        std,
        setup.size_std,
        lens,
        np.zeros(9) if sigmas is None else np.array(sigmas),
        known,
        position,
        rotation,
        np.repeat(np.stack([np.full_like(turn_std, setup.known_std_m), turn_std], axis=1), 3, 1),
        setup.sigma_px or noise * float(np.sqrt(found.bundle.sheets.inflation)),
        noise,
    )
    placed = np.where(map_.placed[:, None], map_.position_m, 0.0)
    turned = np.where(map_.placed[:, None, None], map_.rotation, np.eye(3))
    return CameraModel(
        hand_eye.position_m, hand_eye.rotation, 0.0, lens, map_.ids, placed, turned, knowledge
    )


def _layout(
    setup: CameraSetup, map_: MarkerMap, room: Rigid
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return positions, rotations of markers whose place is known, and which these are."""
    count = len(map_.ids)
    position, rotation = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    known = np.zeros(count, bool)
    numbers, places, turns = known_places(map_, setup.sheets)
    known[numbers] = True
    position[numbers] = places @ room.rotation.T + room.position_m
    rotation[numbers] = room.rotation @ turns
    return position, rotation, known
