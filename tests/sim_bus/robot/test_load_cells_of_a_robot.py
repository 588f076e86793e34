"""Load cells at the cables of a platform read the true tensions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_profiles import load_robot
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_sim_bus.cia402.drive import SimDrive, transmission_of
from cdpr_sim_bus.devices.sim_load_cells import AmplifierPlant, SimAmplifier
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant

SENSORS = "rtu-load-cells-8"
PLANT = {
    "start": {"slack_m": 0.0, "position_m": (0.5, 0.3, 1.5)},
    "floor": {"present": False},
    "platform": {"air_Ns_m": 1000.0},
}


def test_each_cell_reads_the_tension_of_its_cable(tmp_path: Path) -> None:
    robot = load_robot("suspended-8")
    platform = robot.platform
    assert platform is not None
    n = len(robot.axes)
    winches = [axis.winch for axis in robot.axes]
    plant = RobotPlant.model_validate(PLANT)
    shape = RobotShape(
        platform.exit_points_m, platform.anchor_points_m, 100.0, platform.home_m, [0.5] * n
    )
    body = CableRobot(shape, plant, [transmission_of(winch) for winch in winches])
    motors = plant.motor_plants(n, winches)
    drives = [
        SimDrive.for_winch(winch, own, robot=member)
        for winch, own, member in zip(winches, motors, body.members(), strict=True)
    ]
    profile = load_tension_sensors(SENSORS)
    exact = AmplifierPlant(gain_error=0.0, zero_spread_N=0.0, noise_N=0.0)
    with PhysicsBoard.create(tmp_path / "board", n) as board:
        axes = [board.axis(i) for i in range(n)]
        for drive, axis in zip(drives, axes, strict=True):
            drive.connect(axis)
            axis.brake_released = False  # the brakes hold the platform
        cells = [
            SimAmplifier(profile, sensor, exact, axis)
            for sensor, axis in zip(profile.sensors, axes, strict=True)
        ]
        for k in range(1, 1501):
            for drive in drives:
                drive.advance(1e-3 * k)
            if k % 100 == 0:
                read = np.array([cell.measured_N() for cell in cells])
    true = body.tension_N
    assert np.ptp(true) > 20.0, "tensions of all cables differ"
    assert np.allclose(read, true, rtol=2e-3, atol=0.1)
    p = body.platform[0]
    # tension is lower at mid-cable than at the winch, and the platform bears half of each cable
    weight_N_m, motors = 0.5, body.motors
    halfway = true - 0.5 * weight_N_m * motors["far_drop"]
    carried_N = 980.665 + 0.5 * weight_N_m * motors["far_distance"].sum()
    assert np.allclose(halfway @ p["way"][:n], (0.0, 0.0, carried_N), atol=1.0)
