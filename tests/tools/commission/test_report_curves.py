"""Curves that the report computes from recordings agree with known ones."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from cdpr_rt.identification.thesis import ThesisResult
from cdpr_tools.commission import curves
from cdpr_tools.commission.commissioning import Pass
from cdpr_tools.recordings.truth import Truth
from cdpr_tools.style import decimated
from tests.tools.commission.made_up_commissioning import ERROR_ORDER, MadeUp, harmonic_result

GRID = 3600
ANGLE = np.arange(GRID) * (math.tau / GRID)
RAMP = Pass(math.radians(22.0), math.tau, math.tau)


@settings(max_examples=40)
@given(st.integers(1, 60_000), st.integers(0, 2**32 - 1))
def test_thinned_curves_keep_their_peaks(size: int, seed: int) -> None:
    y = np.random.default_rng(seed).standard_normal(size)
    x = np.arange(size, dtype=float)
    few_x, few_y = decimated(x, y)
    assert few_y.size <= 4000
    assert np.array_equal(y[few_x.astype(int)], few_y)
    assert np.all(np.diff(few_x) >= 0)
    assert few_y.max() == y.max()
    assert few_y.min() == y.min()


def test_thinned_curves_with_single_nan_keep_their_extremes() -> None:
    x = np.arange(30_000.0)
    y = np.sin(x / 500.0)
    y[::7] = np.nan
    y[10_000:12_000] = np.nan
    y[20_001] = 9.0
    at, kept = decimated(x, y)
    assert kept.size < 9000 and np.nanmax(kept) == 9.0
    assert np.isnan(kept[(at > 10_100) & (at < 11_900)]).all()
    assert np.isfinite(kept).mean() > 0.9


@settings(max_examples=30)
@given(
    gain=st.floats(0.5, 1.5),
    late_deg=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    offset=st.floats(-0.1, 0.1),
)
def test_the_error_of_a_table_is_found(
    gain: float, late_deg: tuple[float, float], offset: float
) -> None:
    harmonic = harmonic_result()
    late = np.radians(late_deg)
    curve = gain * np.vstack(
        [harmonic.cogging_Nm(ANGLE - late[0]), harmonic.cogging_Nm(ANGLE + late[1])]
    )
    thesis = ThesisResult(curve, curve + offset, curve.mean(axis=1) + offset, curve > 9.0, (2, 2))
    errors = curves.table_errors(thesis, harmonic)
    for side, error in enumerate(errors):
        assert error.gain == pytest.approx(gain, rel=1e-6)
        assert error.behind_deg == pytest.approx(late_deg[side], abs=1e-6)
        difference = curve[side] - harmonic.cogging_Nm(ANGLE)
        assert error.peak_Nm == pytest.approx(np.abs(difference).max(), abs=1e-9)
        assert error.rms_Nm == pytest.approx(np.sqrt(np.mean(difference**2)), abs=1e-9)
    both = curves.shift_deg(curve, 4)
    assert both == pytest.approx(late_deg[0] + late_deg[1], abs=1e-6)


@pytest.mark.parametrize("order", [1, 4, 24, 72, 150])
def test_filter_gain_equals_that_of_the_thesis_filter(order: int) -> None:
    wave = np.cos(order * ANGLE)
    filtered = savgol_filter(
        wave, 51, 2, mode="wrap"
    )  # 5 degrees on this grid, including both ends
    assert curves.filter_gain(order) == pytest.approx(filtered[0], abs=1e-9)


def test_friction_is_found_for_each_direction() -> None:
    harmonic = harmonic_result()
    forward, backward = curves.friction_Nm(harmonic, 0.3)
    assert forward == pytest.approx(0.08 + 0.02 / math.e + 5e-4 * 0.3)
    assert backward == pytest.approx(-(0.08 + 0.01 / math.e + 5e-4 * 0.3))
    assert curves.strongest_order(harmonic) == 4
    assert curves.strongest_order(dataclasses.replace(harmonic, harmonics=())) == 1


def test_a_ramp_is_read_as_recorded(tmp_path: Path) -> None:
    made = MadeUp(tmp_path)
    error = math.radians(0.5)
    path = made.record(
        "validate-8Hz-none-0",
        RAMP,
        lambda x: error * np.sin(ERROR_ORDER * x),
        lambda x: 0.3 + 0.01 * np.cos(x),
    )
    made.write_truth()
    ramp = curves.read_ramp(path, Truth(made.paths.truth))
    assert ramp.time_s.size * 2e-3 == pytest.approx(360.0 / 22.0, abs=0.01)
    assert np.abs(ramp.position_error_deg).max() == pytest.approx(0.5, rel=1e-3)
    assert np.abs(ramp.effort_Nm).max() == pytest.approx(0.01, rel=1e-2)
    peak = 22.0 * error * ERROR_ORDER  # deg/s: slope of the error along the ramp
    assert np.abs(ramp.velocity_error_deg_s).max() == pytest.approx(peak, rel=1e-2)
    assert ramp.standing == 0.0
    on_encoder = curves.read_ramp(path, None)
    assert np.abs(on_encoder.position_error_deg).max() == pytest.approx(0.5, abs=0.03)
    assert not np.array_equal(on_encoder.position_error_deg, ramp.position_error_deg)


def test_a_rotor_at_rest_is_detected(tmp_path: Path) -> None:
    made = MadeUp(tmp_path)
    step = math.radians(20.0)
    path = made.record("x-0", RAMP, lambda x: x - np.floor(x / step) * step, np.zeros_like)
    assert curves.read_ramp(path, None).standing > 0.9


def test_repeatable_and_random_parts_are_separated(tmp_path: Path) -> None:
    made = MadeUp(tmp_path)
    rng = np.random.default_rng(3)

    def effort(x: np.ndarray) -> np.ndarray:
        # the second order changes sign at each turn, so that it does not repeat
        sign = np.sign(np.sin(0.5 * x + 1e-9))
        noise = 1e-4 * rng.standard_normal(x.size)
        settling = 0.05 * np.exp(-np.abs(x) / 0.2)
        return np.asarray(0.003 * np.sin(4 * x) + 0.002 * sign * np.sin(10 * x) + noise + settling)

    paths = []
    for number, speed in enumerate((RAMP.speed_rad_s, -RAMP.speed_rad_s)):
        what = dataclasses.replace(RAMP, speed_rad_s=speed)
        paths.append(made.record(f"b-{number}", what, np.zeros_like, effort))
    left = curves.read_residual_effort(paths, 20)
    assert left.forward == (True, False)
    assert left.amplitudes_Nm[:, 3] == pytest.approx(0.003, rel=0.03)
    assert left.rms_Nm == pytest.approx(math.hypot(0.003, 0.002) / math.sqrt(2.0), rel=0.03)
    assert left.repeating_rms_Nm == pytest.approx(math.sqrt(0.5 * (0.003**2 - 0.002**2)), rel=0.1)
