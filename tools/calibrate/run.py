"""Measure the poses of a calibration on a simulated robot; a stored run can be resumed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, Literal, TypeVar, get_args

import numpy as np
from pydantic import Field, field_validator
from typing_extensions import override

from cdpr_drivers.errors import DriverError
from cdpr_profiles import Robot
from cdpr_profiles.errors import FileMissingError, ProfileError, brief
from cdpr_profiles.geometry_calibration import geometry_sha256, write_text
from cdpr_profiles.reader import Profile, read_json_model
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.marker_map import listed
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.readings import (
    CalibrationData,
    CameraSetup,
    MeasuredPoint,
    Numbers,
    PoseReading,
    load_data,
    load_points,
)
from cdpr_rt.calibration.verification import every_fifth
from cdpr_rt.core.clock import Clock
from cdpr_rt.errors import ControlError
from cdpr_tools.calibrate.measure_poses import (
    Measured,
    PoseOperator,
    PoseRefusedError,
    StoppedError,
    measure_poses,
    read_pose,
)
from cdpr_tools.calibrate.places import (
    MOST_POSES,
    Listed,
    Places,
    listed_places,
    places_of,
)
from cdpr_tools.calibrate.rig import OutsidePose, OutsidePoses, RigOperator, simulated_rig
from cdpr_tools.calibrate.truth_comparison import TruthComparison, compare_with_truth
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

if TYPE_CHECKING:
    from cdpr_tools.calibrate.pose_camera import PoseCamera


DATA, SETTINGS, OUTSIDE, IMAGES = "data.json", "run.json", "outside.json", "images"
POINTS = "points.csv"
"""Positions measured at the poses of `cdpr calibrate measure --ask`, or by hand."""
COUNTED = "counted.json"
"""Written by `cdpr calibrate read`; it marks the folder of poses that this command has read."""
_FIRST_S, _HELD_OUT_S = 8.0, 3.0

PoseSource = Literal["camera", "scanner", "redundancy", "points"]


class CalibrationRunSettings(Profile):
    """Settings of a run; a resumed run uses the same."""

    robot: str
    plant: str | None
    source: PoseSource
    poses: int | None = Field(ge=1)
    """Number of poses; None: until more poses improve the result only a little."""
    seed: int = Field(ge=0)
    places: tuple[Numbers, ...] | None = None
    """Listed places (m, d); the run reads only these and home."""
    points: str | None = None
    """File of measured positions, which a resumed run reads again."""

    @field_validator("places")
    @classmethod
    def _alike(cls, places: tuple[Numbers, ...] | None) -> tuple[Numbers, ...] | None:
        if places is not None and len(set(map(len, places))) > 1:
            raise ValueError("the same number of values in each")
        return places

    def save(self, folder: Path) -> None:
        """Write the settings into the folder of the run; raises ProfileError."""
        write_text(folder / SETTINGS, self.model_dump_json(indent=1) + "\n")

    def resumed(
        self, poses: int | None, places: Listed | None, points: Path | None
    ) -> CalibrationRunSettings:
        """Return the settings with another number or list of poses and other points, if given.

        Raises BadInputError for a list if the run began without one, and vice versa.
        """
        update: dict[str, object] = {}
        if points is not None:
            update["points"] = str(points.resolve())
        if poses is not None:
            if (places is None) != (self.places is None):
                kind = "a list of poses" if self.places is not None else "no list of poses"
                raise BadInputError(
                    f"--poses: the run to be continued began with {kind}; give the same again"
                )
            update |= {"poses": poses, "places": places}
        return self.model_copy(update=update)

    @classmethod
    def load(cls, folder: Path) -> CalibrationRunSettings:
        """Read the settings; raises ProfileError."""
        return read_json_model(folder / SETTINGS, cls)


StopCriterion = Callable[[CalibrationData], str | None]
"""Called after each batch; returns why the poses suffice, None if more are needed."""


def no_poses(robot: Robot, simulated: bool, camera: CameraSetup | None = None) -> CalibrationData:
    """Return data without poses, for a robot that has not been measured yet."""
    return CalibrationData(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=simulated,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        camera=camera,
        poses=(),
    )


_Operator = TypeVar("_Operator", bound=PoseOperator)


@dataclass
class StoredPoses(ABC, Generic[_Operator]):
    """Readings of a calibration in the files of its folder; they are complete after each pose."""

    folder: Path
    data: CalibrationData
    name: str = DATA
    """Name of the file of the data."""

    @abstractmethod
    def add(self, reading: PoseReading, operator: _Operator) -> None:
        """Append a reading of this operator and store it; raises ProfileError."""

    def save(self) -> None:
        """Write the data; raises ProfileError."""
        self.data.save(self.folder / self.name)

    def done(self) -> set[tuple[float, ...]]:
        """Return the targets (d,) that were read, or tried without success."""
        return {reading.target for reading in self.data.poses} | set(self.data.tried)

    def require_home(self, robot: Robot, place: FloatArray) -> None:
        """Raise BadInputError if the first pose, (d,), is not home, where lengths are measured."""
        platform = robot.platform
        assert platform is not None  # callers have checked it
        k = len(platform.home_m)
        off_m = float(np.abs(place[:k] - np.array(platform.home_m)).max())
        if not self.data.poses and off_m > platform.home_tolerance_m:
            raise BadInputError(
                f"the platform is {1e3 * off_m:.0f} mm from home, where the first pose must be; "
                "run `cdpr lower` and `cdpr tighten`"
            )


@dataclass
class StoredRun(StoredPoses[RigOperator]):
    """Readings of a run on a simulated robot, with its true and scanned poses."""

    outside: list[OutsidePose] = field(default_factory=list)
    restarted: bool = False
    """Whether lengths count from a new zero since the last reading."""

    @classmethod
    def new(cls, folder: Path, robot: Robot, camera: CameraSetup | None) -> StoredRun:
        """Return an empty run and write it; remove the poses of an earlier run.

        Raises ProfileError, and BadInputError for poses of a real robot or files that no run wrote.
        """
        before = refuse_foreign(folder)
        if before is not None and not before.simulated:
            raise BadInputError(
                f"{folder / DATA}: contains readings of a real robot; choose another --out, or "
                "remove it"
            )
        try:
            # remove the settings first: if they exist, --resume expects data to continue with
            for name in (SETTINGS, DATA, OUTSIDE, COUNTED):
                (folder / name).unlink(missing_ok=True)
            for image in (folder / IMAGES).glob("pose-[0-9][0-9][0-9][0-9].png"):
                image.unlink()
            with suppress(OSError):  # the folder does not exist, or has files of somebody else
                (folder / IMAGES).rmdir()
        except OSError as error:
            raise ProfileError(folder, "", f"cannot be emptied: {error.strerror}") from error
        data = no_poses(robot, True, camera)
        data.save(folder / DATA)
        return cls(folder, data)

    @classmethod
    def resumed(cls, folder: Path, robot: Robot) -> StoredRun:
        """Return the stored part of a run that ended early; raises ProfileError, BadInputError."""
        data = load_data(folder / DATA)
        if data.geometry_sha256 != geometry_sha256(robot):
            raise BadInputError(
                f"{folder / DATA}: was read with another version of {robot.profile!r}; give "
                "--overwrite to replace it"
            )
        try:
            outside = list(OutsidePoses.load_file(folder / OUTSIDE).poses)[: len(data.poses)]
        except FileMissingError:  # ended before the first pose
            outside = []
        # if the run was killed between the two files, drop a pose that is in only one of them
        data = data.model_copy(update={"poses": data.poses[: len(outside)]})
        return cls(folder, data, outside=outside, restarted=bool(outside))

    def remaining(self, places: Listed | None) -> Listed | None:
        """Return the listed places (m, d) that were not tried yet; None without a list."""
        return None if places is None else tuple(one for one in places if one not in self.done())

    @override
    def add(self, reading: PoseReading, operator: RigOperator) -> None:
        poses, restarts = self.data.poses, self.data.restarts
        outside = operator.outside()
        try:
            if longer_s := _scanned_s(len(poses)):
                operator.wait(longer_s)
                # a cable may slip or creep meanwhile: use the truth from when lengths were read
                outside = operator.outside().with_truth_of(outside)
        finally:  # the pose has been read, even if the wait fails
            self.outside.append(outside)
            OutsidePoses(poses=tuple(self.outside)).save(self.folder / OUTSIDE)
            if self.restarted:
                restarts += (len(poses),)
                self.restarted = False
            update = {"poses": (*poses, reading), "restarts": restarts}
            self.data = self.data.model_copy(update=update)
            self.save()


def measure(
    out: Output,
    robot: Robot,
    settings: CalibrationRunSettings,
    kept: StoredRun,
    criterion: StopCriterion,
) -> CalibrationData:
    """Measure the missing poses on a separate simulator; return all data.

    All readings are kept, even after an error, and the error says how to continue. Raises the
    errors of the robot and its camera, and WorkFailedError if the user stops the run.
    """
    most, listed = settings.poses or MOST_POSES, kept.remaining(settings.places)
    if listed is not None:  # home is read at each start
        most = len(kept.data.poses) + len(listed) + bool(listed)
    if len(kept.data.poses) >= most:
        return kept.data
    if listed is not None:
        places = listed_places(robot, np.array(listed))
    else:
        with out.stage("choosing poses"):
            places = places_of(robot, settings.poses, None, settings.seed)
    plant = None if settings.plant is None else Path(settings.plant)

    def camera(url: str, clock: Clock) -> PoseCamera:
        from cdpr_tools.calibrate.pose_camera import (  # noqa: PLC0415  # needs an extra
            PoseCamera,
        )

        setup = kept.data.camera
        assert setup is not None  # only used in a run with a camera
        images = kept.folder / IMAGES
        return PoseCamera(url, clock, setup.intrinsics, setup.sheets, images, out.note)

    how = f"continue with: cdpr calibrate run {robot.reference} --resume --out {kept.folder}"
    with (
        saying_how_to_continue(kept, how),
        stop_on_signals("the robot is brought to rest and switched off") as stop,
        ExitStack() as stack,
    ):
        with out.stage(f"{robot.profile}: starting the simulated robot"):
            operator = stack.enter_context(
                simulated_rig(
                    str(robot.path),
                    plant=plant,
                    scanner=settings.source == "scanner",
                    camera=camera if settings.source == "camera" else None,
                    stop=stop,
                )
            )
            home = operator.tighten()
        count = len(kept.data.poses)
        if count:
            out.note(f"continuing after {count} poses; reading home again first")
        operator.number = count + 1
        read_places(
            *(out, robot, operator, kept, places, most),
            criterion if settings.poses is None else report_faults_only(criterion),
            home=home,
        )
    return kept.data


def refuse_foreign(folder: Path) -> CalibrationData | None:
    """Return the data in a folder, or None.

    Raises BadInputError if files in the folder have the names of a run but no run wrote them.
    """
    names = [
        name for name in (DATA, SETTINGS, OUTSIDE, COUNTED, IMAGES) if (folder / name).exists()
    ]
    if not names:
        return None
    try:
        if names[0] == DATA:
            return load_data(folder / DATA)
        if names[0] == SETTINGS:
            CalibrationRunSettings.load(folder)
            return None
        why = "it was not written by a calibration"
    except ProfileError as error:
        why = brief(error.problem)
    raise BadInputError(f"{folder / names[0]}: {why}; choose another --out, or move the file away")


def report_faults_only(criterion: StopCriterion) -> StopCriterion:
    """Return a criterion that reports faults but never ends the run.

    The user has given the number of poses.
    """

    def asked(data: CalibrationData) -> str | None:
        criterion(data)
        return None

    return asked


def truth_comparison_of(
    robot: Robot, settings: CalibrationRunSettings, folder: Path
) -> Callable[[Outcome], TruthComparison]:
    """Return a function that compares the outcome of a run with the truth of its simulator."""

    def compare(outcome: Outcome) -> TruthComparison:
        plant = None if settings.plant is None else Path(settings.plant)
        return compare_with_truth(robot, plant, outcome, OutsidePoses.load_file(folder / OUTSIDE))

    return compare


def truth_comparison_of_folder(
    robot: Robot, folder: Path
) -> Callable[[Outcome], TruthComparison] | None:
    """Return such a function for the run in a folder; None if the folder has only readings."""
    if not (folder / SETTINGS).exists() or not (folder / OUTSIDE).exists():
        return None
    return truth_comparison_of(robot, CalibrationRunSettings.load(folder), folder)


@contextmanager
def saying_how_to_continue(kept: StoredPoses[Any], how: str) -> Iterator[None]:
    """Add to any error of the block what is saved, and `how` to continue.

    StoppedError becomes WorkFailedError.
    """

    def saved() -> str:
        if not (count := len(kept.data.poses)):
            return "nothing was read yet"
        are = "1 pose is" if count == 1 else f"{count} poses are"
        return f"{are} saved in {kept.folder}; {how}"

    try:
        yield
    except StoppedError:
        raise WorkFailedError(f"stopped; {saved()}") from None
    except (CommandError, ControlError, DriverError) as error:
        error.add_note(saved())
        raise


Ask = Callable[[int], None]
"""Asks a person for the measured position at a pose, counted from 1."""


def read_places(
    out: Output,
    robot: Robot,
    operator: _Operator,
    kept: StoredPoses[_Operator],
    places: Places,
    most: int,
    criterion: StopCriterion = lambda _data: None,
    ask: Ask = lambda _pose: None,
    home: FloatArray | None = None,
) -> None:
    """Read home, then batches of places until there are `most` poses, or `criterion` is met.

    Home is read if there are no poses yet, or if it is given: the place (d,) where the platform
    stands after a restart. All readings are kept, even after an error. Raises CommandError,
    ControlError, DriverError, and StoppedError if the user stops the run.
    """
    with out.progress(f"reading up to {most} poses", float(most)) as advance:

        def note_tried() -> None:
            update = {"left_out": tuple(measured.refused), "tried": tuple(measured.tried)}
            kept.data = kept.data.model_copy(update=update)

        def keep() -> None:
            note_tried()
            kept.add(measured.readings[-1], operator)
            advance(float(len(kept.data.poses)))
            ask(len(kept.data.poses))

        before, done = kept.data, kept.done()
        measured = Measured(keep, list(before.poses), list(before.left_out), list(before.tried))
        try:
            if home is not None or not before.poses:
                _read_home(out, robot, operator, kept, measured, home)
            for batch in places.batches():
                left = np.array([place for place in batch if tuple(place.tolist()) not in done])
                left = left[: most - len(measured.readings)]
                measure_poses(operator, left, places.middle, measured, out)
                if len(measured.readings) >= most:
                    return
                if len(left) and (why := criterion(kept.data)) is not None:
                    out.note(why)
                    return
            out.note(f"only {len(measured.readings)} poses: the robot refused all others")
        finally:
            if kept.data.poses:
                note_tried()
                kept.save()


def _read_home(
    out: Output,
    robot: Robot,
    operator: _Operator,
    kept: StoredPoses[_Operator],
    measured: Measured,
    home: FloatArray | None,
) -> None:
    """Read home; report camera problems before the robot moves far. Raises WorkFailedError."""
    if home is None:
        home = operator.place()
        kept.require_home(robot, home)
    try:
        measured.add(read_pose(operator, home))
    except PoseRefusedError as error:
        raise WorkFailedError(f"{robot.profile}: at home: {error}") from error
    seen, setup = kept.data.poses[-1].image, kept.data.camera
    if seen is None or setup is None or seen.problem is not None:
        return  # the image's problem is already reported; the next one may be better
    if not seen.markers:
        why = "was another dictionary printed, or are the sheets out of view?"
        if seen.mirrored:
            why = f"{listed(seen.mirrored)} are mirror images: are all sheets printed mirrored?"
        raise WorkFailedError(
            f"at home the camera sees no marker of {setup.sheets.dictionary}: {why}"
        )
    out.note(f"at home the camera sees {len(seen.markers)} markers")


def _scanned_s(pose: int) -> float:
    """Return the extra time for which the scanner measures a pose (from 0) for verification.

    The first pose takes longest, because all errors are relative to it and contain its error.
    """
    if pose == 0:
        return _FIRST_S
    return _HELD_OUT_S if every_fifth(pose + 1)[pose] else 0.0


# Check the options of a run before anything moves.

_METRES: Final = 300.0
"""If all points are nearer to the origin than targets by this factor, the user typed metres."""


def points_of(path: Path, robot: Robot) -> list[MeasuredPoint]:
    """Return the points of a file; raises ProfileError, or BadInputError for values in metres."""
    points, platform = load_points(path), robot.platform
    assert platform is not None  # callers have checked it
    box_m = np.abs([platform.workspace_min_m, platform.workspace_max_m])
    furthest_m = float(np.linalg.norm(box_m.max(axis=0)))
    at_m = float(np.abs([np.nan_to_num(point.position_m) for point in points]).max(initial=0.0))
    if 0.0 < at_m < furthest_m / _METRES:
        raise BadInputError(
            f"--points {path}: all within {1e3 * at_m:.3g} mm of the room's origin, but "
            f"targets are up to {1e3 * furthest_m:.0f} mm from it; are they in metres? "
            "Write mm"
        )
    return points


def check_points(path: Path, robot: Robot, poses: int | None) -> None:
    """Raise BadInputError for points of poses beyond the last one, and errors of `points_of`."""
    for point in points_of(path, robot):
        if poses is not None and point.pose >= poses:
            raise BadInputError(
                f"--points {path}: pose {point.pose + 1}; allowed: 1 to {poses} (--poses)"
            )


def source_of(robot: Robot, **given: bool) -> PoseSource:
    """Return what a run uses in addition to lengths and tensions, from the options given.

    Raises BadInputError.
    """
    asked = [source for source in get_args(PoseSource) if given.get(source)]
    if not asked and robot.platform is not None and len(robot.platform.controlled) == 6:
        return "camera"
    if asked == ["camera", "points"]:
        asked = ["camera"]  # points are used in addition
    if len(asked) != 1:
        raise BadInputError(
            "give one of --camera, --redundancy, --scanner and --points, or --camera with --points"
        )
    if asked[0] == "camera" and robot.platform is not None and len(robot.platform.controlled) < 6:
        raise BadInputError(
            f"--camera: {robot.profile} does not turn its platform about two axes, which is "
            "needed to find where the camera sits; allowed: --scanner, --points, "
            "--redundancy"
        )
    chosen: PoseSource = asked[0]
    return chosen
