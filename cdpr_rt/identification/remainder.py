"""The part of the cogging that the chosen orders leave: a curve of residuals over the turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.windows import TWO_PI, IntArray, Windows

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
