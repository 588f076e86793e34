"""The control of a platform that hangs on too few cables, on simulated physics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.cdpr_rt.platform.platform_physics import Machine, Physics, hung

MACHINES = [hung(), hung(centre_m=(0.02, -0.02, -0.08)), hung(moved_m=(0.3, -0.2, 0.2))]


@pytest.mark.parametrize("machine", MACHINES)
def test_the_platform_stands_near_its_target_though_it_is_tilted(machine: Machine) -> None:
    physics = Physics(machine, RobotPlant())
    target = np.array([0.3, 0.25, 0.8])
    physics.go(target)
    physics.run(4.0)
    true = np.array(physics.true[-3000:]).mean(axis=0)
    tilted_deg = np.degrees(np.linalg.norm(physics.rotation_rad))
    assert tilted_deg > 2.5
    assert 1e3 * np.linalg.norm(true - target) < 3.0
    told = Rotation.from_quat(np.roll(physics.control.pose[3:], -1))
    off = (told * Rotation.from_matrix(physics.robot.rotation).inv()).as_rotvec(degrees=True)
    assert np.linalg.norm(off[:2]) < 2.0  # about z it is soft
