"""Cables some of which have much more slack than others do not pull the platform off its stand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.robot import Error
from cdpr_tools.lockstep_robot import LockstepRobot

pytestmark = pytest.mark.long

WORSE_MOTORS = """
[cables]
friction_share = 0.04
[variation]
cogging = 0.3
friction = 0.2
[[motor.cogging]]
order = 4
amplitude_Nm = 0.036
[motor.friction]
coulomb_Nm = 0.062
"""
"""Half as much again as is usual of a motor of 1.2 Nm, each its own way."""


MUCH_COGGING = """
[cables]
friction_share = 0.04
[variation]
friction = 0.3
cogging = 0.3
torque_constant = 0.05
[motor.friction]
coulomb_Nm = 0.16
[[motor.cogging]]
order = 4
amplitude_Nm = 0.07
phase_deg = 40.0
[[motor.cogging]]
order = 30
amplitude_Nm = 0.03
phase_deg = 10.0
"""
SLACK_m = [0.016, 0.035, 0.04, 0.011, 0.017, 0.056, 0.014, 0.016]
"""By chance, between 10 and 60 mm."""


def plant(path: Path, slack_m: list[float]) -> Path:
    path.write_text(f"[start]\nslack_m = {slack_m}\n")
    return path


def moved_mm(robot: LockstepRobot, name: str | Path) -> tuple[float, float]:
    """Return how far the platform truly is from home, mm, and how far it is turned, deg."""
    platform, truth = load_robot(name).platform, robot.truth()
    assert platform is not None
    home_m = np.zeros(3)
    home_m[: len(platform.home_m)] = platform.home_m
    angle = np.arccos(np.clip(0.5 * (np.trace(truth["rotation"]) - 1.0), -1.0, 1.0))
    return 1e3 * float(np.abs(truth["position_m"] - home_m).max()), float(np.degrees(angle))


@pytest.mark.parametrize(
    ("name", "slack_m"),
    [
        ("spatial-8", [0.02, 0.15, 0.04, 0.3, 0.01, 0.09, 0.2, 0.05]),
        ("spatial-8", [0.0] * 8),
        ("planar-3", [0.02, 0.15, 0.0]),
        ("point-4", [0.25, 0.0, 0.1, 0.04]),
    ],
)
def test_slack_is_taken_up_without_moving_the_platform(
    name: str, slack_m: list[float], tmp_path: Path
) -> None:
    with LockstepRobot(name, plant=plant(tmp_path / "plant.toml", slack_m)) as robot:
        robot.enable()
        robot.program("tighten")
        while robot.progress.get("stage") != "beyond":
            robot.run(0.1)
            assert not robot.progress.get("trouble")
        position_mm, turned_deg = moved_mm(robot, name)
    assert position_mm < 0.5
    assert turned_deg < 0.1


def test_a_cable_that_becomes_tight_in_motion_does_not_pull_the_platform_along(
    tmp_path: Path,
) -> None:
    """Its winch pulls with what has turned it, and with more only while it stands still."""
    slack_m = [0.057, 0.041, 0.028, 0.036, 0.043, 0.024, 0.017, 0.049]
    file = plant(tmp_path / "plant.toml", slack_m)
    file.write_text("seed = 101\n" + file.read_text())
    with LockstepRobot("spatial-8", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        moved, turned_deg = moved_mm(robot, "spatial-8")
        assert moved < 1.0
        assert turned_deg < 0.2


def test_cogging_that_turns_a_winch_is_not_taken_for_all_that_it_needs(tmp_path: Path) -> None:
    """Where cogging turned it by itself, it stands still further on though its cable is slack."""
    file = tmp_path / "plant.toml"
    file.write_text(
        """
seed = 100
start.slack_m = [0.016, 0.035, 0.014]
variation = { friction = 0.3, cogging = 0.3, torque_constant = 0.05 }
cables.friction_share = 0.04
motor.friction.coulomb_Nm = 0.16
motor.cogging = [
  { order = 4, amplitude_Nm = 0.07, phase_deg = 40.0 },
  { order = 30, amplitude_Nm = 0.03, phase_deg = 10.0 },
]
"""
    )
    with LockstepRobot("planar-3", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert moved_mm(robot, "planar-3")[0] < 1.0


def test_cables_that_become_tight_at_the_same_time_do_not_turn_the_platform(tmp_path: Path) -> None:
    """One is reeled in after the other: winches that rub and cog much pull with some newtons."""
    file = plant(tmp_path / "plant.toml", SLACK_m)
    file.write_text("seed = 100\n" + file.read_text() + MUCH_COGGING)
    with LockstepRobot("spatial-8", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        moved, turned_deg = moved_mm(robot, "spatial-8")
        assert not robot.status()["notices"]
    assert moved < 2.0
    assert turned_deg < 1.0


def test_a_platform_that_was_dragged_along_by_one_winch_ends_it(tmp_path: Path) -> None:
    """Half as heavy as its file says, it is dragged by what it was to stand against."""
    file = plant(tmp_path / "plant.toml", SLACK_m)
    file.write_text("seed = 100\nplatform.mass_error = -0.5\n" + file.read_text() + MUCH_COGGING)
    with LockstepRobot("spatial-8", plant=file) as robot:
        robot.enable()
        with pytest.raises(Error, match="further out than it was alone"):
            robot.carry_out("tighten")
        assert moved_mm(robot, "spatial-8")[0] > 5.0


def test_how_far_slack_lets_a_light_platform_be_pulled_along_is_reported(tmp_path: Path) -> None:
    """At most what is told, and no less than a third of it."""
    file = plant(tmp_path / "plant.toml", SLACK_m[:4])
    file.write_text("seed = 100\n" + file.read_text())
    with LockstepRobot("planar-4", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        (told,) = robot.status()["notices"]
        stands = re.search(r"may stand up to about (\d+) mm from the place", told)
        assert stands is not None, told
        most_mm = float(stands[1])
        assert most_mm / 3.0 < moved_mm(robot, "planar-4")[0] < most_mm
    file.write_text("start.slack_m = 0.02\n")
    with LockstepRobot("planar-4", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert not robot.status()["notices"]


def test_a_platform_too_light_for_its_winches_is_told_to_have_moved(tmp_path: Path) -> None:
    """What turns a winch of `planar-4` without load pulls its platform of 3 kg along."""
    file = plant(tmp_path / "plant.toml", [0.0, 0.3, 0.3, 0.3])
    with LockstepRobot("planar-4", plant=file) as robot:
        robot.enable()
        with pytest.raises(Error, match=r"mm more slack than .* moves this light platform"):
            robot.carry_out("tighten", 60.0)


def test_a_winch_that_stuck_with_slack_is_not_taken_for_a_platform_that_moved(
    tmp_path: Path,
) -> None:
    """With this seed friction holds a winch before its 20 mm of slack are in."""
    file = tmp_path / "plant.toml"
    file.write_text("seed = 10\n")
    with LockstepRobot("planar-4", plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert moved_mm(robot, "planar-4")[0] < 1.0


def test_a_platform_that_would_tip_over_is_not_pulled_at_by_one_winch_alone(tmp_path: Path) -> None:
    """A winch that turns without load pulls with 2.2 N, which does not slide 0.95 kg: 0.3 of it."""
    name = tmp_path / "tall.toml"
    asked = ("kind=spatial-8", "frame_m=1.5 1.5 1.5", "winch=winch-45n")
    answers = [word for answer in asked for word in ("--set", answer)]
    assert cdpr_here("robot", "new", str(name), *answers, "--yes").returncode == 0
    file = plant(tmp_path / "plant.toml", [0.02] * 8)
    file.write_text(file.read_text() + WORSE_MOTORS)
    with LockstepRobot(name, plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        position_mm, turned_deg = moved_mm(robot, name)
    assert position_mm < 1.0
    assert turned_deg < 1.0


def test_winches_that_rub_more_than_the_least_tension_leave_no_cable_slack(tmp_path: Path) -> None:
    """They are pulled on the stand with more than they rub, 16 N, and not with 8 N."""
    name, file = tmp_path / "heavy.toml", tmp_path / "plant.toml"
    text = (SHIPPED / "robots" / "planar-4.toml").read_text()
    for old, new in (
        ("mass_kg = 3.0", "mass_kg = 20.0"),
        ("tension_min_N = 20.0", "tension_min_N = 8.0"),
        ("tension_max_N = 230.0", "tension_max_N = 150.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    name.write_text(text)
    file.write_text("start.slack_m = 0.02\nmotor.friction.coulomb_Nm = 0.16\n")
    with LockstepRobot(name, plant=file) as robot:
        robot.enable()
        robot.program("tighten")
        while robot.progress.get("stage") != "beyond":
            robot.run(0.1)
            assert not robot.progress.get("trouble")
        assert robot.truth()["tension_N"].min() > 10.0
        assert moved_mm(robot, name)[0] < 1.0
