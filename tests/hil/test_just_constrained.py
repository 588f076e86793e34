"""With as many cables as directions, only a cable's own motor shows its state."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.robot import Error
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot


@pytest.fixture
def plotter(tmp_path: Path) -> Path:
    return slower_robot(tmp_path, Path(__file__).parent / "robots" / "plotter.toml")


def test_a_cable_that_is_cut_is_reported_as_broken(plotter: Path) -> None:
    """The estimated tension falls from 25 N to winch friction, four times the slack threshold."""
    with local_robot(plotter) as robot:
        robot.enable()
        robot.carry_out("tighten")
        robot.carry_out("pose", position_m=[0.2, 1.3])
        robot.run(1.0)
        robot.inject(1, 12, 1)
        rows = robot.run(0.15)
        first = int(rows["limit"].argmax())
        assert Limit(int(rows["limit"][first])) is Limit.BROKEN_CABLE
        assert first * robot.period_s < 0.05
        assert robot.status()["reason"].startswith("c2: the cable seems broken")


def test_tighten_reports_a_cable_that_friction_kept_slack(plotter: Path, tmp_path: Path) -> None:
    """Friction and cogging block the winch until the torque rises. The platform is off by 4 mm.

    With usual or doubled friction the cable is tight.
    """
    plant = tmp_path / "plant.toml"
    plant.write_text(
        """
seed = 100
start.slack_m = [0.016, 0.035]
variation = { friction = 0.3, cogging = 0.3, torque_constant = 0.05 }
cables.friction_share = 0.04
motor.friction.coulomb_Nm = 0.16
motor.cogging = [
  { order = 4, amplitude_Nm = 0.07, phase_deg = 40.0 },
  { order = 30, amplitude_Nm = 0.03, phase_deg = 10.0 },
]
"""
    )
    with local_robot(plotter, plant=plant) as robot:
        robot.enable()
        with pytest.raises(Error, match=r"c1: came in by .* take up slack by hand"):
            robot.carry_out("tighten")
    plant.write_text(
        "seed = 100\nmotor.friction.coulomb_Nm = 0.16\nstart.slack_m = [0.016, 0.035]\n"
    )
    with local_robot(plotter, plant=plant) as robot:
        robot.enable()
        robot.carry_out("tighten")
