"""Tensions of the planar robot: in equilibrium, within bounds, or said why not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_rt.robots.planar_kinematics import GeometryError, PlanarGeometry
from cdpr_rt.robots.planar_tensions import PlanarTensions, carry

ROBOT = PlanarGeometry(
    np.array([[-2.0, 3.0], [2.0, 3.0], [0.0, 0.0]]),
    np.array([[-0.075, 0.0433], [0.075, 0.0433], [0.0, -0.0866]]),
)
LOW, HIGH = np.full(3, 20.0), np.array([110.0, 120.0, 100.0])
anywhere = st.tuples(st.floats(-1.9, 1.9), st.floats(0.2, 2.9)).map(np.array)
wrenches = st.tuples(st.floats(-150.0, 150.0), st.floats(-150.0, 150.0)).map(np.array)


def stranger(J: np.ndarray, wrench: np.ndarray) -> tuple[float, float]:
    """Return, by a linear program, how far outside the bounds tensions must be, and their sum."""
    W = -J.T
    rows = np.block([[-np.eye(3), -np.ones((3, 1))], [np.eye(3), -np.ones((3, 1))]])
    least = linprog(
        [0, 0, 0, 1], rows, np.concatenate([-LOW, HIGH]),
        np.hstack([W, np.zeros((2, 1))]), -wrench, [(None, None)] * 4,
    )  # fmt: skip
    inside = linprog([1, 1, 1], None, None, W, -wrench, list(zip(LOW, HIGH, strict=True)))
    assert least.x is not None
    total = inside.fun if inside.success else None
    return float(least.x[3]), np.inf if total is None else float(total)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(anywhere, wrenches, st.floats(0.0, 1.0))
def test_equilibrium_and_bounds(p: np.ndarray, wrench: np.ndarray, share: float) -> None:
    J = ROBOT.jacobian(p)
    t, missing = PlanarTensions(LOW, HIGH, share).distribute(J, wrench)
    assert -J.T @ t + wrench == pytest.approx(np.zeros(2), abs=1e-7)
    outside, _ = stranger(J, wrench)
    if outside < -1e-6:
        assert not missing
        assert (t >= LOW - 1e-9).all()
        assert (t <= HIGH + 1e-9).all()
    elif outside > 1e-6:
        assert "outside" in missing
        worst = float(np.maximum(LOW - t, t - HIGH).max())
        assert worst == pytest.approx(outside, rel=1e-3, abs=1e-3), "as little as can be"


@settings(derandomize=True, deadline=None, max_examples=200)
@given(anywhere, wrenches)
def test_share_nothing_is_the_least_tension(p: np.ndarray, wrench: np.ndarray) -> None:
    J = ROBOT.jacobian(p)
    t, missing = PlanarTensions(LOW, HIGH).distribute(J, wrench)
    outside, total = stranger(J, wrench)
    if not missing and outside < -1e-6:
        assert min(t - LOW) == pytest.approx(0.0, abs=1e-7)
        # where all tensions grow together the least of one is the least of their sum
        u = np.linalg.svd(J.T)[2][2]
        if (u > 0.0).all() or (u < 0.0).all():
            assert t.sum() == pytest.approx(total, rel=1e-6)


def test_tensions_go_on_smoothly_over_the_workspace() -> None:
    tensions = PlanarTensions(LOW, HIGH)
    weight = np.array([0.0, -2.5 * 9.80665])
    line = np.linspace([-0.5, 1.0], [0.9, 2.5], 2001)
    found = [tensions.distribute(ROBOT.jacobian(p), weight) for p in line]
    assert not any(missing for _, missing in found)
    t = np.array([tension for tension, _ in found])
    assert np.abs(np.diff(t, axis=0)).max() < 1.0


def test_cables_that_cannot_hold_say_so() -> None:
    flat = PlanarGeometry(np.array([[-1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.zeros((3, 2)))
    _, missing = PlanarTensions(LOW, HIGH).distribute(flat.jacobian(np.zeros(2)), np.zeros(2))
    assert "cannot hold one direction" in missing
    _, missing = PlanarTensions(LOW, HIGH).distribute(
        ROBOT.jacobian(np.array([0.0, 1.5])), np.array([0.0, -400.0])
    )
    assert "N outside" in missing
    assert "cable" in missing


@pytest.mark.parametrize(
    ("low", "high"), [((1, 2), (3, 4)), ((5, 5, 5), (9, 5, 9)), ((-1, 0, 0), (1, 1, 1))]
)
def test_bounds_that_bound_nothing_are_refused(low: tuple[int, ...], high: tuple[int, ...]) -> None:
    with pytest.raises(GeometryError, match="tension bounds"):
        PlanarTensions(np.array(low), np.array(high))


def carried_by(
    p: np.ndarray, wrench: np.ndarray, force: np.ndarray, lift: float, pace: float = 0.02
) -> tuple[np.ndarray, np.ndarray, tuple[int, float, float, float]]:
    """Return tensions, those that carry the wrench alone, and what `carry` tells of them."""
    t, alone, u, room = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((4, 3))
    low, high = LOW + RESERVE_N, HIGH - RESERVE_N
    told = carry(
        ROBOT.jacobian(p), wrench, force, low, high, RESERVE_N, pace, lift, t, alone, u, room
    )
    return t, alone, told


RESERVE_N = 10.0
forces = st.lists(st.floats(-60, 60), min_size=2, max_size=2).map(np.array)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(anywhere, wrenches, forces, st.floats(0.0, 30.0))
def test_a_loop_s_force_is_exerted_as_far_as_the_reserve_goes(
    p: np.ndarray, wrench: np.ndarray, force: np.ndarray, lift: float
) -> None:
    J = ROBOT.jacobian(p)
    asked = force.copy()
    t, alone, (outcome, outside, share, lifted) = carried_by(p, wrench, force, lift)
    assert (force == asked).all()
    low, high = LOW + RESERVE_N, HIGH - RESERVE_N
    feasible = PlanarTensions(low, high).distribute(J, wrench)[1] == ""
    assert (outcome == 0) == feasible
    # whatever is asked for, nothing leaves the true bounds
    assert (t >= LOW - 1e-6).all()
    assert (t <= HIGH + 1e-6).all()
    if not feasible:
        assert outside > 0.0
        return
    assert -J.T @ alone == pytest.approx(-wrench, abs=1e-6)
    assert (alone >= low - 1e-6).all()
    assert (alone <= high + 1e-6).all()
    assert 0.0 <= share <= 1.0
    assert -J.T @ t == pytest.approx(share * asked - wrench, abs=1e-6)
    assert lifted >= 0.0


def test_tensions_rise_slowly_where_a_force_needs_them() -> None:
    p, weight = np.array([0.0, 1.5]), np.array([0.0, -20.0])
    up = np.array([0.0, 40.0])
    lift, shares, least = 0.0, [], []
    for _ in range(400):
        t, _, (_, _, share, lift) = carried_by(p, weight, up, lift)
        shares.append(share)
        least.append(t.min())
    assert shares[0] < 0.9, "there is not so much room at once"
    assert shares[-1] == pytest.approx(1.0)
    assert np.abs(np.diff(least)).max() < 1.0
    for _ in range(400):
        lift = carried_by(p, weight, np.zeros(2), lift)[2][3]
    assert lift < 0.1, "least tension is least friction"
