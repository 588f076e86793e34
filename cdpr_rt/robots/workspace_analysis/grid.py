"""A workspace by the places of a grid, as ARACHNIS does it in the thesis, section 3.4.2."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.statics import Box
from cdpr_rt.robots.workspace_analysis.criterion import Criterion
from cdpr_rt.robots.workspace_analysis.rays import Rays
from cdpr_rt.robots.workspace_analysis.surface import Triangles, area, isosurface, volume


@dataclass(frozen=True)
class GridJob:
    """Some places (m, k) of a grid."""

    criterion: Criterion
    points: FloatArray

    def run(self) -> FloatArray:
        """Return how far they are inside, N, (m,)."""
        return self.criterion.depths(self.points)


@dataclass(frozen=True)
class WayJob:
    """Straight ways from a centre (k,) to some places (m, k) of a grid."""

    criterion: Criterion
    centre_m: FloatArray
    points: FloatArray

    def run(self) -> FloatArray:
        """Return 1 where the way is free of contact, else -1, (m,)."""
        shares = self.criterion.clear_shares(self.centre_m, self.points)
        return np.where(shares < 1.0, -1.0, 1.0)


@dataclass(frozen=True)
class Grid:
    """Places that fill a box, its sides among them, and how far each of them is inside.

    `depths` (a, b) or (a, b, c), N, as of `Criterion.depths`, go along x, y and z.
    """

    box: Box
    depths: FloatArray

    @property
    def spacing_m(self) -> FloatArray:
        """Spacing along each coordinate, (k,)."""
        sides = np.subtract(self.box.high_m, self.box.low_m)
        return np.asarray(sides / (np.array(self.depths.shape) - 1))

    @property
    def points(self) -> FloatArray:
        """The places, (m, k)."""
        return grid_points(self.box, self.depths.shape)

    @property
    def deepest(self) -> tuple[FloatArray, float]:
        """The place (k,) that is furthest inside, and how far, N."""
        k = int(self.depths.argmax())
        return self.points[k], float(self.depths.flat[k])

    @cached_property
    def surface(self) -> tuple[FloatArray, Triangles]:
        """Vertices and triangles of the closed surface around the workspace, in space."""
        return isosurface(self.depths, np.array(self.box.low_m), self.spacing_m)

    @cached_property
    def size(self) -> float:
        """The volume within that surface, m3; in a plane the area, m2."""
        if self.depths.ndim == 3:
            return volume(*self.surface)
        return area(self.depths, float(self.spacing_m.prod()))

    @property
    def cut(self) -> list[str]:
        """The sides of the box that the workspace reaches: it may go on beyond, `x low` and so."""
        sides = []
        for k, name in zip(range(self.depths.ndim), "xyz", strict=False):
            for end, where in ((0, "low"), (-1, "high")):
                if (self.depths.take(end, axis=k) >= 0.0).any():
                    sides.append(f"{name} {where}")
        return sides

    def unseen_share(self, rays: Rays) -> float:
        """Return the share of the places inside that no straight line from the centre reaches.

        Those only that are further than the nearest rays by more than a diagonal of a cell.
        """
        inside = self.points[self.depths.ravel() >= 0.0]
        if not len(inside):
            return 0.0
        away = np.linalg.norm(inside - rays.centre_m, axis=1)
        beyond = away > rays.reach_m(inside) + float(np.linalg.norm(self.spacing_m))
        return float(beyond.mean())


def shape_of(box: Box, cells: int) -> tuple[int, ...]:
    """Return how many places along each coordinate make so many cells along the longest side."""
    sides = np.subtract(box.high_m, box.low_m)
    return tuple(max(1, math.ceil(cells * side / sides.max() - 1e-9)) + 1 for side in sides)


def grid_points(box: Box, shape: Sequence[int]) -> FloatArray:
    """Return the places (m, k) of a grid, the last coordinate changing first."""
    sides = [np.linspace(*side) for side in zip(box.low_m, box.high_m, shape, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(shape))
