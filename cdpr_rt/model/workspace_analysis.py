"""The whole workspace: as a grid, as rays from a centre, and its surface."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.model.platform_model import platform_model, platform_model_of
from cdpr_rt.model.rigid_body import orientations
from cdpr_rt.model.statics import Box, PlatformStatics


@dataclass(frozen=True)
class Criterion:
    """Criterion of a workspace: cables hold the platform at a position in all orientations.

    Tensions carry the weight, with accelerations up to `acceleration_m_s2` and the same share of
    the file's angular acceleration, and keep at least `least_N` from their bounds. At 0 m/s2 this
    gives the static workspace, otherwise the wrench-feasible one. With one orientation it is the
    constant-orientation workspace, with several the total-orientation workspace of these. The
    object can be passed to other processes.
    """

    platform: Platform
    low_N: tuple[float, ...]
    high_N: tuple[float, ...]
    acceleration_m_s2: float
    turns_rad: tuple[tuple[float, ...], ...] = ((0.0, 0.0, 0.0),)
    """Rotation vectors from home's orientation."""
    least_N: float = 0.0
    contact_free: bool = False
    """Whether the straight line from the centre to a position must also be free of contact: cables,
    body and obstacles keep the clearance of the robot's file in each orientation."""

    def depths(self, points: FloatArray) -> FloatArray:
        """Return how far positions (m, k) are inside, N, (m,): the margin minus `least_N`.

        The margin is that of the worst orientation. The result is negative outside, and -inf if the
        cables cannot hold some direction. Contact is ignored.
        """
        statics = self._statics
        workspace = statics.model.workspace(self.acceleration_m_s2, 0.0)
        found = [
            workspace.capacity_margins(statics.poses(points, np.array(turn)))
            for turn in self.turns_rad
        ]
        return np.asarray(np.min(found, axis=0) - self.least_N)

    def clear_shares(self, centre_m: FloatArray, ends_m: FloatArray) -> FloatArray:
        """Return the contact-free shares (m,) of straight lines from a centre to positions.

        Orientation is constant on a way; the share is that of the worst orientation. It is 0 if
        bodies are in contact at the centre. Whole ways are checked because crossing cables are in
        contact for a few millimetres only: contact checks at single positions, however dense, could
        miss the crossing.
        """
        shares = np.ones(len(ends_m))
        model = self._statics.model
        if not self.contact_free or not len(model.interference.pairs):
            return shares
        chosen = [i - 3 for i in model.kinematics.directions if i >= 3]
        for turn in np.array(self.turns_rad):
            start = np.concatenate([centre_m, turn[chosen]])
            if model.interference.contact(model.pose(start).array):
                return np.zeros(len(ends_m))
            way = np.array([start, start])
            for k, end in enumerate(ends_m):
                way[1, : len(end)] = centre_m + shares[k] * (end - centre_m)
                met = model.interference.first_contact(way)
                shares[k] *= met.share if met else 1.0
        return shares

    @property
    def _statics(self) -> PlatformStatics:
        return _statics(self.platform, self.low_N, self.high_N)


def criterion_of(
    robot: Robot,
    acceleration_m_s2: float,
    turns_rad: FloatArray,
    least_N: float,
    contact_free: bool = False,
) -> Criterion:
    """Return the criterion of a robot that has a platform, within its limits."""
    assert robot.platform is not None
    model = platform_model_of(robot)
    low, high = tuple(model.low_N.tolist()), tuple(model.torque_limited_N.tolist())
    turns = tuple(tuple(turn) for turn in np.asarray(turns_rad).tolist())
    return Criterion(robot.platform, low, high, acceleration_m_s2, turns, least_N, contact_free)


def turns_within(platform: Platform, angle_rad: float) -> FloatArray:
    """Return rotation vectors (k, 3) that represent all up to an angle from home's orientation.

    The first is zero. The others have the full angle and half of it, about each controlled axis and
    the diagonals between them.
    """
    whole = orientations(replace(platform, workspace_angle_rad=angle_rad))
    return np.concatenate([whole, 0.5 * whole[1:]])


@lru_cache(maxsize=4)
def _statics(
    platform: Platform, low_N: tuple[float, ...], high_N: tuple[float, ...]
) -> PlatformStatics:
    return PlatformStatics(platform_model(platform, np.array(low_N), np.array(high_N)))


# Surface, volume and area of the region in which values on a grid, interpolated linearly, are not
# negative.

Triangles = NDArray[np.int64]
"""Triples of vertices, anticlockwise as seen from outside, (f, 3)."""
_OUTSIDE = 1e3
_APART = 1e-3
"""Smallest distance of a crossing from both ends of its edge, as a share of the edge, so that no
two crossings coincide."""
_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)])


def isosurface(
    values: FloatArray, low_m: FloatArray, spacing_m: FloatArray
) -> tuple[FloatArray, Triangles]:
    """Return vertices (v, 3) and triangles of the closed surface around values (a, b, c) >= 0.

    Each cell is divided into six tetrahedra around its diagonal (marching tetrahedra). Neighbours
    agree on every face for all values, so there are no gaps. The surface is closed at the sides of
    the grid.
    """
    outside = _outside(values)
    padded = np.pad(np.nan_to_num(values, neginf=outside), 1, constant_values=outside)
    nodes = np.arange(padded.size).reshape(padded.shape)
    flat = padded.ravel()
    edges: list[NDArray[np.int64]] = []
    for axes in itertools.permutations(range(3)):
        corners = _CORNERS[:, np.argsort(axes)]
        tetrahedra = np.stack([_at(nodes, corner).ravel() for corner in corners], axis=1)
        edges += _cut(tetrahedra, flat >= 0.0, _is_even(axes))
    if not edges:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    ends = np.sort(np.concatenate(edges).reshape(-1, 2), axis=1)
    crossed, places = np.unique(ends, axis=0, return_inverse=True)
    a, b = flat[crossed[:, 0]], flat[crossed[:, 1]]
    share = np.clip(a / (a - b), _APART, 1.0 - _APART)[:, None]
    first, last = (
        np.stack(np.unravel_index(crossed[:, k], padded.shape), axis=1) - 1.0 for k in range(2)
    )
    vertices = low_m + spacing_m * (first + share * (last - first))
    return vertices, places.reshape(-1, 3)


def volume(vertices: FloatArray, triangles: Triangles) -> float:
    """Return the volume that a closed surface of triangles encloses, by Gauss' theorem."""
    if not len(triangles):
        return 0.0
    a, b, c = (vertices[triangles[:, k]] - vertices[0] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def area(values: FloatArray, cell_m2: float) -> float:
    """Return the area where values on a grid (a, b) are not negative; a cell is two triangles."""
    v = np.nan_to_num(values, neginf=_outside(values))
    low, high = v[:-1, :-1].ravel(), v[1:, 1:].ravel()
    both = [np.sort(np.stack([low, one.ravel(), high]), axis=0) for one in (v[1:, :-1], v[:-1, 1:])]
    return 0.5 * cell_m2 * sum(float(_share(corners).sum()) for corners in both)


def _outside(values: FloatArray) -> float:
    """Return a negative value for nodes outside the grid that suits any neighbour."""
    finite = np.abs(values[np.isfinite(values)])
    return -_OUTSIDE * max(float(finite.max(initial=0.0)), 1e-9)


def _share(corners: FloatArray) -> FloatArray:
    """Return the nonnegative share of each triangle; values at its `corners` (3, m) ascend."""
    a, b, c = corners
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = c * c / ((c - a) * (c - b)), 1.0 - a * a / ((a - b) * (a - c))
    some = np.where(b < 0.0, one, two)
    return np.where(a >= 0.0, 1.0, np.where(c < 0.0, 0.0, some))


def _at(nodes: NDArray[np.int64], corner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the nodes at one corner of every cell."""
    return nodes[tuple(slice(k, size - 1 + k) for k, size in zip(corner, nodes.shape, strict=True))]


def _is_even(axes: tuple[int, ...]) -> bool:
    return float(np.linalg.det(np.eye(3)[list(axes)])) > 0.0


def _cut(
    tetrahedra: NDArray[np.int64], inside: NDArray[np.bool_], even: bool
) -> list[NDArray[np.int64]]:
    """Return the triangles of all cut tetrahedra (t, 4): (f, 3, 2), both ends of each edge."""
    code = inside[tetrahedra] @ np.array([1, 2, 4, 8])
    found = []
    for case, triangles in _CASES.items():
        cut = tetrahedra[code == case]
        for triangle in triangles if len(cut) else ():
            ordered = triangle if even else triangle[::-1]
            found.append(np.stack([cut[:, list(edge)] for edge in ordered], axis=1))
    return found


def _cases() -> dict[int, list[list[tuple[int, int]]]]:
    """Return the triangles for each set of a tetrahedron's corners inside, as seen from outside."""
    cases: dict[int, list[list[tuple[int, int]]]] = {}
    for case in range(1, 15):
        ins = [k for k in range(4) if case >> k & 1]
        outs = [k for k in range(4) if not case >> k & 1]
        edges = [(i, o) for i in ins for o in outs]
        if len(ins) == 2:
            a, b, c, d = edges
            triangles = [[a, b, d], [a, d, c]]
        else:
            triangles = [edges]
        outward = _CORNERS[outs].mean(axis=0) - _CORNERS[ins].mean(axis=0)
        cases[case] = [edge if _normal(edge) @ outward > 0.0 else edge[::-1] for edge in triangles]
    return cases


def _normal(edges: list[tuple[int, int]]) -> FloatArray:
    a, b, c = (_CORNERS[list(edge)].mean(axis=0) for edge in edges)
    return np.cross(b - a, c - a)


_CASES = _cases()


# The border of a workspace along rays from its centre, found by a search for eq. (3.35), section
# 3.4.2.

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
        """Return the length of each ray up to its first exit from the workspace, m, (m,).

        The result is exact within 0.1 mm. The search may miss gaps narrower than 1/64 of the ray,
        but no contact. The centre has to be inside.
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
    """The border of the part of a workspace that can be reached on straight lines from a centre."""

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
        """Return the reach towards points (m, k): the longest of the k nearest rays."""
        ways = points - self.centre_m
        away = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
        _, nearest = cKDTree(self.directions).query(ways / away, k=len(self.centre_m))
        return np.asarray(self.lengths_m[nearest].max(axis=1))


def directions(count: int, dimensions: int) -> FloatArray:
    """Return evenly spread unit vectors (count, k), in space by a Fibonacci lattice."""
    k = np.arange(count, dtype=np.float64)
    if dimensions == 2:
        angle = 2.0 * math.pi * k / count
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = 1.0 - (2.0 * k + 1.0) / count
    beside, angle = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * k
    return np.stack([beside * np.cos(angle), beside * np.sin(angle), z], axis=1)


def reaches(centre_m: FloatArray, directions: FloatArray, box: Box) -> FloatArray:
    """Return the distances (m,), m, at which rays from a centre inside a box leave the box."""
    sides = np.where(directions > 0.0, np.array(box.high_m), np.array(box.low_m)) - centre_m
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.nanmin(np.where(directions == 0.0, np.inf, sides / directions), axis=1)
        )


# A workspace as the positions of a grid, as ARACHNIS computes it in the thesis, section 3.4.2.


@dataclass(frozen=True)
class GridJob:
    """Some positions (m, k) of a grid."""

    criterion: Criterion
    points: FloatArray

    def run(self) -> FloatArray:
        """Return how far the positions are inside the workspace, N, (m,)."""
        return self.criterion.depths(self.points)


@dataclass(frozen=True)
class WayJob:
    """Straight ways from a centre (k,) to some positions (m, k) of a grid."""

    criterion: Criterion
    centre_m: FloatArray
    points: FloatArray

    def run(self) -> FloatArray:
        """Return 1 for a way without contact, otherwise -1, (m,)."""
        shares = self.criterion.clear_shares(self.centre_m, self.points)
        return np.where(shares < 1.0, -1.0, 1.0)


@dataclass(frozen=True)
class Grid:
    """Positions that fill a box, sides included, and how far each is inside the workspace.

    `depths` (a, b) or (a, b, c), N, as in `Criterion.depths`, go along x, y and z.
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
        """The position (k,) that is furthest inside, and how far it is inside, N."""
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
        """The sides of the box, such as `x low`, that the workspace reaches and may cross."""
        sides = []
        for k, name in zip(range(self.depths.ndim), "xyz", strict=False):
            for end, where in ((0, "low"), (-1, "high")):
                if (self.depths.take(end, axis=k) >= 0.0).any():
                    sides.append(f"{name} {where}")
        return sides

    def unseen_share(self, rays: Rays) -> float:
        """Return the share of the positions inside that no straight line from the centre reaches.

        These are positions farther out than the nearest rays by more than the diagonal of a cell.
        """
        inside = self.points[self.depths.ravel() >= 0.0]
        if not len(inside):
            return 0.0
        away = np.linalg.norm(inside - rays.centre_m, axis=1)
        beyond = away > rays.reach_m(inside) + float(np.linalg.norm(self.spacing_m))
        return float(beyond.mean())


def shape_of(box: Box, cells: int) -> tuple[int, ...]:
    """Return the number of positions along each coordinate for `cells` along the longest side."""
    sides = np.subtract(box.high_m, box.low_m)
    return tuple(max(1, math.ceil(cells * side / sides.max() - 1e-9)) + 1 for side in sides)


def grid_points(box: Box, shape: Sequence[int]) -> FloatArray:
    """Return the positions (m, k) of a grid; the last coordinate changes first."""
    sides = [np.linspace(*side) for side in zip(box.low_m, box.high_m, shape, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(shape))
