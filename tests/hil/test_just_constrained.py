"""As many cables as directions: nothing but what its own motor does tells of a cable."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_tools.trials.lockstep import LockstepRobot

PLOTTER = Path(__file__).parent / "robots" / "plotter.toml"


@pytest.mark.parametrize(("axis", "name"), [(0, "c1"), (1, "c2")])
def test_a_cable_that_is_cut_is_told_as_broken(axis: int, name: str) -> None:
    """What is left of 25 N is its winch's friction, four times what counts as slack."""
    with LockstepRobot(PLOTTER) as robot:
        robot.enable()
        robot.carry_out("tighten")
        robot.carry_out("pose", position_m=[0.2, 1.3])
        robot.run(1.0)
        robot.inject_fault(axis, 12, 1)
        rows = robot.run(0.15)
        first = int(rows["limit"].argmax())
        assert Limit(int(rows["limit"][first])) is Limit.BROKEN_CABLE
        assert first * robot.period_s < 0.05
        assert robot.status["reason"].startswith(f"{name}: the cable seems broken")
