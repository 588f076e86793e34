"""A loop that oscillates because of delayed answers of drives is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.core.states import LoopState
from tests.local_robot import local_robot

pytestmark = pytest.mark.long


def test_an_oscillating_loop_is_reported_in_the_status(tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text("[motor.drive]\nfeedback_delay_s = 0.0055\n")
    with local_robot("planar-4", plant=plant) as robot:
        robot.enable()
        robot.carry_out("tighten")
        robot.carry_out("pose", position_m=[0.0, 1.55])
        tension_N = []
        for _ in range(400):
            robot.turn(6)
            tension_N.append(robot.truth()["tension_N"].copy())
        assert robot.state is LoopState.ACTIVE, robot.state_text()
        told = robot.status()["notices"]
        assert np.ptp(tension_N, axis=0).max() > 25.0
        (notice,) = (text for text in told if "oscillates at this winch" in text)
        assert ": the control loop oscillates at this winch: for 1 s at 3" in notice
        robot.carry_out("lower")
        robot.program("tighten")  # tightening starts a new detection
        assert not any("oscillates at this winch" in text for text in robot.status()["notices"])
