"""Kernels of the time scaling: the fastest motion along a path's nodes that limits bear.

State and control are those of Bobrow and of TOPP-RA (Pham and Pham, 2018): x = ds/dt squared and
u = d²s/dt². All limits on velocity bound x, all limits on acceleration and on tensions are
inequalities linear in (x, u) at each node; u is even between two nodes, so that x is linear in s.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.motion.path.quintic import quintic

_NOTHING: Final = 1e-12
_MOST_CUTS: Final = 60
_FAR: Final = 1e12
_REACH: Final = 0.55
_SHORT_m: Final = 1e-5
"""Between nodes that are nearer to each other the third derivative is not known, for rounding."""


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
    """Wrenches that tensions can exert along a path, as half-spaces, and those that it requires.

    lower <= normals · (by_u u + by_x x) <= upper at node i with `row[i]`, -1 where any motion
    within the limits of acceleration is carried anyway.
    """

    row: IntArray
    """(N,)"""
    normals: FloatArray
    """(t, f, d)"""
    lower: FloatArray
    """(t, f), below 0, as `upper` above: what rest takes has been taken off."""
    upper: FloatArray
    by_u: FloatArray
    """(N, d), what d²s/dt² takes, and ..."""
    by_x: FloatArray
    """... (ds/dt)²."""

    @classmethod
    def none(cls, count: int, d: int) -> WrenchBounds:
        """Return no bounds for so many nodes."""
        nothing = np.zeros((count, d))
        rows = np.full(count, -1, np.int64)
        return cls(rows, np.zeros((1, 1, d)), np.zeros((1, 1)), np.zeros((1, 1)), nothing, nothing)


@jit
def _bounds(
    x: float, i: int, curve: Curve, most: FloatArray, wrenches: WrenchBounds, found: FloatArray
) -> None:
    """Write the least and greatest u at x at node i, and their derivatives by x, into found (4,).

    By accelerations first·u + second·x, up to `most` (d,) either way, and by `wrenches`.
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
    """Write the greatest x (N,) up to `bound` (N,) from node `begin` to `end`, at rest at both.

    Backward: the greatest x from which the next node's can be reached. Forward: the greatest u.
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
            # the gap is convex in x: a tangent's zero is never below the first one of the gap
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
    """Write the time (N,) of each node of a run since its beginning, and the integral of s."""
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

    Its average over the last `width_s`: whatever steps the acceleration takes, the third derivative
    is at most their height over the width. It lasts longer by the width, at rest at both ends.
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

    The polynomial of fifth order that has both nodes' positions and two derivatives.
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
    """Write by which factor (c,) each sample of `motion` (c, 4) would have to be slower, and where.

    `limits` (3, d) are those of velocity, acceleration and jerk, `speed` (N,) that along the path.
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
    """Return the worst strain of the directions' own limits, and the speed along the path."""
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
    """Lower `bound` (N,) of x where the smoothed motion is too fast; return whether it is anywhere.

    A sample is an average over `width_s`: as much of the path is slowed as is passed in that time
    at the speed that is wanted.
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
