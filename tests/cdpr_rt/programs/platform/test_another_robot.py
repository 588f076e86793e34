"""A robot of another kind, moved by the same programs: they ask for what the interface names alone.

Each coordinate of its carriage has a belt and a motor of its own. Nothing of the model of cables
from exit points is in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.programs.arguments import ProgramError
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.pose import PoseProgram
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.kinematics.pose import Pose
from tests.cdpr_rt.programs.ideal_platform import NothingFound

PERIOD_S, BELT_m, INERTIA_kg_m2, TORQUE_Nm = 1e-3, 0.02, 1e-4, 2.0
PLATFORM = Platform(
    mass_kg=1.0,
    home_m=(0.0, 0.5),
    home_tolerance_m=0.05,
    workspace_min_m=(-0.5, 0.5),
    workspace_max_m=(0.5, 1.0),
    speed_m_s=0.5,
    acceleration_m_s2=2.0,
    exit_points_m=((0.0, 0.0), (0.0, 2.0)),
    anchor_points_m=((0.0, 0.0), (0.0, 0.0)),
)
_POST_m = 0.3


class Belts:
    """Kinematics, tensions and workspace at once: a belt's length is its coordinate."""

    directions = (0, 1)

    def lengths(self, pose: Pose) -> FloatArray:
        return np.array(pose.array[0, :2])

    def wrench_matrix(self, pose: Pose, out: FloatArray | None = None) -> FloatArray:
        W = np.empty((2, 2)) if out is None else out
        W[:] = -np.eye(2)
        return W

    def solve(self, W: FloatArray, w_e: FloatArray, t_out: FloatArray) -> TensionOutcome:
        t_out[:] = w_e
        return TensionOutcome.FEASIBLE

    def capacity_margins(self, poses: FloatArray, least_N: float) -> FloatArray:
        return np.full(len(poses), 10.0)


class Carriage:
    """The model: what the file says of it."""

    platform, kinematics = PLATFORM, Belts()
    positions = size = 2
    angle_rad = 0.0
    low_N, high_N = np.full(2, -100.0), np.full(2, 100.0)
    torque_limited_N = high_N
    home, wrench_scale = np.array(PLATFORM.home_m), np.ones(2)
    speed, acceleration = np.full(2, PLATFORM.speed_m_s), np.full(2, PLATFORM.acceleration_m_s2)
    jerk = np.full(2, PLATFORM.jerk_m_s3)

    @property
    def home_pose(self) -> Pose:
        return self.pose(self.home)

    def weight(self) -> FloatArray:
        return np.zeros(2)

    def pose(self, position: FloatArray) -> Pose:
        return Pose(np.array([*position, 0.0]))

    def poses(self, positions: FloatArray) -> FloatArray:
        return np.array([self.pose(position).array for position in positions])

    def least_tensions(self, low_N: FloatArray, high_N: FloatArray) -> Belts:
        return self.kinematics

    def workspace(self, acceleration_m_s2: float | None = None) -> Belts:
        return self.kinematics

    def contact_on_way(self, positions: FloatArray, looks: int) -> str:
        return ""


class BeltControl:
    """A PD loop for each motor; a post stands where the carriage may not go."""

    learnt_Nm = None
    swing_rad = swing_m = 0.0

    def __init__(self) -> None:
        self.position, self.velocity, self.acceleration = np.zeros((3, 2))
        self.estimated, self.free_lengths_m, self.zero_m, self.before_rad = np.zeros((4, 2))
        self.tension_N, self.least_N, self.low_N = np.zeros((3, 2))
        self.effort_Nm, self.compensation_Nm, self.motor_loss_Nm, self.cogging_Nm = np.zeros((4, 2))
        self.torque_Nm, self.inertia_kg_m2 = np.full(2, TORQUE_Nm), np.full(2, INERTIA_kg_m2)
        self.shaped, self.residual_m, self.suspect = self.position, 0.0, -1

    @property
    def pose(self) -> FloatArray:
        return np.array([*self.estimated, 0.0, 1.0, 0.0, 0.0, 0.0])

    def notices(self) -> list[str]:
        return []

    def reset(self) -> None: ...
    def forget_motors(self) -> None: ...
    def clear_notices(self) -> None: ...
    def clear_compensation(self) -> None: ...

    pull_fit = NothingFound()

    def measure_tensions(self, tension_N: FloatArray, measured: BoolArray) -> None: ...

    def begin(self, feedback: AxisFeedback) -> None:
        self.observe(feedback)

    def observe(self, feedback: AxisFeedback) -> None:
        self.estimated[:] = self.zero_m + BELT_m * feedback.position_rad

    def stand_still(self, *, on_stand: bool = False) -> None:
        self.position[:] = self.estimated
        self.velocity[:] = self.acceleration[:] = 0.0

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        return np.array(PLATFORM.home_m)

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        self.zero_m[:] = length_m - BELT_m * feedback.position_rad

    def tension_infeasibility(self) -> str:
        return ""

    def is_feasible(self, position: FloatArray) -> bool:
        return not self.infeasibility(position)

    def contact_ahead(self, position: FloatArray) -> int:
        return -1

    def contact_at(self, position: FloatArray) -> int:
        return -1

    def contact(self, pair: int) -> str:
        return ""

    def infeasibility(self, position: FloatArray) -> str:
        return "a post stands there" if position[0] > _POST_m else ""

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        return self.infeasibility(position)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        self.observe(feedback)
        setpoint.position_rad[:] = (self.position - self.zero_m) / BELT_m
        setpoint.velocity_rad_s[:] = self.velocity / BELT_m
        setpoint.acceleration_rad_s2[:] = self.acceleration / BELT_m
        error = setpoint.position_rad - feedback.position_rad
        slope = setpoint.velocity_rad_s - (feedback.position_rad - self.before_rad) / PERIOD_S
        self.before_rad[:] = feedback.position_rad
        torque_Nm[:] = INERTIA_kg_m2 * (setpoint.acceleration_rad_s2 + 900.0 * error + 60.0 * slope)


class Machine:
    """The carriage's two rotors under the program `pose`."""

    def __init__(self) -> None:
        self.control = BeltControl()
        self.parts = PlatformParts(Carriage(), self.control, Estimator(2, PERIOD_S), PERIOD_S)
        stream = PoseStream(SharedBlock.create(2, 1.0, 1.0 / PERIOD_S), PERIOD_S)
        self.program = PoseProgram(self.parts, np.full(2, TORQUE_Nm), stream)
        self.feedback, self.setpoint, self.torque = AxisFeedback(2), Setpoint(2), np.zeros(2)
        self.feedback.valid[:] = True
        self.speed_rad_s = np.zeros(2)
        self.parts.assume_at_home(self.feedback)
        self.parts.estimator.set_lengths(np.zeros(2), np.array(PLATFORM.home_m))
        self.parts.estimator.update(self.feedback)
        self.program.start(self.feedback, self.setpoint, self.torque)

    def command(self, **wanted: Any) -> None:
        keys: Mapping[str, Any] = wanted
        self.program.check(keys)
        self.program.command(keys)

    def until_done(self) -> None:
        for _ in range(10_000):
            self.feedback.cycle += 1
            self.program.update(self.feedback, self.setpoint, self.torque)
            self.speed_rad_s += PERIOD_S * self.torque / INERTIA_kg_m2
            self.feedback.position_rad += PERIOD_S * self.speed_rad_s
            if self.program.progress()["done"]:
                return
        raise AssertionError("does not arrive")


def test_the_program_pose_moves_a_robot_that_has_no_exit_points() -> None:
    machine = Machine()
    machine.command(position_m=[0.2, 0.8])
    machine.until_done()
    there = np.array(PLATFORM.home_m) + BELT_m * machine.feedback.position_rad
    assert there == pytest.approx([0.2, 0.8], abs=1e-3)
    assert machine.program.progress()["position_m"] == pytest.approx([0.2, 0.8], abs=1e-3)


def test_where_it_cannot_stand_is_said_in_the_words_of_its_own_control() -> None:
    machine = Machine()
    with pytest.raises(ProgramError, match="a post stands there"):
        machine.command(position_m=[0.4, 0.8])
