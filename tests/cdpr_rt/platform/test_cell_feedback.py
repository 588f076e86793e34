"""Measured tensions in the loop: errors of motors are compensated within bounds."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.model.tension_split import FAST
from cdpr_rt.platform.cell_feedback import TOGETHER_SHARE, CellCheck, CellFeedback

PERIOD_S, RESERVE_N = 1e-3, 80.0
MOST_N = (1.0 - FAST) * RESERVE_N
CABLE_m = np.array([0.026, -0.026, 0.003])
RISE_N = np.array([4.0, 0.0, -2.0])
"""Difference of the tensions at the winches, where the cells are, from the requested ones."""
MISSING_N = np.array([3.0, -5.0, 40.0])


class Cables:
    """Tensions that are `missing_N` below the requested ones, read through a filter every 50 ms."""

    def __init__(self) -> None:
        self.read_N, self.valid = np.full(3, 50.0), np.ones(3, np.bool_)
        self.learnt_Nm = np.zeros(3)
        check = CellCheck(["a", "b", "c"], np.full(3, 150.0), np.ones(2), np.ones(2), PERIOD_S)
        self.feedback = CellFeedback(
            self.read_N, self.valid, CABLE_m, RESERVE_N, PERIOD_S, check,
            np.zeros((2, 3)), np.zeros(2), self.learnt_Nm, RISE_N,
        )  # fmt: skip
        self.asked_N, self.missing_N = np.full(3, 50.0), MISSING_N
        self.feedback.restart(self.asked_N)
        self._filtered = np.full((2, 3), 50.0)

    @property
    def true_N(self) -> np.ndarray:
        added_Nm = self.learnt_Nm + self.feedback.torque_Nm
        return self.asked_N - self.missing_N - added_Nm / CABLE_m

    def run(self, seconds: float, stuck_N: float | None = None) -> np.ndarray:
        """Return the true tensions of each cycle, (k, 3); cells that are stuck read `stuck_N`."""
        seen = []
        for k in range(round(seconds / PERIOD_S)):
            self.feedback.update(self.asked_N)
            self._filtered[0] += 0.09 * (self.true_N - self._filtered[0])
            self._filtered[1] += 0.09 * (self._filtered[0] - self._filtered[1])
            if k % 50 == 0:
                self.read_N[:] = self._filtered[1] + RISE_N if stuck_N is None else stuck_N
            seen.append(self.true_N)
        return np.array(seen)


def test_a_weak_motor_is_compensated_within_bounds() -> None:
    cables = Cables()
    cables.run(4.0)
    np.testing.assert_allclose(cables.true_N[:2], 50.0, atol=0.05)
    assert cables.true_N[2] == pytest.approx(50.0 - MISSING_N[2] + MOST_N)


def test_a_step_of_the_requested_tension_is_followed_immediately() -> None:
    cables = Cables()
    cables.run(4.0)
    cables.asked_N = np.full(3, 80.0)
    assert np.abs(cables.run(2.0)[:, :2] - 80.0).max() < 3.0


def test_the_correction_fades_when_readings_stop() -> None:
    cables = Cables()
    cables.run(4.0)
    cables.valid[0] = False
    cables.read_N[0] = np.nan
    seen = cables.run(6.0)[:, 0]
    assert np.abs(np.diff(seen)).max() < 0.01  # gradually
    assert seen[-1] == pytest.approx(50.0 - MISSING_N[0], abs=0.05)
    assert cables.true_N[1] == pytest.approx(50.0, abs=0.05)


@pytest.mark.parametrize("stuck_N", [0.0, 1e3])
def test_a_stuck_cell_leaves_true_tensions_within_their_bounds(stuck_N: float) -> None:
    """Motors without error stay within the loop's bounds whatever the cell reads."""
    cables = Cables()
    cables.missing_N = np.zeros(3)
    low_N, high_N = 20.0, 300.0
    asked_N = (low_N + (1.0 - FAST) * RESERVE_N, high_N - (1.0 - FAST) * RESERVE_N)
    for edge_N in asked_N:  # planned bounds with the loop's largest force beyond them
        cables.asked_N = np.full(3, edge_N)
        cables.run(1.0, stuck_N)
        assert (cables.true_N > low_N - 1e-9).all() and (cables.true_N < high_N + 1e-9).all()
    assert np.abs(cables.true_N - edge_N).min() == pytest.approx(MOST_N)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_stuck_cell_and_a_wrongly_learnt_torque_share_one_bound(sign: float) -> None:
    cables = Cables()
    cables.missing_N = np.zeros(3)
    most_N = TOGETHER_SHARE * RESERVE_N
    cables.learnt_Nm[:] = sign * CABLE_m * (most_N - 0.25 * MOST_N)
    cables.run(2.0, stuck_N=50.0 + sign * 900.0)
    assert cables.true_N == pytest.approx(50.0 - sign * most_N)
    cables.learnt_Nm[:] *= -1.0  # as friction does when the motion reverses
    cables.run(PERIOD_S, stuck_N=50.0 + sign * 900.0)
    assert cables.true_N == pytest.approx(50.0 + sign * (most_N - 1.25 * MOST_N))


def test_a_cell_is_checked_against_the_applied_correction() -> None:
    cables = Cables()
    cables.missing_N = np.zeros(3)
    cables.learnt_Nm[:] = CABLE_m * (TOGETHER_SHARE * RESERVE_N - 0.25 * MOST_N)
    cables.run(16.0, stuck_N=950.0)
    # a quarter of the correction is left beside the learnt torque
    assert f"shows {900.0 - RISE_N[2] + 0.25 * MOST_N:.0f} N more" in cables.feedback.check.trouble
