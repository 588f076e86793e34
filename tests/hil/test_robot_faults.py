"""Faults of a planar robot: it is held or lowered under control and the reason is reported.

Speeds are those of the simulator's true pose, which no controller reads.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import take_over
from cdpr_rt.core.states import LoopState
from cdpr_rt.diagnosis.predictions import slips
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.robot import Error, Refused
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.recordings.truth import read_pose_log
from tests.local_robot import local_robot
from tests.profiles.test_geometry_calibration import calibration
from tests.slower_robot import slower_robot

UPPER_LEFT, UPPER_RIGHT, LOWER = range(3)
HIGH = (0.1, 1.65)
G_m_s2 = 9.80665
TENSION_MAX_N = 150.0


def aloft(robot: LockstepRobot, **tighten: str) -> None:
    """Tighten the cables and lift the platform."""
    robot.enable()
    robot.carry_out("tighten", 30.0, **tighten)
    robot.carry_out("pose", 30.0, position_m=list(HIGH))
    robot.run(0.3)


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return slower_robot(tmp_path_factory.mktemp("planar"), "planar-3", 0.002)


@pytest.fixture(scope="module")
def hanging(planar: Path) -> Iterator[LockstepRobot]:
    with local_robot(planar) as robot:
        aloft(robot)
        yield robot


class Truth:
    """The simulator's log from now on."""

    def __init__(self, robot: LockstepRobot) -> None:
        self._robot = robot
        self._from = robot.cycle + robot.machine.sync_offset

    def read(self) -> Any:
        """Return the records since then."""
        log = read_pose_log(self._robot.truth_log)
        return log[log["sync_index"] >= self._from]


def end_of_fault(robot: LockstepRobot) -> None:
    robot._turn_until(lambda: robot.loop.busy, 3.0, "a reaction")
    robot._turn_until(lambda: not robot.loop.busy, 60.0, "the power off")


def speed_at_power_off_m_s(robot: LockstepRobot, truth: Truth) -> float:
    """Return the highest speed from 50 ms before to 1 s after the power is cut."""
    end_of_fault(robot)
    off = len(truth.read())
    robot.run(1.0)
    return float(np.linalg.norm(truth.read()["velocity_m_s"][off - 25 :], axis=1).max())


def height_m(records: Any) -> float:
    return float(records["position_m"][0, 1] - records["position_m"][-1, 1])


FAULTS = [
    # the fault and its axis by 2F00h, the reported texts, whether the cables still carry gravity
    ((UPPER_RIGHT, 1, 0x7305), ("7305h",), False),
    ((UPPER_LEFT, 12, 1), ("upper left: the cable seems broken",), False),
    ((LOWER, 12, 1), ("lower: the cable seems broken",), True),
    ((UPPER_RIGHT, 11, 500), ("upper right: angle jumped",), True),
]


@pytest.mark.parametrize(
    ("what", "told", "carries"), FAULTS, ids=["drive", "cut", "lower-cut", "jump"]
)
def test_the_remaining_winches_lower_the_platform(
    hanging: LockstepRobot, what: tuple[int, int, int], told: tuple[str, ...], carries: bool
) -> None:
    if what[0] == LOWER:  # already on its way home
        hanging.block.post_command({"do": "disable", "client": "test"})
        hanging.run(0.3)
    truth = Truth(hanging)
    hanging.inject(*what)
    end_of_fault(hanging)
    assert hanging.state is LoopState.FAULT
    for text in told:
        assert text in hanging.loop.life.reason
    repair = [text for text in hanging.status()["notices"] if ": repair it, then" in text]
    assert len(repair) == ("broken" in told[0])
    assert all(text.startswith(told[0]) for text in repair)
    # cable lengths remain known only after a fault of a drive
    assert hanging.loop.engine.parts.estimator.estimate.length_known.all() == (told == ("7305h",))
    records = truth.read()
    down_m_s = -records["velocity_m_s"][:, 1].min()
    if carries:
        assert down_m_s < 0.45
    # with one upper cable left the platform swings, with little more energy than its height gives
    speed_m_s = np.linalg.norm(records["velocity_m_s"], axis=1).max()
    assert speed_m_s < 1.03 * math.sqrt(2.0 * G_m_s2 * height_m(records))
    others = [axis for axis in range(3) if axis != what[0]]
    assert records["tension_N"][:, others].max() < TENSION_MAX_N
    # at rest on the floor, without load on the cables
    assert np.abs(records["velocity_m_s"][-1]).max() < 0.02
    assert height_m(records) > 0.25
    assert records["tension_N"][-1].max() < 8.0


def test_a_platform_held_by_friction_is_at_rest_before_power_is_cut(
    planar: Path, tmp_path: Path
) -> None:
    path, plant = tmp_path / "light.toml", tmp_path / "plant.toml"
    path.write_text(planar.read_text().replace("mass_kg = 2.0", "mass_kg = 1.0"))
    plant.write_text("[motor.friction]\ncoulomb_Nm = 0.16\n")
    with local_robot(path, plant=plant) as robot:
        aloft(robot)
        truth = Truth(robot)
        robot.inject(LOWER, 1, 0x7305)
        assert speed_at_power_off_m_s(robot, truth) < 0.01
        assert height_m(truth.read()) == pytest.approx(HIGH[1] - 1.3, abs=0.02)


def test_a_drive_that_goes_pre_operational_is_switched_off_in_time(hanging: LockstepRobot) -> None:
    axis = hanging.robot.axes[UPPER_LEFT]
    network = hanging.machine.networks[axis.bus]
    truth = Truth(hanging)
    network.send(0, bytes([128, axis.node_id]))  # it keeps its last torque and its heartbeats
    hanging.run(0.05)
    assert abs(height_m(truth.read())) < 0.02
    hanging.run(0.07)  # its heartbeat comes every 0.1 s
    assert network.read_int(axis.node_id, 0x6041) & 0x6F == 0x40  # switch on disabled
    assert speed_at_power_off_m_s(hanging, truth) < 0.02
    assert (
        "pre-operational" in hanging.loop.life.reason or "not answered" in hanging.loop.life.reason
    )
    highest_m = truth.read()["position_m"][:, 1].max()
    assert highest_m < HIGH[1] + 0.05


@pytest.mark.parametrize("slip_mm", [20, 60])
def test_peak_tension_after_a_slip_is_at_most_as_predicted(
    hanging: LockstepRobot, slip_mm: int
) -> None:
    hanging.carry_out("pose", 30.0, position_m=[0.6, 2.4])
    truth = Truth(hanging)
    hanging.inject(UPPER_RIGHT, SLIP, slip_mm)
    hanging.run(0.4)
    highest_N = truth.read()["tension_N"].max()
    predicted_N = slips(Subject(hanging.robot))[UPPER_RIGHT].peak_N
    assert highest_N < 1.1 * predicted_N
    hanging.run(0.6)  # wait for the next status
    notices, reason = hanging.status()["notices"], hanging.loop.life.reason
    reported = any("upper right: tension" in note for note in notices) or "upper right" in reason
    assert reported or highest_N < TENSION_MAX_N


def restart(robot: LockstepRobot, axis: int) -> None:
    where = robot.robot.axes[axis]
    robot.machine.networks[where.bus].send(0, bytes([129, where.node_id]))


CUT, FAULT, SLIP = 12, 1, 13
ONE_CARRIES = """
name = "one upper cable"
sync_period_s = 0.002
[[buses]]
name = "can0"
[platform]
mass_kg = 1.6
home_m = [0, 0, 0.45]
workspace_min_m = [-0.2, -0.2, 0.5]
workspace_max_m = [0.2, 0.2, 0.85]
speed_m_s = 0.4
acceleration_m_s2 = 1.5
[limits]
torque_Nm = 1.5
tension_min_N = 4.0
tension_max_N = 45.0
""" + "".join(
    f"""
[[axes]]
winch = "winch-45n"
bus = "can0"
node_id = {k + 1}
exit_point_m = [{x}, {y}, {z}]
anchor_point_m = [0.0, 0.0, 0.0]
"""
    for k, (x, y, z) in enumerate(
        [(0.0, 1.7, 0.1), (-1.47, -0.85, 0.1), (1.47, -0.85, 0.1), (0.0, 0.0, 2.4)]
    )
)
SECOND_CAUSES = [
    # the first fault, that 0.5 s later, and the axis and text reported for it
    ((UPPER_LEFT, CUT), (LOWER, None), "lower", "restarted"),
    ((LOWER, FAULT), (UPPER_RIGHT, CUT), "upper right", "the cable seems broken"),
]


@pytest.mark.parametrize(("first", "second", "named", "told"), SECOND_CAUSES)
def test_a_second_fault_during_a_reaction_is_reported_in_the_notices(
    hanging: LockstepRobot,
    first: tuple[int, int],
    second: tuple[int, int | None],
    named: str,
    told: str,
) -> None:
    hanging.inject(*first, 0x7305 if first[1] == FAULT else 1)
    hanging.run(0.5)
    assert hanging.loop.engine.reacting
    reason = hanging.loop.life.reason
    assert not [note for note in hanging.status()["notices"] if note.startswith("also: ")]
    axis, sub = second
    if sub is None:
        restart(hanging, axis)
    else:
        hanging.inject(axis, sub, 0x7305 if sub == FAULT else 1)
    end_of_fault(hanging)
    assert hanging.loop.life.reason == reason
    notes = [note for note in hanging.status()["notices"] if note.startswith("also: ")]
    assert any(named in note and told in note for note in notes), notes


def test_a_cable_slack_after_landing_is_reported_as_possibly_broken(hanging: LockstepRobot) -> None:
    hanging.inject(UPPER_LEFT, FAULT, 0x7305)  # the platform swings down on the other upper cable
    end_of_fault(hanging)
    notes = [note for note in hanging.status()["notices"] if "seems broken" in note]
    assert notes
    assert all("or the platform landed" in note for note in notes)


def test_a_slip_of_the_only_carrying_cable_is_detected(tmp_path: Path) -> None:
    path = tmp_path / "one.toml"
    path.write_text(ONE_CARRIES)
    with local_robot(path) as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        robot.carry_out("pose", 30.0, position_m=[0.0, 0.0, 0.65])
        assert 0.0 < robot.run(0.5)["lengths_disagree_m"].max() < 1e-3
        robot.inject(3, SLIP, 25)
        end_of_fault(robot)
        assert robot.state is LoopState.FAULT
        told = robot.loop.life.reason
        assert told.startswith("the cables' lengths suddenly changed relative to each other by ")
        assert "axis 4" in told


@pytest.mark.parametrize("slip_mm", [60, 30])
def test_a_slip_of_one_of_eight_cables_is_detected(tmp_path: Path, slip_mm: int) -> None:
    """A large slip shows in the tension, a small one in the lengths of a calibrated robot."""
    path = slower_robot(tmp_path, "spatial-8", 0.002)
    if slip_mm < 60:
        file = load_robot(path)
        right = {"drum_scales": (1.0,) * 8, "elongation_scale": 1.0, "home_m": file.platform.home_m}
        take_over(file, calibration(file, move_m=0.0).model_copy(update=right))
    with local_robot(path) as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        assert 0.0 < robot.run(0.3)["lengths_disagree_m"].max() < 1e-3
        robot.inject(1, 13, slip_mm)
        end_of_fault(robot)
        assert robot.state is LoopState.FAULT
        told = robot.loop.life.reason
        if "the cables' lengths disagree by" in told:
            assert "axis 2" in told
            assert told.startswith(("the cables", "axis 2: "))  # no wrong cable is named
        else:
            assert told.startswith("axis 2: the cable seems broken or has slipped")


def test_power_is_rejected_if_cable_lengths_cannot_be_stored(planar: Path) -> None:
    with local_robot(planar) as robot:
        last = robot.loop.engine.parts.last_stop
        last.path = Path("/proc/nowhere/cdpr-rt/lengths.planar-3.json")
        told = r"/proc/nowhere/cdpr-rt: is not writable, .* XDG_STATE_HOME"
        with pytest.raises(Refused, match=told):
            robot.enable()
        assert robot.machine.unpowered()
        last.path = None
        robot.enable()


def test_a_failing_lower_program_ends_with_power_off(hanging: LockstepRobot) -> None:
    def mistaken(*_: object) -> None:
        raise ValueError("a mistake")

    lower = hanging.loop.engine.parts.programs["lower"]
    lower.update = mistaken  # type: ignore[method-assign]
    begun_s = hanging.now_s
    with pytest.raises(Error):
        hanging.command("disable")
    hanging._turn_until(lambda: not hanging.loop.busy, 10.0, "the power off")
    assert hanging.now_s - begun_s < 5.0
    assert hanging.state is LoopState.FAULT
    assert hanging.loop.life.reason.startswith("program lower: ValueError: a mistake")
    assert hanging.machine.unpowered()


def test_a_platform_not_at_rest_after_lowering_ends_in_a_fault(hanging: LockstepRobot) -> None:
    lower = hanging.loop.engine.parts.programs["lower"]
    progress = lower.progress
    lower.progress = lambda: progress() | {"trouble": "not at rest"}  # type: ignore[method-assign]
    hanging.block.post_command({"do": "disable", "client": "test"})
    end_of_fault(hanging)
    assert hanging.state is LoopState.FAULT
    assert "not at rest" in hanging.loop.life.reason
    assert hanging.machine.unpowered()


def test_a_winch_that_does_not_obey_cannot_drag_the_platform_off_its_stand(
    hanging: LockstepRobot,
) -> None:
    truth = Truth(hanging)
    hanging.simulator.inject("torque-stuck", UPPER_RIGHT + 1)
    hanging.block.post_command({"do": "disable", "client": "test"})
    end_of_fault(hanging)
    assert "upper right wound in" in hanging.loop.life.reason
    hanging.run(0.5)
    assert np.linalg.norm(truth.read()["position_m"][-1, :2] - (0.0, 1.3)) < 0.06


def test_a_drive_lost_while_the_platform_is_set_down_does_not_fling_it_up(
    hanging: LockstepRobot,
) -> None:
    hanging.block.post_command({"do": "disable", "client": "test"})
    lower = hanging.loop.engine.parts.programs["lower"]
    hanging._turn_until(lambda: lower.progress().get("stage") == "down", 20.0, "home")
    truth = Truth(hanging)
    hanging.inject(LOWER, 1, 0x7305)
    assert speed_at_power_off_m_s(hanging, truth) < 0.02
    assert truth.read()["position_m"][:, 1].max() < 1.3 + 0.05


def test_drives_that_are_all_silent_for_too_many_cycles_lower_the_platform(
    hanging: LockstepRobot,
) -> None:
    truth = Truth(hanging)
    tolerated = limits_of(hanging.robot).missed_cycles
    for axis in range(3):
        hanging.inject(axis, 2, 2 * (tolerated + 2))  # two TPDOs per cycle
    hanging.run(0.1)
    assert hanging.machine.powered()
    assert speed_at_power_off_m_s(hanging, truth) < 0.02
    assert -truth.read()["velocity_m_s"][:, 1].min() < 0.45


def test_the_platform_is_held_when_the_hand_disappears_in_motion(hanging: LockstepRobot) -> None:
    hanging.program("pose", position_m=[-0.4, 2.1], speed_m_s=0.2)
    hanging.run(0.5)
    hanging.right.fall_silent()
    hanging.until(lambda: hanging.loop.engine.program.name == "hold", 5.0)
    assert "nobody holds the right to move" in hanging.loop.life.reason
    hanging.run(1.0)
    truth = Truth(hanging)
    hanging.run(0.5)
    records = truth.read()
    assert np.linalg.norm(records["velocity_m_s"], axis=1).max() < 0.01
    assert records["tension_N"].min() > 10.0  # of the planned 20 N
    assert hanging.progress["tight"]
    # the old reason disappears when a hand moves the platform again
    hanging.run(4.0)
    hanging.right.take("trial")
    hanging.carry_out("pose", 30.0, position_m=list(HIGH))
    assert hanging.loop.life.reason == ""


def test_cable_lengths_that_contradict_the_index_are_neither_used_nor_stored(
    hanging: LockstepRobot, tmp_path: Path
) -> None:
    robot = hanging
    last, machine = robot.loop.engine.parts.last_stop, robot.loop.engine.parts.estimator
    assert last is not None
    last.path = tmp_path / "lengths.json"
    robot.carry_out("lower", 30.0)
    robot.command("disable")
    machine.forget_lengths()
    last.take()
    last.load(3, 3.0)
    assert last.lengths is not None
    # as if a motor had been turned by hand by 44 degrees, 20 mm of cable
    turned_m = np.array([0.0, 0.02, 0.0])
    elsewhere = last.lengths.cable_at_index_m + turned_m
    last.lengths = replace(last.lengths, cable_at_index_m=elsewhere)
    robot.enable()
    told = "upper right: its motor's index is 20.* mm from its place at the last stop"
    with pytest.raises(Error, match=told):
        robot.carry_out("tighten", 30.0, **{"from": "last"})
    robot.run(3.0)  # the robot is at rest and has not carried out the command
    assert robot.progress["done"] == 0.0
    assert robot.status()["failure"].startswith("tighten: upper right: its motor's index is 20")
    with pytest.raises(Error, match=told):
        robot.program("pose", position_m=list(HIGH))
    with pytest.raises(Error, match=told):
        robot.program("tighten")
    robot.carry_out("lower", 30.0)
    with pytest.raises(Error, match=told):
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


def test_a_stop_lowers_the_platform_and_stores_lengths_for_the_next_start(
    hanging: LockstepRobot, tmp_path: Path
) -> None:
    robot = hanging
    last, platform = robot.loop.engine.parts.last_stop, robot.robot.platform
    assert last is not None
    assert platform is not None
    last.path = tmp_path / "lengths.json"
    robot.carry_out("lower", 30.0, blind=True)  # beside its previous position
    robot.command("disable")
    assert robot.state is LoopState.READY
    # as if daemon and drives had been without power
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
