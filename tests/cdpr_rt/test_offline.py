"""`cdpr_rt.load`: the model of a robot for arrays of positions."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.optimize import linprog

import cdpr_rt as cdpr

ROBOTS = ["planar-3", "planar-4", "point-4", "spatial-8"]


def positions(model: cdpr.Model, count: int) -> np.ndarray:
    """Return positions (count, d) in and around the box of targets, turned by some degrees."""
    random = np.random.default_rng(4)
    low, high = model.box_m
    q = 0.05 * random.standard_normal((count, model.d))
    q[:, : low.size] = random.uniform(low - 0.2, high + 0.2, (count, low.size))
    return q


@pytest.mark.parametrize("name", ROBOTS)
def test_jacobian_is_the_derivative_of_the_lengths(name: str) -> None:
    model, step = cdpr.load(name), 1e-6
    q = positions(model, 5)
    q[:, model.box_m.shape[1] :] = 0.0  # there a rotation vector changes as the twist does
    change = step * np.eye(model.d)
    lengths = model.lengths(q[:, None] + change) - model.lengths(q[:, None] - change)
    expected = np.swapaxes(lengths / (2.0 * step), -1, -2)
    assert model.jacobian(q) == pytest.approx(expected, abs=1e-7)


def test_a_model_can_be_sent_to_another_process() -> None:
    model = cdpr.load("planar-4")
    there = pickle.loads(pickle.dumps(model))
    q = positions(model, 3)
    np.testing.assert_array_equal(there.tensions(q), model.tensions(q))


@pytest.mark.parametrize("name", ROBOTS)
def test_position_is_found_from_the_lengths(name: str) -> None:
    model = cdpr.load(name)
    q = positions(model, 6).reshape(2, 3, model.d)
    assert model.position(model.lengths(q)) == pytest.approx(q, abs=1e-8)
    assert model.position(model.lengths(q[0, 0]), start=q[0, 0]) == pytest.approx(q[0, 0])


@pytest.mark.parametrize("name", ROBOTS)
def test_tensions_balance_gravity_and_a_wrench_within_their_bounds(name: str) -> None:
    model = cdpr.load(name)
    q, wrench = positions(model, 40), np.linspace(-2.0, 3.0, model.d)
    t = model.tensions(q, wrench)
    found = np.isfinite(t).all(axis=-1)
    assert found.any()
    left = np.einsum("mdn,mn->md", model.wrench_matrix(q), t) + model.gravity(q) + wrench
    assert left[found] == pytest.approx(0.0, abs=1e-6)
    assert (t[found] >= model.low_N).all() and (t[found] <= model.high_N).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_a_position_is_feasible_if_linear_programming_finds_tensions(name: str) -> None:
    model = cdpr.load(name)
    low, high = model.box_m
    q = np.linspace(low - 0.6 * (high - low), high + 0.6 * (high - low), 15)
    bounds = list(zip(model.low_N, model.high_N, strict=True))
    solved = [
        linprog(np.zeros(model.n), A_eq=W, b_eq=-w, bounds=bounds).status == 0
        for W, w in zip(model.wrench_matrix(q), model.gravity(q), strict=True)
    ]
    feasible = model.is_feasible(q)
    assert feasible.tolist() == solved
    assert not feasible.all() and feasible.any()


def test_invalid_input_is_reported_with_what_is_allowed() -> None:
    model = cdpr.load("spatial-8")
    assert repr(model) == "<Model of 8 cables, 6 controlled directions>"
    with pytest.raises(
        cdpr.InvalidArgument, match=r"position: .*finite numbers of shape \(..., 3\) or"
    ):
        model.lengths([0.0, 1.0])
    with pytest.raises(cdpr.InvalidArgument, match="position"):
        model.tensions([0.0, np.nan, 1.0])
    with pytest.raises(cdpr.InvalidArgument, match=r"position: .*want an array of numbers"):
        model.lengths([[0.0, 0.0, 1.0], [0.0]])  # type: ignore[list-item]
    with pytest.raises(cdpr.InvalidArgument, match="acceleration_m_s2: nan"):
        model.is_feasible([0.0, 0.0, 1.0], np.nan)
    with pytest.raises(cdpr.InvalidArgument, match=r"wrench: shape \(2,\)"):
        model.tensions([0.0, 0.0, 1.0], [1.0, 2.0])
    with pytest.raises(cdpr.InvalidArgument, match=r"wrench: shape \(\)"):
        model.tensions([0.0, 0.0, 1.0], 5.0)
    with pytest.raises(cdpr.InvalidArgument, match=r"position: .*want an array of numbers"):
        model.lengths(np.array([0.0, 0.0, 1j]))
    with pytest.raises(cdpr.InvalidArgument, match=r"lengths_m: shape \(3,\)"):
        model.position([1.0, 2.0, 3.0])
    with pytest.raises(cdpr.InvalidRobot, match="nothing-9"):
        cdpr.load("nothing-9")
    with pytest.raises(cdpr.InvalidRobot, match=r"add a \[platform\] table"):
        cdpr.load("bench-2")
