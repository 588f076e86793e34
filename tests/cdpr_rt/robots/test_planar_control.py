"""A platform's control: on simulated physics, and beside the same computation in NumPy."""

from __future__ import annotations

import dataclasses
import math
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.exchange import AxisFeedback, Setpoint
from cdpr_rt.robots.planar_control import PlanarControl
from cdpr_rt.robots.planar_kinematics import GeometryError
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.pose_stream import PoseStream
from cdpr_rt.runtime.programs.platform_program import PlatformParts
from cdpr_rt.runtime.programs.pose import PoseProgram
from cdpr_rt.runtime.robot_arrays import winches_of
from cdpr_rt.runtime.shared_block import SharedBlock
from profiles import Winch, load_robot
from sim_bus import servo
from sim_bus.cable_robot import CableRobot, RobotShape
from sim_bus.drive import transmission_of
from sim_bus.motor_state import MotorRatings, build_motor
from sim_bus.robot_plant import RobotPlant
from tools.bench.planar import Motion, planar_controls, run_block

PERIOD_S = 1e-3
ROBOT = load_robot("planar-3")
PLATFORM = ROBOT.platform
LOW_N, HIGH_N, TORQUE_Nm = np.full(3, 20.0), np.full(3, 150.0), np.full(3, 4.5)
COUNT_rad = 2.0 * math.pi / 8192
RATED_Nm = 3.0
assert PLATFORM is not None


class Physics:
    """The simulated robot without a bus: what is asked for in one cycle acts in the next."""

    def __init__(self, plant: RobotPlant) -> None:
        assert PLATFORM is not None
        shape = RobotShape(
            PLATFORM.exit_points_m,
            PLATFORM.anchor_points_m,
            PLATFORM.mass_kg,
            PLATFORM.home_m,
            [0.122] * 3,
        )
        self.robot = CableRobot(shape, plant, [transmission_of(a.winch) for a in ROBOT.axes])
        for i, motor in enumerate(plant.motor_plants(3)):
            self.robot.adopt(i, build_motor(motor, MotorRatings()), self._asks(i))
        estimator = Estimator(3, PERIOD_S, winches_of(ROBOT.axes))
        self.control = PlanarControl(PLATFORM, list(ROBOT.axes), LOW_N, HIGH_N, TORQUE_Nm, PERIOD_S)
        parts = PlatformParts(PLATFORM, self.control, estimator, PERIOD_S, HIGH_N)
        block = SharedBlock.create(3, 1.0, 1000.0)
        self.program = PoseProgram(parts, TORQUE_Nm, PoseStream(block, PERIOD_S))
        self.feedback, self.setpoint, self.torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
        self.feedback.valid[:] = True
        self._acting = np.zeros(3)
        self._now_s = 0.0
        for k in range(1500):  # tight as it stands, its lengths known: no start-up here
            self.torque[:] = -0.026 * 20.0 * min(1.0, k / 1000)
            self.cycle()
        start_m = self.robot.motors["cable_start"]
        estimator.set_lengths(np.zeros(3), start_m)
        estimator.update(self.feedback)
        parts.tight = True
        self.program.start(self.feedback, self.setpoint, self.torque)
        self.run(1.0)
        self.tension_N: list[np.ndarray] = []
        self.true_m: list[np.ndarray] = []

    def _asks(self, i: int) -> Callable[[], tuple[int, float]]:
        return lambda: (servo.TORQUE, float(np.round(self._acting[i] / RATED_Nm * 1000)))

    def cycle(self) -> None:
        self._now_s += PERIOD_S
        for i in range(3):
            sample = self.robot.step(i, self._now_s)
            self.feedback.position_rad[i] = sample[1] * COUNT_rad
        self._acting = self.torque.copy()
        self.feedback.cycle += 1

    def run(self, seconds: float, until_rest: bool = False) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.cycle()
            self.program.update(self.feedback, self.setpoint, self.torque)
            if hasattr(self, "true_m"):
                self.tension_N.append(self.robot.tension_N)
                self.true_m.append(self.robot.position_m[:2])
            if until_rest and self.program.at_rest:
                return


Moved = tuple[Physics, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]


@pytest.fixture(scope="module")
def moved() -> Moved:
    """A robot whose motors are unknown, after targets; of each: target, path and rest, true."""
    physics = Physics(RobotPlant())
    legs = []
    for x, y in ((0.5, 1.5), (-0.5, 2.3), (0.55, 2.35), (-0.4, 1.45)):
        first = len(physics.true_m)
        physics.program.command({"position_m": [x, y]})
        physics.run(6.0, until_rest=True)
        physics.run(1.5)
        path = np.array(physics.true_m[first:])
        legs.append((np.array([x, y]), path, path[-1]))
    return physics, legs


def test_targets_are_reached_without_knowledge_of_the_motors(moved: Moved) -> None:
    _, legs = moved
    errors = np.array([rest - target for target, _, rest in legs])
    assert np.abs(errors).max() < 1e-3
    assert np.abs(errors.mean(axis=0)).max() < 0.3e-3


def test_the_estimate_is_where_the_platform_is(moved: Moved) -> None:
    physics, _ = moved
    assert physics.control.estimated_m == pytest.approx(physics.true_m[-1], abs=1.5e-4)
    rotation = physics.robot.rotation
    assert physics.control.angle_rad == pytest.approx(
        math.atan2(rotation[1, 0], rotation[0, 0]), abs=math.radians(0.7)
    )


def test_true_tensions_stay_within_their_bounds(moved: Moved) -> None:
    physics, _ = moved
    tensions = np.array(physics.tension_N)
    assert tensions.min() > LOW_N[0]
    assert tensions.max() < HIGH_N[0]


def test_overshoot_is_small_and_ways_are_straight(moved: Moved) -> None:
    _, legs = moved
    for target, path, _ in legs:
        way = target - path[0]
        along = way / np.linalg.norm(way)
        ahead = (path - target) @ along
        assert ahead.max() < 3e-3
        across = (path - path[0]) @ np.array([-along[1], along[0]])
        assert np.abs(across).max() < 6e-3


def test_torques_are_those_of_plain_numpy() -> None:
    ours, obvious = planar_controls(ROBOT)
    motion = Motion(ROBOT, ours, 400)
    _, torques = run_block(ours, motion, 0, 400)
    _, wanted = run_block(obvious, motion, 0, 400)
    assert np.ptp(torques, axis=0).min() > 0.1
    np.testing.assert_allclose(torques, wanted, atol=1e-8)


def test_an_update_allocates_nothing_that_stays() -> None:
    ours, _ = planar_controls(ROBOT)
    motion = Motion(ROBOT, ours, 50)
    run_block(ours, motion, 0, 50)
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    feedback.position_rad[:] = motion.angle_rad[-1]
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(300):
        ours.update(feedback, setpoint, torque)
        ours.stands(ours.position_m)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 2000


def test_a_place_that_tensions_cannot_hold_is_told() -> None:
    control, _ = planar_controls(ROBOT)
    assert not control.feasible(np.array([0.0, 1.9]))
    assert control.stands(np.array([0.0, 1.9]))
    for place in ((-1.5, 1.0), (0.0, 2.95), (0.0, 3.5)):
        told = control.feasible(np.array(place))
        assert "cable" in told
        assert "reserve" in told
        assert not control.stands(np.array(place))
    assert "at " in control.feasible_way(np.array([-1.5, 1.0]))
    assert not control.feasible_way(np.array([0.3, 1.6]))


def test_a_target_in_an_exit_point_is_told() -> None:
    control, _ = planar_controls(ROBOT)
    assert PLATFORM is not None
    place = np.subtract(PLATFORM.exit_points_m[0], PLATFORM.anchor_points_m[0])
    assert control.feasible(place)


def test_a_heavier_platform_gets_a_slower_loop_that_is_as_well_damped() -> None:
    assert PLATFORM is not None
    settings = []
    for mass in (0.5, 2.0, 20.0):
        platform = dataclasses.replace(PLATFORM, mass_kg=mass)
        control = PlanarControl(platform, list(ROBOT.axes), LOW_N, HIGH_N, TORQUE_Nm, PERIOD_S)
        s = control.settings
        moving = mass + 1.5 * s["inertia"] / 0.026**2
        ratio = s["damping"] / (2.0 * math.sqrt(s["stiffness"] * moving))
        assert ratio == pytest.approx(0.55)
        # Routh and Hurwitz: the integral part leaves the loop stable, with a wide margin
        assert s["integral"] < 0.3 * s["stiffness"] * s["damping"] / moving
        settings.append(s)
    assert settings[0]["stiffness"] > settings[2]["stiffness"]


def test_other_robots_are_refused() -> None:
    assert PLATFORM is not None
    with pytest.raises(GeometryError, match="allowed: 3 in a plane"):
        PlanarControl(PLATFORM, list(ROBOT.axes)[:2], LOW_N, HIGH_N, TORQUE_Nm, PERIOD_S)


def test_the_lightest_rotor_decides_how_much_is_damped() -> None:
    assert PLATFORM is not None
    geared = replace(ROBOT.axes[0].winch, gear_ratio=8.0)  # four times as heavy at its cable

    def damping(*winches: Winch) -> float:
        axes = [replace(a, winch=w) for a, w in zip(ROBOT.axes, winches, strict=True)]
        control = PlanarControl(PLATFORM, axes, LOW_N, HIGH_N, TORQUE_Nm, PERIOD_S)
        return control.settings["damping"]

    light = ROBOT.axes[0].winch
    assert damping(geared, light, geared) == damping(light, light, light)
    assert damping(geared, geared, geared) > 2.0 * damping(light, light, light)
