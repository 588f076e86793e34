"""Tightening that is stopped, or that does not come to its end."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.programs.platform.tightening import tighten as tighten_module
from tests.cdpr_rt.programs.platform.standing_robot import PERIOD_S, Standing, home_pretension_N

FALL_S = 0.2


def until(robot: Standing, stage: str) -> None:
    robot.switch("tighten")
    while robot.program.progress()["stage"] != stage:
        robot.run(PERIOD_S)


@pytest.mark.parametrize(("stage", "after_s"), [("slack", 0.5), ("pull", 0.02), ("beyond", 0.1)])
def test_a_stop_lets_all_tensions_down_and_none_at_once(
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


def test_a_stop_in_the_first_cycle_lets_down_what_was_pulled_before(robot: Standing) -> None:
    robot.loosen((0.0, 0.0, 0.0))
    robot.torque[:] = -10.0 * robot.cable_m
    robot.switch("tighten")
    robot.program.stop()
    robot.run(PERIOD_S)
    fastest_N = home_pretension_N(robot.parts) * PERIOD_S / FALL_S
    assert (-robot.torque / robot.cable_m >= 10.0 - fastest_N - 1e-9).all()


def test_cables_that_are_not_tight_in_time_are_named_with_what_they_pull(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tighten_module, "_TIGHT_WITHIN_S", 2.0)
    robot.slack_m[1] += 0.4
    robot.switch("tighten")
    told = robot.until_done(5.0)["trouble"]
    assert told.startswith("no further cable tight within 2 s: upper right pulls with ")
    assert 0.0 < float(told.split("with ")[1].split(" N")[0]) < 20.0
    assert "left" not in told and "lower" not in told


def test_where_all_pull_the_cable_that_does_not_stand_still_is_named(
    robot: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    until(robot, "pull")
    monkeypatch.setattr(tighten_module, "_TIGHT_WITHIN_S", 0.0)
    told = robot.until_done(1.0)["trouble"]
    assert told.startswith("no further cable tight within 0 s: ")
    assert told.endswith(" N and does not stand still")


@pytest.mark.parametrize("stage", ["slack", "pull"])
def test_which_cables_are_tight_is_looked_at_without_new_arrays(
    robot: Standing, stage: str
) -> None:
    until(robot, stage)
    look = robot.program._not_tight  # type: ignore[attr-defined]
    first = look()
    assert first.size == 3
    assert look() is first
