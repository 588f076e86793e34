"""The polygon of tensions: its points against a convex hull, along paths, and where it is thin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, Delaunay, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.tension_distribution import tension_distribution
from tests.cdpr_rt.robots.tension.cable_robots import (
    SCALE,
    WEIGHT,
    FloatArray,
    made_up,
    suspended_poses,
    wrench_matrix,
)

LOW, HIGH = np.full(8, 10.0), np.full(8, 6000.0)
seeds = st.integers(0, 2**32 - 1)


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
def test_points_of_the_polygon_are_those_of_its_convex_hull(seed: int, d: int) -> None:
    n = d + 2
    W, w_e, low, high = made_up(seed, d, n, True)
    corners = vertices(W, w_e, low, high)
    if corners is None:
        return
    t = np.zeros(n)
    tension_distribution("polygon-centroid", low, high, np.ones(d)).solve(W, w_e, t)
    assert t == pytest.approx(centroid(W, corners), abs=1e-6)
    tension_distribution("polygon-1-norm", low, high, np.ones(d)).solve(W, w_e, t)
    assert t.sum() == pytest.approx(corners.sum(axis=1).min(), abs=1e-7)
    least = np.zeros(n)
    tension_distribution("polygon-2-norm", low, high, np.ones(d)).solve(W, w_e, t)
    tension_distribution("minimum-norm", low, high, np.ones(d)).solve(W, w_e, least)
    assert t == pytest.approx(least, abs=1e-7)


@settings(max_examples=100)
@given(seeds, st.integers(1, 6))
def test_with_one_cable_more_it_is_a_segment(seed: int, d: int) -> None:
    W, w_e, low, high = made_up(seed, d, d + 1, True)
    t = np.zeros(d + 1)
    bounds = list(zip(low, high, strict=True))
    u = null_space(W)[:, 0]
    ends = [linprog(way * u, A_eq=W, b_eq=-w_e, bounds=bounds).x for way in (-1, 1)]
    tension_distribution("polygon-centroid", low, high, np.ones(d)).solve(W, w_e, t)
    assert t == pytest.approx(0.5 * (ends[0] + ends[1]), abs=1e-5)
    tension_distribution("polygon-1-norm", low, high, np.ones(d)).solve(W, w_e, t)
    assert t.sum() == pytest.approx(min(ends[0].sum(), ends[1].sum()), abs=1e-5)
    least = np.zeros(d + 1)
    tension_distribution("polygon-2-norm", low, high, np.ones(d)).solve(W, w_e, t)
    tension_distribution("minimum-norm", low, high, np.ones(d)).solve(W, w_e, least)
    assert t == pytest.approx(least, abs=1e-7)


def steps(method: str, seed: int) -> FloatArray:
    """Return what remains of the largest change within 3 mm of paths when looked at within 1 nm."""
    rng = np.random.default_rng(seed)
    wanted = np.full(8, 400.0) if method == "minimum-deviation" else None
    distribution = tension_distribution(method, LOW, HIGH, SCALE, wanted)

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


@pytest.mark.parametrize(
    "method", ["minimum-norm", "minimum-deviation", "polygon-2-norm", "polygon-centroid"]
)
def test_tensions_do_not_step_along_paths(method: str) -> None:
    """Not even where a path leaves what can be carried."""
    assert steps(method, seed=13).max() < 0.01


def test_the_least_sum_steps_along_paths() -> None:
    """So the test above would see a step."""
    assert steps("polygon-1-norm", seed=13).max() > 1.0


@pytest.mark.parametrize("method", ["polygon-1-norm", "polygon-2-norm", "polygon-centroid"])
def test_a_cut_cable_makes_a_segment_of_it(method: str) -> None:
    """The polygon has no area then: as if the robot had this cable not."""
    rest = [0, 1, 2, 4, 5, 6, 7]
    cut = tension_distribution(method, LOW, HIGH, SCALE)
    cut.low[3] = cut.high[3] = 0.0
    without = tension_distribution(method, LOW[rest], HIGH[rest], SCALE)
    t, t_rest, seen = np.zeros(8), np.zeros(7), 0
    for W in suspended_poses(200, seed=14):
        outcome = cut.solve(W, WEIGHT, t)
        assert outcome == without.solve(np.ascontiguousarray(W[:, rest]), WEIGHT, t_rest)
        assert t[3] == 0.0
        if outcome == TensionOutcome.FEASIBLE:
            assert t[rest] == pytest.approx(t_rest, abs=1e-5)
            seen += 1
    assert seen > 10


def test_a_polygon_that_is_a_point_is_that_point() -> None:
    """Two opposite cables at their upper bounds hold the load; nothing is left to choose."""
    W = np.array([[-1.0, 1.0, 0.6, -0.6], [0.0, 0.0, 0.8, 0.8]])
    low, high = np.full(4, 10.0), np.array([100.0, 100.0, 50.0, 50.0])
    w_e = np.array([0.0, -80.0])
    for method in ("polygon-1-norm", "polygon-2-norm", "polygon-centroid"):
        t = np.zeros(4)
        outcome = tension_distribution(method, low, high, np.ones(2)).solve(W, w_e, t)
        assert outcome == TensionOutcome.FEASIBLE
        assert t[2:] == pytest.approx([50.0, 50.0])
        assert t[0] == pytest.approx(t[1])
