"""Orders for faults beside the bus: at their bus time, the same bytes each time, with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.states import LoopState
from cdpr_tools.errors import BadInputError
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.recordings.truth import read_pose_log

AXIS, LIMIT = 2, 10
"""Axis from 1, and the missed answers in a row that planar-3 bridges."""


def disturbed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[list[bytes], Any]:
    """Return the logs of a run with scheduled faults, and the records of the faults."""
    folder.mkdir()
    monkeypatch.setenv("CDPR_SIM_FRAME_LOG", str(folder / "frames.log"))
    with LockstepRobot("planar-3", truth_log=folder / "truth.bin") as robot:
        robot.enable()
        simulator, at_s = robot.simulator, robot.machine.clock.now_s + 0.0503
        for fault, value, after_s in (("encoder-noise", 30, 0.0), ("frames-lossy", 20, 0.01)):
            order = simulator.inject(fault, AXIS, value, at_s=at_s + after_s)
            assert (order["axis"], order["value"]) == (AXIS, value)
        simulator.inject("mend", at_s=at_s + 0.15)
        assert simulator.broken() == []
        robot.run(0.1)
        assert {one["fault"] for one in simulator.broken()} == {"encoder-noise", "frames-lossy"}
        robot.run(0.2)
        assert simulator.broken() == []
        faults = simulator.truth()["faults"]
        times = [(one["at_s"] - at_s, one["ended_s"] - at_s) for one in faults]
        assert times == [pytest.approx((0.0, 0.15)), pytest.approx((0.01, 0.15))]
    return [path.read_bytes() for path in sorted(folder.iterdir())], faults


def test_scheduled_faults_act_at_their_time_and_give_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, again = (disturbed(tmp_path / name, monkeypatch) for name in "ab")
    assert first == again
    truth = read_pose_log(tmp_path / "a" / "truth.bin")
    assert truth["power_on"].max(axis=0).all() and not truth["power_on"][0].any()
    assert np.isfinite(truth["motor_rad_s"]).all()


def test_missed_answers_are_bridged_up_to_the_limit_and_named_beyond_it() -> None:
    with LockstepRobot("planar-3") as robot:
        robot.enable()
        engine, simulator = robot.loop.engine, robot.simulator
        before = engine.missed
        simulator.inject("frames-lost", AXIS, LIMIT)
        rows = robot.run(0.1)
        assert robot.state is LoopState.ACTIVE, robot.state_text()
        assert engine.missed == before + LIMIT
        assert rows["missed"].sum() == LIMIT or rows["missed"].max() > 0
        simulator.inject("frames-lost", AXIS, LIMIT + 1)
        robot.run(0.1)
        (fault,) = robot.status()["faults"]
        assert (fault["limit"], fault["axis"]) == (Limit.MISSED.name.lower(), AXIS - 1)
        # the loop is dead, the simulator is not
        robot.die(1.0)
        truth = simulator.truth()
        assert truth["time_s"] == pytest.approx(robot.machine.clock.now_s, abs=0.02)
        assert not any(one["power_on"] or one["torque_Nm"] for one in truth["drives"])
        for order, reason in (
            (("nothing",), "fault 'nothing'; allowed: drive-off"),
            (("slip", 7), "axis 7; allowed: 1 to 3"),
            (("push-z",), "push-z: the robot has no platform in space"),
            (("slip", 1, 1, 0.0), "at_s 0.0; allowed: bus times from now"),
        ):
            with pytest.raises(BadInputError, match=reason):
                simulator.inject(*order)


def test_a_robot_without_a_platform_has_a_truth_and_its_log() -> None:
    with LockstepRobot("bench-2") as robot:
        robot.enable()
        robot.run(0.1)
        assert robot.simulator.truth()["platform"] is None
        assert robot.truth()["power_on"].tolist() == [1.0, 1.0]
        robot.simulator.inject("power-lost", 2)
        robot.run(0.1)
        assert robot.truth()["power_on"][1] == 0.0
        with pytest.raises(BadInputError, match="cut-cable: the robot has no cable"):
            robot.simulator.inject("cut-cable", 1)
