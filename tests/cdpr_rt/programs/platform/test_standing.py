"""What the lengths of cables tell of a platform that is said to stand at home."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.tightening.standing import (
    why_not_at_home,
    why_not_to_wind_in,
)
from cdpr_rt.programs.registry import platform_parts
from cdpr_rt.robots.robot_arrays import limits_of, winches_of

PERIOD_S = 1e-3
SEED = 1


@pytest.fixture(scope="module", params=["spatial-8", "suspended-8"])
def parts(request: pytest.FixtureRequest) -> PlatformParts:
    robot = load_robot(request.param)
    n, limits = len(robot.axes), limits_of(robot)
    model = model_of(robot.axes, PERIOD_S, [2.3e-3] * n, limits)
    made = platform_parts(robot, limits, model, Estimator(n, PERIOD_S, winches_of(robot.axes)))
    assert made is not None
    return made


def why_not(parts: PlatformParts, longer_m: FloatArray) -> str:
    """Return what speaks against home with cables that are so much longer than there, (n,)."""
    low_N, feedback = parts.control.low_N, AxisFeedback(longer_m.size)
    feedback.valid[:] = True
    return why_not_at_home(parts, parts.control.lengths_at_home(low_N) + longer_m, low_N, feedback)


def test_no_platform_that_is_turned_over_stands_at_home(parts: PlatformParts) -> None:
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


def test_one_cable_that_has_slipped_does_not_speak_against_home(parts: PlatformParts) -> None:
    n = parts.control.low_N.size
    assert not why_not(parts, np.zeros(n))
    for cable in range(n):
        assert not why_not(parts, 0.3 * np.eye(n)[cable])
        two = 0.3 * (np.eye(n)[cable] + np.eye(n)[cable - 1])
        assert "the lengths of 2 cables are up to 300 mm" in why_not(parts, two)


def test_slack_is_not_wound_in_where_cables_do_not_even_reach_home(parts: PlatformParts) -> None:
    rng, model, n = np.random.default_rng(SEED), parts.model, parts.control.low_N.size
    home_m = parts.control.lengths_at_home(np.zeros(n))
    refused = 0
    for _ in range(200):
        aside_m = rng.uniform(-0.6, 0.6, 3) * [1.0, 1.0, 0.0]
        there = model.pose(np.r_[model.home[:3] + aside_m, np.zeros(3)])
        lies_m = model.kinematics.lengths(there) + rng.uniform(0.0, 0.3, n)
        if why_not_to_wind_in(parts, lies_m):
            refused += 1
            # nor does it stand there when these are wound in, as far as they can be
            assert "not at home" in why_not(parts, np.minimum(lies_m - home_m, 0.0))
    assert refused > 100
    assert "2 cables are up to 300 mm too short" in why_not_to_wind_in(
        parts, home_m - 0.3 * np.eye(n)[0] - 0.3 * np.eye(n)[1]
    )
    for slack_m in (0.0, 0.5):
        assert not why_not_to_wind_in(parts, home_m + slack_m)
        assert not why_not_to_wind_in(parts, home_m + slack_m - (0.3 + slack_m) * np.eye(n)[2])
