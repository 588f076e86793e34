"""Whether cable lengths agree that the platform stands at home, and its pretension there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.model.rigid_body import G_m_s2
from cdpr_rt.model.robot_arrays import limits_of, winches_of
from cdpr_rt.model.standing_tensions import OVERSHOOT, StandingTensions
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.registry import platform_parts
from cdpr_rt.programs.standing import (
    disagreement,
    hangs,
    rests_at_home,
    why_not_at_home,
    why_not_to_wind_in,
)
from tests.cdpr_rt.platform.platform_physics import heavier, spatial

PERIOD_S = 1e-3
SEED = 1


@pytest.fixture(scope="module", params=["spatial-8", "suspended-8"])
def parts(request: pytest.FixtureRequest) -> PlatformParts:
    return parts_of(request.param)


def parts_of(name: str, allowed_m: float | None = None) -> PlatformParts:
    robot = load_robot(name)
    n, limits = len(robot.axes), limits_of(robot)
    if allowed_m is not None:
        limits = replace(limits, lengths_disagree_m=allowed_m)
    model = model_of(robot.axes, PERIOD_S, [2.3e-3] * n, limits)
    made = platform_parts(robot, limits, model, Estimator(n, PERIOD_S, winches_of(robot.axes)))
    assert made is not None
    return made


def why_not(parts: PlatformParts, longer_m: FloatArray) -> str:
    """Return why cables longer than at home by these lengths, (n,), contradict home."""
    low_N, feedback = parts.control.low_N, AxisFeedback(longer_m.size)
    feedback.valid[:] = True
    return why_not_at_home(parts, parts.control.lengths_at_home(low_N) + longer_m, low_N, feedback)


def test_the_lengths_of_an_overturned_platform_contradict_home(parts: PlatformParts) -> None:
    rng, model = np.random.default_rng(SEED), parts.model
    home_m = model.kinematics.lengths(model.home_pose).copy()
    for turned_deg in (20, 40, 60, 90, 120, 150, 180):
        for _ in range(40):
            axis = rng.normal(size=3)
            about = Rotation.from_rotvec(np.radians(turned_deg) * axis / np.linalg.norm(axis))
            aside_m = rng.uniform(-0.1, 0.1, 3) * [1.0, 1.0, 0.0]
            there = model.pose(np.r_[model.home[:3] + aside_m, about.as_rotvec()])
            longer_m = model.kinematics.lengths(there) - home_m
            assert "not at home" in why_not(parts, longer_m), (turned_deg, axis)


def test_one_slipped_cable_does_not_contradict_home(parts: PlatformParts) -> None:
    n = parts.control.low_N.size
    assert not why_not(parts, np.zeros(n))
    for cable in range(n):
        assert not why_not(parts, 0.3 * np.eye(n)[cable])
        two = 0.3 * (np.eye(n)[cable] + np.eye(n)[cable - 1])
        assert "the lengths of 2 cables are up to 300 mm" in why_not(parts, two)


def test_slack_is_not_wound_in_if_cables_are_too_short_for_home(parts: PlatformParts) -> None:
    rng, model, n = np.random.default_rng(SEED), parts.model, parts.control.low_N.size
    home_m = parts.control.lengths_at_home(np.zeros(n))
    refused = 0
    for _ in range(200):
        aside_m = rng.uniform(-0.6, 0.6, 3) * [1.0, 1.0, 0.0]
        there = model.pose(np.r_[model.home[:3] + aside_m, np.zeros(3)])
        lies_m = model.kinematics.lengths(there) + rng.uniform(0.0, 0.3, n)
        if why_not_to_wind_in(parts, lies_m):
            refused += 1
            # the lengths still contradict home when slack is wound in as far as possible
            assert "not at home" in why_not(parts, np.minimum(lies_m - home_m, 0.0))
    assert refused > 100
    assert "2 cables are up to 300 mm too short" in why_not_to_wind_in(
        parts, home_m - 0.3 * np.eye(n)[0] - 0.3 * np.eye(n)[1]
    )
    for slack_m in (0.0, 0.5):
        assert not why_not_to_wind_in(parts, home_m + slack_m)
        assert not why_not_to_wind_in(parts, home_m + slack_m - (0.3 + slack_m) * np.eye(n)[2])


def test_a_platform_does_not_rest_if_upward_tensions_carry_its_weight(parts: PlatformParts) -> None:
    model, control, n = parts.model, parts.control, parts.control.low_N.size
    feedback, tension_N = AxisFeedback(n), parts.estimator.estimate.tension_N
    length_m = control.lengths_at_home(control.low_N)
    W, weight_N = model.kinematics.wrench_matrix(model.home_pose), parts.platform.mass_kg * G_m_s2
    # the least tensions that carry a share of the weight and balance all other directions
    for share, rests in ((1.0, False), (0.85, False), (0.6, True)):
        wrench = np.zeros(len(W))
        wrench[model.positions - 1] = share * weight_N
        tension_N[:] = nnls(W, wrench)[0]
        assert W @ tension_N == pytest.approx(wrench, abs=1e-6)
        assert rests_at_home(parts, length_m, feedback) == rests


def test_a_platform_rests_if_its_tensions_cancel_each_other() -> None:
    """Tensions of cables from all sides cancel each other, whatever their sum is."""
    parts = parts_of("spatial-8")
    control, model, n = parts.control, parts.model, parts.control.low_N.size
    W = model.kinematics.wrench_matrix(model.home_pose).copy()
    cancelling, off = nnls(np.vstack([W, np.ones(n)]), np.eye(len(W) + 1)[-1])
    assert off < 1e-6
    parts.estimator.estimate.tension_N[:] = 2.0 * parts.platform.mass_kg * G_m_s2 * cancelling
    home_m, feedback = model.kinematics.lengths(model.home_pose).copy(), AxisFeedback(n)
    length_m = control.lengths_at_home(control.low_N)
    assert hangs(parts) and rests_at_home(parts, length_m, feedback)
    # away from home nothing shows that it rests on something
    raised = model.home + 2.0 * parts.platform.home_tolerance_m * np.eye(len(W))[2]
    raised_m = model.kinematics.lengths(model.pose(raised)) - home_m
    assert not rests_at_home(parts, length_m + raised_m, feedback)


def test_a_large_frame_allows_more_disagreement_away_from_home() -> None:
    parts = parts_of("spatial-8", 0.15)
    control, feedback = parts.control, AxisFeedback(8)
    feedback.valid[:] = True
    slipped_m = control.lengths_at_home(control.low_N) + 0.2 * np.eye(8)[0]
    control.take_lengths(slipped_m, feedback)
    control.begin(feedback, control.low_N)
    assert parts.platform.home_tolerance_m < control.residual_m < 0.15
    assert not disagreement(parts, "last")
    told = disagreement(parts, "home")
    assert "50 mm allowed, one of axis 1, " in told, "the most likely cable is named first"
    assert "; the platform is not at home" in told


# Tensions at a standing platform.


@pytest.mark.parametrize(("mass_kg", "share"), [(6.0, 1.0), (12.0, 0.75), (14.0, 0.25)])
def test_the_least_tension_is_as_high_as_the_bounds_allow(mass_kg: float, share: float) -> None:
    """With little tension, friction lets cables sag, and their lengths give a wrong pose.

    The heavier a platform that is pressed down with its weight, the less is left for that.
    """
    machine = heavier(spatial(), mass_kg)
    model, low_N = machine.model(), machine.control().low_N
    most_N = np.full(machine.n, machine.torque_Nm / 0.026)
    standing = StandingTensions(model, low_N, most_N, np.zeros(machine.n))
    tension_N, stays = standing.at(model.home_pose)
    W = np.zeros((model.size, machine.n))
    model.kinematics.wrench_matrix(model.home_pose, W)
    assert stays
    floor_N = machine.low_N + share * (low_N - machine.low_N)
    assert tension_N.min() == pytest.approx(floor_N.min(), abs=1e-6)
    assert (OVERSHOOT * tension_N < machine.high_N).all()
    np.testing.assert_allclose(W @ tension_N, model.weight(), atol=1e-6)


@pytest.mark.parametrize(
    ("mass_kg", "taken_up_N", "share"), [(14.0, 20.0, 1.0), (14.0, 23.0, 0.75), (18.0, 26.0, 0.5)]
)
def test_winches_with_high_friction_pull_harder_and_press_the_platform_less(
    mass_kg: float, taken_up_N: float, share: float
) -> None:
    """Otherwise friction leaves a cable nearly slack, and its length is arbitrary."""
    machine = heavier(spatial(), mass_kg)
    model, low_N = machine.model(), machine.control().low_N
    most_N, taken_up = np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
    tension_N, stays = StandingTensions(model, low_N, most_N, taken_up).at(model.home_pose)
    W = np.zeros((model.size, machine.n))
    model.kinematics.wrench_matrix(model.home_pose, W)
    assert stays
    assert (tension_N > taken_up_N).all()
    np.testing.assert_allclose(W @ tension_N, share * model.weight(), atol=1e-6)


def test_tensions_increase_with_the_friction_of_winches() -> None:
    machine = heavier(spatial(), 14.0)
    model, low_N = machine.model(), machine.control().low_N
    least_N = []
    for taken_up_N in (0.0, 20.0, 23.0, 30.0, 40.0):
        most_N, taken_up = np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
        taken_up[0] *= 2.0
        standing = StandingTensions(model, low_N, most_N, taken_up)
        tension_N, stays = standing.at(model.home_pose)
        assert stays
        least_N.append(tension_N.min())
    assert least_N == sorted(least_N)
    assert least_N[-1] > 1.5 * least_N[0]


@pytest.mark.parametrize(("taken_up_N", "pulled_N"), [(28.0, 33.6), (44.0, 39.6)])
def test_tensions_exceed_the_planned_ones_at_high_friction(
    taken_up_N: float, pulled_N: float
) -> None:
    """Up to their bounds: 1.2 times the friction of winches, or three quarters of that."""
    machine = heavier(spatial(), 14.0)
    model, low_N = machine.model(), np.full(machine.n, 20.0)
    standing = StandingTensions(
        model, low_N, np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
    )
    tension_N, stays = standing.at(model.home_pose)
    assert stays
    assert tension_N.min() > pulled_N - 1e-6
    assert (OVERSHOOT * tension_N < machine.high_N).all()
