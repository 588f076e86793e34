"""What a robot's cables can hold, compared with linear programming, statics and the controller."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.model.platform_model import RESERVE, platform_model
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.statics import Box, PlatformStatics, statics_of
from cdpr_rt.model.tension_distribution import TensionOutcome
from cdpr_rt.platform.cable_control import CableControl

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


UP = np.array([0.0, 9.80665])


LOW, HIGH = np.full(3, 20.0), np.full(3, 150.0)


def shipped() -> PlatformStatics:
    return statics_of(load_robot("planar-3"))


def by_linear_programming(statics: PlatformStatics, p: np.ndarray, a: np.ndarray) -> float:
    """Return the greatest possible distance of all tensions from their bounds."""
    ways = statics.exits_m - p - statics.anchors_m
    W = (ways / np.linalg.norm(ways, axis=1)[:, None]).T
    force = statics.platform.mass_kg * (a + UP)
    bounds = np.concatenate([-statics.low_N, statics.high_N])
    rows = np.hstack([np.concatenate([-np.eye(3), np.eye(3)]), np.ones((6, 1))])
    found = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=rows, b_ub=bounds, A_eq=np.hstack([W, np.zeros((2, 1))]), b_eq=force,
        bounds=[(None, None)] * 4,
    )  # fmt: skip
    assert found.success
    return float(-found.fun)


@settings(max_examples=100)
@given(st.floats(-2.2, 2.2), st.floats(-0.5, 3.3))
def test_poses_are_feasible_if_the_controller_finds_tensions(x: float, y: float) -> None:
    statics, p = shipped(), np.array([x, y])
    weight = np.array([0.0, -9.80665 * statics.platform.mass_kg])
    W, t = statics.model.kinematics.wrench_matrix(statics.model.pose(p)), np.zeros(3)
    outcome = statics.model.least_tensions(LOW, HIGH).solve(W, weight, t)
    reserve = float(statics.margin_N(p))
    if abs(reserve) > 1e-6:
        assert (outcome is TensionOutcome.FEASIBLE) == (reserve > 0.0)
    if reserve > 1e-6:
        least = statics.least_tensions_N(p)
        assert (least >= LOW - 1e-6).all() and least.sum() <= t.sum() + 1e-6


@pytest.mark.parametrize("name", ["planar-3", "spatial-8"])
def test_lengths_equal_those_of_the_loop_also_with_pulleys(name: str) -> None:
    robot = load_robot(name)
    assert robot.platform is not None
    radii = tuple(0.02 + 0.01 * i for i in range(len(robot.axes)))
    platform = dataclasses.replace(robot.platform, pulley_radius_m=radii)
    with_pulleys = statics_of(dataclasses.replace(robot, platform=platform))
    home = np.array(platform.home_m)
    places = np.stack([home, home + 0.05])
    kinematics = with_pulleys.model.kinematics
    poses = [Pose(p[0], p[1:]) for p in with_pulleys.poses(places)]
    expected = [kinematics.lengths(pose) for pose in poses]
    np.testing.assert_allclose(with_pulleys.lengths(places), expected, atol=1e-12)
    wound = with_pulleys.lengths(places) - with_pulleys.free_lengths(places)
    assert (wound >= 0.0).all() and (wound > 1e-3).any(axis=1).all()


def test_the_margin_in_motion_is_that_of_the_worst_acceleration() -> None:
    statics, points = shipped(), shipped().box.grid(4, 3)
    assert points.shape == (3, 4, 2)
    moving = statics.margin_N(points, 2.0)
    worst = [
        min(
            by_linear_programming(statics, p, np.array([i, j]))
            for i in (-2.0, 2.0)
            for j in (-2.0, 2.0)
        )
        for p in points.reshape(-1, 2)
    ]
    np.testing.assert_allclose(moving.ravel(), worst, atol=1e-6)


def test_the_platform_turns_to_where_the_tensions_have_no_moment() -> None:
    statics = shipped()
    p = np.array([0.5, 1.5])
    angle, t = float(statics.angle_rad(p)), statics.tensions_N(p)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    arms = statics.anchors_m @ turn.T
    ways = statics.exits_m - p - arms
    pulls = t[:, None] * ways / np.linalg.norm(ways, axis=1)[:, None]
    assert np.sum(arms[:, 0] * pulls[:, 1] - arms[:, 1] * pulls[:, 0]) == pytest.approx(0, abs=1e-9)
    assert statics.angle_rad(p * [-1, 1]) == pytest.approx(-angle)
    assert 1e-3 < abs(angle) < 0.1


def test_the_largest_box_is_feasible_and_a_wider_one_is_not() -> None:
    statics, plane = shipped(), Box((-2.0, 0.0), (2.0, 3.0))
    found = statics.largest_box(plane)
    assert found is not None
    spare_N = RESERVE * 130.0
    assert statics.margin_N(found.grid(41, 41), 2.0).min() > spare_N - 1.0
    wider = Box((found.low_m[0] - 0.15, found.low_m[1]), (found.high_m[0] + 0.15, found.high_m[1]))
    assert statics.margin_N(wider.grid(41, 41), 2.0).min() < spare_N
    heavy = dataclasses.replace(statics.platform, mass_kg=60.0)
    assert PlatformStatics(platform_model(heavy, LOW, HIGH)).largest_box(plane) is None


@settings(max_examples=40)
@given(st.floats(-1.2, 1.2), st.floats(0.8, 2.7))
def test_targets_are_the_positions_that_the_controller_accepts(x: float, y: float) -> None:
    robot, p = load_robot("planar-3"), np.array([x, y])
    assert robot.platform is not None
    statics = shipped()
    control = CableControl(statics.model, list(robot.axes), np.full(3, 4.5), 1e-3)
    moving_N = float(statics.margin_N(p, statics.platform.acceleration_m_s2))
    # the controller reserves less for the acceleration than the statics
    if abs(moving_N - statics.model.reserve_N) > 0.5:
        assert (control.infeasibility(p) == "") == bool(statics.is_target(p))


def test_a_point_platform_does_not_turn_and_has_no_margin_in_an_exit_point() -> None:
    platform = dataclasses.replace(shipped().platform, anchor_points_m=((0.0, 0.0),) * 3)
    statics = PlatformStatics(platform_model(platform, LOW, HIGH))
    assert statics.angle_rad(np.array([0.3, 1.5])) == 0.0
    at_exits = statics.margin_N(np.array(platform.exit_points_m))
    assert (at_exits == -np.inf).all()


def test_the_largest_box_is_feasible_with_the_reserve_of_its_own_middle() -> None:
    statics = statics_of(load_robot("point-4"))
    # the margin in the middle of the wide box is small, that in the smaller one is larger
    low, high = (-2.7, -2.2, 1.2), (2.7, 2.2, 3.8)
    platform = dataclasses.replace(
        statics.platform, workspace_min_m=low, workspace_max_m=high, home_m=(0.0, 0.0, 1.2)
    )
    wide = PlatformStatics(platform_model(platform, statics.low_N, statics.high_N))
    box = wide.largest_box(wide.box)
    assert box is not None
    platform = dataclasses.replace(platform, workspace_min_m=box.low_m, workspace_max_m=box.high_m)
    smaller = PlatformStatics(platform_model(platform, statics.low_N, statics.high_N))
    assert smaller.model.reserve_N > wide.model.reserve_N + 0.5
    assert smaller.is_target(smaller.points()).all()


def test_tensions_balance_a_centre_of_mass_beside_the_origin() -> None:
    statics = statics_of(load_robot("suspended-8"))
    aside = dataclasses.replace(statics.platform, centre_of_mass_m=(0.2, 0.0, 0.0))
    other = PlatformStatics(platform_model(aside, statics.low_N, statics.high_N))
    p = np.array([0.5, 0.3, 1.5])
    t, pose = other.tensions_N(p), other.model.pose(p)
    W = other.model.kinematics.wrench_matrix(pose)
    weight = np.array([0.0, 0.0, -9.80665 * aside.mass_kg])
    wrench = np.concatenate([weight, np.cross([0.2, 0.0, 0.0], weight)])
    # it bears half of each of its steel cables, 0.64 N/m
    for exit_m, anchor_m in zip(aside.exit_points_m, aside.anchor_points_m, strict=True):
        half = np.array([0.0, 0.0, -0.32 * np.linalg.norm(p + anchor_m - exit_m)])
        wrench += np.concatenate([half, np.cross(anchor_m, half)])
    np.testing.assert_allclose(W @ t + wrench, 0.0, atol=1e-6)
