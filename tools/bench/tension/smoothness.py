"""How far tensions change along paths, and whether what looks like a step is one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.tension_distribution import TensionSolver
from cdpr_tools.bench.geometries import CableRobot

_POINTS = 500
_APART_m = 1e-3
_STEP_WITHIN_m = 1e-9
_STEP_N = 0.01
"""What remains of a change within a nanometre from which on it is a step; rounding is far below."""


@dataclass
class Smoothness:
    """Changes of the tension that changes most, for each mm of path, and steps among them."""

    paths: int
    p50_N_mm: float
    p99_N_mm: float
    most_N_mm: float
    paths_with_steps: int
    largest_step_N: float
    largest_step_of_the_wrench_N: float


class _PathPoint:
    """One distribution of one robot, asked for places along a path with one orientation."""

    def __init__(self, robot: CableRobot, distribution: TensionSolver) -> None:
        self._robot, self._distribution = robot, distribution
        self.rotation: FloatArray = np.eye(3)

    def at(self, p: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
        """Return the tensions (n,), the wrench they exert (6,), scaled, and whether they carry."""
        W = self._robot.wrench_matrix(p, self.rotation)
        t = np.zeros(W.shape[1])
        outcome = self._distribution.solve(W, self._robot.wrench_N_Nm, t)
        return t, W @ t / self._robot.wrench_scale, outcome < TensionOutcome.NEAREST

    def step(self, a: FloatArray, b: FloatArray) -> tuple[float, float]:
        """Return what remains of a change of tensions, and of the wrench, where it is steepest."""
        (t_a, w_a, _), (t_b, w_b, _) = self.at(a), self.at(b)
        while np.linalg.norm(b - a) > _STEP_WITHIN_m:
            middle = 0.5 * (a + b)
            t, w, _ = self.at(middle)
            if np.abs(t - t_a).max() > np.abs(t_b - t).max():
                b, t_b, w_b = middle, t, w
            else:
                a, t_a, w_a = middle, t, w
        return float(np.abs(t_b - t_a).max()), float(np.linalg.norm(w_b - w_a))


def smoothness(
    robot: CableRobot, distribution: TensionSolver, points: int, seed: int
) -> tuple[Smoothness, Smoothness]:
    """Follow straight paths of 0.5 m, `points` in all; return where tensions carry and where not.

    Of the changes from one point to the next only those count whose both ends carry the weight, or
    both do not. The largest of each path is halved down to a nanometre: what remains is a step.
    """
    rng = np.random.default_rng(seed)
    starts, rotations = robot.poses(max(1, points // _POINTS), seed)
    walker = _PathPoint(robot, distribution)
    changes: tuple[list[FloatArray], ...] = ([], [])
    steps: tuple[list[tuple[float, float]], ...] = ([], [])
    for start, rotation in zip(starts, rotations, strict=True):
        walker.rotation = rotation
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        path = start + np.outer(np.arange(_POINTS) * _APART_m, direction)
        along = [walker.at(p) for p in path]
        change = np.abs(np.diff([t for t, _, _ in along], axis=0)).max(axis=1)
        carried = np.array([c for _, _, c in along])
        for kind, both in enumerate((carried[1:] & carried[:-1], ~carried[1:] & ~carried[:-1])):
            if both.any():
                k = int(np.where(both, change, -1.0).argmax())
                changes[kind].append(change[both])
                steps[kind].append(walker.step(path[k], path[k + 1]))
    return _summary(changes[0], steps[0]), _summary(changes[1], steps[1])


def _summary(changes: list[FloatArray], steps: list[tuple[float, float]]) -> Smoothness:
    per_mm = np.concatenate([*changes, np.zeros(0)]) / (1e3 * _APART_m)
    p50, p99, most = np.percentile(per_mm, [50.0, 99.0, 100.0]) if per_mm.size else np.zeros(3)
    of_tensions, of_wrench = np.array(steps).reshape(-1, 2).T
    return Smoothness(
        len(steps), float(p50), float(p99), float(most), int((of_tensions > _STEP_N).sum()),
        float(of_tensions.max(initial=0.0)), float(of_wrench.max(initial=0.0)),
    )  # fmt: skip
