"""Result of the harmonic model's identification, and the curve that its orders leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.identification.windows import TWO_PI, FrictionShape, IntArray, Windows

# An identified value with its confidence interval.


@dataclass(frozen=True)
class ConfidenceInterval:
    """value ± half_width contains the true value with 95 % confidence, both in the value's unit."""

    value: float
    half_width: float


@dataclass(frozen=True)
class Harmonic:
    """One order of the cogging: cosine·cos(order·θ) + sine·sin(order·θ), θ from the index."""

    order: int
    cosine_Nm: float
    sine_Nm: float
    amplitude_Nm: ConfidenceInterval
    phase_deg: ConfidenceInterval
    """Phase of amplitude·sin(order·θ + phase)."""
    per_pole_pair: float
    hint: str


@dataclass(frozen=True)
class HarmonicResult:
    """The identified motor; torques in the unit of sent torques, angles from the index."""

    harmonics: tuple[Harmonic, ...]
    friction: FrictionFeedforward
    shape: FrictionShape
    coulomb_forward_Nm: ConfidenceInterval
    coulomb_backward_Nm: ConfidenceInterval
    viscous_Nms_rad: ConfidenceInterval
    inertia_kg_m2: ConfidenceInterval
    inertia_measured: bool
    """Whether the inertia was measured; otherwise no run was fast enough and the given value was
    kept."""
    latency_s: ConfidenceInterval
    lag_rad: ConfidenceInterval
    """Static part of the lag: half the shift between the curves of the two directions."""
    pole_pairs: int
    slots: int | None
    """Slots of the stator, if known."""
    directions: tuple[int, ...]
    """Measured directions, 1 and -1. The friction of the other is assumed to be the same."""
    coverage: float
    """Share of the turn on which the rotor was sliding."""
    cogging_trend_1_s: float
    """Relative change of the cogging per second, as the motor warms up."""
    dropped_fraction: float
    """Share of the samples in pieces, between jumps of the time, that are too short for a fit."""
    excluded_fraction: float
    """Share of the windows in which the rotor stood still or turned against the ramp."""
    residual_rms_Nm: float
    error_by_orders_Nm: FloatArray
    """Residual (rms) with the 0, 1, 2, ... most significant orders, (k + 1,)."""
    remainder_Nm: FloatArray
    """Cogging that the orders leave, as samples over the turn; see `remaining_curve`."""

    @property
    def orders(self) -> tuple[int, ...]:
        """The identified orders, increasing."""
        return tuple(h.order for h in self.harmonics)

    @property
    def amplitudes_Nm(self) -> tuple[float, ...]:
        """The amplitude of each order."""
        return tuple(h.amplitude_Nm.value for h in self.harmonics)

    def cogging_Nm(self, angle_rad: FloatArray) -> FloatArray:
        """Return the torque that holds the rotor against the cogging, without lag."""
        out = at_angle(self.remainder_Nm, angle_rad)
        for h in self.harmonics:
            out += h.cosine_Nm * np.cos(h.order * angle_rad)
            out += h.sine_Nm * np.sin(h.order * angle_rad)
        return out

    def tables(self, m: int) -> FloatArray:
        """Return the cogging on m samples over the turn for both directions, (2, m)."""
        angle = np.linspace(0.0, TWO_PI, m, endpoint=False)
        lag = self.lag_rad.value
        return np.vstack([self.cogging_Nm(angle - lag), self.cogging_Nm(angle + lag)])


def likely_cause(order: int, pole_pairs: int, slots: int | None = None) -> str:
    """Return the usual cause of a cogging of this order, as text; `slots` is None if unknown."""
    poles = 2 * pole_pairs
    known = {
        2: "twice per turn: oval stator, bent shaft or coupling",
        1: "once per turn: eccentric rotor, encoder or coupling",
        poles: "twice per pole pair: unequal gains of the current sensors, or magnets",
        pole_pairs: "once per pole pair: offset of a current sensor, or unequal magnets",
    }
    if order in known:
        return known[order]
    by_slots = [
        (math.lcm(slots, poles), f"{slots} slots and {poles} poles: slots against magnets"),
        (slots, f"the {slots} slots: unequal magnets"),
        (poles, f"the {poles} poles: unequal slots"),
        (pole_pairs, "the pole pairs: unequal poles, or the back EMF's shape"),
    ] if slots else [
        (6 * pole_pairs, "six per pole pair: slots against magnets, or the back EMF's shape"),
        (pole_pairs, "the pole pairs: slots against magnets"),
    ]  # fmt: skip
    for period, cause in by_slots:
        if order % period == 0:
            return f"a multiple of {cause}"
    also = " or slots" if slots else ""
    return f"no multiple of the pole pairs{also}: unequal slots or magnets, or a coupled part"


# The part of the cogging that the chosen orders leave: a curve of residuals over the turn.

SAMPLES = 1440
"""Samples of the curve over a turn."""
_WIDTH = 2.0
"""Standard deviation of the smoothing, in samples; the windows are a little wider."""
_LEAST_SEEN = 0.05
"""Number of windows near a sample that its value requires, as a share of the mean number."""
_BOTH = 0.5
"""Share of the turn that two turns must have in common to be compared."""
_LEAST_SHARE = 0.5
"""Share that is kept of the curve of a single turn if noise might explain all of it."""
_LEAST_VARIANCE = 1e-16


def remaining_curve(
    windows: Sequence[Windows], used: Sequence[IntArray], residual_Nm: FloatArray, lag_rad: float
) -> FloatArray:
    """Return the mean residual over the turn, (SAMPLES,), times the share of it that repeats.

    `used` are the rows of each run that the residuals belong to. The curve c̄ is the mean of the
    turns' curves c_t, weighted with their inverse variance. The linear estimate of least mean
    square error multiplies it by s/mean(c̄²), where s is the mean of c_t c_u over pairs of
    turns: noise does not repeat. If only one turn was recorded, s is unknown. Half of the curve is
    then the choice whose largest error over all s is least. More of it is kept if independent noise
    of the windows explains only a small share of it, see `_share_of_one_turn`.
    """
    sums, counts, precision = _turns(windows, used, residual_Nm, lag_rad)
    seen = counts > _LEAST_SEEN * counts.mean(axis=1, keepdims=True)
    curves = np.where(seen, sums / np.maximum(counts, 1e-9), 0.0)
    weight = seen * precision[:, None]
    total = weight.sum(axis=0)
    mean = (weight * curves).sum(axis=0) / np.maximum(total, precision.min())
    pairs = total**2 - (weight**2).sum(axis=0)
    common = pairs > 0.0
    if common.mean() <= _BOTH:
        noise = _noise_variance(used, residual_Nm, counts.sum(axis=0)[total > 0.0])
        share = _share_of_one_turn(noise, float((mean**2).mean()))
    else:
        products = (weight * curves).sum(axis=0) ** 2 - ((weight * curves) ** 2).sum(axis=0)
        repeated = float(products[common].sum() / pairs[common].sum())
        share = min(max(repeated / max(float((mean[common] ** 2).mean()), 1e-30), 0.0), 1.0)
    return np.asarray(share * (mean - mean.mean()))


def _share_of_one_turn(noise: float, variance: float) -> float:
    """Return the share of a curve of one turn that is used; `noise` is part of its variance.

    If the share s of a curve repeats, a share k of it has the error s (1 - k)² + (1 - s) k². It is
    less than 1 - s, the error of the whole curve, if k > 2 s - 1.
    """
    most = 1.0 - noise / max(variance, _LEAST_VARIANCE)
    return min(max(2.0 * most - 1.0, _LEAST_SHARE), 1.0)


def _noise_variance(used: Sequence[IntArray], residual_Nm: FloatArray, counts: FloatArray) -> float:
    """Return the variance of the smoothed curve due to noise that rows do not have in common.

    `counts` are numbers of windows at samples; Gaussian smoothing averages 2 √π σ of them. Windows
    overlap by half, so that neighbours are correlated with 1/2. White noise of variance v then has
    second differences of variance 2 v, which hardly contain the curve, and a mean of m rows has the
    variance 2 v/m.
    """
    squares, first = [np.zeros(0)], 0
    for rows in used:
        left = residual_Nm[first : first + rows.size]
        first += rows.size
        bend = left[2:] - 2.0 * left[1:-1] + left[:-2]
        squares.append(bend[rows[2:] - rows[:-2] == 2] ** 2)
    each = float(np.concatenate(squares).sum()) / max(sum(part.size for part in squares), 1)
    averaged = 2.0 * np.sqrt(np.pi) * _WIDTH * np.maximum(counts, 1e-9)
    return each * float(np.mean(1.0 / averaged))


def _turns(
    windows: Sequence[Windows], used: Sequence[IntArray], residual_Nm: FloatArray, lag_rad: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return smoothed sums of residuals and numbers of windows, (t, SAMPLES), and 1/σ² (t,)."""
    sums, counts, precision, first = [], [], [], 0
    for w, rows in zip(windows, used, strict=True):
        angle = w.centre_rad[rows] - lag_rad * w.direction[rows]
        left = residual_Nm[first : first + rows.size]
        first += rows.size
        turn = np.floor(np.abs(angle - w.centre_rad[0]) / TWO_PI).astype(int)
        place = np.floor(np.mod(angle / TWO_PI, 1.0) * SAMPLES).astype(int) % SAMPLES
        for one in np.unique(turn):
            mine = turn == one
            sums.append(_smoothed_sum(place[mine], left[mine]))
            counts.append(_smoothed_sum(place[mine], np.ones(place[mine].size)))
            precision.append(1.0 / max(float(np.mean(left[mine] ** 2)), _LEAST_VARIANCE))
    return np.array(sums), np.array(counts), np.array(precision)


def _smoothed_sum(place: IntArray, values: FloatArray) -> FloatArray:
    """Return the smoothed sums of the values at each sample, (SAMPLES,)."""
    sums = np.bincount(place, values, SAMPLES).astype(float)
    # scipy.ndimage is loaded on use: its import takes long
    return np.asarray(scipy.ndimage.gaussian_filter1d(sums, _WIDTH, mode="wrap"))


def at_angle(curve_Nm: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Return the curve at angles of any size; the middle of sample k is at (k + 1/2)/SAMPLES."""
    place = np.mod(np.asarray(angle_rad, float) / TWO_PI, 1.0) * curve_Nm.size
    around = np.concatenate([curve_Nm[-1:], curve_Nm, curve_Nm[:1]])
    return np.asarray(np.interp(place, np.arange(-0.5, curve_Nm.size + 1.0), around))
