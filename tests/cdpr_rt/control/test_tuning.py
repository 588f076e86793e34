"""The PID design has its margins, and its bandwidth in the time domain."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.control.tuning import (
    INERTIA_RATIO,
    MAX_SENSITIVITY,
    GAIN_MARGIN_dB,
    PHASE_MARGIN_deg,
    TuningError,
    analyse,
    design_pid,
    standstill_gains,
    stiffest_pid,
    sweep_gain,
)

T = 1e-3
inertias = st.floats(1e-5, 1e-1)


def simulated_response(design, frequency_Hz, delay_cycles, sub=10):
    """Return the closed-loop amplitude at one frequency, by an independent simulation in time."""
    g, seconds = design.gains, 8.0 / frequency_Hz + 3.0
    n = round(seconds / T)
    angle = velocity = integral = slope = last = 0.0
    queue = [0.0] * (delay_cycles * sub)
    out = np.zeros(n)
    reference = np.sin(2 * math.pi * frequency_Hz * T * np.arange(n))
    for k in range(n):
        out[k] = angle
        error = reference[k] - angle
        integral += g.integral_Nm_rad_s * T * error
        slope = (g.derivative_filter_s * slope + error - last) / (g.derivative_filter_s + T)
        last = error
        u = g.proportional_Nm_rad * error + integral + g.derivative_Nms_rad * slope
        queue += [u] * sub
        for _ in range(sub):
            rate = queue.pop(0) / design.inertia_kg_m2
            angle += velocity * T / sub + 0.5 * rate * (T / sub) ** 2
            velocity += rate * T / sub
    period = round(1.0 / frequency_Hz / T)
    tail = out[-2 * period :]
    turn = np.exp(-2j * math.pi * frequency_Hz * T * np.arange(tail.size))
    return 2.0 * abs(np.mean(tail * turn))


@pytest.mark.parametrize("bandwidth", [5.0, 12.5, 25.0])
def test_bandwidth_agrees_with_a_simulation_in_time(bandwidth):
    design = design_pid(1.13e-4, 2.5 * T, bandwidth)  # two cycles plus half a cycle of the hold
    assert design.bandwidth_Hz == pytest.approx(bandwidth, rel=0.01)
    assert simulated_response(design, bandwidth, 2) == pytest.approx(math.sqrt(0.5), rel=0.03)
    assert simulated_response(design, 1.5 * bandwidth, 2) < 0.6


@settings(max_examples=20)
@given(inertia=inertias, latency=st.floats(0.5e-3, 4e-3), bandwidth=st.floats(3.0, 25.0))
def test_designs_keep_their_margins(inertia, latency, bandwidth):
    design = design_pid(inertia, latency, bandwidth)
    assert design.phase_margin_deg == pytest.approx(PHASE_MARGIN_deg, abs=0.5)
    assert design.gain_margin_dB >= GAIN_MARGIN_dB
    assert design.gain_reduction_dB >= GAIN_MARGIN_dB
    assert design.sensitivity_peak <= MAX_SENSITIVITY


@settings(max_examples=10)
@given(inertia=inertias)
def test_gains_follow_the_inertia(inertia):
    one, other = design_pid(1e-4, 2e-3, 10.0), design_pid(inertia, 2e-3, 10.0)
    for name in ("proportional_Nm_rad", "integral_Nm_rad_s", "derivative_Nms_rad"):
        a, b = getattr(one.gains, name), getattr(other.gains, name)
        assert b / a == pytest.approx(inertia / 1e-4, rel=1e-3)


def test_a_wrong_inertia_reduces_the_margins():
    design = design_pid(1e-4, 2e-3, 10.0)
    again = analyse(design.gains, 2e-4, 2e-3)
    assert again.gain_reduction_dB == pytest.approx(design.gain_reduction_dB - 6.02, abs=0.05)


def test_unreachable_bandwidths_are_rejected():
    with pytest.raises(TuningError, match=r"200 Hz .* latency of 4\.00 ms"):
        design_pid(1e-4, 4e-3, 200.0)
    with pytest.raises(TuningError, match="inertia_kg_m2 = -1"):
        design_pid(-1.0, 2e-3, 10.0)
    with pytest.raises(TuningError, match="latency_s = 0"):
        sweep_gain(1e-4, 0.0)


def test_sweep_gain_leaves_phase_for_the_latency():
    gain = sweep_gain(1.13e-4, 2.3e-3)
    assert math.sqrt(gain / 1.13e-4) * 2.3e-3 == pytest.approx(0.3)


@settings(max_examples=10)
@given(inertias, st.sampled_from([5e-4, 1e-3, 2e-3, 4e-3]))
def test_a_firm_loop_keeps_its_margins_and_tolerates_more_inertia(inertia, period):
    latency = 0.8e-3 + 1.5 * period
    plain = stiffest_pid(inertia, latency, (30.0, 20.0, 10.0, 5.0), period)
    firm = standstill_gains(plain, period)
    assert firm.sensitivity_peak <= MAX_SENSITIVITY
    assert firm.gain_margin_dB >= GAIN_MARGIN_dB
    assert firm.gains.proportional_Nm_rad > 1.5 * plain.gains.proportional_Nm_rad
    analyse(firm.gains, INERTIA_RATIO * inertia, latency, period)


@pytest.mark.parametrize("period", [1e-3, 2e-3])
def test_a_firm_loop_is_stiffer_than_the_slope_of_cogging(period):
    latency = 0.8e-3 + 1.5 * period
    firm = standstill_gains(stiffest_pid(1.13e-4, latency, (30.0, 20.0), period), period)
    # 0.06 Nm, four times per turn
    assert firm.gains.proportional_Nm_rad > 4 * 0.06
