"""Time along a path: as fast as speeds, accelerations, jerks and tensions allow, at rest in stops.

The passes of the scaling kernel scale each run between two stops. The motion is then averaged over
time, so that its acceleration has no steps. The average is too fast at positions at which the
motion was slow for a moment only. These positions are slowed down and the run is scaled again. This
is repeated until all samples of the smoothed motion keep all limits, and the set-point stays on the
path between samples. A small remaining excess is removed by slowing the whole run, which breaks no
limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.motion.path_nodes import EXACT_m, PathNodes

# Kernel of the polynomial of fifth order between two nodes with two derivatives each.


@jit
def quintic(
    p0: float, v0: float, a0: float, p1: float, v1: float, a1: float, h: float, u: float
) -> tuple[float, float, float, float]:
    """Return value and three derivatives at the share `u` of an interval of length `h`.

    At both ends the value is p, the first derivative v and the second a (Hermite).
    """
    v0, v1, a0, a1 = h * v0, h * v1, h * h * a0, h * h * a1
    gap, slope, bend = p1 - p0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
    c3 = 10.0 * gap - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * slope - bend
    c5 = 6.0 * gap - 3.0 * slope + 0.5 * bend
    return (
        p0 + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5)))),
        (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h,
        (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / h**2,
        (6.0 * c3 + u * (24.0 * c4 + u * 60.0 * c5)) / h**3,
    )


# Kernels of the time scaling: the fastest motion along a path's nodes within limits. State
# and control are those of Bobrow and of TOPP-RA (Pham and Pham, 2018): x = ds/dt squared and u
# = d²s/dt². All limits on velocity bound x. All limits on acceleration and on tensions are
# inequalities linear in (x, u) at each node. u is constant between two nodes, so that x is linear
# in s.

_NOTHING: Final = 1e-12
_MOST_CUTS: Final = 60
_FAR: Final = 1e12
_REACH: Final = 0.55
_SHORT_m: Final = 1e-5
"""Between nodes that are closer than this, the third derivative is lost in rounding errors."""


class Curve(NamedTuple):
    """The N nodes of a path in d coordinates, smooth between those of a run."""

    s: FloatArray
    """Length along the path, (N,)."""
    q: FloatArray
    """Positions (N, d)."""
    first: FloatArray
    """First derivatives by length, (N, d)."""
    second: FloatArray


class WrenchBounds(NamedTuple):
    """Wrenches that tensions can exert along a path, as half-spaces, and wrenches that it requires.

    lower <= normals · (by_u u + by_x x) <= upper at node i with `row[i]`; -1 if tensions allow any
    motion within the limits of acceleration.
    """

    row: IntArray
    """Row of `normals`, `lower` and `upper` for each node, (N,)."""
    normals: FloatArray
    """Normals of the f half-spaces at t places, (t, f, d)."""
    lower: FloatArray
    """Lower bounds (t, f). They are below 0, and `upper` is above 0, because the wrench at rest has
    been subtracted."""
    upper: FloatArray
    by_u: FloatArray
    """Wrench per u = d²s/dt² at each node, (N, d)."""
    by_x: FloatArray
    """Wrench per x = (ds/dt)² at each node, (N, d)."""

    @classmethod
    def none(cls, count: int, d: int) -> WrenchBounds:
        """Return no bounds for `count` nodes."""
        nothing = np.zeros((count, d))
        rows = np.full(count, -1, np.int64)
        return cls(rows, np.zeros((1, 1, d)), np.zeros((1, 1)), np.zeros((1, 1)), nothing, nothing)


@jit
def _bounds(
    x: float, i: int, curve: Curve, most: FloatArray, wrenches: WrenchBounds, found: FloatArray
) -> None:
    """Write the least and largest u at x at node i, and their derivatives by x, into found (4,).

    u is bounded by the accelerations first·u + second·x, up to ±`most` (d,), and by `wrenches`.
    """
    found[0], found[1], found[2], found[3] = -_FAR, _FAR, 0.0, 0.0
    for k in range(most.size):
        _narrow(curve.first[i, k], curve.second[i, k], -most[k], most[k], x, found)
    row = wrenches.row[i]
    if row >= 0:
        normals, by_u, by_x = wrenches.normals[row], wrenches.by_u[i], wrenches.by_x[i]
        for f in range(normals.shape[0]):
            a, b = 0.0, 0.0
            for k in range(normals.shape[1]):
                a += normals[f, k] * by_u[k]
                b += normals[f, k] * by_x[k]
            _narrow(a, b, wrenches.lower[row, f], wrenches.upper[row, f], x, found)


@jit
def _narrow(a: float, b: float, low: float, high: float, x: float, found: FloatArray) -> None:
    """Narrow u to low <= a u + b x <= high."""
    if abs(a) < _NOTHING:
        return
    if a < 0.0:
        a, b, low, high = -a, -b, -high, -low
    least, most = (low - b * x) / a, (high - b * x) / a
    if least > found[0]:
        found[0], found[2] = least, -b / a
    if most < found[1]:
        found[1], found[3] = most, -b / a


@jit
def scale_run(
    begin: int,
    end: int,
    curve: Curve,
    most: FloatArray,
    wrenches: WrenchBounds,
    bound: FloatArray,
    x: FloatArray,
) -> None:
    """Write the largest x (N,) up to `bound` (N,) from node `begin` to `end`, at rest at both.

    The backward pass finds the largest x from which the next node's x can be reached. The forward
    pass takes the largest u.
    """
    s, found = curve.s, x[:4].copy()
    x[begin] = x[end] = 0.0
    for i in range(end - 1, begin, -1):
        step = 2.0 * (s[i + 1] - s[i])
        here = bound[i]
        for _ in range(_MOST_CUTS):
            _bounds(here, i, curve, most, wrenches, found)
            _narrow(1.0, 1.0 / step, 0.0, x[i + 1] / step, here, found)
            gap, slope = found[0] - found[1], found[2] - found[3]
            if gap <= _NOTHING:
                break
            # the gap is convex in x, so a tangent's zero is never below the first zero of the gap
            here = here - gap / slope if slope > _NOTHING else 0.5 * here
            if here <= 0.0:
                here = 0.0
                break
        x[i] = here
    for i in range(begin, end - 1):
        step = 2.0 * (s[i + 1] - s[i])
        _bounds(x[i], i, curve, most, wrenches, found)
        x[i + 1] = max(min(x[i + 1], x[i] + step * found[1]), 0.0)


@jit
def clock_run(
    begin: int, end: int, s: FloatArray, x: FloatArray, t: FloatArray, swept: FloatArray
) -> None:
    """Write the time (N,) of each node of a run since its start, and the integral of s."""
    t[begin] = swept[begin] = 0.0
    for i in range(begin, end):
        v, w = math.sqrt(x[i]), math.sqrt(x[i + 1])
        step = s[i + 1] - s[i]
        dt = 2.0 * step / max(v + w, _NOTHING)
        slope = (w - v) / dt
        t[i + 1] = t[i] + dt
        here = s[i] - s[begin]
        swept[i + 1] = swept[i] + dt * (here + dt * (0.5 * v + dt * slope / 6.0))


@jit
def _at(
    t: float,
    i: int,
    begin: int,
    end: int,
    s: FloatArray,
    x: FloatArray,
    times: FloatArray,
    swept: FloatArray,
    out: FloatArray,
) -> int:
    """Write integral of s, s, ds/dt and d²s/dt² at a time into out (4,); return the node before."""
    if t <= 0.0:
        out[0] = out[1] = out[2] = out[3] = 0.0
        return begin
    if t >= times[end]:
        out[1] = s[end] - s[begin]
        out[0] = swept[end] + out[1] * (t - times[end])
        out[2] = out[3] = 0.0
        return end - 1
    while i < end - 1 and times[i + 1] <= t:
        i += 1
    v, w = math.sqrt(x[i]), math.sqrt(x[i + 1])
    slope, dt, here = (w - v) / (times[i + 1] - times[i]), t - times[i], s[i] - s[begin]
    out[0] = swept[i] + dt * (here + dt * (0.5 * v + dt * slope / 6.0))
    out[1] = here + dt * (v + 0.5 * dt * slope)
    out[2], out[3] = v + dt * slope, slope
    return i


@jit
def smooth_run(
    begin: int,
    end: int,
    width_s: float,
    period_s: float,
    s: FloatArray,
    x: FloatArray,
    times: FloatArray,
    swept: FloatArray,
    motion: FloatArray,
) -> None:
    """Write s and three derivatives by time, (c, 4), every `period_s`, of a run's smoothed motion.

    The smoothed motion is the average over the last `width_s`. If the acceleration has steps, the
    third derivative is at most their height divided by the width. The motion lasts longer by the
    width, and is at rest at both ends.
    """
    now, before = motion[0].copy(), motion[0].copy()
    i = j = begin
    for c in range(motion.shape[0]):
        t = c * period_s
        i = _at(t, i, begin, end, s, x, times, swept, now)
        j = _at(t - width_s, j, begin, end, s, x, times, swept, before)
        for k in range(4):
            motion[c, k] = (now[k] - before[k]) / width_s
        motion[c, 0] += s[begin]


@jit
def place_between(along: float, i: int, curve: Curve, out: FloatArray) -> None:
    """Write position and three derivatives by length, (4, d), between the nodes i and i + 1.

    The curve is the polynomial of fifth order with the positions and two derivatives of both nodes.
    """
    s, q, first, second = curve
    h = s[i + 1] - s[i]
    u = min(max((along - s[i]) / h, 0.0), 1.0)
    for k in range(q.shape[1]):
        out[0, k], out[1, k], out[2, k], out[3, k] = quintic(
            q[i, k], first[i, k], second[i, k], q[i + 1, k], first[i + 1, k], second[i + 1, k], h, u
        )


@jit
def strain_run(
    begin: int,
    end: int,
    curve: Curve,
    speed: FloatArray,
    positions: int,
    limits: FloatArray,
    wrenches: WrenchBounds,
    motion: FloatArray,
    strain: FloatArray,
    node: IntArray,
) -> None:
    """Write the factor (c,) by which each sample of `motion` (c, 4) is too fast, and its node.

    `limits` (3, d) are limits of velocity, acceleration and jerk; `speed` (N,) is the limit along
    the path.
    """
    s, at = curve.s, curve.q[:4].copy()  # a run has five nodes at least
    i = begin
    for c in range(motion.shape[0]):
        while i < end - 1 and s[i + 1] <= motion[c, 0]:
            i += 1
        node[c] = i
        place_between(motion[c, 0], i, curve, at)
        v, a = motion[c, 1], motion[c, 2]
        bends = 1.0 if s[i + 1] - s[i] > _SHORT_m else 0.0
        worst, along = _direction_strain(at, motion[c], bends, limits, positions)
        wanted = speed[i] if motion[c, 0] - s[i] < 0.5 * (s[i + 1] - s[i]) else speed[i + 1]
        worst = max(worst, along / wanted)
        if wrenches.row[i] >= 0:
            worst = max(worst, _wrench_strain(i, wrenches, v * v, a))
        strain[c] = worst


@jit
def _direction_strain(
    at: FloatArray, motion: FloatArray, bends: float, limits: FloatArray, positions: int
) -> tuple[float, float]:
    """Return the largest ratio of motion to limit over the directions, and the speed along the
    path.
    """
    v, a, j = motion[1], motion[2], motion[3]
    worst, straight, turned = 0.0, 0.0, 0.0
    for k in range(at.shape[1]):
        rate = at[1, k] * v
        slope = at[1, k] * a + at[2, k] * v * v
        jerk = at[1, k] * j + 3.0 * at[2, k] * v * a + bends * at[3, k] * v * v * v
        worst = max(worst, abs(rate) / limits[0, k])
        worst = max(worst, math.sqrt(abs(slope) / limits[1, k]))
        worst = max(worst, (abs(jerk) / limits[2, k]) ** (1.0 / 3.0))
        if k < positions:
            straight += rate * rate
        else:
            turned += rate * rate
    return worst, math.sqrt(straight if straight > _NOTHING * v * v else turned)


@jit
def _wrench_strain(i: int, wrenches: WrenchBounds, x: float, u: float) -> float:
    row, by_u, by_x = wrenches.row[i], wrenches.by_u[i], wrenches.by_x[i]
    normals, worst = wrenches.normals[row], 0.0
    for f in range(normals.shape[0]):
        needed = 0.0
        for k in range(normals.shape[1]):
            needed += normals[f, k] * (by_u[k] * u + by_x[k] * x)
        room = wrenches.upper[row, f] if needed > 0.0 else -wrenches.lower[row, f]
        worst = max(worst, abs(needed) / max(room, _NOTHING))
    return math.sqrt(worst)


@jit
def lower_bounds(
    begin: int,
    end: int,
    width_s: float,
    tolerance: float,
    s: FloatArray,
    motion: FloatArray,
    strain: FloatArray,
    node: IntArray,
    bound: FloatArray,
) -> bool:
    """Lower `bound` (N,) of x if the smoothed motion is too fast there; return whether it was.

    A sample is an average over `width_s`. So the part of the path that is passed in that time at
    the wanted speed is slowed.
    """
    lowered = False
    for c in range(motion.shape[0]):
        if strain[c] <= tolerance:
            continue
        lowered = True
        v = motion[c, 1] / strain[c]
        reach = _REACH * v * width_s
        i = node[c]
        while i >= begin and s[i] >= motion[c, 0] - reach:
            bound[i] = min(bound[i], v * v)
            i -= 1
        bound[max(i, begin)] = min(bound[max(i, begin)], v * v)
        i = node[c] + 1
        while i <= end and s[i] <= motion[c, 0] + reach:
            bound[i] = min(bound[i], v * v)
            i += 1
        bound[min(i, end)] = min(bound[min(i, end)], v * v)
    return lowered


@jit
def sample_run(
    begin: int,
    end: int,
    slower: float,
    curve: Curve,
    motion: FloatArray,
    samples: FloatArray,
    node: IntArray,
) -> None:
    """Write positions, velocities and accelerations (c, 3, d) of a motion slowed by a factor."""
    s, at = curve.s, curve.q[:4].copy()  # a run has five nodes at least
    i = begin
    for c in range(motion.shape[0]):
        while i < end - 1 and s[i + 1] <= motion[c, 0]:
            i += 1
        node[c] = i
        place_between(motion[c, 0], i, curve, at)
        v, a = motion[c, 1] / slower, motion[c, 2] / slower**2
        for k in range(at.shape[1]):
            samples[c, 0, k] = at[0, k]
            samples[c, 1, k] = at[1, k] * v
            samples[c, 2, k] = at[1, k] * a + at[2, k] * v * v


@jit
def departures_run(
    curve: Curve,
    scale: FloatArray,
    slower: float,
    period_s: float,
    motion: FloatArray,
    samples: FloatArray,
    node: IntArray,
    last: int,
    away: FloatArray,
) -> None:
    """Write how far the set-point leaves the path after each sample (c,), up to the node `last`.

    Between samples the set-point is the polynomial of fifth order that `path_playback` uses. Only
    the distance across the path counts; an error along it is only an error of time.
    """
    s, d = curve.s, samples.shape[2]
    at, gap = curve.q[:4].copy(), curve.q[0].copy()
    for c in range(motion.shape[0] - 1):
        away[c] = 0.0
        i = node[c]
        for part in range(1, 4):
            u = 0.25 * part
            along, _, _, _ = quintic(
                motion[c, 0], motion[c, 1] / slower, motion[c, 2] / slower**2,
                motion[c + 1, 0], motion[c + 1, 1] / slower, motion[c + 1, 2] / slower**2,
                period_s, u,
            )  # fmt: skip
            while i < last - 1 and s[i + 1] <= along:
                i += 1
            place_between(along, i, curve, at)
            dot, square = 0.0, 0.0
            for k in range(d):
                q, _, _, _ = quintic(
                    samples[c, 0, k], samples[c, 1, k], samples[c, 2, k],
                    samples[c + 1, 0, k], samples[c + 1, 1, k], samples[c + 1, 2, k], period_s, u,
                )  # fmt: skip
                gap[k] = scale[k] * (q - at[0, k])
                dot += gap[k] * scale[k] * at[1, k]
                square += gap[k] * gap[k]
            away[c] = max(away[c], math.sqrt(max(square - dot * dot, 0.0)))


PERIOD_S: Final = 0.01
"""Time between the samples of a plan."""
MOST_SAMPLES: Final = 100_000
"""Largest number of samples of a plan, which the loop reads between two cycles."""
_TOLERANCE: Final = 1.005
_ROUNDS: Final = 20
_FINER: Final = 3.0
"""Number of positions checked per sample."""
_SHARE: Final = 0.98
"""Share of acceleration and jerk that the first passes use; smoothing needs the rest."""
_SLOWEST_m_s: Final = 1e-4
_TIME_SCALING_NOTHING: Final = 1e-9


@dataclass(frozen=True)
class PathLimits:
    """Limits of velocity, acceleration and jerk of each coordinate, (d,) each, per s, s² and s³."""

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def table(self) -> FloatArray:
        """Velocity, acceleration and jerk, (3, d)."""
        return np.array([self.velocity, self.acceleration, self.jerk])

    @property
    def smoothing_s(self) -> float:
        """Time over which velocities are averaged: twice the largest acceleration, over jerk.

        It is at least a millisecond, even if jerk is not limited.
        """
        return max(2.0 * float((self.acceleration / self.jerk).max()), 1e-3)


@dataclass(frozen=True)
class TimedPath:
    """A path in time: samples every `period_s`."""

    period_s: float
    samples: FloatArray
    """Position, velocity and acceleration (c, 3, d)."""
    node: IntArray
    """The node before each sample, (c,)."""
    along_m: FloatArray
    """Length along the path, (c,), weighted like that of the nodes."""
    waits: IntArray
    """Samples at which the path waits for a command to continue."""
    rounds: int
    """Largest number of scaling passes of a run."""
    departure_m: float
    """Largest distance of the set-point from the nodes' path, between samples."""
    departs: int
    """Node at which this distance occurs."""

    @property
    def duration_s(self) -> float:
        """Duration without waits."""
        return self.period_s * (len(self.samples) - 1)


def time_path(nodes: PathNodes, limits: PathLimits, wrenches: WrenchBounds) -> TimedPath:
    """Return the fastest motion along a path within limits, apart from losses by smoothing."""
    bound = speed_bounds(nodes, limits)
    samples, node, along, waits, most = [], [], [], [], 0
    count = departs = 0
    departure_m = 0.0
    for (begin, end), dwell_s, wait in zip(nodes.runs, nodes.dwell_s, nodes.waits, strict=True):
        last_q, last_s = nodes.q[end], nodes.s[end]
        if end > begin:
            run = _scale(nodes, limits, wrenches, bound, int(begin), int(end))
            samples.append(run.samples[:-1])
            node.append(run.node[:-1])
            along.append(run.along_m[:-1])
            count += len(run.samples) - 1
            most = max(most, run.rounds)
            worst = int(run.away_m.argmax())
            if run.away_m[worst] > departure_m:
                departure_m, departs = float(run.away_m[worst]), int(run.node[worst])
        # a wait follows a moment of rest, so the path must begin with one
        resting = max(int(np.ceil(dwell_s / PERIOD_S)), int(wait and not count))
        still = np.zeros((resting, 3, nodes.q.shape[1]))
        still[:, 0] = last_q
        samples.append(still)
        node.append(np.full(resting, end))
        along.append(np.full(resting, last_s))
        count += resting
        if wait:
            waits.append(count)
    final = np.zeros((1, 3, nodes.q.shape[1]))
    final[0, 0] = nodes.q[-1]
    return TimedPath(
        PERIOD_S,
        np.concatenate([*samples, final]),
        np.append(np.concatenate(node), len(nodes.s) - 1),
        np.append(np.concatenate(along), nodes.s[-1]),
        np.array(waits, np.int64),
        most,
        departure_m,
        departs,
    )


def curve_of(nodes: PathNodes) -> Curve:
    """Return the nodes' arrays for the kernels."""
    return Curve(nodes.s, nodes.q, nodes.first, nodes.second)


def speed_bounds(nodes: PathNodes, limits: PathLimits) -> FloatArray:
    """Return the largest (ds/dt)² of each node, (N,), by velocity, feed and bends."""
    k = nodes.coordinates.positions
    first, second = np.abs(nodes.first), np.abs(nodes.second)
    # coordinates that hardly move allow infinite speed along the path
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = [(limits.velocity / first) ** 2, _SHARE * limits.acceleration / second]
        straight, turned = (np.linalg.norm(part, axis=1) for part in (first[:, :k], first[:, k:]))
        along = np.where(straight > _TIME_SCALING_NOTHING, straight, turned)
        feed = ((nodes.speed / along) ** 2)[:, None]
        third = np.zeros_like(second)
        step = np.diff(nodes.s)
        bend = (
            np.abs(np.diff(nodes.second, axis=0)) / np.maximum(step, _TIME_SCALING_NOTHING)[:, None]
        )
        bend[step <= 0.0] = 0.0
        third[:-1], third[1:] = bend, np.maximum(third[1:], bend)
        bounds += [feed, (_SHARE * limits.jerk / third) ** (2.0 / 3.0)]
    least = np.min([np.nan_to_num(one, nan=np.inf).min(axis=1) for one in bounds], axis=0)
    least[nodes.runs.ravel()] = 0.0
    return np.asarray(least)


@dataclass(frozen=True)
class _Run:
    """A run's samples (c, 3, d), with the node before each and the length along the path."""

    samples: FloatArray
    node: IntArray
    along_m: FloatArray
    away_m: FloatArray
    """Distance of the set-point from the path after each sample, (c,)."""
    rounds: int


def _scale(
    nodes: PathNodes,
    limits: PathLimits,
    wrenches: WrenchBounds,
    bound: FloatArray,
    begin: int,
    end: int,
) -> _Run:
    """Return a run's smoothed motion in samples that keep all limits and stay on the path."""
    x, times, swept = np.zeros((3, len(bound)))
    width_s, most = limits.smoothing_s, _SHARE * limits.acceleration
    curve = curve_of(nodes)
    for rounds in range(1, _ROUNDS + 1):
        scale_run(begin, end, curve, most, wrenches, bound, x)
        clock_run(begin, end, nodes.s, x, times, swept)
        duration_s = float(times[end]) + width_s
        motion = _smoothed(nodes, begin, end, width_s, duration_s, _FINER, x, times, swept)
        strain, where = np.zeros(len(motion)), np.zeros(len(motion), np.int64)
        strain_run(
            begin, end, curve, nodes.speed, nodes.coordinates.positions, limits.table, wrenches,
            motion, strain, where,
        )  # fmt: skip
        lowered = rounds < _ROUNDS and lower_bounds(
            begin, end, width_s, _TOLERANCE, nodes.s, motion, strain, where, bound
        )
        if not lowered:
            slower = max(
                1.0, float(strain.max())
            )  # rounding to whole samples then gives the exact factor
            motion = _smoothed(nodes, begin, end, width_s, duration_s, slower, x, times, swept)
            slower = PERIOD_S * (len(motion) - 1) / duration_s
            run = _sampled(nodes, begin, end, slower, motion, rounds)
            # a departure grows at most with the third power of the time between samples
            departs = np.maximum(np.cbrt(run.away_m / EXACT_m), _TOLERANCE)
            strain = np.where(run.away_m > EXACT_m, slower * departs, 0.0)
            if rounds == _ROUNDS or not lower_bounds(
                begin, end, width_s, 1.0, nodes.s, motion, strain, run.node, bound
            ):
                return run
        np.maximum(bound[begin + 1 : end], _SLOWEST_m_s**2, out=bound[begin + 1 : end])
    raise AssertionError  # the last round returns


def _sampled(
    nodes: PathNodes, begin: int, end: int, slower: float, motion: FloatArray, rounds: int
) -> _Run:
    """Return the samples of a motion slowed by a factor."""
    samples = np.zeros((len(motion), 3, nodes.q.shape[1]))
    where, away_m = np.zeros(len(motion), np.int64), np.zeros(len(motion))
    curve = curve_of(nodes)
    sample_run(begin, end, slower, curve, motion, samples, where)
    samples[-1], samples[-1, 0] = 0.0, nodes.q[end]  # without rounding errors
    departures_run(curve, nodes.scale, slower, PERIOD_S, motion, samples, where, end, away_m)
    return _Run(samples, where, motion[:, 0], away_m, rounds)


def _smoothed(
    nodes: PathNodes,
    begin: int,
    end: int,
    width_s: float,
    duration_s: float,
    stretch: float,
    x: FloatArray,
    times: FloatArray,
    swept: FloatArray,
) -> FloatArray:
    """Return a run's smoothed motion, (c, 4), with as many samples as if it were stretched."""
    count = max(int(np.ceil(stretch * duration_s / PERIOD_S - _TIME_SCALING_NOTHING)), 1)
    motion = np.zeros((count + 1, 4))
    smooth_run(begin, end, width_s, duration_s / count, nodes.s, x, times, swept, motion)
    motion[-1] = nodes.s[end], 0.0, 0.0, 0.0
    return motion
