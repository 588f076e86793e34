"""The simulated parts of a robot: cables, platform and motors, and their true geometry."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_sim_bus.cia402.drive import SimDrive, transmission_of
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor_state import Transmission
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.errors import BadInputError


def physics_of(
    robot: Robot, plant: Path | None, detached: bool
) -> tuple[CableRobot | None, Sequence[Plant]]:
    """Return the body that all axes move, or None, and the plant of each motor.

    Raises BadInputError if the plant file does not fit the robot.
    """
    n, platform = len(robot.axes), robot.platform
    if platform is None:
        one = Plant.load_file(plant)
        return None, [one.model_copy(update={"seed": (one.seed + i) % 2**32}) for i in range(n)]
    whole = RobotPlant.load_file(plant)
    try:
        whole.require_fit(n, len(platform.home_m))
        motors = whole.motor_plants(n, [axis.winch for axis in robot.axes])
        if detached:
            return None, motors
        return CableRobot(_shape(robot, platform), whole, _transmissions(robot)), motors
    except ValueError as error:
        raise BadInputError(f"--plant {plant}: {error}") from error


@dataclass(frozen=True)
class TrueGeometry:
    """The true geometry of a simulated robot, to evaluate a calibration."""

    exit_points_m: NDArray[np.float64]
    """(n, 3)"""
    drum_errors: NDArray[np.float64]
    """Relative error of the cable paid out by one turn of each motor, (n,)."""
    elongation_error: float
    """Relative error of the cables' elongation without creep."""


def true_geometry(robot: Robot, plant: Path | None) -> TrueGeometry:
    """Return the truth of a robot's simulator; raises BadInputError."""
    assert robot.platform is not None  # callers calibrate its cables
    body, plants = physics_of(robot, plant, detached=False)
    assert body is not None  # there is a platform on the cables
    drives = [
        SimDrive.for_winch(axis.winch, plant, robot=member)
        for axis, plant, member in zip(robot.axes, plants, body.members(), strict=True)
    ]
    for drive in drives:
        drive.close()
    nominal = np.array([one.cable_m_per_rad for one in _transmissions(robot)])
    return TrueGeometry(
        body.platform["exit"][0][: body.n].copy(),
        np.abs(body.motors["cable_gain"]) / np.abs(nominal) - 1.0,
        1.0 / (1.0 + RobotPlant.load_file(plant).cables.stiffness_error) - 1.0,
    )


def _shape(robot: Robot, platform: Platform) -> RobotShape:
    body = platform.body
    return RobotShape(
        exit_points_m=platform.exit_points_m,
        anchor_points_m=platform.anchor_points_m,
        mass_kg=platform.mass_kg,
        home_m=platform.home_m,
        weights_N_m=[axis.winch.cable.weight_per_length_N_m for axis in robot.axes],
        home_rotation_rad=platform.home_rotation_rad,
        inertia_kg_m2=platform.inertia_kg_m2,
        centre_of_mass_m=platform.centre_of_mass_m,
        pulley_radii_m=platform.pulley_radius_m,
        pulley_axes=platform.pulley_axes,
        feet_m=(
            None
            if body is None
            else list(itertools.product(*zip(body.min_m, body.max_m, strict=True)))
        ),
    )


def _transmissions(robot: Robot) -> list[Transmission]:
    return [transmission_of(axis.winch) for axis in robot.axes]
