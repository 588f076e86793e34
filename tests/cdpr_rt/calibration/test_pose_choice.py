"""Poses chosen by distance and by information agree with plain definitions of both."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.calibration.fit import moved
from cdpr_rt.calibration.pose_choice import (
    HAND_EYE_m,
    HAND_EYE_rad,
    LENGTH_m,
    POSITION_m,
    ROTATION_rad,
    cable_geometry,
    information_rows,
    informative,
    pose_rows,
    predicted_deviation_m,
    spread,
)
from cdpr_rt.calibration.residuals import encoder_lengths
from cdpr_rt.model.cable_kernel import RADIUS
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.reachable import Reach
from tests.cdpr_rt.model.pulley import over_a_pulley


def candidates(count: int) -> tuple[np.ndarray, np.ndarray, PlatformModel, np.ndarray]:
    model = platform_model_of(load_robot("spatial-8"))
    positions = Reach(model).draw(count, 9).positions
    points = np.array(model.platform.exit_points_m), np.array(model.platform.anchor_points_m)
    return *points, model, model.poses(positions)


def log_det(rows: np.ndarray, taken: list[int]) -> float:
    all_rows = np.concatenate(rows[taken])
    return float(np.linalg.slogdet(np.eye(rows.shape[2]) + all_rows.T @ all_rows)[1])


def test_the_chosen_spread_is_at_least_half_the_optimum() -> None:
    positions = np.random.default_rng(2).uniform(-1.0, 1.0, (14, 3))
    arms = np.array([1.0, 1.0, 0.3])

    def width(taken: tuple[int, ...]) -> float:
        points = positions[list(taken)] * arms
        return min(float(np.linalg.norm(a - b)) for a, b in combinations(points, 2))

    taken = tuple(spread(positions, arms, 5).tolist())
    assert len(set(taken)) == 5
    best = max(width(some) for some in combinations(range(14), 5))
    assert best / 2.0 <= width(taken) <= best


def test_each_chosen_pose_adds_the_most_information() -> None:
    _, _, model, poses = candidates(100)
    rows = pose_rows(cable_geometry(model), poses)
    taken = informative(cable_geometry(model), poses, 5).tolist()
    for k, one in enumerate(taken):
        before = taken[:k]
        others = [j for j in range(len(poses)) if j not in before]
        assert one == max(others, key=lambda j: log_det(rows, [*before, j]))


def test_information_rows_of_a_pose_equal_its_marginal_information() -> None:
    # poses and parameters are unknowns of one problem, and the poses are eliminated
    _, _, model, poses = candidates(3)
    geometry = cable_geometry(model)
    rows = pose_rows(geometry, poses)
    size, n = geometry.size, geometry.n
    tension = np.full((1, n), 50.0)
    for j, pose in enumerate(poses):
        J = np.zeros((n + 6, size + 12))

        def told(
            x: np.ndarray, pose: np.ndarray = pose, tension: np.ndarray = tension
        ) -> np.ndarray:
            there = moved(pose[None], x[None, size + 6 :], (0, 1, 2, 3, 4, 5))
            lengths = encoder_lengths(geometry.with_values(x[:size]), there, tension)[0]
            Q = there[0, 1:]
            camera = np.concatenate([
                (there[0, 0] + Q @ x[size : size + 3]) / POSITION_m,
                Rotation.from_matrix(
                    Q @ Rotation.from_rotvec(x[size + 3 : size + 6]).as_matrix() @ pose[1:].T
                ).as_rotvec() / ROTATION_rad,
            ])  # fmt: skip
            return np.concatenate([lengths / geometry.knowledge.length_m, camera])

        known = np.concatenate([geometry.known_std(), [HAND_EYE_m] * 3, [HAND_EYE_rad] * 3])
        for k in range(size + 12):
            step = np.zeros(size + 12)
            step[k] = 1e-6
            J[:, k] = (told(step) - told(-step)) / 2e-6
        H = J.T @ J
        p, x = slice(0, size + 6), slice(size + 6, None)
        left = H[p, p] - H[p, x] @ np.linalg.solve(H[x, x], H[x, p])
        drums = np.isin(np.arange(size + 6), [5 * i + 4 for i in range(n)])
        same = ~drums  # only the rows contain the length paid out at a pose
        expected = (left * np.outer(known, known))[np.ix_(same, same)]
        got = (rows[j].T @ rows[j])[np.ix_(same, same)]
        assert got == pytest.approx(expected, rel=1e-3, abs=1e-4 * np.abs(expected).max())


def test_chosen_poses_give_more_information_than_random_ones() -> None:
    _, _, model, poses = candidates(400)
    geometry = model.kinematics.geometry
    taken = informative(cable_geometry(model), poses, 30)
    chosen = predicted_deviation_m(geometry, poses[taken])
    at_random = predicted_deviation_m(geometry, poses[:30])
    assert chosen < at_random


def test_information_rows_agree_with_simulated_measurements() -> None:
    # one cable with noisy lengths and poses: rows are divided by the deviation of its residuals
    exits, anchors, model, poses = candidates(1)
    rng, count = np.random.default_rng(4), 40_000
    exit_point, anchor, p, Q = exits[2], anchors[2], poses[0, 0], poses[0, 1:]
    arm = Q @ anchor
    true = np.linalg.norm(p + arm - exit_point)
    moved = p + rng.normal(0.0, POSITION_m, (count, 3))
    turned = arm + np.cross(rng.normal(0.0, ROTATION_rad, (count, 3)), arm)
    seen = np.linalg.norm(moved + turned - exit_point, axis=1) - true
    seen -= rng.normal(0.0, LENGTH_m, count)
    row = information_rows(model.kinematics.geometry, poses)[0, 2]
    assert 1.0 / row[3] == pytest.approx(float(seen.std()), rel=0.03)
    step = 1e-6 * np.array([0.3, -0.5, 0.2])
    change = np.linalg.norm(p + arm - exit_point - step) - true
    assert -row[:3] @ step / row[3] == pytest.approx(change, rel=1e-3)


def test_information_rows_over_a_pulley_follow_its_cable_length() -> None:
    exits, anchors, model, poses = candidates(1)
    geometry, radius_m, i = model.kinematics.geometry.copy(), 0.2, 2
    geometry[RADIUS] = radius_m
    (row,) = information_rows(geometry, poses)[:, i]
    p, arm = poses[0, 0], poses[0, 1:] @ anchors[i]

    def length(exit_m: np.ndarray, point_m: np.ndarray) -> float:
        return over_a_pulley(exit_m, radius_m, point_m)[0]

    h = 1e-2
    by_exit, by_turn = np.zeros((2, 3))
    for k, step in enumerate(h * np.eye(3)):
        by_exit[k] = length(exits[i] + step, p + arm) - length(exits[i] - step, p + arm)
        turned = np.cross(step, arm)
        by_turn[k] = length(exits[i], p + arm + turned) - length(exits[i], p + arm - turned)
    by_exit, by_turn = by_exit / (2.0 * h), by_turn / (2.0 * h)
    std_m = math.sqrt(LENGTH_m**2 + POSITION_m**2 + (by_turn @ by_turn) * ROTATION_rad**2)
    assert 1.0 / row[3] == pytest.approx(std_m, rel=1e-3)
    assert row[:3] / row[3] == pytest.approx(-by_exit, abs=1e-3)
    straight = information_rows(model.kinematics.geometry, poses)[0, i]
    assert np.abs(straight[:3] / straight[3] + by_exit).max() > 0.02
