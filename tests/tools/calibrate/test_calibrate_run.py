"""Calibration runs that end early can be resumed, tested on a synthetic robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_drivers.camera.camera import CameraError
from cdpr_profiles import load_robot
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import CalibrationData, CameraSetup, load_data
from cdpr_rt.calibration.residuals import encoder_lengths
from cdpr_rt.errors import TripError
from cdpr_tools.calibrate import run
from cdpr_tools.calibrate.finish import stop_criterion
from cdpr_tools.calibrate.measure_poses import (
    COUNTED,
    DATA,
    SETTLE_S,
    NotThePoseError,
    PoseRefusedError,
    Readings,
    StoppedError,
    TargetNotReached,
)
from cdpr_tools.calibrate.places import chosen_places
from cdpr_tools.calibrate.rig import OutsidePose, OutsidePoses, RigOperator
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

ROBOT = load_robot("planar-4")
SETUP = CameraSetup(
    intrinsics=CameraIntrinsics(
        width_px=64, height_px=64, focal_px=(50.0, 50.0), centre_px=(32.0, 32.0)
    ),
    sheets=MarkerSheets(size_m=0.1, placed=(0, 1)),
)
TENSION = 60.0


class Rig(RigOperator):
    """A robot whose cables are 4 mm longer after each start."""

    started = stuck_at = 0

    def __init__(self, fails_at: int, failure: BaseException | None) -> None:
        self.geometry = CableGeometry.of(ROBOT)
        self.offset = 0.004 * Rig.started
        Rig.started += 1
        self.here = self.geometry.model.home.copy()
        self.gone: list[FloatArray] = []
        self.failed_at: FloatArray | None = None
        self.waits: list[float] = []
        self.trip: TripError | None = None
        self.sees: dict[int, FloatArray] = {0: np.zeros((4, 2)), 1: np.ones((4, 2))}
        self._left, self._failure = fails_at, failure
        self._chance = np.random.default_rng(Rig.started)

    def tighten(self) -> FloatArray:
        return self.here

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        self._left -= 1
        if self._failure is not None and self._left < 0:
            self.failed_at = place
            raise self._failure
        if len(self.gone) == 2:
            self.gone.append(place)
            raise PoseRefusedError("no")
        self.gone.append(place)
        if len(self.gone) == self.stuck_at:
            self.here = 0.5 * (self.here + place)
            return TargetNotReached(self.here, "40 mm off after 12 s: no way on")
        self.here = place
        return None

    def wait(self, seconds: float) -> None:
        self.waits.append(seconds)
        if self.trip is not None and seconds != SETTLE_S:
            raise self.trip

    def read(self, seconds: float) -> Readings:
        tension = np.full(self.geometry.n, TENSION)
        pose = self.geometry.model.poses(self.here[None])
        lengths = encoder_lengths(self.geometry, pose, tension[None])[0] + self.offset
        lengths += self._chance.normal(0.0, 1e-4, lengths.shape)
        measured = {"position_m": tuple(pose[0, 0].tolist()), "position_std_m": 1e-3}
        return Readings(np.tile(lengths, (20, 1)), np.tile(tension, (20, 1)), measured)

    def image(self) -> Sighting | None:
        return Sighting("now", self.sees)

    def outside(self) -> OutsidePose:
        p = tuple(float(x) for x in self.geometry.model.poses(self.here[None])[0, 0])
        return OutsidePose(true_position_m=p, true_rotation=((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))


@pytest.fixture
def rigs(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Rig]]:
    """Return a function that makes runs use rigs with the given failures."""
    Rig.started = Rig.stuck_at = 0
    made: list[Rig] = []

    def use(*failures: tuple[int, BaseException | None]) -> list[Rig]:
        left = list(failures)

        @contextmanager
        def rig(*_: object, **__: object) -> Iterator[Any]:
            made.append(Rig(*(left.pop(0) if left else (0, None))))
            yield made[-1]

        monkeypatch.setattr(run, "simulated_rig", rig)
        return made

    return use


def settings(poses: int | None = 15) -> run.CalibrationRunSettings:
    return run.CalibrationRunSettings(
        robot="planar-4", plant=None, source="camera", poses=poses, seed=1
    )


def never(_: CalibrationData) -> str | None:
    return None


def begin(folder: Path, wanted: run.CalibrationRunSettings) -> CalibrationData:
    return run.measure(Output(True), ROBOT, wanted, run.StoredRun.new(folder, ROBOT, SETUP), never)


def go_on(folder: Path, wanted: run.CalibrationRunSettings) -> CalibrationData:
    return run.measure(Output(True), ROBOT, wanted, run.StoredRun.resumed(folder, ROBOT), never)


@pytest.mark.parametrize(
    ("failure", "raised"),
    [
        (StoppedError(), WorkFailedError),
        (CameraError("camera sim:x sends no more images"), CameraError),
        (KeyboardInterrupt(), KeyboardInterrupt),  # as sudden as SIGKILL
    ],
)
def test_a_resumed_run_keeps_measured_poses_and_measures_the_rest(
    failure: BaseException,
    raised: type[BaseException],
    tmp_path: Path,
    rigs: Callable[..., list[Rig]],
) -> None:
    made = rigs((7, failure))
    with pytest.raises(raised) as caught:
        begin(tmp_path, settings())
    left = load_data(tmp_path / DATA)
    assert 5 <= len(left.poses) <= 7 and left.restarts == ()
    if raised is not KeyboardInterrupt:
        told = " ".join([str(caught.value), *getattr(caught.value, "__notes__", ())])
        assert f"{len(left.poses)} poses are saved" in told and "--resume" in told
    data = go_on(tmp_path, settings())
    assert len(data.poses) == 15 and data.restarts == (len(left.poses),)
    assert data.poses[: len(left.poses)] == left.poses
    assert data.poses[len(left.poses)].target == data.poses[0].target
    targets = [reading.target for reading in data.poses]
    assert len(set(targets)) == 14  # only home is visited twice
    assert len(OutsidePoses.load_file(tmp_path / run.OUTSIDE).poses) == 15
    assert len(made) == 2
    assert go_on(tmp_path, settings()) == data and len(made) == 2


def test_all_poses_of_a_list_are_visited_despite_an_interruption(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs((7, StoppedError()))
    listed = tuple(map(tuple, chosen_places(ROBOT, 16, 9).chosen.tolist()))
    wanted = settings(17).model_copy(update={"places": listed})
    with pytest.raises(WorkFailedError):
        begin(tmp_path, wanted)
    wanted.save(tmp_path)
    again = run.CalibrationRunSettings.load(tmp_path)
    assert again == wanted == again.resumed(None, None, None)
    data = go_on(tmp_path, again)
    home = data.poses[0].target
    assert {reading.target for reading in data.poses} == {home, *listed}
    assert len(data.poses) == 18 and go_on(tmp_path, again) == data
    with pytest.raises(BadInputError, match="began with a list of poses"):
        again.resumed(30, None, None)


def test_a_kill_between_two_files_loses_at_most_one_pose(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs()
    data = begin(tmp_path, settings())
    outside = OutsidePoses.load_file(tmp_path / run.OUTSIDE)
    data.model_copy(update={"poses": data.poses[:9]}).save(tmp_path / DATA)
    outside.model_copy(update={"poses": outside.poses[:10]}).save(tmp_path / run.OUTSIDE)
    again = go_on(tmp_path, settings())
    assert len(again.poses) == 15 and again.restarts == (9,)
    assert again.poses[:9] == data.poses[:9]


def test_new_initial_lengths_after_a_restart_are_fitted(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs((12, StoppedError()))
    with pytest.raises(WorkFailedError):
        begin(tmp_path, settings(25))
    data = go_on(tmp_path, settings(25))
    geometry = CableGeometry.of(ROBOT)
    outcome = calibrate(ROBOT, geometry, data.observations(ROBOT, geometry.model), "points")
    assert outcome.found.jumps_m == pytest.approx(-0.004, abs=1e-3)
    assert not outcome.faults and outcome.verified.mean_mm < 0.5
    assert outcome.before.mean_mm < 0.5  # the file is right


def test_poses_are_added_until_the_stop_criterion_is_met(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs()
    asked: list[int] = []

    def enough(data: CalibrationData) -> str | None:
        asked.append(len(data.poses))
        return "enough" if len(data.poses) > 20 else None

    kept = run.StoredRun.new(tmp_path, ROBOT, SETUP)
    data = run.measure(Output(True), ROBOT, settings(None), kept, enough)
    assert 20 < len(data.poses) < 35 and asked[-1] == len(data.poses)


def test_the_scanner_measures_longer_at_the_first_and_at_held_out_poses(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    made = rigs((7, StoppedError()))
    with pytest.raises(WorkFailedError):
        begin(tmp_path, settings())
    go_on(tmp_path, settings())
    waits = [seconds for rig in made for seconds in rig.waits]
    poses = np.cumsum(np.array(waits) == SETTLE_S)  # each pose is awaited before it is read
    longer = [(int(pose), s) for pose, s in zip(poses, waits, strict=True) if s != SETTLE_S]
    assert [pose for pose, _ in longer] == [1, 5, 10, 15]
    assert longer[0][1] > max(s for _, s in longer[1:])


def test_the_true_pose_is_that_at_the_reading_and_not_after_the_longer_scan(
    tmp_path: Path, rigs: Callable[..., list[Rig]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rigs()
    wait, outside = Rig.wait, Rig.outside

    def slips(rig: Rig, seconds: float) -> None:
        wait(rig, seconds)
        if seconds != SETTLE_S:
            rig.here = rig.here + 0.01

    def scanned(rig: Rig) -> OutsidePose:
        seen = outside(rig)
        return seen.model_copy(update={"position_m": seen.true_position_m})

    monkeypatch.setattr(Rig, "wait", slips)
    monkeypatch.setattr(Rig, "outside", scanned)
    data = begin(tmp_path, settings())
    kept = OutsidePoses.load_file(tmp_path / run.OUTSIDE).poses
    later = []
    for reading, other in zip(data.poses, kept, strict=True):
        assert other.true_position_m[:2] == pytest.approx(reading.target[:2])
        assert other.position_m is not None
        later.append(other.position_m[0] - other.true_position_m[0])
    assert np.flatnonzero(later).tolist() == [0, 4, 9, 14]
    assert np.array(later)[[0, 4, 9, 14]] == pytest.approx(0.01)


def test_a_read_pose_is_kept_if_the_longer_scan_is_interrupted(
    tmp_path: Path, rigs: Callable[..., list[Rig]], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rigs()
    told = run.StoredRun.add

    def add(self: run.StoredRun, *what: Any) -> None:
        told(self, *what)
        if len(self.data.poses) == 4:
            made[0].trip = TripError("the motion was ended: fault")

    monkeypatch.setattr(run.StoredRun, "add", add)
    with pytest.raises(TripError, match="ended"):
        begin(tmp_path, settings())
    left = load_data(tmp_path / DATA)
    assert len(left.poses) == 5 and not left.tried
    assert len(OutsidePoses.load_file(tmp_path / run.OUTSIDE).poses) == 5
    data = go_on(tmp_path, settings())
    assert data.poses[:5] == left.poses and len(data.poses) == 15


def test_an_unreachable_place_is_read_where_the_platform_stops_and_not_retried(
    tmp_path: Path, rigs: Callable[..., list[Rig]], capsys: pytest.CaptureFixture[str]
) -> None:
    made = rigs((9, StoppedError()))
    Rig.stuck_at = 6
    with pytest.raises(WorkFailedError):
        begin(tmp_path, settings())
    Rig.stuck_at = 0
    left = load_data(tmp_path / DATA)
    missed = tuple(made[0].gone[5].tolist())
    assert left.tried == (missed,) and not left.left_out
    assert missed not in {reading.target for reading in left.poses}
    said = capsys.readouterr().err
    assert "is read where the platform stands: 40 mm off after 12 s" in said
    data = go_on(tmp_path, settings())
    assert len(data.poses) == 15 and data.tried[:2] == left.tried
    assert missed not in {tuple(place.tolist()) for place in made[1].gone}


def test_a_place_at_which_a_fault_ended_the_motion_is_not_retried(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs((7, TripError("the motion was ended: fault")))
    with pytest.raises(TripError):
        begin(tmp_path, settings())
    left = load_data(tmp_path / DATA)
    assert "fault" in left.left_out[-1]
    data = go_on(tmp_path, settings())
    assert len(data.poses) == 15
    assert left.tried[-1] not in {reading.target for reading in data.poses}


def test_a_place_interrupted_by_an_emergency_stop_is_retried(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    made = rigs((7, NotThePoseError("the motion was ended: emergency stop")))
    with pytest.raises(TripError):
        begin(tmp_path, settings())
    failed_at = made[0].failed_at
    assert failed_at is not None
    data = go_on(tmp_path, settings())
    assert tuple(failed_at.tolist()) in {reading.target for reading in data.poses}
    assert not any("emergency" in text for text in data.left_out)


def test_a_camera_that_sees_no_marker_at_home_ends_the_run(
    tmp_path: Path, rigs: Callable[..., list[Rig]], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rigs()
    monkeypatch.setattr(Rig, "image", lambda _: Sighting("now", {}))
    with pytest.raises(WorkFailedError, match="at home the camera sees no marker"):
        begin(tmp_path, settings())
    assert not made[0].gone


def test_images_that_never_show_two_markers_end_the_run_after_a_batch(
    tmp_path: Path, rigs: Callable[..., list[Rig]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rigs()
    monkeypatch.setattr(Rig, "image", lambda _: Sighting("now", {0: np.zeros((4, 2))}))
    kept = run.StoredRun.new(tmp_path, ROBOT, SETUP)
    criterion = stop_criterion(Output(True), ROBOT, None, CableGeometry.of(ROBOT))
    with pytest.raises(WorkFailedError, match="no image shows two markers together"):
        run.measure(Output(True), ROBOT, settings(), kept, criterion)
    assert len(load_data(tmp_path / DATA).poses) == 11  # home and ten places


def test_a_new_run_deletes_poses_of_the_previous_run(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs()
    begin(tmp_path, settings())
    (tmp_path / run.IMAGES).mkdir()
    for name in (f"{run.IMAGES}/pose-0015.png", COUNTED):
        (tmp_path / name).write_text("of before")
    run.StoredRun.new(tmp_path, ROBOT, SETUP)
    assert [path.name for path in tmp_path.iterdir()] == [DATA]
    assert not load_data(tmp_path / DATA).poses


def test_a_run_that_ended_before_its_first_pose_can_be_resumed(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs()
    run.StoredRun.new(tmp_path, ROBOT, SETUP)
    settings().save(tmp_path)
    assert len(go_on(tmp_path, settings()).poses) == len(
        begin(tmp_path / "whole", settings()).poses
    )


@pytest.mark.parametrize("name", [run.IMAGES, DATA, run.SETTINGS, run.OUTSIDE, COUNTED])
def test_a_run_rejects_a_folder_with_files_of_the_user(tmp_path: Path, name: str) -> None:
    kept = tmp_path / name / "pose-0001.png" if name == run.IMAGES else tmp_path / name
    kept.parent.mkdir(exist_ok=True)
    kept.write_text("somebody else's")
    with pytest.raises(BadInputError, match="choose another --out, or move the file away"):
        run.StoredRun.new(tmp_path, ROBOT, SETUP)
    assert kept.read_text() == "somebody else's"


def test_a_new_run_keeps_files_of_the_user_among_its_images(tmp_path: Path) -> None:
    run.StoredRun.new(tmp_path, ROBOT, SETUP)
    (tmp_path / run.IMAGES).mkdir()
    (tmp_path / run.IMAGES / "holiday.png").write_text("a beach")
    run.StoredRun.new(tmp_path, ROBOT, SETUP)
    assert (tmp_path / run.IMAGES / "holiday.png").read_text() == "a beach"


def test_a_simulation_does_not_overwrite_readings_of_a_real_robot(tmp_path: Path) -> None:
    kept = run.StoredRun.new(tmp_path, ROBOT, None)
    kept.data.model_copy(update={"simulated": False}).save(tmp_path / DATA)
    with pytest.raises(BadInputError, match="contains readings of a real robot"):
        run.StoredRun.new(tmp_path, ROBOT, None)
    assert (tmp_path / DATA).exists()


def test_data_of_a_changed_robot_cannot_be_resumed(
    tmp_path: Path, rigs: Callable[..., list[Rig]]
) -> None:
    rigs()
    data = begin(tmp_path, settings())
    data.model_copy(update={"geometry_sha256": "0" * 64}).save(tmp_path / DATA)
    with pytest.raises(BadInputError, match="another version of 'planar-4'"):
        go_on(tmp_path, settings())
