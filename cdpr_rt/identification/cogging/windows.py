"""The rotor's equation of motion in weak form: one row for every short window of a run.

J·θ'' + cogging(θ) + friction(v) = torque is averaged with a smooth bump, the cubic B-spline of four
box averages. Two of the boxes turn the acceleration into a second difference of averaged angles, so
that the encoder's reading is never differentiated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.identification.cogging.sweep import SweepData, period_s
from cdpr_rt.jit import jit

IntArray = NDArray[np.intp]

_FAST_rad_s = np.deg2rad(30.0)
_QUICK_rad_s = 3.0
_STEP_rad = np.deg2rad(0.2)
_SHORTEST_s = 0.009
_LONGEST_s = 0.039
_FAST_STEP_s = 0.015
_QUICK_STEP_s = 0.006
_THIN_s = 0.003
_SMOOTHING_s = 0.004
_SMOOTHING = 3.6
_LEAST_NOISE_rad = 1e-6
_SMOOTHING_SPEED_rad_s = 0.3
_GAUSSIAN_WIDTH = 3.54
"""Independent values that a Gaussian filter averages, by its standard deviation: 2·sqrt(pi)."""
_SAMPLED = np.array([1.0, 10.0, 1.0]) / 12.0
_HELD = np.array([1.0, 6.0, 1.0]) / 8.0
"""Weights that turn averages over samples into those over time in the second difference: two boxes
of a cycle for sampled values, a third one for the torque, which is held over a cycle."""
_STANDING = 0.2
_RUNAWAY = 3.0
_SLOWEST_rad_s = 0.03
_RELAXED_rad = 0.02
_PLAY = 3.0
_QUASI_STATIC_rad_s = np.deg2rad(10.0)


@dataclass(frozen=True)
class Windows:
    """One run cut into windows; arrays are (r,) unless described otherwise.

    `angle_rad` and `velocity_rad_s` are samples, smoothed and thinned out: window i is their
    average with weights `bump` (4·stride,) from sample i·stride on.
    """

    angle_rad: FloatArray
    velocity_rad_s: FloatArray
    bump: FloatArray
    stride: int
    torque_Nm: FloatArray
    torque_rate_Nm_s: FloatArray
    acceleration_rad_s2: FloatArray
    centre_rad: FloatArray
    centre_s: FloatArray
    speed_rad_s: FloatArray
    """Mean velocity, signed."""
    direction: FloatArray
    """Its sign."""
    moving: BoolArray
    """Whether the rotor slides along with the set-point; in a sweep it may stick at moments."""
    quasi_static: bool
    """Whether it is a sweep, too slow for its friction to follow a curve."""
    fast: bool
    """Whether the set-point is fast enough to identify viscous friction."""
    quick: bool
    """Whether it is fast enough to identify the inertia in spite of the encoder's noise."""
    play_rad: float
    """Movements of the smoothed angle that may be noise."""
    cruise_rad_s: float
    """The run's highest set-point speed."""


def contiguous(runs: Sequence[SweepData]) -> list[SweepData]:
    """Split runs where the time jumps or the set-point turns around."""
    pieces = []
    for run in runs:
        step = np.diff(run.time_s)
        sign = np.sign(run.setpoint_velocity_rad_s)
        moving = np.flatnonzero(sign)
        turned = moving[1:][np.diff(sign[moving]) != 0]
        breaks = np.flatnonzero(np.abs(step - np.median(step)) > 0.5 * np.median(step)) + 1
        edges = np.unique(np.concatenate([[0], breaks, turned, [run.time_s.size]])).astype(int)
        for start, stop in pairwise(edges):
            if stop - start >= 100:
                pieces.append(SweepData(*(a[start:stop] for a in vars(run).values())))
    return pieces


def encoder_noise_rad(run: SweepData) -> float:
    """Return the standard deviation of the encoder's angle, rounding included.

    Third differences hardly contain motion: their variance is 20 times that of white noise.
    """
    return max(float(np.std(np.diff(run.angle_rad, 3))) / math.sqrt(20.0), _LEAST_NOISE_rad)


def _spacing(speed_rad_s: float) -> float:
    """Return the spacing of windows: short against the cogging's periods, long against noise."""
    if speed_rad_s > _QUICK_rad_s:
        return _QUICK_STEP_s
    if speed_rad_s > _FAST_rad_s:
        return _FAST_STEP_s
    return float(min(max(_STEP_rad / max(speed_rad_s, 1e-3), _SHORTEST_s), _LONGEST_s))


def _odd(x: float) -> int:
    return max(1, 2 * round((x - 1.0) / 2.0) + 1)


def cut(run: SweepData, latency_s: float, spacing_s: float | None = None) -> Windows | None:
    """Cut one contiguous run into windows, None where it is too short for any.

    `latency_s` is the time from the instant an angle was true to the mean instant at which the
    torque sent in that cycle acts: an angle belongs to the torque sent one latency earlier.
    `spacing_s` from window to window is chosen by the run's speed where it is not given.
    """
    period = period_s(run)
    speed = float(np.max(np.abs(run.setpoint_velocity_rad_s)))
    # thinning widens or narrows a window by its rounding: harmless where the motion is slow
    thin = _odd(_THIN_s / period) if speed < _QUASI_STATIC_rad_s and not spacing_s else 1
    spacing = spacing_s or _spacing(speed)
    stride = _odd(spacing / period / thin)
    step = stride * thin
    rows = (run.time_s.size - 1) // step - 4
    if rows < 1:
        return None
    ndimage = scipy.ndimage  # loaded on use: its import takes long
    noise = encoder_noise_rad(run)
    smoothing = _smoothing_s(noise, speed, period, 4.0 * spacing) / period
    angle, velocity = _smoothed(run, smoothing, period)
    centre = (np.arange(rows) + 2) * step + (thin - 1) // 2
    boxed = ndimage.uniform_filter1d(
        ndimage.uniform_filter1d(run.angle_rad - run.angle_rad[0], step), step
    )
    smooth_torque = _smoothed_torque(run, latency_s / period, step)
    mean = ndimage.uniform_filter1d(velocity, 2 * step + 1)[centre]
    quasi_static = speed < _QUASI_STATIC_rad_s
    turned, wanted = angle[centre] - angle[0], run.setpoint_velocity_rad_s[centre]
    return Windows(
        angle_rad=angle[(thin - 1) // 2 :: thin],
        velocity_rad_s=velocity[(thin - 1) // 2 :: thin],
        bump=_bump(stride, thin),
        stride=stride,
        torque_Nm=smooth_torque[centre],
        torque_rate_Nm_s=(smooth_torque[centre + 1] - smooth_torque[centre - 1]) / (2.0 * period),
        acceleration_rad_s2=(boxed[centre + step] - 2.0 * boxed[centre] + boxed[centre - step])
        / (step * period) ** 2,
        centre_rad=angle[centre],
        centre_s=run.time_s[centre],
        speed_rad_s=mean,
        direction=np.sign(mean),
        moving=_slides(mean, wanted, turned, quasi_static),
        quasi_static=quasi_static,
        fast=speed > _FAST_rad_s,
        quick=speed > _QUICK_rad_s,
        play_rad=_PLAY * noise / math.sqrt(max(1.0, 0.5 * smoothing * _GAUSSIAN_WIDTH)),
        cruise_rad_s=speed,
    )


def _smoothing_s(noise_rad: float, speed_rad_s: float, least_s: float, most_s: float) -> float:
    """Return the standard deviation of the filter of a run's deviation from its set-point."""
    quick = speed_rad_s > _QUICK_rad_s
    wanted_s = _SMOOTHING * noise_rad / (speed_rad_s if quick else _SMOOTHING_SPEED_rad_s)
    return min(max(wanted_s, least_s if quick else _SMOOTHING_s), most_s)


def _smoothed(run: SweepData, width: float, period: float) -> tuple[FloatArray, FloatArray]:
    """Return angle and velocity, the deviation from the set-point smoothed over cycles."""
    smooth = partial(scipy.ndimage.gaussian_filter1d, run.angle_rad - run.setpoint_rad)
    angle = run.setpoint_rad + smooth(0.5 * width, mode="nearest")
    drift = smooth(width, order=1, mode="nearest") / period
    return angle, run.setpoint_velocity_rad_s + drift


def _smoothed_torque(run: SweepData, latency: float, step: int) -> FloatArray:
    """Return the torque that acted, some cycles after it was sent, smoothed over windows."""
    cycle = np.arange(run.time_s.size)
    torque = np.convolve(np.interp(cycle - latency, cycle, run.torque_Nm), _HELD, mode="same")
    for _ in range(4):
        torque = scipy.ndimage.uniform_filter1d(torque, step)
    return torque


def _slides(
    speed: FloatArray, wanted: FloatArray, turned: FloatArray, quasi_static: bool
) -> BoolArray:
    """Return where a rotor that has `turned` slides along with its set-point, speeds in rad/s."""
    along = (speed * wanted > 0.0) & (np.abs(speed) > _STANDING * np.abs(wanted))
    if quasi_static:
        return np.asarray(along & (np.abs(speed) < _RUNAWAY * np.abs(wanted)), np.bool_)
    # the state of the friction before the slide is not known
    relaxed = np.abs(turned) > _RELAXED_rad
    return np.asarray(along & (np.abs(speed) > _SLOWEST_rad_s) & relaxed, np.bool_)


def _bump(stride: int, thin: int) -> FloatArray:
    """Return the weights of a window on thinned samples, (4·stride + 1,), centred at 2·stride."""
    box = np.ones(stride) / stride
    four = np.convolve(np.convolve(box, box), np.convolve(box, box))
    weights = np.zeros(4 * stride + 1)
    weights[2:-2] = four
    return np.convolve(weights, _SAMPLED, mode="same") if thin == 1 else weights


def average(values: FloatArray, windows: Windows, first: int, last: int) -> FloatArray:
    """Return the windows' averages of values given at the thinned samples, (rows, columns)."""
    out = np.zeros((last - first, values.shape[1]))
    _average(values, windows.bump, windows.stride, first, out)
    return out


def average_by_sign(values: FloatArray, windows: Windows, rows: IntArray, out: FloatArray) -> None:
    """Write some windows' averages of `values` (samples,) to the columns 0, where positive, and 1.

    The rest counts as zero.
    """
    _average_by_sign(values, windows.bump, windows.stride, rows, out)


@jit
def _average_by_sign(
    values: FloatArray, bump: FloatArray, stride: int, rows: IntArray, out: FloatArray
) -> None:
    last = values.size - 1
    for i in range(rows.size):
        start = rows[i] * stride
        above, below = 0.0, 0.0
        for k in range(bump.size):
            share = bump[k] * values[min(start + k, last)]
            if share > 0.0:
                above += share
            else:
                below += share
        out[i, 0], out[i, 1] = above, below


@jit
def _average(
    values: FloatArray, bump: FloatArray, stride: int, first: int, out: FloatArray
) -> None:
    last = values.shape[0] - 1
    for row in range(out.shape[0]):
        start = (first + row) * stride
        for k in range(bump.size):
            place = min(start + k, last)
            for column in range(out.shape[1]):
                out[row, column] += bump[k] * values[place, column]
