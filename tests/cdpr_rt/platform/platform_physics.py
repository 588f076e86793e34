"""Robots under their control on simulated physics, without a bus; and two platforms."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles import RobotAxis, load_robot
from cdpr_profiles.catalogue import load_motor
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.model.platform_model import PlatformModel, platform_model
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.motion.trajectory import approach
from cdpr_rt.platform.cable_control import CableControl
from cdpr_sim_bus.cia402.drive import transmission_of
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor_state import MotorRatings, build_motor
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant

PERIOD_S = 1e-3
COUNT_rad = 2.0 * math.pi / 8192
RATED_Nm = 3.0
_PLANAR = load_robot("planar-3")
_CORNERS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]])


@dataclass(frozen=True)
class Machine:
    """A platform, its axes, and the limits of cables and motors."""

    platform: Platform
    axes: tuple[RobotAxis, ...]
    low_N: float
    high_N: float
    torque_Nm: float
    learns: bool = True
    """Whether its control learns the motors' friction and cogging."""

    @property
    def n(self) -> int:
        return len(self.axes)

    def model(self) -> PlatformModel:
        return platform_model(
            self.platform, np.full(self.n, self.low_N), np.full(self.n, self.high_N)
        )

    def control(self) -> CableControl:
        torque_Nm = np.full(self.n, self.torque_Nm)
        return CableControl(self.model(), list(self.axes), torque_Nm, PERIOD_S, learns=self.learns)


def planar() -> Machine:
    """The robot planar-3."""
    assert _PLANAR.platform is not None
    return Machine(_PLANAR.platform, tuple(_PLANAR.axes), 20.0, 150.0, 4.5)


def bar() -> Machine:
    """A bar of 0.4 m on three cables, fastened unevenly: it swings widely at 2 to 4 Hz."""
    motor = load_motor("MPP0922D")
    axes = [replace(axis, winch=replace(axis.winch, motor=motor)) for axis in _PLANAR.axes]
    platform = Platform(
        mass_kg=3.0,
        home_m=(0.0, 1.2),
        home_tolerance_m=0.05,
        workspace_min_m=(-0.4, 1.3),
        workspace_max_m=(0.5, 2.0),
        speed_m_s=0.5,
        acceleration_m_s2=2.0,
        exit_points_m=((-2.0, 3.0), (2.0, 3.0), (0.1, 0.0)),
        anchor_points_m=((-0.15, 0.02), (0.25, 0.0), (0.03, -0.02)),
    )
    return Machine(platform, tuple(axes), 20.0, 120.0, 3.0)


def spatial() -> Machine:
    """A box of 0.5 x 0.2 x 0.6 m on 8 crossed cables in a frame of 4 x 4 x 3 m."""
    low, high = np.full((4, 1), 0.0), np.full((4, 1), 3.0)
    exits = np.vstack([np.hstack([2.0 * _CORNERS, low]), np.hstack([2.0 * _CORNERS, high])])
    across = _CORNERS * [0.25, 0.1]
    anchors = np.vstack([np.hstack([across, low + 0.3]), np.hstack([across, low - 0.3])])
    axis = _PLANAR.axes[0]
    platform = Platform(
        mass_kg=6.0,
        home_m=(0.0, 0.0, 1.0),
        home_tolerance_m=0.05,
        workspace_min_m=(-0.3, -0.3, 1.1),
        workspace_max_m=(0.3, 0.3, 1.7),
        speed_m_s=0.4,
        acceleration_m_s2=1.5,
        exit_points_m=tuple(map(tuple, exits)),
        anchor_points_m=tuple(map(tuple, anchors)),
        workspace_angle_rad=0.15,
        angular_speed_rad_s=0.5,
        angular_acceleration_rad_s2=2.0,
    )
    return Machine(platform, (axis,) * 8, 20.0, 200.0, 6.0)


def hung(
    centre_m: tuple[float, float, float] = (0.0, 0.0, -0.1),
    moved_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Machine:
    """A platform of 12 kg that hangs on 4 cables, 0.2 m apart, which do not control its rotation.

    `moved_m` is the distance of the third exit point from a corner of the frame.
    """
    corners = np.hstack([_CORNERS, np.full((4, 1), 0.0)])
    exits = np.array([1.2, 1.2, 0.0]) * corners + [0.0, 0.0, 2.0]
    exits[2] += moved_m
    platform = Platform(
        mass_kg=12.0,
        home_m=(0.0, 0.0, 0.4),
        home_tolerance_m=0.05,
        workspace_min_m=(-0.4, -0.4, 0.5),
        workspace_max_m=(0.4, 0.4, 1.2),
        speed_m_s=0.3,
        acceleration_m_s2=0.5,
        exit_points_m=tuple(map(tuple, exits)),
        anchor_points_m=tuple(map(tuple, 0.1 * corners)),
        centre_of_mass_m=centre_m,
        inertia_kg_m2=(0.2, 0.15, 0.2, 0.0, 0.0, 0.0),
        controlled=("x", "y", "z"),
        cable_model="elastic",
    )
    return Machine(platform, (_PLANAR.axes[0],) * 4, 10.0, 300.0, 8.0)


def short_arms() -> Machine:
    """A plate of 0.12 m on 8 cables in a frame of 4 x 3 x 2 m, all in one plane of it.

    Turned about z it is held by its pretension, and hardly by its cables' elasticity.
    """
    corners = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    low, high = np.full((4, 1), 0.0), np.full((4, 1), 2.0)
    across = corners * [2.0, 1.5]
    exits = np.vstack([np.hstack([across, high]), np.hstack([across, low])])
    anchors = np.tile(np.hstack([0.06 * corners, low]), (2, 1))
    platform = Platform(
        mass_kg=3.0,
        home_m=(0.0, 0.0, 0.7),
        home_tolerance_m=0.05,
        workspace_min_m=(-0.4, -0.3, 0.8),
        workspace_max_m=(0.4, 0.3, 1.2),
        speed_m_s=0.5,
        acceleration_m_s2=1.0,
        exit_points_m=tuple(map(tuple, exits)),
        anchor_points_m=tuple(map(tuple, anchors)),
    )
    return Machine(platform, (_PLANAR.axes[0],) * 8, 20.0, 200.0, 6.0)


def crossed_rod() -> Machine:
    """A rod of 0.6 m on 7 cables that cross: its pretension turns it away from upright."""
    upper = [(-1.5, -1.2, 2.6), (1.5, -1.2, 2.6), (0.0, 1.6, 2.6)]
    lower = [(-1.4, 1.3, 0.1), (1.4, 1.3, 0.1), (1.3, -1.4, 0.1), (-1.3, -1.4, 0.1)]
    platform = Platform(
        mass_kg=2.0,
        home_m=(0.0, 0.0, 1.0),
        home_tolerance_m=0.05,
        inertia_kg_m2=(0.07, 0.07, 0.002, 0.0, 0.0, 0.0),
        workspace_min_m=(-0.25, -0.2, 1.1),
        workspace_max_m=(0.25, 0.2, 1.5),
        speed_m_s=0.5,
        acceleration_m_s2=1.5,
        exit_points_m=(*upper, *lower),
        anchor_points_m=((0.0, 0.0, -0.3),) * 3 + ((0.0, 0.0, 0.3),) * 4,
        controlled=("x", "y", "z", "rx", "ry"),
    )
    return Machine(platform, (_PLANAR.axes[0],) * 7, 20.0, 150.0, 4.5)


def shipped(name: str) -> Machine:
    """Return a shipped robot."""
    robot = load_robot(name)
    assert robot.platform is not None
    limits = limits_of(robot)
    bounds = [float(np.min(b)) for b in (limits.tension_min_N, limits.tension_max_N)]
    return Machine(robot.platform, tuple(robot.axes), *bounds, float(np.min(limits.torque_Nm)))


class Physics:
    """The simulated robot: the command of one cycle acts in the next."""

    def __init__(self, machine: Machine, plant: RobotPlant) -> None:
        platform, n = machine.platform, machine.n
        shape = RobotShape(
            platform.exit_points_m,
            platform.anchor_points_m,
            platform.mass_kg,
            platform.home_m,
            platform.cable_weights_N_m if any(platform.cable_weights_N_m) else [0.122] * n,
            platform.home_rotation_rad,
            platform.inertia_kg_m2,
            platform.centre_of_mass_m,
        )
        self.robot = CableRobot(shape, plant, [transmission_of(a.winch) for a in machine.axes])
        for i, motor in enumerate(plant.motor_plants(n)):
            self.robot.adopt(i, build_motor(motor, MotorRatings()), self._asks(i))
        self.control = control = machine.control()
        self.model = control.model
        self.feedback, self.setpoint, self.torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
        self.feedback.valid[:] = True
        self._acting = np.zeros(n)
        self._now_s = 0.0
        for k in range(1500):  # tight and with known lengths: no start-up is needed
            self.torque[:] = -0.026 * machine.low_N * min(1.0, k / 1000)
            self._cycle()
        control.take_lengths(self.robot.motors["cable_start"].copy(), AxisFeedback(n))
        control.begin(self.feedback)
        control.stand_still()
        self.tension_N: list[FloatArray] = []
        self.true: list[FloatArray] = []
        self.wanted: list[FloatArray] = []
        self.target = control.position.copy()
        self.run(1.0)

    def _asks(self, i: int) -> Callable[[], tuple[int, float]]:
        return lambda: (servo.TORQUE, float(np.round(self._acting[i] / RATED_Nm * 1000)))

    def _cycle(self) -> None:
        self._now_s += PERIOD_S
        for i in range(len(self.torque)):
            sample = self.robot.step(i, self._now_s)
            self.feedback.position_rad[i] = sample[1] * COUNT_rad
        self._acting = self.torque.copy()
        self.feedback.cycle += 1

    @property
    def rotation_rad(self) -> FloatArray:
        """True rotation vector from home, (3,)."""
        home = self.model.home_pose.Q
        return np.asarray(Rotation.from_matrix(self.robot.rotation @ home.T).as_rotvec())

    def run(self, seconds: float, until_rest: bool = False) -> None:
        """Follow the target for this time, or with `until_rest` until the set-point has arrived."""
        c, model = self.control, self.model
        for _ in range(round(seconds / PERIOD_S)):
            self._cycle()
            there = approach(
                self.target, model.speed, model.acceleration, PERIOD_S,
                c.position, c.velocity, c.acceleration,
            )  # fmt: skip
            c.update(self.feedback, self.setpoint, self.torque)
            self.tension_N.append(self.robot.tension_N)
            self.wanted.append(c.shaped.copy())
            truth = np.concatenate([self.robot.position_m, self.rotation_rad])
            self.true.append(truth[list(model.kinematics.directions)])
            if until_rest and there:
                return

    def go(self, target: Sequence[float] | FloatArray) -> FloatArray:
        """Go there and rest; return the true and the wanted positions on the way, (2, k, d)."""
        first = len(self.true)
        self.target = np.array(target, float)
        self.run(8.0, until_rest=True)
        self.run(1.5)
        return np.array([self.true[first:], self.wanted[first:]])


def with_friction(coulomb_Nm: float) -> RobotPlant:
    """Return a plant whose motors have this friction."""
    motor = RobotPlant().motor
    friction = motor.friction.model_copy(
        update={"coulomb_Nm": coulomb_Nm, "breakaway_Nm": 1.25 * coulomb_Nm}
    )
    return RobotPlant(motor=motor.model_copy(update={"friction": friction}))


def heavier(machine: Machine, mass_kg: float) -> Machine:
    """Return a robot whose platform has another mass."""
    return dataclasses.replace(
        machine, platform=dataclasses.replace(machine.platform, mass_kg=mass_kg)
    )
