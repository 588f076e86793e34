"""Search a robot's workspace, by a grid and by rays, in jobs for any number of processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.statics import Box
from cdpr_rt.model.workspace_analysis import (
    Criterion,
    Grid,
    GridJob,
    RayJob,
    Rays,
    WayJob,
    directions,
    grid_points,
    shape_of,
)
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes import Job, Runner, cores, runner

_CHECKS_A_JOB = 100_000
_CHECKS_A_RAY = 80
_WAYS_A_JOB = 5_000
_WORTH_PROCESSES = 1_000_000
"""Number of poses from which other processes save more time than they take to start."""
_CHECKS_A_SECOND = 100_000.0


@dataclass(frozen=True)
class Search:
    """How a workspace is searched."""

    criterion: Criterion
    box: Box
    cells: int
    """Number of grid cells along the longest side of the box."""
    rays: int
    centre_m: FloatArray | None
    """Where rays start; by default the middle of the box of targets, else the deepest place."""
    workers: int | None
    cluster: str | None


@dataclass(frozen=True)
class Found:
    """A workspace by grid and by rays, with the same criterion."""

    grid: Grid
    rays: Rays


def search(settings: Search, out: Output) -> Found:
    """Search the workspace; raises CommandError if it is empty or the centre is outside."""
    shape = shape_of(settings.box, settings.cells)
    turns = len(settings.criterion.turns_rad)
    checks = turns * (int(np.prod(shape)) + _CHECKS_A_RAY * settings.rays)
    usual = 1 if checks < _WORTH_PROCESSES else cores()
    with (
        runner(settings.workers or usual, settings.cluster) as run,
        out.progress("poses", checks / _CHECKS_A_SECOND) as advance,
    ):

        def computed(jobs: Sequence[Job[FloatArray]], first: int, each: int) -> FloatArray:
            results = []
            for k, result in enumerate(run(jobs), start=1):
                results.append(result)
                advance(turns * (first + k * each) / _CHECKS_A_SECOND)
            return np.concatenate(results)

        points = grid_points(settings.box, shape)
        count = max(1, _CHECKS_A_JOB // turns)
        grid_jobs = [
            GridJob(settings.criterion, points[k : k + count]) for k in range(0, len(points), count)
        ]
        grid = Grid(settings.box, computed(grid_jobs, 0, count).reshape(shape))
        centre = _centre(settings, grid)
        if settings.criterion.contact_free:
            grid = _reached(settings.criterion, grid, centre, run)
        ways = directions(settings.rays, len(shape))
        count = max(1, count // _CHECKS_A_RAY)
        ray_jobs = [
            RayJob(settings.criterion, centre, ways[k : k + count], settings.box)
            for k in range(0, len(ways), count)
        ]
        lengths = computed(ray_jobs, len(points), count * _CHECKS_A_RAY)
    return Found(grid, Rays(centre, ways, lengths))


def _reached(criterion: Criterion, grid: Grid, centre: FloatArray, run: Runner) -> Grid:
    """Return the grid with negated depths at places that cannot be reached without contact."""
    depths = grid.depths.ravel().copy()
    held = np.flatnonzero(depths >= 0.0)
    count = max(1, _WAYS_A_JOB // len(criterion.turns_rad))
    jobs = [
        WayJob(criterion, centre, grid.points[held[k : k + count]])
        for k in range(0, len(held), count)
    ]
    depths[held] *= np.concatenate(list(run(jobs)))
    return Grid(grid.box, depths.reshape(grid.depths.shape))


def _centre(settings: Search, grid: Grid) -> FloatArray:
    """Return the place where rays start."""
    deepest, depth_N = grid.deepest
    if not depth_N >= 0.0:
        near = (
            f"the nearest place is {in_mm(deepest)} mm, where the margin of tensions is "
            f"{-depth_N:.1f} N too small"
        )
        if not np.isfinite(depth_N):
            near = "at no place can the tensions act in all directions"
        raise WorkFailedError(
            f"no place of the grid from {in_mm(settings.box.low_m)} to "
            f"{in_mm(settings.box.high_m)} mm is in this workspace; {near}"
        )
    platform = settings.criterion.platform
    centre = settings.centre_m
    if centre is None:
        centre = np.add(platform.workspace_min_m, platform.workspace_max_m) / 2.0
    low, high = settings.box.low_m, settings.box.high_m
    inside = bool((centre > low).all() and (centre < high).all())
    if not inside or not settings.criterion.depths(centre[None])[0] >= 0.0:
        if settings.centre_m is not None:
            raise _outside(centre, deepest)
        centre = deepest
    if not settings.criterion.clear_shares(centre, centre[None])[0] > 0.0:
        raise BadInputError(
            f"--contact-free: there is a contact at the start of the rays, {in_mm(centre)} "
            "mm; choose another --centre or orientation"
        )
    return centre


def _outside(centre: FloatArray, deepest: FloatArray) -> BadInputError:
    return BadInputError(
        f"--centre {in_mm(centre)}: outside the workspace; allowed: a place within it, such as "
        f"{in_mm(deepest)}"
    )


def in_mm(position_m: FloatArray | Sequence[float]) -> str:
    """Return a position in mm, in the form of an option's value."""
    return " ".join(f"{1e3 * value:.0f}" for value in position_m)
