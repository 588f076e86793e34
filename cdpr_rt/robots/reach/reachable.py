"""Poses that a robot reaches on a straight way: Tremblay (thesis), section 3.4.4, eq. (3.38)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.reach.reach_kernel import CONTACT, NOT_HELD, WHOLE, reach_all
from cdpr_rt.robots.tension.circuit_margin import MOST_NULL_DIRECTIONS

SHARE: Final = 0.95
"""μ of eq. (3.38): how far the platform is sent of a way that ends before its target."""
_AT_ONCE = 512
_MOST_DRAWN = 20
"""Times as many draws as poses are wanted, and that many more, before it is given up."""


@dataclass(frozen=True)
class Reached:
    """Positions (m, d) that are reached, and what became of all that were drawn."""

    positions: FloatArray
    shares: FloatArray
    """Share of the way to the drawn pose that was gone, (m,)."""
    drawn: int
    cut_by_contact: int
    cut_by_tensions: int
    outside: int
    """Number that ended outside the box of targets, or down on the stand, and are left out."""


class Reach:
    """How far straight ways go from a start, with a proof for all places between.

    All tensions stay within their bounds as for targets, with the control's reserve, at full
    acceleration; nothing comes into contact. Positions are those of `PlatformModel`, and ways are
    straight in these, as the program `pose` moves.
    """

    def __init__(self, model: PlatformModel, start: FloatArray | None = None) -> None:
        """Take the position (d,) from which ways lead; home if none is given.

        Raises GeometryError where the platform is not held or in contact there, or hangs on more
        cables than d + 2.
        """
        self.model = model
        self.start = np.array(model.home if start is None else start, float)
        n, d = model.kinematics.n, model.size
        if n > d + MOST_NULL_DIRECTIONS:
            allowed = f"allowed: up to {d + MOST_NULL_DIRECTIONS} to control {d} directions"
            raise GeometryError(f"{n} cables; {allowed}")
        workspace, there = model.workspace(), model.pose(self.start)
        why_not = workspace.infeasibility(there) or model.interference.contact(there.array)
        if why_not:
            place = ", ".join(f"{x:.3f}" for x in there.p[: model.positions])
            raise GeometryError(f"the start at {place} m: {why_not}")
        directions, geometry = model.kinematics.directions, model.about_centre_of_mass.geometry
        self._arrays = np.array(directions), model.interference.scene, geometry, workspace.sets

    def shares(self, ends: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return how much of the way to each of the positions (m, d) is reached, and why no more.

        0 to 1, (m,), and WHOLE, CONTACT or NOT_HELD of `reach_kernel`.
        """
        shares, why = np.zeros(len(ends)), np.zeros(len(ends), np.int64)
        reach_all(
            self.model.home_pose.array, self.start, np.ascontiguousarray(ends, float),
            *self._arrays, shares, why,
        )  # fmt: skip
        return shares, why

    def draw(
        self, count: int, seed: int, angle_rad: float | None = None, share: float = SHARE
    ) -> Reached:
        """Return `count` positions that are reached, drawn at random; the same for the same seed.

        Evenly in the box of targets, turned by up to `angle_rad` from home's orientation, evenly
        as rotation vectors; as far as targets may be turned if left out. Where a way ends before
        its target, `share` of it is gone, eq. (3.38), if that leads into the box. Raises
        GeometryError where hardly anything is reached.
        """
        rng = np.random.default_rng(seed)
        most = self.model.angle_rad if angle_rad is None else angle_rad
        parts: list[tuple[FloatArray, FloatArray]] = []
        drawn = found = outside = 0
        cut = np.zeros(3, np.int64)
        while found < count:
            if drawn > _MOST_DRAWN * (count + _AT_ONCE):
                raise GeometryError(f"of {drawn} ways {found} lead to a target; wanted: {count}")
            ends = self._drawn(rng, min(_AT_ONCE, count - found), most)
            shares, why = self.shares(ends)
            gone = np.where(why == WHOLE, 1.0, share * shares)
            there = self.start + gone[:, None] * (ends - self.start)
            inside = self.are_targets(there)
            drawn, found = drawn + len(ends), found + int(inside.sum())
            outside += len(ends) - int(inside.sum())
            cut += np.bincount(why, minlength=3)
            parts.append((there[inside], gone[inside]))
        positions, gone = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return Reached(positions, gone, drawn, int(cut[CONTACT]), int(cut[NOT_HELD]), outside)

    def _drawn(self, rng: np.random.Generator, m: int, angle_rad: float) -> FloatArray:
        platform, k, d = self.model.platform, self.model.positions, self.model.size
        positions = np.zeros((m, d))
        positions[:, :k] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (m, k))
        if d > k:
            turns = rng.normal(size=(m, d - k))
            turns *= (angle_rad / np.linalg.norm(turns, axis=1))[:, None]
            positions[:, k:] = turns * rng.uniform(0.0, 1.0, (m, 1)) ** (1.0 / (d - k))
        return positions

    def are_targets(self, positions: FloatArray) -> BoolArray:
        """Return which of the positions (m, d) are in the box of targets, and not on the stand."""
        platform, k = self.model.platform, self.model.positions
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        inside = (positions[:, :k] >= low) & (positions[:, :k] <= high)
        return np.asarray(inside.all(axis=1)) & self._clears_stand(positions)

    def _clears_stand(self, positions: FloatArray) -> BoolArray:
        """Return whether a platform that stands at home, under its targets, stays above that.

        Its underside is that of the box around its anchor points, which turning brings lower.
        """
        model, up = self.model, self.model.positions - 1
        platform = model.platform
        if platform.workspace_min_m[up] < platform.home_m[up]:
            return np.ones(len(positions), bool)
        poses = np.concatenate([model.home_pose.array[None], model.poses(positions)])
        under_m = (poses[:, 0, up, None] + poses[:, 1 + up] @ model.corners.T).min(axis=1)
        return np.asarray(under_m[1:] >= under_m[0] + platform.clearance_m)
