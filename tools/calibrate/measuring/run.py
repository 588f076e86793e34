"""Measures the poses of a calibration on a simulated robot; what is stored can be resumed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field, field_validator

from cdpr_drivers.errors import DriverError
from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import geometry_sha256, write_text
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.reader import Profile, read_json_model
from cdpr_rt.calibration.markers.coverage import coverage, listed
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.readings.camera_data import CameraSetup
from cdpr_rt.calibration.readings.data import CalibrationData, Numbers, load_data
from cdpr_rt.calibration.verification.held_out import held_out
from cdpr_rt.core.clock import Clock
from cdpr_rt.errors import ControlError
from cdpr_rt.procedures.calibration.measure_poses import (
    Measured,
    PoseRefusedError,
    measure_poses,
    read_pose,
)
from cdpr_tools.calibrate.measuring.outside import OutsidePose, OutsidePoses
from cdpr_tools.calibrate.measuring.places import (
    MOST_POSES,
    Listed,
    Places,
    listed_places,
    places_of,
)
from cdpr_tools.calibrate.measuring.rig import RigOperator, simulated_rig
from cdpr_tools.calibrate.measuring.ways import StoppedError
from cdpr_tools.calibrate.report.truth_comparison import TruthComparison, compare_with_truth
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Advance, Output
from cdpr_tools.signals import stop_on_signals

if TYPE_CHECKING:
    from cdpr_tools.calibrate.measuring.pose_camera import PoseCamera

DATA, SETTINGS, OUTSIDE, IMAGES = "data.json", "run.json", "outside.json", "images"
POINTS = "points.csv"
"""Positions measured at the poses of `cdpr calibrate measure --ask`, or by hand."""
COUNTED = "counted.json"
"""Of poses that `cdpr calibrate read` has read: it marks a folder of these."""
_FIRST_S, _HELD_OUT_S = 8.0, 3.0

PoseSource = Literal["camera", "scanner", "redundancy", "points"]


class CalibrationRunSettings(Profile):
    """What a run was asked for; one that goes on does the same."""

    robot: str
    plant: str | None
    source: PoseSource
    poses: int | None = Field(ge=1)
    """None: as many as bring something."""
    seed: int = Field(ge=0)
    places: tuple[Numbers, ...] | None = None
    """(m, d), where a list has named them: these and home are all."""
    points: str | None = None
    """File of measured positions, which a run that goes on reads again."""

    @field_validator("places")
    @classmethod
    def _alike(cls, places: tuple[Numbers, ...] | None) -> tuple[Numbers, ...] | None:
        if places is not None and len(set(map(len, places))) > 1:
            raise ValueError("as many numbers in each")
        return places

    def save(self, folder: Path) -> None:
        """Write them into the folder of the run; raises ProfileError."""
        write_text(folder / SETTINGS, self.model_dump_json(indent=1) + "\n")

    def resumed(
        self, poses: int | None, places: Listed | None, points: Path | None
    ) -> CalibrationRunSettings:
        """Return them with as many poses, or a list, and points, where these are given.

        Raises BadInputError for a list where there was none, and the other way round.
        """
        update: dict[str, object] = {}
        if points is not None:
            update["points"] = str(points.resolve())
        if poses is not None:
            if (places is None) != (self.places is None):
                kind = "a list of poses" if self.places is not None else "no list of poses"
                raise BadInputError(
                    f"--poses: allowed: as the run that goes on was begun, with {kind}"
                )
            update |= {"poses": poses, "places": places}
        return self.model_copy(update=update)

    @classmethod
    def load(cls, folder: Path) -> CalibrationRunSettings:
        """Read them; raises ProfileError."""
        return read_json_model(folder / SETTINGS, cls)


StopCriterion = Callable[[CalibrationData], str | None]
"""Is asked after each batch; says why no more poses are needed, None where some are."""


@dataclass
class StoredRun:
    """What a run has read, in the files of its folder; on pose after pose these are complete."""

    folder: Path
    data: CalibrationData
    outside: list[OutsidePose] = field(default_factory=list)

    @classmethod
    def new(cls, folder: Path, robot: Robot, camera: CameraSetup | None) -> StoredRun:
        """Return what has read nothing yet; what the folder held of earlier poses is removed.

        Raises ProfileError, and BadInputError where that was read of a real robot.
        """
        if _is_of_real_robot(folder / DATA):
            raise BadInputError(
                f"{folder / DATA}: was read of a real robot; allowed: another --out, or remove it"
            )
        try:
            for name in (DATA, OUTSIDE, COUNTED):
                (folder / name).unlink(missing_ok=True)
            if (folder / IMAGES).exists():
                shutil.rmtree(folder / IMAGES)
        except OSError as error:
            raise ProfileError(folder, "", f"cannot be emptied: {error.strerror}") from error
        data = CalibrationData(
            robot=robot.profile,
            geometry_sha256=geometry_sha256(robot),
            simulated=True,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            camera=camera,
            poses=(),
        )
        return cls(folder, data)

    @classmethod
    def resumed(cls, folder: Path, robot: Robot) -> StoredRun:
        """Return what a run has left that ended early; raises ProfileError, BadInputError."""
        data = load_data(folder / DATA)
        if data.geometry_sha256 != geometry_sha256(robot):
            raise BadInputError(
                f"{folder / DATA}: of another state of {robot.profile!r}; allowed: --overwrite"
            )
        outside = list(OutsidePoses.load_file(folder / OUTSIDE).poses)[: len(data.poses)]
        # killed between the two files: what was read without the other is not known to belong
        return cls(folder, data.model_copy(update={"poses": data.poses[: len(outside)]}), outside)

    def done(self) -> set[tuple[float, ...]]:
        """Return the targets (d,) that were read, or tried in vain."""
        return {reading.target for reading in self.data.poses} | set(self.data.tried)

    def remaining(self, places: Listed | None) -> Listed | None:
        """Return those of listed places (m, d) to which nothing has gone yet; None of no list."""
        return None if places is None else tuple(one for one in places if one not in self.done())

    def keep(self, measured: Measured, restarts: tuple[int, ...], outside: OutsidePose) -> None:
        """Write what there is now, with another pose; raises ProfileError."""
        self.outside.append(outside)
        OutsidePoses(poses=tuple(self.outside)).save(self.folder / OUTSIDE)
        self.data = self.data.model_copy(
            update={"poses": tuple(measured.readings), "restarts": restarts}
        )
        self.save(measured)

    def save(self, measured: Measured) -> None:
        """Write what there is now, where no pose has been read since; raises ProfileError."""
        self.data = self.data.model_copy(
            update={"left_out": tuple(measured.refused), "tried": tuple(measured.tried)}
        )
        self.data.save(self.folder / DATA)


def measure(
    out: Output,
    robot: Robot,
    settings: CalibrationRunSettings,
    kept: StoredRun,
    criterion: StopCriterion,
) -> CalibrationData:
    """Measure what is missing, on a simulator of its own; return all.

    What is read is kept whatever ends it, and the error says how to go on. Raises what the robot
    and its camera do, WorkFailedError where somebody stops it.
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
        from cdpr_tools.calibrate.measuring.pose_camera import (  # noqa: PLC0415  # needs an extra
            PoseCamera,
        )

        setup = kept.data.camera
        assert setup is not None  # of a run with a camera
        images = kept.folder / IMAGES
        return PoseCamera(url, clock, setup.intrinsics, setup.sheets, images, out.note)

    try:
        with (
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
            up_to = "" if settings.poses else "up to "
            advance = stack.enter_context(out.progress(f"reading {up_to}{most} poses", float(most)))
            _Measuring(out, operator, kept, most, advance).go(
                robot,
                places,
                criterion if settings.poses is None else report_faults_only(criterion),
            )
    except StoppedError:
        raise WorkFailedError(f"stopped; {_going_on(robot, kept)}") from None
    except (CommandError, ControlError, DriverError) as error:
        error.add_note(_going_on(robot, kept))
        raise
    return kept.data


def _is_of_real_robot(path: Path) -> bool:
    try:
        return path.exists() and not load_data(path).simulated
    except ProfileError:
        return False  # nothing that can be used


def report_faults_only(criterion: StopCriterion) -> StopCriterion:
    """Return what tells what is wrong and never has enough: somebody has said how many."""

    def asked(data: CalibrationData) -> str | None:
        criterion(data)
        return None

    return asked


def truth_comparison_of(
    robot: Robot, settings: CalibrationRunSettings, folder: Path
) -> Callable[[Outcome], TruthComparison]:
    """Return what compares the outcome of a run with what its simulator knows."""

    def compare(outcome: Outcome) -> TruthComparison:
        plant = None if settings.plant is None else Path(settings.plant)
        return compare_with_truth(robot, plant, outcome, OutsidePoses.load_file(folder / OUTSIDE))

    return compare


def truth_comparison_of_folder(
    robot: Robot, folder: Path
) -> Callable[[Outcome], TruthComparison] | None:
    """Return what compares an outcome of a run's folder; None of one that holds readings alone."""
    if not (folder / SETTINGS).exists() or not (folder / OUTSIDE).exists():
        return None
    return truth_comparison_of(robot, CalibrationRunSettings.load(folder), folder)


def _going_on(robot: Robot, kept: StoredRun) -> str:
    if not kept.data.poses:
        return "nothing was read yet"
    return (
        f"{len(kept.data.poses)} poses are kept in {kept.folder}; go on with: cdpr calibrate run "
        f"{robot.reference} --resume --out {kept.folder}"
    )


def _scanned_s(pose: int) -> float:
    """Return how much longer the scanner measures a pose, counted from 0, that it judges by.

    All errors are counted from the first one, so that its own is in all of them.
    """
    if pose == 0:
        return _FIRST_S
    return _HELD_OUT_S if held_out(pose + 1)[pose] else 0.0


class _Measuring:
    """A robot that stands ready at home, and what is read of it from there."""

    def __init__(
        self, out: Output, operator: RigOperator, kept: StoredRun, most: int, advance: Advance
    ) -> None:
        self._out, self._operator, self._kept = out, operator, kept
        self._most, self._advance = most, advance
        before = kept.data
        self._restarts = before.restarts
        if before.poses:
            self._restarts += (len(before.poses),)
            out.note(f"going on after {len(before.poses)} poses: home is read again first")
        self._measured = Measured(
            self._keep, list(before.poses), list(before.left_out), list(before.tried)
        )
        operator.number = len(before.poses) + 1

    def _keep(self) -> None:
        operator, count = self._operator, len(self._measured.readings)
        outside = operator.outside()
        try:
            if longer_s := _scanned_s(count - 1):
                operator.wait(longer_s)
                # a cable may slip or creep meanwhile: what was true counts when lengths were read
                outside = operator.outside().with_truth_of(outside)
        finally:  # the pose is read, whatever ends the stay
            self._kept.keep(self._measured, self._restarts, outside)
        operator.number = count + 1
        self._advance(float(count))

    def go(self, robot: Robot, places: Places, criterion: StopCriterion) -> None:
        """Read home, then a batch of places after another until it is enough."""
        try:
            self._go(robot, places, criterion)
        finally:
            if self._kept.data.poses:
                self._kept.save(self._measured)

    def _go(self, robot: Robot, places: Places, criterion: StopCriterion) -> None:
        operator, measured = self._operator, self._measured
        done = self._kept.done()
        try:
            measured.add(read_pose(operator, operator.tighten()))
        except PoseRefusedError as error:
            raise WorkFailedError(f"{robot.profile}: at home: {error}") from error
        self._look_at_home()
        for batch in places.batches():
            left = np.array([place for place in batch if tuple(place.tolist()) not in done])
            left = left[: self._most - len(measured.readings)]
            measure_poses(operator, left, places.middle, measured, self._out)
            if len(measured.readings) >= self._most:
                return
            if len(left) and self._judged(criterion):
                return
        self._out.note(f"{len(measured.readings)} poses only: all others were refused")

    def _look_at_home(self) -> None:
        """Say what the camera lacks before anything moves far; raises WorkFailedError."""
        seen, setup = self._measured.readings[-1].image, self._kept.data.camera
        if seen is None or setup is None or seen.problem is not None:
            return  # what is wrong with an image is told already; the next one may be better
        if not seen.markers:
            why = "was another set printed, or does the camera not look at the sheets?"
            if seen.mirrored:
                why = f"{listed(seen.mirrored)} read as mirror images: are all printed so?"
            raise WorkFailedError(
                f"at home the camera sees no marker of {setup.sheets.dictionary}: {why}"
            )
        self._out.note(f"at home the camera sees {len(seen.markers)} markers")

    def _judged(self, criterion: StopCriterion) -> bool:
        """Tell what the poses so far are good for; return whether no more are needed."""
        data = self._kept.data
        if data.camera is not None:
            cover = coverage(data.sightings(), data.camera.sheets.placed)
            for text in cover.lines():
                self._out.note(f"after {len(data.poses)} poses: {text}")
            if not any(len(island) > 1 for island in cover.islands):
                raise WorkFailedError("no image shows two markers together: put them closer")
        why = criterion(data)
        if why is not None:
            self._out.note(why)
        return why is not None
