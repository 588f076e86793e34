"""Tensions carry the wrench within bounds, are optimal, and say why where there are none."""

from __future__ import annotations

import tracemalloc

import numpy as np
import osqp
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core.runtime import _nrt_python, rtsys
from scipy.linalg import null_space
from scipy.optimize import linprog, lsq_linear

from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.tension_distribution import (
    METHODS,
    TensionError,
    TensionSolver,
    tension_distribution,
)
from tests.cdpr_rt.robots.tension.cable_robots import (
    SCALE,
    WEIGHT,
    FloatArray,
    made_up,
    suspended_poses,
)

FOUND = (TensionOutcome.FEASIBLE, TensionOutcome.SUBSTITUTED)
shapes = st.tuples(st.integers(1, 6), st.integers(0, 6)).map(lambda s: (s[0], s[0] + s[1]))
seeds = st.integers(0, 2**32 - 1)


def of(
    method: str, low: FloatArray, high: FloatArray, scale: FloatArray, wanted: FloatArray
) -> TensionSolver:
    return tension_distribution(
        method, low, high, scale, wanted if method == "minimum-deviation" else None
    )


def feasible(W: FloatArray, w_e: FloatArray, low: FloatArray, high: FloatArray) -> bool:
    """Ask the simplex method."""
    bounds = list(zip(low, high, strict=True))
    return bool(linprog(np.zeros(low.size), A_eq=W, b_eq=-w_e, bounds=bounds).status == 0)


def by_osqp(
    W: FloatArray, w_e: FloatArray, low: FloatArray, high: FloatArray, wanted: FloatArray
) -> FloatArray | None:
    n = low.size
    solver = osqp.OSQP()
    solver.setup(
        sp.eye(n, format="csc"),
        -wanted,
        sp.csc_matrix(np.vstack([W, np.eye(n)])),
        np.concatenate([-w_e, low]),
        np.concatenate([-w_e, high]),
        eps_abs=1e-9,
        eps_rel=1e-9,
        eps_prim_inf=1e-9,
        max_iter=200_000,
        polishing=True,
        verbose=False,
    )
    result = solver.solve(raise_error=False)
    return np.array(result.x) if result.info.status == "solved" else None


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=150)
@given(seeds, shapes, st.booleans())
def test_tensions_carry_the_wrench_within_bounds_wherever_the_simplex_method_finds_some(
    method: str, seed: int, shape: tuple[int, int], wanted_feasible: bool
) -> None:
    d, n = shape
    if method.startswith("polygon") and n > d + 2:
        n = d + 2
    W, w_e, low, high = made_up(seed, d, n, wanted_feasible)
    wanted = np.random.default_rng(seed + 1).uniform(0.0, 100.0, n)
    distribution = of(method, low, high, np.ones(d), wanted)
    t = np.full(n, np.nan)
    outcome = distribution.solve(W, w_e, t)
    assert (t >= low).all() and (t <= high).all()
    assert distribution.missing == pytest.approx(-(W @ t + w_e), abs=1e-9)
    if outcome in FOUND:
        assert np.abs(W @ t + w_e).max() <= 1e-8
        assert (distribution.limiting_cable, distribution.limiting_bound) == (-1, 0)
    assert (outcome in FOUND) == (wanted_feasible or feasible(W, w_e, low, high))


@settings(max_examples=200)
@given(seeds, shapes, st.booleans())
def test_minimum_deviation_meets_the_conditions_of_an_optimum(
    seed: int, shape: tuple[int, int], none_wanted: bool
) -> None:
    """t - wanted is a sum of rows of W and of bounds that hold tensions up, or down."""
    d, n = shape
    W, w_e, low, high = made_up(seed, d, n, True)
    wanted = np.zeros(n) if none_wanted else np.random.default_rng(seed + 1).uniform(0, 100, n)
    method = "minimum-norm" if none_wanted else "minimum-deviation"
    t = np.zeros(n)
    assert of(method, low, high, np.ones(d), wanted).solve(W, w_e, t) == TensionOutcome.FEASIBLE
    held_up, held_down = t <= low + 1e-9, t >= high - 1e-9
    columns = np.hstack([W.T, np.eye(n)[:, held_up], -np.eye(n)[:, held_down]])
    least = np.r_[np.full(d, -np.inf), np.zeros(columns.shape[1] - d)]
    fit = lsq_linear(columns, t - wanted, (least, np.inf), tol=1e-14)
    assert np.abs(columns @ fit.x - (t - wanted)).max() <= 1e-6 * max(1.0, np.abs(t).max())


def test_minimum_deviation_is_what_osqp_finds() -> None:
    rng = np.random.default_rng(3)
    low, high = np.full(8, 10.0), np.full(8, 6000.0)
    wanted = rng.uniform(50.0, 2000.0, 8)
    distribution = of("minimum-deviation", low, high, SCALE, wanted)
    t = np.zeros(8)
    found = 0
    for W in suspended_poses(60, seed=4):
        if distribution.solve(W, WEIGHT, t) != TensionOutcome.FEASIBLE:
            continue
        theirs = by_osqp(W, WEIGHT, low, high, wanted)
        assert theirs is not None
        assert t == pytest.approx(theirs, abs=1e-3)
        assert np.linalg.norm(t - wanted) <= np.linalg.norm(theirs - wanted) + 1e-6
        found += 1
    assert found > 40


@settings(max_examples=150)
@given(seeds, shapes)
def test_where_none_carry_the_wrench_it_is_the_nearest_one_that_is_carried(
    seed: int, shape: tuple[int, int]
) -> None:
    d, n = shape
    W, w_e, low, high = made_up(seed, d, n, False)
    scale = np.random.default_rng(seed + 2).uniform(0.2, 3.0, d)
    distribution = of("minimum-norm", low, high, scale, low)
    t = np.zeros(n)
    if distribution.solve(W, w_e, t) != TensionOutcome.NEAREST:
        return
    ours = np.linalg.norm((W @ t + w_e) / scale)
    theirs = lsq_linear(W / scale[:, None], -w_e / scale, (low, high), method="bvls", tol=1e-14)
    assert ours == pytest.approx(np.sqrt(2.0 * theirs.cost), rel=1e-9, abs=1e-9)
    assert (W @ t) == pytest.approx(W @ theirs.x, abs=1e-5)


@settings(max_examples=100)
@given(seeds, shapes)
def test_the_limiting_bound_is_the_one_that_brings_the_wrench_nearest_when_moved(
    seed: int, shape: tuple[int, int]
) -> None:
    d, n = shape
    W, w_e, low, high = made_up(seed, d, n, False)
    distribution = of("minimum-norm", low, high, np.ones(d), low)
    t = np.zeros(n)
    if distribution.solve(W, w_e, t) != TensionOutcome.NEAREST:
        return
    cable, side, moved = distribution.limiting_cable, distribution.limiting_bound, 1e-4
    gains = {}
    for i in range(n):
        for way, bound in ((-1, distribution.low), (1, distribution.high)):
            kept = bound[i]
            bound[i] += way * moved
            distribution.solve(W, w_e, t)
            gains[i, way] = -np.linalg.norm(distribution.missing)
            bound[i] = kept
    assert gains[cable, side] >= max(gains.values()) - 1e-7


def test_asking_for_more_never_gives_less() -> None:
    """The force exerted along the force asked for does not fall when more of it is asked."""
    rng = np.random.default_rng(5)
    directions = np.array([[0.8, -0.9, 0.1], [0.5, 0.4, -1.0]])
    for W, d in ((directions, 2), (suspended_poses(1, seed=6)[0], 6)):
        n = W.shape[1]
        distribution = of("minimum-norm", np.full(n, 20.0), np.full(n, 600.0), np.ones(d), W[0])
        t = np.zeros(n)
        for _ in range(20):
            way = rng.normal(size=d)
            way /= np.linalg.norm(way)
            exerted = []
            for asked in np.linspace(0.0, 3000.0, 200):
                distribution.solve(np.ascontiguousarray(W), -asked * way, t)
                exerted.append(way @ W @ t)
            assert (np.diff(exerted) >= -1e-7).all()
            assert exerted[-1] > exerted[0]


@pytest.mark.parametrize("method", ["minimum-norm", "closed-form", "polygon-centroid"])
def test_cables_that_cannot_hold_a_direction_are_told_and_carry_the_rest(method: str) -> None:
    W = np.array([[1.0, -1.0, 0.5, -0.5], [0.0, 0.0, 0.0, 0.0], [0.2, 0.2, -0.2, -0.3]])
    low, high = np.full(4, 5.0), np.full(4, 100.0)
    distribution = of(method, low, high, np.ones(3), low)
    t = np.zeros(4)
    outcome = distribution.solve(W, np.array([10.0, -7.0, 1.0]), t)
    assert outcome == TensionOutcome.SINGULAR
    assert distribution.missing == pytest.approx([0.0, 7.0, 0.0], abs=1e-9)
    assert (t >= low).all() and (t <= high).all()
    assert distribution.limiting_cable == -1


@settings(max_examples=100)
@given(seeds, st.integers(2, 6), st.integers(0, 3))
def test_a_singular_matrix_gives_the_nearest_wrench_too(seed: int, d: int, more: int) -> None:
    rng = np.random.default_rng(seed)
    W, w_e, low, high = made_up(seed, d, d + more, False)
    W[-1] = rng.normal(size=d - 1) @ W[:-1]
    scale = rng.uniform(0.2, 3.0, d)
    distribution = of("minimum-norm", low, high, scale, low)
    t = np.zeros(d + more)
    assert distribution.solve(W, w_e, t) == TensionOutcome.SINGULAR
    theirs = lsq_linear(W / scale[:, None], -w_e / scale, (low, high), method="bvls", tol=1e-14)
    ours = np.linalg.norm((W @ t + w_e) / scale)
    assert ours == pytest.approx(np.sqrt(2.0 * theirs.cost), rel=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_a_cable_that_pulls_nowhere_keeps_within_its_bounds(method: str) -> None:
    W = np.array([[1.0, -1.0, 0.0, 0.3], [0.4, 0.5, 0.0, -1.0]])
    low, high = np.full(4, 5.0), np.full(4, 100.0)
    distribution = of(method, low, high, np.ones(2), np.full(4, 40.0))
    t = np.zeros(4)
    assert distribution.solve(W, np.array([3.0, -4.0]), t) in FOUND
    assert np.abs(W @ t + [3.0, -4.0]).max() < 1e-10
    assert 5.0 <= t[2] <= 100.0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("zero", [False, True])
def test_no_cable_pulls_anywhere(method: str, zero: bool) -> None:
    low, high = np.full(3, 5.0), np.full(3, 100.0)
    distribution = of(method, low, high, np.ones(2), low)
    t = np.zeros(3)
    w_e = np.zeros(2) if zero else np.array([1.0, 2.0])
    assert distribution.solve(np.zeros((2, 3)), w_e, t) == TensionOutcome.SINGULAR
    assert (t >= low).all() and (t <= high).all()
    assert distribution.missing == pytest.approx(-w_e)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e200])
def test_what_is_no_number_is_refused_and_nothing_written(method: str, wrong: float) -> None:
    W, w_e, low, high = made_up(7, 3, 5, True)
    distribution = of(method, low, high, np.ones(3), low)
    t = np.full(5, 17.0)
    for place in range(5):
        matrix, wrench = W.copy(), w_e.copy()
        changed = (matrix[0], wrench, distribution.low, distribution.high, distribution.wanted)[
            place
        ]
        kept = changed[1]
        changed[1] = wrong
        assert distribution.solve(matrix, wrench, t) == TensionOutcome.REFUSED
        assert (t == 17.0).all()
        changed[1] = kept
    assert distribution.solve(W, w_e, t) in FOUND


def test_other_sizes_and_reversed_bounds_are_refused_in_the_cycle() -> None:
    W, w_e, low, high = made_up(8, 3, 5, True)
    distribution = of("minimum-norm", low, high, np.ones(3), low)
    t = np.full(5, 17.0)
    assert distribution.solve(np.ones((3, 6)), w_e, t) == TensionOutcome.REFUSED
    assert distribution.solve(np.ones((4, 5)), w_e, t) == TensionOutcome.REFUSED
    assert distribution.solve(W, np.ones(4), t) == TensionOutcome.REFUSED
    assert distribution.solve(W, w_e, np.zeros(4)) == TensionOutcome.REFUSED
    distribution.low[2] = distribution.high[2] + 1.0
    assert distribution.solve(W, w_e, t) == TensionOutcome.REFUSED
    assert (t == 17.0).all()


@pytest.mark.parametrize("method", METHODS)
def test_the_same_question_has_the_same_answer_whatever_was_asked_before(method: str) -> None:
    low, high = np.full(8, 10.0), np.full(8, 6000.0)
    matrices = suspended_poses(40, seed=9)

    def answers(order: range) -> dict[int, bytes]:
        distribution = of(method, low, high, SCALE, np.full(8, 300.0))
        t = np.zeros(8)
        told = {}
        for k in order:
            distribution.solve(matrices[k], WEIGHT, t)
            told[k] = t.tobytes() + distribution.missing.tobytes()
        return told

    assert answers(range(40)) == answers(range(39, -1, -1))


def test_a_cut_cable_is_bounds_of_zero() -> None:
    W = suspended_poses(1, seed=10)[0]
    distribution = of("minimum-norm", np.full(8, 10.0), np.full(8, 6000.0), SCALE, W[0])
    distribution.low[3] = distribution.high[3] = 0.0
    t = np.zeros(8)
    outcome = distribution.solve(W, WEIGHT, t)
    assert t[3] == 0.0
    assert (outcome in FOUND) == feasible(W, WEIGHT, distribution.low, distribution.high)


def test_the_closed_form_says_where_another_method_had_to_help() -> None:
    """There are wrenches that can be carried and of which the closed form finds no tensions."""
    low, high, t = np.full(8, 10.0), np.full(8, 6000.0), np.zeros(8)
    closed_form, optimum = (of(m, low, high, SCALE, low) for m in ("closed-form", "minimum-norm"))
    helped = 0
    for W in suspended_poses(3000, seed=12):
        outcome = closed_form.solve(W, WEIGHT, t)
        assert (outcome in FOUND) == (optimum.solve(W, WEIGHT, t) == TensionOutcome.FEASIBLE)
        helped += outcome == TensionOutcome.SUBSTITUTED
    assert 0 < helped < 100


def test_the_closed_form_is_potts() -> None:
    """t_m - W^+(w_e + W t_m) where that is within bounds."""
    seen = 0
    for seed in range(200):
        W, w_e, low, high = made_up(seed, 3, 6, True)
        middle = 0.5 * (low + high)
        expected = middle - np.linalg.pinv(W) @ (w_e + W @ middle)
        if ((expected < low) | (expected > high)).any():
            continue
        t = np.zeros(6)
        of("closed-form", low, high, np.ones(3), low).solve(W, w_e, t)
        assert t == pytest.approx(expected, abs=1e-9)
        seen += 1
    assert seen > 20


@pytest.mark.parametrize("method", METHODS)
def test_as_many_cables_as_directions_have_one_answer(method: str) -> None:
    W, w_e, low, high = made_up(11, 6, 6, True)
    t = np.zeros(6)
    assert of(method, low, high, np.ones(6), low).solve(W, w_e, t) == TensionOutcome.FEASIBLE
    assert t == pytest.approx(np.linalg.solve(W, -w_e), abs=1e-8)
    assert null_space(W).size == 0


def test_what_no_robot_can_have_is_refused_with_what_is_allowed() -> None:
    low, high, scale = np.full(4, 5.0), np.full(4, 100.0), np.ones(3)
    with pytest.raises(TensionError, match="minimum-norm, minimum-deviation, closed-form"):
        tension_distribution("least", low, high, scale)
    with pytest.raises(TensionError, match="cable 3: tension bounds 5 to 4 N"):
        tension_distribution("minimum-norm", low, np.array([9.0, 9.0, 4.0, 9.0]), scale)
    with pytest.raises(TensionError, match="finite"):
        tension_distribution("minimum-norm", low, np.full(4, np.inf), scale)
    with pytest.raises(TensionError, match=r"upper bounds of shape \(3,\); allowed: \(4,\)"):
        tension_distribution("minimum-norm", low, np.full(3, 100.0), scale)
    with pytest.raises(TensionError, match="4 cables, 5 directions; allowed: 1 to 4"):
        tension_distribution("minimum-norm", low, high, np.ones(5))
    with pytest.raises(TensionError, match="at most 3 cables"):
        tension_distribution("polygon-centroid", low, high, np.ones(1))
    with pytest.raises(TensionError, match="wanted tensions"):
        tension_distribution("minimum-deviation", low, high, scale)
    with pytest.raises(TensionError, match="above 0"):
        tension_distribution("minimum-norm", low, high, np.array([1.0, 0.0, 1.0]))


@pytest.mark.parametrize("method", METHODS)
def test_a_call_allocates_no_arrays(method: str) -> None:
    low, high, t = np.full(8, 10.0), np.full(8, 6000.0), np.zeros(8)
    distribution = of(method, low, high, SCALE, np.full(8, 300.0))
    matrices = suspended_poses(50, seed=15)  # feasible ones and another
    for W in matrices:
        distribution.solve(W, WEIGHT, t)
    headers = 9  # numba makes one for each array that a kernel is given
    _nrt_python.memsys_enable_stats()
    try:
        for W in matrices:
            before = rtsys.get_allocation_stats().alloc
            distribution.solve(W, WEIGHT, t)
            assert rtsys.get_allocation_stats().alloc - before == headers
    finally:
        _nrt_python.memsys_disable_stats()
    tracemalloc.start()
    for W in matrices:
        distribution.solve(W, WEIGHT, t)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2000
