"""A platform that is turned by its cables, from its stand and back, judged by what was true."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cdpr_tools.trials.lockstep import LockstepRobot

TURN_rad = 0.15


@pytest.fixture(scope="module")
def robot() -> Iterator[LockstepRobot]:
    with LockstepRobot("planar-4") as opened:
        opened.enable()
        opened.carry_out("tighten", 60.0)
        yield opened


def turned_rad(robot: LockstepRobot) -> float:
    """Return by how much the platform is truly turned."""
    Q = robot.truth()["rotation"]
    return math.atan2(Q[1, 0], Q[0, 0])


def test_it_goes_turned_where_it_is_told_and_is_lowered_as_it_stood(robot: LockstepRobot) -> None:
    robot.carry_out("pose", position_m=[0.1, 1.6], rotation_rad=[TURN_rad])
    robot.run(1.0)
    assert turned_rad(robot) == pytest.approx(TURN_rad, abs=2e-3)
    assert robot.truth()["position_m"][:2] == pytest.approx([0.1, 1.6], abs=1e-3)
    half = 0.5 * TURN_rad
    for name, off in (("pose", 1e-3), ("pose_setpoint", 1e-9)):
        recorded = [*robot.row[name][:2], *robot.row[name][3:]]
        expected = [0.1, 1.6, math.cos(half), 0.0, 0.0, math.sin(half)]
        assert recorded == pytest.approx(expected, abs=off)

    robot.carry_out("pose", position_m=[0.0, 1.5])
    robot.run(0.5)
    assert turned_rad(robot) == pytest.approx(TURN_rad, abs=2e-3), "what is left out stays"

    robot.carry_out("lower")
    assert turned_rad(robot) == pytest.approx(0.0, abs=2e-3)
    home = robot.robot.platform
    assert home is not None
    np.testing.assert_allclose(robot.truth()["position_m"][:2], home.home_m, atol=5e-3)
