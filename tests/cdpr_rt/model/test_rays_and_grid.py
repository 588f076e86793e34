"""Workspaces by rays and by a grid, compared with each other, geometry and published robots."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import platform_model, platform_model_of
from cdpr_rt.model.statics import Box
from cdpr_rt.model.workspace_analysis import (
    Criterion,
    Grid,
    GridJob,
    RayJob,
    Rays,
    WayJob,
    area,
    criterion_of,
    directions,
    grid_points,
    isosurface,
    shape_of,
    turns_within,
    volume,
)


def by_grid(criterion: Criterion, box: Box, cells: int) -> Grid:
    shape = shape_of(box, cells)
    return Grid(box, GridJob(criterion, grid_points(box, shape)).run().reshape(shape))


def by_rays(criterion: Criterion, box: Box, centre: tuple[float, ...], count: int) -> Rays:
    ways = directions(count, len(centre))
    at = np.array(centre)
    return Rays(at, ways, RayJob(criterion, at, ways, box).run())


def hung(exits: FloatArray, mass_kg: float = 10.0) -> Platform:
    """Return a point platform on cables."""
    size = exits.shape[1]
    low, high = exits.min(axis=0).tolist(), exits.max(axis=0).tolist()
    return Platform(
        mass_kg=mass_kg, home_m=tuple(low), home_tolerance_m=0.05, workspace_min_m=tuple(low),
        workspace_max_m=tuple(high), speed_m_s=1.0, acceleration_m_s2=1.0,
        exit_points_m=tuple(map(tuple, exits.tolist())),
        anchor_points_m=((0.0,) * size,) * len(exits),
    )  # fmt: skip


def test_the_workspace_of_a_hanging_point_is_the_prism_below_its_exit_points() -> None:
    exits = np.array([[-3.0, -2.0, 4.0], [2.5, -2.2, 4.0], [3.0, 2.0, 4.0], [-2.0, 2.5, 4.0]])
    x, y = exits[:, 0], exits[:, 1]
    base = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    criterion = Criterion(hung(exits), (0.0,) * 4, (1e9,) * 4, 0.0)
    box = Box((-3.5, -3.0, 0.0), (3.5, 3.0, 3.5))
    grid, rays = by_grid(criterion, box, 40), by_rays(criterion, box, (0.0, 0.0, 1.5), 3000)
    assert grid.size == pytest.approx(3.5 * base, rel=0.01)
    assert rays.size == pytest.approx(3.5 * base, rel=0.02)
    assert grid.cut == ["z low", "z high"]
    assert grid.unseen_share(rays) == 0.0


def test_the_workspace_of_three_cables_is_the_triangle_of_their_exit_points() -> None:
    exits = np.array([[-2.0, 3.0], [2.0, 3.0], [0.0, 0.0]])
    criterion = Criterion(hung(exits, 1e-9), (1e-6,) * 3, (1e6,) * 3, 0.0)
    box = Box((-2.2, -0.2), (2.2, 3.2))
    assert by_rays(criterion, box, (0.0, 2.0), 4000).size == pytest.approx(6.0, rel=2e-3)
    assert by_grid(criterion, box, 200).size == pytest.approx(6.0, rel=0.02)


@pytest.mark.parametrize("name", ["spatial-8", "suspended-8", "planar-4"])
def test_rays_and_grid_find_the_same_volume(name: str) -> None:
    robot = load_robot(name)
    assert robot.platform is not None
    criterion = criterion_of(robot, robot.platform.acceleration_m_s2, np.zeros((1, 3)), 10.0)
    exits = np.array(robot.platform.exit_points_m)
    low = np.append(exits.min(axis=0)[:-1], 0.0)
    box = Box(tuple(low.tolist()), tuple(exits.max(axis=0).tolist()))
    centre = np.add(robot.platform.workspace_min_m, robot.platform.workspace_max_m) / 2.0
    rays = by_rays(criterion, box, tuple(centre.tolist()), 3000)
    grid = by_grid(criterion, box, 40)
    assert rays.size == pytest.approx(grid.size, rel=0.02)
    # rays end at the border or at a side of the box
    at_side = (np.abs(rays.ends_m - box.low_m) < 1e-9) | (np.abs(rays.ends_m - box.high_m) < 1e-9)
    ended = ~at_side.any(axis=1)
    assert ended.sum() > 500
    further = rays.ends_m[ended] + 3e-4 * rays.directions[ended]
    assert (criterion.depths(rays.ends_m) >= -1e-9).all()
    assert (criterion.depths(further) < 0.0).all()


def test_the_total_orientation_workspace_is_the_intersection_of_all_orientations() -> None:
    robot = load_robot("spatial-8")
    assert robot.platform is not None
    turns = turns_within(robot.platform, 0.2)
    assert len(turns) == 29
    assert_allclose(sorted(set(np.linalg.norm(turns, axis=1).round(9))), [0.0, 0.1, 0.2])
    points = np.random.default_rng(3).uniform((-1.0, -1.0, 1.0), (1.0, 1.0, 2.2), (200, 3))
    all_of_them = criterion_of(robot, 1.0, turns, 0.0).depths(points)
    each = [criterion_of(robot, 1.0, turn[None], 0.0).depths(points) for turn in turns]
    assert_allclose(all_of_them, np.min(each, axis=0))
    kept = criterion_of(robot, 1.0, turns, 15.0).depths(points)
    assert_allclose(kept, all_of_them - 15.0)


def test_places_behind_a_contact_can_be_left_out() -> None:
    robot = load_robot("spatial-8")
    turn, centre = np.array([[0.0, 0.0, 0.55]]), np.array([-0.15, 0.1, 1.575])
    criterion = criterion_of(robot, 0.0, turn, 0.0, contact_free=True)
    model = platform_model_of(robot)
    box = Box((-1.5, -1.8, 0.8), (1.2, 1.9, 2.6))
    ways = directions(60, 3)
    lengths = RayJob(criterion, centre, ways, box).run()
    held = RayJob(replace(criterion, contact_free=False), centre, ways, box).run()
    short = lengths < held - 1e-6
    assert 5 < short.sum() < 55
    for way, length, further in zip(ways, lengths, held, strict=True):
        steps = np.arange(0.0, length, 2e-3)
        places = np.hstack([centre + steps[:, None] * way, np.tile(turn[0], (len(steps), 1))])
        clearances, _ = model.interference.clearances(model.poses(places))
        assert (clearances > model.interference.clearance_m - 1e-6).all()
        just = np.concatenate([centre + min(further, length + 2e-3) * way, turn[0]])
        assert (further > length + 2e-3) <= bool(model.interference.contact(model.pose(just).array))
    points = np.array([centre + 0.5 * (lengths + held)[:, None] * ways])[0]
    reached = WayJob(criterion, centre, points).run()
    assert ((reached < 0.0) == short).all()


@dataclass(frozen=True)
class _Shape:
    """A workspace in the shape of a U in a plane, its arms upward."""

    def depths(self, points: FloatArray) -> FloatArray:
        x, y = points.T
        inside = np.minimum(1.0 - np.abs(x), 1.0 - np.abs(y))
        gap = np.minimum(0.4 - np.abs(x), y + 0.4)
        return np.minimum(inside, -gap)

    def clear_shares(self, _: FloatArray, ends_m: FloatArray) -> FloatArray:
        return np.ones(len(ends_m))


def test_regions_no_ray_reaches_are_reported() -> None:
    shape, box = cast(Any, _Shape()), Box((-1.5, -1.5), (1.5, 1.5))
    grid = by_grid(shape, box, 100)
    whole = 4.0 - 0.8 * 1.4
    assert grid.size == pytest.approx(whole, rel=0.01)
    rays = by_rays(shape, box, (-0.7, 0.5), 4000)
    # from the left arm a part of the bottom is visible, and nothing of the right arm
    assert rays.size < 0.75 * whole
    assert grid.unseen_share(rays) == pytest.approx(1.0 - rays.size / whole, abs=0.06)
    assert replace(grid, depths=np.abs(grid.depths)).cut == ["x low", "x high", "y low", "y high"]


def test_ipanema_has_its_published_structure_matrix_and_margin() -> None:
    """Fraunhofer IPA's design as in its WireX: structure matrix, and 5.5 N in the middle."""
    corners = [(-1, 1), (1, 1), (1, -1), (-1, -1)]
    exits = tuple((2.0 * x, 1.5 * y, z) for z in (2.0, 0.0) for x, y in corners)
    anchors = tuple((0.06 * x, 0.06 * y, 0.0) for _ in range(2) for x, y in corners)
    platform = replace(
        hung(np.array(exits), 1e-9), exit_points_m=exits, anchor_points_m=anchors,
        home_m=(0.0, 0.0, 1.0), controlled=("x", "y", "z", "rx", "ry", "rz"),
    )  # fmt: skip
    model = platform_model(platform, np.full(8, 1.0), np.full(8, 10.0))
    W = model.kinematics.wrench_matrix(model.pose(np.array([0.1, 0.2, 1.0])))
    published = [
        [-0.788167814, 0.479082397, 0.386356771, 0.023181406, 0.023181406, 0.018545125],
        [0.756031036, 0.509499177, 0.410886433, 0.024653186, -0.024653186, -0.014791912],
        [0.691748877, -0.616558781, 0.375950476, -0.022557029, -0.022557029, 0.004511406],
        [-0.728051577, -0.585296366, 0.356888028, -0.021413282, 0.021413282, -0.008565313],
    ]
    assert_allclose(W[:, :4].T, published, atol=1e-8)
    criterion = Criterion(platform, (1.0,) * 8, (10.0,) * 8, 0.0)
    assert criterion.depths(np.array([[0.0, 0.0, 1.0]]))[0] == pytest.approx(4.5, abs=1e-6)
    box = Box((-2.0, -1.5, 0.0), (2.0, 1.5, 2.0))
    grid = by_grid(criterion, box, 40)
    where, depth_N = grid.deepest
    assert_allclose(where, [0.0, 0.0, 1.0], atol=1e-9)
    assert depth_N == pytest.approx(4.5, abs=1e-6)
    # the workspace is as symmetrical as the frame
    for axis in range(3):
        assert_allclose(grid.depths, np.flip(grid.depths, axis=axis), atol=1e-6)


def ball(radius: float, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    side = np.linspace(-1.0, 1.0, count)
    x, y, z = np.meshgrid(side, side, side, indexing="ij")
    return radius - np.sqrt(x * x + y * y + z * z), np.full(3, -1.0), np.full(3, side[1] - side[0])


@settings(max_examples=40)
@given(st.tuples(*[st.integers(2, 7)] * 3), st.integers(0, 2**32 - 1), st.floats(-2.0, 2.0))
def test_the_isosurface_of_random_values_is_closed_and_has_its_volume(
    shape: tuple[int, int, int], seed: int, level: float
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=shape) + level
    values[rng.random(shape) < 0.05] = -np.inf
    spacing = rng.uniform(0.1, 2.0, 3)
    vertices, triangles = isosurface(values, rng.normal(size=3), spacing)
    if not (values >= 0.0).any():
        assert not len(triangles)
        return
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert volume(vertices, triangles) == pytest.approx(mesh.volume, rel=1e-9)
    assert volume(vertices, triangles) > 0.0


def test_the_volume_of_a_ball_is_cut_off_at_the_grid() -> None:
    values, low, spacing = ball(0.8, 41)
    whole = volume(*isosurface(values, low, spacing))
    assert whole == pytest.approx(4.0 / 3.0 * math.pi * 0.8**3, rel=5e-3)
    half = volume(*isosurface(values[:21], low, spacing))
    assert half == pytest.approx(0.5 * whole, rel=5e-3)
    assert volume(*isosurface(np.ones((5, 4, 3)), np.zeros(3), np.ones(3))) == pytest.approx(
        4.0 * 3.0 * 2.0, rel=5e-3
    )


def test_the_computed_area_of_a_disc_is_right() -> None:
    values, _, spacing = ball(0.8, 61)
    across = values[:, :, 30]
    assert area(across, spacing[0] ** 2) == pytest.approx(math.pi * 0.64, rel=5e-3)
    across[across < 0.0] = -np.inf
    assert area(across, spacing[0] ** 2) == pytest.approx(math.pi * 0.64, rel=0.08)
    assert area(-np.ones((4, 4)), 1.0) == 0.0
    assert area(np.ones((4, 3)), 1.0) == pytest.approx(6.0)
