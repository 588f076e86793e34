"""Wrench-feasible workspace of any robot: margins compared with linear programming, and texts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.kinematics import PLANAR, PLANAR_POINT, POINT, SPATIAL, CableKinematics
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.workspace import SHARES, CableWorkspace, corners, wrenches_in_motion
from tests.cdpr_rt.model.shipped_points import COGIRO

SHAPES = [(PLANAR_POINT, 2), (PLANAR_POINT, 3), (PLANAR, 4), (PLANAR, 5), (POINT, 4), (POINT, 7)]
SHAPES += [(SPATIAL, 6), (SPATIAL, 7), (SPATIAL, 8), (SPATIAL, 9)]
LOW_N, HIGH_N = 20.0, 900.0


def made_up(
    directions: tuple[int, ...], n: int, rng: np.random.Generator
) -> tuple[CableWorkspace, Pose]:
    a, b = rng.uniform(-3.0, 3.0, (n, 3)), rng.uniform(-0.3, 0.3, (n, 3))
    d = len(directions)
    wrenches = rng.normal(0.0, 80.0, (int(rng.integers(1, 4)), d))
    generators = rng.normal(0.0, 25.0, (int(rng.integers(0, 4)), d))
    low, high = LOW_N * rng.uniform(0.5, 1.5, n), HIGH_N * rng.uniform(0.5, 1.5, n)
    robot = CableKinematics(a, b, directions)
    pose = Pose(rng.uniform(-0.8, 0.8, 3)).plus(np.array([0, 0, 0, *rng.uniform(-0.2, 0.2, 3)]))
    return CableWorkspace(robot, wrenches, low, high, np.ones(d), generators=generators), pose


def by_linear_programming(workspace: CableWorkspace, pose: Pose) -> float:
    W = workspace.kinematics.wrench_matrix(pose)
    d, n = W.shape
    rows = np.hstack([np.vstack([-np.eye(n), np.eye(n)]), np.ones((2 * n, 1))])
    bounds = np.concatenate([-workspace.low, workspace.high])
    told = [
        linprog(
            [0.0] * n + [-1.0], rows, bounds, np.hstack([W, np.zeros((d, 1))]), -w_e,
            [(None, None)] * (n + 1),
        )
        for w_e in workspace.wrenches
    ]  # fmt: skip
    return float(min(-found.fun for found in told))


@settings(max_examples=200)
@given(st.sampled_from(SHAPES), st.integers(0, 2**32 - 1))
def test_the_margin_equals_that_of_linear_programming(
    shape: tuple[tuple[int, ...], int], seed: int
) -> None:
    workspace, pose = made_up(*shape, np.random.default_rng(seed))
    (margin,), (t,) = workspace.margins(pose.array[None])
    W = workspace.kinematics.wrench_matrix(pose)
    if np.linalg.cond(W) > 1e4:
        return
    assert margin == pytest.approx(by_linear_programming(workspace, pose), abs=1e-5, rel=1e-7)
    (closed_form,) = workspace.capacity_margins(pose.array[None])
    assert closed_form == pytest.approx(margin, abs=1e-6, rel=1e-7)
    (early,) = workspace.capacity_margins(pose.array[None], 0.0)
    assert (early >= 0.0) == (closed_form >= 0.0)
    # the tensions carry one of the wrenches, and have the margin
    missing = np.abs(W @ t + workspace.wrenches).max(axis=1)
    assert missing.min() < 1e-6
    inside = np.minimum(t - workspace.low, workspace.high - t).min()
    assert inside == pytest.approx(margin, abs=1e-6)
    assert workspace.is_feasible(pose) == (margin >= 0.0)
    assert (workspace.infeasibility(pose) == "") == (margin >= 0.0)


def test_infeasible_poses_are_reported() -> None:
    flat = CableKinematics(
        np.array([[-1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.zeros((3, 2)), (0, 1)
    )
    weight, _ = wrenches_in_motion(2.0, 0.0, 1, (0, 1))
    workspace = CableWorkspace(flat, weight, np.zeros(3), np.full(3, 9.0), np.ones(2))
    assert "cannot hold one direction" in workspace.infeasibility(Pose(np.zeros(3)))
    assert "cannot hold one direction" in workspace.infeasibility(Pose(np.array([1.0, 0.0, 0.0])))
    margins, _ = workspace.margins(Pose(np.zeros(3)).array[None])
    assert margins[0] == -math.inf
    assert "N outside" in workspace.infeasibility(Pose(np.array([0.5, -0.3, 0.0])))


def test_closed_form_margins_agree_with_linear_programming_for_cogiro() -> None:
    """CoGiRo with its published payload and tensions: the polygon of its tensions has corners."""
    rng = np.random.default_rng(2025)
    robot = CableKinematics(COGIRO.exit_points_m, COGIRO.anchor_points_m)
    weight = np.array([0.0, 0.0, -100.0 * 9.81, 0.0, 0.0, 0.0])
    low, high = np.full(8, 10.0), np.full(8, 6000.0)
    workspace = CableWorkspace(robot, weight[None], low, high, np.ones(6))
    turns = Rotation.from_euler("xyz", rng.uniform(-30.0, 30.0, (400, 3)), degrees=True)
    poses = np.zeros((400, 4, 3))
    poses[:, 0] = rng.uniform((-6.75, -4.75, 0.0), (6.75, 4.75, 4.75), (400, 3))
    poses[:, 1:] = turns.as_matrix()
    margins = workspace.capacity_margins(poses)
    held = [
        linprog(np.ones(8), A_eq=W, b_eq=-weight, bounds=(10.0, 6000.0)).status == 0
        for W in robot_matrices(robot, poses)
    ]
    assert 20 < sum(held) < 380
    clear = np.abs(margins) > 1e-6
    assert ((margins >= 0.0) == held)[clear].all()


def robot_matrices(robot: CableKinematics, poses: FloatArray) -> list[FloatArray]:
    return [robot.wrench_matrix(Pose(pose[0], pose[1:])).copy() for pose in poses]


def test_wrenches_in_motion_include_both_signs_of_every_acceleration() -> None:
    told = corners(*wrenches_in_motion(2.0, 3.0, 2, SPATIAL))
    assert told.shape == (8, 6)
    assert {tuple(row) for row in np.abs(told[:, :2])} == {(6.0, 6.0)}
    assert sorted(set(told[:, 2])) == pytest.approx([-2.0 * 9.80665 - 6.0, -2.0 * 9.80665 + 6.0])
    assert not told[:, 3:].any()


def test_the_first_infeasible_pose_of_a_way_is_found() -> None:
    ceiling = np.array([[-2.0, -2.0, 3.0], [2.0, -2.0, 3.0], [2.0, 2.0, 3.0], [-2.0, 2.0, 3.0]])
    robot = CableKinematics(ceiling, np.zeros((4, 3)), POINT)
    weight, _ = wrenches_in_motion(10.0, 0.0, 2, POINT)
    workspace = CableWorkspace(robot, weight, np.full(4, 1.0), np.full(4, 200.0), np.ones(3))

    def first_infeasible(
        start: tuple[float, ...], end: tuple[float, ...]
    ) -> tuple[Pose, str] | None:
        poses = np.zeros((len(SHARES), 4, 3))
        poses[:, 0] = (1.0 - SHARES[:, None]) * np.array(start) + SHARES[:, None] * np.array(end)
        poses[:, 1:] = np.eye(3)
        return workspace.first_infeasible(poses)

    start, end = (0.0, 0.0, 1.0), (4.0, 0.0, 1.0)
    obstacle = first_infeasible(start, end)
    assert obstacle is not None
    there, why = obstacle
    assert "N outside" in why and there.p[0] == pytest.approx(2.0, abs=0.25)
    assert first_infeasible(start, (1.0, 0.5, 0.5)) is None
    # a start that is not held is left
    assert first_infeasible((2.5, 0.0, 1.0), start) is None
    assert first_infeasible((2.5, 0.0, 1.0), end) is not None
