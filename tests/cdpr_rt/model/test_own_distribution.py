"""Tension distributions of the user's own: what is checked, and how a loop fades to them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.own_distribution import TOLERANCE, OwnDistribution, TensionDistributionError

W = np.array([[1.0, -1.0, 0.2], [0.0, 0.0, 1.0]])
WRENCH = np.array([0.0, -100.0])
LOW, HIGH = np.full(3, 10.0), np.full(3, 200.0)
BUILT_IN = np.array([10.0, 30.0, 100.0])
WANTED = np.array([60.0, 80.0, 100.0])
SCALE = np.ones(2)


def own(function: Callable[..., object], period_s: float = 0.02) -> OwnDistribution:
    return OwnDistribution(function, LOW, HIGH, SCALE, period_s)  # type: ignore[arg-type]


def shifted(by_N: FloatArray | float) -> Callable[..., FloatArray]:
    def wanted(*_: FloatArray) -> FloatArray:
        return WANTED + by_N

    return wanted


def test_the_function_gets_all_arrays_and_its_tensions_are_taken() -> None:
    given: list[tuple[FloatArray, ...]] = []

    def wanted(*arrays: FloatArray) -> list[float]:
        given.append(arrays)
        return WANTED.tolist()

    found = np.zeros(3)
    own(wanted).solve(W, WRENCH, BUILT_IN, found)
    assert found == pytest.approx(WANTED)
    for got, expected in zip(given[0], (W, WRENCH, LOW, HIGH, BUILT_IN), strict=True):
        assert got == pytest.approx(expected)


def failing(*_: FloatArray) -> FloatArray:
    raise ZeroDivisionError("no way on")


def leaving(*_: FloatArray) -> FloatArray:
    raise SystemExit("enough")


def writing(w_matrix: FloatArray, *_: FloatArray) -> FloatArray:
    w_matrix[:] = 0.0
    return WANTED


@pytest.mark.parametrize(
    ("function", "text"),
    [
        (lambda *_: WANTED[1:], r"<lambda>: returned \[ 80. 100.\]; return 3 finite tensions in N"),
        (lambda *_: None, "returned None; return 3 finite tensions"),
        (lambda *_: "much", "returned 'much'; return 3 finite tensions"),
        (shifted(np.nan), r"wanted: returned \[nan nan nan\]; return 3 finite"),
        (shifted(np.array([140.1, 140.1, 0.0])), "200.1 N for cable 1; allowed: 10 to 200 N"),
        (shifted(np.array([-55.0, -55.0, 0.0])), "5 N for cable 1; allowed: 10 to 200 N"),
        (shifted(np.array([0.1, 0.0, 0.0])), r"W t \+ w is 0.1 in row 1; allowed: up to 0.02"),
        (failing, "tension distribution failing: ZeroDivisionError: no way on"),
        (leaving, "SystemExit: enough"),
        (writing, "ValueError: .*read-only"),
    ],
)  # fmt: skip
def test_each_error_of_the_function_is_reported(function: Callable[..., object], text: str) -> None:
    found = BUILT_IN.copy()
    with pytest.raises(TensionDistributionError, match=text):
        own(function).solve(W, WRENCH, BUILT_IN, found)
    assert found == pytest.approx(BUILT_IN)


def test_tensions_of_an_iterative_solver_are_put_within_their_bounds() -> None:
    beyond = 0.5 * TOLERANCE * 190.0
    found = np.zeros(3)
    own(shifted(np.array([-50.0 - beyond, -50.0 - beyond, 0.0]))).solve(W, WRENCH, BUILT_IN, found)
    assert found.min() == LOW[0]


def test_a_loop_fades_to_the_function_within_a_fifth_of_a_second() -> None:
    previous: list[FloatArray] = []

    def wanted(*arrays: FloatArray) -> FloatArray:
        previous.append(arrays[-1].copy())
        return WANTED

    faded, rows = own(wanted), []
    for _ in range(11):
        tension = BUILT_IN.copy()
        assert faded.write(W, WRENCH, tension)
        rows.append(tension)
        assert W @ tension + WRENCH == pytest.approx(np.zeros(2), abs=1e-9)
    assert np.abs(np.diff([BUILT_IN, *rows], axis=0)).max() == pytest.approx(5.0)
    assert rows[9] == pytest.approx(WANTED)
    assert np.array(previous) == pytest.approx(np.array([BUILT_IN, *rows[:-1]]))
    faded.restart()
    tension = BUILT_IN.copy()
    faded.write(W, WRENCH, tension)
    assert tension == pytest.approx(BUILT_IN + 0.1 * (WANTED - BUILT_IN))


def test_a_loop_stops_asking_after_a_failure_until_it_begins_again() -> None:
    calls: list[int] = []

    def failing_once(*_: FloatArray) -> FloatArray:
        calls.append(1)
        if len(calls) == 1:
            raise ZeroDivisionError
        return WANTED

    asked, tension = own(failing_once), BUILT_IN.copy()
    with pytest.raises(TensionDistributionError, match="ZeroDivisionError"):
        asked.write(W, WRENCH, tension)
    assert not asked.write(W, WRENCH, tension)
    assert tension == pytest.approx(BUILT_IN) and len(calls) == 1
    asked.revive()
    assert asked.write(W, WRENCH, tension)
    asked.stand_in()
    assert not asked.write(W, WRENCH, tension)
