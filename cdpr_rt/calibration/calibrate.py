"""Make a calibration from observations, and move it into the frame of the robot's file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera_geometry import exponentials, logarithms
from cdpr_rt.calibration.camera_model import UNKNOWN_HAND_EYE_STD, CameraKnowledge, CameraModel
from cdpr_rt.calibration.camera_start import camera_start
from cdpr_rt.calibration.faults import (
    Fault,
    fit_without_faults,
    free_wrong_values,
    hand_eye_fault,
    map_faults,
    moved_or_slipped,
    parameter_faults,
    place_faults,
    without_points,
    without_slipped_points,
)
from cdpr_rt.calibration.fit import Fit, fit, fit_with_noise_seen, locate
from cdpr_rt.calibration.marker_map import best_fit, coverage, laid_out
from cdpr_rt.calibration.marker_map_fit import MapFit
from cdpr_rt.calibration.noise import noise_seen
from cdpr_rt.calibration.outcome import LEAST_POINTS, CalibrationMethod, Outcome
from cdpr_rt.calibration.parameters import DRUM, EXIT, CableGeometry
from cdpr_rt.calibration.readings import Images, Observations
from cdpr_rt.calibration.residuals import encoder_lengths
from cdpr_rt.calibration.verification import (
    LEAST_POSES,
    Predicted3Sigma,
    absolute_3_sigma,
    change_of,
    held_out,
    hold_out,
    open_directions,
    predicted_3_sigma,
    require_enough,
    with_more_poses,
)
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.cable_kernel import ANCHOR, RADIUS
from cdpr_rt.model.robot_arrays import limits_of

_GRID = 4
_SLACK_SHARE = 0.5


def calibrate(
    robot: Robot,
    geometry: CableGeometry,
    seen: Observations,
    method: CalibrationMethod,
    images: Images | None = None,
) -> Outcome:
    """Return the calibration from observations; raise InvalidRequestError if they are too few.

    With images, camera and markers are fitted too. One fit uses all poses except faulty readings; a
    second fit also leaves out one pose in five, or blocks of time while the platform moves. Those
    poses verify the second fit, which does not use them at all, not even to find faults. Measured
    points that the first fit has found wrong are not used for verification; the outcome gives their
    number. Without images, the noise of readings is estimated first.
    """
    if seen.poses < LEAST_POSES:
        raise InvalidRequestError(
            f"{seen.poses} poses; allowed: {LEAST_POSES} or more, because some verify the "
            "result of the others"
        )
    if seen.tension_assumed:
        kinds = tuple(kind for kind in geometry.identified if kind != "elongation")
        geometry = replace(geometry, identified=kinds)
    slack = _SLACK_SHARE * np.asarray(limits_of(robot).slack_N, float)
    noise = None
    if images is None:
        require_enough(geometry, seen.some(~held_out(seen)))
        noise = noise_seen(geometry, seen, partial(_without_faults, slack))
        geometry, seen = noise.geometry, noise.seen
        all_of_it = _of_cables(geometry, seen, slack)
    else:
        all_of_it = _with_camera(geometry, seen, slack, images)
    found, first_map = all_of_it.fit, all_of_it.map
    known_room = all_of_it.known_room or bool(all_of_it.seen.measured.sum() >= LEAST_POINTS)
    unused = hold_out(
        geometry, all_of_it.weighed, all_of_it.seen, slack, found, first_map, all_of_it.images
    )
    grid = _grid(found.geometry)
    honesty = unused.honesty()
    birge = honesty.ratio
    larger = max(birge, 1.0) if known_room and math.isfinite(birge) else 1.0
    known = predicted_3_sigma(found, grid, not known_room, larger)
    with_more = predicted_3_sigma(with_more_poses(found), grid, not known_room, larger)
    absolute = absolute_3_sigma(found, grid, larger)
    if known_room or all_of_it.seen.measured.any():
        absolute = absolute.with_shared_scale(grid[:, 0, : geometry.coordinates])
    else:  # the file alone determines the frame
        exits_mm = math.sqrt(max(absolute.position_mm**2 - known.position_mm**2, 0.0))
        framed = in_frame_of_file(found, geometry, grid, 1e-3 * exits_mm / 3.0)
        part = in_frame_of_file(unused.part, geometry, grid, 1e-3 * exits_mm / 3.0).found
        found, unused, absolute = framed.found, replace(unused, part=part), framed.known_to(known)
    change = change_of(found, grid, not known_room, larger)
    cover = None
    if images is not None:
        cover = coverage(images.sightings, images.setup.sheets.placed)
    return Outcome(
        robot, found, method, all_of_it.faults, open_directions(found),
        unused.verified(), unused.before(geometry), int((~unused.seen.used).sum()),
        known, with_more.position_mm, absolute, known_room,
        position_shift(found, geometry, grid), unused, change, honesty, cover=cover, noise=noise,
        verifying_points_left_out=all_of_it.verifying_left_out,
    )  # fmt: skip


@dataclass(frozen=True)
class _Whole:
    """The fit to all poses, and the faults found in the observations."""

    fit: Fit
    weighed: CableGeometry
    """Geometry of the robot's file, with the accuracy of readings that the fit has found."""
    faults: list[Fault]
    seen: Observations
    """Observations without wrong points, but with the lengths that the fit has left out."""
    verifying_left_out: int
    """Number of wrong points at poses that would otherwise have verified the fit."""
    map: MapFit | None = None
    known_room: bool = False
    """Whether poses of markers in the room are known."""
    images: Images | None = None
    """The images; their setup has only those known marker poses that agree with each other."""


def _of_cables(geometry: CableGeometry, seen: Observations, slack_N: FloatArray) -> _Whole:
    seen, of_points = without_slipped_points(geometry, seen, slack_N)
    found, faults = fit_without_faults(geometry, seen, slack_N)
    found, weighed = fit_with_noise_seen(found, geometry)
    faults = of_points + faults
    left_out = _verifying_left_out(seen, faults)
    return _Whole(found, weighed, faults, without_points(seen, faults), left_out)


def _without_faults(
    slack_N: FloatArray, geometry: CableGeometry, seen: Observations
) -> tuple[Fit, int]:
    """Return the fit without faulty readings, and their number."""
    found, faults = fit_without_faults(geometry, seen, slack_N)
    return found, sum(fault.pose >= 0 for fault in faults)


def _verifying_left_out(seen: Observations, faults: list[Fault]) -> int:
    """Return how many wrong points are at poses that would be held out if the points were right."""
    held = held_out(seen)
    return sum(bool(held[fault.pose]) for fault in faults if fault.kind == "point")


def _with_camera(
    geometry: CableGeometry, seen: Observations, slack_N: FloatArray, images: Images
) -> _Whole:
    start = camera_start(geometry, seen, images.setup, images.sightings)
    require_enough(geometry, start.seen.some(~held_out(start.seen)))
    known, of_points = without_slipped_points(geometry, start.seen, slack_N)
    given = start.camera.knowledge
    # The given pose of the camera is used only after it agrees with the readings. A wrong pose
    # would look like faults of cables, and hide real ones.
    unknown = start.camera.with_hand_eye(
        given.position_m, given.rotation, np.array(UNKNOWN_HAND_EYE_STD)
    )
    found, faults = fit_without_faults(geometry, known, slack_N, unknown)
    misplaced = None
    if images.setup.hand_eye is not None:
        misplaced = hand_eye_fault(found, given)
        if misplaced is None:
            found = _with_hand_eye(geometry, found, given)
    found, wrong = free_wrong_values(geometry, found, start.map)
    if misplaced is not None and wrong and hand_eye_fault(found, given, wrong) is None:
        misplaced, found = None, _with_hand_eye(geometry, found, given)
    # if the drum radii of the file are wrong, they must not constrain the fit
    believed = replace(geometry, knowledge=found.geometry.knowledge)
    found, weighed = fit_with_noise_seen(found, believed)
    readings = [one for one in faults if one.kind not in ("drum", "elongation")]
    of_map = map_faults(start.map, laid_out(images.sightings, images.setup.sheets.placed))
    of_wrong = {(one.kind, one.cable) for one in wrong}
    others = [one for one in parameter_faults(found) if (one.kind, one.cable) not in of_wrong]
    faults = [
        *of_points, *place_faults(start), *of_map, *readings, *moved_or_slipped(readings),
        *([] if misplaced is None else [misplaced]), *wrong, *others,
    ]  # fmt: skip
    left_out = _verifying_left_out(known, faults)
    known = without_points(known, faults)
    used = replace(images, setup=start.setup)
    return _Whole(found, weighed, faults, known, left_out, start.map, start.known_room, used)


def _with_hand_eye(geometry: CableGeometry, found: Fit, given: CameraKnowledge) -> Fit:
    """Return the fit with the hand-eye transform from its file."""
    camera = found.fitted_camera
    camera = camera.with_hand_eye(given.position_m, given.rotation, given.hand_eye_std)
    known = replace(geometry, knowledge=found.geometry.knowledge)
    seen = replace(found.seen, start=found.poses)
    return fit(known, seen, start=found.geometry, camera=camera)


def _grid(geometry: CableGeometry) -> FloatArray:
    """Return poses spread over the workspace, at home's orientation."""
    platform = geometry.model.platform
    axes = [
        np.linspace(low, high, _GRID)
        for low, high in zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return geometry.model.poses(places)


# The frame of a calibration. Lengths, and markers at unknown poses, determine positions relative to
# each other. They do not determine where the robot is in its room: the residuals do not change if
# all exit points and poses move together. Then only the robot's file determines the frame.

STAND_m: Final = 0.005
STAND_rad: Final = 0.005
"""Standard deviations of the platform's position and orientation on its stand, at which the
encoders start to count."""


@dataclass(frozen=True)
class FrameOfFile:
    """A fit in the frame of the robot's file, and how well that frame is known."""

    found: Fit
    share: float
    """Weight of the frame given by home; the frame of the exit points has the rest of 1."""

    def known_to(self, relative: Predicted3Sigma) -> Predicted3Sigma:
        """Return the accuracy of poses in this frame; `relative` is the accuracy between poses."""
        turned = relative.orientation_deg
        stand_mm, stand_deg = (
            3.0 * math.sqrt(self.share) * std for std in (1e3 * STAND_m, math.degrees(STAND_rad))
        )
        return Predicted3Sigma(
            math.hypot(relative.position_mm, stand_mm),
            None if turned is None else math.hypot(turned, stand_deg),
        )


def in_frame_of_file(
    found: Fit, file: CableGeometry, poses: FloatArray, exits_std_m: float
) -> FrameOfFile:
    """Return a fit moved as a whole into the frame of the robot's file.

    The file determines the frame twice. The first way uses the exit points: the fit displaces them
    as little as possible as a whole, so they determine the frame with `exits_std_m`. The second way
    uses home, at which the lengths begin to count: fit and file compute poses near `poses` (M, 4,
    3) from the same lengths. The rigid motion between these poses (least squares over anchor
    points) has the accuracy `STAND_m`. The result weights both ways by their variances.
    """
    geometry = found.geometry
    if "exit" not in geometry.identified:
        return FrameOfFile(found, 0.0)
    by_fit, by_file = _by_both(found, file, poses)
    turn, shift = best_fit(_anchors(geometry, by_fit), _anchors(geometry, by_file))
    share = exits_std_m**2 / (exits_std_m**2 + STAND_m**2)
    middle = by_fit[:, 0].mean(axis=0)
    moved = share * (turn @ middle + shift - middle)
    turn = exponentials(share * logarithms(turn))[0]
    shift = middle + moved - turn @ middle
    exits = geometry.kernel_geometry()[:3].T
    cable = geometry.cable.copy()
    cable[:, EXIT] += exits @ turn.T + shift - exits
    camera = None if found.camera is None else _moved_camera(found.camera, turn, shift)
    there = replace(
        found, geometry=replace(geometry, cable=cable), camera=camera,
        poses=_moved(found.poses, turn, shift),
    )  # fmt: skip
    return FrameOfFile(there, share)


def position_shift(found: Fit, file: CableGeometry, poses: FloatArray) -> FloatArray:
    """Return how far, m, (k,), a fit displaces positions at `poses` (M, 4, 3) on average."""
    by_fit, by_file = _by_both(found, file, poses)
    return np.asarray((by_fit - by_file)[:, 0, : file.coordinates].mean(axis=0))


def _by_both(found: Fit, file: CableGeometry, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the poses that the fit and the file give for the encoder lengths at `poses`."""
    geometry, seen = found.geometry, found.seen
    tension = np.tile(np.median(seen.tension_N, axis=0), (len(poses), 1))
    drum = geometry.cable[:, DRUM]
    length = encoder_lengths(geometry, poses, tension)
    length = (length + drum * seen.reference_m) / (1.0 + drum)
    there = replace(Observations.of_lengths(length, tension, poses), reference_m=seen.reference_m)
    by_fit, by_file = (locate(one, there).poses for one in (geometry, file))
    return by_fit, by_file


def _anchors(geometry: CableGeometry, poses: FloatArray) -> FloatArray:
    """Return all anchor points of platforms at poses (M, 4, 3), (M n, 3)."""
    anchors = geometry.kernel_geometry()[ANCHOR:RADIUS]
    return np.asarray((poses[:, :1] + (poses[:, 1:] @ anchors).transpose(0, 2, 1)).reshape(-1, 3))


def _moved(poses: FloatArray, turn: FloatArray, shift: FloatArray) -> FloatArray:
    out = turn @ poses[:, 1:]
    place = poses[:, 0] @ turn.T + shift
    return np.concatenate([place[:, None], out], axis=1)


def _moved_camera(camera: CameraModel, turn: FloatArray, shift: FloatArray) -> CameraModel:
    known = camera.knowledge
    known = replace(
        known, marker_position_m=known.marker_position_m @ turn.T + shift,
        marker_rotation=turn @ known.marker_rotation,
    )  # fmt: skip
    return replace(
        camera, knowledge=known, marker_position_m=camera.marker_position_m @ turn.T + shift,
        marker_rotation=turn @ camera.marker_rotation,
    )  # fmt: skip
