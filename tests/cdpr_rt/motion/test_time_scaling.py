"""Corners and timing: limits at every sample, corners within their radius, near-optimal duration.

The package toppra computes the optimum without limits of jerk.
"""

from __future__ import annotations

import numpy as np
import pytest
import toppra
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from toppra import algorithm, constraint

from cdpr_rt.motion.path_description import Arc, Coordinates, Move, PathDescription
from cdpr_rt.motion.path_nodes import PathNodes, nodes_of
from cdpr_rt.motion.time_scaling import PathLimits, TimedPath, WrenchBounds, time_path

toppra.setup_logging("ERROR")
ROOM = Coordinates(("x", "y", "z", "rx", "ry", "rz"), np.zeros(6))
SCALE = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])
LIMITS = PathLimits(
    np.array([0.4, 0.4, 0.3, 0.5, 0.5, 0.5]),
    np.array([1.0, 1.5, 1.0, 1.0, 1.0, 2.0]),
    np.array([10.0, 12.0, 8.0, 10.0, 10.0, 25.0]),
)


def polyline(points, blend_m, speed=np.inf, **last) -> PathDescription:
    points = np.asarray(points, float)
    path = PathDescription("made up", ROOM, points[0], 1)
    for i, point in enumerate(points[1:], 2):
        path.add(Move(i, point, speed, blend_m, **(last if i == len(points) else {})))
    return path


def timed(nodes: PathNodes, limits: PathLimits = LIMITS) -> TimedPath:
    return time_path(nodes, limits, WrenchBounds.none(len(nodes.s), 6))


def check_limits(plan: TimedPath, limits: PathLimits) -> None:
    h = plan.period_s
    position, velocity, acceleration = (plan.samples[:, i] for i in range(3))
    for values, most in (
        (velocity, limits.velocity),
        (acceleration, limits.acceleration),
        (np.diff(acceleration, axis=0) / h, limits.jerk),
    ):
        assert (np.abs(values) <= 1.01 * most).all()
    # velocities and accelerations are the positions' derivatives
    step = 0.5 * h * (velocity[1:] + velocity[:-1]) - h**2 / 12.0 * np.diff(acceleration, axis=0)
    np.testing.assert_allclose(np.diff(position, axis=0), step, atol=2e-6)
    assert not plan.samples[[0, -1], 1:].any()


points = st.lists(
    st.tuples(*[st.floats(-0.3, 0.3)] * 3, *[st.floats(-0.2, 0.2)] * 3), min_size=2, max_size=6
)


@settings(max_examples=25)
@given(points, st.sampled_from([0.0, 0.002, 0.02]), st.floats(0.02, 1.0))
def test_samples_keep_all_limits_and_corners_their_radius(places, blend_m, speed):
    path = polyline(places, blend_m, speed)
    nodes = nodes_of(path, SCALE)
    plan = timed(nodes)
    check_limits(plan, LIMITS)
    np.testing.assert_allclose(plan.samples[[0, -1], 0], path.points[[0, -1]], atol=1e-9)
    moves = np.linalg.norm(plan.samples[:, 1, :3], axis=1)
    turns = np.linalg.norm(plan.samples[:, 1, 3:], axis=1)
    shifts = np.linalg.norm(nodes.first[:, :3], axis=1) > 1e-6
    before, after = plan.node, np.minimum(plan.node + 1, len(nodes.s) - 1)
    assert (moves <= 1.01 * speed)[shifts[before] & shifts[after]].all()
    assert (turns <= 1.01 * speed)[~shifts[before] & ~shifts[after]].all()
    for corner in path.points[1:-1]:
        away = np.linalg.norm(SCALE * (nodes.q - corner), axis=1).min()
        assert away <= blend_m + 1e-9


def test_a_cut_corner_has_no_step_in_direction_or_curvature():
    path = polyline([[0] * 6, [0.2, 0, 0, 0, 0, 0]], 0.02)
    path.add(Move(3, np.array([0.2, 0.2, 0, 0, 0, 0.1]), np.inf, 0.02))
    centre = np.array([0.1, 0.2])
    end = np.array([0.0, 0.2, 0.05, 0, 0, 0])
    path.add(Move(4, end, np.inf, 0.02, arc=Arc(centre, np.pi)))
    nodes = nodes_of(path, SCALE)
    assert len(nodes.runs) == 1
    size = np.linalg.norm(nodes.scale * nodes.first, axis=1)
    np.testing.assert_allclose(size, 1.0, atol=1e-9)
    step = np.diff(nodes.s)[:, None]
    # both derivatives belong to the positions, through every corner
    np.testing.assert_allclose(
        np.diff(nodes.first, axis=0) / step, 0.5 * (nodes.second[1:] + nodes.second[:-1]),
        atol=0.12 * np.abs(nodes.second).max(),
    )  # fmt: skip
    np.testing.assert_allclose(
        np.diff(nodes.q, axis=0) / step, 0.5 * (nodes.first[1:] + nodes.first[:-1]), atol=0.03
    )


def test_the_duration_is_near_the_optimum_if_jerk_is_hardly_limited():
    places = [[0, 0, 0, 0, 0, 0], [0.3, 0, 0, 0.1, 0, 0], [0.3, 0.3, 0.1, 0, 0, 0.1],
              [0.0, 0.4, 0.1, 0, 0.1, 0.1], [-0.2, 0.1, 0, 0, 0, 0]]  # fmt: skip
    path = polyline(places, 0.1)
    nodes = nodes_of(path, SCALE)
    assert len(nodes.runs) == 1
    limits = PathLimits(LIMITS.velocity, LIMITS.acceleration, 1e3 * LIMITS.acceleration)
    plan = timed(nodes, limits)
    s = np.linspace(0.0, nodes.s[-1], 2000)
    dense = CubicHermiteSpline(nodes.s, nodes.q, nodes.first)(s)
    fastest = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(limits.velocity),
            constraint.JointAccelerationConstraint(limits.acceleration),
        ],
        toppra.SplineInterpolator(s, dense), solver_wrapper="seidel",
    ).compute_trajectory(0, 0)  # fmt: skip
    assert 0.97 * fastest.duration <= plan.duration_s <= 1.06 * fastest.duration


def test_a_straight_run_takes_the_time_of_its_velocity_profile():
    limits = LIMITS
    plan = timed(nodes_of(polyline([[0] * 6, [0.3, 0, 0, 0, 0, 0]], 0.0), SCALE), limits)
    a, v = 0.98, 0.4
    assert plan.duration_s == pytest.approx(0.3 / v + v / a + limits.smoothing_s, abs=0.011)


def test_dwells_and_waits_become_rest():
    path = polyline([[0] * 6, [0.1] + [0] * 5, [0.1, 0.1] + [0] * 4], 0.01, dwell_s=0.3, waits=True)
    path.moves[0] = Move(2, path.moves[0].end, np.inf, 0.01, dwell_s=0.25)
    nodes = nodes_of(path, SCALE)
    assert nodes.runs.shape == (2, 2)
    plan = timed(nodes)
    still = ~plan.samples[:, 1].any(axis=1)
    assert still[-31:].all()
    assert still.sum() >= 25 + 30
    assert plan.waits.tolist() == [len(plan.samples) - 1]


def test_a_wait_at_the_beginning_comes_after_one_sample_of_rest():
    """A wait at time 0 would be passed over by who looks for the next one."""
    path = polyline([[0] * 6, [0] * 6, [0.1] + [0] * 5], 0.0)
    path.moves[0] = Move(2, path.start, np.inf, waits=True)
    plan = timed(nodes_of(path, SCALE))
    assert plan.waits.tolist() == [1]
    assert not plan.samples[:2, 1:].any()


def test_limited_wrenches_slow_the_path_down():
    path = polyline([[0] * 6, [0.3, 0, 0, 0, 0, 0]], 0.0)
    nodes = nodes_of(path, SCALE)
    count = len(nodes.s)
    force = 5.0 * nodes.first
    bounds = WrenchBounds(
        np.zeros(count, np.int64), np.eye(6)[None], np.full((1, 6), -2.0), np.full((1, 6), 1.0),
        force, 5.0 * nodes.second,
    )  # fmt: skip
    plan = time_path(nodes, LIMITS, bounds)
    assert plan.samples[:, 2, 0].max() <= 0.2 * 1.02
    assert plan.samples[:, 2, 0].min() >= -0.4 * 1.02
    assert plan.duration_s > 1.3 * timed(nodes).duration_s


def test_a_path_without_length_stays_at_rest():
    path = polyline([[0.1] * 6, [0.1] * 6], 0.01, dwell_s=0.5)
    plan = timed(nodes_of(path, SCALE))
    assert plan.duration_s == pytest.approx(0.5)
    assert not plan.samples[:, 1:].any()


def test_tiny_pieces_between_cut_corners_do_not_slow_the_path():
    """As of arcs in lines of 2 mm, rounded to micrometres, whose corners are cut by half of it."""
    angle = np.arange(4000) / 50.0
    places = np.round(0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 6)
    path = polyline([(x, y, 0.0, 0.0, 0.0, 0.0) for x, y in places], 0.001, 0.1)
    nodes = nodes_of(path, SCALE)
    assert 0.0 < np.diff(nodes.s).min() < 1e-6
    plan = timed(nodes)
    assert plan.rounds < 8
    assert plan.duration_s < 1.6 * nodes.s[-1] / 0.1
