"""Tension distribution: wrench and bounds, optimality, and the outcome if no tensions exist."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core.runtime import _nrt_python, rtsys
from scipy.linalg import null_space
from scipy.optimize import linprog, lsq_linear
from scipy.spatial import ConvexHull, Delaunay, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from cdpr_rt.model.tension_distribution import METHODS, TensionOutcome, TensionSolver
from tests.cdpr_rt.model.cable_robots import (
    SCALE,
    WEIGHT,
    FloatArray,
    made_up,
    suspended_poses,
    wrench_matrix,
)

FOUND = (TensionOutcome.FEASIBLE, TensionOutcome.SUBSTITUTED)
shapes = st.tuples(st.integers(1, 6), st.integers(0, 6)).map(lambda s: (s[0], s[0] + s[1]))
seeds = st.integers(0, 2**32 - 1)
LOW, HIGH = np.full(8, 10.0), np.full(8, 6000.0)


def of(
    method: str, low: FloatArray, high: FloatArray, scale: FloatArray, wanted: FloatArray
) -> TensionSolver:
    return TensionSolver(
        method, low, high, scale, wanted if method == "minimum-deviation" else None
    )


def feasible(W: FloatArray, w_e: FloatArray, low: FloatArray, high: FloatArray) -> bool:
    """Return whether the simplex method finds tensions."""
    bounds = list(zip(low, high, strict=True))
    return bool(linprog(np.zeros(low.size), A_eq=W, b_eq=-w_e, bounds=bounds).status == 0)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=150)
@given(seeds, shapes, st.booleans())
def test_tensions_within_bounds_are_found_if_the_simplex_method_finds_some(
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
    assert (outcome in FOUND) == (wanted_feasible or feasible(W, w_e, low, high))


@settings(max_examples=200)
@given(seeds, shapes, st.booleans())
def test_minimum_deviation_satisfies_the_optimality_conditions(
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


@settings(max_examples=200)
@given(seeds, st.integers(2, 6), st.integers(0, 6), st.booleans())
def test_an_infeasible_wrench_is_approximated_with_the_least_error(
    seed: int, d: int, more: int, singular: bool
) -> None:
    rng = np.random.default_rng(seed)
    n = d + more
    W, w_e, low, high = made_up(seed, d, n, False)
    if singular:
        W[-1] = rng.normal(size=d - 1) @ W[:-1]
    scale = rng.uniform(0.2, 3.0, d)
    distribution = of("minimum-norm", low, high, scale, low)
    t = np.zeros(n)
    outcome = distribution.solve(W, w_e, t)
    assert (outcome == TensionOutcome.SINGULAR) == singular
    if outcome == TensionOutcome.FEASIBLE:
        return
    theirs = lsq_linear(W / scale[:, None], -w_e / scale, (low, high), method="bvls", tol=1e-14)
    ours = np.linalg.norm((W @ t + w_e) / scale)
    assert ours == pytest.approx(np.sqrt(2.0 * theirs.cost), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("method", ["minimum-norm", "closed-form", "polygon-centroid"])
def test_a_direction_that_no_cable_holds_is_reported_and_the_rest_carried(method: str) -> None:
    W = np.array([[1.0, -1.0, 0.5, -0.5], [0.0, 0.0, 0.0, 0.0], [0.2, 0.2, -0.2, -0.3]])
    low, high = np.full(4, 5.0), np.full(4, 100.0)
    distribution = of(method, low, high, np.ones(3), low)
    t = np.zeros(4)
    outcome = distribution.solve(W, np.array([10.0, -7.0, 1.0]), t)
    assert outcome == TensionOutcome.SINGULAR
    assert distribution.missing == pytest.approx([0.0, 7.0, 0.0], abs=1e-9)
    assert (t >= low).all() and (t <= high).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_cable_without_effect_stays_within_its_bounds(method: str) -> None:
    W = np.array([[1.0, -1.0, 0.0, 0.3], [0.4, 0.5, 0.0, -1.0]])
    low, high = np.full(4, 5.0), np.full(4, 100.0)
    distribution = of(method, low, high, np.ones(2), np.full(4, 40.0))
    t = np.zeros(4)
    assert distribution.solve(W, np.array([3.0, -4.0]), t) in FOUND
    assert np.abs(W @ t + [3.0, -4.0]).max() < 1e-10
    assert 5.0 <= t[2] <= 100.0


@pytest.mark.parametrize("method", METHODS)
def test_a_zero_wrench_matrix_is_singular(method: str) -> None:
    low, high = np.full(3, 5.0), np.full(3, 100.0)
    distribution = of(method, low, high, np.ones(2), low)
    t, w_e = np.zeros(3), np.array([1.0, 2.0])
    assert distribution.solve(np.zeros((2, 3)), w_e, t) == TensionOutcome.SINGULAR
    assert (t >= low).all() and (t <= high).all()
    assert distribution.missing == pytest.approx(-w_e)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e200])
def test_nan_is_rejected_and_tensions_stay_unchanged(method: str, wrong: float) -> None:
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


def test_wrong_sizes_and_reversed_bounds_are_rejected_in_the_cycle() -> None:
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
def test_results_do_not_depend_on_earlier_calls(method: str) -> None:
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


def test_bounds_of_zero_exclude_a_cut_cable() -> None:
    W = suspended_poses(1, seed=10)[0]
    distribution = of("minimum-norm", np.full(8, 10.0), np.full(8, 6000.0), SCALE, W[0])
    distribution.low[3] = distribution.high[3] = 0.0
    t = np.zeros(8)
    outcome = distribution.solve(W, WEIGHT, t)
    assert t[3] == 0.0
    assert (outcome in FOUND) == feasible(W, WEIGHT, distribution.low, distribution.high)


def test_the_closed_form_reports_when_another_method_was_used() -> None:
    """Some wrenches can be carried although the closed form finds no tensions for them."""
    low, high, t = np.full(8, 10.0), np.full(8, 6000.0), np.zeros(8)
    closed_form, optimum = (of(m, low, high, SCALE, low) for m in ("closed-form", "minimum-norm"))
    helped = 0
    for W in suspended_poses(3000, seed=12):
        outcome = closed_form.solve(W, WEIGHT, t)
        assert (outcome in FOUND) == (optimum.solve(W, WEIGHT, t) == TensionOutcome.FEASIBLE)
        helped += outcome == TensionOutcome.SUBSTITUTED
    assert 0 < helped < 100


def test_the_closed_form_equals_potts_formula() -> None:
    """t_m - W^+(w_e + W t_m) if that is within bounds."""
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
def test_as_many_cables_as_directions_have_one_solution(method: str) -> None:
    W, w_e, low, high = made_up(11, 6, 6, True)
    t = np.zeros(6)
    assert of(method, low, high, np.ones(6), low).solve(W, w_e, t) == TensionOutcome.FEASIBLE
    assert t == pytest.approx(np.linalg.solve(W, -w_e), abs=1e-8)
    assert null_space(W).size == 0


@pytest.mark.parametrize("method", METHODS)
def test_a_call_allocates_no_arrays(method: str) -> None:
    low, high, t = np.full(8, 10.0), np.full(8, 6000.0), np.zeros(8)
    distribution = of(method, low, high, SCALE, np.full(8, 300.0))
    matrices = suspended_poses(50, seed=15)  # feasible ones and one that is not
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


def vertices(
    W: FloatArray, w_e: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray | None:
    """Return the vertices (m, n) of all tensions within bounds, by Qhull, or None if it is thin."""
    start, N = np.linalg.lstsq(W, -w_e)[0], null_space(W)
    rows = np.vstack([N, -N])
    ends = np.concatenate([high - start, start - low])
    length = np.linalg.norm(rows, axis=1)
    inner = linprog(
        [0, 0, -1], np.column_stack([rows, length]), ends, bounds=[(None, None)] * 2 + [(0, None)]
    )
    if inner.status != 0 or inner.x[2] < 1e-3:
        return None
    corners = HalfspaceIntersection(np.column_stack([rows, -ends]), inner.x[:2]).intersections
    return np.asarray(start + corners[ConvexHull(corners).vertices] @ N.T)


def centroid(W: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the centre of area by triangles."""
    plane = null_space(W)
    triangles = corners[Delaunay(corners @ plane).simplices]
    flat = triangles @ plane
    sides = flat[:, 1:] - flat[:, :1]
    areas = np.abs(np.linalg.det(sides))
    return np.asarray((areas[:, None] * triangles.mean(axis=1)).sum(axis=0) / areas.sum())


@settings(max_examples=200)
@given(seeds, st.integers(1, 6))
def test_the_centroid_is_that_of_the_convex_hull_of_all_tensions(seed: int, d: int) -> None:
    n = d + 2
    W, w_e, low, high = made_up(seed, d, n, True)
    corners = vertices(W, w_e, low, high)
    if corners is None:
        return
    t = np.zeros(n)
    TensionSolver("polygon-centroid", low, high, np.ones(d)).solve(W, w_e, t)
    assert t == pytest.approx(centroid(W, corners), abs=1e-6)


@settings(max_examples=100)
@given(seeds, st.integers(1, 6))
def test_with_one_cable_more_the_centroid_is_the_middle_of_a_segment(seed: int, d: int) -> None:
    W, w_e, low, high = made_up(seed, d, d + 1, True)
    t = np.zeros(d + 1)
    bounds = list(zip(low, high, strict=True))
    u = null_space(W)[:, 0]
    ends = [linprog(way * u, A_eq=W, b_eq=-w_e, bounds=bounds).x for way in (-1, 1)]
    TensionSolver("polygon-centroid", low, high, np.ones(d)).solve(W, w_e, t)
    assert t == pytest.approx(0.5 * (ends[0] + ends[1]), abs=1e-5)


def steps(method: str, seed: int) -> FloatArray:
    """Return what remains within 1 nm of the largest change within 3 mm, of each of some paths."""
    rng = np.random.default_rng(seed)
    wanted = np.full(8, 400.0) if method == "minimum-deviation" else None
    distribution = TensionSolver(method, LOW, HIGH, SCALE, wanted)

    def tensions(p: FloatArray) -> FloatArray:
        t = np.zeros(8)
        distribution.solve(wrench_matrix(p, turned), WEIGHT, t)
        return t

    remaining = []
    for _ in range(30):
        turned = Rotation.from_euler("xyz", rng.uniform(-20, 20, 3), degrees=True).as_matrix()
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        path = rng.uniform([-6, -4, 0.3], [6, 4, 4]) + np.outer(np.arange(400) * 3e-3, way)
        along = np.array([tensions(p) for p in path])
        k = int(np.abs(np.diff(along, axis=0)).max(axis=1).argmax())
        a, b = path[k], path[k + 1]
        while np.linalg.norm(b - a) > 1e-9:
            middle = 0.5 * (a + b)
            t_a, t, t_b = tensions(a), tensions(middle), tensions(b)
            a, b = (a, middle) if np.abs(t - t_a).max() > np.abs(t_b - t).max() else (middle, b)
        remaining.append(np.abs(tensions(b) - tensions(a)).max())
    return np.array(remaining)


@pytest.mark.parametrize("method", ["minimum-norm", "minimum-deviation", "polygon-centroid"])
def test_tensions_do_not_step_along_paths(method: str) -> None:
    """Not even where a path leaves the feasible region."""
    assert steps(method, seed=13).max() < 0.01


def test_the_centroid_without_a_cut_cable_is_the_middle_of_a_segment() -> None:
    """The polygon then has no area: the result is that of a robot without this cable."""
    rest = [0, 1, 2, 4, 5, 6, 7]
    cut = TensionSolver("polygon-centroid", LOW, HIGH, SCALE)
    cut.low[3] = cut.high[3] = 0.0
    without = TensionSolver("polygon-centroid", LOW[rest], HIGH[rest], SCALE)
    t, t_rest, seen = np.zeros(8), np.zeros(7), 0
    for W in suspended_poses(200, seed=14):
        outcome = cut.solve(W, WEIGHT, t)
        assert outcome == without.solve(np.ascontiguousarray(W[:, rest]), WEIGHT, t_rest)
        assert t[3] == 0.0
        if outcome == TensionOutcome.FEASIBLE:
            assert t[rest] == pytest.approx(t_rest, abs=1e-5)
            seen += 1
    assert seen > 10


def test_a_polygon_that_is_a_point_has_this_point_as_centroid() -> None:
    """Two opposite cables at their upper bounds hold the load; nothing is left to choose."""
    W = np.array([[-1.0, 1.0, 0.6, -0.6], [0.0, 0.0, 0.8, 0.8]])
    low, high = np.full(4, 10.0), np.array([100.0, 100.0, 50.0, 50.0])
    w_e = np.array([0.0, -80.0])
    t = np.zeros(4)
    outcome = TensionSolver("polygon-centroid", low, high, np.ones(2)).solve(W, w_e, t)
    assert outcome == TensionOutcome.FEASIBLE
    assert t[2:] == pytest.approx([50.0, 50.0])
    assert t[0] == pytest.approx(t[1])
