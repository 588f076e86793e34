"""What goes wrong on a planar robot: it is held or let down under control, and the reason is told.

Speeds are those of the simulator's true pose, which no controller reads.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.calibration.in_force import take_over
from cdpr_rt.core.states import LoopState
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.trials.evaluation.pose_log import read_pose_log
from cdpr_tools.trials.lockstep import LockstepRobot
from cdpr_tools.trials.streams.stream import StreamSender
from tests.profiles.test_geometry_calibration import calibration

UPPER_LEFT, UPPER_RIGHT, LOWER = range(3)
HIGH = (0.1, 1.65)
G_m_s2 = 9.80665
TENSION_MAX_N = 150.0
ACCELERATION_m_s2 = 2.0


def aloft(robot: LockstepRobot, **tighten: str) -> None:
    """Have the platform hang on its cables."""
    robot.enable()
    robot.carry_out("tighten", 30.0, **tighten)
    robot.carry_out("pose", 30.0, position_m=list(HIGH))
    robot.run(0.3)


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped robot at half the cycles a second, which take half the time."""
    shipped = load_robot("planar-3").path
    slower = tmp_path_factory.mktemp("planar") / shipped.name
    text = shipped.read_text()
    assert "sync_period_s = 0.001" in text
    slower.write_text(text.replace("sync_period_s = 0.001", "sync_period_s = 0.002"))
    return slower


@pytest.fixture
def hanging(planar: Path) -> Iterator[LockstepRobot]:
    with LockstepRobot(planar) as robot:
        aloft(robot)
        yield robot


@pytest.fixture(scope="module")
def shared(planar: Path) -> Iterator[LockstepRobot]:
    with LockstepRobot(planar) as robot:
        aloft(robot)
        yield robot


@pytest.fixture
def healthy(shared: LockstepRobot) -> LockstepRobot:
    """A robot at rest, whose tests leave it able to go on."""
    if shared.right.token is None:
        shared.run(4.0)
        shared.right.take("trial")
    shared.carry_out("pose", 30.0, position_m=list(HIGH))
    shared.run(1.0)
    return shared


class Truth:
    """What the simulator logs from now on."""

    def __init__(self, robot: LockstepRobot) -> None:
        self._robot = robot
        self._from = robot.cycle + robot.sync_offset

    def read(self) -> Any:
        """Return the records since."""
        log = read_pose_log(self._robot.truth_log)
        return log[log["sync_index"] >= self._from]


def end_of_fault(robot: LockstepRobot) -> None:
    robot._turn_until(lambda: robot.loop.busy, 3.0, "a reaction")
    robot._turn_until(lambda: not robot.loop.busy, 60.0, "the power off")


def height_m(records: Any) -> float:
    return float(records["position_m"][0, 1] - records["position_m"][-1, 1])


FAULTS = [
    # what breaks where, by 2F00h; what is told; whether gravity can still be carried
    ((UPPER_RIGHT, 1, 0x7305), ("7305h",), False),
    ((UPPER_LEFT, 12, 1), ("upper left: the cable seems broken",), False),
    ((LOWER, 12, 1), ("lower: the cable seems broken",), True),
    ((UPPER_RIGHT, 11, 500), ("upper right: angle jumped",), True),
]


@pytest.mark.parametrize(
    ("what", "told", "carries"),
    FAULTS,
    ids=["drive", "cut", "lower-cut", "jump"],
)
def test_the_winches_that_are_left_let_the_platform_down(
    hanging: LockstepRobot, what: tuple[int, int, int], told: tuple[str, ...], carries: bool
) -> None:
    if what[0] == LOWER:  # on its way home already
        hanging.block.post_command({"do": "disable", "client": "test"})
        hanging.run(0.3)
    truth = Truth(hanging)
    hanging.inject_fault(*what)
    end_of_fault(hanging)
    assert hanging.state is LoopState.FAULT
    for text in told:
        assert text in hanging.loop.life.reason
    mend = [text for text in hanging.status["notices"] if "mend the cable" in text]
    assert len(mend) == ("broken" in told[0])
    assert all(text.startswith(told[0]) for text in mend)
    # how far its cables are out is not known any more, but after the fault of a drive
    assert hanging.loop.engine.parts.estimator.estimate.length_known.all() == (told == ("7305h",))
    records = truth.read()
    down_m_s = -records["velocity_m_s"][:, 1].min()
    if carries:
        assert down_m_s < 0.45
    # what only one upper cable is left of swings: it gains hardly more than its height is worth
    speed_m_s = np.linalg.norm(records["velocity_m_s"], axis=1).max()
    assert speed_m_s < 1.03 * math.sqrt(2.0 * G_m_s2 * height_m(records))
    others = [axis for axis in range(3) if axis != what[0]]
    assert records["tension_N"][:, others].max() < TENSION_MAX_N
    # it rests: on the floor, the cables without load
    assert np.abs(records["velocity_m_s"][-1]).max() < 0.02
    assert height_m(records) > 0.25
    assert records["tension_N"][-1].max() < 8.0


@pytest.mark.parametrize("slip_mm", [60, 30])
def test_a_cable_of_eight_that_slips_is_noticed_by_the_others(tmp_path: Path, slip_mm: int) -> None:
    """By so little that it is tight enough not to be taken for a broken one.

    Half of it needs a calibrated robot.
    """
    path = tmp_path / "mine.toml"
    shutil.copy(load_robot("spatial-8").path, path)
    if slip_mm < 60:
        file = load_robot(path)
        right = {"drum_scales": (1.0,) * 8, "elongation_scale": 1.0, "home_m": file.platform.home_m}
        take_over(file, calibration(file, move_m=0.0).model_copy(update=right))
    with LockstepRobot(path) as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        assert 0.0 < robot.run(0.3)["lengths_disagree_m"].max() < 1e-3
        robot.inject_fault(1, 13, slip_mm)
        end_of_fault(robot)
        assert robot.state is LoopState.FAULT
        told = robot.loop.life.reason
        assert "the cables' lengths disagree by" in told
        assert told.startswith(("the cables", "axis 2: "))  # no other cable than that is named


def test_a_lowering_that_fails_does_not_leave_motors_with_power(hanging: LockstepRobot) -> None:
    def mistaken(*_: object) -> None:
        raise ValueError("a mistake")

    lower = hanging.loop.engine.parts.programs["lower"]
    lower.update = mistaken  # type: ignore[method-assign]
    begun_s = hanging.now_s
    with pytest.raises(WorkFailedError):
        hanging.command("disable")
    hanging._turn_until(lambda: not hanging.loop.busy, 10.0, "the power off")
    assert hanging.now_s - begun_s < 5.0
    assert hanging.state is LoopState.FAULT
    assert hanging.loop.life.reason.startswith("program lower: ValueError: a mistake")
    assert hanging.machine.unpowered()


def test_a_target_out_of_the_workspace_is_refused_and_nothing_moves(
    healthy: LockstepRobot,
) -> None:
    truth = Truth(healthy)
    for position, named in (
        ([0.0, 5.0], r"position_m\[1\]: value 5 m; allowed: 1.4 to 2.4 m, the workspace"),
        ([math.nan, 1.8], r"position_m\[0\]: value nan"),
        ([-0.7, 1.8], r"position_m\[0\]: value -0.7 m; allowed: -0.6 to 0.6 m"),
    ):
        with pytest.raises(WorkFailedError, match=named):
            healthy.program("pose", position_m=position)
    healthy.run(0.3)
    speeds = np.linalg.norm(truth.read()["velocity_m_s"], axis=1)
    assert speeds.max() < 0.02
    assert healthy.loop.engine.program.name == "pose"


def lead(robot: LockstepRobot, hand: StreamSender, places: list[list[float]]) -> Any:
    """Send a place every 20 ms; return the rows of all cycles meanwhile."""
    rows = []
    for place in places:
        robot.stream.take(hand.packet(robot.now_s, place))
        rows.append(robot.run(0.02))
    return np.concatenate(rows)


def test_a_hand_that_leaps_by_a_metre_moves_nothing_at_a_step(healthy: LockstepRobot) -> None:
    healthy.program("pose", stream=True)
    hand = healthy.stream.sender()
    lead(healthy, hand, [[0.0, 0.0, 0.0]] * 20)
    truth = Truth(healthy)
    rows = lead(healthy, hand, [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]] * 15)
    steps = np.diff(rows["pose_setpoint"][:, :2], n=2, axis=0) / healthy.period_s**2
    assert np.abs(steps).max() < 1.01 * ACCELERATION_m_s2
    speeds = np.linalg.norm(truth.read()["velocity_m_s"], axis=1)
    assert speeds.max() < 0.75
    assert healthy.state is LoopState.ACTIVE


def test_a_hand_that_is_no_number_is_not_followed(healthy: LockstepRobot) -> None:
    healthy.program("pose", stream=True)
    hand = healthy.stream.sender()
    lead(healthy, hand, [[0.0, 0.0, 0.0]] * 20)
    truth = Truth(healthy)
    lead(healthy, hand, [[math.nan, 0.0, 0.0], [0.0, math.inf, 0.0]] * 15)
    assert np.linalg.norm(truth.read()["velocity_m_s"], axis=1).max() < 0.02
    assert np.isfinite(healthy.row["pose_setpoint"][:2]).all()
    assert healthy.state is LoopState.ACTIVE


def test_a_master_that_disappears_in_motion_leaves_the_platform_held(
    healthy: LockstepRobot,
) -> None:
    healthy.program("pose", position_m=[-0.4, 2.1], speed_m_s=0.2)
    healthy.run(0.5)
    healthy.right.fall_silent()
    healthy.until(lambda: healthy.loop.engine.program.name == "hold", 5.0)
    assert "nobody holds the right to move" in healthy.loop.life.reason
    healthy.run(1.0)
    truth = Truth(healthy)
    healthy.run(0.5)
    records = truth.read()
    assert np.linalg.norm(records["velocity_m_s"], axis=1).max() < 0.01
    assert records["tension_N"].min() > 10.0  # of the 20 N that are planned
    assert healthy.progress["tight"]
    # somebody who leads it again is not told the old reason for ever
    healthy.run(4.0)
    healthy.right.take("trial")
    healthy.carry_out("pose", 30.0, position_m=list(HIGH))
    assert healthy.loop.life.reason == ""


def test_what_was_paused_goes_on_to_where_it_was_going(healthy: LockstepRobot) -> None:
    target = [-0.3, 1.6]
    healthy.program("pose", position_m=target)
    healthy.run(0.4)
    healthy.command("hold")
    healthy.run(0.5)
    away_m = np.abs(healthy.truth()["position_m"][:2] - target).max()
    assert away_m > 0.05
    healthy.carry_out("pose", 20.0, resume=True)
    healthy.run(0.5)
    assert healthy.truth()["position_m"][:2] == pytest.approx(target, abs=0.01)


def test_no_platform_is_dropped_by_a_word(healthy: LockstepRobot) -> None:
    with pytest.raises(WorkFailedError, match="the platform hangs on its cables; lower it first"):
        healthy.program("idle")
    assert healthy.loop.engine.program.name == "pose"


def test_lengths_that_an_index_contradicts_neither_move_the_platform_nor_are_kept(
    planar: Path, tmp_path: Path
) -> None:
    with LockstepRobot(planar) as robot:
        last, machine = robot.loop.engine.parts.last_stop, robot.loop.engine.parts.estimator
        assert last is not None
        last.path = tmp_path / "lengths.json"
        aloft(robot)
        robot.carry_out("lower", 30.0)
        robot.command("disable")
        machine.forget_lengths()
        last.take()
        last.load(3, 3.0)
        assert last.lengths is not None
        # as if a motor had been turned by hand meanwhile, by 44 deg, which is 20 mm of cable
        turned_m = np.array([0.0, 0.02, 0.0])
        elsewhere = last.lengths.cable_at_index_m + turned_m
        last.lengths = replace(last.lengths, cable_at_index_m=elsewhere)
        robot.enable()
        told = "upper right: its motor's index is 20.* mm from where the last stop has it"
        with pytest.raises(WorkFailedError, match=told):
            robot.carry_out("tighten", 30.0, **{"from": "last"})
        robot.run(3.0)  # at rest, it has not done what it was to
        assert robot.progress["done"] == 0.0
        assert robot.status["failure"].startswith("tighten: upper right: its motor's index is 20")
        with pytest.raises(WorkFailedError, match=told):
            robot.program("pose", position_m=list(HIGH))
        with pytest.raises(WorkFailedError, match=told):
            robot.program("tighten")
        robot.carry_out("lower", 30.0)
        with pytest.raises(WorkFailedError, match=told):
            robot.program("tighten")
        robot.command("disable")
        last.lengths = None
        last.load(3, 3.0)
        assert last.lengths is None and last.displaced
        aloft(robot, **{"from": "home"})
        assert robot.truth()["position_m"][:2] == pytest.approx(HIGH, abs=0.01)
        robot.shut_down()
        last.load(3, 3.0)
        assert last.lengths is not None and not last.displaced


def test_a_stop_leaves_the_next_start_its_lengths_and_the_platform_on_its_stand(
    planar: Path, tmp_path: Path
) -> None:
    with LockstepRobot(planar) as robot:
        last, platform = robot.loop.engine.parts.last_stop, robot.robot.platform
        assert last is not None
        assert platform is not None
        last.path = tmp_path / "lengths.json"
        aloft(robot)
        robot.carry_out("lower", 30.0, blind=True)  # beside where it stood
        robot.command("disable")
        assert robot.state is LoopState.READY
        # as if the daemon and its drives had been without power meanwhile
        robot.loop.engine.parts.estimator.forget_lengths()
        last.take()
        last.load(3, 3.0)
        aloft(robot, **{"from": "last"})
        assert robot.truth()["position_m"][:2] == pytest.approx(HIGH, abs=0.01)

        robot.program("pose", position_m=[-0.3, 1.9])
        robot.run(0.5)
        truth = Truth(robot)
        robot.shut_down()  # in motion
        assert robot.state is LoopState.UNCONFIGURED
        records = truth.read()
        speeds = np.linalg.norm(records["velocity_m_s"], axis=1)
        assert speeds.max() < 0.75  # 0.5 m/s along each direction
        assert speeds[-1] < 0.01
        assert records["position_m"][-1, :2] == pytest.approx(platform.home_m, abs=0.003)
        assert records["tension_N"][-1].max() < 8.0
