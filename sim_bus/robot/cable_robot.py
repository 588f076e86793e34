"""One simulated cable robot: the physics that its drives share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.logs.platform_record import RobotShape, build_platform
from cdpr_sim_bus.robot.motor import sample_of
from cdpr_sim_bus.robot.motor_state import LOAD_KINDS, MOTOR_DTYPE, MotorArray, Transmission
from cdpr_sim_bus.robot.robot_motion import run_together, update_ends
from cdpr_sim_bus.robot.robot_plant import RobotPlant

_LONGEST_STEP_S = 1e-3
_SAME_TIME_S = 1e-12
FloatArray = NDArray[np.float64]
MotorSample = tuple[int, int, int, int, float, float, float, float, float, float]
"""A `motor.Sample` as the kernels return it."""
MotorCommand = Callable[[], tuple[int, float]]
"""Returns a kind of control, named in `servo`, and its target, as a power stage is set now."""


class CableRobot:
    """Motors, cables and platform; each drive advances it and reads its own motor.

    The first drive that asks for an instant advances all, with every power stage as it is then.
    """

    def __init__(
        self, shape: RobotShape, plant: RobotPlant, transmissions: Sequence[Transmission]
    ) -> None:
        self.n = n = len(transmissions)
        self.motors: MotorArray = np.zeros(n, MOTOR_DTYPE)
        """Taken over by `adopt`, one record each."""
        self.kinds: NDArray[np.int64] = np.full(n, servo.OFF, np.int64)
        self.targets: FloatArray = np.zeros(n)
        self._flags: NDArray[np.int64] = np.zeros(n, np.int64)
        self._plant = plant
        self._rng = np.random.default_rng([plant.seed, 1])
        self._transmissions = list(transmissions)
        self._weights = list(shape.weights_N_m)
        self._slips = sorted(plant.cables.slips, key=lambda slip: slip.at_s)
        self.platform = build_platform(shape, plant, n, self._rng)
        # have it compiled now, before the clock runs
        run_together(self.motors, self.platform, 0.0, self.kinds, self.targets, self._flags)
        self.commands: list[MotorCommand] = [lambda: (servo.OFF, 0.0)] * n
        """Returns the present command of each power stage."""

    def adopt(self, i: int, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """Connect motor `i`, a record of shape (1,), to its cable; return the record to use."""
        self.commands[i] = command
        self.motors[i] = motor[0]
        motor = self.motors[i : i + 1]
        plant, transmission = self._plant.cables, self._transmissions[i]
        error = float(self._rng.normal(0.0, plant.drum_radius_sigma))
        if plant.drum_radius_errors:
            error += plant.drum_radius_errors[i]
        gain = transmission.cable_m_per_rad * (1.0 + error)
        motor["load_kind"] = LOAD_KINDS.index("platform")
        motor["cable_gain"] = gain
        motor["rigidity"] = transmission.cable_stiffness_N * (1.0 + plant.stiffness_error)
        motor["weight"] = self._weights[i] if plant.sag else 0.0
        known_s, true_s = transmission.cable_damping_s, plant.damping_s
        motor["damping_time"] = known_s if true_s is None else true_s
        motor["creep_share"] = plant.creep_shares
        motor["creep_rate"] = 1.0 / np.array(plant.creep_times_s)
        motor["winch_friction"] = plant.winch_friction_Nm
        motor["friction_share"] = plant.friction_share * abs(gain)
        winding = self._plant.winding
        motor["drum_gain"] = 1.0 / transmission.gear_ratio
        radius = gain * transmission.gear_ratio
        motor["gear_yield"] = radius**2 / self._plant.winding.gear_stiffness_Nm_rad
        motor["run_out"] = winding.run_out_m
        motor["run_out_phase"] = self._rng.uniform(0.0, 2.0 * math.pi)
        motor["lag"] = winding.carriage_error * winding.pitch_m / (2.0 * math.pi)
        motor["carriage_offset"] = winding.carriage_offset_m
        motor["carriage_distance"] = winding.carriage_distance_m
        motor["angle_start"] = motor["angle"]
        slack_m = np.broadcast_to(self._plant.start.slack_m, self.n)
        motor["cable_start"] = self.distance_m(i) + float(slack_m[i])
        return motor

    def step(self, i: int, until: float) -> MotorSample:
        """Advance all to `until`, return the `motor.Sample` of motor `i`."""
        now = float(self.motors["time"][i])
        if until - now > _SAME_TIME_S:
            for k, command in enumerate(self.commands):
                self.kinds[k], self.targets[k] = command()
        while until - now > _SAME_TIME_S:
            now = min(until, now + _LONGEST_STEP_S) if until - now > 1.5e-3 else until
            run_together(self.motors, self.platform, now, self.kinds, self.targets, self._flags)
        while self._slips and self._slips[0].at_s <= now:
            due = self._slips.pop(0)
            self.slip(due.cable - 1, due.slip_m)
        flags, self._flags[i] = int(self._flags[i]), 0
        return sample_of(self.motors[i : i + 1], flags)

    def members(self) -> list[RobotMember]:
        """Return each motor's part in the robot."""
        return [RobotMember(self, i) for i in range(self.n)]

    @property
    def position_m(self) -> FloatArray:
        """True position of the platform's origin, (3,)."""
        p = self.platform[0]
        return np.asarray(p["position"] - p["rotation"] @ p["com"])

    @property
    def rotation(self) -> FloatArray:
        """True rotation from the platform's frame to the room, (3, 3)."""
        return np.array(self.platform[0]["rotation"])

    @property
    def tension_N(self) -> FloatArray:
        """True tension of each cable at its winch, (n,)."""
        return np.array(self.motors["winch_tension"])

    def cut(self, i: int) -> None:
        """Cut cable `i` for good."""
        self.motors["rigidity"][i] = 1e-9
        self.motors["weight"][i] = 0.0

    def slip(self, i: int, metres: float) -> None:
        """Let so much of cable `i` slip through its fastening on the drum."""
        self.motors["cable_start"][i] += metres

    def distance_m(self, i: int) -> float:
        """Return the way of cable `i` from its exit to its anchor point, over its pulley, m."""
        update_ends(self.platform, self.motors)
        return float(self.motors["far_distance"][i])


@dataclass(frozen=True)
class RobotMember:
    """One motor's part in the robot, for the drive that it belongs to."""

    robot: CableRobot
    number: int

    def adopt(self, motor: MotorArray, command: MotorCommand) -> MotorArray:
        """See `CableRobot.adopt`."""
        return self.robot.adopt(self.number, motor, command)

    def step(self, until: float) -> MotorSample:
        """See `CableRobot.step`."""
        return self.robot.step(self.number, until)

    def cut(self) -> None:
        """See `CableRobot.cut`."""
        self.robot.cut(self.number)

    def slip(self, metres: float) -> None:
        """See `CableRobot.slip`."""
        self.robot.slip(self.number, metres)
