"""Tightening and lowering, on winches whose cables end at a fixed platform."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.control.winch_speed_loop import SPARE_m
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.model.robot_arrays import limits_of, winches_of
from cdpr_rt.model.statics import statics_of
from cdpr_rt.programs import lower as lower_module
from cdpr_rt.programs import slack as slack_module
from cdpr_rt.programs import tighten as tighten_module
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.registry import platform_parts
from cdpr_rt.programs.tighten import index_path
from tests.cdpr_rt.programs.standing_robot import (
    PERIOD_S,
    ROBOT,
    HOME_m,
    Standing,
    STIFFNESS_N_m,
    home_pretension_N,
)


def tightened(robot: Standing) -> Standing:
    robot.switch("tighten")
    robot.until_done(20.0)
    return robot


def mean_torque_Nm(robot: Standing, cycles: int = 6) -> np.ndarray:
    torques = []
    for _ in range(cycles):
        robot.run(PERIOD_S)
        torques.append(robot.torque.copy())
    return np.mean(torques, axis=0)


def test_tightening_takes_up_slack_and_sets_the_lengths_at_home(robot: Standing):
    assert not robot.parts.pose_known
    tightened(robot)
    assert robot.tension_N.min() > 15.0
    robot.run(0.01)
    known_m = robot.estimator.estimate.cable_length_m
    stiffness_N = ROBOT.axes[0].winch.cable.stiffness_N
    # the springs at the cables' ends have moved since; lengths follow the motors' angles
    moved_m = (robot.tension_N - home_pretension_N(robot.parts)) / STIFFNESS_N_m
    home_m = statics_of(ROBOT).lengths(HOME_m) / (
        1.0 + home_pretension_N(robot.parts) / stiffness_N
    )
    assert known_m + moved_m == pytest.approx(home_m, abs=3e-4)


def test_tensions_grow_together_and_no_cable_is_jerked(robot: Standing):
    robot.switch("tighten")
    full_N = home_pretension_N(robot.parts)
    shares, uneven_N = [], []
    while not robot.parts.tight:
        robot.run(0.002)
        shares.append((robot.tension_N / full_N).max())
        uneven_N.append(
            robot.tension_N[0] - robot.tension_N[1]
        )  # the difference would pull the platform sideways
    assert 1.2 < max(shares[:-1]) < 1.7
    # friction of 0.3 on a stand pressed with twice the weight holds 15.8 N
    assert np.abs(uneven_N[:-1]).max() < 15.0


def test_a_second_tightening_takes_up_slack_like_the_first(monkeypatch: pytest.MonkeyPatch):
    """The tensions at the end of the previous tightening make no cable tight."""
    monkeypatch.setattr(slack_module, "_STAND_FRICTION", 0.0)  # all cables are reeled in together
    robot = Standing()
    for slack_m in ((0.02, 0.015, 0.03), (0.06, 0.055, 0.07)):
        robot.loosen(slack_m)
        robot.switch("tighten")
        assert not robot.until_done(20.0)["trouble"]


def test_cables_already_under_tension_never_exceed_the_pretension(robot: Standing):
    robot.loosen((0.0, 0.0, 0.0))
    full_N = home_pretension_N(robot.parts)
    robot.torque[:] = -full_N * robot.cable_m
    robot.switch("tighten")
    high_N = robot.program._winches.high_N  # type: ignore[attr-defined]
    for _ in range(100):
        robot.run(PERIOD_S)
        assert (high_N <= full_N + 1e-9).all()


def test_tensions_change_without_a_step_to_those_of_the_actual_position(robot: Standing):
    model = robot.parts.model
    there = model.pose(np.array([0.8, 1.6]))
    slack_m = robot.slack_m + robot.cable_m * robot.angle
    length_m = model.kinematics.lengths(there) + slack_m
    robot.estimator.set_lengths(robot.feedback.position_rad, length_m)
    robot.run(0.01)
    robot.switch("tighten", {"from": "lengths"})
    high_N = robot.program._winches.high_N  # type: ignore[attr-defined]
    asked_N = []
    while not robot.parts.tight:
        robot.run(PERIOD_S)
        progress = robot.program.progress()
        if progress["stage"] != "slack":
            asked_N.append(high_N.copy())
        assert not progress["trouble"]
    other_N = np.abs(asked_N[-1] - home_pretension_N(robot.parts)).max()
    assert other_N > 5.0
    # from zero to full tension in a second, and from one tension to another in a second
    fastest_N_s = np.max(asked_N) + 1.5 * other_N
    assert np.abs(np.diff(asked_N, axis=0)).max() < fastest_N_s * PERIOD_S


def test_a_broken_cable_is_reported_and_all_cables_are_released(robot: Standing):
    robot.slack_m[1] = 5.0
    robot.switch("tighten")
    told = robot.until_done(60.0)
    assert told["trouble"].startswith("upper right: 1000.0 mm reeled in without becoming tight")
    assert "take up slack by hand; or the platform is not at home: put it there" in told["trouble"]
    assert robot.parts.last_stop.broken == {1: told["trouble"]}
    robot.run(0.5)
    assert robot.program.at_rest
    assert not robot.torque.any()
    assert not robot.parts.tight


@pytest.mark.parametrize("name", ["tighten", "lower"])
def test_tightening_and_lowering_subtract_no_learnt_loss_from_tensions(robot: Standing, name: str):
    """The control's last values do not apply to these programs."""
    if name == "lower":
        tightened(robot)
    control = robot.parts.control
    control.compensation_Nm[:] = control.motor_loss_Nm[:] = control.cogging_Nm[:] = 0.05
    robot.switch(name)
    robot.run(0.5)
    expected_N = np.abs(robot.torque / robot.cable_m)
    assert robot.estimator.estimate.tension_N == pytest.approx(expected_N, abs=2.0)
    assert not control.compensation_Nm.any()


def test_a_jog_tells_that_the_cables_are_not_tight(robot: Standing):
    robot.switch("jog", {"velocity_rad_s": [0.0, 0.0, 0.0], "duration_s": 0.1})
    robot.run(0.2)
    progress = robot.programs["jog"].progress()
    assert progress["tight"] is False and progress["done"] == 1.0


def test_positions_need_tight_cables_and_idle_needs_loose_ones(robot: Standing):
    pose, idle = robot.programs["pose"], robot.programs["idle"]
    with pytest.raises(ProgramError, match="cables are not tight; run tighten first"):
        pose.check({"position_m": [0.0, 1.6]})
    idle.check({})
    tightened(robot)
    pose.check({"position_m": [0.0, 1.6]})
    with pytest.raises(ProgramError, match="hangs on its cables; lower it first"):
        idle.check({})
    with pytest.raises(ProgramError, match="hangs on its cables; lower it first"):
        robot.programs["jog"].check({"velocity_rad_s": [0.0, 0.0, 0.0]})
    robot.parts.slacken()
    robot.switch("hold")
    robot.run(0.1)  # each axis holds its own cable now, as after a stop with brakes
    with pytest.raises(ProgramError, match="may hang on them; lower it first"):
        idle.check({})


def test_a_cable_that_goes_slack_ends_tightening(robot: Standing):
    robot.switch("tighten")
    for _ in range(400):
        robot.run(0.05)
        if robot.program.progress()["stage"] == "pull":
            break
    robot.slack_m[0] += 5.0
    told = robot.until_done(20.0)
    assert told["trouble"].startswith("upper left: 5")
    assert "reeled in without becoming tight" in told["trouble"]


def test_a_cable_that_seemed_broken_is_named_until_all_are_tight(robot: Standing):
    robot.slack_m[0] += 5.0
    robot.parts.last_stop.broken[2] = "lower: the cable seems broken"
    robot.switch("tighten")
    told = robot.until_done(60.0)
    assert told["trouble"].startswith("upper left: 1000.0 mm reeled in without becoming tight")
    assert told["trouble"].endswith(
        "; before that, lower: the cable seems broken: has this been repaired?"
    )
    (notice,) = (text for text in robot.parts.notices() if "repair it" in text)
    assert "upper left: " in notice and "lower: " in notice
    robot.run(0.5)
    robot.slack_m[0] -= 4.0
    tightened(robot)
    assert not robot.parts.last_stop.broken


def test_a_tight_robot_cannot_be_tightened_from_home_again(robot: Standing):
    tightened(robot)
    with pytest.raises(
        ProgramError, match="the cables are already tight; lower the platform first"
    ):
        robot.programs["tighten"].check({"from": "home"})
    robot.programs["tighten"].check({})


def test_a_platform_lowered_blindly_is_not_assumed_to_stand_at_home(robot: Standing):
    tightened(robot)
    robot.switch("lower", {"blind": True})
    robot.run(2.0)
    tighten = robot.programs["tighten"]
    tighten.check({})  # its cables' lengths are known
    robot.estimator.forget_lengths()
    with pytest.raises(ProgramError, match="put it at home; allowed: from home"):
        tighten.check({})
    robot.switch("tighten", {"from": "home"})
    robot.until_done(20.0)
    assert not robot.parts.last_stop.displaced


def test_a_platform_that_cannot_reach_home_is_lowered_where_it_is(robot: Standing):
    tightened(robot)
    robot.switch("lower")
    stuck = robot.programs["lower"]._approach
    robot.programs["lower"]._approach = lambda: False  # type: ignore[attr-defined]
    try:
        robot.run(30.0)
    finally:
        robot.programs["lower"]._approach = stuck  # type: ignore[attr-defined]
    assert robot.program.progress()["blind"]


def test_hold_keeps_axes_before_tightening_and_the_platform_after(robot: Standing):
    assert robot.programs["hold"].pose is None
    tightened(robot)
    # each cycle's torque contains noise of an encoder count
    before_Nm = mean_torque_Nm(robot)
    robot.switch("hold")
    assert mean_torque_Nm(robot) == pytest.approx(before_Nm, abs=0.02)
    assert robot.program.pose is not None
    assert robot.program.pose[:2] == pytest.approx(HOME_m, abs=0.002)


@pytest.mark.parametrize(
    ("wanted", "named"),
    [
        ({"from": "there"}, "from: value 'there'; allowed: home, lengths, last"),
        ({"from": "lengths"}, "lengths are not known; allowed: from home"),
        ({"from": "last"}, "no lengths of the last stop: the lengths at its last stop"),
        ({"to": "home"}, "key 'to'; allowed: from"),
    ],
)
def test_tightening_from_unknown_lengths_is_rejected(
    robot: Standing, wanted: dict[str, str], named: str
):
    robot.parts.last_stop.take()
    robot.parts.last_stop.why = "the lengths at its last stop are not known"
    with pytest.raises(ProgramError, match=named):
        robot.programs["tighten"].check(wanted)


def test_tightening_from_lengths_that_disagree_fails(robot: Standing):
    home_m = robot.parts.control.lengths_at_home(np.full(3, 20.0))
    robot.estimator.set_lengths(robot.feedback.position_rad, home_m + np.array([0.2, 0.0, 0.2]))
    robot.run(0.01)
    robot.switch("tighten", {"from": "lengths"})
    told = robot.until_done(20.0)
    assert "the cables' lengths disagree by" in told["trouble"]
    assert not robot.parts.tight


def test_no_friction_is_learnt_if_lengths_at_home_disagree(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[bool] = []
    monkeypatch.setattr(
        type(robot.parts.control.pull_fit), "begin_learning", lambda _: begun.append(True)
    )
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr("cdpr_rt.programs.standing.disagreement", lambda *_: "disagree")
        robot.switch("tighten", {})
        assert robot.until_done(20.0)["trouble"] == "disagree"
    assert not begun
    tightened(robot)
    assert begun == [True]


def test_lowering_ends_without_torque_and_with_slack_cables_despite_friction(robot: Standing):
    tightened(robot)
    parts, start = robot.parts, robot.angle.copy()
    least_N, high_N = parts.control.least_N, parts.model.high_N
    stretch_m = parts.control.lengths_at_home(least_N) - parts.control.lengths_at_home(high_N)
    expected_m = stretch_m * high_N / (high_N - least_N) + SPARE_m + parts.platform.home_tolerance_m
    robot.switch("lower", {"blind": True})
    assert not robot.programs["lower"].at_rest
    told = robot.until_done(20.0)
    assert told["stage"] == "fade"
    assert robot.program.at_rest
    assert not robot.torque.any()
    assert robot.tension_N.max() < 1e-3
    assert (robot.cable_m * (robot.angle - start) < expected_m + 0.01).all()
    before = robot.angle.copy()
    robot.run(1.0)
    assert np.abs(robot.cable_m * (robot.angle - before)).max() < 0.001


def test_a_broken_cable_does_not_delay_lowering_of_a_standing_platform(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
):
    tightened(robot)
    robot.slack_m[2] += 100.0
    robot.switch("lower", {"blind": True})
    winches = robot.programs["lower"]._winches  # type: ignore[attr-defined]
    update = winches.update

    def trembling(feedback: AxisFeedback, torque_Nm: np.ndarray) -> None:
        update(feedback, torque_Nm)
        winches.tension_N[2] += 8.0 * (feedback.cycle % 50 == 0)  # cogging of the turning motor

    monkeypatch.setattr(winches, "update", trembling)
    robot.until_done(6.0)
    assert np.abs(robot.tension_N[:2]).max() < 12.0


def test_slack_cables_are_not_reeled_in_before_lowering(robot: Standing):
    before = robot.angle.copy()
    robot.switch("lower")
    robot.until_done(20.0)
    assert (robot.cable_m * (robot.angle - before)).min() > -0.002


def test_lowering_after_an_interrupted_one_pays_out_no_slack_cable(robot: Standing):
    tightened(robot)
    robot.switch("lower", {"blind": True})
    robot.run(0.05)
    robot.loosen((0.02, 0.02, 0.02))  # power off
    before = robot.angle.copy()
    robot.switch("lower")
    robot.until_done(20.0)
    assert (robot.cable_m * (robot.angle - before)).max() < 0.002


def test_a_platform_that_keeps_sinking_is_reported_and_counts_as_fallen(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr(lower_module, "_MOST_S", 0.5)
    robot = tightened(Standing())
    robot.switch("lower", {"blind": True})
    told = robot.program.progress()
    for _ in range(1500):
        before = robot.angle.copy()
        robot.run(0.01)
        robot.slack_m -= robot.cable_m * (robot.angle - before)  # it keeps sinking
        told = robot.program.progress()
        if told["done"]:
            break
    assert told["done"]
    assert "did not come to rest within" in told["trouble"]
    assert robot.parts.last_stop.fallen


def test_a_winch_that_does_not_turn_is_reported_and_the_platform_counts_as_fallen() -> None:
    robot = tightened(Standing())
    robot.switch("lower", {"blind": True})
    held_rad, told = robot.angle[2], robot.program.progress()
    for _ in range(20_000):
        robot.run(PERIOD_S)
        robot.angle[2], robot.speed[2] = held_rad, 0.0
        if (told := robot.program.progress())["done"]:
            break
    assert told["done"]
    assert "lower was driven to pay out cable but did not turn" in told["trouble"]
    assert "may fall when the power goes off" in told["trouble"]
    assert robot.parts.last_stop.fallen


def test_a_winch_that_winds_in_during_lowering_is_reported_before_the_power_goes_off() -> None:
    robot = tightened(Standing())
    robot.parts.last_stop.fallen = True  # as after a fault of a hanging platform
    robot.switch("lower", {"blind": True})
    pulled_rad, told = robot.angle[2] - 0.1 / robot.cable_m[2], robot.program.progress()
    for _ in range(20_000):
        robot.run(PERIOD_S)
        robot.angle[2], robot.speed[2] = pulled_rad, 0.0
        if (told := robot.program.progress())["done"]:
            break
    assert told["done"]
    assert "lower wound in 100 mm instead of paying out" in told["trouble"]
    assert "may fall when the power goes off" in told["trouble"]


@pytest.mark.parametrize(
    ("noise_rad", "text"), [(0.0, "its encoder shows no motion"), (0.2, "mostly noise")]
)
def test_tighten_names_a_winch_whose_encoder_has_failed(noise_rad: float, text: str) -> None:
    robot = Standing()
    robot.switch("tighten")
    held_rad, sign = robot.angle[2], 1.0
    for _ in range(20_000):
        robot.run(PERIOD_S)
        robot.angle[2], robot.speed[2], sign = held_rad + sign * noise_rad, 0.0, -sign
        if robot.program.progress()["trouble"]:
            break
    assert robot.program.progress()["trouble"].startswith("lower: ")
    assert text in robot.program.progress()["trouble"]


def test_the_index_path_turns_every_motor_by_a_whole_turn():
    platform = ROBOT.platform
    assert platform is not None
    cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    statics = statics_of(ROBOT)
    way = index_path(statics.model, cable_m, lambda _: True)
    assert len(way) == 1  # lifting the platform is enough
    ends = np.array([platform.home_m, *way])
    assert (np.ptp(statics.lengths(ends), axis=0) > 2.0 * np.pi * np.abs(cable_m)).all()
    # if it may not be lifted far enough, it also moves sideways
    way = index_path(statics.model, cable_m, lambda there: bool(there[1] < 1.5))
    assert len(way) == 3
    assert {float(np.sign(point[0])) for point in way[1:]} == {-1.0, 1.0}
    assert all(point[1] < 1.5 for point in way)


def test_the_set_point_waits_for_a_platform_that_lags_behind(robot: Standing) -> None:
    tightened(robot)
    robot.switch("pose", {"position_m": [0.0, 1.8]})
    robot.run(1.0)
    told = robot.program.progress()
    assert not told["done"] and "behind" in told["held_back"]
    went_m = robot.parts.control.shaped - HOME_m
    assert 0.02 < went_m[1] < 0.1
    robot.run(0.5)
    assert robot.parts.control.shaped[1] - HOME_m[1] - went_m[1] < 0.005
    robot.program.stop()
    robot.run(0.2)
    assert robot.program.at_rest


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "spatial-8"])
def test_the_pretension_at_home_does_not_lift_the_platform(name: str):
    machine = load_robot(name)
    model = model_of(machine.axes, PERIOD_S, [2.3e-3] * len(machine.axes), limits_of(machine))
    estimator = Estimator(len(machine.axes), PERIOD_S, winches_of(machine.axes))
    parts = platform_parts(machine, limits_of(machine), model, estimator)
    assert parts is not None
    t = home_pretension_N(parts)
    pull = parts.model.kinematics.wrench_matrix(parts.model.home_pose) @ t
    weight = parts.model.weight()
    assert (t >= parts.control.least_N - 1e-9).all()
    assert pull @ weight >= -1e-6  # otherwise friction moved spatial-8 by 0.7 mm on its stand
    assert pull == pytest.approx((pull @ weight) / (weight @ weight) * weight, abs=1e-6)


def test_arrival_tolerance_scales_with_the_robot(robot: Standing):
    assert robot.parts.near_m == 5e-4
    large = load_robot("suspended-8")
    n, limits = len(large.axes), limits_of(large)
    model = model_of(large.axes, PERIOD_S, [2.3e-3] * n, limits)
    parts = platform_parts(large, limits, model, Estimator(n, PERIOD_S, winches_of(large.axes)))
    assert parts is not None
    assert parts.near_m == pytest.approx(1.9e-3, abs=1e-4)


# Ends of tightening.

FALL_S = 0.2


def until(robot: Standing, stage: str) -> None:
    robot.switch("tighten")
    while robot.program.progress()["stage"] != stage:
        robot.run(PERIOD_S)


@pytest.mark.parametrize(("stage", "after_s"), [("slack", 0.5), ("pull", 0.02), ("beyond", 0.1)])
def test_a_stop_reduces_all_tensions_without_a_step(
    robot: Standing, stage: str, after_s: float
) -> None:
    until(robot, stage)
    robot.run(after_s)
    asked_N = [-robot.torque / robot.cable_m]
    robot.program.stop()
    while not robot.program.at_rest:
        robot.run(PERIOD_S)
        asked_N.append(-robot.torque / robot.cable_m)
        assert len(asked_N) < 1.0 / PERIOD_S
    assert max(asked_N[0]) > 2.0
    assert not np.any(asked_N[-1])
    fastest_N = home_pretension_N(robot.parts) * PERIOD_S / FALL_S
    assert (-np.diff(asked_N, axis=0) <= fastest_N + 1e-9).all()


def test_a_stop_in_the_first_cycle_reduces_earlier_tensions_without_a_step(robot: Standing) -> None:
    robot.loosen((0.0, 0.0, 0.0))
    robot.torque[:] = -10.0 * robot.cable_m
    robot.switch("tighten")
    robot.program.stop()
    robot.run(PERIOD_S)
    fastest_N = home_pretension_N(robot.parts) * PERIOD_S / FALL_S
    assert (-robot.torque / robot.cable_m >= 10.0 - fastest_N - 1e-9).all()


def test_cables_that_are_not_tight_in_time_are_named_with_their_tension(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tighten_module, "_TIGHT_WITHIN_S", 2.0)
    robot.slack_m[1] += 0.4
    robot.switch("tighten")
    told = robot.until_done(5.0)["trouble"]
    assert told.startswith("no further cable became tight within 2 s: upper right pulls with ")
    assert 0.0 < float(told.split("with ")[1].split(" N")[0]) < 20.0
    assert "left" not in told and "lower" not in told


def test_a_cable_that_pulls_but_does_not_stand_still_is_named(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    until(robot, "pull")
    monkeypatch.setattr(tighten_module, "_TIGHT_WITHIN_S", 0.0)
    told = robot.until_done(1.0)["trouble"]
    assert told.startswith("no further cable became tight within 0 s: ")
    assert told.endswith(" N and keeps moving")
