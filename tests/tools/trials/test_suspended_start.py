"""Where a suspended robot's platform truly goes whose motors nobody has commissioned."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_tools.lockstep_robot import LockstepRobot

pytestmark = pytest.mark.long


def test_cogging_and_friction_at_the_start_are_not_taken_for_length() -> None:
    """They are 20 N and 30 N of each cable, 0.8 and 1.2 mm of its stretch."""
    platform = load_robot("suspended-8").platform
    assert platform is not None
    middle_m = 0.5 * (np.array(platform.workspace_min_m) + np.array(platform.workspace_max_m))
    with LockstepRobot("suspended-8") as robot:
        robot.enable()
        robot.carry_out("tighten")
        found_Nm = np.array(robot.progress["learnt_friction_Nm"])
        robot.carry_out("pose", position_m=middle_m.tolist())
        robot.run(1.5)
        off_mm = 1e3 * (robot.truth()["position_m"] - middle_m)
    assert np.abs(off_mm).max() < 0.6
    # the simulated motors' is 0.08 Nm, 20 % this way and that, and 2 % of the cable's torque
    np.testing.assert_allclose(found_Nm, 0.08, atol=0.03)


def test_six_cables_are_tightened_and_stand_where_they_are_held() -> None:
    """Their platform is found elsewhere while what presses it on its stand is let go."""
    with LockstepRobot("suspended-6") as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert not robot.progress["trouble"]
