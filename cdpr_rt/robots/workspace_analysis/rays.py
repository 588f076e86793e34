"""The border of a workspace along rays from its centre, eq. (3.35) as a search, section 3.4.2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.robots.statics import Box
from cdpr_rt.robots.workspace_analysis.criterion import Criterion
from cdpr_rt.robots.workspace_analysis.surface import Triangles, volume

_STEPS = 64
_EXACT_m = 1e-4


@dataclass(frozen=True)
class RayJob:
    """Some rays from a centre (k,) along unit vectors (m, k), searched up to the sides of a box."""

    criterion: Criterion
    centre_m: FloatArray
    directions: FloatArray
    box: Box

    def run(self) -> FloatArray:
        """Return the length of each ray up to where it first leaves the workspace, m, (m,).

        Within 0.1 mm, but for gaps narrower than 1/64 of the ray, of which contact is none; the
        centre has to be inside.
        """
        reach = reaches(self.centre_m, self.directions, self.box)
        inside, outside = np.zeros(len(reach)), np.full(len(reach), np.inf)
        going = np.arange(len(reach))
        for k in range(1, _STEPS + 1):
            there = reach[going] * (k / _STEPS)
            held = self._held(going, there)
            inside[going[held]], outside[going[~held]] = there[held], there[~held]
            going = going[held]
        ended = np.flatnonzero(np.isfinite(outside))
        for _ in range(math.ceil(math.log2(max(reach.max() / _STEPS / _EXACT_m, 1.0)))):
            middle = 0.5 * (inside[ended] + outside[ended])
            held = self._held(ended, middle)
            inside[ended[held]], outside[ended[~held]] = middle[held], middle[~held]
        ends = self.centre_m + inside[:, None] * self.directions
        return inside * self.criterion.clear_shares(self.centre_m, ends)

    def _held(self, rays: IntArray, there: FloatArray) -> BoolArray:
        points = self.centre_m + there[:, None] * self.directions[rays]
        return np.asarray(self.criterion.depths(points) >= 0.0)


@dataclass(frozen=True)
class Rays:
    """The border of the part of a workspace that straight lines from a centre reach."""

    centre_m: FloatArray
    directions: FloatArray
    lengths_m: FloatArray

    @property
    def ends_m(self) -> FloatArray:
        """End points of the rays, (m, k)."""
        return np.asarray(self.centre_m + self.lengths_m[:, None] * self.directions)

    @cached_property
    def triangles(self) -> Triangles:
        """The closed surface over the ends of rays in space."""
        d = self.directions
        triangles = ConvexHull(d).simplices.astype(np.int64)
        a, b, c = (d[triangles[:, k]] for k in range(3))
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
        triangles[inward] = triangles[inward][:, ::-1]
        return triangles

    @property
    def size(self) -> float:
        """The volume within that surface, m3; in a plane the area of the polygon, m2."""
        if len(self.centre_m) == 3:
            return volume(self.ends_m, self.triangles)
        turn = 2.0 * math.pi / len(self.lengths_m)
        return 0.5 * math.sin(turn) * float(self.lengths_m @ np.roll(self.lengths_m, -1))

    def reach_m(self, points: FloatArray) -> FloatArray:
        """Return how far rays go in the directions of points (m, k): the furthest of the nearest.

        Those nearest to a direction are as many as there are coordinates.
        """
        ways = points - self.centre_m
        away = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
        _, nearest = cKDTree(self.directions).query(ways / away, k=len(self.centre_m))
        return np.asarray(self.lengths_m[nearest].max(axis=1))


def directions(count: int, dimensions: int) -> FloatArray:
    """Return unit vectors (count, k) spread evenly: in space a Fibonacci lattice."""
    k = np.arange(count, dtype=np.float64)
    if dimensions == 2:
        angle = 2.0 * math.pi * k / count
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = 1.0 - (2.0 * k + 1.0) / count
    beside, angle = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * k
    return np.stack([beside * np.cos(angle), beside * np.sin(angle), z], axis=1)


def reaches(centre_m: FloatArray, directions: FloatArray, box: Box) -> FloatArray:
    """Return how far rays from a centre within a box go before they leave the box, m, (m,)."""
    sides = np.where(directions > 0.0, np.array(box.high_m), np.array(box.low_m)) - centre_m
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.nanmin(np.where(directions == 0.0, np.inf, sides / directions), axis=1)
        )
