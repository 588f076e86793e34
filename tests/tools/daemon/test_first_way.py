"""The first way off the stand, after the platform was pressed onto it: followed as later ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_tools.trials.lockstep import LockstepRobot

TWICE = "[motor.friction]\ncoulomb_Nm = 0.16\nbreakaway_Nm = 0.2\n"


def lag_mm(robot: LockstepRobot) -> float:
    """Return how far the platform truly is from its set-point."""
    k = len(robot.robot.platform.workspace_min_m)
    setpoint = robot.row["pose_setpoint"][:3] if k == 3 else robot.row["pose_setpoint"][:2]
    return float(1e3 * np.linalg.norm(setpoint - robot.truth()["position_m"][:k]))


def way_mm(robot: LockstepRobot, seconds: float = 1.5) -> float:
    """Return the farthest that the platform is off within some time."""
    lags = []
    for _ in range(round(seconds / 0.01)):
        robot.turn(10)
        lags.append(lag_mm(robot))
    return max(lags)


@pytest.mark.parametrize(
    ("name", "plant", "waits_s", "most_mm"),
    [
        ("spatial-8", "", 0.0, 12.0),  # 34 mm where the set-point is below the stand
        ("spatial-8", "", 8.0, 12.0),
        ("planar-3", TWICE, 8.0, 6.0),  # 9 mm
        ("suspended-8", "", 0.0, 4.0),  # 8 mm
    ],
)
def test_a_platform_leaves_its_stand_as_it_goes_other_ways(
    tmp_path: Path, name: str, plant: str, waits_s: float, most_mm: float
) -> None:
    (tmp_path / "plant.toml").write_text(plant)
    with LockstepRobot(name, plant=tmp_path / "plant.toml") as robot:
        platform = robot.robot.platform
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        robot.enable()
        robot.carry_out("tighten")
        robot.run(waits_s)
        robot.program("pose", position_m=(0.5 * (low + high)).tolist())
        assert way_mm(robot) < most_mm
        assert robot.progress["held_back"] == ""


def test_a_hand_leads_it_off_its_stand() -> None:
    with LockstepRobot("planar-3") as robot:
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
        assert max(lags) < 4.0  # 7 mm where the set-point is below the stand
