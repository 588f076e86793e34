"""By how much lengths disagree, and which cable is off, compared with plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.model.kinematics import PLANAR, PLANAR_POINT, POINT, SPATIAL
from cdpr_rt.model.kinematics import CableKinematics as Kinematics
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.pose_search import assemble, factorise, largest_jump, largest_residual

SLIP_m = 1e-3
SHAPES = [
    (PLANAR_POINT, 3),
    (PLANAR, 4),
    (POINT, 4),
    (POINT, 7),
    (SPATIAL, 6),
    (SPATIAL, 8),
    (SPATIAL, 12),
]


def residual(robot: Kinematics, lengths_m: np.ndarray, start: Pose) -> tuple[float, int, Pose]:
    """Return the kernel's result for lengths, and the pose that fits them."""
    found = robot.pose_from_lengths(lengths_m, start)
    assert found.converged
    cables = np.array(robot._cables)
    assemble(cables, robot.solver)
    assert factorise(robot.solver, 0.0)
    return *largest_residual(lengths_m, cables, robot.solver, np.zeros(len(lengths_m))), found.pose


def projector(J: np.ndarray) -> np.ndarray:
    """Return the matrix that turns errors of lengths into residuals: I - J J⁺."""
    return np.eye(len(J)) - J @ np.linalg.pinv(J)


@settings(max_examples=60)
@given(st.sampled_from(SHAPES), st.integers(0, 2**32 - 1))
def test_the_kernel_finds_the_largest_normalised_residual(
    shape: tuple[tuple[int, ...], int], seed: int
) -> None:
    directions, n = shape
    rng = np.random.default_rng(seed)
    exits, anchors = rng.normal(size=(n, 3)), rng.uniform(-0.3, 0.3, (n, 3))
    exits *= 3.0 / np.linalg.norm(exits, axis=1)[:, None]
    if set(directions) <= set(PLANAR):
        exits[:, 2] = anchors[:, 2] = 0.0
        exits *= 3.0 / np.linalg.norm(exits, axis=1)[:, None]
    robot, home = Kinematics(exits, anchors, directions), Pose(np.zeros(3))
    if np.linalg.cond(robot.jacobian(home)) > 30.0:
        return
    slipped = int(rng.integers(n))
    lengths_m = robot.lengths(home) + SLIP_m * np.eye(n)[slipped]
    value, index, pose = residual(robot, lengths_m, home)
    share = np.sqrt(np.diag(projector(robot.jacobian(pose))).clip(min=0.0))
    if n == len(directions):
        assert (value, index) == (0.0, -1)
        return
    off = np.abs(robot.lengths(pose) - lengths_m)
    told = off[share > 2e-3] / share[share > 2e-3]
    assert value == pytest.approx(told.max(), rel=0.02, abs=1e-8)
    if share[slipped] > 0.1:
        # only the nonlinearity over 1 mm is left
        assert value == pytest.approx(SLIP_m * share[slipped], rel=0.05)
        assert index in {-1, slipped}
    if n == len(directions) + 1:
        assert index == -1, "with one redundant cable, any cable may be the wrong one"


def test_a_jump_is_the_change_from_the_settled_residuals() -> None:
    settled = np.full(3, np.nan)
    before, after = np.array([0.02, -0.01, 0.0]), np.array([0.02, -0.018, 0.001])
    for _ in range(100):
        assert largest_jump(before, settled, 0.01) == (0.0, -1)
    jump_m, cable = largest_jump(after, settled, 0.01)
    assert (jump_m, cable) == (pytest.approx(0.008), 1)
    for _ in range(69):
        jump_m, cable = largest_jump(after, settled, 0.01)
    assert (jump_m, cable) == (pytest.approx(0.008 * 0.99**69), 1)
    assert largest_jump(np.full(3, 0.5), np.zeros(3), 0.01) == (0.5, -1)
