"""Time along a path: as fast as speeds, accelerations, jerks and tensions allow, at rest in stops.

Each run between two stops is scaled by the passes of `time_scaling_kernel`, whose motion is then
averaged over time so that its acceleration has no steps. Averaged, it is too fast where it was
slow for a moment only: those places are slowed down and the run is scaled again, until all samples
of the smoothed motion keep all limits. What little is left is left to time: the run is slowed as a
whole, by which nothing that was within limits leaves them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.motion.path import time_scaling_kernel as kernel
from cdpr_rt.motion.path.nodes import PathNodes
from cdpr_rt.motion.path.time_scaling_kernel import Curve, WrenchBounds

PERIOD_S: Final = 0.01
"""Between the samples of a plan."""
MOST_SAMPLES: Final = 100_000
"""Longest plan, which the loop reads between two cycles."""
_TOLERANCE: Final = 1.005
_ROUNDS: Final = 20
_FINER: Final = 3.0
"""Places that are looked at for each sample."""
_SHARE: Final = 0.98
"""Share of acceleration and jerk that the first passes use; the rest is for smoothing."""
_SLOWEST_m_s: Final = 1e-4
_NOTHING: Final = 1e-9


@dataclass(frozen=True)
class PathLimits:
    """The most of each coordinate, (d,) each, by s, s² and s³."""

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def table(self) -> FloatArray:
        """Velocity, acceleration and jerk, (3, d)."""
        return np.array([self.velocity, self.acceleration, self.jerk])

    @property
    def smoothing_s(self) -> float:
        """Time over which velocities are averaged: accelerations step by twice their most, over it.

        A jerk that is not limited leaves a millisecond.
        """
        return max(2.0 * float((self.acceleration / self.jerk).max()), 1e-3)


@dataclass(frozen=True)
class TimedPath:
    """A path in time: samples every `period_s`."""

    period_s: float
    samples: FloatArray
    """Position, velocity and acceleration (c, 3, d)."""
    node: IntArray
    """The node before each, (c,)."""
    along_m: FloatArray
    """Length along the path, weighted as the nodes', (c,)."""
    waits: IntArray
    """Samples at which it waits until it is told to go on."""
    rounds: int
    """Most passes of scaling of a run."""

    @property
    def duration_s(self) -> float:
        """Duration without waits."""
        return self.period_s * (len(self.samples) - 1)


def time_path(nodes: PathNodes, limits: PathLimits, wrenches: WrenchBounds) -> TimedPath:
    """Return the fastest motion along a path within limits, as near as smoothing comes to it."""
    bound = speed_bounds(nodes, limits)
    samples, node, along, waits, most = [], [], [], [], 0
    count = 0
    for (begin, end), dwell_s, wait in zip(nodes.runs, nodes.dwell_s, nodes.waits, strict=True):
        last_q, last_s = nodes.q[end], nodes.s[end]
        if end > begin:
            motion, slower, rounds = _scale(nodes, limits, wrenches, bound, int(begin), int(end))
            part = np.zeros((len(motion), 3, nodes.q.shape[1]))
            where = np.zeros(len(motion), np.int64)
            kernel.sample_run(begin, end, slower, curve_of(nodes), motion, part, where)
            part[-1], part[-1, 0] = 0.0, last_q  # not as rounded
            samples.append(part[:-1])
            node.append(where[:-1])
            along.append(motion[:-1, 0])
            count += len(part) - 1
            most = max(most, rounds)
        resting = int(np.ceil(dwell_s / PERIOD_S))
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
    )


def curve_of(nodes: PathNodes) -> Curve:
    """Return the nodes' arrays for the kernels."""
    return Curve(nodes.s, nodes.q, nodes.first, nodes.second)


def speed_bounds(nodes: PathNodes, limits: PathLimits) -> FloatArray:
    """Return the greatest (ds/dt)² of each node, (N,), by velocity, feed and bends."""
    k = nodes.coordinates.positions
    first, second = np.abs(nodes.first), np.abs(nodes.second)
    # what hardly moves at all may be infinitely fast
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = [(limits.velocity / first) ** 2, _SHARE * limits.acceleration / second]
        straight, turned = (np.linalg.norm(part, axis=1) for part in (first[:, :k], first[:, k:]))
        along = np.where(straight > _NOTHING, straight, turned)
        feed = ((nodes.speed / along) ** 2)[:, None]
        third = np.zeros_like(second)
        step = np.diff(nodes.s)
        bend = np.abs(np.diff(nodes.second, axis=0)) / np.maximum(step, _NOTHING)[:, None]
        bend[step <= 0.0] = 0.0
        third[:-1], third[1:] = bend, np.maximum(third[1:], bend)
        bounds += [feed, (_SHARE * limits.jerk / third) ** (2.0 / 3.0)]
    least = np.min([np.nan_to_num(one, nan=np.inf).min(axis=1) for one in bounds], axis=0)
    least[nodes.runs.ravel()] = 0.0
    return np.asarray(least)


def _scale(
    nodes: PathNodes,
    limits: PathLimits,
    wrenches: WrenchBounds,
    bound: FloatArray,
    begin: int,
    end: int,
) -> tuple[FloatArray, float, int]:
    """Return a run's smoothed motion (c, 4), by how much it is to be slower, and the rounds."""
    x, times, swept = np.zeros((3, len(bound)))
    width_s, most = limits.smoothing_s, _SHARE * limits.acceleration
    curve = curve_of(nodes)
    for rounds in range(1, _ROUNDS + 1):
        kernel.scale_run(begin, end, curve, most, wrenches, bound, x)
        kernel.clock_run(begin, end, nodes.s, x, times, swept)
        duration_s = float(times[end]) + width_s
        motion = _smoothed(nodes, begin, end, width_s, duration_s, _FINER, x, times, swept)
        strain, where = np.zeros(len(motion)), np.zeros(len(motion), np.int64)
        kernel.strain_run(
            begin, end, curve, nodes.speed, nodes.coordinates.positions, limits.table, wrenches,
            motion, strain, where,
        )  # fmt: skip
        if rounds == _ROUNDS or not kernel.lower_bounds(
            begin, end, width_s, _TOLERANCE, nodes.s, motion, strain, where, bound
        ):
            break
        np.maximum(bound[begin + 1 : end], _SLOWEST_m_s**2, out=bound[begin + 1 : end])
    slower = max(1.0, float(strain.max()))  # its count of samples says by how much
    motion = _smoothed(nodes, begin, end, width_s, duration_s, slower, x, times, swept)
    slower = PERIOD_S * (len(motion) - 1) / duration_s
    return motion, slower, rounds


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
    """Return a run's smoothed motion, (c, 4), in as many samples as if it was stretched."""
    count = max(int(np.ceil(stretch * duration_s / PERIOD_S - _NOTHING)), 1)
    motion = np.zeros((count + 1, 4))
    kernel.smooth_run(begin, end, width_s, duration_s / count, nodes.s, x, times, swept, motion)
    motion[-1] = nodes.s[end], 0.0, 0.0, 0.0
    return motion
