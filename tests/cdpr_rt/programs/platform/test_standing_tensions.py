"""With which tensions cables are tightened around a platform that stands."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.robots.standing_tensions import OVERSHOOT, StandingTensions
from tests.cdpr_rt.robots.platform.platform_physics import heavier, spatial


@pytest.mark.parametrize(("mass_kg", "share"), [(6.0, 1.0), (12.0, 0.75), (14.0, 0.25)])
def test_no_cable_is_pulled_less_than_the_others_bounds_make_it(
    mass_kg: float, share: float
) -> None:
    """Friction leaves cables that hardly pull to sag, and their lengths tell another pose.

    The heavier a platform that is pressed down with its weight, the less is left for that.
    """
    machine = heavier(spatial(), mass_kg)
    model, low_N = machine.model(), machine.control().low_N
    most_N = np.full(machine.n, machine.torque_Nm / 0.026)
    standing = StandingTensions(model, low_N, most_N, np.zeros(machine.n))
    tension_N, stays = standing.at(model.home_pose)
    W = np.zeros((model.size, machine.n))
    model.kinematics.wrench_matrix(model.home_pose, W)
    assert stays
    floor_N = machine.low_N + share * (low_N - machine.low_N)
    assert tension_N.min() == pytest.approx(floor_N.min(), abs=1e-6)
    assert (OVERSHOOT * tension_N < machine.high_N).all()
    np.testing.assert_allclose(W @ tension_N, model.weight(), atol=1e-6)


@pytest.mark.parametrize(
    ("mass_kg", "taken_up_N", "share"), [(14.0, 20.0, 1.0), (14.0, 23.0, 0.75), (18.0, 26.0, 0.5)]
)
def test_winches_that_may_take_up_all_pull_harder_and_press_the_platform_less(
    mass_kg: float, taken_up_N: float, share: float
) -> None:
    """Else a cable hangs all but slack, as its winch is wound in, and its length is anything."""
    machine = heavier(spatial(), mass_kg)
    model, low_N = machine.model(), machine.control().low_N
    most_N, taken_up = np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
    tension_N, stays = StandingTensions(model, low_N, most_N, taken_up).at(model.home_pose)
    W = np.zeros((model.size, machine.n))
    model.kinematics.wrench_matrix(model.home_pose, W)
    assert stays
    assert (tension_N > taken_up_N).all()
    np.testing.assert_allclose(W @ tension_N, share * model.weight(), atol=1e-6)


def test_the_more_winches_may_take_up_the_harder_cables_are_pulled() -> None:
    machine = heavier(spatial(), 14.0)
    model, low_N = machine.model(), machine.control().low_N
    least_N = []
    for taken_up_N in (0.0, 20.0, 23.0, 30.0, 40.0):
        most_N, taken_up = np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
        taken_up[0] *= 2.0
        standing = StandingTensions(model, low_N, most_N, taken_up)
        tension_N, stays = standing.at(model.home_pose)
        assert stays
        least_N.append(tension_N.min())
    assert least_N == sorted(least_N)
    assert least_N[-1] > 1.5 * least_N[0]


@pytest.mark.parametrize(("taken_up_N", "pulled_N"), [(28.0, 33.6), (44.0, 39.6)])
def test_they_are_pulled_with_more_than_is_planned_with_where_winches_take_that_up(
    taken_up_N: float, pulled_N: float
) -> None:
    """Up to their bounds: 1.2 times what winches take up, or three quarters of that."""
    machine = heavier(spatial(), 14.0)
    model, low_N = machine.model(), np.full(machine.n, 20.0)
    standing = StandingTensions(
        model, low_N, np.full(machine.n, 1e3), np.full(machine.n, taken_up_N)
    )
    tension_N, stays = standing.at(model.home_pose)
    assert stays
    assert tension_N.min() > pulled_N - 1e-6
    assert (OVERSHOOT * tension_N < machine.high_N).all()
