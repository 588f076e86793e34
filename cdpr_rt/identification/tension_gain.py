"""Identify the gain from cable tension to motor torque, and the winch's friction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cdpr_profiles.motor_bounds import MOST_GAIN_ERROR
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError
from cdpr_rt.identification.result import ConfidenceInterval

CONFIDENCE = 0.95
MOST_UNCERTAINTY = 0.05
"""Relative half-width of the gain above which a calibration is rejected."""
LEAST_LEVELS = 3
"""Smallest number of different tensions in each direction."""
LEAST_SPAN = 2.0
"""Smallest ratio of the highest to the lowest tension."""


class CalibrationRefusedError(ControlError):
    """The measurements do not support a calibration; the message gives the reason and a remedy."""


@dataclass(frozen=True)
class TorquePoint:
    """The winding torque at one tension, while or after the winch moved in one direction."""

    tension_N: float
    torque_Nm: float
    """Positive if it winds the cable in."""
    winding_in: bool
    angle_rad: float = math.nan
    """Motor angle if the torque was measured at one angle; nan if over whole turns."""


@dataclass(frozen=True)
class TensionGain:
    """Winding torque = gain·tension + bias ± (friction + friction_per_N·tension)."""

    gain_m: ConfidenceInterval
    bias_Nm: ConfidenceInterval
    friction_Nm: ConfidenceInterval
    friction_per_N_m: ConfidenceInterval
    residual_rms_Nm: float
    cogging_Nm: float
    """Amplitude of the cogging order that was also fitted, 0 without."""
    lowest_N: float
    highest_N: float


def identify_tension_gain(
    points: Sequence[TorquePoint], nominal_m: float, cogging_order: int | None = None
) -> TensionGain:
    """Fit both directions' lines through the points by least squares.

    The mean of the two slopes is the gain K_t by which tensions become torques (Tremblay, section
    3.6.2, after eq. (3.80)). Half their difference is the part of friction that grows with
    tension; half the difference of the intercepts is the constant part. Friction that differs
    between directions changes the bias, not the gain. With `cogging_order`, cogging of this
    number of periods per motor turn is fitted too, and the points are treated as a time series
    with correlated errors. Raises CalibrationRefusedError.
    """
    _refuse_few(points)
    tension = np.array([p.tension_N for p in points])
    torque = np.array([p.torque_Nm for p in points])
    side = np.array([1.0 if p.winding_in else -1.0 for p in points])
    columns = [tension, np.ones_like(tension), side, side * tension]
    if cogging_order is not None:
        angle = cogging_order * np.array([p.angle_rad for p in points])
        columns += [np.cos(angle), np.sin(angle)]
    time_series = cogging_order is not None
    found, half, rms = _least_squares(np.column_stack(columns), torque, time_series)
    gain, bias, friction, per_N = (
        ConfidenceInterval(float(found[i]), float(half[i])) for i in range(4)
    )
    result = TensionGain(
        gain,
        bias,
        friction,
        per_N,
        residual_rms_Nm=rms,
        cogging_Nm=float(np.hypot(*found[4:])) if cogging_order is not None else 0.0,
        lowest_N=float(tension.min()),
        highest_N=float(tension.max()),
    )
    _refuse_unsound(result, nominal_m)
    return result


def _least_squares(
    matrix: FloatArray, target: FloatArray, time_series: bool
) -> tuple[FloatArray, FloatArray, float]:
    """Return the solution, the half-widths of its confidence intervals and the residual's rms.

    In a `time_series` the effective number of samples is reduced by the residual's
    autocorrelation.
    """
    samples, unknowns = matrix.shape
    freedom = float(samples - unknowns)
    if freedom < 1.0:
        raise CalibrationRefusedError(
            f"{samples} measurements for {unknowns} unknowns; measure at more tensions"
        )
    scale = np.maximum(np.abs(matrix).max(axis=0), 1e-12)
    scaled = matrix / scale
    if np.linalg.cond(scaled) > 1e6:
        raise CalibrationRefusedError(
            "the measurements cannot separate gain, friction and cogging; use more "
            "tensions in a wider range"
        )
    solution, *_ = np.linalg.lstsq(scaled, target, rcond=None)
    residual = target - scaled @ solution
    if time_series:
        correlation = max(
            0.0, float(residual[1:] @ residual[:-1]) / max(1e-30, float(residual @ residual))
        )
        freedom = max(1.0, samples * (1.0 - correlation) / (1.0 + correlation) - unknowns)
    spread = float(residual @ residual) / freedom
    variance = spread * np.diag(np.linalg.inv(scaled.T @ scaled))
    width = float(scipy.special.stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * np.sqrt(variance)
    return solution / scale, width / scale, math.sqrt(float(np.mean(residual**2)))


def _refuse_few(points: Sequence[TorquePoint]) -> None:
    for winding_in, name in ((True, "winding in"), (False, "paying out")):
        levels = {round(p.tension_N, 1) for p in points if p.winding_in is winding_in}
        if len(levels) < LEAST_LEVELS:
            raise CalibrationRefusedError(
                f"{len(levels)} tensions were measured {name}; at least {LEAST_LEVELS} "
                "different ones are needed to separate gain and friction"
            )
        if max(levels) < LEAST_SPAN * min(levels):
            raise CalibrationRefusedError(
                f"the tensions measured {name} reach from {min(levels):.1f} to "
                f"{max(levels):.1f} N; "
                f"the highest must be at least {LEAST_SPAN:g} times the lowest"
            )


def _refuse_unsound(found: TensionGain, nominal_m: float) -> None:
    gain, half = found.gain_m.value, found.gain_m.half_width
    if gain <= 0.0:
        raise CalibrationRefusedError(
            f"torque falls with tension (gain {gain * 1e3:.2f} mNm/N); is cable_sign of the "
            "winch's profile right, and did the cable carry the load?"
        )
    if half > MOST_UNCERTAINTY * gain:
        raise CalibrationRefusedError(
            f"the gain is uncertain by {100 * half / gain:.1f} % ({gain * 1e3:.2f} ± "
            f"{half * 1e3:.2f} mNm/N), {100 * MOST_UNCERTAINTY:g} % are allowed; use a wider range "
            "of tensions, and let the motor turn further (whole turns, or a spring at the anchor)"
        )
    if abs(gain - nominal_m) > MOST_GAIN_ERROR * nominal_m:
        raise CalibrationRefusedError(
            f"the gain, {gain * 1e3:.2f} mNm/N, is {gain / nominal_m:.2f} times the geometry's "
            f"{nominal_m * 1e3:.2f} (drum_radius_m / gear_ratio); are gear ratio, drum radius, "
            "masses, sensor scale and the drive's torque_unit right?"
        )
    middle = 0.5 * (found.lowest_N + found.highest_N)
    friction = found.friction_Nm.value + found.friction_per_N_m.value * middle
    slack = found.friction_Nm.half_width + found.friction_per_N_m.half_width * middle
    if friction < -slack:
        raise CalibrationRefusedError(
            f"winding in takes less torque than paying out (friction {friction:.3f} Nm); is "
            "the sign of the torque or the cable wrong?"
        )
