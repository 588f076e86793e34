"""Move a platform from pose to pose for a calibration, through its handle, and read each pose."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import Field

from cdpr_profiles import Robot as Profile
from cdpr_profiles.geometry_calibration import write_text
from cdpr_profiles.reader import Profile as CheckedFile
from cdpr_profiles.reader import read_json_model
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import CalibrationData, ImageReading, PoseReading
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.states import EMERGENCY_STOP
from cdpr_rt.errors import TripError
from cdpr_rt.robot import Error, Faulted, MotionEnded, Refused, Robot, end_text
from cdpr_tools.client.handle_errors import command_error
from cdpr_tools.errors import BadInputError, ServiceRefusalError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.trials.directions import Directions, platform_of

READING_S, SETTLE_S = 0.5, 1.0
"""Averaging time of a reading, and settling time before it."""
_STILL_m = 1.5e-4
"""Change of a length within a reading beyond which the platform does not stand still."""
_MOST_READINGS = 10
_MOST_FAILURES = 5
DATA, IMAGES = "data.json", "images"
COUNTED = "counted.json"
"""Written for poses of a daemon's robot; it marks their folder."""
_COUNTS_ANEW_m = 1e-5


class CountedFrom(CheckedFile):
    """Cable lengths at which the motor angles are zero; they change when counting restarts."""

    length_m: tuple[float, ...] = Field(max_length=64)


class PoseRefusedError(Exception):
    """The robot rejects a pose; the message says why. It has not moved."""


class NotThePoseError(TripError):
    """The motion ended for a reason independent of the pose, such as an emergency stop."""


@dataclass(frozen=True)
class TargetNotReached:
    """The platform has not reached its target in time, and is held where it is."""

    place: FloatArray
    """Present position (d,), according to the controller."""
    why: str


@dataclass(frozen=True)
class Readings:
    """Readings over some time."""

    length_m: FloatArray
    """(cycles, n)"""
    tension_N: FloatArray
    measured: Mapping[str, Any] = field(default_factory=dict)
    """The externally measured pose, as the fields of a `PoseReading`."""


TakeImage = Callable[[Callable[[float], None]], Sighting | None]
"""Takes an image and returns its markers, None without a camera; the argument lets time pass."""
_SLOWED: Final = 1.5
_LATE_S: Final = 10.0
"""A motion may take `_SLOWED` times the planned duration plus `_LATE_S`."""
_SPEED_SHARE: Final = 0.5
"""Share of the speed in the robot's file: a robot that is not calibrated yet moves slowly."""
_SILENT_S: Final = 5.0
_NO_POSE_MAKES: Final = frozenset(
    limit.key
    for limit in (
        Limit.SAFETY_STOP, Limit.SAFETY_ALARM, Limit.STALE, Limit.MISSED, Limit.MISSED_IN_WINDOW,
        Limit.LATE,
    )
)  # fmt: skip
"""Limits whose violation does not depend on the pose."""


class StoppedError(Exception):
    """The user has stopped the calibration; all readings are kept."""


class _LateError(Exception):
    """A motion takes too long or is blocked."""


class PoseOperator:
    """Moves and reads the platform of a robot.

    `stop` returns whether the user wants to stop; then StoppedError ends the motion, and the
    platform is held.
    """

    def __init__(
        self,
        robot: Robot,
        profile: Profile,
        image: TakeImage = lambda _wait: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self.robot = robot
        self.directions = Directions.of(platform_of(profile))
        self.counted_m = np.zeros(len(profile.axes))
        """Cable lengths (n,) at which the motor angles are zero, as last read."""
        self._m_per_rad = np.array([axis.winch.cable_m_per_motor_rad for axis in profile.axes])
        self._image, self._stop = image, stop
        self._deadline_s = math.inf
        self._seen: Mapping[str, Any] = {}
        """The last status."""
        self._program = ""
        """The program that must keep running while the platform stands; empty before the first."""
        robot.on_status = self._look

    def _look(self, status: Mapping[str, Any]) -> None:
        if self._stop():
            raise StoppedError
        silent_s = status.get("loop", {}).get("silent_s", 0.0)
        if silent_s > _SILENT_S:
            raise WorkFailedError(f"the loop has run no cycle for {silent_s:.0f} s")
        self._seen = status
        if status["cycle"]["time_s"] > self._deadline_s:
            raise _LateError

    def tighten(self) -> FloatArray:
        """Enable the drives and take up the slack at home; return the home place, (d,)."""
        with self._trips():
            self.robot.enable()
            self.robot.tighten()
        self._program = "tighten"
        home = np.array(self.robot.description["platform"]["home_m"])
        return np.pad(home, (0, self.directions.d - self.directions.k))

    def place(self) -> FloatArray:
        """Return the platform's place, (d,); raises WorkFailedError if cables do not hold it."""
        status = self._held_status()
        progress = status["program_progress"]
        return np.array([*progress["position_m"], *progress.get("rotation_rad", ())])

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        """Move the platform to a place (d,), or hold it on its way if that takes too long.

        Raises PoseRefusedError, TripError, StoppedError, and CommandError for failures that do not
        depend on the pose, such as a daemon whose loop does not answer.
        """
        robot, directions = self.robot, self.directions
        arguments = directions.arguments(place, _SPEED_SHARE * float(directions.speed[0]))
        try:
            with self._trips():
                allowed_s = within_s(directions, self.place(), place)
                try:
                    robot.move_to(**arguments, wait=False)
                except Refused as error:
                    if isinstance(error.origin, ServiceRefusalError):
                        raise  # somebody else may move the robot
                    self._held_status()  # raises if the motion is being ended
                    raise PoseRefusedError(str(error.refusal or error)) from None
        except TripError as error:  # before the motion began
            raise NotThePoseError(str(error)) from None
        self._deadline_s = robot.time_s + allowed_s
        try:
            with self._trips():
                robot.wait_until_done()
        except _LateError:  # the robot is held
            self._program = "hold"
        else:
            self._program = "pose"
            return None
        finally:
            self._deadline_s = math.inf
        progress = self._seen["program_progress"]
        with self._trips():
            robot.wait(SETTLE_S)  # the robot brakes
        return _not_reached(directions, place, self.place(), allowed_s, progress)

    def wait(self, seconds: float) -> None:
        """Let time pass; raises TripError if the loop ends the motion meanwhile."""
        with self._trips():
            self.robot.wait(seconds)
        self._require_standing()

    def read(self, seconds: float) -> Readings:
        """Let time pass and return lengths and tensions; raises TripError as `wait`."""
        with self._trips():
            rows = self.robot.observe(seconds)
        self._require_standing()
        lengths, tensions = np.array(rows["cable_length_m"]), np.array(rows["tension_N"])
        if not np.isfinite([lengths, tensions]).all():
            raise WorkFailedError("not all lengths and tensions are known; run tighten first")
        self.counted_m = (lengths - self._m_per_rad * rows["position_rad"]).mean(axis=0)
        return Readings(lengths, tensions)

    def image(self) -> Sighting | None:
        """Return the markers that the camera sees, None without a camera."""
        return self._image(self.wait)

    def _require_standing(self) -> None:
        status = self.robot.status
        if self._program and status["program"] != self._program:
            raise self._ended(status)

    def _held_status(self) -> dict[str, Any]:
        status = self.robot.status
        self._look(status)
        progress = status.get("program_progress") or {}
        powered = status["state"] == "active" and status["reacting"] == "none"
        if powered and progress.get("tight") is not False and "position_m" in progress:
            self._require_standing()
            return status
        if self._program or status["reacting"] != "none":
            raise self._ended(status)
        raise WorkFailedError(
            f"the cables do not hold the platform ({status['state']}, {status['program']}); "
            "run `cdpr enable`, `cdpr tighten` and `cdpr move` first"
        )

    @staticmethod
    def _ended(status: Mapping[str, Any]) -> TripError:
        reaction = status["reacting"]
        how = status["state"] if reaction == "none" else f"{reaction} under way"
        limit = (status["reason_limit"] or {}).get("limit")
        return _trip(f"{end_text(status)} ({how})", limit)

    @contextmanager
    def _trips(self) -> Iterator[None]:
        """Turn the end of a motion into TripError, other errors of the handle into CommandError."""
        try:
            yield
        except Faulted as error:
            raise _trip(str(error), error.limit) from None
        except MotionEnded as error:
            if self._seen["program"] == "pose" and self._seen["state"] == "active":
                raise _LateError from None  # the way is blocked and the robot is held
            raise _trip(str(error), None) from None
        except Error as error:
            raise command_error(error) from None


def _trip(why: str, limit: str | None) -> TripError:
    """Return the error for an ended motion; NotThePoseError if the pose cannot be the cause."""
    text = f"the motion was ended: {why}"
    if limit in _NO_POSE_MAKES or EMERGENCY_STOP in why:
        return NotThePoseError(text)
    return TripError(text)


def within_s(directions: Directions, start: FloatArray, place: FloatArray) -> float:
    """Return the time limit of a motion between two places (d,), from rest to rest.

    The planned duration assumes that all directions move for the same time, as `pose` does.
    """
    way = np.abs(place - start)
    planned_s = float((way / directions.speed).max()) / _SPEED_SHARE
    square_s2 = float((way / directions.acceleration).max())
    if square_s2 > planned_s**2:  # too short to reach full speed
        planned_s = 2.0 * math.sqrt(square_s2)
    else:
        planned_s += square_s2 / max(planned_s, 1e-9)
    return _SLOWED * planned_s + _LATE_S


def _not_reached(
    directions: Directions,
    place: FloatArray,
    start: FloatArray,
    allowed_s: float,
    progress: Mapping[str, Any],
) -> TargetNotReached:
    """Return why the platform, which stands at `start`, has not reached a place (d,)."""
    k = directions.k
    apart = f"{1e3 * float(np.linalg.norm((start - place)[:k])):.0f} mm"
    if directions.turns:
        apart += f" and {math.degrees(float(np.linalg.norm((start - place)[k:]))):.1f} deg"
    kept = progress["trouble"] or progress["held_back"] or progress["missing"]
    why = f"{apart} off after {allowed_s:.0f} s: {kept or 'still moving'}"
    return TargetNotReached(start, why)


def read_pose(operator: PoseOperator, target: FloatArray) -> PoseReading:
    """Wait until the platform stands still, and return the readings at that pose.

    Raises PoseRefusedError if the platform does not come to rest within about ten readings.
    """
    operator.wait(SETTLE_S)
    for _ in range(_MOST_READINGS):
        readings = operator.read(READING_S)
        half = len(readings.length_m) // 2
        moved = np.abs(
            readings.length_m[:half].mean(axis=0) - readings.length_m[half:].mean(axis=0)
        ).max()
        if moved < _STILL_m:
            seen = operator.image()
            return PoseReading(
                target=tuple(np.asarray(target).tolist()),
                length_m=tuple(readings.length_m.mean(axis=0).tolist()),
                tension_N=tuple(readings.tension_N.mean(axis=0).tolist()),
                image=None if seen is None else ImageReading.of(seen),
                **readings.measured,
            )
    raise PoseRefusedError(
        f"the platform did not come to rest: a cable still moves by {1e3 * moved:.2f} mm"
    )


@dataclass
class StoredPoses:
    """Readings of a calibration in the files of its folder; they are complete after each pose."""

    folder: Path
    data: CalibrationData
    name: str = DATA
    """Name of the file of the data."""
    added: Callable[[int], None] = lambda _count: None
    """Called after each reading with the number of readings."""
    failures: int = 0
    """Number of successive positions that were not reached, or at which the platform did not come
    to rest."""

    def add(self, reading: PoseReading, operator: PoseOperator) -> None:
        """Append a reading of this operator and store it; raises ProfileError."""
        counted = self.folder / COUNTED
        now = CountedFrom(length_m=tuple(operator.counted_m.tolist())).model_dump_json() + "\n"
        restarted = False
        if self.data.poses:
            before = read_json_model(counted, CountedFrom).length_m
            restarted = bool(np.abs(np.array(before) - operator.counted_m).max() > _COUNTS_ANEW_m)
        else:
            write_text(counted, now)
        self.append(reading, restarted)
        # written last: if this process is killed before, the older lengths still show the next
        # reading that counting has restarted
        write_text(counted, now)
        self.added(len(self.data.poses))

    def append(self, reading: PoseReading, restarted: bool) -> None:
        """Store a reading; `restarted`: lengths count from another zero than before."""
        poses, restarts = self.data.poses, self.data.restarts
        self.change(poses=(*poses, reading), restarts=(*restarts, *[len(poses)] * restarted))
        self.save()

    def change(self, **update: object) -> None:
        """Replace values of the data."""
        self.data = self.data.model_copy(update=update)

    @contextmanager
    def images(self, out: Output, url: str, clock: Clock) -> Iterator[TakeImage]:
        """Yield a function that takes the image of the next pose with the camera of a URL.

        Raises CameraError.
        """
        from cdpr_tools.calibrate.pose_camera import (  # noqa: PLC0415  # needs an extra
            PoseCamera,
        )

        setup, folder = self.data.camera, self.folder / IMAGES
        assert setup is not None  # only used if there is a camera
        opened = PoseCamera(url, clock, setup.intrinsics, setup.sheets, folder, out.note)
        with closing(opened):
            yield lambda wait: opened.see(len(self.data.poses) + 1, wait)

    def save(self) -> None:
        """Write the data; raises ProfileError."""
        self.data.save(self.folder / self.name)

    def done(self) -> set[tuple[float, ...]]:
        """Return the targets (d,) that were read, or tried without success."""
        return {reading.target for reading in self.data.poses} | set(self.data.tried)

    def try_no_more(self, place: FloatArray, why: str = "") -> None:
        """Do not go to a position (d,) again; `why` it was not read, if it was not."""
        self.change(tried=(*self.data.tried, tuple(place.tolist())))
        if why:
            self.change(left_out=(*self.data.left_out, f"{_listed(place)}: {why}"))

    def interrupted(self, place: FloatArray, error: TripError) -> None:
        """Leave out a position (d,) at which the motion ended, if the position may be the cause."""
        if not isinstance(error, NotThePoseError):
            # the same may happen there again
            self.try_no_more(place, str(error))

    def require_home(self, robot: Profile, place: FloatArray) -> None:
        """Raise BadInputError if the first pose, (d,), is not home, where lengths are measured."""
        platform = platform_of(robot)
        k = len(platform.home_m)
        off_m = float(np.abs(place[:k] - np.array(platform.home_m)).max())
        if not self.data.poses and off_m > platform.home_tolerance_m:
            raise BadInputError(
                f"the platform is {1e3 * off_m:.0f} mm from home, where the first pose must be; "
                "run `cdpr lower` and `cdpr tighten`"
            )


def measure_poses(
    operator: PoseOperator,
    places: Iterable[FloatArray],
    between: FloatArray,
    kept: StoredPoses,
    out: Output,
) -> None:
    """Move to positions (d,) and read each; go through `between` if the straight line is rejected.

    If a position is not reached, the reading is taken where the platform stands, also on the way
    through `between`. Raises TripError if the motion is ended, or if the platform does not reach
    five successive positions or does not come to rest there.
    """
    for place in places:
        what = f"pose {len(kept.data.poses) + 1}, at {_listed(place)}"
        try:
            held = _go(operator, place, between)
        except PoseRefusedError as error:
            kept.try_no_more(place, str(error))
            out.note(f"{what}, is left out: {error}")
            continue
        except TripError as error:
            kept.interrupted(place, error)
            raise
        failure = _read(operator, place, held, kept)
        kept.failures = kept.failures + 1 if failure else 0
        if failure:
            out.note(f"{what}, {failure}")
        if kept.failures >= _MOST_FAILURES:
            raise TripError(f"{kept.failures} poses in a row failed, the last {what}, {failure}")


def _go(operator: PoseOperator, place: FloatArray, between: FloatArray) -> TargetNotReached | None:
    try:
        return operator.move_to(place)
    except PoseRefusedError:
        held = operator.move_to(between)
        if held is None:
            return operator.move_to(place)
        return replace(held, why=f"on its way through {_listed(between)} {held.why}")


def _read(
    operator: PoseOperator, place: FloatArray, held: TargetNotReached | None, kept: StoredPoses
) -> str:
    """Read the pose at which the platform stands; return the problem, or ""."""
    try:
        reading = read_pose(operator, place if held is None else held.place)
    except PoseRefusedError as error:
        why = str(error) if held is None else f"{held.why}; {error}"
        kept.try_no_more(place, why)
        return f"is left out: {why}"
    except TripError as error:
        kept.interrupted(place, error)
        raise
    if held is not None:
        kept.try_no_more(place)
    kept.add(reading, operator)
    return "" if held is None else f"is read where the platform stands: {held.why}"


def _listed(place: FloatArray) -> str:
    return ", ".join(f"{x:.3f}" for x in place)
