"""Kinematics of the planar robot: inverse of each other, and of the derivative."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from cdpr_rt.robots.planar_kinematics import GeometryError, PlanarGeometry

EXITS_m = np.array([[-2.0, 3.0], [2.0, 3.0], [0.0, 0.0]])
ANCHORS_m = np.array([[-0.075, 0.0433], [0.075, 0.0433], [0.0, -0.0866]])
ROBOT = PlanarGeometry(EXITS_m, ANCHORS_m)
inside = st.tuples(st.floats(-1.2, 1.2), st.floats(0.5, 2.6)).map(np.array)
seeds = st.integers(0, 2**32 - 1)


@settings(derandomize=True, deadline=None)
@given(inside, inside)
def test_forward_inverts_inverse_from_anywhere_inside(p: np.ndarray, guess: np.ndarray) -> None:
    found = ROBOT.forward(ROBOT.lengths(p), guess)
    assert bool(found.converged)
    assert found.position_m == pytest.approx(p, abs=1e-9)
    assert float(found.residual_m) < 1e-9
    assert 1 <= int(found.iterations) <= 12


@settings(derandomize=True, deadline=None)
@given(inside, seeds)
def test_lengths_that_disagree_give_the_least_squares_position(p: np.ndarray, seed: int) -> None:
    rho = ROBOT.lengths(p) + np.random.default_rng(seed).normal(0.0, 5e-3, 3)
    found = ROBOT.forward(rho, p)
    stranger = least_squares(lambda q: ROBOT.lengths(q) - rho, p, xtol=1e-14, gtol=1e-14)
    assert bool(found.converged)
    assert found.position_m == pytest.approx(stranger.x, abs=1e-6)
    assert float(found.residual_m) == pytest.approx(math.sqrt(2.0 * stranger.cost / 3.0), abs=1e-9)


@settings(derandomize=True, deadline=None)
@given(inside)
def test_the_jacobian_is_the_derivative(p: np.ndarray) -> None:
    h = 1e-6
    slope = [(ROBOT.lengths(p + h * e) - ROBOT.lengths(p - h * e)) / (2.0 * h) for e in np.eye(2)]
    assert ROBOT.jacobian(p) == pytest.approx(np.array(slope).T, abs=1e-8)


def test_arrays_in_and_out() -> None:
    p = np.array([[[0.0, 1.0], [0.3, 1.5]], [[-0.4, 2.0], [1.0, 0.9]]])
    rho = ROBOT.lengths(p)
    assert rho.shape == (2, 2, 3)
    assert ROBOT.jacobian(p).shape == (2, 2, 3, 2)
    found = ROBOT.forward(rho, (0.0, 1.5))
    assert found.position_m == pytest.approx(p, abs=1e-9)
    assert found.iterations.shape == found.converged.shape == (2, 2)


def test_lengths_of_no_position_say_so() -> None:
    found = ROBOT.forward(np.array([0.1, 0.1, 0.1]), (0.0, 1.5))
    assert float(found.residual_m) > 0.5, "whatever it has come to, the lengths are not those"
    assert not bool(ROBOT.forward(np.array([np.nan, 1.0, 1.0]), (0.0, 1.5)).converged)


def test_cables_in_one_line_leave_a_direction_free() -> None:
    flat = PlanarGeometry(np.array([[-1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.zeros((3, 2)))
    found = flat.forward(flat.lengths(np.array([0.3, 0.0])), (0.2, 0.0))
    assert not bool(found.converged)


@pytest.mark.parametrize(
    ("a", "b", "told"),
    [
        (EXITS_m, ANCHORS_m[:2], "(2, 2)"),
        (EXITS_m[:1], ANCHORS_m[:1], "1 cable"),
        (EXITS_m * math.nan, ANCHORS_m, "finite"),
        (np.zeros(3), np.zeros(3), "(3,)"),
    ],
)
def test_a_geometry_no_robot_has_is_refused(a: np.ndarray, b: np.ndarray, told: str) -> None:
    with pytest.raises(GeometryError, match=told.replace("(", r"\(").replace(")", r"\)")):
        PlanarGeometry(a, b)


def test_an_anchor_in_its_exit_has_no_direction() -> None:
    with pytest.raises(GeometryError, match="exit point"):
        ROBOT.jacobian(EXITS_m[0] - ANCHORS_m[0])
