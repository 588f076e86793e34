"""Figures of merit of signals with known figures."""

import math

import numpy as np
import pytest

from cdpr_rt.control.tuning import design_pid
from cdpr_rt.control.validation import evaluate, floor, low_pass_velocity, ratios, worst
from cdpr_rt.errors import ControlError

T = 1e-3
SPEED = math.radians(22.0)


def ramp(seconds=40.0):
    time = np.arange(round(seconds / T)) * T
    return time, SPEED * time, np.full(time.size, SPEED)


def test_figures_agree_with_a_known_oscillation():
    time, setpoint, velocity = ramp()
    swing = math.radians(0.5) * np.sin(2 * math.pi * 2.0 * time)
    effort = 0.3 + 0.01 * np.sin(2 * math.pi * 2.0 * time)
    got = evaluate(setpoint + swing, setpoint, velocity, effort, T, time > 2.0)
    assert got.rms_position_error_deg == pytest.approx(0.5 / math.sqrt(2), rel=1e-3)
    assert got.peak_pid_effort_Nm == pytest.approx(0.01, rel=1e-3)
    assert got.peak_velocity_error_deg_s == pytest.approx(0.5 * 4 * math.pi, rel=1e-2)


def test_an_offset_counts_as_position_error():
    _, setpoint, velocity = ramp()
    got = evaluate(setpoint - 0.01, setpoint, velocity, 0 * setpoint, T)
    assert got.rms_position_error_deg == pytest.approx(math.degrees(0.01))
    assert got.mean_position_error_deg == pytest.approx(math.degrees(0.01))


def test_velocity_is_low_passed_without_phase_shift():
    time, setpoint, _ = ramp(4.0)
    middle = slice(1000, 3000)
    slow = low_pass_velocity(setpoint + 1e-3 * np.sin(2 * math.pi * 5 * time), T)[middle]
    want = SPEED + 1e-3 * 10 * math.pi * np.cos(2 * math.pi * 5 * time[middle])
    assert np.max(np.abs(slow - want)) < 1e-3
    fast = low_pass_velocity(setpoint + 1e-3 * np.sin(2 * math.pi * 200 * time), T)[middle]
    assert np.max(np.abs(fast - SPEED)) < 0.02 * 1e-3 * 400 * math.pi


def test_figures_combine_to_worst_values_and_ratios():
    _, setpoint, velocity = ramp(2.0)
    small = evaluate(setpoint - 0.01, setpoint, velocity, 0 * setpoint, T)
    large = evaluate(setpoint + 0.02, setpoint, velocity, 0 * setpoint, T)
    assert worst([small, large]).rms_position_error_deg == large.rms_position_error_deg
    assert ratios(large, small).rms_position_error == pytest.approx(2.0)


def test_signals_of_different_length_are_rejected():
    _, setpoint, velocity = ramp(2.0)
    with pytest.raises(ControlError, match="lengths"):
        evaluate(setpoint[:-1], setpoint, velocity, setpoint, T)


def test_the_noise_floor_agrees_with_a_frictionless_rotor():
    """The same loop is simulated in time with rounded reading and torque."""
    inertia, step, quantum = 1.13e-4, 2 * math.pi / 8192, 3e-3
    design = design_pid(inertia, 2.5 * T, 12.0)
    g, rng = design.gains, np.random.default_rng(1)
    velocity = integral = slope = last = carry = 0.0
    angle = 0.5 * step
    queue, n = [0.0, 0.0], 40000
    truth, wanted = np.zeros(n), np.zeros(n)
    for k in range(n):
        truth[k] = angle
        reading = step * (
            math.floor(angle / step + rng.uniform())
        )  # dithered, so that rounding errors are white
        error = -reading
        integral += g.integral_Nm_rad_s * T * error
        slope = (g.derivative_filter_s * slope + error - last) / (g.derivative_filter_s + T)
        last = error
        wanted[k] = g.proportional_Nm_rad * error + integral + g.derivative_Nms_rad * slope
        sent = quantum * round((wanted[k] + carry + rng.uniform(-1e-6, 1e-6)) / quantum)
        carry += wanted[k] - sent
        queue.append(sent)
        rate = queue.pop(0) / inertia
        angle += velocity * T + 0.5 * rate * T * T
        velocity += rate * T
    low = floor(g, inertia, 2.5 * T, T, step, quantum, samples=n)
    seen = evaluate(truth, 0 * truth, 0 * truth, wanted, T, np.arange(n) > 2000)
    for name in ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s"):
        assert 0.4 < getattr(seen, name) / getattr(low, name) < 2.5, name


def test_the_noise_floor_grows_with_the_steps():
    gains = design_pid(1.13e-4, 2.5 * T, 12.0).gains
    fine = floor(gains, 1.13e-4, 2.5 * T, T, 1e-4, 1e-4)
    coarse = floor(gains, 1.13e-4, 2.5 * T, T, 1e-3, 1e-3)
    assert ratios(coarse, fine).rms_position_error == pytest.approx(10.0, rel=1e-3)
