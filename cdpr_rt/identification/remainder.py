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
"""Windows near a sample, as a share of their mean number, for a value there."""
_BOTH = 0.5
"""Share of the turn that two turns must have in common to be compared."""
_UNKNOWN_SHARE = 0.5
_LEAST_VARIANCE = 1e-16


def remaining_curve(
    windows: Sequence[Windows], used: Sequence[IntArray], residual_Nm: FloatArray, lag_rad: float
) -> FloatArray:
    """Return the mean residual over the turn, (SAMPLES,), times the share of it that repeats.

    `used` are the rows of each run that the residuals belong to. The curve c̄ is the mean of the
    turns' curves c_t, weighted with their inverse variance. The linear estimate of least mean
    square error multiplies it by s/mean(c̄²), where s is the mean of c_t c_u over pairs of
    turns: noise does not repeat. If only one turn was recorded, s is unknown. Half of the curve is
    then the choice whose largest error over all s is least.
    """
    sums, counts, precision = _turns(windows, used, residual_Nm, lag_rad)
    seen = counts > _LEAST_SEEN * counts.mean(axis=1, keepdims=True)
    curves = np.where(seen, sums / np.maximum(counts, 1e-9), 0.0)
    weight = seen * precision[:, None]
    total = weight.sum(axis=0)
    mean = (weight * curves).sum(axis=0) / np.maximum(total, precision.min())
    pairs = total**2 - (weight**2).sum(axis=0)
    share, common = _UNKNOWN_SHARE, pairs > 0.0
    if common.mean() > _BOTH:
        products = (weight * curves).sum(axis=0) ** 2 - ((weight * curves) ** 2).sum(axis=0)
        repeated = float(products[common].sum() / pairs[common].sum())
        share = min(max(repeated / max(float((mean[common] ** 2).mean()), 1e-30), 0.0), 1.0)
    return np.asarray(share * (mean - mean.mean()))


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
