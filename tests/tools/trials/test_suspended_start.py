"""The true position of a suspended platform with motors that are not commissioned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from tests.local_robot import local_robot
from tests.slower_robot import slower_robot

pytestmark = pytest.mark.long


def test_cogging_and_friction_at_the_start_do_not_falsify_lengths() -> None:
    """They are 20 N and 30 N per cable, 0.8 mm and 1.2 mm of its stretch."""
    platform = load_robot("suspended-8").platform
    assert platform is not None
    middle_m = 0.5 * (np.array(platform.workspace_min_m) + np.array(platform.workspace_max_m))
    with local_robot("suspended-8") as robot:
        robot.enable()
        robot.carry_out("tighten")
        found_Nm = np.array(robot.progress["learnt_friction_Nm"])
        robot.carry_out("pose", position_m=middle_m.tolist())
        robot.run(1.5)
        off_mm = 1e3 * (robot.truth()["position_m"] - middle_m)
    assert np.abs(off_mm).max() < 0.6
    # true friction is 0.08 Nm +- 20 % plus 2 % of the cable's torque
    np.testing.assert_allclose(found_Nm, 0.08, atol=0.03)


def test_six_suspended_cables_are_tightened_without_trouble(tmp_path: Path) -> None:
    """The estimated position changes while the force on the stand is removed."""
    with local_robot(slower_robot(tmp_path, "suspended-6")) as robot:
        robot.enable()
        robot.carry_out("tighten")
        assert not robot.progress["trouble"]
