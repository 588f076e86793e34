"""`cdpr calibrate check`: ten poses of a calibrated robot, and whether it is as it was."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.calibration.in_force import calibrated, in_force
from cdpr_rt.calibration.camera.seen_poses import with_seen_poses
from cdpr_rt.calibration.check import Check, check_geometry
from cdpr_rt.calibration.estimation.fit import Fit
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.outcome import wanted_mm
from cdpr_rt.calibration.readings.camera_data import CameraSetup
from cdpr_rt.calibration.readings.data import CalibrationData, load_data
from cdpr_rt.core.clock import Clock
from cdpr_rt.procedures.calibration.measure_poses import (
    Measured,
    PoseRefusedError,
    measure_poses,
    read_pose,
)
from cdpr_tools.calibrate.finish import identified
from cdpr_tools.calibrate.measuring.daemon_pose import (
    DaemonPoses,
    held_place,
    image_taker,
    no_poses,
    robot_of,
)
from cdpr_tools.calibrate.measuring.daemon_run import DaemonOperator, read_places
from cdpr_tools.calibrate.measuring.places import chosen_places
from cdpr_tools.calibrate.measuring.rig import simulated_rig
from cdpr_tools.calibrate.measuring.run import DATA
from cdpr_tools.calibrate.measuring.ways import StoppedError
from cdpr_tools.client.client import Daemon
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.robots.poses.choice import Choose
from cdpr_tools.signals import HELD, stop_on_signals

if TYPE_CHECKING:
    from cdpr_tools.calibrate.measuring.pose_camera import PoseCamera

POSES = 10
CHECK, IMAGES = "check.json", "images"
_LEAST = 5
_SHARE = 1.0 / 3.0
"""Of the error that is wanted at most: what has changed by less does not matter yet."""


@dataclass(frozen=True)
class Before:
    """What a calibration with the camera has left: its data and its fit."""

    data: CalibrationData
    found: Fit

    @property
    def setup(self) -> CameraSetup:
        """The camera's."""
        assert self.data.camera is not None  # see `before`
        return self.data.camera


def before(out: Output, file: Robot) -> Before | None:
    """Return the data of the calibration in force and their fit; None where no camera had a part.

    Says where the data are gone. Raises ProfileError for data that cannot be read,
    InvalidRequestError for such of another robot.
    """
    known = in_force(file)
    if known is None or known.method != "camera":
        return None
    if not Path(known.raw_data).exists():
        out.note(f"{known.raw_data}: is gone, and the map with it; the camera is left aside")
        return None
    data = load_data(Path(known.raw_data))
    outcome = identified(file, data, None, CableGeometry.of(file))
    return Before(data, outcome.found)


def checked(
    out: Output, file: Robot, plant: Path | None, scanner: bool, seed: int, folder: Path
) -> Check:
    """Take a simulated robot, with its calibration in force, to ten poses and look at it.

    Where it was calibrated with the camera, that looks as well. The readings are kept in the
    folder. Raises what the robot does, WorkFailedError.
    """
    _require_other_folder(folder)
    robot, known = calibrated(file), before(out, file)
    return _judged(robot, known, _read(out, robot, plant, scanner, seed, folder, known))


def checked_running(
    out: Output, file: Robot, daemon: Daemon, camera: str | None, seed: int, folder: Path
) -> Check:
    """Do the same with the robot that a daemon runs with that calibration, from home.

    It looks with the `camera` of a URL where there is one. Raises CommandError besides.
    """
    _require_other_folder(folder)
    robot, description = robot_of(daemon, as_calibrated=True)
    if robot.path != file.path:
        raise BadInputError(f"{file.reference}: the daemon of this name runs {robot.reference}")
    known = before(out, file)
    if known is None and camera is not None:
        raise BadInputError("--camera: allowed: of a robot that was calibrated with one")
    if known is not None and camera is None:
        out.note("--camera is left out: lengths alone are looked at")
        known = None
    kept = DaemonPoses(folder, no_poses(robot, description["simulated"]), CHECK)
    kept.require_home(robot, held_place(daemon, robot))  # before what takes a while
    places = chosen_places(robot, POSES, seed, Choose.SPREAD)
    if known is not None:
        kept.data = kept.data.model_copy(update={"camera": known.setup})
    with (
        stop_on_signals(HELD) as stop,
        image_taker(camera, None, None, kept, out.note) as image,
    ):
        try:
            operator = DaemonOperator(daemon, robot, image, stop)
            read_places(out, robot, operator, kept, places, POSES + 1)
        except StoppedError:
            raise WorkFailedError("stopped; nothing is said of the robot") from None
    return _judged(robot, known, kept.data)


def _require_other_folder(folder: Path) -> None:
    """Raise BadInputError for the folder of a calibration, whose files would be written over."""
    if (folder / DATA).exists():
        raise BadInputError(f"--out {folder}: has the poses of a calibration; allowed: another")


def _judged(robot: Robot, known: Before | None, data: CalibrationData) -> Check:
    if len(data.poses) <= _LEAST:
        raise WorkFailedError(f"{len(data.poses) - 1} poses of {POSES} only: {data.left_out[-1]}")
    geometry = CableGeometry.of(robot)
    seen = data.observations(robot, geometry.model)
    if known is not None:
        seen = with_seen_poses(known.found, known.setup.sheets, seen, data.sightings())
    return check_geometry(geometry, seen, _SHARE * 1e-3 * wanted_mm(robot))


def _read(
    out: Output,
    robot: Robot,
    plant: Path | None,
    scanner: bool,
    seed: int,
    folder: Path,
    known: Before | None,
) -> CalibrationData:
    """Return readings at home and at ten poses far from each other, all over the workspace."""
    places = chosen_places(robot, POSES, seed, Choose.SPREAD)
    out.note(f"{robot.profile}: starting the simulated robot ...")

    def camera(url: str, clock: Clock) -> PoseCamera:
        from cdpr_tools.calibrate.measuring.pose_camera import (  # noqa: PLC0415  # needs an extra
            PoseCamera,
        )

        assert known is not None  # asked for with one alone
        setup, images = known.setup, folder / IMAGES
        return PoseCamera(url, clock, setup.intrinsics, setup.sheets, images, out.note)

    def keep() -> None:
        count = len(measured.readings)
        operator.number = count + 1
        advance(float(count))
        out.note(f"pose {count - 1} of {len(places.chosen)}" if count > 1 else "home is read")

    measured = Measured(keep)
    try:
        with (
            stop_on_signals("the robot is brought to rest and switched off") as stop,
            out.progress(f"reading {POSES + 1} poses", float(POSES + 1)) as advance,
            simulated_rig(
                str(robot.path),
                plant=plant,
                scanner=scanner,
                camera=None if known is None else camera,
                stop=stop,
                as_calibrated=True,
            ) as operator,
        ):
            operator.number = 1
            measured.add(read_pose(operator, operator.tighten()))
            for batch in places.batches():
                measure_poses(operator, batch, places.middle, measured, out)
    except StoppedError:
        raise WorkFailedError("stopped; nothing is said of the robot") from None
    except PoseRefusedError as error:
        raise WorkFailedError(f"{robot.profile}: at home: {error}") from error
    return _kept(robot, measured, known, folder)


def _kept(robot: Robot, measured: Measured, known: Before | None, folder: Path) -> CalibrationData:
    """Return what was read, which is in the folder then."""
    data = no_poses(robot, simulated=True).model_copy(
        update={
            "left_out": tuple(measured.refused),
            "camera": None if known is None else known.setup,
            "poses": tuple(measured.readings),
        }
    )
    data.save(folder / CHECK)
    return data


def lines(found: Check, robot: Robot) -> list[str]:
    """Return what the check says, and what to do."""
    verdict = found.verdict()
    known = calibrated(robot).calibration
    against = (
        "its file" if known is None else f"calibration {known.version} of {known.date:%Y-%m-%d}"
    )
    verdict[0] = f"{robot.profile} against {against}: {verdict[0]}"
    if found.moved:
        verdict.append(
            f"mend what moved, or calibrate anew: cdpr calibrate run {robot.reference}; until then "
            "positions are off by what is said above"
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
