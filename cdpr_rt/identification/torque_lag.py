"""The low-pass filter in a drive's torque reading: its removal, and its identification.

A reading y of the torque u with the time constant T obeys T·y' + y = u.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.harmonic_model import explained, weighing
from cdpr_rt.identification.result import ConfidenceInterval
from cdpr_rt.identification.windows import SweepData, contiguous, cut

_SHORTEST_s, _LONGEST_s = 0.002, 0.5
_CLOSE = 0.02
_CONFIDENCE = 1.96
_STEP = 0.1
MOST_RESIDUAL = 0.02


@dataclass(frozen=True)
class Reading:
    """Time in s, angle in rad and the drive's torque in Nm of one run, (k,) each."""

    time_s: FloatArray
    angle_rad: FloatArray
    torque_Nm: FloatArray


def without_lag(time_s: FloatArray, torque_Nm: FloatArray, lag_s: float) -> FloatArray:
    """Return the torque before the filter, (k,): sample i is the mean over the step before it."""
    if lag_s <= 0.0:
        return np.array(torque_Nm, float)
    kept = np.exp(-np.diff(time_s) / lag_s)
    steps = (torque_Nm[1:] - kept * torque_Nm[:-1]) / (1.0 - kept)
    return np.concatenate([torque_Nm[:1], steps])


def with_lag(time_s: FloatArray, torque_Nm: FloatArray, lag_s: float) -> FloatArray:
    """Return the filter's output for a torque that is constant over the step before a sample."""
    if lag_s <= 0.0:
        return np.array(torque_Nm, float)
    out = np.array(torque_Nm, float)
    kept = np.exp(-np.diff(time_s) / lag_s)
    for i in range(1, out.size):
        out[i] = kept[i - 1] * out[i - 1] + (1.0 - kept[i - 1]) * torque_Nm[i]
    return out


def resampled(reading: Reading, lag_s: float, period_s: float) -> SweepData:
    """Return a run at a constant rate without the filter, with a set-point of constant speed.

    The torque is averaged over the steps between the samples, so that no part of it is lost.
    """
    time = reading.time_s
    grid = np.arange(time[0], time[-1], period_s)
    angle = np.interp(grid, time, reading.angle_rad)
    torque = without_lag(time, reading.torque_Nm, lag_s)
    impulse = np.concatenate([[0.0], np.cumsum(torque[1:] * np.diff(time))])
    mean = np.gradient(np.interp(grid, time, impulse), period_s)
    speed, at_start = np.polyfit(grid - grid[0], angle, 1)
    setpoint = at_start + speed * (grid - grid[0])
    return SweepData(grid, angle, mean, setpoint, np.full(grid.size, speed))


@dataclass(frozen=True)
class FittedLag:
    """A filter found in recordings.

    `residual` is the share of squared torque that the harmonics do not explain, and `gain` the
    ratio of this residual to that without a filter. Stick-slip leaves too large a residual; the
    time constant is then not `reliable`.
    """

    lag_s: ConfidenceInterval
    residual: float
    gain: float

    @property
    def reliable(self) -> bool:
        """Whether the harmonics explain the torque well enough to show a filter."""
        return self.residual < MOST_RESIDUAL


def fit_torque_lag(readings: Sequence[Reading], period_s: float) -> FittedLag:
    """Return the filter's time constant.

    Hunting, both directions, or different speeds determine it, because with a wrong time constant
    the same angle has different torques.
    """

    def unexplained(lag_s: float) -> tuple[float, float]:
        runs = [resampled(reading, lag_s, period_s) for reading in readings]
        windows = [w for run in contiguous(runs) if (w := cut(run, 0.0)) is not None]
        return explained(weighing(windows))

    def cost(log_lag: float) -> float:
        share, _ = unexplained(math.exp(log_lag))
        return math.log(share)

    bounds = (math.log(_SHORTEST_s), math.log(_LONGEST_s))
    found = scipy.optimize.minimize_scalar(
        cost, bounds=bounds, method="bounded", options={"xatol": _CLOSE}
    )
    share, independent = unexplained(math.exp(found.x))
    beside = [cost(found.x + side * _STEP) for side in (-1.0, 1.0)]
    curvature = max(independent * (sum(beside) - 2.0 * math.log(share)) / _STEP**2, 1e-12)
    lag = math.exp(found.x)
    half_width = _CONFIDENCE * lag * math.sqrt(2.0 / curvature)
    return FittedLag(ConfidenceInterval(lag, half_width), share, share / unexplained(0.0)[0])
