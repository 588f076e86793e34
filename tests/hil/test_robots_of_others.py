"""Planar robots described by other users load, start, move and come to rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_rt.model.statics import statics_of
from tests.local_robot import local_robot

OTHERS = sorted((Path(__file__).parent / "others").glob("*.toml"))
START_m = 0.003
"""Position error that the stand and winch friction leave at the start, and so everywhere."""


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.stem)
def test_a_robot_of_another_user_starts_moves_and_rests(path: Path) -> None:
    with local_robot(path) as robot:
        refuse_impossible(robot.robot)
        statics = statics_of(robot.robot)
        robot.enable()
        robot.carry_out("tighten")
        lowest, highest = np.inf, 0.0
        for target in (statics.box.low_m, statics.box.high_m):
            robot.carry_out("pose", position_m=list(target))
            for _ in range(6):
                robot.run(0.1)
                tension = robot.truth()["tension_N"]
                lowest, highest = min(lowest, tension.min()), max(highest, tension.max())
            missed_m = robot.truth()["position_m"][:2] - target
            assert np.linalg.norm(missed_m) < START_m, (target, missed_m)
        assert lowest > 0.6 * statics.low_N.min() and highest < statics.high_N.max()
        robot.shut_down()
        assert robot.loop.ended
        assert np.linalg.norm(robot.truth()["position_m"][:2] - statics.platform.home_m) < 0.01
