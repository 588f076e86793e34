"""A path for one robot: from its file to samples in time, or to the first infeasible position."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.model.interference import in_words
from cdpr_rt.model.path_wrenches import InertialWrenches, available_wrenches
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_rt.model.rigid_body import G_m_s2
from cdpr_rt.motion import time_scaling
from cdpr_rt.motion.path_description import Coordinates, PathDescription, PathError
from cdpr_rt.motion.path_nodes import MOST_NODES, EXACT_m, NODE_m, PathNodes, nodes_of

# Paths in wrong units, which are too large or too small by a factor of 25.4 or 1000 for the robot's
# workspace. A mistake is reported only if the path fits after its correction.

_FACTORS: Final = {
    1.0 / 25.4: "25.4 times too large: mm read as inches (G20 instead of G21)",
    1.0 / 1000.0: "1000 times too large: mm read as m",
    25.4: "25.4 times too small: inches read as mm (G21 instead of G20)",
    1000.0: "1000 times too small: m read as mm",
}
_SMALL: Final = 0.04
"""A path not larger than this share of the workspace may have wrong units."""


def size_fault(path: PathDescription, low_m: FloatArray, high_m: FloatArray) -> None:
    """Raise PathError if a path fits the workspace's box only after a correction of its units."""
    k = path.coordinates.positions
    points = path.points[:, :k]
    inside = ((points >= low_m) & (points <= high_m)).all(axis=1)
    if inside.all() or path.in_room:  # wrong units do not explain positions in the room
        return
    size, room = np.ptp(points, axis=0), high_m - low_m
    line = path.lines[int((~inside).argmax())]
    for factor, text in _FACTORS.items():
        scaled = factor * points
        if ((scaled >= low_m) & (scaled <= high_m)).all():
            raise PathError(path.source, line, f"the path is {text}")
    if (size > room).any():
        for factor, text in _FACTORS.items():
            if factor < 1.0 and (factor * size <= room).all():
                raise PathError(
                    path.source, line,
                    f"the path is {_text(size)}, the workspace {_text(room)}; perhaps {text}",
                )  # fmt: skip
        raise PathError(
            path.source,
            line,
            f"the path is {_text(size)}; allowed: {_text(room)}, the workspace",
        )


def size_note(path: PathDescription, low_m: FloatArray, high_m: FloatArray) -> str:
    """Return a warning about units if a path is very small for the box, else ""."""
    points = path.points[:, : path.coordinates.positions]
    size, room = np.ptp(points, axis=0), high_m - low_m
    if not size.any() or (size > _SMALL * room).any():
        return ""
    return (
        f"the whole path is only {_text(size)}, in a workspace of {_text(room)}: are "
        "its units right?"
    )


def _text(size_m: FloatArray) -> str:
    return " x ".join(f"{1e3 * value:.4g}" for value in size_m) + " mm"


LONGEST_s: Final = time_scaling.MOST_SAMPLES * time_scaling.PERIOD_S
"""Longest duration of one plan; a longer path needs several."""
MOST_WAITS: Final = 60
_POSES_m: Final = 0.02
"""Largest distance between the poses at which wrenches and contacts are checked."""
_ROUNDING_m: Final = 1e-8
"""Tolerance of a position at the sides of the box, in m and rad."""

Advance = Callable[[str, float], None]
"""Function that is called with the present step and the completed share of the whole."""


@dataclass(frozen=True)
class Obstacle:
    """The first infeasible position of a path."""

    line: int
    """Line in the path's file."""
    position: FloatArray
    """(d,)"""
    text: str


@dataclass(frozen=True)
class PathPlan:
    """A path that a robot can follow, unless there is an obstacle."""

    path: PathDescription
    nodes: PathNodes
    limits: time_scaling.PathLimits
    obstacle: Obstacle | None
    timed: time_scaling.TimedPath | None
    """The path in time; None if the obstacle was found before timing."""
    constant_s: float
    """Duration at a constant speed and acceleration that all positions allow."""
    slowed: int
    """Number of moves whose wanted speed the robot never reaches."""
    next_line: int | None = None
    """Line of the file at which the next plan continues, None if this one ends the path."""

    @property
    def deviation_m(self) -> float:
        """Largest distance of the set-point from the file's path, including cut corners."""
        return self.nodes.deviation_m + (self.timed.departure_m if self.timed else 0.0)


class PathPlanner:
    """Plans paths for one robot with a platform."""

    def __init__(self, robot: Robot) -> None:
        """Raises PathError for a robot without a platform."""
        platform = robot.platform
        if platform is None:
            raise PathError(robot.path, 0, NO_PLATFORM)
        self.model: PlatformModel = platform_model_of(robot)
        self.platform = platform
        self.limits = time_scaling.PathLimits(
            self.model.speed, self.model.acceleration, self.model.jerk
        )
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        reference = np.zeros(self.model.size)
        reference[: self.model.positions] = np.clip(platform.home_m, low, high)
        self.coordinates = Coordinates(platform.controlled, reference)

    def plan(
        self,
        path: PathDescription,
        advance: Advance = lambda _what, _part: None,
        first_line: int = 0,
    ) -> PathPlan:
        """Return the plan of a path from a line on, as much of it as fits into one plan.

        The platform rests at the end of the plan. The first plan of a path also checks the
        positions of the later ones. Raises PathError for a path with wrong units.
        """
        advance("corners", 0.0)
        size_fault(path, *self._box())
        if not np.ptp(path.points, axis=0).any() and all(move.arc is None for move in path.moves):
            raise PathError(path.source, path.start_line, "the file contains no move")
        begin = path.index_of(first_line)
        ends = self._divide(path, begin)
        end = ends[0]
        while True:
            plan = self._plan_part(path.part(begin, end), advance)
            if plan is not None:
                break
            end = self._earlier(path, begin, end)
        for one, other in itertools.pairwise(ends):
            if begin or plan.obstacle is not None:
                break
            advance("the part that follows", 0.7)
            later = path.part(one, other)
            nodes = nodes_of(later, self.model.wrench_scale)
            plan = replace(plan, obstacle=self._obstacle(nodes)[1])
            if plan.obstacle is not None:
                return replace(plan, path=later, nodes=nodes, timed=None)
        return replace(plan, next_line=path.moves[end].line if end < len(path.moves) else None)

    def _plan_part(self, path: PathDescription, advance: Advance) -> PathPlan | None:
        """Return the plan of a path, None if it takes too long."""
        nodes = nodes_of(path, self.model.wrench_scale)
        advance("tensions", 0.1)
        wrenches, obstacle = self._obstacle(nodes)
        if obstacle is not None:
            return PathPlan(path, nodes, self.limits, obstacle, None, np.nan, 0)
        if self._least_s(nodes) > LONGEST_s:
            return None
        advance("time", 0.3)
        timed = time_scaling.time_path(nodes, self.limits, wrenches)
        if timed.duration_s > LONGEST_s:
            return None
        if timed.departure_m > EXACT_m:
            raise PathError(
                path.source, int(nodes.line[timed.departs]),
                f"the set-point would be {1e3 * timed.departure_m:.4g} mm from the path; allowed: "
                f"{1e3 * EXACT_m:g} mm: lower F",
            )  # fmt: skip
        return PathPlan(
            path, nodes, self.limits, None, timed, self._constant_s(nodes), self._slowed(nodes)
        )

    # -- parts

    def _divide(self, path: PathDescription, begin: int) -> list[int]:
        """Return where plans end, as numbers of moves; each plan is as long as allowed.

        The shortest times of moves are added up to half the longest plan, to leave time for
        braking. Raises PathError for a move that takes too long.
        """
        k = self.model.positions
        points = path.points
        away = np.diff(points, axis=0)[begin:]
        moved = np.linalg.norm(away[:, :k], axis=1)
        for i, move in enumerate(path.moves[begin:]):
            if move.arc is not None:
                arm = move.arc.arm_m(points[begin + i, :k])
                moved[i] = max(moved[i], abs(move.arc.angle_rad) * np.linalg.norm(arm))
        turned = np.linalg.norm(away[:, k:], axis=1)
        speed = np.array([move.speed for move in path.moves[begin:]])
        fastest = np.linalg.norm(self.limits.velocity[:k]), np.linalg.norm(self.limits.velocity[k:])
        seconds = moved / np.minimum(speed, fastest[0])
        if turned.any():
            seconds = np.maximum(seconds, turned / fastest[1])
            seconds = np.where(moved > 0.0, seconds, turned / np.minimum(speed, fastest[1]))
        seconds += [move.dwell_s for move in path.moves[begin:]]
        if (seconds > LONGEST_s).any():
            i = begin + int(seconds.argmax())
            raise self._too_long(path, i, float(seconds.max()))
        used = seconds / (0.5 * LONGEST_s) + (moved / NODE_m + 20.0) / (0.5 * MOST_NODES)
        used += [move.waits / MOST_WAITS for move in path.moves[begin:]]
        ends, total = [], 0.0
        lines = [move.line for move in path.moves[begin:]]
        for i, share in enumerate(used):
            total += share
            # plans end only between lines, so that a line number says where to continue
            if total > 1.0 and i and lines[i] != lines[i - 1]:
                ends.append(begin + i)
                total = float(share)
        return [*ends, len(path.moves)]

    def _earlier(self, path: PathDescription, begin: int, end: int) -> int:
        """Return an earlier end of a part that takes too long; raises PathError if none exists."""
        moves = path.moves
        middle = (begin + end + 1) // 2
        while middle < end and moves[middle].line == moves[middle - 1].line:
            middle += 1
        if middle >= end:
            raise self._too_long(path, begin, math.inf)
        return middle

    def _too_long(self, path: PathDescription, i: int, seconds: float) -> PathError:
        takes = (
            f"takes {seconds / 60.0:.3g} min or more" if math.isfinite(seconds) else "is too long"
        )
        most = f"{LONGEST_s / 60.0:.3g} min"
        return PathError(
            path.source, path.moves[i].line, f"{takes}; divide it into parts of up to {most}"
        )

    def _least_s(self, nodes: PathNodes) -> float:
        """Return a lower bound for the duration of a path."""
        fastest = np.sqrt(time_scaling.speed_bounds(nodes, self.limits))
        step = np.diff(nodes.s)
        moves = step > 0.0
        least_s = nodes.dwell_s.sum()
        with np.errstate(divide="ignore"):
            least_s += (step[moves] / np.maximum(fastest[1:], fastest[:-1])[moves]).sum()
        return float(least_s)

    # -- where it cannot be

    def _box(self) -> tuple[FloatArray, FloatArray]:
        platform = self.platform
        return np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)

    def _obstacle(self, nodes: PathNodes) -> tuple[time_scaling.WrenchBounds, Obstacle | None]:
        """Return the bounds of wrenches along the path, and its first infeasible place."""
        outside = self._outside(nodes, *self._box())
        if outside is not None:
            return time_scaling.WrenchBounds.none(0, self.model.size), outside
        wrenches, obstacle = self._wrenches(nodes)
        return wrenches, self._first(nodes, obstacle, self._contact(nodes))

    def _outside(self, nodes: PathNodes, low: FloatArray, high: FloatArray) -> Obstacle | None:
        """Return the first position outside the box of targets or turned too far.

        The curve between two nodes is checked at four positions.
        """
        first: tuple[float, Obstacle] | None = None
        for part in (0.0, 0.25, 0.5, 0.75):
            places = nodes.q if part == 0.0 else nodes.between(part)
            found = self._first_outside(places, low, high)
            if found is None or (first is not None and first[0] <= found[0] + part):
                continue
            i, text = found
            # the interval after a node belongs to the line of the next node
            line = int(nodes.line[i if part == 0.0 else min(i + 1, len(nodes.line) - 1)])
            first = i + part, Obstacle(line, places[i].copy(), text)
        return None if first is None else first[1]

    def _first_outside(
        self, q: FloatArray, low: FloatArray, high: FloatArray
    ) -> tuple[int, str] | None:
        """Return the first of the positions (n, d) that is out of bounds, and why."""
        k, names = self.model.positions, self.coordinates.names
        place = q[:, :k]
        out = (place < low - _ROUNDING_m) | (place > high + _ROUNDING_m)
        angle, most = np.linalg.norm(q[:, k:], axis=1), self.model.angle_rad
        far = angle > most + _ROUNDING_m
        wrong = np.flatnonzero(out.any(axis=1) | far)
        if not wrong.size:
            return None
        i = int(wrong[0])
        if far[i]:
            return i, (
                f"turned by {np.degrees(angle[i]):.4g} deg from the orientation at home; allowed: "
                f"up to {np.degrees(most):.4g} deg"
            )
        j = int(out[i].argmax())
        return i, (
            f"{names[j]} {1e3 * place[i, j]:.6g} mm is outside; allowed: {1e3 * low[j]:g} to "
            f"{1e3 * high[j]:g} mm, the workspace"
        )

    def _wrenches(self, nodes: PathNodes) -> tuple[time_scaling.WrenchBounds, Obstacle | None]:
        """Return the bounds of wrenches along the path, or the first infeasible position."""
        model = self.model
        chosen = self.looked_at(nodes)
        positions = nodes.q[chosen]
        available = available_wrenches(model, positions)
        if not available.holds.all():
            i = int((~available.holds).argmax())
            why = self.infeasibility(positions[i])
            return time_scaling.WrenchBounds.none(0, model.size), Obstacle(
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
            return time_scaling.WrenchBounds.none(len(nodes.s), model.size), None
        return (
            time_scaling.WrenchBounds(
                row, available.normals[kept], available.lower[kept], available.upper[kept],
                by_u, by_x,
            ),
            None,
        )  # fmt: skip

    def _contact(self, nodes: PathNodes) -> Obstacle | None:
        """Return the first contact of cables, platform and boxes, along chords of the path.

        Chords are 20 mm long on straight pieces, else from node to node.
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
        """Return the largest value of each entry of the wrench within the limits, (N, d)."""
        fastest = time_scaling.speed_bounds(nodes, self.limits)[:, None]
        fastest[nodes.runs.ravel()] = 0.0
        with np.errstate(divide="ignore"):
            bend = np.abs(nodes.second) * fastest
            steepest = ((self.limits.acceleration + bend) / np.abs(nodes.first)).min(axis=1)
        steepest[~nodes.first.any(axis=1)] = 0.0  # a part that rests only
        return np.asarray(np.abs(by_u) * steepest[:, None] + np.abs(by_x) * fastest)

    def looked_at(self, nodes: PathNodes) -> IntArray:
        """Return nodes that are at most 20 mm apart, including those at stops."""
        cell = np.floor(nodes.s / _POSES_m).astype(np.int64)
        fresh = np.concatenate([[True], np.diff(cell) > 0])
        fresh[nodes.runs.ravel()] = True
        return np.flatnonzero(fresh).astype(np.int64)

    def infeasibility(self, position: FloatArray) -> str:
        """Return the reason why the cables cannot hold the platform at rest at a position (d,)."""
        model = self.model
        workspace = model.workspace(0.0)
        why = workspace.infeasibility(model.pose(position))
        return why or "the torque of the motors cannot hold it"

    # -- figures

    def _constant_s(self, nodes: PathNodes) -> float:
        """Return the duration at one speed and one acceleration along all of the path."""
        inner = np.ones(len(nodes.s), bool)
        inner[nodes.runs.ravel()] = False
        if not inner.any():
            return float(nodes.dwell_s.sum())
        v = float(np.sqrt(time_scaling.speed_bounds(nodes, self.limits)[inner].min()))
        with np.errstate(divide="ignore"):
            a = float((self.limits.acceleration / np.abs(nodes.first[inner])).min())
        length = nodes.s[nodes.runs[:, 1]] - nodes.s[nodes.runs[:, 0]]
        moving = length[length > 0.0]
        peak = np.minimum(v, np.sqrt(a * moving))
        times = moving / peak + peak / a + self.limits.smoothing_s
        return float(times.sum() + nodes.dwell_s.sum())

    def _slowed(self, nodes: PathNodes) -> int:
        """Return the number of moves that require more speed than the robot has."""
        finite = np.isfinite(nodes.speed)
        k = self.model.positions
        most = np.where(
            np.any(nodes.first[:, :k], axis=1),
            np.linalg.norm(self.limits.velocity[:k]),
            np.linalg.norm(self.limits.velocity[k:]) if k < self.model.size else np.inf,
        )
        return int(np.unique(nodes.line[finite & (nodes.speed > most)]).size)


# The tensions along a planned path, by the robot's own distribution.

_MOST: Final = 20_000


@dataclass(frozen=True)
class PathTensions:
    """Tensions at a plan's samples, or at evenly chosen ones if there are too many."""

    sample: IntArray
    """Indices of these samples, (m,)."""
    tension_N: FloatArray
    """(m, n)"""
    low_N: FloatArray
    """Bounds used for planning: the file's, reduced by the control's reserve, (n,)."""
    high_N: FloatArray
    carried: BoolArray
    """Whether tensions are within these bounds, (m,)."""


def path_tensions(model: PlatformModel, timed: time_scaling.TimedPath) -> PathTensions:
    """Return the tensions along a plan, within the limits of the motors' torque."""
    step = -(-len(timed.samples) // _MOST)
    chosen = np.arange(0, len(timed.samples), step)
    q, v, a = (np.ascontiguousarray(timed.samples[chosen, i]) for i in range(3))
    low, high = model.low_N + model.reserve_N, model.torque_limited_N - model.reserve_N
    weight = np.zeros(6)
    weight[model.positions - 1] = -model.platform.mass_kg * G_m_s2
    others = weight[list(model.kinematics.directions)] - InertialWrenches(model, q).of(v, a)
    tension, carried = model.planned_tensions(model.poses(q), others)
    return PathTensions(chosen, tension, low, high, carried)
