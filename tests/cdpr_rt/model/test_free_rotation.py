"""A rotation that no cable controls: its equilibrium, frequency and swing."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.predictions import free_rotation
from cdpr_rt.model import free_rotation_kernel as kernel
from cdpr_rt.model.free_rotation_kernel import rotation_of
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.pose import Pose
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.cdpr_rt.platform.platform_physics import Machine, Physics, bar, planar, spatial

OTHERS = Path(__file__).parents[2] / "hil" / "others"
TENSION_N = np.array([40.0, 45.0, 33.0])


def with_mass_at(machine: Machine, centre_m: tuple[float, float]) -> Machine:
    return replace(machine, platform=replace(machine.platform, centre_of_mass_m=centre_m))


class Swinging:
    """The same platform, computed from the potential of its cables' tensions."""

    def __init__(self, machine: Machine, position_m: tuple[float, float]) -> None:
        platform = machine.platform
        self.p, self.centre = np.array(position_m), np.array(platform.centre_of_mass_m)
        self.exits = np.array(platform.exit_points_m)
        self.anchors = np.array(platform.anchor_points_m)
        self.mass = machine.model().platform.mass_kg

    def lengths(self, q: FloatArray) -> FloatArray:
        """Return the lengths where centre of mass and angle are q = (x, y, angle)."""
        c, s = math.cos(q[2]), math.sin(q[2])
        arms = (self.anchors - self.centre) @ np.array([[c, s], [-s, c]])
        return np.asarray(np.linalg.norm(self.exits - q[:2] - arms, axis=1))

    def at(self, angle: float) -> FloatArray:
        c, s = math.cos(angle), math.sin(angle)
        return np.append(self.p + np.array([[c, -s], [s, c]]) @ self.centre, angle)

    def moment(self, angle: float, step: float = 1e-6) -> float:
        """Return the moment of the tensions about the centre of mass."""
        q, turned = self.at(angle), np.array([0.0, 0.0, step])
        more, less = (self.lengths(q + sign * turned) for sign in (1.0, -1.0))
        return -float(TENSION_N @ (more - less)) / (2.0 * step)

    def frequency_Hz(self, angle: float, inertia: float, step: float = 1e-4) -> float:
        """Return the frequency of the swing that changes the lengths least."""
        q, e = self.at(angle), step * np.eye(3)
        J = np.array([self.lengths(q + x) - self.lengths(q - x) for x in e]).T / (2.0 * step)
        H = np.zeros((3, 3))
        for i, j, a, b in itertools.product(range(3), range(3), (1, -1), (1, -1)):
            potential = TENSION_N @ self.lengths(q + a * e[i] + b * e[j])
            H[i, j] += a * b * potential / (4.0 * step**2)
        M = np.diag([self.mass, self.mass, inertia])
        # springs hold the lengths in the two directions of the position
        held = J.T @ J[:, :2] @ np.linalg.inv(J[:, :2].T @ J[:, :2])
        stiff = 1e7 * held @ held.T
        return math.sqrt(float(eigh(H + stiff, M, eigvals_only=True)[0])) / math.tau


@pytest.mark.parametrize("centre_m", [(0.0, 0.0), (0.04, -0.03)])
@pytest.mark.parametrize("position_m", [(-0.3, 1.4), (0.0, 1.6), (0.4, 1.9)])
def test_equilibrium_and_frequency_follow_from_the_potential(
    centre_m: tuple[float, float], position_m: tuple[float, float]
) -> None:
    machine = with_mass_at(bar(), centre_m)
    other, rotation = Swinging(machine, position_m), rotation_of(machine.platform)
    angle = float(brentq(other.moment, -0.6, 0.6))
    Q = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0],
                  [0.0, 0.0, 1.0]])  # fmt: skip
    pose = Pose(np.append(position_m, 0.0), Q)
    kernel.rotational_stiffness(
        machine.model().kinematics.geometry, TENSION_N, pose.array, rotation
    )
    assert rotation[kernel.MOMENT] == pytest.approx(0.0, abs=1e-6)
    omega = math.sqrt(rotation[kernel.STIFFNESS] / rotation[kernel.SWINGING])
    found_Hz = other.frequency_Hz(angle, rotation[kernel.INERTIA])
    assert omega / math.tau == pytest.approx(found_Hz, rel=1e-3)


def test_only_a_wide_bar_swings_far_and_for_long() -> None:
    swings = free_rotation(bar().model())
    assert swings is not None
    assert 1.5 < swings.slowest_Hz < 2.5 < swings.fastest_Hz < 4.5
    assert swings.swing_m > 5e-3 and swings.lasts_s(2e-3) > 10.0
    small = free_rotation(planar().model())
    assert small is not None and small.swing_m < 1e-3 and small.lasts_s(2e-3) == 0.0
    assert free_rotation(spatial().model()) is None
    point = platform_model_of(load_robot(OTHERS / "point-470mm.toml"))
    assert free_rotation(point) is None


@pytest.mark.long
def test_a_simulated_bar_swings_no_further_than_predicted() -> None:
    told = free_rotation(bar().model())
    assert told is not None
    physics = Physics(bar(), RobotPlant())
    physics.go((0.32, 1.71))
    for target in ((-0.32, 1.6), (0.03, 1.41)):
        physics.go(target)
        first = len(physics.true)
        physics.run(1.0)
        swung_m = float(np.ptp(np.array(physics.true[first:]), axis=0).max())
        assert 2.5e-3 < swung_m < 2.0 * told.swing_m
