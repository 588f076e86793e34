"""A platform that its cables turn, from its stand and back, checked against the truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_tools.lockstep_robot import LockstepRobot
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot

pytestmark = pytest.mark.long

TURN_rad = 0.15


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LockstepRobot]:
    with local_robot(slower_robot(tmp_path_factory.mktemp("turning"), "planar-4")) as opened:
        opened.enable()
        opened.carry_out("tighten", 60.0)
        yield opened


def turned_rad(robot: LockstepRobot) -> float:
    """Return the true angle of the platform."""
    Q = robot.truth()["rotation"]
    return math.atan2(Q[1, 0], Q[0, 0])


def test_a_platform_moves_and_turns_and_is_lowered_to_its_initial_pose(
    robot: LockstepRobot,
) -> None:
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
    assert turned_rad(robot) == pytest.approx(TURN_rad, abs=2e-3), (
        "an omitted angle does not change"
    )

    robot.carry_out("lower")
    assert turned_rad(robot) == pytest.approx(0.0, abs=2e-3)
    home = robot.robot.platform
    assert home is not None
    np.testing.assert_allclose(robot.truth()["position_m"][:2], home.home_m, atol=5e-3)


# The first motion off the stand.

TWICE = "[motor.friction]\ncoulomb_Nm = 0.16\nbreakaway_Nm = 0.2\n"


def lag_mm(robot: LockstepRobot) -> float:
    """Return the true distance of the platform from its set-point."""
    k = len(robot.robot.platform.workspace_min_m)
    setpoint = robot.row["pose_setpoint"][:3] if k == 3 else robot.row["pose_setpoint"][:2]
    return float(1e3 * np.linalg.norm(setpoint - robot.truth()["position_m"][:k]))


def way_mm(robot: LockstepRobot, seconds: float = 1.5) -> float:
    """Return the largest distance from the set-point within `seconds`."""
    lags = []
    for _ in range(round(seconds / 0.01)):
        robot.run(0.01)
        lags.append(lag_mm(robot))
    return max(lags)


@pytest.mark.parametrize(
    ("name", "plant", "waits_s", "most_mm"),
    [
        ("spatial-8", "", 0.0, 12.0),  # 34 mm if the set-point is below the stand
        ("planar-3", TWICE, 8.0, 6.0),  # 9 mm
        ("suspended-8", "", 0.0, 4.0),  # 8 mm
    ],
)
def test_a_platform_follows_its_set_point_when_leaving_the_stand(
    tmp_path: Path, name: str, plant: str, waits_s: float, most_mm: float
) -> None:
    (tmp_path / "plant.toml").write_text(plant)
    with local_robot(slower_robot(tmp_path, name, 0.002), plant=tmp_path / "plant.toml") as robot:
        platform = robot.robot.platform
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        robot.enable()
        robot.carry_out("tighten")
        robot.run(waits_s)
        robot.program("pose", position_m=(0.5 * (low + high)).tolist())
        assert way_mm(robot) < most_mm
        assert robot.progress["held_back"] == ""


def test_a_platform_follows_a_hand_off_its_stand() -> None:
    with local_robot("planar-3") as robot:
        robot.enable()
        robot.carry_out("tighten")
        robot.program("pose", stream=True)
        hand = robot.stream.sender()
        lags = []
        for step in range(60):
            robot.stream.take(hand.packet(robot.now_s, (0.0, 0.002 * step, 0.0)))
            robot.turn(20)
            lags.append(lag_mm(robot))
        assert robot.truth()["position_m"][1] > 1.38
        assert max(lags) < 4.0  # 7 mm if the set-point is below the stand
