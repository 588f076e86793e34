"""A platform on cables without drives, and physical quantities of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor_state import MotorRatings, Transmission, build_motor
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant

SIDE_m = 0.15
HEIGHT_m = SIDE_m * math.sqrt(3.0) / 2.0
EXITS_m = ((-2.0, 3.0), (2.0, 3.0), (0.0, 0.0))
ANCHORS_m = (
    (-SIDE_m / 2.0, HEIGHT_m / 3.0),
    (SIDE_m / 2.0, HEIGHT_m / 3.0),
    (0.0, -2.0 * HEIGHT_m / 3.0),
)
SMOOTH = {
    "cogging": (),
    "friction": {"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.0},
}
"""A motor without friction and cogging."""


def body(
    *,
    exits: ArrayLike = EXITS_m,
    anchors: ArrayLike = ANCHORS_m,
    home: Sequence[float] = (0.2, 1.5),
    smooth: bool = True,
    locked: bool = False,
    pretension_N: float = 30.0,
    mass_kg: float = 4.0,
    weight_N_m: float = 0.0,
    shape: dict[str, Any] | None = None,
    **plant: Any,
) -> CableRobot:
    """Return a robot whose cables are taut at power-up.

    `shape` are further fields of its RobotShape, and `plant` sections of its plant file.
    """
    sections = {
        "cables": {
            "damping_s": 0.0,
            "sag": weight_N_m > 0.0,
            "friction_share": 0.0,
            "creep_shares": (0.0, 0.0),
        },
        "floor": {"present": False},
        "platform": {"air_Ns_m": 0.0},
        "start": {"slack_m": 0.0},
        "winding": {
            "run_out_m": 0.0,
            "carriage_error": 0.0,
            "carriage_offset_m": 0.0,
            "gear_stiffness_Nm_rad": 1e9,
        },
    }
    for name, table in plant.items():
        sections[name] = {**sections.get(name, {}), **table}
    motor = SMOOTH if smooth else {}
    whole = RobotPlant.model_validate({**sections, "motor": motor})
    n = len(np.asarray(exits))
    form = RobotShape(exits, anchors, mass_kg, home, [weight_N_m] * n, **(shape or {}))
    robot = CableRobot(form, whole, [Transmission()] * n)
    for i, own in enumerate(whole.motor_plants(n) if not smooth else [whole.motor] * n):
        robot.adopt(
            i, build_motor(Plant.model_validate(own), MotorRatings()), lambda: (servo.OFF, 0.0)
        )
    if pretension_N:
        robot.motors["cable_start"] *= 1.0 - pretension_N / robot.motors["rigidity"]
    if locked:
        robot.motors["brake"] = 1e6
    return robot


def free_length_m(robot: CableRobot) -> NDArray[np.float64]:
    m = robot.motors
    return np.asarray(m["cable_start"] + m["cable_gain"] * (m["angle"] - m["angle_start"]))


def energy_J(robot: CableRobot) -> float:
    """Return the sum of kinetic, potential and strain energy, for cables without weight."""
    p, m = robot.platform[0], robot.motors
    spin = p["rotation"].T @ p["spin"]
    total = 0.5 * p["mass"] * float(p["velocity"] @ p["velocity"])
    total += 0.5 * float(spin @ p["inertia"] @ spin)
    total -= p["mass"] * float(p["gravity"] @ p["position"])
    free = free_length_m(robot)
    for i in range(robot.n):
        stretch = max(0.0, robot.distance_m(i) - free[i])
        total += 0.5 * m["rigidity"][i] / free[i] * stretch**2
    return total + 0.5 * float(np.sum(m["inertia"] * m["velocity"] ** 2))


def run(
    robot: CableRobot, seconds: float, torque_units: float | None = None, begin_s: float = 0.0
) -> None:
    """Advance all axes, with power stages off or one common torque command."""
    command = servo.OFF if torque_units is None else servo.TORQUE, torque_units or 0.0
    robot.commands = [lambda: command] * robot.n
    for k in range(1, round(seconds * 1e3) + 1):
        for i in range(robot.n):
            robot.step(i, begin_s + k * 1e-3)
