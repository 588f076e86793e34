"""Whether cables of a platform on its stand can be pulled with more than their winches rub."""

from __future__ import annotations

import dataclasses
import re

import pytest

from cdpr_profiles import load_robot
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.feasibility.stand_checks import stand_findings
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_rt.robots.statics import statics_of

SHIPPED = ("planar-3", "planar-4", "point-4", "spatial-8", "suspended-6", "suspended-8")


def told(name: str, high_N: float | None = None) -> list[Finding]:
    """Return what is told of a shipped robot, whose cables bear 2 N to `high_N` where given."""
    robot = load_robot(name)
    if high_N is not None:
        bounds = {"tension_min_N": (2.0,), "tension_max_N": (high_N,), "slack_N": (0.5,)}
        robot = dataclasses.replace(robot, limits=robot.limits.model_copy(update=bounds))
    return list(stand_findings(robot, limits_of(robot), statics_of(robot)))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_robots_can_be_pulled_tight(name: str) -> None:
    assert told(name) == []


@pytest.mark.parametrize(("name", "high_N"), [("planar-3", 12.0), ("spatial-8", 25.0)])
def test_bounds_below_what_winches_rub_are_told_with_some_that_would_do(
    name: str, high_N: float
) -> None:
    (finding,) = told(name, high_N)
    assert (finding.key, finding.impossible) == ("limits.tension_max_N", False)
    assert "such winches usually rub with up to 7.6 N" in finding.text
    enough = re.search(r"enough: (\d+),", finding.text)
    assert enough is not None
    assert told(name, float(enough[1])) == []
