"""Tight cables that press the platform on its stand are handed over to its control."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.tighten import LettingGo
from tests.cdpr_rt.programs.ideal_platform import ROOM, IdealPlatform
from tests.cdpr_rt.programs.standing_robot import PERIOD_S, Standing


def handing_over(robot: Standing, source: str | None = None) -> Standing:
    """Tighten up to the release of the force that presses on the stand."""
    robot.switch("tighten", {"from": source} if source else {})
    for _ in range(2000):
        robot.run(0.01)
        if robot.program.progress()["stage"] == "held":
            assert not robot.parts.tight
            return robot
    raise AssertionError("not tight")


def test_the_platform_is_not_moved_before_it_is_released(robot: Standing):
    handing_over(robot)
    with pytest.raises(ProgramError, match="the cables are not tight; run tighten first"):
        robot.programs["pose"].check({"stream": True})
    steps_Nm = []
    while not robot.parts.tight:
        before_Nm = robot.torque.copy()
        robot.run(PERIOD_S)
        steps_Nm.append(np.abs(robot.torque - before_Nm).max())
    assert 0.4 < len(steps_Nm) * PERIOD_S < 0.6
    assert max(steps_Nm) < 0.1
    here = robot.parts.control
    assert here.position == pytest.approx(here.estimated, abs=1e-4)
    assert robot.until_done(10.0)["done"]


def test_a_stop_while_handing_over_ends_with_tight_cables(robot: Standing):
    handing_over(robot)
    robot.program.stop()
    robot.run(0.7)
    assert robot.program.at_rest
    assert robot.parts.tight


def switch_power_off(robot: Standing) -> None:
    """Switch power off as a safe stop does, without the program."""
    robot.program = robot.programs["idle"]
    robot.program.start(robot.feedback, robot.setpoint, robot.torque)
    robot.run(0.05)


def test_a_displaced_platform_stays_displaced_after_an_early_end(robot: Standing):
    robot.parts.last_stop.displaced = True
    handing_over(robot, "home")
    switch_power_off(robot)
    assert robot.parts.last_stop.displaced
    assert handing_over(robot, "home").until_done(10.0)["done"]
    assert not robot.parts.last_stop.displaced


def test_a_hanging_platform_is_checked_again_after_an_early_end(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
):
    looked = []

    def hangs(parts: PlatformParts) -> bool:
        looked.append(parts)
        return False

    monkeypatch.setattr("cdpr_rt.programs.standing.hangs", hangs)
    handing_over(robot)
    looked.clear()
    robot.program.check({"from": "lengths"})
    assert not looked
    switch_power_off(robot)
    robot.programs["tighten"].check({"from": "lengths"})
    assert looked


@pytest.mark.parametrize("name", ["hold", "lower", "tighten"])
def test_other_programs_take_over_while_handing_over_without_a_step(robot: Standing, name: str):
    handing_over(robot)
    before_Nm, lengths_m = robot.torque.copy(), robot.estimator.estimate.cable_length_m.copy()
    robot.switch(name)
    robot.run(0.003)
    assert robot.torque == pytest.approx(before_Nm, abs=0.15)
    assert robot.estimator.estimate.cable_length_m == pytest.approx(lengths_m, abs=1e-3)
    robot.run(12.0)
    assert robot.parts.tight == (name == "tighten")
    if name == "lower":
        assert robot.program.at_rest
        assert not robot.torque.any()


@pytest.mark.parametrize(
    ("slack_m_s", "told"), [(4.0, "its winch winds in"), (0.04, "disagree by")]
)
def test_a_slack_cable_ends_the_handover_and_lengths_are_forgotten(
    robot: Standing, slack_m_s: float, told: str
):
    """Its winch is stopped before it runs away, and lengths are unknown afterwards."""
    handing_over(robot)
    fastest_m_s = 0.0
    while not robot.program.progress()["trouble"]:
        robot.slack_m[1] += slack_m_s * PERIOD_S
        robot.run(PERIOD_S)
        fastest_m_s = max(fastest_m_s, np.abs(robot.speed * robot.cable_m).max())
        assert not robot.parts.tight
    assert told in robot.program.progress()["trouble"]
    robot.run(1.0)
    assert robot.program.at_rest
    assert not robot.torque.any()
    assert fastest_m_s < 1.0
    assert not robot.parts.tight and not robot.parts.pose_known


@pytest.mark.parametrize(("up_m", "told"), [(0.0, False), (0.003, False), (0.02, True)])
def test_lengths_that_agree_away_from_home_give_a_notice(
    robot: Standing, up_m: float, told: bool
) -> None:
    """If all cables are equally slack, their lengths contradict only the stand."""
    handing_over(robot)
    model = robot.parts.model
    shorter_m = up_m * model.kinematics.wrench_matrix(model.home_pose)[1]
    for _ in range(400):
        robot.slack_m += shorter_m / 400
        robot.run(PERIOD_S)
    assert robot.until_done(10.0)["done"]
    notices = robot.parts.notices()
    assert bool(notices) is told
    if told:
        off_mm = float(notices[0].split("the platform is ")[1].split(" mm")[0])
        assert off_mm == pytest.approx(1e3 * up_m, abs=3.0)
    robot.loosen((0.0, 0.0, 0.0))
    handing_over(robot).until_done(10.0)
    assert not robot.parts.notices()


def test_a_rotation_counts_as_off_home_by_the_displacement_of_anchor_points():
    ideal = IdealPlatform(ROOM, 10.0, 6000.0)
    ideal.control.position[:] = ideal.model.home
    letting_go = LettingGo(ideal.parts, np.full(8, -0.01), np.full(8, 300.0))
    ideal.control.off[5] = np.radians(0.2)  # 2 mm at the anchor points
    assert not letting_go.off_home()
    ideal.control.off[5] = np.radians(4.0)
    told = letting_go.off_home()
    assert "the platform is 0 mm from there, turned by 4.0 deg" in told
    ideal.control.off[:] = 0.0, 0.0, 0.02, 0.0, 0.0, 0.0
    assert "the platform is 20 mm from there, turned by 0.0 deg" in letting_go.off_home()


def test_the_off_home_notice_ends_once_lengths_agree_elsewhere() -> None:
    ideal = IdealPlatform(ROOM, 10.0, 6000.0)
    parts, control = ideal.parts, ideal.control
    parts.tight = True
    parts.off_home, parts.off_home_by[:3] = "off", (0.0, 0.2, 0.0)
    control.position[:] = parts.model.home
    assert parts.notices() == ["off"], "at home the notice stays"
    low, high = parts.platform.workspace_min_m, parts.platform.workspace_max_m
    control.position[:3] = high[0], high[1], low[2]
    control.residual_m = 0.02
    assert parts.notices() == ["off"]
    control.residual_m = 0.001
    assert parts.notices() == []
