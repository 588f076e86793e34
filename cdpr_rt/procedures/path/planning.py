"""A path for one robot: from its file to samples in time, or to the first place it cannot be at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.motion.path.description import Coordinates, PathDescription, PathError
from cdpr_rt.motion.path.nodes import PathNodes, nodes_of
from cdpr_rt.motion.path.time_scaling import (
    MOST_SAMPLES,
    PERIOD_S,
    PathLimits,
    TimedPath,
    speed_bounds,
    time_path,
)
from cdpr_rt.motion.path.time_scaling_kernel import WrenchBounds
from cdpr_rt.procedures.path.unit_slips import size_fault
from cdpr_rt.robots.interference.interference import in_words
from cdpr_rt.robots.platform_model import PlatformModel, platform_model_of
from cdpr_rt.robots.wrenches.path_wrenches import InertialWrenches, available_wrenches

_POSES_m: Final = 0.02
"""Between the poses at most at which wrenches and contacts are looked at."""
_ROUNDING: Final = 1e-9

Advance = Callable[[str, float], None]
"""Told what is being done, and which part of the whole is done."""


@dataclass(frozen=True)
class Obstacle:
    """The first place of a path at which the platform cannot be."""

    line: int
    """In the path's file."""
    position: FloatArray
    """(d,)"""
    text: str


@dataclass(frozen=True)
class PathPlan:
    """A path that a robot can follow, unless there is an obstacle."""

    path: PathDescription
    nodes: PathNodes
    limits: PathLimits
    obstacle: Obstacle | None
    timed: TimedPath | None
    """None with an obstacle that has nothing to do with time."""
    constant_s: float
    """Duration at the one speed and acceleration that every place allows."""
    slowed: int
    """Moves whose wanted speed the robot does not reach anywhere."""


class PathPlanner:
    """Plans paths for one robot with a platform."""

    def __init__(self, robot: Robot) -> None:
        """Raises PathError for a robot without a platform."""
        platform = robot.platform
        if platform is None:
            raise PathError(robot.path, 0, NO_PLATFORM)
        self.model: PlatformModel = platform_model_of(robot)
        self.platform = platform
        self.limits = PathLimits(self.model.speed, self.model.acceleration, self.model.jerk)
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        reference = np.zeros(self.model.size)
        reference[: self.model.positions] = np.clip(platform.home_m, low, high)
        self.coordinates = Coordinates(platform.controlled, reference)

    def plan(self, path: PathDescription, advance: Advance = lambda _what, _part: None) -> PathPlan:
        """Return the plan of a path; raises PathError for one of a size in wrong units."""
        model = self.model
        advance("corners", 0.0)
        low, high = np.array(self.platform.workspace_min_m), np.array(self.platform.workspace_max_m)
        size_fault(path, low, high)
        nodes = nodes_of(path, model.wrench_scale)
        obstacle = self._outside(nodes, low, high)
        if obstacle is not None:
            return PathPlan(path, nodes, self.limits, obstacle, None, np.nan, 0)
        if not nodes.length_m and not nodes.s[-1]:
            raise PathError(path.source, path.start_line, "nothing moves; allowed: a path")
        self._require_duration(path, nodes)
        advance("tensions", 0.1)
        wrenches, obstacle = self._wrenches(nodes)
        obstacle = self._first(nodes, obstacle, self._contact(nodes))
        if obstacle is not None:
            return PathPlan(path, nodes, self.limits, obstacle, None, np.nan, 0)
        advance("time", 0.3)
        timed = time_path(nodes, self.limits, wrenches)
        return PathPlan(
            path, nodes, self.limits, None, timed, self._constant_s(nodes), self._slowed(nodes)
        )

    def _require_duration(self, path: PathDescription, nodes: PathNodes) -> None:
        """Raise PathError for a path that takes longer than a plan may, however it is followed."""
        fastest = np.sqrt(speed_bounds(nodes, self.limits))
        step = np.diff(nodes.s)
        moves = step > 0.0
        least_s = nodes.dwell_s.sum()
        with np.errstate(divide="ignore"):
            least_s += (step[moves] / np.maximum(fastest[1:], fastest[:-1])[moves]).sum()
        if not least_s <= MOST_SAMPLES * PERIOD_S:
            raise PathError(
                path.source, 0, f"takes {least_s / 60.0:.3g} min or more; allowed: up to "
                f"{MOST_SAMPLES * PERIOD_S / 60.0:.3g} min: divide it",
            )  # fmt: skip

    # -- where it cannot be

    def _outside(self, nodes: PathNodes, low: FloatArray, high: FloatArray) -> Obstacle | None:
        """Return the first node out of the box of targets, or turned too far."""
        k, names = self.model.positions, self.coordinates.names
        place = nodes.q[:, :k]
        out = (place < low - _ROUNDING) | (place > high + _ROUNDING)
        angle, most = np.linalg.norm(nodes.q[:, k:], axis=1), self.model.angle_rad
        far = angle > most + _ROUNDING
        wrong = np.flatnonzero(out.any(axis=1) | far)
        if not wrong.size:
            return None
        i = int(wrong[0])
        if far[i]:
            text = (
                f"turned by {np.degrees(angle[i]):.4g} deg from the orientation at home; allowed: "
                f"up to {np.degrees(most):.4g} deg"
            )
        else:
            j = int(out[i].argmax())
            text = (
                f"{names[j]} {1e3 * place[i, j]:.6g} mm is outside; allowed: {1e3 * low[j]:g} to "
                f"{1e3 * high[j]:g} mm, the workspace"
            )
        return Obstacle(int(nodes.line[i]), nodes.q[i].copy(), text)

    def _wrenches(self, nodes: PathNodes) -> tuple[WrenchBounds, Obstacle | None]:
        """Return the bounds of wrenches along the path, or the first place that is not held."""
        model = self.model
        chosen = self.looked_at(nodes)
        positions = nodes.q[chosen]
        available = available_wrenches(model, positions)
        if not available.holds.all():
            i = int((~available.holds).argmax())
            why = self.infeasibility(positions[i])
            return WrenchBounds.none(0, model.size), Obstacle(
                int(nodes.line[chosen[i]]), positions[i].copy(), why
            )
        inertial = InertialWrenches(model, nodes.q)
        nothing = np.zeros_like(nodes.q)
        by_u = inertial.of(nothing, nodes.first)
        by_x = inertial.of(nodes.first, nodes.second)
        nearest = np.searchsorted(chosen, np.arange(len(nodes.s)), side="right") - 1
        most = self._most_wrench(nodes, by_u, by_x)
        greatest = np.zeros((len(chosen), model.size))
        np.maximum.at(greatest, nearest, most)
        tight = ~available.spare(greatest)
        kept = np.flatnonzero(tight)
        number = np.full(len(chosen), -1, np.int64)
        number[kept] = np.arange(kept.size)
        row = number[nearest]
        if not kept.size:
            return WrenchBounds.none(len(nodes.s), model.size), None
        return (
            WrenchBounds(
                row, available.normals[kept], available.lower[kept], available.upper[kept],
                by_u, by_x,
            ),
            None,
        )  # fmt: skip

    def _contact(self, nodes: PathNodes) -> Obstacle | None:
        """Return the first contact of cables, platform and boxes, along chords of the path.

        Of straight pieces 20 mm long, else from node to node.
        """
        bent = np.flatnonzero(np.any(nodes.second != 0.0, axis=1))
        chosen = np.union1d(self.looked_at(nodes), bent)
        found = self.model.interference.first_contact(np.ascontiguousarray(nodes.q[chosen]))
        if found is None:
            return None
        line = int(nodes.line[chosen[found.part]])
        return Obstacle(line, found.position, in_words(found.things, found.distance_m))

    def _first(
        self, nodes: PathNodes, one: Obstacle | None, other: Obstacle | None
    ) -> Obstacle | None:
        """Return which of two obstacles comes first along the path."""
        if one is None or other is None:
            return other if one is None else one
        k = self.model.size
        away = [np.abs(nodes.q - each.position[:k]).sum(axis=1).argmin() for each in (one, other)]
        return one if away[0] <= away[1] else other

    def _most_wrench(self, nodes: PathNodes, by_u: FloatArray, by_x: FloatArray) -> FloatArray:
        """Return how large each entry of the wrench can be within the limits, (N, d)."""
        fastest = speed_bounds(nodes, self.limits)[:, None]
        fastest[nodes.runs.ravel()] = 0.0
        with np.errstate(divide="ignore"):
            bend = np.abs(nodes.second) * fastest
            steepest = ((self.limits.acceleration + bend) / np.abs(nodes.first)).min(axis=1)
        return np.asarray(np.abs(by_u) * steepest[:, None] + np.abs(by_x) * fastest)

    def looked_at(self, nodes: PathNodes) -> IntArray:
        """Return nodes not farther from each other than 20 mm, those at stops among them."""
        cell = np.floor(nodes.s / _POSES_m).astype(np.int64)
        fresh = np.concatenate([[True], np.diff(cell) > 0])
        fresh[nodes.runs.ravel()] = True
        return np.flatnonzero(fresh).astype(np.int64)

    def infeasibility(self, position: FloatArray) -> str:
        """Return why the platform is not held at rest at a position (d,)."""
        model = self.model
        workspace = model.workspace(0.0)
        why = workspace.infeasibility(model.pose(position))
        return why or "the motors' torque does not hold it"

    # -- figures

    def _constant_s(self, nodes: PathNodes) -> float:
        """Return the duration at one speed and one acceleration along all of the path."""
        inner = np.ones(len(nodes.s), bool)
        inner[nodes.runs.ravel()] = False
        if not inner.any():
            return float(nodes.dwell_s.sum())
        v = float(np.sqrt(speed_bounds(nodes, self.limits)[inner].min()))
        with np.errstate(divide="ignore"):
            a = float((self.limits.acceleration / np.abs(nodes.first[inner])).min())
        length = nodes.s[nodes.runs[:, 1]] - nodes.s[nodes.runs[:, 0]]
        moving = length[length > 0.0]
        peak = np.minimum(v, np.sqrt(a * moving))
        times = moving / peak + peak / a + self.limits.smoothing_s
        return float(times.sum() + nodes.dwell_s.sum())

    def _slowed(self, nodes: PathNodes) -> int:
        """Return how many moves want more speed than the robot has in any direction."""
        finite = np.isfinite(nodes.speed)
        k = self.model.positions
        most = np.where(
            np.any(nodes.first[:, :k], axis=1),
            np.linalg.norm(self.limits.velocity[:k]),
            np.linalg.norm(self.limits.velocity[k:]) if k < self.model.size else np.inf,
        )
        return int(np.unique(nodes.line[finite & (nodes.speed > most)]).size)
