"""Measure the poses of a calibration on a simulated robot; a stored run can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Literal, get_args

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
from cdpr_rt.errors import ControlError
from cdpr_tools.calibrate.measure_poses import (
    COUNTED,
    DATA,
    IMAGES,
    PoseOperator,
    PoseRefusedError,
    StoppedError,
    StoredPoses,
    measure_poses,
    read_pose,
)
from cdpr_tools.calibrate.places import MOST_POSES, Listed, Places, listed_places, places_of
from cdpr_tools.calibrate.rig import OutsidePose, OutsidePoses, RigOperator, simulated_rig
from cdpr_tools.calibrate.truth_comparison import TruthComparison, compare_with_truth
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

SETTINGS, OUTSIDE = "run.json", "outside.json"
POINTS = "points.csv"
"""Positions measured at the poses of `cdpr calibrate measure --ask`, or by hand."""
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
                kind = "a list" if self.places is not None else "a number"
                raise BadInputError(
                    f"--poses: the run to resume began with {kind} of poses; give {kind} again"
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


@dataclass
class StoredRun(StoredPoses):
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
    def add(self, reading: PoseReading, operator: PoseOperator) -> None:
        assert isinstance(operator, RigOperator)
        outside = operator.outside()
        try:
            if longer_s := _scanned_s(len(self.data.poses)):
                operator.wait(longer_s)
                # a cable may slip or creep meanwhile: use the truth from when lengths were read
                outside = operator.outside().with_truth_of(outside)
        finally:  # the pose has been read, even if the wait fails
            self.outside.append(outside)
            OutsidePoses(poses=tuple(self.outside)).save(self.folder / OUTSIDE)
            self.append(reading, self.restarted)
            self.restarted = False
        self.added(len(self.data.poses))


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
                    images=partial(kept.images, out) if settings.source == "camera" else None,
                    stop=stop,
                )
            )
            home = operator.tighten()
        count = len(kept.data.poses)
        if count:
            out.note(f"continuing after {count} poses; reading home again first")
        read_places(
            *(out, robot, operator, kept, places, most, criterion),
            home=home,
            may_end=settings.poses is None,
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


def compared_with_truth(outcome: Outcome, folder: Path) -> TruthComparison | None:
    """Return the comparison of a run's outcome with its simulator; None without such a run."""
    if not (folder / SETTINGS).exists() or not (folder / OUTSIDE).exists():
        return None
    plant = CalibrationRunSettings.load(folder).plant
    outside = OutsidePoses.load_file(folder / OUTSIDE)
    file = None if plant is None else Path(plant)
    return compare_with_truth(outcome.robot, file, outcome, outside)


@contextmanager
def saying_how_to_continue(kept: StoredPoses, how: str) -> Iterator[None]:
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
    operator: PoseOperator,
    kept: StoredPoses,
    places: Places,
    most: int,
    criterion: StopCriterion = lambda _data: None,
    ask: Ask = lambda _pose: None,
    home: FloatArray | None = None,
    *,
    may_end: bool = True,
) -> None:
    """Read home, then batches of places until there are `most` poses, or `criterion` is met.

    If `may_end` is false, the criterion only reports faults, because the user has given the number
    of poses.

    Home is read if there are no poses yet, or if it is given: the place (d,) where the platform
    stands after a restart. All readings are kept, even after an error. Raises CommandError,
    ControlError, DriverError, and StoppedError if the user stops the run.
    """
    with out.progress(f"reading up to {most} poses", float(most)) as advance:

        def added(count: int) -> None:
            advance(float(count))
            ask(count)

        kept.added, done = added, kept.done()
        try:
            if home is not None or not kept.data.poses:
                _read_home(out, robot, operator, kept, home)
            for batch in places.batches():
                left = np.array([place for place in batch if tuple(place.tolist()) not in done])
                left = left[: most - len(kept.data.poses)]
                measure_poses(operator, left, places.middle, kept, out)
                if len(kept.data.poses) >= most:
                    return
                if len(left) and (why := criterion(kept.data)) is not None and may_end:
                    out.note(why)
                    return
            out.note(f"only {len(kept.data.poses)} poses: the robot refused all others")
        finally:
            if kept.data.poses:
                kept.save()


def _read_home(
    out: Output, robot: Robot, operator: PoseOperator, kept: StoredPoses, home: FloatArray | None
) -> None:
    """Read home; report camera problems before the robot moves far. Raises WorkFailedError."""
    if home is None:
        home = operator.place()
        kept.require_home(robot, home)
    try:
        kept.add(read_pose(operator, home), operator)
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
