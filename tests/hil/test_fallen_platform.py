"""`tighten` after power was cut immediately while the platform was suspended."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_rt.core.states import LoopState
from cdpr_rt.robot import Refused
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.recordings.truth import read_pose_log
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot

LOOSE_N, TAKES_UP_N = 15.0, 40.0
"""Tension of an inactive winch, and tension to take up slack, both with friction."""


def turned_deg(robot: LockstepRobot) -> float:
    angle_rad = Rotation.from_matrix(np.reshape(robot.truth()["rotation"], (3, 3))).magnitude()
    return float(np.degrees(angle_rad))


def highest_N(robot: LockstepRobot, since: int) -> float:
    log = read_pose_log(robot.truth_log)
    return float(log["tension_N"][log["sync_index"] >= since].max())


@pytest.fixture(scope="module")
def tight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LockstepRobot]:
    with local_robot(slower_robot(tmp_path_factory.mktemp("tight"), "spatial-8")) as robot:
        robot.enable()
        robot.carry_out("tighten")
        yield robot


def fall(robot: LockstepRobot, position_m: list[float], rotation_rad: list[float]) -> None:
    """Let the platform fall from the given pose, and give the robot power again."""
    robot.carry_out("pose", position_m=position_m, rotation_rad=rotation_rad)
    robot.loop.request_power_off()
    robot.run(3.0)
    assert robot.state is LoopState.FAULT
    robot.command("acknowledge")
    robot.enable()


def test_tighten_does_not_pull_at_a_platform_that_has_turned_over(tight: LockstepRobot) -> None:
    fall(tight, [-0.45, -0.3, 1.7], [0.18, 0.18, 0.0])
    assert turned_deg(tight) > 60.0
    with pytest.raises(Refused, match="It has come down, may have turned over"):
        tight.program("tighten")
    since = tight.cycle + tight.machine.sync_offset
    with pytest.raises(Refused, match=r"\d cables are up to \d+ mm too short"):
        tight.program("tighten", **{"from": "home"})
    tight.run(0.5)
    assert highest_N(tight, since) < LOOSE_N
    tight.program("tighten", **{"from": "lengths"})
    tight.finish(120.0)  # each cable is reeled in separately by decimetres at 50 mm/s
    assert re.search(
        r"turned by \d+ deg.*: the cables are not tightened", tight.progress["trouble"]
    )
    assert tight.progress["stage"] == "slack" and not tight.progress["tight"]
    assert highest_N(tight, since) < TAKES_UP_N


def test_tighten_from_lengths_finds_a_platform_that_landed_upright(tight: LockstepRobot) -> None:
    # 15 cm above the stand: from higher up it may tip over
    fall(tight, [0.15, 0.5, 1.45], [0.2, 0.0, 0.0])
    assert turned_deg(tight) < 20.0  # in use, the platform may be turned by 15 degrees
    assert tight.status()["last_stop"]["fallen"]
    with pytest.raises(Refused, match="allowed: from home, lengths"):
        tight.program("tighten")
    last = tight.loop.engine.parts.last_stop
    assert last is not None
    last.broken[0] = "axis 1: the cable seems broken"
    assert any(": repair it, then" in notice for notice in tight.status()["notices"])
    tight.carry_out("tighten", **{"from": "lengths"})
    assert tight.progress["tight"], tight.progress["trouble"]
    assert not tight.status()["last_stop"]["fallen"]
    assert not any(": repair it, then" in notice for notice in tight.status()["notices"])
    here_m, true_m = tight.progress["position_m"], tight.truth()["position_m"]
    assert here_m == pytest.approx(np.ravel(true_m), abs=0.01)
    tight.carry_out("lower")
    tight.program("tighten")  # at home again, `from` is not needed


def test_tighten_from_lengths_keeps_a_suspended_platform_in_place(tmp_path: Path) -> None:
    position_m = [1.5, 1.0, 1.5]
    with local_robot(slower_robot(tmp_path, "suspended-8")) as robot:
        robot.enable()
        robot.carry_out("tighten")
        robot.carry_out("pose", position_m=position_m)
        engine = robot.loop.engine
        # each winch holds its cable separately, as by brakes
        engine.parts.programs["tighten"]._parts.slacken()  # type: ignore[attr-defined]
        engine.switch("hold")
        robot.run(0.5)
        known = engine.parts.estimator
        length_m = known.estimate.cable_length_m.copy()
        slipped_m = np.eye(8)[0] * 0.3
        known.set_lengths(known.position_rad, length_m + slipped_m)
        with pytest.raises(Refused, match=r"disagree by .* each winch holds its cable; lower"):
            robot.program("tighten", **{"from": "lengths"})
        robot.run(0.5)
        assert np.ravel(robot.truth()["position_m"]) == pytest.approx(position_m, abs=0.01)
        known.set_lengths(known.position_rad, known.estimate.cable_length_m - slipped_m)
        robot.program("tighten", **{"from": "lengths"})
        for _ in range(20):
            robot.run(0.05)
            assert np.ravel(robot.truth()["position_m"]) == pytest.approx(position_m, abs=0.01)
        assert robot.progress["tight"], robot.progress["trouble"]


def test_tighten_is_rejected_after_all_drives_lost_power_together(tight: LockstepRobot) -> None:
    tight.carry_out("pose", position_m=[-0.4, 0.5, 1.7])
    for axis in range(8):
        tight.inject(axis, 1, 0x3220)
    tight._turn_until(lambda: tight.loop.busy, 3.0, "a reaction")
    tight._turn_until(lambda: not tight.loop.busy, 60.0, "the power off")
    assert tight.state is LoopState.FAULT
    tight.command("acknowledge")
    tight.enable()
    with pytest.raises(Refused, match="It has come down, may have turned over"):
        tight.program("tighten")
