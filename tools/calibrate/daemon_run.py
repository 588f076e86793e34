"""Move a robot that a daemon runs to the poses of a calibration and read them."""

from __future__ import annotations

import math
import os
import select
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration_in_force import calibrated
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_profiles.reader import Profile
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.readings import CalibrationData, CameraSetup, load_points
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.calibrate import run
from cdpr_tools.calibrate.measure_poses import (
    COUNTED,
    DATA,
    PoseOperator,
    PoseRefusedError,
    StoredPoses,
    TakeImage,
    read_pose,
)
from cdpr_tools.client.client import Daemon
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.streams import discard_typed_ahead

# Read the pose at which a daemon's robot stands into the data of a calibration.


def robot_of(daemon: Daemon, as_calibrated: bool = False) -> tuple[Robot, dict[str, Any]]:
    """Return the robot that a daemon runs, and the daemon's description of it.

    The robot must run with the geometry of its file or, if `as_calibrated`, of its calibration.
    Raises BadInputError if it does not, if it has no platform, or if its file or calibration has
    changed since the start.
    """
    description = daemon.get("/description")
    return profile_of(description, as_calibrated), description


def profile_of(description: Mapping[str, Any], as_calibrated: bool = False) -> Robot:
    """Return the robot that a daemon describes; raises BadInputError as `robot_of` does."""
    robot = load_robot(description["reference"])
    if robot.platform is None:
        raise BadInputError(f"{robot.path}: {NO_PLATFORM}")
    if as_calibrated:
        robot = calibrated(robot)
    elif description["calibration"] is not None:
        raise BadInputError(
            f"{robot.profile} runs with an adopted calibration, which changes its lengths; undo it "
            f"with `cdpr calibrate undo {robot.reference}`, then start the robot again"
        )
    if description["geometry_sha256"] != geometry_sha256(robot):
        what = "the file or its calibration " if as_calibrated else ""
        raise BadInputError(f"{robot.path}: {what}has changed since the robot started")
    return robot


def read_into(reader: PoseOperator, robot: Robot, kept: StoredPoses) -> None:
    """Read the pose at which the robot stands, and keep it.

    Raises ProfileError, BadInputError, WorkFailedError.
    """
    place = reader.place()
    kept.require_home(robot, place)
    try:
        reading = read_pose(reader, place)
    except PoseRefusedError as error:
        raise WorkFailedError(str(error)) from None
    kept.add(reading, reader)


def data_of(folder: Path, robot: Robot, simulated: bool) -> CalibrationData:
    """Return the data that the folder already holds; data without poses for a new folder.

    Raises ProfileError, BadInputError.
    """
    data = run.refuse_foreign(folder)
    if data is None:
        return run.no_poses(robot, simulated)
    if (data.robot, data.geometry_sha256, data.simulated) != (
        robot.profile,
        geometry_sha256(robot),
        simulated,
    ):
        raise BadInputError(
            f"{folder / DATA}: is of another robot, another bus or an older robot file; "
            "choose another --out"
        )
    if not (folder / COUNTED).exists():
        raise BadInputError(f"{folder}: contains an automatic run; choose another --out")
    return data


@contextmanager
def image_taker(
    camera: str | None,
    intrinsics: Path | None,
    markers: Path | None,
    kept: StoredPoses,
    out: Output,
) -> Iterator[TakeImage]:
    """Yield a function that takes an image of the next pose with the camera of a URL, if given.

    Intrinsics and markers come from these files at the first pose, then from the stored data.
    Raises CameraError, ProfileError, BadInputError.
    """
    if camera is None:
        yield lambda _wait: None
        return
    kept.change(camera=_camera_setup(kept.data, intrinsics, markers))
    with kept.images(out, camera, PacedClock()) as image:
        yield image


def _camera_setup(
    data: CalibrationData, intrinsics: Path | None, markers: Path | None
) -> CameraSetup:
    if data.camera is not None:
        _require_same("--intrinsics", intrinsics, data.camera.intrinsics)
        _require_same("--markers", markers, data.camera.sheets)
        return data.camera
    if data.poses:
        raise BadInputError(
            "--camera: the earlier poses were read without a camera; choose another --out"
        )
    if intrinsics is None or markers is None:
        raise BadInputError("--camera: the first pose also needs --intrinsics and --markers")
    return CameraSetup.of(CameraIntrinsics.load_file(intrinsics), MarkerSheets.load_file(markers))


def _require_same(option: str, path: Path | None, kept: Profile) -> None:
    """Raise BadInputError if a file differs from that of the first pose; raises ProfileError."""
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
            f"{option} {path}: {'; '.join(other)}; give the same values, omit the option, "
            "or choose another --out"
        )


def lines(robot: Robot, data: CalibrationData) -> list[str]:
    """Return the last reading as lines of text."""
    assert robot.platform is not None  # see `robot_of`
    reading = data.poses[-1]
    place = ", ".join(f"{1e3 * x:.1f}" for x in reading.target[: len(robot.platform.home_m)])
    tensions = reading.tension_N or (math.nan,)
    said = [f"pose {len(data.poses)} at {place} mm: tensions {min(tensions):.1f} to "]
    said[0] += f"{max(tensions):.1f} N"
    if reading.image is not None:
        said[0] += f"; {len(reading.image.markers)} markers in the image"
    if data.restarts and data.restarts[-1] == len(data.poses) - 1:
        said.append("the zero of the lengths changed since the previous pose: they get new offsets")
    return said


def going_on(kept: StoredPoses) -> AbstractContextManager[None]:
    """Add to any error of the block how to continue; see `saying_how_to_continue`."""
    return run.saying_how_to_continue(kept, "the same command continues after these poses")


# Ask a person for the measured position while the platform stands; store it in a file of points.

_LOOK_S: Final = 0.2
_NAMES: Final = ("x", "y", "z")
_BYTES: Final = 4096
_MOVED_m: Final = 2e-3
_DOUBTFUL_m: Final = 0.2
"""A point that deviates by more must be typed twice: a calibration moves no exit point by more."""


def require_points_of(poses: int, path: Path) -> None:
    """Raise BadInputError if a file has points of poses that have not been read.

    Also raises ProfileError.

    Such points were measured at poses of an earlier run, whose data are no longer in the folder.
    """
    if not path.exists():
        return
    last = max((point.pose + 1 for point in load_points(path)), default=0)
    if last > poses:
        raise BadInputError(
            f"{path}: has a point of pose {last}, but only {poses} poses were read; it is from an "
            "earlier run: choose another --out, or remove the file"
        )


class PointsFile:
    """A file of measured positions for `--points`; raises ProfileError if writing fails.

    `coordinates` is the number of coordinates of the platform's origin, 2 or 3.
    """

    def __init__(self, path: Path, coordinates: int) -> None:
        self.names = _NAMES[:coordinates]
        self._path = path
        if not path.exists():
            self._append(",".join(["pose", *(f"{name}_mm" for name in self.names), "sigma_mm"]))

    def add(self, pose: int, numbers_mm: Sequence[float]) -> None:
        """Append the position and perhaps its sigma at a pose, counted from 1; nan is unknown."""
        cells = ("" if math.isnan(number) else repr(float(number)) for number in numbers_mm)
        self._append(",".join([str(pose), *cells]))

    def _append(self, line: str) -> None:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise ProfileError(self._path, "", f"cannot be written: {error.strerror}") from None


class AskedPoints:
    """Asks on standard input for a position at each pose, and stores it in a `PointsFile`.

    `place` returns the platform's place (d,) from its cables; it raises if the platform is no
    longer held or the user stops. It is called while waiting for input.
    """

    def __init__(
        self, out: Output, path: Path, coordinates: int, place: Callable[[], FloatArray]
    ) -> None:
        self._out, self._file = out, PointsFile(path, coordinates)
        self._names = self._file.names
        self._place, self._read = place, b""
        self._open = sys.stdin is not None  # None: closed by a shell's `<&-`

    def __call__(self, pose: int) -> None:
        """Ask for the position at a pose, counted from 1, at which the platform stands now.

        Raises WorkFailedError if the platform is moved meanwhile, and the errors of `place`.
        """
        if not self._open:
            return
        with self._out.paused():
            discard_typed_ahead()  # nobody has measured this pose yet
            self._ask(pose, self._origin_m())

    def _ask(self, pose: int, origin_m: FloatArray) -> None:
        names, doubted = " ".join(self._names), [""]
        while True:
            # the person who measures stands beside a robot that moves after the answer
            self._out.note(
                f"the platform stands at pose {pose}: type the measured {names} in mm [and sigma], "
                "or press Enter to skip; leave the workspace first, because the robot moves on:"
            )
            words = self._line(pose, origin_m).split()
            if not words:
                return
            numbers = self._numbers(words)
            if not numbers:
                self._out.note(
                    f"allowed: {names}, numbers in mm, with a decimal point, separated by spaces; "
                    "then the standard deviation, above 0, if not 2 mm"
                )
                continue
            off_m = float(np.linalg.norm(1e-3 * np.array(numbers[: len(origin_m)]) - origin_m))
            if off_m <= _DOUBTFUL_m or words == doubted:
                self._file.add(pose, numbers)
                return
            doubted = words
            by_cables = " ".join(f"{1e3 * x:.0f}" for x in origin_m)
            self._out.note(
                f"that is {1e3 * off_m:.0f} mm from the position given by the cable lengths, "
                f"{by_cables}; if it is right, type it again"
            )

    def _numbers(self, words: list[str]) -> list[float]:
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            return []
        k = len(self._names)
        given = k <= len(numbers) <= k + 1 and all(map(math.isfinite, numbers))
        return numbers if given and min(numbers[k:], default=1.0) > 0.0 else []

    def _line(self, pose: int, origin_m: FloatArray) -> str:
        """Return a line of standard input, an empty one at the end of the input."""
        number = sys.stdin.fileno()
        while b"\n" not in self._read:
            self._require_there(pose, origin_m)
            if select.select([number], [], [], _LOOK_S)[0]:
                more = os.read(number, _BYTES)
                if not more:
                    self._open = False
                    return ""
                self._read += more
        self._require_there(pose, origin_m)
        line, _, self._read = self._read.partition(b"\n")
        return line.decode(errors="replace")

    def _origin_m(self) -> FloatArray:
        return self._place()[: len(self._names)]

    def _require_there(self, pose: int, origin_m: FloatArray) -> None:
        if np.abs(self._origin_m() - origin_m).max() > _MOVED_m:
            raise WorkFailedError(
                f"the platform moved after pose {pose} was read, so the measured position does "
                "not belong to it"
            )
