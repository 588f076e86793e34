"""A platform's control on simulated physics, and compared with plain NumPy."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import BoxFile
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.platform.cable_control import CableControl
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.bench.control import PeriodicMotion, control_of, updates
from tests.cdpr_rt.platform.platform_physics import (
    PERIOD_S,
    Physics,
    planar,
    short_arms,
    spatial,
    with_friction,
)

ROBOTS = ("planar-3", "spatial-8", "suspended-8")
PLANE = ((0.5, 1.5), (-0.5, 2.3), (0.55, 2.35), (-0.4, 1.45))
SPACE = (
    (0.2, -0.2, 1.6, 0.0, 0.0, 0.0),
    (-0.2, 0.1, 1.3, 0.08, -0.05, 0.0),
    (0.1, 0.2, 1.5, -0.04, 0.06, 0.1),
)

Leg = tuple[np.ndarray, np.ndarray, np.ndarray]
Moved = tuple[Physics, list[Leg]]


def moved(physics: Physics, targets: tuple[tuple[float, ...], ...]) -> Moved:
    """Return for each target: the target, true and wanted path, and the true position at rest."""
    physics.go(targets[-1])
    physics.tension_N.clear()
    legs = []
    for target in targets:
        path = physics.go(target)
        legs.append((np.array(target), path, path[0, -100:].mean(axis=0)))
    return physics, legs


@pytest.fixture(scope="module")
def in_a_plane() -> Moved:
    """A robot with unidentified motors after motions to targets."""
    return moved(Physics(planar(), RobotPlant()), PLANE)


@pytest.fixture(scope="module")
def in_space() -> Moved:
    return moved(Physics(spatial(), RobotPlant()), SPACE)


def robot(name: str) -> Robot:
    return load_robot(name)


def test_targets_are_reached_without_knowledge_of_the_motors(in_a_plane: Moved) -> None:
    errors = np.array([rest - target for target, _, rest in in_a_plane[1]])
    assert np.abs(errors).max() < 0.6e-3
    assert np.abs(errors.mean(axis=0)).max() < 0.3e-3


def test_positions_and_orientations_are_reached_in_space(in_space: Moved) -> None:
    errors = np.array([rest - target for target, _, rest in in_space[1]])
    assert np.abs(errors[:, :3]).max() < 0.6e-3
    assert np.abs(errors[:, 3:]).max() < np.radians(0.15)


@pytest.mark.parametrize("where", ["in_a_plane", "in_space"])
def test_the_estimated_pose_equals_the_true_pose(
    where: str, request: pytest.FixtureRequest
) -> None:
    physics, _ = request.getfixturevalue(where)
    k = physics.model.positions
    estimated, truth = physics.control.estimated, physics.true[-1]
    assert estimated[:k] == pytest.approx(truth[:k], abs=2e-4)
    assert estimated[k:] == pytest.approx(truth[k:], abs=np.radians(0.1))
    turned = physics.control.pose
    w = turned[3] / np.linalg.norm(turned[3:])
    angle = 2.0 * np.arccos(min(w, 1.0))
    assert angle == pytest.approx(np.linalg.norm(physics.rotation_rad), abs=np.radians(0.7))


@pytest.mark.parametrize("where", ["in_a_plane", "in_space"])
def test_true_tensions_stay_within_their_bounds(where: str, request: pytest.FixtureRequest) -> None:
    physics, _ = request.getfixturevalue(where)
    tensions = np.array(physics.tension_N)
    assert tensions.min() > physics.model.low_N[0]
    assert tensions.max() < physics.model.high_N[0]


@pytest.mark.parametrize("where", ["in_a_plane", "in_space"])
def test_overshoot_is_small_and_the_set_point_is_followed(
    where: str, request: pytest.FixtureRequest
) -> None:
    physics, legs = request.getfixturevalue(where)
    k = physics.model.positions
    for target, (path, wanted), _ in legs:
        way = target[:k] - wanted[0, :k]
        assert ((path[:, :k] - target[:k]) @ (way / np.linalg.norm(way))).max() < 3e-3
        off = path - wanted
        assert np.linalg.norm(off[:, :k], axis=1).max() < 5e-3
        assert np.abs(off[:, k:]).max(initial=0.0) < np.radians(1.0)


def test_friction_and_cogging_are_learnt_in_motion(in_a_plane: Moved) -> None:
    physics = in_a_plane[0]
    learning, motors = physics.control.learning, RobotPlant().motor_plants(3)
    assert learning is not None
    # learnt friction includes the cable's share; after so little motion the mean over all motors
    # is more accurate than each value
    share = learning.friction_Nm / [motor.friction.coulomb_Nm for motor in motors]
    assert share.min() > 0.5 and share.max() < 2.0 and 0.9 < share.mean() < 1.6
    amplitude = np.linalg.norm(learning.cogging_Nm, axis=1)
    np.testing.assert_allclose(amplitude, [m.cogging[0].amplitude_Nm for m in motors], rtol=0.35)


def test_a_robot_with_high_friction_overshoots_little() -> None:
    """Friction exceeds the bound of the proportional part; the damping is not saturated."""
    physics, legs = moved(Physics(planar(), with_friction(0.5)), PLANE[:2])
    for target, (path, wanted), rest in legs:
        assert np.abs(rest - target).max() < 2e-3
        assert np.linalg.norm(path - wanted, axis=1).max() < 0.04
        way = (target - wanted[0]) / np.linalg.norm(target - wanted[0])
        assert ((path - target) @ way).max() < 5e-3
    assert np.array(physics.tension_N).min() > 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_updates_retain_no_memory(name: str) -> None:
    ours = control_of(robot(name))
    motion = PeriodicMotion(robot(name), ours)
    for work in islice(updates(ours, motion, []), 50):
        work()
    n = motion.angle_rad.shape[1]
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    feedback.position_rad[:] = motion.angle_rad[49]
    assert ours.is_feasible(ours.position)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(300):
        ours.update(feedback, setpoint, torque)
        ours.is_feasible(ours.position)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 2000


def test_an_obstacle_in_the_way_is_reported() -> None:
    robot = load_robot("spatial-8")
    assert robot.platform is not None
    box = BoxFile(min_m=(-0.1, 0.0, 2.12), max_m=(0.0, 0.2, 2.2))
    blocked = replace(robot.platform, obstacles=(box,))
    model = platform_model_of(replace(robot, platform=blocked))
    control = CableControl(model, robot.axes, np.full(8, 6.0), PERIOD_S)
    told = control.way_infeasibility(np.array([-0.05, 0.1, 1.81, 0.0, 0.0, 0.0]))
    assert "at -50.0, 100.0, 1810.0 mm: platform and obstacle 1 come within 10 mm" in told
    assert not control.way_infeasibility(np.array([-0.05, 0.1, 1.7, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize(("place", "told"), [((0.0, 1.9), False), ((-1.5, 1.0), True)])
def test_tensions_that_are_missing_are_reported(place: tuple[float, float], told: bool) -> None:
    control = planar().control()
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    lengths = control.model.kinematics.lengths(control.model.pose(np.array(place)))
    control.take_lengths(lengths, feedback)
    control.begin(feedback)
    control.stand_still()
    for _ in range(50):
        control.update(feedback, setpoint, torque)
    assert ("cable" in control.tension_infeasibility()) == told
    assert (control.outcome != 0) == told
    model = control.model
    assert control.tension_N.min() >= model.low_N[0] - 1e-9
    assert control.tension_N.max() <= model.high_N[0] + 1e-9


def test_a_nan_length_makes_the_residual_nan_and_suspects_no_cable() -> None:
    control, feedback = spatial().control(), AxisFeedback(8)
    control.take_lengths(control.lengths_at_home(np.zeros(8)), feedback)
    control.begin(feedback)
    control.observe(feedback)
    assert control.residual_m < 0.03
    feedback.position_rad[2] = np.nan
    control.observe(feedback)
    assert np.isnan(control.residual_m)
    assert control.suspect == -1
    assert control.suspects() == []


def test_a_jump_blames_the_cable_that_jumped_not_one_that_was_off_before() -> None:
    control, feedback = spatial().control(), AxisFeedback(8)
    lengths_m = control.lengths_at_home(np.zeros(8))
    lengths_m[5] += 0.02
    control.take_lengths(lengths_m, feedback)
    control.begin(feedback)
    control.observe(feedback)
    before = control.suspects()
    feedback.position_rad[1] += 0.2
    for _ in range(5):
        control.observe(feedback)
    assert 5 in before and 1 not in before
    assert set(control.suspects()) == set(before)
    assert 1 in control.suspects(jump=True)
    assert 5 not in control.suspects(jump=True)


def test_an_acceleration_that_tensions_cannot_give_is_reported() -> None:
    control = planar().control()
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    place = np.array([0.0, 1.9])
    control.take_lengths(control.model.kinematics.lengths(control.model.pose(place)), feedback)
    control.begin(feedback)
    control.stand_still()
    control.acceleration[:] = [0.0, -200.0]
    for _ in range(100):
        control.update(feedback, setpoint, torque)
    assert control.is_feasible(place)
    assert control.tension_infeasibility().startswith("for this motion, cable")


def test_lengths_taken_at_any_motor_angles_place_the_platform_at_home() -> None:
    """The platform is estimated at home after its lengths were given at any motor angles."""
    control = spatial().control()
    tension_N = np.full(8, 60.0)
    lengths = control.lengths_at_home(tension_N)
    EA = np.array([axis.winch.cable.stiffness_N for axis in spatial().axes])
    rigid = control.model.kinematics.lengths(control.model.home_pose)
    assert lengths == pytest.approx(rigid / (1.0 + tension_N / EA), rel=1e-12)
    feedback = AxisFeedback(8)
    feedback.position_rad[:] = np.linspace(-3.0, 3.0, 8)
    control.take_lengths(rigid, feedback)
    control.take_lengths(np.full(8, np.nan), feedback)
    control.begin(feedback)
    assert control.free_lengths_m == pytest.approx(rigid, abs=1e-12)
    assert control.estimated == pytest.approx(control.model.home, abs=2e-2)
    control.stand_still()
    np.testing.assert_array_equal(control.position, control.estimated)
    np.testing.assert_array_equal(control.shaped, control.estimated)
    assert not control.velocity.any()


def test_reset_clears_the_integral_part() -> None:
    control = planar().control()
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    control.take_lengths(control.model.kinematics.lengths(control.model.home_pose), feedback)
    control.begin(feedback)
    control.stand_still()
    control.reset()
    control.update(feedback, setpoint, torque)
    first = torque.copy()
    control.position[0] += 0.001
    for _ in range(300):
        control.update(feedback, setpoint, torque)
    grown = torque.copy()
    control.position[0] -= 0.001
    for _ in range(100):
        control.update(feedback, setpoint, torque)
    assert np.abs(torque - first).max() > 1e-3
    control.reset()
    control.observe(feedback)
    for _ in range(2):
        control.update(feedback, setpoint, torque)
    assert np.abs(torque - first).max() < 0.3 * np.abs(grown - first).max()


def test_fewer_axes_than_cables_are_rejected() -> None:
    machine = planar()
    with pytest.raises(GeometryError, match="2 axes; allowed: 3, one for each cable"):
        CableControl(machine.model(), list(machine.axes)[:2], np.full(3, 4.5), PERIOD_S)


def test_shaping_the_set_point_keeps_its_end() -> None:
    """The mean over 60 ms turns a step into a ramp that ends at the same place."""
    control = planar().control()
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    control.take_lengths(control.model.kinematics.lengths(control.model.home_pose), feedback)
    control.begin(feedback)
    control.stand_still()
    start = control.position.copy()
    control.position += 0.01
    steps = []
    for _ in range(60):
        control.update(feedback, setpoint, torque)
        steps.append(control.shaped - start)
    assert np.diff(np.array(steps), axis=0) == pytest.approx(0.01 / 60, rel=1e-6)
    assert control.shaped == pytest.approx(start + 0.01, abs=1e-12)


def test_a_set_point_on_a_stand_begins_where_the_platform_stands_now() -> None:
    """The set-point is the new estimate, not a way from the old one."""
    control = short_arms().control()
    assert not control.gains.follows_pose
    kinematics, model, feedback = control.model.kinematics, control.model, AxisFeedback(8)
    home_m = kinematics.lengths(model.home_pose)
    control.take_lengths(home_m, feedback)
    control.begin(feedback)
    control.stand_still(on_stand=True)
    elsewhere = model.home + 0.3 * np.eye(6)[0]
    cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in short_arms().axes])
    feedback.position_rad[:] = (kinematics.lengths(model.pose(elsewhere)) - home_m) / cable_m
    control.begin(feedback)
    control.stand_still(on_stand=True)
    np.testing.assert_allclose(control.position, control.estimated, atol=1e-9)


def test_lengths_on_the_stand_agree_under_the_standing_tensions() -> None:
    """Cables that press a platform on its stand are stretched by more than the planned tensions."""
    robot = load_robot("spatial-8")
    control = CableControl(platform_model_of(robot), robot.axes, np.full(8, 6.0), PERIOD_S)
    feedback, standing_N = (
        AxisFeedback(8),
        np.array([20.0, 60.0, 20.0, 60.0, 90.0, 30.0, 90.0, 30.0]),
    )
    control.take_lengths(control.lengths_at_home(standing_N), feedback)
    control.begin(feedback, standing_N)
    assert control.residual_m < 1e-6
    np.testing.assert_allclose(control.estimated, control.model.home, atol=1e-6)
    # with the planned tensions, lengths disagree
    control.begin(feedback)
    assert control.residual_m > 1e-3


def test_friction_compensation_replaces_the_integral_part_as_motion_begins() -> None:
    def step_of_torque(friction_Nm: float) -> FloatArray:
        """Return the change of torque as motion begins after a wait beside the target."""
        control = planar().control()
        feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
        control.take_lengths(control.model.kinematics.lengths(control.model.home_pose), feedback)
        control.begin(feedback)
        control.stand_still()
        control.reset()
        assert control.learning is not None
        found = np.zeros((3, 3))
        found[:, 0] = friction_Nm
        control.learning.begin_with(np.ones(3, np.bool_), found, np.tile(np.eye(3), (3, 1, 1)))
        control.position[0] += 0.001
        for _ in range(300):
            control.update(feedback, setpoint, torque)
        before = torque.copy()
        control.velocity[0] = 1e-9  # too slow for friction to be added
        control.update(feedback, setpoint, torque)
        return torque - before

    nothing, little, much = (np.abs(step_of_torque(f)).max() for f in (0.0, 0.005, 0.05))
    assert nothing < 1e-3
    assert 0.002 < little < 0.01
    assert much > 2.0 * little
