"""Kinematics of n cables, forward and inverse, compared with finite differences and plain NumPy."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.kinematics import PLANAR, PLANAR_POINT, POINT, SPATIAL, CableKinematics
from cdpr_rt.model.pose import Pose
from tests.cdpr_rt.model.shipped_points import COGIRO, SPATIAL_8

quick = settings(max_examples=60)
seeds = st.integers(0, 2**32 - 1)
UP = np.array([0.0, 0.0, 1.0])


def made_up(
    directions: tuple[int, ...], n: int, rng: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """Return exit and anchor points: around a room of 4 m, on a platform of 0.3 m."""
    a = rng.normal(size=(n, 3))
    a *= 2.5 / np.linalg.norm(a, axis=1)[:, None]
    b = rng.uniform(-0.3, 0.3, (n, 3))
    if max(directions) < 3:
        b *= 0.05
    if set(directions) <= set(PLANAR):
        a[:, 2] = b[:, 2] = 0.0
        a *= 2.5 / np.linalg.norm(a, axis=1)[:, None]
    return a, b


SHAPES = [
    (PLANAR_POINT, 3),
    (PLANAR, 4),
    (POINT, 4),
    (SPATIAL, 6),
    (SPATIAL, 8),
    ((0, 1, 2, 5), 6),
    (SPATIAL, 12),
]


def near(pose: Pose, directions: tuple[int, ...], rng: np.random.Generator, by: float) -> Pose:
    x = np.zeros(6)
    x[list(directions)] = rng.uniform(-by, by, len(directions))
    return pose.plus(x)


@quick
@given(st.sampled_from(SHAPES), seeds, st.sampled_from([0.0, 0.04]))
def test_pose_from_lengths_inverts_lengths(
    shape: tuple[tuple[int, ...], int], seed: int, radius: float
) -> None:
    directions, n = shape
    rng = np.random.default_rng(seed)
    robot = CableKinematics(*made_up(directions, n, rng), directions, pulley_radius_m=radius)
    truth = near(Pose(np.zeros(3)), directions, rng, 0.3)
    if np.linalg.cond(robot.jacobian(truth)) > 1e3:
        return
    found = robot.pose_from_lengths(robot.lengths(truth), near(truth, directions, rng, 0.01))
    assert found.converged
    assert found.residual_m < 1e-9
    assert np.abs(found.pose.minus(truth)).max() < 1e-8
    assert np.abs(found.pose.Q @ found.pose.Q.T - np.eye(3)).max() < 1e-14


@quick
@given(st.sampled_from(SHAPES), seeds, st.sampled_from([0.0, 0.04]))
def test_the_jacobian_is_the_derivative_and_w_its_negative_transpose(
    shape: tuple[tuple[int, ...], int], seed: int, radius: float
) -> None:
    directions, n = shape
    rng = np.random.default_rng(seed)
    robot = CableKinematics(*made_up(directions, n, rng), directions, pulley_radius_m=radius)
    pose = near(Pose(np.zeros(3)), SPATIAL, rng, 0.3)
    J, h = robot.jacobian(pose), 1e-6
    for column, k in enumerate(directions):
        step = h * np.eye(6)[k]
        slope = (robot.lengths(pose.plus(step)) - robot.lengths(pose.plus(-step))) / (2.0 * h)
        assert J[:, column] == pytest.approx(slope, abs=1e-8)
    W = np.empty((len(directions), n))
    assert robot.wrench_matrix(pose, W) is W
    assert pytest.approx(-J.T, abs=0.0) == W


@quick
@given(seeds)
def test_lengths_and_jacobian_equal_those_of_plain_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = made_up(SPATIAL, 8, rng)
    pose = near(Pose(np.zeros(3)), SPATIAL, rng, 1.0)
    c = pose.p + b @ pose.Q.T - a  # (3.4)
    rho = np.linalg.norm(c, axis=1)  # (3.2)
    J = np.hstack([c, np.cross(b @ pose.Q.T, c)]) / rho[:, None]  # (3.10), (3.14)
    robot = CableKinematics(a, b)
    assert robot.lengths(pose) == pytest.approx(rho, rel=1e-14)
    assert robot.jacobian(pose) == pytest.approx(J, abs=1e-14)


def test_tensions_pull_the_platform_to_the_exit_points() -> None:
    """A platform that hangs on one cable straight above its origin: 5 N up balance 5 N down."""
    robot = CableKinematics(np.array([[0.0, 0.0, 3.0]] * 3), np.zeros((3, 3)), POINT)
    W = robot.wrench_matrix(Pose(np.zeros(3)))
    assert pytest.approx(np.zeros(3)) == W @ [5.0, 0.0, 0.0] + [0.0, 0.0, -5.0]


@quick
@given(seeds)
def test_lengths_that_disagree_give_the_least_squares_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = CableKinematics(SPATIAL_8.exit_points_m, SPATIAL_8.anchor_points_m)
    truth = SPATIAL_8.home.plus(rng.uniform(-0.3, 0.3, 6))
    rho = robot.lengths(truth) + rng.normal(0.0, 5e-3, 8)
    stranger = least_squares(
        lambda x: robot.lengths(truth.plus(x)) - rho,
        np.zeros(6),
        xtol=1e-14,
        gtol=1e-14,
        ftol=1e-14,
    )
    found = robot.pose_from_lengths(rho, truth)
    assert found.converged
    assert found.pose.minus(truth) == pytest.approx(stranger.x, abs=1e-6)
    assert found.residual_m == pytest.approx(math.sqrt(2.0 * stranger.cost / 8), rel=1e-6)


def wound(exit_m: np.ndarray, anchor_m: np.ndarray, axis: np.ndarray, r: float) -> float:
    """Return the length over a pulley by trying where on its rim the cable leaves: the tangent."""
    c = anchor_m - exit_m
    e = c - (c @ axis) * axis
    e /= np.linalg.norm(e)
    theta = np.linspace(0.0, 1.5 * math.pi, 40_001)
    rim = exit_m + r * (1.0 - np.cos(theta))[:, None] * e + r * np.sin(theta)[:, None] * axis
    tangent = np.sin(theta)[:, None] * e + np.cos(theta)[:, None] * axis
    way = anchor_m - rim
    free = np.linalg.norm(way, axis=1)
    best = int(np.argmax((tangent * way).sum(axis=1) / free))
    return float(r * theta[best] + free[best])


@settings(max_examples=10)
@given(seeds, st.floats(0.01, 0.15))
def test_a_cable_leaves_its_pulley_along_the_tangent(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = made_up(SPATIAL, 8, rng)
    axes = rng.normal(size=(8, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    pose = near(Pose(np.zeros(3)), SPATIAL, rng, 0.5)
    robot = CableKinematics(a, b, pulley_radius_m=radius, swivel_axes=axes)
    anchors = pose.p + b @ pose.Q.T
    told = [wound(a[i], anchors[i], axes[i], radius) for i in range(8)]
    assert robot.lengths(pose) == pytest.approx(told, abs=1e-6)


def test_restarts_find_the_true_pose_from_a_bad_start() -> None:
    """CoGiRo, started up to 1 m and 40 degrees off, without and with a rotation at home."""
    rng = np.random.default_rng(11)
    robot = CableKinematics(COGIRO.exit_points_m, COGIRO.anchor_points_m, length_std_m=1e-6)
    alone, found = 0, 0
    for _ in range(300):
        angles = rng.uniform(-30.0, 30.0, 3)
        p = rng.uniform([-6.0, -4.0, 0.0], [6.0, 4.0, 4.5])
        truth = Pose(p, Rotation.from_euler("xyz", angles, degrees=True).as_matrix())
        off = Rotation.from_euler("xyz", angles + rng.uniform(-40.0, 40.0, 3), degrees=True)
        start = Pose(p + rng.uniform(-1.0, 1.0, 3), off.as_matrix())
        rho = robot.lengths(truth)
        alone += np.abs(robot.pose_from_lengths(rho, start).pose.minus(truth)).max() < 1e-6
        best = robot.pose_from_lengths(rho, start, restarts=9)
        found += best.converged and np.abs(best.pose.minus(truth)).max() < 1e-6
    assert found == 300
    assert alone < 295, "no start was bad: the test shows nothing"


@pytest.mark.parametrize("shape", [(7,), (9,), (8, 1), ()])
def test_impossible_cable_lengths_are_rejected(shape: tuple[int, ...]) -> None:
    robot = CableKinematics(SPATIAL_8.exit_points_m, SPATIAL_8.anchor_points_m)
    with pytest.raises(GeometryError, match=r"^lengths \(.*\); allowed: \(8,\)$"):
        robot.pose_from_lengths(np.full(shape, 3.0), SPATIAL_8.home)


def test_a_pickled_robot_works_independently_of_its_original() -> None:
    robot = CableKinematics(SPATIAL_8.exit_points_m, SPATIAL_8.anchor_points_m)
    truth = SPATIAL_8.home.plus(np.array([0.1, -0.05, 0.08, 0.1, 0.2, -0.1]))
    robot.pose_from_lengths(robot.lengths(truth), SPATIAL_8.home)
    other = pickle.loads(pickle.dumps(robot))
    robot.pose_from_lengths(robot.lengths(SPATIAL_8.home), SPATIAL_8.home)
    found = other.pose_from_lengths(robot.lengths(truth), SPATIAL_8.home)
    assert np.abs(found.pose.minus(truth)).max() < 1e-9


def test_forward_kinematics_reports_failure() -> None:
    robot = CableKinematics(SPATIAL_8.exit_points_m, SPATIAL_8.anchor_points_m)
    nan = robot.pose_from_lengths(np.full(8, math.nan), SPATIAL_8.home, restarts=9)
    assert not nan.converged
    assert np.isfinite(nan.pose.array).all()
    off = robot.pose_from_lengths(np.full(8, 0.1), SPATIAL_8.home, restarts=9)
    assert off.residual_m > 0.5, "whatever it has come to, the lengths are not those"
    flat = CableKinematics(
        np.array([[-1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.zeros((3, 2)), (0, 1)
    )
    pose = Pose(np.array([0.3, 0.0, 0.0]))
    line = flat.pose_from_lengths(flat.lengths(pose), pose.plus(0.1 * np.eye(6)[0]))
    assert not line.converged, "cables in one line leave a direction free"


def test_an_anchor_point_in_its_exit_point_or_pulley_is_rejected() -> None:
    a = SPATIAL_8.exit_points_m
    for radius, off in ((0.0, 0.0), (0.05, 0.04)):
        robot = CableKinematics(a, np.tile([off, 0.0, 0.0], (8, 1)), pulley_radius_m=radius)
        with pytest.raises(GeometryError, match="cable 3: its anchor point"):
            robot.jacobian(Pose(a[2]))


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_the_geometric_stiffness_is_the_derivative_of_the_tensions_wrench(radius: float) -> None:
    rng = np.random.default_rng(11)
    robot = CableKinematics(*made_up(SPATIAL, 7, rng), SPATIAL, pulley_radius_m=radius)
    tension_N, pose = rng.uniform(10.0, 100.0, 7), Pose(np.array([0.1, -0.2, 1.1]))
    pose.array[1:] = Rotation.from_rotvec([0.3, -0.2, 0.1]).as_matrix()

    def wrench(step: FloatArray) -> FloatArray:
        there = Pose(pose.p + step[:3], Rotation.from_rotvec(step[3:]).as_matrix() @ pose.Q)
        return np.asarray(robot.jacobian(there).T @ tension_N)

    steps = 1e-5 * np.eye(6)
    expected = np.array([(wrench(step) - wrench(-step)) / 2e-5 for step in steps]).T
    found = robot.geometric_stiffness(pose, tension_N)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
