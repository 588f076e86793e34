"""Poses chosen by distance and by information: against plain definitions of both."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.calibration.pose_choice import (
    EXIT_m,
    LENGTH_m,
    OFFSET_m,
    POSITION_m,
    ROTATION_rad,
    information_rows,
    informative,
    predicted_deviation_m,
    spread,
)
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_rt.robots.reach.reachable import Reach

PRIOR = np.diag([EXIT_m**-2] * 3 + [OFFSET_m**-2])


def candidates(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    model = platform_model_of(load_robot("spatial-8"))
    positions = Reach(model).draw(count, 9).positions
    points = np.array(model.platform.exit_points_m), np.array(model.platform.anchor_points_m)
    return *points, positions, model.poses(positions)


def log_det(rows: np.ndarray, taken: list[int]) -> float:
    inform = PRIOR + np.einsum("mia,mib->iab", rows[taken], rows[taken])
    return float(np.linalg.slogdet(inform)[1].sum())


def test_no_spread_is_twice_as_wide_as_the_one_that_is_chosen() -> None:
    positions = np.random.default_rng(2).uniform(-1.0, 1.0, (14, 3))
    arms = np.array([1.0, 1.0, 0.3])

    def width(taken: tuple[int, ...]) -> float:
        points = positions[list(taken)] * arms
        return min(float(np.linalg.norm(a - b)) for a, b in combinations(points, 2))

    taken = tuple(spread(positions, arms, 5).tolist())
    assert len(set(taken)) == 5
    best = max(width(some) for some in combinations(range(14), 5))
    assert best / 2.0 <= width(taken) <= best


def test_each_pose_that_is_taken_tells_most_beside_those_before() -> None:
    exits, anchors, _, poses = candidates(40)
    rows = information_rows(exits, anchors, poses)
    taken = informative(exits, anchors, poses, 6).tolist()
    for k, one in enumerate(taken):
        before = taken[:k]
        others = [j for j in range(len(poses)) if j not in before]
        assert one == max(others, key=lambda j: log_det(rows, [*before, j]))


def test_chosen_poses_tell_more_than_as_many_at_random() -> None:
    exits, anchors, _, poses = candidates(400)
    chosen = predicted_deviation_m(exits, anchors, poses[informative(exits, anchors, poses, 30)])
    at_random = predicted_deviation_m(exits, anchors, poses[:30])
    assert chosen < at_random


def test_a_pose_tells_what_measurement_would() -> None:
    # a cable, measured lengths, poses with noise: residuals' deviation is what the rows divide by
    exits, anchors, _, poses = candidates(1)
    rng, count = np.random.default_rng(4), 40_000
    exit_point, anchor, p, Q = exits[2], anchors[2], poses[0, 0], poses[0, 1:]
    arm = Q @ anchor
    true = np.linalg.norm(p + arm - exit_point)
    moved = p + rng.normal(0.0, POSITION_m, (count, 3))
    turned = arm + np.cross(rng.normal(0.0, ROTATION_rad, (count, 3)), arm)
    seen = np.linalg.norm(moved + turned - exit_point, axis=1) - true
    seen -= rng.normal(0.0, LENGTH_m, count)
    row = information_rows(exits, anchors, poses)[0, 2]
    assert 1.0 / row[3] == pytest.approx(float(seen.std()), rel=0.03)
    step = 1e-6 * np.array([0.3, -0.5, 0.2])
    change = np.linalg.norm(p + arm - exit_point - step) - true
    assert -row[:3] @ step / row[3] == pytest.approx(change, rel=1e-3)
