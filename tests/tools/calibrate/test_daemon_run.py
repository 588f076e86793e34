"""A stand-in for a daemon moves a platform between poses. Readings are stored, failures end it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration_in_force import calibrated, take_over, undo
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import load_data
from cdpr_rt.calibration.residuals import encoder_lengths
from cdpr_rt.errors import TripError
from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.calibrate.check import checked_running
from cdpr_tools.calibrate.daemon_run import going_on
from cdpr_tools.calibrate.measure_poses import PoseOperator, StoredPoses
from cdpr_tools.calibrate.places import Places
from cdpr_tools.calibrate.run import read_places
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.errors import BadInputError, ConnectionLostError, WorkFailedError
from cdpr_tools.output import Output
from tests.profiles.test_geometry_calibration import calibration
from tests.tools.calibrate.test_daemon_pose import ROBOT, StandingDaemon, kept_in, read

pytestmark = pytest.mark.usefixtures("daemon_time")


PLACES = [(0.1, 1.5, 0.0), (0.2, 1.6, 0.05), (-0.1, 1.7, 0.0), (0.0, 1.4, -0.05)]


class Moved(StandingDaemon):
    """A stand-in that moves its platform, except for places that are rejected, missed or faulty."""

    def __init__(self) -> None:
        super().__init__()
        self.program, self.target = "hold", list(self.place)
        self.refused: set[float] = set()
        self.stuck: set[float] = set()
        self.faulty: set[float] = set()
        self.limit, self.holds, self.rights = "slack", 0, 0
        self.lost = self.silent = False
        self.reacting = "none"
        """The reaction that is stopping the robot."""

    def get(self, path: str) -> dict[str, Any]:
        if self.lost:
            raise ConnectionLostError("gone")
        status = super().get(path)
        if path != "/status":
            return status
        if self.program == "pose" and self.target[0] in self.faulty:
            self.state = "fault"
        arrived = self.program == "pose" and self.target[0] not in self.stuck
        if arrived:
            self.place = list(self.target)
            here = {"position_m": self.place[:2], "rotation_rad": self.place[2:]}
            status["program_progress"] |= here
        status["program_progress"] |= {
            "done": float(arrived), "trouble": "", "held_back": "a cable would be slack",
            "missing": "",
        }  # fmt: skip
        reason = "axis 1: slack" if self.state == "fault" or self.reacting != "none" else ""
        limit = {"limit": self.limit} if reason else None
        return status | {
            "program": self.program,
            "commanded": f"{self.program} by me",
            "state": self.state,
            "reason": reason,
            "reason_limit": limit,
            "reacting": self.reacting,
        }

    def post(
        self, path: str, body: dict[str, Any] | None = None, _token: str | None = None
    ) -> dict[str, Any]:
        if path == "/control":
            self.rights += 1
            return {"token": "one"}
        if path == "/hold":
            self.program, self.holds = "hold", self.holds + 1
            return {}
        wanted = (body or {})["wanted"]
        assert (path, (body or {})["program"]) == ("/program", "pose")
        assert wanted["speed_m_s"] == 0.5 * ROBOT.platform.speed_m_s  # type: ignore[union-attr]
        if self.silent:
            raise WorkFailedError("the loop has run no cycle for 2.0 s")
        if self.reacting != "none":
            raise refused("the robot is being stopped")
        if wanted["position_m"][0] in self.refused:
            raise refused("a cable is in the way")
        self.program, self.target = "pose", [*wanted["position_m"], *wanted["rotation_rad"]]
        return {}

    def renew(self, _token: str) -> None: ...
    def release(self, _token: str) -> None: ...


def refused(why: str) -> DaemonRefusalError:
    return DaemonRefusalError.of(
        CommandRefusal(RefusalCode.NOT_FEASIBLE, "pose", arguments={"why": why})
    )


class Measurement:
    """A measurement of four places with such a daemon, stored in a folder."""

    def __init__(self, daemon: Moved, folder: Path) -> None:
        self.daemon, self.folder = daemon, folder
        self.asked: list[int] = []
        self.ask = self.asked.append
        self.stopped = False

    def run(self, wanted: int = 5) -> StoredPoses:
        robot, kept = kept_in(self.daemon, self.folder)
        places = Places(np.array([0.0, 1.5, 0.0]), np.array(PLACES))
        out = Output(as_json=False)
        with going_on(kept), commanded(self.daemon, in_control=True) as running:  # type: ignore[arg-type]
            operator = PoseOperator(running, robot, lambda _: None, lambda: self.stopped)
            read_places(out, robot, operator, kept, places, wanted, lambda _: None, self.ask)
        return kept


@pytest.fixture
def measurement(tmp_path: Path) -> Measurement:
    return Measurement(Moved(), tmp_path)


def test_home_and_each_place_are_read_and_stored(measurement: Measurement) -> None:
    kept = measurement.run()
    data = load_data(measurement.folder / "data.json")
    assert data == kept.data and len(data.poses) == 5 and data.restarts == ()
    assert {pose.target for pose in data.poses[1:]} == set(PLACES)
    assert measurement.asked == [1, 2, 3, 4, 5]
    # the right to move is held from the first pose to the last
    assert measurement.daemon.rights == measurement.daemon.holds == 1
    assert measurement.daemon.program == "hold"


def test_a_measurement_continues_after_its_stored_poses(measurement: Measurement) -> None:
    assert measurement.run(3).data.restarts == ()
    assert measurement.run(4).data.restarts == ()
    measurement.daemon.counted_m += 0.01  # as after a restart
    kept = measurement.run()
    assert len(kept.data.poses) == 5 and kept.data.restarts == (4,)


def test_a_rejected_place_is_omitted_and_a_missed_one_is_read(
    measurement: Measurement, capsys: pytest.CaptureFixture[str]
) -> None:
    measurement.daemon.refused, measurement.daemon.stuck = {0.2}, {-0.1}
    data = measurement.run().data
    told = capsys.readouterr().err
    assert "a cable is in the way" in told
    assert "mm" in told and "still moving" not in told and "a cable would be slack" in told
    assert set(data.tried) == {PLACES[1], PLACES[2]}
    assert len(data.poses) == 4


@pytest.mark.parametrize(("limit", "tried"), [("slack", 1), ("late", 0)])
def test_a_fault_ends_the_measurement_and_keeps_readings(
    measurement: Measurement, limit: str, tried: int
) -> None:
    measurement.daemon.faulty, measurement.daemon.limit = {-0.1}, limit
    with pytest.raises(TripError, match="the motion was ended: axis 1: slack") as caught:
        measurement.run()
    assert "the same command continues after these poses" in caught.value.__notes__[0]
    data = load_data(measurement.folder / "data.json")
    assert len(data.tried) == tried and 1 <= len(data.poses) < 5


def test_a_reacting_robot_ends_the_measurement_before_the_next_place(
    measurement: Measurement,
) -> None:
    """While its platform is lowered, a robot still has power but rejects all commands."""
    measurement.run(2)
    daemon = measurement.daemon
    post = daemon.post

    def stopped_meanwhile(*arguments: Any) -> Any:
        daemon.reacting = "controlled stop"
        return post(*arguments)

    daemon.post = stopped_meanwhile  # type: ignore[method-assign]
    with pytest.raises(TripError, match=r"axis 1: slack \(controlled stop under way\)"):
        measurement.run()
    # the platform has not started towards the place, which is visited later
    assert daemon.rights == 2 and load_data(measurement.folder / "data.json").tried == ()
    with pytest.raises(TripError):  # nothing is read either
        measurement.run()
    assert len(load_data(measurement.folder / "data.json").poses) == 2


def test_a_silent_loop_does_not_count_as_rejection_of_a_place(measurement: Measurement) -> None:
    measurement.run(2)
    measurement.daemon.silent = True
    with pytest.raises(WorkFailedError, match="has run no cycle"):
        measurement.run()
    assert measurement.daemon.rights == 2
    assert load_data(measurement.folder / "data.json").tried == ()


def test_a_hold_by_another_client_ends_the_measurement_at_rest(measurement: Measurement) -> None:
    def ask(pose: int) -> None:
        if pose == 3:
            measurement.daemon.program = "hold"

    measurement.ask = ask
    with pytest.raises(TripError, match="the motion was ended"):
        measurement.run()
    assert len(load_data(measurement.folder / "data.json").poses) == 3


def test_a_stop_request_holds_the_robot_and_a_lost_daemon_is_reported(
    measurement: Measurement,
) -> None:
    measurement.run(2)
    daemon, post = measurement.daemon, measurement.daemon.post

    def stopped_on_the_way(path: str, *arguments: Any) -> dict[str, Any]:
        answer = post(path, *arguments)
        measurement.stopped |= path == "/program"
        return answer

    daemon.post = stopped_on_the_way  # type: ignore[method-assign]
    daemon.stuck = {place[0] for place in PLACES}
    with pytest.raises(WorkFailedError, match="stopped; 2 poses are saved"):
        measurement.run()
    assert daemon.program == "hold"
    measurement.stopped, daemon.lost = False, True
    with pytest.raises(ConnectionLostError):
        measurement.run()


class Calibrated(Moved):
    """A stand-in that runs a calibrated robot. A drum may have changed since then."""

    def __init__(self, robot: Robot, drum: float) -> None:
        super().__init__()
        self.robot, self.drum = robot, drum
        self.description |= {
            "reference": str(robot.path), "geometry_sha256": geometry_sha256(robot),
            "calibration": {"version": 1},
        }  # fmt: skip
        self.geometry = CableGeometry.of(robot)
        self.tension_N = np.full((1, 4), 40.0)
        self.home_m = self.lengths_m(np.array([*robot.platform.home_m, 0.0]))  # type: ignore[union-attr]

    def lengths_m(self, place: FloatArray) -> FloatArray:
        poses = self.geometry.model.poses(place[None])
        return np.asarray(encoder_lengths(self.geometry, poses, self.tension_N)[0])

    def get(self, path: str) -> dict[str, Any]:
        status = super().get(path)
        if path == "/status":
            lengths_m = self.lengths_m(np.array(self.place))
            lengths_m[1] -= self.drum * (lengths_m[1] - self.home_m[1])
            for axis, length_m in zip(status["axes"], lengths_m, strict=True):
                axis |= {"cable_length_m": float(length_m), "tension_N": 40.0}
        return status


@pytest.fixture
def file(tmp_path: Path) -> Robot:
    """Return a robot's file with a calibration in force."""
    path = tmp_path / "mine.toml"
    shutil.copy(ROBOT.path, path)
    robot = load_robot(path)
    take_over(robot, calibration(robot))
    return robot


@pytest.mark.parametrize(("drum", "moved"), [(0.0, False), (0.01, True)])
def test_a_running_robot_is_checked_against_its_calibration(
    file: Robot, drum: float, moved: bool, tmp_path: Path
) -> None:
    daemon = Calibrated(calibrated(file), drum)
    out = Output(as_json=False)
    found = checked_running(out, file, daemon, None, 1, tmp_path / "out")  # type: ignore[arg-type]
    assert (found.moved, found.poses) == (moved, 11)
    if moved:
        (change,) = found.changes
        assert (change.kind, change.cable) == ("drum", 1)
        assert change.size == pytest.approx([0.01], rel=0.2)
    data = load_data(tmp_path / "out" / "check.json")
    assert len(data.poses) == 11 and not data.simulated


def test_a_check_requires_a_robot_that_runs_with_its_calibration(
    file: Robot, tmp_path: Path
) -> None:
    out, folder = Output(as_json=False), tmp_path / "out"
    daemon = Calibrated(calibrated(file), 0.0)
    with pytest.raises(BadInputError, match="calibrated with a camera"):
        checked_running(out, file, daemon, "opencv:0", 1, folder)  # type: ignore[arg-type]
    with pytest.raises(BadInputError, match="the running daemon uses"):
        checked_running(out, ROBOT, daemon, None, 1, folder)  # type: ignore[arg-type]
    undo(file)
    with pytest.raises(BadInputError, match="or its calibration has changed"):
        checked_running(out, file, daemon, None, 1, folder)  # type: ignore[arg-type]
    assert not folder.exists() and daemon.rights == 0


def test_a_check_does_not_overwrite_data_of_a_calibration(file: Robot, tmp_path: Path) -> None:
    read(StandingDaemon(), tmp_path)
    daemon = Calibrated(calibrated(file), 0.0)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    with pytest.raises(BadInputError, match="contains the poses of a calibration; choose another"):
        checked_running(Output(as_json=False), file, daemon, None, 1, tmp_path)  # type: ignore[arg-type]
    assert before == {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    assert daemon.rights == 0


def test_a_check_requires_a_platform_held_at_home(file: Robot, tmp_path: Path) -> None:
    out, folder = Output(as_json=False), tmp_path / "out"
    daemon = Calibrated(calibrated(file), 0.0)
    daemon.place[0] += 0.3
    with pytest.raises(BadInputError, match=r"\d+ mm from home, where the first pose must be"):
        checked_running(out, file, daemon, None, 1, folder)  # type: ignore[arg-type]
    daemon.state = "ready"
    with pytest.raises(
        WorkFailedError, match=r"the cables do not hold the platform \(ready, hold\)"
    ):
        checked_running(out, file, daemon, None, 1, folder)  # type: ignore[arg-type]
    assert not folder.exists() and daemon.rights == 0
