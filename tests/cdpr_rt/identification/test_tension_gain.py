"""The fit of gain and friction to made-up measurements, and what it rejects."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.identification.tension_gain import (
    CalibrationRefusedError,
    TorquePoint,
    identify_tension_gain,
)

NOMINAL = 0.026


def points(
    tensions: list[float],
    gain: float = NOMINAL,
    friction: float = 0.1,
    share: float = 0.05,
    bias: float = 0.01,
    noise: Any = None,
    cogging: float = 0.0,
) -> list[TorquePoint]:
    made = []
    for winding_in in (True, False):
        side = 1.0 if winding_in else -1.0
        for tension in tensions:
            angle = tension * 0.08
            torque = gain * tension * (1.0 + side * share) + side * friction + bias
            torque += cogging * math.cos(4 * angle + 0.7)
            if noise is not None:
                torque += noise.normal(0.0, 0.002)
            made.append(TorquePoint(tension, torque, winding_in, angle))
    return made


@settings(max_examples=40)
@given(
    gain=st.floats(0.015, 0.037),
    friction=st.floats(0.0, 0.3),
    share=st.floats(0.0, 0.2),
    bias=st.floats(-0.05, 0.05),
)
def test_exact_measurements_give_the_exact_parameters(
    gain: float, friction: float, share: float, bias: float
) -> None:
    found = identify_tension_gain(points([20.0, 50.0, 100.0], gain, friction, share, bias), NOMINAL)
    assert found.gain_m.value == pytest.approx(gain, rel=1e-9)
    assert found.friction_Nm.value == pytest.approx(friction, abs=1e-9)
    assert found.friction_per_N_m.value == pytest.approx(share * gain, abs=1e-9)
    assert found.bias_Nm.value == pytest.approx(bias, abs=1e-9)


def test_the_interval_contains_the_truth_as_often_as_claimed() -> None:
    inside = 0
    for seed in range(300):
        noise = np.random.default_rng(seed)
        found = identify_tension_gain(points([20.0, 50.0, 80.0], noise=noise), NOMINAL)
        inside += abs(found.gain_m.value - NOMINAL) <= found.gain_m.half_width
    assert 270 <= inside <= 299  # 95 %


def test_cogging_along_a_pull_is_fitted_and_removed() -> None:
    tensions = list(np.linspace(10.0, 80.0, 200))
    noise = np.random.default_rng(3)
    pull = points(tensions, cogging=0.06, noise=noise)
    found = identify_tension_gain(pull, NOMINAL, cogging_order=4)
    assert found.gain_m.value == pytest.approx(NOMINAL, rel=2e-3)
    assert found.cogging_Nm == pytest.approx(0.06, rel=0.02)
    blind = identify_tension_gain(pull, NOMINAL)
    assert blind.residual_rms_Nm > 10 * found.residual_rms_Nm


def test_correlated_errors_widen_the_interval() -> None:
    tensions = list(np.linspace(10.0, 80.0, 200))
    pull = points(tensions, noise=np.random.default_rng(5))
    wavy = [
        TorquePoint(p.tension_N, p.torque_Nm + 0.002 * math.sin(i / 9), p.winding_in, p.angle_rad)
        for i, p in enumerate(points(tensions))
    ]
    sharp = identify_tension_gain(pull, NOMINAL, cogging_order=4)
    blurred = identify_tension_gain(wavy, NOMINAL, cogging_order=4)
    assert blurred.residual_rms_Nm < sharp.residual_rms_Nm
    assert blurred.gain_m.half_width > 2 * sharp.gain_m.half_width


def assert_rejected(made: list[TorquePoint], what: str, **more: Any) -> None:
    with pytest.raises(CalibrationRefusedError, match=what):
        identify_tension_gain(made, NOMINAL, **more)


def test_measurements_that_are_too_few_or_too_poor_are_rejected() -> None:
    assert_rejected(points([20.0, 50.0]), "2 tensions were measured winding in; at least 3")
    assert_rejected(points([20.0, 50.0, 80.0])[:3], "0 tensions were measured paying out")
    assert_rejected(points([50.0, 55.0, 60.0]), r"reach from 50.0 to 60.0 N")
    assert_rejected(points([20.0, 50.0, 80.0], gain=-0.026, share=0.0), "cable_sign")
    assert_rejected(
        points([20.0, 50.0, 80.0], gain=0.052, share=0.0), "is 2.00 times the geometry's 26.00"
    )
    assert_rejected(
        points([20.0, 50.0, 80.0], friction=-0.2, share=0.0), "torque or the cable wrong"
    )
    wild = [
        TorquePoint(p.tension_N, p.torque_Nm + 0.3 * (-1) ** i, p.winding_in)
        for i, p in enumerate(points([20.0, 50.0, 80.0]))
    ]
    assert_rejected(wild, "the gain is uncertain by")


def test_a_pull_too_short_to_separate_cogging_from_gain_is_rejected() -> None:
    short = [
        TorquePoint(p.tension_N, p.torque_Nm, p.winding_in, 0.001 * p.tension_N)
        for p in points(list(np.linspace(10.0, 80.0, 50)), cogging=0.06)
    ]
    assert_rejected(
        short, "cannot separate gain, friction and cogging|is uncertain by", cogging_order=4
    )
