"""Compute the curves and figures of the pictures again from the recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from cdpr_rt.arrays import BoolArray, FloatArray, rms
from cdpr_rt.control.validation import low_pass_velocity
from cdpr_rt.identification.commissioning_results import Recording, recording
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.identification.result import HarmonicResult
from cdpr_rt.identification.thesis import DEGREE, GRID, ThesisResult, WINDOW_deg
from cdpr_tools.recordings.truth import Truth

_BINS = 720
_COMPARABLE = 0.5
"""Share of the turn that must be recorded twice to identify the part that repeats."""
_STANDING = 0.1
"""Share of the ramp's speed below which the rotor counts as standing."""
_SETTLING_rad = math.radians(60.0)


@dataclass(frozen=True)
class Ramp:
    """The judged part of one validation pass: arrays (k,) with the deviations that are judged."""

    time_s: FloatArray
    position_error_deg: FloatArray
    effort_Nm: FloatArray
    """Effort of the PID about its mean."""
    velocity_error_deg_s: FloatArray
    standing: float
    """Share of the time in which the rotor stood still."""


def read_ramp(path: Path, truth: Truth | None) -> Ramp:
    """Read one validation pass, on the true angle with `truth`; raises RawLogError."""
    log = read_raw_log(path)
    run = recording(log)
    sweep, judged = run.sweep, run.judged
    angle = sweep.angle_rad if truth is None else truth.angle_of(log, run)
    velocity = low_pass_velocity(angle, run.period_s)[judged]
    setpoint = sweep.setpoint_velocity_rad_s[judged]
    effort = run.effort_Nm[judged]
    return Ramp(
        time_s=np.asarray(np.arange(effort.size) * run.period_s, float),
        position_error_deg=np.degrees((sweep.setpoint_rad - angle)[judged]),
        effort_Nm=effort - effort.mean(),
        velocity_error_deg_s=np.degrees(velocity - setpoint),
        standing=float(np.mean(np.abs(velocity) < _STANDING * np.abs(setpoint))),
    )


@dataclass(frozen=True)
class ResidualEffort:
    """Remaining PID effort under compensation, one row per recorded direction."""

    forward: tuple[bool, ...]
    effort_Nm: FloatArray
    """Effort over the turn, about its mean, (d, m)."""
    amplitudes_Nm: FloatArray
    """Amplitudes of the effort's orders 1, 2, ... (d, k)."""
    rms_Nm: float
    repeating_rms_Nm: float | None
    """RMS of the part that repeats in the next turn; None if too little was recorded."""


def read_residual_effort(paths: Sequence[Path], orders: int) -> ResidualEffort:
    """Read the PID's residual effort in recorded passes up to an order; raises RawLogError."""
    curves, forward, products = [], [], []
    for path in paths:
        run = recording(read_raw_log(path))
        forward.append(float(run.sweep.setpoint_velocity_rad_s[run.judged][0]) > 0.0)
        last, seen = _over_angle(run, run.judged)
        curves.append(last - last.mean())
        first, before = _over_angle(run, _settled(run))
        both = seen & before
        if np.mean(both) > _COMPARABLE:
            products.append(np.mean((last * first)[both]))
    effort = np.array(curves)
    return ResidualEffort(
        forward=tuple(forward),
        effort_Nm=effort,
        amplitudes_Nm=np.abs(np.fft.rfft(effort, axis=1))[:, 1 : orders + 1] * 2.0 / _BINS,
        rms_Nm=rms(effort.ravel()),
        repeating_rms_Nm=math.sqrt(max(0.0, float(np.mean(products)))) if products else None,
    )


def _settled(run: Recording) -> BoolArray:
    """Mark the part of the lead-in at full speed in which the controller has settled."""
    speed = np.abs(run.sweep.setpoint_velocity_rad_s)
    steady = speed > (1.0 - 1e-6) * speed.max()
    first = np.flatnonzero(run.judged)[0]
    begun = np.flatnonzero(steady)[0]
    start = begun + round(_SETTLING_rad / speed.max() / run.period_s)
    place = np.arange(speed.size)
    return np.asarray(steady & (place >= start) & (place < first))


def _over_angle(run: Recording, chosen: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return the PID's effort about its mean in bins of the turn, and which bins have data."""
    if not chosen.any():
        return np.zeros(_BINS), np.zeros(_BINS, np.bool_)
    turn = run.sweep.angle_rad[chosen] / math.tau
    place = np.floor((turn - np.floor(turn)) * _BINS).astype(np.int64) % _BINS
    count = np.bincount(place, minlength=_BINS)
    effort = run.effort_Nm[chosen]
    total = np.bincount(place, effort - effort.mean(), _BINS)
    seen = np.asarray(count > 0)
    curve = np.interp(
        np.arange(_BINS), np.flatnonzero(seen), total[seen] / count[seen], period=_BINS
    )
    return np.asarray(curve), seen


def friction_Nm(harmonic: HarmonicResult, speed_rad_s: float) -> tuple[float, float]:
    """Return the model's friction torque at a steady speed with increasing, decreasing angle."""
    f = harmonic.friction
    fall = math.exp(-((speed_rad_s / f.stribeck_speed_rad_s) ** 2))
    viscous = f.viscous_Nms_rad * speed_rad_s
    return (
        f.coulomb_forward_Nm + f.stribeck_forward_Nm * fall + viscous,
        -(f.coulomb_backward_Nm + f.stribeck_backward_Nm * fall + viscous),
    )


@dataclass(frozen=True)
class TableError:
    """Deviation of the thesis' curve of one direction, about its mean, from the harmonic model."""

    peak_Nm: float
    peak_deg: float
    rms_Nm: float
    gain: float
    """Amplitude of the strongest order in the curve divided by the model's."""
    behind_deg: float
    """Motor angle by which that order lags, in the direction of motion."""


def table_errors(thesis: ThesisResult, harmonic: HarmonicResult) -> tuple[TableError, TableError]:
    """Compare the thesis' curves with the harmonic model, for each direction."""
    samples = thesis.curve_Nm.shape[1]
    model = harmonic.tables(samples)
    order = strongest_order(harmonic)
    turning = np.exp(-1j * order * np.arange(samples) * (math.tau / samples))
    errors = []
    for side, sign in ((0, 1.0), (1, -1.0)):
        error = thesis.variation_Nm[side] - model[side]
        worst = int(np.argmax(np.abs(error)))
        ratio = 1.0 + 0.0j
        if harmonic.harmonics:
            ratio = complex((thesis.variation_Nm[side] @ turning) / (model[side] @ turning))
        errors.append(
            TableError(
                peak_Nm=float(np.abs(error[worst])),
                peak_deg=worst * 360.0 / samples,
                rms_Nm=rms(error),
                gain=abs(ratio),
                behind_deg=-sign * math.degrees(math.atan2(ratio.imag, ratio.real)) / order,
            )
        )
    return errors[0], errors[1]


def strongest_order(harmonic: HarmonicResult) -> int:
    """Return the order with the largest amplitude, 1 if none was found."""
    if not harmonic.harmonics:
        return 1
    return max(harmonic.harmonics, key=lambda one: one.amplitude_Nm.value).order


def filter_gain(order: int) -> float:
    """Return the share of an order that the thesis' filter (degree 2, window of 5 deg) passes."""
    half = round(0.5 * WINDOW_deg / 360.0 * GRID)
    weights = scipy.signal.savgol_coeffs(2 * half + 1, DEGREE)
    return float(weights @ np.cos(math.tau * order * np.arange(-half, half + 1) / GRID))


def shift_deg(raw_Nm: FloatArray, order: int) -> float:
    """Return the shift between the curves of both directions, (2, m), in one order.

    It is positive if each curve lags in its direction of motion.
    """
    samples = raw_Nm.shape[1]
    turning = np.exp(-1j * order * np.arange(samples) * (math.tau / samples))
    forward, backward = raw_Nm @ turning
    phase = np.angle(backward * np.conj(forward))
    return math.degrees(float(phase)) / order
