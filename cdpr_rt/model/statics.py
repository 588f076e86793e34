"""Static tensions of a robot's cables over its workspace, and their margins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.model.cable_kernel import ARC, CABLE_ROWS, FREE, WEIGHT, run_poses
from cdpr_rt.model.free_rotation_kernel import STEEPNESS, rotation_of, turn_to_rest
from cdpr_rt.model.kinematics import PLANAR_POINT
from cdpr_rt.model.platform_model import PlatformModel, platform_model, platform_model_of
from cdpr_rt.model.rigid_body import home_rotation, in_space, orientations
from cdpr_rt.model.tension_distribution import TensionOutcome

_MARGIN = 0.1
_LEAST_ARM_m = 1e-3
_FINE = {2: 45, 3: 11}
_GRIDS = {2: (25, 25), 3: (9, 9, 9)}
_COARSE_GRIDS = {2: (15, 15), 3: (5, 5, 5)}
_ANY_N = 1e9
NONE_rad = np.zeros(3)
"""The zero rotation vector."""


@dataclass(frozen=True)
class Box:
    """A rectangle in a plane, or a box in space, m."""

    low_m: tuple[float, ...]
    high_m: tuple[float, ...]

    def grid(self, *counts: int) -> FloatArray:
        """Return points that fill the box, edges included, with these counts along each coordinate.

        The shape is the counts in reverse order, then the number of coordinates; in a plane, rows
        come first.
        """
        sides = [np.linspace(*side) for side in zip(self.low_m, self.high_m, counts, strict=True)]
        points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
        return np.asarray(points.transpose(*range(len(counts) - 1, -1, -1), len(counts)))


def view_of(platform: Platform) -> Box:
    """Return a box around all parts of a robot, with some margin."""
    points = np.array(
        [
            *platform.exit_points_m,
            platform.home_m,
            platform.workspace_min_m,
            platform.workspace_max_m,
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    return Box(tuple((low - margin).tolist()), tuple((high + margin).tolist()))


def statics_of(robot: Robot, limits: Limits | None = None) -> PlatformStatics:
    """Return the statics of a robot that has a platform, as `platform_model_of`."""
    return PlatformStatics(platform_model_of(robot, limits))


class PlatformStatics:
    """Tensions of a platform's n cables at any position.

    Methods take arrays of positions (..., dimensions), m. The platform has home's orientation, or
    is turned from it by rotation vectors (k, 3), rad. Eqs. (2.13) to (2.19) and (3.80), with all
    wrenches about the centre of mass.
    """

    def __init__(self, model: PlatformModel) -> None:
        """Take the platform's model."""
        self.model, self.platform = model, model.platform
        platform, size = self.platform, model.positions
        self.low_N, self.high_N = model.low_N, model.high_N
        self.exits_m = np.array(platform.exit_points_m)
        anchors = np.array([in_space(b) for b in platform.anchor_points_m])
        self.anchors_m = (anchors @ home_rotation(platform).T)[:, :size]
        """Anchor points (n, dimensions) from the platform's origin, along the room's axes."""
        self.box = Box(platform.workspace_min_m, platform.workspace_max_m)
        self.turns_freely = model.kinematics.directions == PLANAR_POINT
        """Whether no cable controls the orientation of a planar platform."""
        self.orientations = orientations(platform)
        """Rotation vectors (k, 3) from home that represent the orientations of all targets, zero
        first."""

    def points(self) -> FloatArray:
        """Return positions that fill the box of targets, edges included."""
        grids = _GRIDS if len(self.orientations) == 1 else _COARSE_GRIDS
        return self.box.grid(*grids[len(self.platform.home_m)])

    def lengths(self, position_m: FloatArray, turn_rad: FloatArray = NONE_rad) -> FloatArray:
        """Return the cable lengths (..., n), m, including the parts on the pulleys, eq. (3.2)."""
        return np.asarray(self._cables(position_m, turn_rad)[..., FREE : ARC + 1, :].sum(axis=-2))

    def free_lengths(self, position_m: FloatArray) -> FloatArray:
        """Return the lengths (..., n), m, from pulley or exit point to anchor point."""
        return self._cables(position_m, NONE_rad)[..., FREE, :]

    def rises_N(self, position_m: FloatArray) -> FloatArray:
        """Return the excess of tensions at winches over those in the middle of cables, (..., n).

        They are in N, at home's orientation; see `cable_kernel.tension_rise`.
        """
        cables, weight = self._cables(position_m, NONE_rad), self.model.kinematics.geometry[WEIGHT:]
        return np.asarray(0.5 * cables[..., FREE, :] * (cables[..., :3, :] * weight).sum(axis=-2))

    def _cables(self, position_m: FloatArray, turn_rad: FloatArray) -> FloatArray:
        """Return the rows of `cable_kernel` (..., 9, n)."""
        poses, geometry = self.poses(position_m, turn_rad), self.model.kinematics.geometry
        cables = np.empty((len(poses), CABLE_ROWS, geometry.shape[1]))
        run_poses(geometry, poses, cables)
        return cables.reshape(*np.shape(position_m)[:-1], *cables.shape[1:])

    def poses(self, position_m: FloatArray, turn_rad: FloatArray = NONE_rad) -> FloatArray:
        """Return the poses (m, 4, 3) at all positions."""
        model = self.model
        flat = np.reshape(position_m, (-1, model.positions))
        turn = [turn_rad[i - 3] for i in model.kinematics.directions if i >= 3]
        return model.poses(np.hstack([flat, np.tile(turn, (len(flat), 1))]))

    def margin_N(
        self,
        position_m: FloatArray,
        acceleration_m_s2: float = 0.0,
        turns_rad: FloatArray = NONE_rad,
    ) -> FloatArray:
        """Return the margin (...), N: how far all tensions can stay from both their bounds.

        If it is negative, some tension must be outside its bounds by that much. With an
        acceleration in all directions together, the margin is the least over both signs. If targets
        may be turned, the same share of the angular acceleration is included. The margin is also
        the least over all `turns_rad` (k, 3). It is -inf if the cables cannot hold some direction.
        """
        workspace = self.model.workspace(acceleration_m_s2, 0.0)
        margins = [
            workspace.capacity_margins(self.poses(position_m, turn))
            for turn in np.reshape(turns_rad, (-1, 3))
        ]
        return np.asarray(np.min(margins, axis=0)).reshape(np.shape(position_m)[:-1])

    def is_target(self, position_m: FloatArray, turns_rad: FloatArray = NONE_rad) -> BoolArray:
        """Return whether the cables can hold and accelerate the platform with the reserve.

        They must do so in each orientation of `turns_rad` (k, 3).
        """
        moving = self.model.workspace(self.platform.acceleration_m_s2, 0.0)
        reserve_N, places = self.model.reserve_N, np.reshape(position_m, (-1, self.model.positions))
        held = np.ones(len(places), bool)
        for turn in np.reshape(turns_rad, (-1, 3)):
            left = np.flatnonzero(held)
            margins_N = moving.capacity_margins(self.poses(places[left], turn), reserve_N)
            held[left] = margins_N >= reserve_N
        return held.reshape(np.shape(position_m)[:-1])

    def tensions_N(self, position_m: FloatArray, turn_rad: FloatArray = NONE_rad) -> FloatArray:
        """Return the tensions (..., n) at rest with the largest margin to their bounds."""
        _, tensions = self.model.workspace(0.0, 0.0).margins(self.poses(position_m, turn_rad))
        return tensions.reshape(*np.shape(position_m)[:-1], -1)

    def least_tensions_N(self, position_m: FloatArray, reserve_N: float = 0.0) -> FloatArray:
        """Return the tensions (..., n) at rest nearest to the lower bounds plus a reserve.

        The orientation is that of home. No tension is below that sum; nan if no such tensions
        exist.
        """
        n, low = self.model.kinematics.n, self.low_N + reserve_N
        still = self.model.workspace(0.0)
        least, weight = self.model.least_tensions(low, np.full(n, _ANY_N)), still.wrenches[0]
        t, poses = np.zeros(n), self.poses(position_m)
        matrices, hanging = still.wrench_matrices(poses), still.hanging_wrenches(poses)
        found = np.full((len(matrices), n), np.nan)
        for k, W in enumerate(matrices):
            if least.solve(W, weight + hanging[k], t) is TensionOutcome.FEASIBLE:
                found[k] = t
        return found.reshape(*np.shape(position_m)[:-1], n)

    def angle_rad(self, position_m: FloatArray) -> FloatArray:
        """Return the rotation (...) at rest of a platform that `turns_freely`, nan if it topples.

        No cable controls its orientation, so it turns until the tensions exert no moment.
        """
        poses, tensions = self.poses(position_m), self.tensions_N(position_m)
        angle, about = np.zeros(len(poses)), rotation_of(self.platform)
        if (
            np.linalg.norm(self.anchors_m, axis=1).max() >= _LEAST_ARM_m
        ):  # otherwise the platform is a point
            geometry, n = self.model.kinematics.geometry, tensions.shape[-1]
            for k, t in enumerate(tensions.reshape(-1, n)):
                angle[k] = turn_to_rest(geometry, t, poses[k], about)
                if not (about[STEEPNESS] > 0.0 and abs(angle[k]) < 0.5 * np.pi):
                    angle[k] = np.nan
        return angle.reshape(np.shape(position_m)[:-1])

    def largest_box(self, inside: Box) -> Box | None:
        """Return the largest box within `inside` in which all positions are targets; or None.

        All orientations of targets are checked. The resolution is a grid of 45 by 45 points, in
        space 11 by 11 by 11. The control's reserve depends on the middle of the box. While the
        reserve of the result exceeds the assumed one, the search continues within the result.
        """
        statics = self
        while (box := statics.largest_held(inside)) is not None:
            statics = self._with_box(box)
            if bool(statics.is_target(statics._fine(box), self.orientations).all()):
                return box
            inside = box
        return None

    def _with_box(self, box: Box) -> PlatformStatics:
        platform = replace(self.platform, workspace_min_m=box.low_m, workspace_max_m=box.high_m)
        bounds = (self.low_N, self.high_N, self.model.torque_limited_N)
        return PlatformStatics(platform_model(platform, *bounds))

    def _fine(self, box: Box) -> FloatArray:
        return box.grid(*(_FINE[len(box.low_m)] for _ in box.low_m))

    def largest_held(self, inside: Box) -> Box | None:
        """Return the largest box within this one in which the cables hold the platform.

        They hold it with the reserve of this box.
        """
        points = self._fine(inside)
        good = self.is_target(points, self.orientations)
        best, found = 0, None
        for ends, rest in _slabs(good):
            for more, row in [((), rest)] if rest.ndim == 1 else list(_slabs(rest)):
                run = _longest_run(row)
                sides = (ends, *([more] if more else []), run)
                size = math.prod(last - first for first, last in sides)
                if size > best:
                    best, found = size, sides
        if found is None:
            return None
        low, high = (points[tuple(side[end] for side in found)] for end in (0, 1))
        return Box(tuple(low.tolist()), tuple(high.tolist()))


def _slabs(
    good: BoolArray,
) -> Iterator[tuple[tuple[int, int], BoolArray]]:
    """Yield (first, last) along the first coordinate, and which entries are good throughout."""
    for first in range(len(good)):
        rest = np.ones(good.shape[1:], bool)
        for last in range(first, len(good)):
            rest = rest & good[last]
            yield (first, last), rest


def _longest_run(good: BoolArray) -> tuple[int, int]:
    """Return the first and the last index of the longest run of True, or 0 and 0.

    Of runs with the same length, the one nearest to the middle is used.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    if not edges.size:
        return 0, 0
    first, last = edges[::2], edges[1::2] - 1
    aside = np.abs(first + last - (good.size - 1)) / (4.0 * good.size)
    best = int((last - first - aside).argmax())
    return int(first[best]), int(last[best])
