"""With which tensions cables are tightened around a platform that stands."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.programs.platform.tightening.standing_tensions import OVERSHOOT, StandingTensions
from tests.cdpr_rt.robots.platform_physics import heavier, spatial


@pytest.mark.parametrize(("mass_kg", "share"), [(6.0, 1.0), (14.0, 0.5), (25.0, 0.25)])
def test_no_cable_is_pulled_by_less_than_is_planned_with_to_press_harder(
    mass_kg: float, share: float
) -> None:
    """Below that, friction leaves cables to sag, whose lengths then tell another pose."""
    machine = heavier(spatial(), mass_kg)
    model, low_N = machine.model(), machine.control().low_N
    standing = StandingTensions(model, low_N, np.full(machine.n, machine.torque_Nm / 0.026))
    tension_N, stays = standing.at(model.home_pose)
    W = np.zeros((model.size, machine.n))
    model.kinematics.wrench_matrix(model.home_pose, W)
    assert stays
    assert (tension_N > low_N - 1e-6).all()
    assert (OVERSHOOT * tension_N < machine.high_N).all()
    np.testing.assert_allclose(W @ tension_N, share * model.weight(), atol=1e-6)
