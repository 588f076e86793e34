"""`cdpr calibrate check`: read ten poses of a calibrated robot and report what has changed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import calibrated, in_force
from cdpr_profiles.errors import FileMissingError, ProfileError
from cdpr_rt.calibration.camera_start import with_seen_poses
from cdpr_rt.calibration.check import Check, check_geometry, require_spare_length
from cdpr_rt.calibration.fit import Fit
from cdpr_rt.calibration.outcome import wanted_mm
from cdpr_rt.calibration.parameters import CableGeometry, Knowledge
from cdpr_rt.calibration.readings import CalibrationData, CameraSetup, HandEye, load_data
from cdpr_tools.calibrate.daemon_run import image_taker, robot_of
from cdpr_tools.calibrate.finish import identified, with_hand_eye
from cdpr_tools.calibrate.measure_poses import DATA, PoseOperator, StoppedError, StoredPoses
from cdpr_tools.calibrate.places import chosen_places
from cdpr_tools.calibrate.rig import simulated_rig
from cdpr_tools.calibrate.run import no_poses, read_places
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.robots.pose_choice import Choose
from cdpr_tools.signals import HELD, stop_on_signals

POSES = 10
CHECK = "check.json"
_LEAST = 5
_SAME_mm = 0.01
"""Exit points of a repeated fit that differ by no more than this count as unchanged."""
_SHARE = 1.0 / 3.0
"""Share of the largest acceptable error; a change with a smaller effect is still tolerated."""


@dataclass(frozen=True)
class Before:
    """Data and fit of an earlier calibration with the camera."""

    data: CalibrationData
    found: Fit

    @property
    def setup(self) -> CameraSetup:
        """Return the setup of the camera."""
        assert self.data.camera is not None  # see `before`
        return self.data.camera


def before(out: Output, file: Robot) -> Before | None:
    """Return the data of the calibration in force and their fit; None if it used no camera.

    The fit is repeated with the same settings. If that is no longer possible, a note says why.
    Raises ProfileError for unreadable data, InvalidRequestError for data of another robot.
    """
    known = in_force(file)
    if known is None or known.method != "camera":
        return None
    points, hand_eye = (Path(x) if x else None for x in (known.points_file, known.hand_eye_file))
    for path in filter(None, (Path(known.raw_data), points, hand_eye)):
        if not path.exists():
            out.note(f"{path}: is missing, and so is the map; the camera is not used")
            return None
    data = with_hand_eye(
        load_data(Path(known.raw_data)), None if hand_eye is None else HandEye.load_file(hand_eye)
    )
    knowledge = Knowledge(exit_m=known.known_exit_m)
    geometry = CableGeometry.of(file, known.identified, knowledge)
    found = identified(file, data, points, geometry).found
    k = found.geometry.coordinates
    exits = found.geometry.kernel_geometry()[:k].T
    off_mm = 1e3 * float(np.abs(exits - np.array(known.exit_points_m)).max())
    if off_mm > _SAME_mm:
        out.note(
            f"{known.raw_data}: exit points come out up to {off_mm:.2f} mm from those of "
            "the calibration in force: files or software have changed since; the camera is "
            "not used"
        )
        return None
    return Before(data, found)


def checked(
    out: Output, file: Robot, plant: Path | None, scanner: bool, seed: int, folder: Path
) -> Check:
    """Move a simulated robot, with its calibration in force, to ten poses and check it.

    If it was calibrated with the camera, the check uses the camera too. The readings are stored
    in the folder. Raises the robot's errors and WorkFailedError.
    """
    _require_other_folder(folder)
    robot, known = calibrated(file), before(out, file)
    if known is None and not scanner:
        require_spare_length(CableGeometry.of(robot))  # before the robot moves
    places = chosen_places(robot, POSES, seed, Choose.SPREAD)
    out.note(f"{robot.profile}: starting the simulated robot ...")

    kept = _nothing_read(folder, robot, known, simulated=True)
    with (
        stop_on_signals("the robot is brought to rest and switched off") as stop,
        _stopped(),
        simulated_rig(
            str(robot.path),
            plant=plant,
            scanner=scanner,
            images=None if known is None else partial(kept.images, out),
            stop=stop,
            as_calibrated=True,
        ) as operator,
    ):
        operator.tighten()
        read_places(out, robot, operator, kept, places, POSES + 1)
    return _judged(robot, known, kept.data)


def checked_running(
    out: Output, file: Robot, daemon: Daemon, camera: str | None, seed: int, folder: Path
) -> Check:
    """Check the robot that a daemon runs with its calibration in force, starting at home.

    `camera` is the URL of a camera, if there is one. Also raises CommandError.
    """
    _require_other_folder(folder)
    robot, description = robot_of(daemon, as_calibrated=True)
    if robot.path != file.path:
        raise BadInputError(
            f"{file.reference}: the running daemon uses {robot.reference}; end it with `cdpr stop`"
        )
    known = before(out, file)
    if known is None and camera is not None:
        raise BadInputError("--camera: allowed only if the robot was calibrated with a camera")
    if known is not None and camera is None:
        out.note("--camera is not given: only lengths are checked")
        known = None
    if known is None:
        require_spare_length(CableGeometry.of(robot))
    kept = _nothing_read(folder, robot, known, description["simulated"])
    with commanded(daemon) as running:  # before the slow choice of poses
        kept.require_home(robot, PoseOperator(running, robot).place())
    places = chosen_places(robot, POSES, seed, Choose.SPREAD)
    with (
        stop_on_signals(HELD) as stop,
        image_taker(camera, None, None, kept, out) as image,
        _stopped(),
        commanded(daemon, in_control=True) as running,
    ):
        operator = PoseOperator(running, robot, image, stop)
        read_places(out, robot, operator, kept, places, POSES + 1)
    return _judged(robot, known, kept.data)


def _nothing_read(folder: Path, robot: Robot, known: Before | None, simulated: bool) -> StoredPoses:
    """Return the empty data of a new check, in its folder."""
    camera = None if known is None else known.setup
    data = no_poses(robot, simulated, camera)
    return StoredPoses(folder, data, CHECK)


@contextmanager
def _stopped() -> Iterator[None]:
    try:
        yield
    except StoppedError:
        raise WorkFailedError("stopped; the robot was not checked") from None


def _require_other_folder(folder: Path) -> None:
    """Raise BadInputError if the check would overwrite files that no check has written."""
    if (folder / DATA).exists():
        raise BadInputError(
            f"--out {folder}: contains the poses of a calibration; choose another folder"
        )
    try:
        load_data(folder / CHECK)
    except FileMissingError:
        return
    except ProfileError as error:
        raise BadInputError(f"{error}; choose another --out, or move the file away") from None


def _judged(robot: Robot, known: Before | None, data: CalibrationData) -> Check:
    if len(data.poses) <= _LEAST:
        raise WorkFailedError(f"only {len(data.poses) - 1} of {POSES} poses: {data.left_out[-1]}")
    geometry = CableGeometry.of(robot)
    seen = data.observations(robot, geometry.model)
    if known is not None:
        seen = with_seen_poses(known.found, known.setup.sheets, seen, data.sightings())
    return check_geometry(geometry, seen, _SHARE * 1e-3 * wanted_mm(robot))


def lines(found: Check, robot: Robot) -> list[str]:
    """Return the verdict of the check and what to do, as lines of text."""
    verdict = found.verdict()
    known = calibrated(robot).calibration
    against = (
        "its file" if known is None else f"calibration {known.version} of {known.date:%Y-%m-%d}"
    )
    verdict[0] = f"{robot.profile} against {against}: {verdict[0]}"
    if found.moved:
        verdict.append(
            f"repair what moved, or recalibrate: cdpr calibrate run {robot.reference}; "
            "until then positions have the errors given above"
        )
    return verdict


def as_json(found: Check) -> dict[str, object]:
    """Return the check for JSON."""
    return {
        "moved": found.moved,
        "poses": found.poses,
        "residual_mm": 1e3 * found.residual_m,
        "misfit": float(np.round(found.misfit, 6)),
        "effect_mm": 1e3 * found.effect_m,
        "matters_from_mm": 1e3 * found.wanted_m,
        "changes": [change.as_json() for change in found.changes],
        "verdict": found.verdict(),
    }
