"""A platform's model from the robot's file."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_profiles import load_robot
from cdpr_profiles.platform import BoxFile, Platform
from cdpr_profiles.robot import Robot
from cdpr_rt.model.platform_model import RESERVE, platform_model_of
from cdpr_rt.model.rigid_body import directions_of
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.model.tension_distribution import TensionOutcome
from cdpr_rt.platform.cable_control import CableControl
from tests.profiles.test_geometry_calibration import calibration

PLANAR, SUSPENDED = load_robot("planar-3"), load_robot("suspended-8")


def platform_with(points: int, *anchors: tuple[float, ...]) -> Platform:
    platform = PLANAR.platform if len(anchors[0]) == 2 else SUSPENDED.platform
    assert platform is not None
    exits = (platform.exit_points_m * 2)[:points]
    all_anchors = (anchors * points)[:points]
    return dataclasses.replace(
        platform, exit_points_m=exits, anchor_points_m=all_anchors, controlled=()
    )


@pytest.mark.parametrize(
    ("platform", "directions"),
    [
        (platform_with(3, (0.1, 0.0), (-0.1, 0.0)), (0, 1)),
        (platform_with(4, (0.1, 0.0), (-0.1, 0.0)), (0, 1, 5)),
        (platform_with(4, (0.0, 0.0)), (0, 1)),
        (platform_with(8, (0.1, 0.0, 0.0), (-0.1, 0.0, 0.1)), (0, 1, 2, 3, 4, 5)),
        (platform_with(6, (0.0, 0.0, 0.0)), (0, 1, 2)),
    ],
)
def test_directions_follow_from_the_points(platform: Platform, directions: tuple[int, ...]) -> None:
    assert directions_of(platform) == directions


def test_the_reserve_is_a_share_of_the_margin_to_the_tension_bounds() -> None:
    planar, suspended = platform_model_of(PLANAR), platform_model_of(SUSPENDED)
    assert planar.reserve_N == RESERVE * 130.0
    box = np.array([suspended.platform.workspace_min_m, suspended.platform.workspace_max_m])
    middle = suspended.poses(box.mean(axis=0)[None])
    margins, _ = suspended.workspace(0.0, 0.0).margins(middle)
    assert 0.0 < suspended.reserve_N < 0.5 * margins[0] < RESERVE * 1990.0
    control = CableControl(planar, PLANAR.axes, np.full(3, 4.5), 1e-3)
    assert control.position == pytest.approx(planar.platform.home_m)


def test_weight_and_wrench_scale_have_an_entry_per_direction() -> None:
    planar, suspended = platform_model_of(PLANAR), platform_model_of(SUSPENDED)
    assert planar.weight() == pytest.approx([0.0, -2.0 * 9.80665])
    assert suspended.weight() == pytest.approx([0.0, 0.0, -980.665, 0.0, 0.0, 0.0])
    arm = np.linalg.norm(suspended.platform.anchor_points_m, axis=1).max()
    assert suspended.wrench_scale == pytest.approx([1.0, 1.0, 1.0, arm, arm, arm])
    pose = suspended.pose(np.array([1.0, 2.0, 3.0]))
    assert suspended.poses(np.array([[1.0, 2.0, 3.0]]))[0] == pytest.approx(pose.array)


def test_a_platform_tips_over_at_half_its_width_over_its_height() -> None:
    spatial = platform_model_of(load_robot("spatial-8"))
    anchors = np.array(spatial.platform.anchor_points_m)
    half_width, height = 0.5 * np.ptp(anchors[:, :2], axis=0).min(), np.ptp(anchors[:, 2])
    assert spatial.tips_at == pytest.approx(half_width / height)
    lying = dataclasses.replace(spatial.platform, home_rotation_rad=(np.pi / 2, 0.0, 0.0))
    turned = dataclasses.replace(spatial, platform=lying)
    width = min(np.ptp(anchors[:, 0]), height)
    assert turned.tips_at == pytest.approx(0.25 * width / half_width)
    foot = BoxFile(min_m=(-0.3, -0.4, -0.35), max_m=(0.3, 0.4, 0.3))
    on_foot = dataclasses.replace(spatial.platform, body=foot)
    broad = dataclasses.replace(spatial, platform=on_foot)
    assert broad.tips_at == pytest.approx(0.3 / 0.65)
    assert platform_model_of(PLANAR).tips_at == pytest.approx(0.577, abs=1e-3)
    assert platform_model_of(load_robot("point-4")).tips_at == np.inf


@settings(max_examples=100)
@given(
    st.tuples(st.floats(-1.9, 1.9), st.floats(0.2, 2.9)),
    st.tuples(st.floats(-150.0, 150.0), st.floats(-150.0, 150.0)),
)
def test_least_tensions_of_three_cables_have_the_least_sum(
    place: tuple[float, float], wrench: tuple[float, float]
) -> None:
    model, t = platform_model_of(PLANAR), np.zeros(3)
    W = model.kinematics.wrench_matrix(model.pose(np.array(place)))
    outcome = model.least_tensions(model.low_N, model.high_N).solve(W, np.array(wrench), t)
    bounds = list(zip(model.low_N, model.high_N, strict=True))
    least = linprog([1, 1, 1], None, None, W, -np.array(wrench), bounds)
    u = np.linalg.svd(W)[2][2]
    if outcome is TensionOutcome.FEASIBLE and ((u > 0.01).all() or (u < -0.01).all()):
        assert t.sum() == pytest.approx(least.fun, rel=1e-6)
        assert (t - model.low_N).min() == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "point-4", "spatial-8", "suspended-8"])
@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_lengths_may_disagree_by_errors_of_tape_and_drums(name: str, size: float) -> None:
    robot = _of_size(load_robot(name), size)
    assert robot.platform is not None
    frame_m = np.linalg.norm(np.ptp(np.array(robot.platform.exit_points_m), axis=0))
    tape_m = min(0.022, 0.01 * float(frame_m))
    drums_m = limits_of(robot).lengths_disagree_m - tape_m
    assert drums_m == pytest.approx(3.0 * _residual_of_drums_m(robot, 0.003), rel=0.1)
    told = robot.limits.model_copy(update={"lengths_disagree_m": 0.05})
    assert limits_of(dataclasses.replace(robot, limits=told)).lengths_disagree_m == 0.05


def test_lengths_of_a_facade_robot_may_disagree_by_the_observed_38_mm() -> None:
    # 10 m x 6 m; exit points 5 mm and drums 0.3 % off, cables 30 % softer: 38 mm, without a fault
    facade = dataclasses.replace(
        load_robot("planar-4").platform,
        exit_points_m=((-5.0, 6.0), (5.0, 6.0), (5.0, 0.0), (-5.0, 0.0)),
        anchor_points_m=((-0.4, 0.25), (0.4, 0.25), (0.4, -0.25), (-0.4, -0.25)),
        controlled=("x", "y"),
        home_m=(0.0, 1.5),
        workspace_min_m=(-2.5, 1.7),
        workspace_max_m=(2.5, 3.4),
    )
    robot = dataclasses.replace(load_robot("planar-4"), platform=facade)
    assert 1.2 * 0.0381 < limits_of(robot).lengths_disagree_m < 0.06


@pytest.mark.parametrize(
    ("name", "slip_m"),
    [
        ("planar-3", 0.06),
        ("planar-4", 0.08),
        ("point-4", 0.06),
        ("spatial-8", 0.08),
        ("suspended-8", 0.09),  # 19 m across: drums alone cause 20 mm
    ],
)
def test_a_slip_of_6_to_9_cm_exceeds_the_allowed_disagreement(name: str, slip_m: float) -> None:
    robot = load_robot(name)
    assert (slip_m * _shares_of_a_slip(robot) > limits_of(robot).lengths_disagree_m).all()


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "point-4", "spatial-8", "suspended-8"])
def test_a_slip_of_3_cm_exceeds_the_allowed_disagreement_after_calibration(name: str) -> None:
    file = load_robot(name)
    robot = dataclasses.replace(file, calibration=calibration(file))
    least_m = 0.03 * _shares_of_a_slip(robot).min()
    assert limits_of(robot).lengths_disagree_m < least_m < limits_of(file).lengths_disagree_m
    doubted = limits_of(robot, calibration_in_doubt=True)
    assert doubted.lengths_disagree_m == limits_of(file).lengths_disagree_m


@pytest.mark.parametrize(
    ("predicted_mm", "allowed_m"),
    [(0.5, 0.00545), (8.0, 0.008), (20.0, 0.01633)],
    ids=["a third", "as it was calibrated", "as without"],
)
def test_a_calibration_tightens_the_limit_of_a_small_frame_by_its_accuracy(
    predicted_mm: float, allowed_m: float
) -> None:
    known = calibration(PLANAR).model_copy(update={"predicted_3_sigma_mm": predicted_mm})
    robot = dataclasses.replace(_of_size(PLANAR, 0.28), calibration=known)
    assert limits_of(robot).lengths_disagree_m == pytest.approx(allowed_m, abs=2e-5)


def test_a_calibration_never_lowers_the_limit_below_5_mm() -> None:
    known = calibration(PLANAR).model_copy(update={"predicted_3_sigma_mm": 0.5})
    robot = dataclasses.replace(_of_size(PLANAR, 0.2), calibration=known)
    assert limits_of(robot).lengths_disagree_m == 0.005


def _of_size(robot: Robot, size: float) -> Robot:
    """Return a robot with all points scaled by `size`."""
    platform = robot.platform
    assert platform is not None

    def scaled(points: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(size * x for x in point) for point in points)

    home, low, high = scaled((platform.home_m, platform.workspace_min_m, platform.workspace_max_m))
    return dataclasses.replace(
        robot,
        platform=dataclasses.replace(
            platform,
            exit_points_m=scaled(platform.exit_points_m),
            anchor_points_m=scaled(platform.anchor_points_m),
            home_m=home,
            workspace_min_m=low,
            workspace_max_m=high,
        ),
    )


def _residual_of_drums_m(robot: Robot, off: float) -> float:
    """Return the standard deviation of a normalised residual at the worst corner, from draws."""
    model = platform_model_of(robot)
    kinematics, platform = model.kinematics, model.platform
    shares = off * np.random.default_rng(5).standard_normal((2000, len(robot.axes)))
    home_m = kinematics.lengths(model.home_pose).copy()
    worst_m = 0.0
    for corner in itertools.product(
        *zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ):
        pose = model.pose(np.array(corner))
        errors_m = shares * (kinematics.lengths(pose) - home_m)
        J = kinematics.jacobian(pose)
        fits = np.linalg.lstsq(J, errors_m.T, rcond=None)[0]
        left_m = errors_m.T - J @ fits
        redundancy = 1.0 - np.einsum("ij,ji->i", J, np.linalg.pinv(J))
        worst_m = max(worst_m, float((left_m.std(axis=1) / np.sqrt(redundancy)).max()))
    return worst_m


def _shares_of_a_slip(robot: Robot) -> np.ndarray:
    """Return each cable's normalised residual at home as a share of its slip."""
    model = platform_model_of(robot)
    J = model.kinematics.jacobian(model.home_pose)
    return np.sqrt(1.0 - np.diag(J @ np.linalg.pinv(J)))
