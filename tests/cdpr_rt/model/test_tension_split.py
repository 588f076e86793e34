"""Tensions that carry a platform and exert a loop's force, compared with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear, nnls

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.tension_split import FAST, INFEASIBLE, OK, SINGULAR, split
from tests.cdpr_rt.platform.platform_physics import Machine, planar, spatial

MACHINES = {"plane": planar, "space": spatial}


class Split:
    """`tension_split.split` of a robot, with its state from cycle to cycle."""

    def __init__(self, machine: Machine, pace: float = 0.0) -> None:
        self.model: PlatformModel = machine.model()
        n, d = machine.n, self.model.size
        self.n, self.pace, self.scale = n, pace, self.model.wrench_scale
        self.reserve = self.model.reserve_N
        self.plan = np.array([self.model.low_N + self.reserve, self.model.high_N - self.reserve])
        self.slow, self.carried = self.plan[0].copy(), self.plan[0].copy()
        self.t, self.missing = np.zeros(n), np.zeros(d)
        self.weight = self.model.weight()

    def W(self, q: FloatArray) -> FloatArray:
        return np.array(self.model.kinematics.wrench_matrix(self.model.pose(q)))

    def __call__(
        self, W: FloatArray, known: FloatArray, force: FloatArray, given: bool = False
    ) -> tuple[int, float, int]:
        n, d, size = self.n, self.model.size, max(self.n, 8)
        return split(
            W, known, force, self.scale, self.plan, self.reserve, self.pace, given, self.slow,
            self.carried, self.t, self.missing, np.zeros((3, n)), np.zeros((2, n)),
            np.zeros((d, n + 1)), np.zeros((n + 1, n)), np.zeros((4, size, size)),
        )  # fmt: skip

    def wider(self, by: float) -> tuple[FloatArray, FloatArray]:
        return self.plan[0] - by, self.plan[1] + by


def places(splitting: Split, count: int) -> list[FloatArray]:
    platform, rng = splitting.model.platform, np.random.default_rng(5)
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    turns = splitting.model.size - len(low)
    most = splitting.model.angle_rad / max(turns, 1) ** 0.5
    return [
        np.concatenate([rng.uniform(low, high), rng.uniform(-most, most, turns)])
        for _ in range(count)
    ]


def is_nearest(
    t: FloatArray, wanted: FloatArray, W: FloatArray, low: FloatArray, high: FloatArray
) -> bool:
    """Return whether t is the projection of `wanted`: Karush, Kuhn and Tucker's conditions."""
    at_low, at_high = t <= low + 1e-9, t >= high - 1e-9
    cone = np.hstack([W.T, -W.T, -np.eye(len(t))[:, at_low], np.eye(len(t))[:, at_high]])
    return bool(nnls(cone, wanted - t)[1] < 1e-6)


@pytest.mark.parametrize("name", MACHINES)
def test_the_requested_wrench_is_exerted_within_bounds(name: str) -> None:
    splitting = Split(MACHINES[name]())
    rng, d = np.random.default_rng(1), splitting.model.size
    for q in places(splitting, 100):
        W = splitting.W(q)
        force = 5.0 * rng.normal(size=d) * splitting.scale
        outcome, share, free = splitting(W, splitting.weight, force)
        assert (outcome, share, free) == (OK, 1.0, splitting.n - d)
        assert W @ splitting.carried + splitting.weight == pytest.approx(np.zeros(d), abs=1e-8)
        assert W @ splitting.t + splitting.weight == pytest.approx(force, abs=1e-8)
        low, high = splitting.plan
        assert (splitting.carried >= low - 1e-9).all()
        assert (splitting.carried <= high + 1e-9).all()
        assert is_nearest(splitting.carried, splitting.slow, W, low, high)
        low, high = splitting.wider(FAST * splitting.reserve)
        assert (splitting.t >= low - 1e-9).all()
        assert (splitting.t <= high + 1e-9).all()
        assert is_nearest(splitting.t, splitting.carried, W, low, high)


@pytest.mark.parametrize("name", MACHINES)
def test_an_infeasible_wrench_is_approximated_with_least_error(name: str) -> None:
    splitting = Split(MACHINES[name]())
    rng, d = np.random.default_rng(2), splitting.model.size
    limited = 0
    for q in places(splitting, 60):
        W = splitting.W(q)
        way = rng.normal(size=d) * splitting.scale
        force = way * rng.uniform(10.0, 300.0) / np.linalg.norm(way / splitting.scale)
        outcome, share, _ = splitting(W, splitting.weight, force)
        low, high = splitting.wider(FAST * splitting.reserve)
        A = W / splitting.scale[:, None]
        best = lsq_linear(A, (force - splitting.weight) / splitting.scale, (low, high), tol=1e-12)
        left = (W @ splitting.t + splitting.weight - force) / splitting.scale
        assert outcome == OK
        assert np.linalg.norm(left) == pytest.approx(np.sqrt(2.0 * best.cost), abs=1e-5)
        assert splitting.missing == pytest.approx(-left * splitting.scale, abs=1e-7)
        size = float(np.linalg.norm(force / splitting.scale))
        assert share == pytest.approx(max(0.0, 1.0 - np.linalg.norm(left) / size), abs=1e-6)
        limited += share < 1.0
    assert limited > 10


@pytest.mark.parametrize("name", MACHINES)
def test_a_larger_requested_force_never_exerts_less(name: str) -> None:
    """The nearest point of a convex set: along the requested direction, the force never falls."""
    splitting = Split(MACHINES[name]())
    rng, d = np.random.default_rng(3), splitting.model.size
    for q in places(splitting, 30):
        W = splitting.W(q)
        way = rng.normal(size=d)
        way = way / np.linalg.norm(way)
        got = []
        for size in np.linspace(0.0, 400.0, 81):
            splitting(W, splitting.weight, size * way * splitting.scale)
            exerted = (W @ splitting.t + splitting.weight) / splitting.scale
            got.append(float(exerted @ way))
        assert np.diff(got).min() > -1e-7
        assert got[5] > 0.0


@pytest.mark.parametrize("name", MACHINES)
def test_tensions_do_not_step_along_a_path(name: str) -> None:
    splitting = Split(MACHINES[name](), pace=1e-3 / 0.051)
    rng, d = np.random.default_rng(4), splitting.model.size
    here, there = places(splitting, 2)
    way = rng.normal(size=d) * splitting.scale
    tensions = []
    for s in np.linspace(0.0, 1.0, 2001):
        # from below the feasible force to beyond it, and back
        force = 200.0 * np.sin(np.pi * s) ** 2 * way / np.linalg.norm(way / splitting.scale)
        splitting(splitting.W((1.0 - s) * here + s * there), splitting.weight, force)
        tensions.append(splitting.t.copy())
    steps = np.abs(np.diff(tensions, axis=0))
    assert np.ptp(tensions, axis=0).max() > 50.0
    assert steps.max() < 2.5


def test_the_inner_tension_follows_a_large_force_slowly() -> None:
    """A force that needs more than half of the reserve tightens the cables."""
    splitting = Split(planar(), pace=0.02)
    W, force = splitting.W(np.array([0.0, 1.9])), np.array([0.0, 40.0])
    splitting(W, splitting.weight, np.zeros(2))
    before = splitting.carried.copy()
    splitting(W, splitting.weight, force)
    once = splitting.carried.copy()
    for _ in range(500):
        outcome, share, _ = splitting(W, splitting.weight, force)
    assert (outcome, share) == (OK, 1.0)
    assert np.abs(once - before).max() < 0.1 * np.abs(splitting.carried - before).max()
    low, _ = splitting.wider(0.5 * splitting.reserve)
    assert splitting.t.min() > low[0] - 0.2


def test_an_infeasible_load_is_reported() -> None:
    splitting = Split(planar())
    outside = splitting.W(np.array([-1.5, 0.5]))
    outcome, _, _ = splitting(outside, splitting.weight, np.zeros(2))
    assert outcome == INFEASIBLE
    low, high = splitting.wider(splitting.reserve)
    assert (splitting.t >= low - 1e-9).all()
    assert (splitting.t <= high + 1e-9).all()
    assert splitting(np.ones((2, 3)), splitting.weight, np.zeros(2)) == (SINGULAR, 0.0, 0)
    assert splitting.t == pytest.approx(splitting.plan[0])


def test_given_tensions_stay_unchanged() -> None:
    splitting = Split(spatial())
    W = splitting.W(np.array([0.0, 0.0, 1.4, 0.0, 0.0, 0.0]))
    splitting(W, splitting.weight, np.zeros(6))
    inner = np.linalg.svd(W)[2][-1]
    given = splitting.carried + 5.0 * inner
    splitting.carried[:] = given
    slow = splitting.slow.copy()
    outcome, share, _ = splitting(W, splitting.weight, np.array([3.0, *np.zeros(5)]), given=True)
    assert (outcome, share) == (OK, 1.0)
    np.testing.assert_array_equal(splitting.carried, given)
    np.testing.assert_array_equal(splitting.slow, slow)
    assert W @ splitting.t + splitting.weight == pytest.approx([3.0, *np.zeros(5)], abs=1e-8)
