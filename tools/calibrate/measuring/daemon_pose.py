"""A pose at which a daemon's robot stands, read into the data of a calibration."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration.geometry import geometry_sha256, write_text
from cdpr_profiles.calibration.in_force import calibrated
from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_profiles.reading.reader import Profile, read_json_model
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.calibration.readings.camera_data import CameraSetup
from cdpr_rt.calibration.readings.data import CalibrationData, PoseReading, load_data
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.procedures.calibration.measure_poses import PoseRefusedError, read_pose
from cdpr_tools.calibrate.measuring.run import COUNTED, DATA, IMAGES
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.pose_reader import DaemonReader
from cdpr_tools.errors import BadInputError, WorkFailedError

_COUNTS_ANEW_m = 1e-5
TakeImage = Callable[[Callable[[float], None]], Sighting | None]
"""Takes an image, given what lets time pass; None without a camera."""


class CountedFrom(Profile):
    """The lengths at which the motors' angles are zero: others, once lengths count anew."""

    length_m: tuple[float, ...] = Field(max_length=64)


def robot_of(daemon: Daemon, as_calibrated: bool = False) -> tuple[Robot, dict[str, Any]]:
    """Return the robot that a daemon runs, and what it tells of it.

    It is to run by its file, or `as_calibrated`. Raises BadInputError where it does not, where it
    has no platform, or has been loaded from another state of its file or its calibration.
    """
    description = daemon.get("/description")
    robot = load_robot(description["reference"])
    if robot.platform is None:
        raise BadInputError(f"{robot.path}: {NO_PLATFORM}")
    if as_calibrated:
        robot = calibrated(robot)
    elif description["calibration"] is not None:
        raise BadInputError(
            f"{robot.profile} runs with a calibration in force, and its lengths count by that; "
            f"allowed: by its file: cdpr calibrate undo {robot.reference}, then start it anew"
        )
    if description["geometry_sha256"] != geometry_sha256(robot):
        what = "or its calibration, " if as_calibrated else ""
        raise BadInputError(
            f"{robot.path}: {what}has been changed since the daemon was started with it"
        )
    return robot, description


def held_place(daemon: Daemon, robot: Robot) -> FloatArray:
    """Return where a daemon's platform is, (d,); raises WorkFailedError where it is not held."""
    return DaemonReader(daemon, cable_m_per_rad(robot), lambda _wait: None).place()


def no_poses(robot: Robot, simulated: bool) -> CalibrationData:
    """Return the data of a robot of which nothing has been read yet."""
    return CalibrationData(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=simulated,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        poses=(),
    )


class DaemonPoses:
    """Poses of a robot that a daemon runs, in a folder; each is kept as soon as it is read."""

    def __init__(self, folder: Path, data: CalibrationData, name: str = DATA) -> None:
        self.folder, self.data, self._path = folder, data, folder / name

    def require_home(self, robot: Robot, place: FloatArray) -> None:
        """Raise BadInputError where the first pose, (d,), is not that from which lengths count."""
        platform = robot.platform
        assert platform is not None  # see `robot_of`
        k = len(platform.home_m)
        off_m = float(np.abs(place[:k] - np.array(platform.home_m)).max())
        if not self.data.poses and off_m > platform.home_tolerance_m:
            raise BadInputError(
                f"the platform is {1e3 * off_m:.0f} mm from home; allowed for the first pose: "
                "home, where it stands after `cdpr lower`, `cdpr tighten`"
            )

    def add(self, reading: PoseReading, counted_m: FloatArray) -> None:
        """Keep a reading behind those before; raises ProfileError.

        `counted_m` (n,) are the lengths at which the motors' angles are zero.
        """
        poses, restarts = self.data.poses, self.data.restarts
        if poses:
            before = read_json_model(self.folder / COUNTED, CountedFrom).length_m
            if np.abs(np.array(before) - counted_m).max() > _COUNTS_ANEW_m:
                restarts += (len(poses),)
        update = {"poses": (*poses, reading), "restarts": restarts}
        self.data = self.data.model_copy(update=update)
        counted = CountedFrom(length_m=tuple(counted_m.tolist())).model_dump_json() + "\n"
        if not poses:
            write_text(self.folder / COUNTED, counted)
        self.save()
        # killed before, the next reading compares with an older one, and no restart is lost
        write_text(self.folder / COUNTED, counted)

    def save(self) -> None:
        """Write what there is; raises ProfileError."""
        self.data.save(self._path)


def read_into(reader: DaemonReader, robot: Robot, kept: DaemonPoses) -> None:
    """Read the pose at which the robot stands, and keep it.

    Raises ProfileError, BadInputError, WorkFailedError.
    """
    place = reader.place()
    kept.require_home(robot, place)
    try:
        reading = read_pose(reader, place)
    except PoseRefusedError as error:
        raise WorkFailedError(str(error)) from None
    kept.add(reading, reader.counted_m)


def cable_m_per_rad(robot: Robot) -> FloatArray:
    """Return the cable that is paid out by each motor, (n,)."""
    return np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])


def data_of(folder: Path, robot: Robot, simulated: bool) -> CalibrationData:
    """Return what the folder holds already, no poses of a new one.

    Raises ProfileError, BadInputError.
    """
    if not (folder / DATA).exists():
        return no_poses(robot, simulated)
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


@contextmanager
def image_taker(
    camera: str | None,
    intrinsics: Path | None,
    markers: Path | None,
    kept: DaemonPoses,
    note: Callable[[str], None],
) -> Iterator[TakeImage]:
    """Yield what takes an image of the next pose with the camera of a URL, where there is one.

    The data of the first pose say what camera and sheets are, by these files. Raises CameraError,
    ProfileError, BadInputError.
    """
    if camera is None:
        yield lambda _wait: None
        return
    from cdpr_tools.calibrate.measuring.pose_camera import (  # noqa: PLC0415  # needs an extra
        PoseCamera,
    )

    setup = _camera_setup(kept.data, intrinsics, markers)
    kept.data = kept.data.model_copy(update={"camera": setup})
    images = kept.folder / IMAGES
    opened = PoseCamera(camera, PacedClock(), setup.intrinsics, setup.sheets, images, note)
    with closing(opened):
        yield lambda wait: opened.see(len(kept.data.poses) + 1, wait)


def _camera_setup(
    data: CalibrationData, intrinsics: Path | None, markers: Path | None
) -> CameraSetup:
    if data.camera is not None:
        _require_same("--intrinsics", intrinsics, data.camera.intrinsics)
        _require_same("--markers", markers, data.camera.sheets)
        return data.camera
    if data.poses:
        raise BadInputError("--camera: the poses before were read without; allowed: another --out")
    if intrinsics is None or markers is None:
        raise BadInputError("--camera: the first pose wants --intrinsics and --markers as well")
    return CameraSetup.of(CameraIntrinsics.load_file(intrinsics), MarkerSheets.load_file(markers))


def _require_same(option: str, path: Path | None, kept: Profile) -> None:
    """Raise BadInputError where a file says otherwise than that of the first pose; ProfileError."""
    if path is None:
        return
    given = type(kept).load_file(path).model_dump()
    other = [
        f"{key} {given[key]!r}, {value!r} at the first pose"
        for key, value in kept.model_dump().items()
        if given[key] != value
    ]
    if other:
        raise BadInputError(
            f"{option} {path}: {'; '.join(other)}; allowed: the same, leave it out, or another "
            "--out"
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
