"""Tightening cables with very different slack does not pull the platform off its stand."""

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
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot

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
"""Friction and cogging 1.5 times the usual of a 1.2 Nm motor, different for each motor."""


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
"""Random values between 10 and 60 mm."""


def plant(path: Path, slack_m: list[float]) -> Path:
    path.write_text(f"[start]\nslack_m = {slack_m}\n")
    return path


def moved_mm(robot: LockstepRobot, name: str | Path) -> tuple[float, float]:
    """Return the true distance of the platform from home in mm and its angle in degrees."""
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
    file = plant(tmp_path / "plant.toml", slack_m)
    with local_robot(slower_robot(tmp_path, name), plant=file) as robot:
        robot.enable()
        robot.program("tighten")
        while robot.progress.get("stage") != "beyond":
            robot.run(0.1)
            assert not robot.progress.get("trouble")
        position_mm, turned_deg = moved_mm(robot, name)
    assert position_mm < 0.5
    assert turned_deg < 0.1


def test_a_cable_that_becomes_tight_in_motion_does_not_move_the_platform(
    tmp_path: Path,
) -> None:
    """The winch keeps the torque that turned it, and increases it only at rest."""
    slack_m = [0.057, 0.041, 0.028, 0.036, 0.043, 0.024, 0.017, 0.049]
    file = plant(tmp_path / "plant.toml", slack_m)
    file.write_text("seed = 101\n" + file.read_text())
    with local_robot(slower_robot(tmp_path, "spatial-8"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        moved, turned_deg = moved_mm(robot, "spatial-8")
        assert moved < 1.0
        assert turned_deg < 0.2


def test_cogging_that_turns_a_winch_does_not_hide_its_slack(tmp_path: Path) -> None:
    """A winch turned by cogging stops further on although its cable is slack."""
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
    with local_robot(slower_robot(tmp_path, "planar-3"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert moved_mm(robot, "planar-3")[0] < 1.0


def test_cables_that_become_tight_at_the_same_time_do_not_turn_the_platform(tmp_path: Path) -> None:
    """They are reeled in sequentially, because winches with much friction pull some newtons."""
    file = plant(tmp_path / "plant.toml", SLACK_m)
    file.write_text("seed = 100\n" + file.read_text() + MUCH_COGGING)
    with local_robot(slower_robot(tmp_path, "spatial-8"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        moved, turned_deg = moved_mm(robot, "spatial-8")
        assert not robot.status()["notices"]
    assert moved < 2.0
    assert turned_deg < 1.0


def test_tighten_fails_if_one_winch_drags_the_platform(tmp_path: Path) -> None:
    """The platform has half the mass of its file, so that the allowed tension moves it."""
    file = plant(tmp_path / "plant.toml", SLACK_m)
    file.write_text("seed = 100\nplatform.mass_error = -0.5\n" + file.read_text() + MUCH_COGGING)
    with local_robot(slower_robot(tmp_path, "spatial-8"), plant=file) as robot:
        robot.enable()
        with pytest.raises(Error, match="further out than when it was tightened alone"):
            robot.carry_out("tighten")
        assert moved_mm(robot, "spatial-8")[0] > 5.0


def test_the_possible_displacement_of_a_light_platform_is_reported(tmp_path: Path) -> None:
    """The true displacement is between a third of the reported value and this value."""
    file = plant(tmp_path / "plant.toml", SLACK_m[:4])
    file.write_text("seed = 100\n" + file.read_text())
    with local_robot(slower_robot(tmp_path, "planar-4"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        (told,) = robot.status()["notices"]
        stands = re.search(r"may stand up to about (\d+) mm from the place", told)
        assert stands is not None, told
        most_mm = float(stands[1])
        assert most_mm / 3.0 < moved_mm(robot, "planar-4")[0] < most_mm
    file.write_text("start.slack_m = 0.02\n")
    with local_robot(slower_robot(tmp_path, "planar-4"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert not robot.status()["notices"]


def test_tighten_reports_a_platform_too_light_for_its_winches(tmp_path: Path) -> None:
    """The torque that turns an unloaded winch of `planar-4` moves its 3 kg platform."""
    file = plant(tmp_path / "plant.toml", [0.0, 0.3, 0.3, 0.3])
    with local_robot(slower_robot(tmp_path, "planar-4"), plant=file) as robot:
        robot.enable()
        with pytest.raises(Error, match=r"mm more slack than .* moves this light platform"):
            robot.carry_out("tighten", 60.0)


def test_a_winch_blocked_by_friction_is_not_mistaken_for_a_moved_platform(
    tmp_path: Path,
) -> None:
    """With this seed, friction blocks a winch before its 20 mm of slack are reeled in."""
    file = tmp_path / "plant.toml"
    file.write_text("seed = 10\n")
    with local_robot(slower_robot(tmp_path, "planar-4"), plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert moved_mm(robot, "planar-4")[0] < 1.0


def test_a_platform_that_could_tip_over_is_not_pulled_by_a_single_winch(tmp_path: Path) -> None:
    """An unloaded winch pulls with 2.2 N, too little to slide 0.95 kg with friction 0.3."""
    name = tmp_path / "tall.toml"
    asked = ("kind=spatial-8", "frame_m=1.5 1.5 1.5", "winch=winch-45n")
    answers = [word for answer in asked for word in ("--set", answer)]
    assert cdpr_here("robot", "new", str(name), *answers, "--yes").returncode == 0
    file = plant(tmp_path / "plant.toml", [0.02] * 8)
    file.write_text(file.read_text() + WORSE_MOTORS)
    with local_robot(name, plant=file) as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        position_mm, turned_deg = moved_mm(robot, name)
    assert position_mm < 1.0
    assert turned_deg < 1.0


def test_winch_friction_above_the_least_tension_leaves_no_cable_slack(tmp_path: Path) -> None:
    """On the stand, cables are pulled with 16 N, more than friction, instead of 8 N."""
    name, file = tmp_path / "heavy.toml", tmp_path / "plant.toml"
    text = (SHIPPED / "robots" / "planar-4.toml").read_text()
    for old, new in (
        ("sync_period_s = 0.001", "sync_period_s = 0.004"),
        ("mass_kg = 3.0", "mass_kg = 20.0"),
        ("tension_min_N = 20.0", "tension_min_N = 8.0"),
        ("tension_max_N = 230.0", "tension_max_N = 150.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    name.write_text(text)
    file.write_text("start.slack_m = 0.02\nmotor.friction.coulomb_Nm = 0.16\n")
    with local_robot(name, plant=file) as robot:
        robot.enable()
        robot.program("tighten")
        while robot.progress.get("stage") != "beyond":
            robot.run(0.1)
            assert not robot.progress.get("trouble")
        assert robot.truth()["tension_N"].min() > 10.0
        assert moved_mm(robot, name)[0] < 1.0
