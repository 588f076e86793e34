"""Tracking error of a validation ramp, and its floor by quantisation (1.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, rms
from cdpr_rt.control.pid import PidGains
from cdpr_rt.control.tuning import loop_response
from cdpr_rt.errors import ControlError

VELOCITY_LOW_PASS_Hz = 50.0


@dataclass(frozen=True)
class ValidationMetrics:
    """The three figures of the thesis' validation, worst over directions when combined."""

    rms_position_error_deg: float
    peak_pid_effort_Nm: float
    """Largest deviation of the PID's effort from its mean."""
    peak_velocity_error_deg_s: float
    """Largest deviation of the velocity through the low-pass from the set-point's."""
    mean_position_error_deg: float = 0.0


@dataclass(frozen=True)
class Ratios:
    """Factor by which each figure decreased; None if it was and stays zero."""

    rms_position_error: float
    peak_pid_effort: float
    peak_velocity_error: float


def low_pass_velocity(angle_rad: FloatArray, period_s: float) -> FloatArray:
    """Return the velocity of angles (k,) through the zero-phase 50 Hz low-pass, rad/s.

    A Butterworth filter of second order, run forward and backward: 1/(1 + (f/50 Hz)⁴). It is
    applied to the spectrum of the velocity and its mirror image, so that the ends do not change.
    """
    velocity = np.gradient(angle_rad, period_s)
    both = np.concatenate([velocity, velocity[::-1]])
    frequency = np.fft.rfftfreq(both.size, period_s)
    spectrum = np.fft.rfft(both) / (1.0 + (frequency / VELOCITY_LOW_PASS_Hz) ** 4)
    return np.asarray(np.fft.irfft(spectrum, both.size)[: velocity.size])


def evaluate(
    angle_rad: FloatArray,
    setpoint_rad: FloatArray,
    setpoint_velocity_rad_s: FloatArray,
    effort_Nm: FloatArray,
    period_s: float,
    judged: BoolArray | None = None,
) -> ValidationMetrics:
    """Evaluate one run in one direction.

    All arrays have shape (k,); `effort_Nm` is the torque of the PID alone. `judged` marks the
    samples to evaluate, whole turns after the lead-in; the low-pass uses the others too. Raises
    ControlError for arrays of different length or if no sample is marked.
    """
    sizes = {a.size for a in (angle_rad, setpoint_rad, setpoint_velocity_rad_s, effort_Nm)}
    if len(sizes) != 1:
        raise ControlError(f"arrays of a validation run have different lengths: {sorted(sizes)}")
    chosen = np.ones(angle_rad.size, np.bool_) if judged is None else judged
    if angle_rad.size < 50 or not chosen.any():
        raise ControlError("a validation run of less than 50 samples cannot be judged")
    error = (setpoint_rad - angle_rad)[chosen]
    velocity = low_pass_velocity(angle_rad, period_s)
    effort = effort_Nm[chosen]
    return ValidationMetrics(
        rms_position_error_deg=math.degrees(rms(error)),
        peak_pid_effort_Nm=float(np.max(np.abs(effort - effort.mean()))),
        peak_velocity_error_deg_s=math.degrees(
            float(np.max(np.abs((velocity - setpoint_velocity_rad_s)[chosen])))
        ),
        mean_position_error_deg=math.degrees(float(np.mean(error))),
    )


def worst(runs: list[ValidationMetrics]) -> ValidationMetrics:
    """Return the larger of each figure over several runs, such as the two directions."""
    return ValidationMetrics(
        max(m.rms_position_error_deg for m in runs),
        max(m.peak_pid_effort_Nm for m in runs),
        max(m.peak_velocity_error_deg_s for m in runs),
        max((m.mean_position_error_deg for m in runs), key=abs),
    )


def ratios(without: ValidationMetrics, having: ValidationMetrics) -> Ratios:
    """Return the factor by which compensation reduces each figure."""

    def divide(a: float, b: float) -> float:
        return a / b if b > 0.0 else math.inf

    return Ratios(
        divide(without.rms_position_error_deg, having.rms_position_error_deg),
        divide(without.peak_pid_effort_Nm, having.peak_pid_effort_Nm),
        divide(without.peak_velocity_error_deg_s, having.peak_velocity_error_deg_s),
    )


def floor(
    gains: PidGains,
    inertia_kg_m2: float,
    latency_s: float,
    period_s: float,
    encoder_step_rad: float,
    torque_step_Nm: float,
    samples: int = 16000,
) -> ValidationMetrics:
    """Return the figures that quantised readings and torques alone cause, without friction.

    Both roundings count as white noise of their step over √12; the rounding's residual,
    carried to the next cycle, shapes the torque's by 1 - z⁻¹. The noises pass the loop of
    `tuning.loop_response`; a peak is the expected largest of as many Gaussian values as there are
    independent ones in `samples` cycles. Stick-slip adds to this and is not included.
    """
    omega = np.linspace(2.0 * math.pi / (samples * period_s), math.pi / period_s, samples // 2)
    loop = loop_response(gains, inertia_kg_m2, latency_s, period_s, omega)
    plant = 1.0 / (inertia_kg_m2 * omega**2)
    shape = np.abs(1.0 - np.exp(-1j * omega * period_s))
    reading = encoder_step_rad / math.sqrt(12.0)
    torque = torque_step_Nm / math.sqrt(12.0) * shape
    position = (reading * np.abs(loop / (1.0 + loop))) ** 2 + (
        torque * plant / np.abs(1.0 + loop)
    ) ** 2
    effort = (reading * np.abs(loop / (1.0 + loop)) / plant) ** 2 + (
        torque * np.abs(loop / (1.0 + loop))
    ) ** 2
    keep = 1.0 / (1.0 + (omega / (2.0 * math.pi * VELOCITY_LOW_PASS_Hz)) ** 4)
    velocity = position * omega**2 * keep**2
    effort_width = _independent(effort, samples)
    velocity_width = _independent(velocity, samples)
    return ValidationMetrics(
        math.degrees(math.sqrt(float(np.mean(position)))),
        math.sqrt(float(np.mean(effort))) * math.sqrt(2.0 * math.log(effort_width)),
        math.degrees(math.sqrt(float(np.mean(velocity))))
        * math.sqrt(2.0 * math.log(velocity_width)),
    )


def _independent(power: FloatArray, samples: int) -> float:
    """Return the approximate number of independent values of a noise with this spectrum."""
    share = float(np.sum(power) ** 2 / (power.size * np.sum(power**2)))
    return max(2.0, share * samples)
