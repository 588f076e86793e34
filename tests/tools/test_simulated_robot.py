"""The Python interface on simulated drives: commands, state, log, errors."""

from __future__ import annotations

import copy
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdpr_rt as cdpr
from cdpr_rt.refusal import RefusalCode
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.lockstep_robot import LockstepRobot


@pytest.fixture(scope="module")
def robot(planar_file: Path) -> Iterator[cdpr.Robot]:
    with cdpr.simulate(planar_file) as opened:
        opened.enable()
        opened.tighten()
        opened.move_to([0.0, 1.8])
        yield opened


def test_importing_the_interface_loads_neither_numpy_nor_drivers() -> None:
    code = "import sys, cdpr_rt; print({'numpy', 'cdpr_tools', 'cdpr_drivers'} & set(sys.modules))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "set()"
    assert set(cdpr.__all__) <= set(dir(cdpr))


def test_a_move_ends_at_its_target_and_is_recorded(robot: cdpr.Robot) -> None:
    begun_s = robot.time_s
    robot.move_to([0.2, 1.9], speed_m_s=0.4)
    assert robot.state == "active"
    assert robot.position_m == pytest.approx([0.2, 1.9], abs=2e-3)
    assert robot.pose[:3] == pytest.approx([0.2, 1.9, 0.0], abs=2e-3)
    assert np.linalg.norm(robot.pose[3:]) == pytest.approx(1.0)
    assert robot.tension_N.shape == robot.cable_length_m.shape == robot.angle_rad.shape == (3,)
    assert (robot.tension_N > 10.0).all()
    log = robot.log()
    assert log["time_s"][-1] == robot.time_s > begun_s
    assert log["pose"][-1] == pytest.approx(robot.pose)
    assert log["tension_N"].shape == (log.size, 3)
    assert np.diff(log["cycle"]).max() == 1
    table = log[-10:].to_pandas()
    assert table["tension_N[upper left]"].tolist() == log["tension_N"][-10:, 0].tolist()
    assert table["pose[qz]"].iloc[-1] == log["pose"][-1, 6]
    assert table["time_s"].size == 10
    of_field = log["tension_N"][-10:].to_pandas()
    assert list(of_field) == [f"tension_N[{axis}]" for axis in robot.axes]
    assert of_field.equals(table[list(of_field)])
    assert list(log["time_s"].to_pandas()) == ["time_s"]
    for computed in (2.0 * log["pose"], log["pose"][:, :2]):
        with pytest.raises(cdpr.Error, match="to_pandas: these numbers have no field's name"):
            computed.to_pandas()


def test_relative_moves_add_up(robot: cdpr.Robot) -> None:
    robot.move_to([0.0, 1.8])
    robot.move_by([0.1, 0.0])
    robot.move_by([0.0, 0.05], frame="platform")
    assert robot.position_m == pytest.approx([0.1, 1.85], abs=2e-3)
    with pytest.raises(cdpr.Refused, match=r"leads to x 1\.1 m; allowed: -0\.6 to 0\.6 m") as error:
        robot.move_by([1.0, 0.0])
    assert error.value.code is RefusalCode.NOT_FEASIBLE


def test_a_path_of_way_points_is_planned_and_followed(robot: cdpr.Robot, tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_text("x_m,y_m\n0.0,1.7\n0.1,1.75\n")
    robot.follow(file)
    assert robot.position_m == pytest.approx([0.1, 1.75], abs=2e-3)
    file.write_text("x_m,y_m\n0.0,1.7\n0.1,2.45\n")
    with pytest.raises(cdpr.Refused, match=r"points\.csv:3: .*y 2400\.\d+ mm is outside"):
        robot.follow(file)
    with pytest.raises(cdpr.InvalidArgument, match="no such file"):
        robot.follow(tmp_path / "none.csv")


def test_a_platform_follows_a_stream_and_holds_at_its_end(robot: cdpr.Robot) -> None:
    robot.move_to([0.0, 1.8])
    with robot.stream(scale=0.5) as send:
        for k in range(60):
            send([1.0 + 0.002 * k, 0.0])  # only its motion counts
            robot.wait(1.0 / 60.0)
        robot.wait(0.4)
        assert robot.program == "pose"
        with pytest.raises(cdpr.InvalidArgument, match=r"position_m: shape \(3,\); allowed: \(2,"):
            send([0.0, 0.0, 0.0])
    assert robot.program == "hold"
    assert robot.position_m == pytest.approx([0.059, 1.8], abs=2e-3)
    with pytest.raises(cdpr.InvalidArgument, match="scale: 0;"), robot.stream(scale=0):
        pass


def test_wrong_shapes_and_values_move_nothing(robot: cdpr.Robot) -> None:
    for target, message in (
        ([0.1, 1.8, 0.0], r"position_m: shape \(3,\); allowed: \(2,\), one number for each coord"),
        ([0.1, float("nan")], r"position_m\[1\]: nan; allowed: a finite number"),
        (["a", 1.0], r"position_m: \['a', 1\.0\]; allowed: 2 numbers"),
        ([0.0, 1.8 + 1j], r"position_m: .*; allowed: 2 numbers"),
    ):
        with pytest.raises(cdpr.InvalidArgument, match=message):
            robot.move_to(target)
    with pytest.raises(cdpr.InvalidArgument, match=r"rotation_rad: .* has no controlled angle"):
        robot.move_to([0.0, 1.8], [0.1])
    with pytest.raises(cdpr.InvalidArgument, match=r"speed_m_s: -1\.0; allowed: a finite number"):
        robot.move_to([0.0, 1.8], speed_m_s=-1.0)
    with pytest.raises(cdpr.InvalidArgument, match="nothing to move; give position_m or rotation"):
        robot.move_to()
    with pytest.raises(cdpr.Refused, match=r"-0\.6 to 0\.6 m, the workspace$"):
        robot.move_to([9.0, 1.8])
    with pytest.raises(cdpr.Refused, match=r"2000\.0; allowed: .*; position_m is in metres"):
        robot.move_to([300, 2000])
    with pytest.raises(cdpr.Refused, match=r"0\.6 m, the workspace; distance_m is in metres"):
        robot.move_by([100, 0])
    with pytest.raises(cdpr.Refused, match=r"program: .dance.; allowed: idle, hold"):
        robot.run("dance")
    with pytest.raises(cdpr.Refused, match="has a platform; use move_to or move_by"):
        robot.turn_by([0.1, 0.1, 0.1])
    wrong: Any
    for wrong in (-1.0, float("nan"), "long"):
        for method in (robot.wait, robot.observe):
            with pytest.raises(
                cdpr.InvalidArgument, match=r"seconds: .*; allowed: a finite number"
            ):
                method(wrong)
    for wrong in ({0.0, 1.8}, [0.0, float("nan")]):
        with pytest.raises(cdpr.InvalidArgument, match=r"position_m: .*; allowed: texts, finite"):
            robot.run("pose", position_m=wrong)
    for wrong in (1j, np.zeros((0, 3)), {1}):
        for call in (robot.run, lambda fault: robot.inject_fault(0, fault)):
            with pytest.raises(cdpr.Error, match=r"allowed: "):
                call(wrong)
    robot.run("pose", position_m=robot.position_m)  # an array is a list of numbers
    for wrong in ("pos", ["time_s", "pose"]):
        with pytest.raises(cdpr.InvalidArgument, match=r"fields: \[.*\]; allowed: cycle, time_s"):
            robot.log(wrong)
    assert robot.log("pose", "time_s", "pose").dtype.names == ("pose", "time_s")
    robot.inject_fault(np.argmin(robot.tension_N), "mend")


def interrupt_turn(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Send Ctrl-C during the given run of cycles from now on."""
    turn, turns = LockstepRobot.turn, count(1)

    def interrupted(self: LockstepRobot, cycles: int = 1) -> None:
        if next(turns) == number:
            os.kill(os.getpid(), signal.SIGINT)
        turn(self, cycles)

    monkeypatch.setattr(LockstepRobot, "turn", interrupted)


@pytest.mark.parametrize(
    "wait",
    [
        lambda robot: robot.wait_until_done(),
        lambda robot: robot.wait(5.0),
        lambda robot: robot.observe(0.5),
        lambda robot: robot.move_to([0.0, 2.1], speed_m_s=0.05, wait=False),
    ],
    ids=["wait_until_done", "wait", "observe", "start"],
)
def test_ctrl_c_holds_a_motion_which_can_be_resumed(
    robot: cdpr.Robot, monkeypatch: pytest.MonkeyPatch, wait: Callable[[cdpr.Robot], None]
) -> None:
    robot.move_to([0.0, 1.8])
    robot.move_to([0.0, 1.9], speed_m_s=0.05, wait=False)
    interrupt_turn(monkeypatch, 1)
    with pytest.raises(KeyboardInterrupt):
        wait(robot)
    assert (robot.state, robot.program) == ("active", "hold")
    robot.resume()
    assert robot.position_m[1] > 1.898


def test_a_motion_is_held_when_an_error_ends_the_wait(
    robot: cdpr.Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot.move_to([0.0, 1.8])

    def failing(_robot: LockstepRobot, _cycles: int = 1) -> None:
        monkeypatch.undo()
        raise WorkFailedError("the drives do not answer")

    robot.move_to([0.0, 1.9], speed_m_s=0.05, wait=False)
    monkeypatch.setattr(LockstepRobot, "turn", failing)
    with pytest.raises(cdpr.Error, match="the drives do not answer"):
        robot.wait_until_done()
    assert (robot.state, robot.program) == ("active", "hold")


def test_a_rejected_motion_does_not_end_the_previous_one(robot: cdpr.Robot) -> None:
    robot.move_to([0.0, 1.8])
    robot.move_to([0.0, 1.9], wait=False)
    with pytest.raises(cdpr.Refused):
        robot.move_to([9.0, 1.8])
    robot.wait_until_done()
    assert robot.position_m == pytest.approx([0.0, 1.9], abs=2e-3)


def test_a_handle_cannot_be_copied(robot: cdpr.Robot) -> None:
    with pytest.raises(TypeError, match="open it in the process that uses it"):
        copy.deepcopy(robot)


def test_wait_runs_exactly_the_requested_time(
    robot: cdpr.Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    turn, passes = LockstepRobot.turn, list[int]()

    def counted(self: LockstepRobot, cycles: int = 1) -> None:
        passes.append(cycles)
        turn(self, cycles)

    monkeypatch.setattr(LockstepRobot, "turn", counted)
    begun_s = robot.time_s
    robot.wait(1.0)
    assert len(passes) == 10
    robot.wait(0.24)
    assert robot.time_s - begun_s == pytest.approx(1.24)


def test_a_drive_fault_ends_a_move_and_can_be_acknowledged(planar_file: Path) -> None:
    with cdpr.simulate(planar_file) as robot:
        with pytest.raises(cdpr.Refused, match=r"call enable\(\) first") as refused:
            robot.move_to([0.0, 1.8])
        assert refused.value.code is RefusalCode.NOT_IN_STATE
        robot.enable()
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 2.0], wait=False)
        robot.inject_fault("lower", "drive-fault")
        with pytest.raises(cdpr.Faulted, match="lower") as fault:
            robot.wait_until_done()
        assert fault.value.limit == "drive"
        assert robot.state == "fault"
        robot.acknowledge()
        assert robot.state == "ready"
        robot.enable()
        with pytest.raises(cdpr.InvalidArgument, match="fault 'rust'; allowed: "):
            robot.inject_fault(0, "rust")
        robot.shut_down()
        with pytest.raises(cdpr.NotRunning, match="the simulation has ended"):
            robot.enable()


def test_axes_of_a_robot_without_a_platform_turn_and_jog() -> None:
    usable = os.sched_getaffinity(0)
    with cdpr.simulate("bench-2") as robot:
        assert os.sched_getaffinity(0) == usable
        assert robot.log().size == 0
        robot.disable()
        robot.enable()
        begun = robot.angle_rad
        robot.turn_by([1.0, np.nan])
        assert robot.angle_rad - begun == pytest.approx([1.0, 0.0], abs=0.02)
        robot.jog([0.0, 1.0], duration_s=0.5)
        robot.wait(0.5)
        assert robot.angle_rad - begun == pytest.approx([1.0, 0.5], abs=0.05)
        per_rad = [axis["cable_m_per_motor_rad"] for axis in robot.description["axes"]]
        robot.pay_out([-per_rad[0], 0.0])
        robot.jog_cable([0.0, -per_rad[1]], duration_s=0.5)
        robot.wait(0.5)
        assert robot.angle_rad - begun == pytest.approx([0.0, 0.0], abs=0.05)
        seen: list[str] = []
        robot.on_status = lambda status: seen.append(status["program"])
        robot.turn_by([0.1, 0.0])
        assert set(seen) == {"pid"}
        assert robot.log("time_s", "torque_actual_Nm").dtype.names == ("time_s", "torque_actual_Nm")
        with pytest.raises(cdpr.InvalidArgument, match=r"fields: .*'time'.* allowed: cycle"):
            robot.log("time")
        assert robot.observe(0.0).size == 2
        with pytest.raises(cdpr.Refused, match="has no platform; use turn_to"):
            robot.move_to([0.0, 1.8])
        observed = robot.observe(0.1)
        assert np.diff(observed["time_s"]).sum() == pytest.approx(0.1, abs=0.01)
        assert robot.pose == pytest.approx(np.full(7, np.nan), nan_ok=True)


def test_a_single_winch_is_a_robot_with_one_axis() -> None:
    with cdpr.simulate("winch-mpp0923d") as robot:
        robot.enable()
        begun = robot.angle_rad
        robot.turn_by([0.2])
        assert robot.angle_rad - begun == pytest.approx([0.2], abs=0.02)
        with pytest.raises(cdpr.InvalidArgument, match=r"true_pose: .* has no platform"):
            _ = robot.true_pose


def test_two_simulations_of_one_script_give_the_same_rows() -> None:
    logs = []
    for _ in range(2):
        with cdpr.simulate("bench-2") as robot:
            robot.enable()
            robot.turn_by([0.5, -0.5])
            logs.append(robot.log())
    for name in ("time_s", "position_rad", "torque_sent_Nm", "statusword"):
        np.testing.assert_array_equal(logs[0][name], logs[1][name])


def test_an_unknown_robot_and_a_missing_daemon_raise_specific_errors() -> None:
    with pytest.raises(cdpr.InvalidRobot, match="no-such-robot"):
        cdpr.simulate("no-such-robot")
    with pytest.raises(cdpr.InvalidRobot, match="no profile named 'planar-33'; did you mean"):
        cdpr.connect("planar-33")
    with pytest.raises(cdpr.NotRunning, match="`cdpr run ROBOT` starts one"):
        cdpr.connect("suspended-8")
    assert issubclass(cdpr.NotRunning, cdpr.Error) and issubclass(cdpr.InvalidArgument, ValueError)


def test_a_failed_start_leaves_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plant, temporary = tmp_path / "plant.toml", tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    plant.write_text("nonsense = 1\n")
    with pytest.raises(cdpr.InvalidRobot, match="nonsense: unknown key"):
        cdpr.simulate("planar-3", plant=plant)
    with pytest.raises(cdpr.InvalidArgument, match="tension_distribution"):
        cdpr.simulate("planar-3", tension_distribution=3)  # type: ignore[arg-type]
    assert not list(temporary.iterdir())
