"""A load cell that is off is named; motors, payloads and cables that are off are none."""

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
"""By what cells show more than is in the middle of their cables."""
TENSION_N = TENSION_N - np.linalg.pinv(W) @ (W @ TENSION_N + WEIGHT)


class Cells:
    """Four cables in a plane at rest, their tensions as they are read and as they are asked for."""

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
def test_a_cell_that_is_off_is_named_with_how_much(off_N: float, word: str) -> None:
    cells = Cells()
    assert not cells.told()
    cells.read_N[2] += off_N
    assert cells.told().startswith(f"three: its load cell shows 40 N {word} than its motor")
    cells.read_N[2] -= off_N
    cells.check.restart()
    assert cells.told().startswith("three"), "it stays until it is cleared"


def test_the_balance_of_forces_tells_cell_and_motor_apart() -> None:
    # what makes the balance worse is more likely than what leaves it: this is a motor that is off
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
    cells.wrench[1] = -WEIGHT_N  # it weighs half as much again, and nobody has said so
    assert not cells.told()


def test_a_hand_that_pulls_is_no_cell() -> None:
    cells = Cells()
    pulled = np.linalg.pinv(W) @ np.array([60.0, 0.0])
    cells.asked_N += pulled
    cells.read_N += pulled
    assert not cells.told()


def test_a_silent_cell_is_left_out() -> None:
    cells = Cells()
    cells.read_N[3], cells.valid[3] = np.nan, False
    assert not cells.told()
    cells.read_N[0] += 60.0
    assert cells.told().startswith("one: ")


def test_readings_that_swing_are_no_lie() -> None:
    cells = Cells()
    for k in range(10_000):
        cells.read_N[:] = TENSION_N + RISE_N + 40.0 * np.sin(2.0 * np.pi * PERIOD_S * k)
        cells.check.update()
    assert not cells.check.trouble
