"""The rotor's equation of motion in weak form: one row for every short window of a run.

J·θ'' + cogging(θ) + friction(v) = torque is averaged with a smooth bump, the cubic B-spline of four
box averages. Two of the boxes turn the acceleration into a second difference of averaged angles, so
that the encoder's reading is never differentiated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.errors import ControlError
from cdpr_rt.jit import jit

# Recorded runs that identification works on.

TWO_PI = 2.0 * math.pi
_SHORTEST_TURNS = 0.98
_SHORTEST_S = 0.25


class IdentificationError(ControlError):
    """The recorded runs do not determine the wanted values; the message says what is missing."""


@dataclass(frozen=True)
class SweepData:
    """One recorded run; all arrays have shape (k,), one entry per cycle.

    `angle_rad` is measured from the encoder index and unwrapped; `torque_Nm` is the torque sent in
    that cycle, after quantisation; the set-point's position is on the angle's scale.
    """

    time_s: FloatArray
    angle_rad: FloatArray
    torque_Nm: FloatArray
    setpoint_rad: FloatArray
    setpoint_velocity_rad_s: FloatArray


@dataclass(frozen=True)
class Stretch:
    """Samples of one run at one constant set-point velocity: from `start` up to `stop`."""

    run: SweepData
    start: int
    stop: int
    velocity_rad_s: float

    @property
    def direction(self) -> int:
        """+1 for increasing angles, -1 for decreasing ones."""
        return 1 if self.velocity_rad_s > 0.0 else -1

    @property
    def turns(self) -> float:
        """Travel of the set-point in turns."""
        time = self.run.time_s
        lasted_s = time[self.stop - 1] - time[self.start] + period_s(self.run)
        return float(lasted_s * abs(self.velocity_rad_s) / TWO_PI)

    def last_whole_turns(self) -> Stretch | None:
        """Return the last whole turns of the stretch, None if it has no whole turn."""
        whole = math.floor(self.turns + 1.0 - _SHORTEST_TURNS)
        if whole < 1:
            return None
        time, period = self.run.time_s, period_s(self.run)
        lasts_s = whole * TWO_PI / abs(self.velocity_rad_s)
        begin_s = time[self.stop - 1] - lasts_s + 0.5 * period
        start = max(self.start, int(np.searchsorted(time, begin_s)))
        return Stretch(self.run, start, self.stop, self.velocity_rad_s)


def period_s(run: SweepData) -> float:
    """Return the cycle time of a run."""
    return float(np.median(np.diff(run.time_s)))


def check_runs(runs: Sequence[SweepData]) -> None:
    """Raise IdentificationError for runs that are empty, ragged or not finite."""
    if not runs:
        raise IdentificationError("no recorded run was given")
    for number, run in enumerate(runs):
        sizes = {name: array.size for name, array in vars(run).items()}
        if len(set(sizes.values())) != 1 or run.time_s.size < 100:
            raise IdentificationError(f"run {number}: lengths {sizes} must be equal and over 100")
        for name, array in vars(run).items():
            if not np.all(np.isfinite(array)):
                raise IdentificationError(f"run {number}: {name} holds values that are not finite")


def stretches(runs: Sequence[SweepData]) -> list[Stretch]:
    """Return all stretches of constant set-point velocity, in the order of the runs."""
    found = []
    for run in runs:
        v = run.setpoint_velocity_rad_s
        steady = np.concatenate([[False], np.abs(np.diff(v)) < 1e-9, [False]])
        edges = np.flatnonzero(np.diff(steady.astype(np.int8)))
        for start, stop in zip(edges[::2], edges[1::2] + 1, strict=True):
            if v[start] != 0.0 and (stop - start) * period_s(run) >= _SHORTEST_S:
                found.append(Stretch(run, int(start), int(stop), float(v[start])))
    return found


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
"""Independent values in a Gaussian filter per standard deviation: 2·sqrt(pi)."""
_SAMPLED = np.array([1.0, 10.0, 1.0]) / 12.0
_HELD = np.array([1.0, 6.0, 1.0]) / 8.0
"""Weights that convert averages over samples to averages over time in the second difference: two
boxes of a cycle for sampled values, a third one for the torque, which is held over a cycle."""
_STANDING = 0.2
_RUNAWAY = 3.0
_SLOWEST_rad_s = 0.03
_RELAXED_rad = 0.02
_PLAY = 3.0
_QUASI_STATIC_rad_s = np.deg2rad(10.0)
_CLEAR = 5.0
"""Ratio of acceleration to its encoder noise, above which the noise hardly biases the inertia."""


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
    """Sign of the mean velocity."""
    moving: BoolArray
    """Whether the rotor slides along with the set-point; in a sweep it may stick for moments."""
    quasi_static: bool
    """Whether the run is a sweep, too slow for its friction to follow a curve."""
    fast: bool
    """Whether the set-point is fast enough to identify viscous friction."""
    quick: bool
    """Whether the run is fast enough to identify the inertia despite the encoder's noise."""
    weighs: bool
    """Whether the inertia's torque is fitted on this run; elsewhere a known inertia is used."""
    swings: bool
    """Whether the rotor's acceleration is large compared with the encoder's noise in it."""
    play_rad: float
    """Largest movement of the smoothed angle that may be noise."""
    cruise_rad_s: float
    """The run's highest set-point speed."""

    @cached_property
    def average(self) -> Any:
        """The sparse matrix (r, samples) whose product with samples are the windows' averages."""
        rows, last = self.torque_Nm.size, self.angle_rad.size - 1
        places = np.arange(rows)[:, None] * self.stride + np.arange(self.bump.size)
        first = np.arange(rows + 1) * self.bump.size
        weights = np.tile(self.bump, rows), np.minimum(places, last).ravel(), first
        return scipy.sparse.csr_array(weights, shape=(rows, last + 1))


def contiguous(runs: Sequence[SweepData]) -> list[SweepData]:
    """Split runs at jumps of time and at reversals of the set-point."""
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
    """Return the standard deviation of the encoder's angle, including rounding.

    Third differences hardly contain motion: their variance is 20 times that of white noise.
    """
    return max(float(np.std(np.diff(run.angle_rad, 3))) / math.sqrt(20.0), _LEAST_NOISE_rad)


def _spacing(speed_rad_s: float) -> float:
    """Return the spacing of windows: short enough to show cogging, long enough to reduce noise."""
    if speed_rad_s > _QUICK_rad_s:
        return _QUICK_STEP_s
    if speed_rad_s > _FAST_rad_s:
        return _FAST_STEP_s
    return float(min(max(_STEP_rad / max(speed_rad_s, 1e-3), _SHORTEST_s), _LONGEST_s))


def _odd(x: float) -> int:
    return max(1, 2 * round((x - 1.0) / 2.0) + 1)


def cut(run: SweepData, latency_s: float, spacing_s: float | None = None) -> Windows | None:
    """Cut one contiguous run into windows; None if it is too short for a window.

    `latency_s` is the time from the sampling of an angle to the mean time at which the torque sent
    in that cycle acts. So an angle belongs to the torque sent one latency earlier. `spacing_s` is
    the distance of windows; by default it depends on the run's speed.
    """
    period = period_s(run)
    speed = float(np.max(np.abs(run.setpoint_velocity_rad_s)))
    # thinning changes a window's width by rounding, which is harmless if the motion is slow
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
    acceleration = boxed[centre + step] - 2.0 * boxed[centre] + boxed[centre - step]
    acceleration /= (step * period) ** 2
    noise_acceleration = 2.0 * noise / math.sqrt(step) / (step * period) ** 2
    quasi_static = speed < _QUASI_STATIC_rad_s
    turned, wanted = angle[centre] - angle[0], run.setpoint_velocity_rad_s[centre]
    return Windows(
        angle_rad=angle[(thin - 1) // 2 :: thin],
        velocity_rad_s=velocity[(thin - 1) // 2 :: thin],
        bump=_bump(stride, thin),
        stride=stride,
        torque_Nm=smooth_torque[centre],
        torque_rate_Nm_s=(smooth_torque[centre + 1] - smooth_torque[centre - 1]) / (2.0 * period),
        acceleration_rad_s2=acceleration,
        centre_rad=angle[centre],
        centre_s=run.time_s[centre],
        speed_rad_s=mean,
        direction=np.sign(mean),
        moving=_slides(mean, wanted, turned, quasi_static),
        quasi_static=quasi_static,
        fast=speed > _FAST_rad_s,
        quick=speed > _QUICK_rad_s,
        weighs=speed > _QUICK_rad_s,
        swings=not quasi_static and bool(np.std(acceleration) > _CLEAR * noise_acceleration),
        play_rad=_PLAY * noise / math.sqrt(max(1.0, 0.5 * smoothing * _GAUSSIAN_WIDTH)),
        cruise_rad_s=speed,
    )


def _smoothing_s(noise_rad: float, speed_rad_s: float, least_s: float, most_s: float) -> float:
    """Return the standard deviation of the filter for the deviation from the set-point."""
    quick = speed_rad_s > _QUICK_rad_s
    wanted_s = _SMOOTHING * noise_rad / (speed_rad_s if quick else _SMOOTHING_SPEED_rad_s)
    return min(max(wanted_s, least_s if quick else _SMOOTHING_s), most_s)


def _smoothed(run: SweepData, width: float, period: float) -> tuple[FloatArray, FloatArray]:
    """Return angle and velocity, with the deviation from the set-point smoothed over cycles."""
    smooth = partial(scipy.ndimage.gaussian_filter1d, run.angle_rad - run.setpoint_rad)
    angle = run.setpoint_rad + smooth(0.5 * width, mode="nearest")
    drift = smooth(width, order=1, mode="nearest") / period
    return angle, run.setpoint_velocity_rad_s + drift


def _smoothed_torque(run: SweepData, latency: float, step: int) -> FloatArray:
    """Return the torque when it acts, some cycles after sending, smoothed over windows."""
    cycle = np.arange(run.time_s.size)
    torque = np.convolve(np.interp(cycle - latency, cycle, run.torque_Nm), _HELD, mode="same")
    for _ in range(4):
        torque = scipy.ndimage.uniform_filter1d(torque, step)
    return torque


def _slides(
    speed: FloatArray, wanted: FloatArray, turned: FloatArray, quasi_static: bool
) -> BoolArray:
    """Return where a rotor that has `turned` slides with its set-point; speeds in rad/s."""
    along = (speed * wanted > 0.0) & (np.abs(speed) > _STANDING * np.abs(wanted))
    if quasi_static:
        return np.asarray(along & (np.abs(speed) < _RUNAWAY * np.abs(wanted)), np.bool_)
    # the friction's state before the slide is unknown
    relaxed = np.abs(turned) > _RELAXED_rad
    return np.asarray(along & (np.abs(speed) > _SLOWEST_rad_s) & relaxed, np.bool_)


def _bump(stride: int, thin: int) -> FloatArray:
    """Return the weights of a window on thinned samples, (4·stride + 1,), centred at 2·stride."""
    box = np.ones(stride) / stride
    four = np.convolve(np.convolve(box, box), np.convolve(box, box))
    weights = np.zeros(4 * stride + 1)
    weights[2:-2] = four
    return np.convolve(weights, _SAMPLED, mode="same") if thin == 1 else weights


# The friction curve's shape: Stribeck speed and height, and its relaxation length. Friction
# follows its steady curve g(v) = 1 + rise·exp(-(v/speed)²), relative to Coulomb friction, only
# after a short sliding distance, as in the LuGre model (Canudas de Wit et al., 1995). Over a
# distance dx it moves towards sign(dx)·g by the share 1 - exp(-|dx|/(length·g)). This describes
# both stick-slip and sliding.

_LOWEST = (0.003, 0.02, 2e-4)
_HIGHEST = (1.5, 2.0, 2e-2)
_INSIDE = 1e-3
_STEPS = 15
_FIRST_STEP = 0.3
_DIFFERENCE = 3e-3
_CLOSE = 1e-4
_SPREAD_OF_MEDIAN = 1.4826
_LEAST_SPREAD_Nm = 2e-4
_TAIL = 2.5


@dataclass(frozen=True)
class FrictionShape:
    """Shape of the curve: relative rise at standstill, Stribeck speed, relaxation length."""

    rise: float = 0.25
    speed_rad_s: float = 0.2
    way_rad: float = 4e-3


STARTS = (FrictionShape(0.3, 0.1, 3e-3), FrictionShape(0.3, 0.4, 3e-3))


@jit
def _slide(angle: FloatArray, play: float, out: FloatArray) -> None:
    place = angle[0]
    out[0] = 0.0
    for i in range(1, angle.size):
        before = place
        place = min(max(place, angle[i] - play), angle[i] + play)
        out[i] = place - before


@jit
def _develop(state: float, slid: FloatArray, height: FloatArray, out: FloatArray) -> None:
    """Relax the friction step by step; `out` (k,) holds the decay factors, then the friction."""
    for i in range(out.size):
        goal = height[i] if slid[i] > 0.0 else -height[i]
        out[i] = state = goal + (state - goal) * out[i]


def sliding(angle: FloatArray, play: float) -> FloatArray:
    """Return the sliding distance before each sample of a motion, signed; arrays (k,).

    Movements within `play` in both directions count as encoder noise, which would otherwise
    relax the friction.
    """
    out = np.empty_like(angle)
    _slide(angle, play, out)
    return out


def relative_friction(slid: FloatArray, velocity: FloatArray, shape: FrictionShape) -> FloatArray:
    """Return friction over Coulomb friction along a motion, signed; all arrays (k,)."""
    height = 1.0 + shape.rise * np.exp(-((velocity / shape.speed_rad_s) ** 2))
    out: FloatArray = np.exp(-np.abs(slid) / (shape.way_rad * height))
    _develop(1.0 if velocity[0] > 0.0 else -1.0, slid, height, out)
    return out


@dataclass(frozen=True)
class FrictionRun:
    """One run for the search of the shape: windows, torque without cogging and inertia."""

    windows: Windows
    torque_Nm: FloatArray
    rows: IntArray

    @cached_property
    def speed_rad_s(self) -> FloatArray:
        """Mean velocity in each of the rows."""
        return np.asarray((self.windows.average @ self.windows.velocity_rad_s)[self.rows])

    @cached_property
    def slid_rad(self) -> FloatArray:
        """Sliding distance before each sample; see `sliding`."""
        return sliding(self.windows.angle_rad, self.windows.play_rad)

    def regressors(self, shape: FrictionShape) -> FloatArray:
        """Return forward friction, backward friction and velocity of the rows, (rows, 3)."""
        friction = relative_friction(self.slid_rad, self.windows.velocity_rad_s, shape)
        both = np.column_stack([np.maximum(friction, 0.0), np.minimum(friction, 0.0)])
        return np.column_stack([(self.windows.average @ both)[self.rows], self.speed_rad_s])


def fit_shape(
    motions: Sequence[FrictionRun], starts: Sequence[FrictionShape] = STARTS
) -> FrictionShape:
    """Return the shape whose friction, with viscosity, leaves the smallest error.

    Separable least squares: each step solves for the linear coefficients. Each run has a separate
    noise level and Huber weights, so that a run with hunting does not dominate. The search
    begins at each of `starts`.
    """
    # logarithms start at one below the lowest, so that the steps of differences are never zero
    origin = np.log(_LOWEST) - 1.0
    low, high = np.ones(3), np.log(_HIGHEST) - origin
    weights = [
        huber_weights(_residuals([m], [np.ones(m.rows.size)], starts[0])[0]) for m in motions
    ]

    def weighted(point: FloatArray) -> FloatArray:
        residuals = _residuals(motions, weights, _shape(point + origin))
        return np.concatenate([np.sqrt(w) * r for w, r in zip(weights, residuals, strict=True)])

    points = [np.log((s.rise, s.speed_rad_s, s.way_rad)) - origin for s in starts]
    for _ in range(2):
        found = [
            scipy.optimize.least_squares(
                weighted,
                np.clip(point, low + _INSIDE, high - _INSIDE),
                bounds=(low, high),
                x_scale=_FIRST_STEP,
                diff_step=[_DIFFERENCE] * 3,
                ftol=_CLOSE,
                xtol=_CLOSE,
                gtol=None,
                max_nfev=_STEPS,
            )
            for point in points
        ]
        points = [min(found, key=lambda f: float(f.cost)).x]
        shape = _shape(points[0] + origin)
        weights = [huber_weights(r) for r in _residuals(motions, weights, shape)]
    return shape


def _shape(logarithms: FloatArray) -> FrictionShape:
    return FrictionShape(*(float(v) for v in np.exp(logarithms)))


def huber_weights(residual: FloatArray, least_spread: float = _LEAST_SPREAD_Nm) -> FloatArray:
    """Return Huber's weights over the squared spread of the residuals."""
    size = np.abs(residual)
    spread = max(_SPREAD_OF_MEDIAN * float(np.median(size)), least_spread)
    return np.asarray(np.minimum(1.0, _TAIL * spread / np.maximum(size, 1e-12)) / spread**2)


def _residuals(
    motions: Sequence[FrictionRun], weights: Sequence[FloatArray], shape: FrictionShape
) -> list[FloatArray]:
    """Return each run's errors after solving for the linear coefficients."""
    xs = [motion.regressors(shape) for motion in motions]
    parts = list(zip(xs, motions, weights, strict=True))
    gram = np.sum([(x.T * w) @ x for x, _, w in parts], axis=0)
    right = np.sum([(x.T * w) @ m.torque_Nm for x, m, w in parts], axis=0)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    beta = np.linalg.solve(gram / np.outer(size, size) + 1e-9 * np.eye(3), right / size) / size
    return [m.torque_Nm - x @ beta for x, m, _ in parts]


# Design matrix of the regression over windows, and its normal equations by kind of row.

_CHUNK, _WAVES = 1024, 256
_DESIGN_QUICK_rad_s = 1.0

INERTIA, LATENCY = 0, 1
COULOMB = 2  # forward, backward
VISCOUS = 4
CREEP = 5  # forward, backward
FIXED = 7


@dataclass(frozen=True)
class ColumnLayout:
    """Order of the columns: the fixed ones, then cosine and sine of each order."""

    orders: tuple[int, ...]
    shape: FrictionShape

    @property
    def columns(self) -> int:
        """Number of columns."""
        return FIXED + 2 * len(self.orders)

    def order(self, which: int) -> list[int]:
        """Return the columns, cosine and sine, of one order."""
        return [FIXED + 2 * which, FIXED + 2 * which + 1]


@dataclass(frozen=True)
class Normal:
    """Sums over rows: X'X (..., p, p), X'y (..., p), y'y (...) and the number of rows (...)."""

    xx: FloatArray
    xy: FloatArray
    yy: FloatArray
    rows: FloatArray

    def weighted(self, weight: FloatArray) -> Normal:
        """Return the sum over the parts along the first axis, each times its weight.

        The number of rows is that of the parts with a weight.
        """
        return Normal(
            np.tensordot(weight, self.xx, 1),
            weight @ self.xy,
            np.asarray(weight @ self.yy),
            np.asarray((weight > 0.0) @ self.rows),
        )


def _harmonics(windows: Windows, orders: Sequence[int], first: int, last: int) -> FloatArray:
    """Return the windows' averages of cosines and sines, (last - first, 2 orders)."""
    out = np.zeros((last - first, 2 * len(orders)))
    if not orders:
        return out
    for begin in range(first, last, _WAVES):  # in parts, because all waves together are large
        end = min(begin + _WAVES, last)
        samples = slice(begin * windows.stride, (end + 4) * windows.stride)
        wave = np.exp(1j * windows.angle_rad[samples, None])
        waves = np.cumprod(np.repeat(wave, max(orders), axis=1), axis=1)[:, np.array(orders) - 1]
        means = windows.average[begin:end, samples] @ waves
        out[begin - first : end - first, ::2] = means.real
        out[begin - first : end - first, 1::2] = means.imag
    return out


def matrix(windows: Windows, layout: ColumnLayout, first: int, last: int) -> FloatArray:
    """Return the regression's columns for windows `first` up to `last`, (last - first, columns)."""
    rows = slice(first, last)
    out = np.zeros((last - first, layout.columns))
    out[:, FIXED:] = _harmonics(windows, layout.orders, first, last)
    if windows.quasi_static:
        out[:, CREEP] = np.maximum(windows.direction[rows], 0.0)
        out[:, CREEP + 1] = np.minimum(windows.direction[rows], 0.0)
        return out
    if windows.weighs:
        out[:, INERTIA] = windows.acceleration_rad_s2[rows]
    out[:, LATENCY] = windows.torque_rate_Nm_s[rows] * (
        np.abs(windows.speed_rad_s[rows]) > _DESIGN_QUICK_rad_s
    )
    slid = sliding(windows.angle_rad, windows.play_rad)
    friction = relative_friction(slid, windows.velocity_rad_s, layout.shape)
    values = (np.maximum(friction, 0.0), np.minimum(friction, 0.0), windows.velocity_rad_s)
    out[:, COULOMB : VISCOUS + 1] = windows.average[rows] @ np.column_stack(values)
    return out


def kinds(windows: Sequence[Windows]) -> list[FloatArray]:
    """Number the kinds of rows by the speed of their run, which noise depends on; -1: left out."""
    speeds = sorted({round(float(np.rad2deg(w.cruise_rad_s)), 1) for w in windows})
    numbered = []
    for w in windows:
        kind = speeds.index(round(float(np.rad2deg(w.cruise_rad_s)), 1))
        numbered.append(np.where(w.moving, kind, -1))
    return numbered


def accumulate(windows: Sequence[Windows], layout: ColumnLayout) -> Normal:
    """Sum the normal equations of all runs for each kind of row, in chunks of bounded memory."""
    kind = kinds(windows)
    count = 1 + max((int(one.max(initial=-1)) for one in kind), default=-1)
    p = layout.columns
    shapes = (count, p, p), (count, p), (count,), (count,)
    sums = Normal(*(np.zeros(shape) for shape in shapes))
    for w, k in zip(windows, kind, strict=True):
        for first in range(0, w.torque_Nm.size, _CHUNK):
            rows = slice(first, min(first + _CHUNK, w.torque_Nm.size))
            x, y = matrix(w, layout, rows.start, rows.stop), w.torque_Nm[rows]
            for key in {int(b) for b in k[rows] if b >= 0}:
                x_part, y_part = x[k[rows] == key], y[k[rows] == key]
                sums.xx[key] += x_part.T @ x_part
                sums.xy[key] += x_part.T @ y_part
                sums.yy[key] += float(y_part @ y_part)
                sums.rows[key] += y_part.size
    return sums
