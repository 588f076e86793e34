"""Gains of the motor's position loops from inertia, latency and wanted margins."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import PidGains
from cdpr_rt.errors import ControlError

ComplexArray = NDArray[np.complex128]

PHASE_MARGIN_deg = 50.0
GAIN_MARGIN_dB = 6.0
MAX_SENSITIVITY = 2.0
DERIVATIVE_FILTER_RATIO = 10.0
"""The derivative's filter pole lies at this multiple of the crossover frequency."""
INERTIA_RATIO = 50.0
"""Ratio of total to rotor inertia that a firm loop tolerates, e.g. with a mass on the cable."""
SWEEP_PHASE = 0.3
"""Phase in radians that the latency may take at the sweep's natural frequency."""
_MOST_FACTOR = 8.0


class TuningError(ControlError):
    """The requested loop is impossible with this motor and latency."""


@dataclass(frozen=True)
class PidDesign:
    """Gains and their performance on the rigid rotor with the whole latency."""

    gains: PidGains
    inertia_kg_m2: float
    latency_s: float
    bandwidth_Hz: float
    """Frequency at which the closed loop, set-point to angle, last falls through -3 dB."""
    crossover_Hz: float
    phase_margin_deg: float
    gain_margin_dB: float
    """Gain margin upwards: increase of the gain that makes the loop unstable."""
    gain_reduction_dB: float
    """Gain margin downwards: reduction of the gain at which integral action makes the loop
    unstable."""
    sensitivity_peak: float


def sweep_gain(inertia_kg_m2: float, latency_s: float) -> float:
    """Return the proportional gain of the cogging sweep, Nm/rad.

    Only friction damps the rotor under a proportional controller, and the latency feeds the
    oscillation by its phase sqrt(kp/J)·latency. The gain sets that phase to `SWEEP_PHASE`.
    """
    _check_positive(inertia_kg_m2=inertia_kg_m2, latency_s=latency_s)
    return inertia_kg_m2 * (SWEEP_PHASE / latency_s) ** 2


def loop_response(
    gains: PidGains, inertia_kg_m2: float, latency_s: float, period_s: float, omega: FloatArray
) -> ComplexArray:
    """Return the open loop's frequency response at `omega` (k,), rad/s.

    The controller is the sampled one, term by term; the plant 1/(J s²) is driven through a
    zero-order hold. `latency_s` is the time from the sampling of an angle to the middle of the
    cycle in which its torque acts, so it already includes half a period of the hold.
    """
    back = np.exp(-1j * omega * period_s)
    slope = (1.0 - back) / (gains.derivative_filter_s + period_s - gains.derivative_filter_s * back)
    control = (
        gains.proportional_Nm_rad
        + gains.integral_Nm_rad_s * period_s / (1.0 - back)
        + gains.derivative_Nms_rad * slope
    )
    hold = np.sinc(omega * period_s / (2.0 * math.pi))
    plant = -np.exp(-1j * omega * latency_s) * hold / (inertia_kg_m2 * omega**2)
    return np.asarray(control * plant, np.complex128)


def analyse(
    gains: PidGains, inertia_kg_m2: float, latency_s: float, period_s: float = 1e-3
) -> PidDesign:
    """Compute bandwidth and margins of a PID loop from its frequency response.

    Raises TuningError if the loop is unstable or has no crossover below half the rate.
    """
    top = 0.98 * math.pi / period_s
    omega = np.geomspace(1e-2, top, 6000)
    loop = loop_response(gains, inertia_kg_m2, latency_s, period_s, omega)
    size = np.log(np.abs(loop))
    phase = np.unwrap(np.angle(loop))
    phase -= 2.0 * math.pi * round((phase[0] + 1.5 * math.pi) / (2.0 * math.pi))
    crossing = _falling(omega, size, 0.0)
    if crossing is None:
        raise TuningError("the loop has no crossover below half the cycle rate")
    margin = math.pi + float(np.interp(crossing, omega, phase))
    above = omega > crossing
    below = ~above
    limit = _falling(omega[above], phase[above], -math.pi)
    gain = math.inf if limit is None else -float(np.interp(limit, omega, size))
    rising = np.flatnonzero((phase[below][:-1] < -math.pi) & (phase[below][1:] >= -math.pi))
    reduction = float(size[below][rising[-1]]) if rising.size else math.inf
    if margin <= 0.0 or gain <= 0.0:
        raise TuningError(
            f"the loop is not stable: phase margin {math.degrees(margin):.1f} deg at "
            f"{crossing / (2.0 * math.pi):.2f} Hz"
        )
    closed = np.abs(loop / (1.0 + loop))
    last = np.flatnonzero(closed >= math.sqrt(0.5))[-1]
    return PidDesign(
        gains=gains,
        inertia_kg_m2=inertia_kg_m2,
        latency_s=latency_s,
        bandwidth_Hz=float(omega[last]) / (2.0 * math.pi),
        crossover_Hz=crossing / (2.0 * math.pi),
        phase_margin_deg=math.degrees(margin),
        gain_margin_dB=20.0 * gain / math.log(10.0),
        gain_reduction_dB=20.0 * reduction / math.log(10.0),
        sensitivity_peak=float(np.max(1.0 / np.abs(1.0 + loop))),
    )


def stiffest_pid(
    inertia_kg_m2: float, latency_s: float, bandwidths_Hz: Sequence[float], period_s: float
) -> PidDesign:
    """Return the PID with the highest of the given bandwidths that keeps the margins.

    Raises TuningError, with the possible margins, if no bandwidth does.
    """
    for bandwidth in bandwidths_Hz[:-1]:
        with contextlib.suppress(TuningError):
            return design_pid(inertia_kg_m2, latency_s, bandwidth, period_s)
    return design_pid(inertia_kg_m2, latency_s, bandwidths_Hz[-1], period_s)


def standstill_gains(design: PidDesign, period_s: float) -> PidDesign:
    """Return a design with as much gain at standstill as `MAX_SENSITIVITY` allows.

    A rotor stands still if the stiffness of the loop exceeds the slope of its cogging. This trades
    phase margin for stiffness. The proportional gain grows by a factor, and the integral gain by
    the square of that factor. The loop must still tolerate `INERTIA_RATIO` times the inertia.
    """
    gains, inertia = design.gains, design.inertia_kg_m2

    def firmer(factor: float) -> PidDesign:
        proportional = factor * gains.proportional_Nm_rad
        # the slow part of the loop, J·s³ + kd·s² + kp·s + ki, is stable below kd·kp/J; half of it
        # is reserved for the latency
        most = gains.derivative_Nms_rad * proportional / (2.0 * INERTIA_RATIO * inertia)
        integral = min(factor * factor * gains.integral_Nm_rad_s, most)
        firm = replace(gains, proportional_Nm_rad=proportional, integral_Nm_rad_s=integral)
        return analyse(firm, inertia, design.latency_s, period_s)

    found, low, high = firmer(1.0), 1.0, _MOST_FACTOR
    for _ in range(12):
        middle = 0.5 * (low + high)
        try:
            firm = firmer(middle)
            bearable = firm.sensitivity_peak <= MAX_SENSITIVITY
        except TuningError:
            bearable = False
        if bearable and firm.gain_margin_dB >= GAIN_MARGIN_dB:
            found, low = firm, middle
        else:
            high = middle
    return found


def design_pid(
    inertia_kg_m2: float, latency_s: float, bandwidth_Hz: float, period_s: float = 1e-3
) -> PidDesign:
    """Design the PID of a free rotor for a wanted closed-loop bandwidth, by margins.

    The controller has a double real zero, a derivative filter `DERIVATIVE_FILTER_RATIO` above
    the crossover, and exactly `PHASE_MARGIN_deg` of phase margin: a wider margin would only cost
    integral gain. Raises TuningError, with the possible margins, if `GAIN_MARGIN_dB` or
    `MAX_SENSITIVITY` cannot be kept at that bandwidth.
    """
    _check_positive(
        inertia_kg_m2=inertia_kg_m2,
        latency_s=latency_s,
        bandwidth_Hz=bandwidth_Hz,
        period_s=period_s,
    )
    return _designed(inertia_kg_m2, latency_s, bandwidth_Hz, period_s)


@lru_cache(maxsize=64)
def _designed(
    inertia_kg_m2: float, latency_s: float, bandwidth_Hz: float, period_s: float
) -> PidDesign:
    low, high = 0.2 * bandwidth_Hz, 1.2 * bandwidth_Hz
    design = None
    for _ in range(40):
        middle = 0.5 * (low + high)
        design = _at_crossover(inertia_kg_m2, latency_s, middle, period_s)
        if design is None or design.bandwidth_Hz > bandwidth_Hz:
            high = middle
        else:
            low = middle
        if high - low < 1e-6 * bandwidth_Hz:
            break
    if (
        design is None
        or abs(design.bandwidth_Hz - bandwidth_Hz) > 0.01 * bandwidth_Hz
        or design.gain_margin_dB < GAIN_MARGIN_dB
        or design.sensitivity_peak > MAX_SENSITIVITY
    ):
        raise TuningError(
            f"a closed-loop bandwidth of {bandwidth_Hz:g} Hz is not possible with a phase "
            "margin of "
            f"{PHASE_MARGIN_deg:g} deg, a gain margin of {GAIN_MARGIN_dB:g} dB and a sensitivity "
            f"below {MAX_SENSITIVITY:g} at a latency of {latency_s * 1e3:.2f} ms; choose a "
            "lower one"
        )
    return design


def _at_crossover(
    inertia: float, latency: float, crossover_Hz: float, period: float
) -> PidDesign | None:
    """Return the loop with the wanted phase margin at that crossover, or None."""
    omega = 2.0 * math.pi * crossover_Hz
    filter_s = 1.0 / (DERIVATIVE_FILTER_RATIO * omega)
    at = np.array([omega])

    def gains(ratio: float, scale: float = 1.0) -> PidGains:
        # (s + z)²/s with z = omega/ratio; only the derivative is filtered
        zero = omega / ratio
        return PidGains(2.0 * zero * scale, zero * zero * scale, scale, filter_s)

    def margin(ratio: float) -> float:
        loop = loop_response(gains(ratio), inertia, latency, period, at)
        return math.degrees(float(np.angle(-loop[0])))

    low, high = 1.0, 200.0
    if margin(high) < PHASE_MARGIN_deg:
        return None
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if margin(middle) < PHASE_MARGIN_deg else (low, middle)
    size = float(np.abs(loop_response(gains(high), inertia, latency, period, at))[0])
    try:
        return analyse(gains(high, 1.0 / size), inertia, latency, period)
    except TuningError:
        return None


def _falling(x: FloatArray, y: FloatArray, level: float) -> float | None:
    """Return the x at which y last falls through the level, or None."""
    places = np.flatnonzero((y[:-1] >= level) & (y[1:] < level))
    if not places.size:
        return None
    i = int(places[-1])
    part = (y[i] - level) / (y[i] - y[i + 1])
    return float(x[i] + part * (x[i + 1] - x[i]))


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise TuningError(f"{name} = {value} must be positive")
