"""Cables that stretch and sag, compared with the differential equation and published figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from cdpr_rt.model.cable_kernel import unstretched_length

DYNEEMA_N = 40e3
quick = settings(max_examples=40)


def end_of(length: float, t: float, angle: float, compliance: float, weight: float) -> np.ndarray:
    """Integrate a hanging elastic cable from the end at which it is pulled by `t` at `angle`."""
    H, V = t * math.cos(angle), t * math.sin(angle)

    def slope(s: float, _: np.ndarray) -> list[float]:
        v = V - weight * s
        tension = math.hypot(H, v)
        stretch = 1.0 + tension * compliance
        return [H / tension * stretch, v / tension * stretch]

    return solve_ivp(slope, (0.0, length), [0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]


@quick
@given(
    st.floats(0.0, 8.0),
    st.floats(-6.0, 6.0),
    st.floats(1.0, 500.0),
    st.sampled_from([0.0, 1.0 / DYNEEMA_N]),
    st.floats(0.0, 0.5),
)
def test_the_catenary_solves_its_differential_equation(
    across: float, height: float, slack: float, compliance: float, weight: float
) -> None:
    if math.hypot(across, height) < 0.1:
        return
    # much more than the cable's weight, as a winch pulls
    t = slack + 3.0 * weight * math.hypot(across, height)
    length = unstretched_length(across, height, t, compliance, weight)
    angle = math.atan2(height, across)
    stranger = fsolve(
        lambda u: end_of(u[0], t, u[1], compliance, weight) - [across, height],
        [math.hypot(across, height), angle],
        xtol=1e-12,
    )
    assert length == pytest.approx(stranger[0], abs=1e-8)


@pytest.mark.parametrize(
    ("tension", "sag_mm", "more_mm"),
    [(4.6, 80.2, 3.47), (10.4, 35.5, 0.68), (14.5, 25.4, 0.35), (18.6, 19.8, 0.21)],
)
def test_a_level_cable_sags_as_in_the_thesis(tension: float, sag_mm: float, more_mm: float) -> None:
    """Table 3.2: 4925 mm of 0.122 N/m, by (3.83) and, corrected, (3.84)."""
    span, weight = 4.925, 0.122
    alpha = tension / weight  # the thesis takes the tension as horizontal
    length = 2.0 * alpha * math.sinh(span / (2.0 * alpha))
    assert 1e3 * alpha * (math.cosh(span / (2.0 * alpha)) - 1.0) == pytest.approx(sag_mm, rel=5e-3)
    at_end = math.hypot(tension, 0.5 * weight * length)
    found = unstretched_length(span, 0.0, at_end, 0.0, weight)
    assert found == pytest.approx(length, abs=1e-12)
    assert 1e3 * (found - span) == pytest.approx(more_mm, abs=0.04)


@quick
@given(st.floats(0.1, 10.0), st.floats(0.0, 200.0), st.floats(1e3, 1e6))
def test_a_cable_without_weight_is_straight_and_stretched(rho: float, t: float, EA: float) -> None:
    across, height = 0.6 * rho, -0.8 * rho
    assert unstretched_length(across, height, t, 1.0 / EA, 0.0) == pytest.approx(
        rho / (1.0 + t / EA), rel=1e-14
    )
    light = unstretched_length(across, height, t + 1.0, 1.0 / EA, 1e-12)
    assert light == pytest.approx(rho / (1.0 + (t + 1.0) / EA), rel=1e-12)


def test_a_hanging_cable_is_stretched_by_its_own_weight() -> None:
    t, w, EA, height = 50.0, 2.0, 1e4, 4.0
    L = unstretched_length(0.0, height, t, 1.0 / EA, w)
    assert L * (1.0 + (t - 0.5 * w * L) / EA) == pytest.approx(height, rel=1e-14)


def test_a_cable_that_cannot_carry_its_weight_has_no_length() -> None:
    assert math.isnan(unstretched_length(5.0, 0.0, 0.2, 0.0, 0.122))
    assert math.isnan(unstretched_length(5.0, 0.0, 0.0, 0.0, 0.122))
