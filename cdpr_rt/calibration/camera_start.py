"""Compute from images the starting point of the fit of cables and camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr_profiles.camera import MarkerSheets, rotation_vector_rad
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration import marker_map
from cdpr_rt.calibration.camera_geometry import angles, exponentials, logarithms, nearest_rotation
from cdpr_rt.calibration.camera_model import (
    UNKNOWN_HAND_EYE_STD,
    CameraKnowledge,
    CameraModel,
    corner_residuals,
)
from cdpr_rt.calibration.fit import Fit, fit
from cdpr_rt.calibration.marker_map_fit import MapFit, fit_map
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import CameraSetup, HandEye, Observations
from cdpr_rt.errors import InvalidRequestError

# Hand-eye calibration: a camera's pose on a platform from poses of both, in closed form. (Q_j, p_j)
# are platform poses in the room, (C_j, c_j) camera poses in the frame of a map, (X, x) the camera's
# pose on the platform and (Z, z) the map's in the room. They satisfy Q_j X = Z C_j and p_j + Q_j x
# = Z c_j + z. For two poses, Q_j^T Q_k X = X C_j^T C_k; with the rotation vectors a of the
# platform's turn and b of the camera's, a = X b (Park and Martin 1994). X is the rotation that fits
# best.

_LEAST_TURN_rad = 0.02
_ROUNDS = 5


@dataclass(frozen=True)
class Rigid:
    """A rotation (3, 3) and a position (3,) of one frame in another."""

    rotation: FloatArray
    position_m: FloatArray


def turned_camera(platform: FloatArray, camera: FloatArray) -> FloatArray:
    """Return X for rotations (N, 3, 3) of platform and camera, robust against outliers.

    Raises InvalidRequestError if the platform hardly turns, or turns about one axis only.
    """
    j, k = np.triu_indices(len(platform), 1)
    a = logarithms(platform[j].transpose(0, 2, 1) @ platform[k])
    b = logarithms(camera[j].transpose(0, 2, 1) @ camera[k])
    spread = np.sqrt(np.linalg.eigvalsh(b.T @ b / max(len(b), 1))) if len(b) else np.zeros(3)
    if spread[1] < _LEAST_TURN_rad:
        raise InvalidRequestError(
            f"the platform turns by {np.degrees(spread[1]):.1f} deg about a second axis, "
            "too little to find where the camera sits; give a measured hand_eye in the data"
        )
    weight = np.ones(len(a))
    for _ in range(_ROUNDS):
        X = nearest_rotation((a * weight[:, None]).T @ b)
        off = np.linalg.norm(a - b @ X.T, axis=1)
        weight = _weights(off)
    return X


def rigid_places(
    platform: FloatArray, camera: Rigid, turn: FloatArray, place_m: FloatArray | None
) -> tuple[Rigid, Rigid]:
    """Return the camera's pose on the platform and the map's pose in the room.

    `platform` (N, 4, 3) and `camera` (N, 3, 3), (N, 3) are poses, `turn` is X; `place_m` is x if it
    is known. The method is least squares, reweighted so that poses that do not fit count less.
    """
    Q, p = platform[:, 1:], platform[:, 0]
    weight = np.ones(len(p))
    for _ in range(_ROUNDS):
        Z = nearest_rotation(np.einsum("j,jab,bc,jdc->ad", weight, Q, turn, camera.rotation))
        weight = _weights(angles(Q @ turn @ camera.rotation.transpose(0, 2, 1) @ Z.T))
    right = camera.position_m @ Z.T - p
    weight = np.ones(len(p))
    for _ in range(_ROUNDS):
        if place_m is None:
            A = np.concatenate([Q, np.broadcast_to(-np.eye(3), Q.shape)], axis=2)
            both = np.linalg.lstsq(
                (weight[:, None, None] * A).reshape(-1, 6), (weight[:, None] * right).ravel(), None
            )[0]
            x, z = both[:3], both[3:]
        else:
            x = place_m
            z = np.average(Q @ x - right, axis=0, weights=weight**2)
        weight = np.sqrt(_weights(np.linalg.norm(Q @ x - z - right, axis=1)))
    return Rigid(turn, x), Rigid(Z, z)


def _weights(off: FloatArray) -> FloatArray:
    """Return weights for distances; the weight is half at twice their median."""
    scale = 2.0 * max(float(np.median(off)), 1e-9)
    return np.asarray(1.0 / (1.0 + (off / scale) ** 2))


_LIKELY_deg, _LIKELY_SIGMAS = 15.0, 6.0
"""Largest likely error of the camera's rotation; it is large because rotations from the robot's
file are inaccurate."""
_ROOM_m, _ROOM_rad = 0.2, 0.15
"""If the layout of known markers is displaced by at most this, it is given in the robot's frame."""


@dataclass(frozen=True)
class CameraStart:
    """A marker map, the matching camera model, and the observations."""

    map: MapFit
    camera: CameraModel
    geometry: CableGeometry
    seen: Observations
    known_room: bool
    """Whether poses of markers are known in the room's frame."""
    setup: CameraSetup
    """Setup of the camera, with only those known marker poses that agree with each other."""
    place_faults: tuple[str, ...] = ()
    """Faults of known marker poses, as text."""
    contradictory_places: bool = False
    """Whether no majority of the known marker poses agrees."""


def camera_start(
    geometry: CableGeometry,
    seen: Observations,
    setup: CameraSetup,
    sightings: Sequence[marker_map.Sighting],
) -> CameraStart:
    """Return the starting point of the fit; there is an image for each pose of `seen`.

    Known marker poses that contradict the map are left out. Raises InvalidRequestError and
    BundleError if the images do not determine a map or the pose of the camera on the platform.
    """
    found = map_of_images(setup, sightings)
    places = marker_map.consistent_places(found.map, setup.sheets, setup.known_std_m)
    setup = setup.model_copy(update={"sheets": places.sheets})
    start = start_on_map(geometry, seen, setup, found)
    return replace(
        start,
        place_faults=(*places.faults, *start.place_faults),
        contradictory_places=places.contradictory,
    )


def map_of_images(setup: CameraSetup, sightings: Sequence[marker_map.Sighting]) -> MapFit:
    """Return the map determined by images alone; raises InvalidRequestError and BundleError."""
    # the later fit uses known marker poses as measurements; here they would only set the frame
    return fit_map(sightings, setup.intrinsics, setup.sheets.model_copy(update={"known": ()}))


def start_on_map(
    geometry: CableGeometry, seen: Observations, setup: CameraSetup, found: MapFit
) -> CameraStart:
    """Return the starting point, given a map of the images; raises InvalidRequestError."""
    rough = fit(geometry, seen)
    map_ = found.map
    if known := marker_map.known_places(map_, setup.sheets)[0]:
        map_ = marker_map.aligned(map_, setup.sheets)[0]
    there = np.flatnonzero(map_.located)
    hand_eye, room = _places(rough.poses, map_, there, setup)
    known_room = bool(known) and _is_small(room, map_)
    faults: tuple[str, ...] = ()
    if known_room:
        room = Rigid(np.eye(3), np.zeros(3))
    elif known:
        faults = (_other_room(room, map_),)
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
        setup,
        faults,
    )


def _places(
    platform: FloatArray, map_: marker_map.MarkerMap, there: IntArray, setup: CameraSetup
) -> tuple[Rigid, Rigid]:
    """Return the camera's pose on the platform, and the map's pose in the room."""
    cameras = Rigid(map_.camera_rotation[there], map_.camera_position_m[there])
    given = setup.hand_eye
    if given is None:
        turn = turned_camera(platform[there, 1:], cameras.rotation)
        return rigid_places(platform[there], cameras, turn, None)
    turn = exponentials(np.array(rotation_vector_rad(given.rotation_deg)))[0]
    _require_likely(turn, platform[there, 1:], cameras.rotation, given)
    return rigid_places(platform[there], cameras, turn, np.array(given.position_m))


def _require_likely(
    turn: FloatArray, platform: FloatArray, camera: FloatArray, given: HandEye
) -> None:
    """Raise InvalidRequestError if the platform's turns contradict the given camera rotation."""
    try:
        seen = turned_camera(platform, camera)
    except InvalidRequestError:  # the platform hardly turns, so only the given rotation is known
        return
    off_deg = math.degrees(angles(seen.T @ turn))
    most_deg = max(_LIKELY_deg, _LIKELY_SIGMAS * given.rotation_std_deg)
    if off_deg > most_deg:
        raise InvalidRequestError(
            f"hand_eye.rotation_deg: value {list(given.rotation_deg)}: it differs by "
            f"{off_deg:.0f} deg from the one found from the platform's rotations; allowed: "
            f"up to {most_deg:.0f} deg; omit it to use the rotations alone"
        )


def _is_small(room: Rigid, map_: marker_map.MarkerMap) -> bool:
    """Return whether the map is nearly where the robot's file places it."""
    return _moved_m(room, map_) < _ROOM_m and bool(angles(room.rotation) < _ROOM_rad)


def _moved_m(room: Rigid, map_: marker_map.MarkerMap) -> float:
    """Return how far the transform from the map's frame to the room's moves the camera."""
    at = map_.camera_position_m[map_.located]
    moved = at @ room.rotation.T + room.position_m - at
    return float(np.median(np.linalg.norm(moved, axis=1)))


def _other_room(room: Rigid, map_: marker_map.MarkerMap) -> str:
    return (
        f"the known markers put the platform {_moved_m(room, map_):.2f} m and "
        f"{math.degrees(angles(room.rotation)):.0f} deg from its place according to the robot's "
        "file: the fit assumes that the markers have a separate frame, so they do not give the "
        "robot's place in its room; check their places if they were measured in the robot's frame"
    )


def _platform_poses(
    rough: FloatArray,
    map_: marker_map.MarkerMap,
    there: IntArray,
    hand_eye: Rigid,
    geometry: CableGeometry,
) -> FloatArray:
    """Return poses (N, 4, 3) from located cameras if six directions are free, else rough ones."""
    poses = rough.copy()
    if len(geometry.free) == 6:
        Q = map_.camera_rotation[there] @ hand_eye.rotation.T
        poses[there, 1:] = Q
        poses[there, 0] = map_.camera_position_m[there] - Q @ hand_eye.position_m
    return poses


def _model(
    setup: CameraSetup, found: MapFit, map_: marker_map.MarkerMap, hand_eye: Rigid, room: Rigid
) -> CameraModel:
    lens = np.array(setup.intrinsics.parameters)
    given = setup.hand_eye
    std = np.array(UNKNOWN_HAND_EYE_STD)
    if given is not None:
        std = np.repeat([given.position_std_m, np.radians(given.rotation_std_deg)], 3)
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
    setup: CameraSetup, map_: marker_map.MarkerMap, room: Rigid
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return positions and rotations of markers, and whether the pose of each is known."""
    count = len(map_.ids)
    position, rotation = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    known = np.zeros(count, bool)
    numbers, places, turns = marker_map.known_places(map_, setup.sheets)
    known[numbers] = True
    position[numbers] = places @ room.rotation.T + room.position_m
    rotation[numbers] = room.rotation @ turns
    return position, rotation, known


# Poses that images determine with the marker map of an earlier calibration.

_MAP_m, _MAP_rad = 5e-4, 5e-4
"""Error common to the whole map, which images cannot show."""
_PLACED_m = 0.05
"""A marker with a larger standard deviation is not in the map."""
_LEAST_MARKERS = 2


def with_seen_poses(
    made: Fit, sheets: MarkerSheets, seen: Observations, sightings: Sequence[marker_map.Sighting]
) -> Observations:
    """Return observations with poses measured by the camera, using the map of a fit.

    Images that show fewer than two markers of the map are ignored. Raises InvalidRequestError
    if all images are ignored.
    """
    camera = made.fitted_camera
    of_markers = made.camera_std[camera.first_marker :].reshape(-1, 6)
    placed = of_markers[:, :3].max(axis=1) < _PLACED_m
    markers = markers_of_map(camera.ids, placed, sheets, sightings)
    if not len(markers):
        raise InvalidRequestError(
            f"no image shows {_LEAST_MARKERS} markers of the calibration's map: were the sheets "
            "taken away?"
        )
    there = locate_by_camera(made.geometry, camera, replace(seen, markers=markers))
    shown = np.isin(np.arange(seen.poses), markers.image)
    sure = np.einsum("jdd->jd", there.pose_covariance) * max(there.corner_factor, 1.0)
    position = np.where(shown[:, None], there.poses[:, 0], np.nan)
    rotation = np.where(shown[:, None, None], there.poses[:, 1:], np.nan)
    return seen.with_positions(position, np.sqrt(sure[:, :3] + _MAP_m**2)).with_rotations(
        rotation, np.sqrt(sure[:, 3:] + _MAP_rad**2)
    )


def locate_by_camera(geometry: CableGeometry, camera: CameraModel, seen: Observations) -> Fit:
    """Return the poses that images alone determine, with a fixed map."""
    blind = replace(
        seen.unmeasured(), used=np.zeros_like(seen.used), markers=seen.markers, jumps=()
    )
    still = replace(camera, held=True)
    return fit(replace(geometry, identified=()), blind, camera=still)


def markers_of_map(
    ids: tuple[int, ...],
    placed: BoolArray,
    sheets: MarkerSheets,
    sightings: Sequence[marker_map.Sighting],
) -> marker_map.SeenMarkers:
    """Return the seen markers with a pose in a map of `ids`, from images that show at least two."""
    number = {marker: k for k, marker in enumerate(ids) if placed[k]}
    rows = [
        (image, number[marker], corners)
        for image, one in enumerate(sightings)
        if one.problem is None
        and sum(marker in number for marker in one.corners_px) >= _LEAST_MARKERS
        for marker, corners in sorted(one.corners_px.items())
        if marker in number
    ]
    return marker_map.SeenMarkers(
        tuple(one.name for one in sightings),
        ids,
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1] for row in rows], np.int64),
        np.array([row[2] for row in rows], float).reshape(-1, 4, 2),
        np.array([sheets.size_of(marker) for marker in ids]),
    )
