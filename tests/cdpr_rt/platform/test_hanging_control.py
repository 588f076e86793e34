"""The control of a platform that hangs on too few cables, on simulated physics."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_sim_bus.robot.robot_plant import PlatformPlant, RobotPlant
from tests.cdpr_rt.platform.platform_physics import Machine, Physics, hung

pytestmark = pytest.mark.long

MACHINES = {
    "mass beside the middle": hung(centre_m=(0.02, -0.02, -0.08)),
    "one exit point elsewhere": hung(moved_m=(0.3, -0.2, 0.2)),
}
TARGET_m = np.array([0.3, 0.25, 0.8])


class Sensed(Physics):
    """The simulated robot, with ideal load cells or an ideal inclinometer."""

    def __init__(
        self, machine: Machine, plant: RobotPlant, *, cells: bool, tilt: bool, turned_deg: float = 0
    ) -> None:
        self._reads, self._mounting = (cells, tilt), Rotation.from_euler("x", turned_deg, True)
        self.read_N, self.measured, self.upward = np.zeros(4), np.zeros(4, bool), np.zeros(4)
        super().__init__(machine, plant)

    def _cycle(self) -> None:
        super()._cycle()
        if self.feedback.cycle == 1:
            self.control.measure_tensions(self.read_N, self.measured, self.upward)
        cells, tilt = self._reads
        if cells:
            self.read_N[:], self.measured[:] = self.robot.tension_N, True
        if tilt:
            self.upward[:] = 1.0, *self._mounting.apply(self.robot.rotation[2])

    def rest(self) -> tuple[float, FloatArray, float]:
        """Go to the target and rest there.

        Return the error of the mean true position and the swing, in mm, and the rotation vector
        from the true to the estimated orientation, deg.
        """
        self.go(TARGET_m)
        self.run(4.0)
        true = np.array(self.true[-2500:])
        told = Rotation.from_quat(np.roll(self.control.pose[3:], -1))
        off = (told * Rotation.from_matrix(self.robot.rotation).inv()).as_rotvec(degrees=True)
        swing_mm = 1e3 * float(np.ptp(true, axis=0).max())
        return 1e3 * float(np.linalg.norm(true.mean(axis=0) - TARGET_m)), off, swing_mm


@cache
def blind(name: str) -> tuple[float, FloatArray, float, float]:
    """Return the figures of `rest` without sensors, and how far the platform is turned, deg."""
    physics = Sensed(MACHINES[name], RobotPlant(), cells=False, tilt=False)
    return *physics.rest(), float(np.degrees(np.linalg.norm(physics.rotation_rad)))


@pytest.mark.parametrize("name", MACHINES)
def test_the_platform_stands_near_its_target_though_it_is_tilted(name: str) -> None:
    error_mm, off_deg, _, turned_deg = blind(name)
    assert turned_deg > 5.0
    assert error_mm < 1.5
    assert np.linalg.norm(off_deg[:2]) < 2.0  # about z it is soft


def test_an_inclinometer_corrects_a_wrong_centre_of_mass() -> None:
    plant = RobotPlant(platform=PlatformPlant(centre_of_mass_m=(0.012, 0.0, -0.1)))
    without_mm, without_deg, _ = Sensed(hung(), plant, cells=False, tilt=False).rest()
    error_mm, off_deg, _ = Sensed(hung(), plant, cells=False, tilt=True).rest()
    assert np.linalg.norm(without_deg[:2]) > 3.0 * np.linalg.norm(off_deg[:2])
    assert error_mm < 1.5 < without_mm


def test_a_wrongly_mounted_inclinometer_is_reported_and_has_a_bounded_effect() -> None:
    machine = MACHINES["mass beside the middle"]
    physics = Sensed(machine, RobotPlant(), cells=False, tilt=True, turned_deg=180.0)
    physics.control.stand_still(on_stand=True)
    assert "another orientation than that at home" in physics.control.notices()[0]
    error_mm, _, _ = physics.rest()
    assert "contradicts lengths, tensions and weight" in physics.control.notices()[0]
    assert error_mm < 25.0


def test_the_reported_swing_is_that_of_the_platform() -> None:
    physics = Sensed(MACHINES["mass beside the middle"], RobotPlant(), cells=False, tilt=True)
    physics.go(TARGET_m)
    physics.run(2.0)
    swung_rad, upward = [], []
    for _ in range(1500):
        physics.run(1e-3)
        upward.append(physics.robot.rotation[2])
        swung_rad.append(physics.control.swing_rad)
    ways = np.array(upward)
    half_rad = 0.5 * np.linalg.norm(np.ptp(ways, axis=0))
    assert half_rad > np.radians(0.5)
    assert np.mean(swung_rad) == pytest.approx(half_rad, rel=0.5)
    assert physics.control.swing_m > 1e-3


def test_sensors_do_not_let_the_control_drive_a_swing() -> None:
    name = "mass beside the middle"
    _, _, swing_mm, _ = blind(name)
    _, _, sensed_mm = Sensed(MACHINES[name], RobotPlant(), cells=True, tilt=True).rest()
    assert sensed_mm < 1.3 * swing_mm
