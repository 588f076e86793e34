"""A load cell with a wrong reading is named; wrong motors, payloads and cables blame no cell."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.platform.cell_feedback import CellCheck, balance_std_N

PERIOD_S, RATED_N, WEIGHT_N = 1e-3, 150.0, 50.0
ANGLES = np.radians([35.0, 145.0, 215.0, 325.0])
W = np.array([np.cos(ANGLES), np.sin(ANGLES)])
TENSION_N = np.array([80.0, 80.0, 80.0, 80.0])
WEIGHT = np.array([0.0, -WEIGHT_N])
RISE_N = np.array([6.0, 5.0, -3.0, 0.0])
"""Difference of tension from the middle of each cable to its cell."""
TENSION_N = TENSION_N - np.linalg.pinv(W) @ (W @ TENSION_N + WEIGHT)


class Cells:
    """Four cables in a plane at rest, with measured and requested tensions."""

    def __init__(self) -> None:
        names = ["one", "two", "three", "four"]
        scale = np.ones(2)
        std_N = balance_std_N(WEIGHT_N, 1, scale)
        self.check = CellCheck(names, np.full(4, RATED_N), std_N, scale, PERIOD_S)
        self.read_N, self.valid = TENSION_N + RISE_N, np.ones(4, np.bool_)
        self.asked_N, self.added_N = np.array(TENSION_N), np.zeros(4)
        self.wrench = np.array(WEIGHT)
        self.check.bind(self.read_N, self.valid, RISE_N, self.asked_N, self.added_N, W, self.wrench)

    def told(self, seconds: float = 10.0) -> str:
        for _ in range(round(seconds / PERIOD_S)):
            self.check.update()
        return self.check.trouble


@pytest.mark.parametrize(("off_N", "word"), [(40.0, "more"), (-40.0, "less")])
def test_a_cell_with_a_wrong_reading_is_named_with_the_error(off_N: float, word: str) -> None:
    cells = Cells()
    assert not cells.told()
    cells.read_N[2] += off_N
    assert cells.told().startswith(f"three: its load cell shows 40 N {word} than its motor")
    cells.read_N[2] -= off_N
    cells.check.restart()
    assert cells.told().startswith("three"), "the report stays until it is cleared"


def test_the_balance_of_forces_distinguishes_cell_and_motor() -> None:
    # the readings balance the weight, so the motor is wrong
    cells = Cells()
    cells.asked_N[1] -= 22.0
    assert not cells.told()
    cells = Cells()
    cells.read_N[1] += 22.0
    assert cells.told().startswith("two: its load cell shows 22 N more")


def test_usual_motor_and_payload_errors_do_not_blame_a_load_cell() -> None:
    cells = Cells()
    cells.read_N[:] += np.array([5.0, -4.0, 6.0, 3.0])
    assert not cells.told()
    cells = Cells()
    cells.wrench[1] = -1.5 * WEIGHT_N
    carried = np.linalg.pinv(W) @ (W @ TENSION_N + cells.wrench)
    cells.asked_N -= carried
    cells.read_N -= carried
    cells.wrench[1] = -WEIGHT_N  # the platform weighs 50 % more than the file says
    assert not cells.told()


def test_an_external_force_does_not_blame_a_load_cell() -> None:
    cells = Cells()
    pulled = np.linalg.pinv(W) @ np.array([60.0, 0.0])
    cells.asked_N += pulled
    cells.read_N += pulled
    assert not cells.told()


def test_a_silent_cell_is_ignored() -> None:
    cells = Cells()
    cells.read_N[3], cells.valid[3] = np.nan, False
    assert not cells.told()
    cells.read_N[0] += 60.0
    assert cells.told().startswith("one: ")


def test_oscillating_readings_do_not_blame_a_load_cell() -> None:
    cells = Cells()
    for k in range(10_000):
        cells.read_N[:] = TENSION_N + RISE_N + 40.0 * np.sin(2.0 * np.pi * PERIOD_S * k)
        cells.check.update()
    assert not cells.check.trouble
