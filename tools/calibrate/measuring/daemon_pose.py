"""A pose at which a daemon's robot stands, read into the data of a calibration."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration.geometry import geometry_sha256, write_text
from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.reading.reader import Profile, read_json_model
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.calibration.readings.camera_data import CameraSetup
from cdpr_rt.calibration.readings.data import CalibrationData, load_data
from cdpr_rt.procedures.calibration.measure_poses import PoseRefusedError, read_pose
from cdpr_tools.calibrate.measuring.run import COUNTED, DATA
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.pose_reader import DaemonReader
from cdpr_tools.errors import BadInputError, WorkFailedError

if TYPE_CHECKING:
    from cdpr_tools.calibrate.measuring.pose_camera import PoseCamera

_COUNTS_ANEW_m = 1e-5


class CountedFrom(Profile):
    """The lengths at which the motors' angles are zero: others, once lengths count anew."""

    length_m: tuple[float, ...] = Field(max_length=64)


def robot_of(daemon: Daemon) -> tuple[Robot, dict[str, Any]]:
    """Return the robot that a daemon runs, and what it tells of it.

    Raises BadInputError where it has no platform, runs with a calibration in force, by which its
    lengths would count, or has been loaded from another state of its file.
    """
    description = daemon.get("/description")
    robot = load_robot(description["reference"])
    if robot.platform is None:
        raise BadInputError(f"{robot.path}: has no platform; allowed: robots with a [platform]")
    if description["calibration"] is not None:
        raise BadInputError(
            f"{robot.profile} runs with a calibration in force, and its lengths count by that; "
            f"allowed: by its file: cdpr calibrate undo {robot.reference}, then start it anew"
        )
    if description["geometry_sha256"] != geometry_sha256(robot):
        raise BadInputError(f"{robot.path}: has been changed since the daemon was started with it")
    return robot, description


def read_into(
    daemon: Daemon,
    robot: Robot,
    data: CalibrationData,
    folder: Path,
    camera: PoseCamera | None = None,
) -> CalibrationData:
    """Read the pose at which the robot stands, and write it behind those of the folder's data.

    Returns all of them. Raises ProfileError, BadInputError, WorkFailedError.
    """
    m_per_rad = np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])
    number = len(data.poses) + 1

    def image(wait: Callable[[float], None]) -> Sighting | None:
        return None if camera is None else camera.see(number, wait)

    reader = DaemonReader(daemon, m_per_rad, image)
    place = reader.place()
    if not data.poses:
        _require_home(robot, place)
    try:
        reading = read_pose(reader, place)
    except PoseRefusedError as error:
        raise WorkFailedError(str(error)) from None
    restarts = data.restarts
    if data.poses:
        before = read_json_model(folder / COUNTED, CountedFrom).length_m
        if np.abs(np.array(before) - reader.counted_m).max() > _COUNTS_ANEW_m:
            restarts += (len(data.poses),)
    after = data.model_copy(update={"poses": (*data.poses, reading), "restarts": restarts})
    counted = CountedFrom(length_m=tuple(reader.counted_m.tolist())).model_dump_json() + "\n"
    if not data.poses:
        write_text(folder / COUNTED, counted)
    after.save(folder / DATA)
    # killed before, the next reading compares with an older one, and no restart is lost
    write_text(folder / COUNTED, counted)
    return after


def data_of(folder: Path, robot: Robot, simulated: bool) -> CalibrationData:
    """Return what the folder holds already, no poses of a new one.

    Raises ProfileError, BadInputError.
    """
    if not (folder / DATA).exists():
        return CalibrationData(
            robot=robot.profile,
            geometry_sha256=geometry_sha256(robot),
            simulated=simulated,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            poses=(),
        )
    data = load_data(folder / DATA)
    if (data.robot, data.geometry_sha256, data.simulated) != (
        robot.profile,
        geometry_sha256(robot),
        simulated,
    ):
        raise BadInputError(
            f"{folder / DATA}: of another robot, bus or state of its file; allowed: another --out"
        )
    if not (folder / COUNTED).exists():
        raise BadInputError(f"{folder}: of a run that moved by itself; allowed: another --out")
    return data


def with_camera(
    data: CalibrationData, intrinsics: Path | None, markers: Path | None
) -> CalibrationData:
    """Return data that say what camera and sheets are, by these files for the first pose.

    Raises ProfileError, BadInputError.
    """
    if data.camera is not None:
        return data
    if data.poses:
        raise BadInputError("--camera: the poses before were read without; allowed: another --out")
    if intrinsics is None or markers is None:
        raise BadInputError("--camera: the first pose wants --intrinsics and --markers as well")
    setup = CameraSetup(
        intrinsics=CameraIntrinsics.load_file(intrinsics), sheets=MarkerSheets.load_file(markers)
    )
    return data.model_copy(update={"camera": setup})


def _require_home(robot: Robot, place: FloatArray) -> None:
    """Raise BadInputError where the first pose is not that from which lengths count."""
    platform = robot.platform
    assert platform is not None  # see `robot_of`
    k = len(platform.home_m)
    off_m = float(np.abs(place[:k] - np.array(platform.home_m)).max())
    if off_m > platform.home_tolerance_m:
        raise BadInputError(
            f"the platform is {1e3 * off_m:.0f} mm from home; allowed for the first pose: home, "
            "where it stands after `cdpr lower`, `cdpr tighten`"
        )


def lines(robot: Robot, data: CalibrationData) -> list[str]:
    """Return what was read last, for people."""
    assert robot.platform is not None  # see `robot_of`
    reading = data.poses[-1]
    place = ", ".join(f"{1e3 * x:.1f}" for x in reading.target[: len(robot.platform.home_m)])
    low, high = min(reading.tension_N), max(reading.tension_N)
    said = [f"pose {len(data.poses)} at {place} mm: tensions {low:.1f} to {high:.1f} N"]
    if reading.image is not None:
        said[0] += f"; {len(reading.image.markers)} markers in the image"
    if data.restarts and data.restarts[-1] == len(data.poses) - 1:
        said.append("lengths count anew since the pose before: these have offsets of their own")
    return said
