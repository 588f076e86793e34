"""A hand that leads a platform into an obstacle: it stops at the clearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles.platform import BoxFile
from tests.cdpr_rt.programs.ideal_platform import ROOM, IdealPlatform

CLEARANCE_m = 0.02
POST = BoxFile(min_m=(0.62, -0.15, 0.0), max_m=(0.70, 0.15, 1.9))
WIRE = BoxFile(min_m=(1.9, -2.0, 2.35), max_m=(1.95, 0.0, 2.4))
BODY = BoxFile(min_m=(-0.2, -0.2, 0.0), max_m=(0.2, 0.2, 0.5))


@pytest.fixture(scope="module")
def robot() -> IdealPlatform:
    crowded = replace(
        ROOM, clearance_m=CLEARANCE_m, body=BODY, obstacles=(POST, WIRE), speed_m_s=0.8
    )
    return IdealPlatform(crowded, 10.0, 6000.0)


def clearances(robot: IdealPlatform) -> np.ndarray:
    return robot.model.interference.clearances(robot.model.poses(np.array(robot.path)))[0]


def lead(robot: IdealPlatform, way_m: tuple[float, float, float], seconds: float) -> set[str]:
    """Lead the platform by `way_m` in a time, then hold; return the reported obstacles."""
    told = set()
    robot.pose.command({"stream": True})
    for share in np.minimum(np.arange(0.0, seconds + 1.5, 0.02) / seconds, 1.0):
        robot.hand(tuple(share * np.array(way_m)))
        told.add(robot.pose.progress()["held_back"])
    return told


@pytest.mark.parametrize(
    ("way_m", "seconds", "told"),
    [
        ((0.9, 0.0, 0.0), 0.8, "platform and obstacle 1"),
        ((0.9, -0.9, -0.2), 3.0, "platform and obstacle 1"),
        ((0.0, -0.9, 0.4), 0.8, "cable 7 and obstacle 1"),
        ((0.0, 0.0, 0.5), 3.0, "cable 7 and obstacle 2"),
    ],
)
def test_the_platform_stops_at_the_clearance_and_the_pair_is_named(robot, way_m, seconds, told):
    robot.restart(np.array([0.0, 0.1, 1.1, 0.0, 0.0, 0.0]))
    words = lead(robot, way_m, seconds)
    least = clearances(robot)
    assert least[0] > CLEARANCE_m + 0.03
    assert CLEARANCE_m <= least.min() < CLEARANCE_m + 1e-3
    assert any(one.startswith(f"{told} come within ") for one in words), words


def test_a_stream_in_contact_may_retreat_but_not_approach(robot):
    near = np.array([0.405, 0.0, 1.1, 0.0, 0.0, 0.0])
    for x, moves in ((0.1, False), (-0.1, True)):
        robot.restart(near)
        lead(robot, (x, 0.0, 0.0), 0.5)
        least = clearances(robot)
        assert least[0] < CLEARANCE_m
        assert least.min() >= least[0] - 1e-9
        assert (abs(robot.path[-1][0] - near[0]) > 0.09) == moves
