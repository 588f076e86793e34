"""A workspace as figures, text and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from scipy.interpolate import RegularGridInterpolator

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.statics import Box
from cdpr_rt.model.workspace_analysis import Rays, Triangles
from cdpr_tools.robots.workspace_search import Found, Search, in_mm
from cdpr_tools.style import LINES, colour_bar, label_view, save_figure

_AGREE = 0.02


def figures(robot: Robot, settings: Search, found: Found) -> dict[str, Any]:
    """Return the results for JSON, in SI units."""
    criterion, grid, rays = settings.criterion, found.grid, found.rays
    size = "volume_m3" if grid.depths.ndim == 3 else "area_m2"
    deepest_m, depth_N = grid.deepest
    return {
        "robot": robot.profile,
        "acceleration_m_s2": criterion.acceleration_m_s2,
        "margin_at_least_N": criterion.least_N,
        "turns_rad": criterion.turns_rad,
        "contact_free": criterion.contact_free,
        "searched_m": [settings.box.low_m, settings.box.high_m],
        "reaches_sides": grid.cut,
        "grid": {"places": grid.depths.shape, "spacing_m": grid.spacing_m, size: grid.size},
        "rays": {"count": len(rays.lengths_m), "centre_m": rays.centre_m, size: rays.size},
        "rays_against_grid": rays.size / grid.size - 1.0 if grid.size else math.nan,
        "unseen_share": grid.unseen_share(rays),
        "greatest_margin_N": depth_N + criterion.least_N,
        "greatest_margin_m": deepest_m,
    }


def lines(robot: Robot, settings: Search, found: dict[str, Any]) -> list[str]:
    """Return the results as lines of text."""
    grid, rays = found["grid"], found["rays"]
    key, unit = ("volume_m3", "m3") if "volume_m3" in grid else ("area_m2", "m2")
    places = " x ".join(map(str, grid["places"]))
    apart = 1e3 * float(np.max(grid["spacing_m"]))
    off, unseen = found["rays_against_grid"], found["unseen_share"]
    text = [
        f"{robot.name} ({robot.profile})",
        *_criterion_lines(settings),
        f"searched   {in_mm(settings.box.low_m)} to {in_mm(settings.box.high_m)} mm",
        f"grid       {grid[key]:.4g} {unit} by {places} places, {apart:.0f} mm apart or less",
        f"rays       {rays[key]:.4g} {unit} by {rays['count']} rays from "
        f"{in_mm(rays['centre_m'])} mm, {100.0 * abs(off):.1f} % {'more' if off > 0 else 'less'}",
        f"deepest    margin of {found['greatest_margin_N']:.1f} N at "
        f"{in_mm(found['greatest_margin_m'])} mm",
    ]
    if unseen:
        text.append(
            f"warning    the rays reach only a part: {100.0 * unseen:.1f} % of the grid's places "
            "inside are not on a straight line from their start; use the grid's value"
        )
    elif abs(off) > _AGREE:
        text.append("warning    grid and rays differ: increase --cells and --rays")
    if found["reaches_sides"]:
        sides = ", ".join(found["reaches_sides"])
        text.append(
            f"warning    the workspace reaches the sides of the searched box ({sides}) and may "
            "extend beyond them: use --low, --high"
        )
    return text


def _criterion_lines(settings: Search) -> list[str]:
    criterion = settings.criterion
    platform, turns = criterion.platform, np.array(criterion.turns_rad)
    what = "static workspace: the platform at rest"
    if criterion.acceleration_m_s2:
        what = f"wrench-feasible workspace: {criterion.acceleration_m_s2:g} m/s2"
        if platform.workspace_angle_rad > 0.0:
            turning = math.degrees(platform.angular_acceleration_rad_s2)
            what += f" and {turning:.0f} deg/s2"
        what += " along all directions together"
    if criterion.least_N:
        what += f", {criterion.least_N:g} N from the bounds of tensions"
    orientation = "at home's orientation"
    if len(turns) > 1:
        angle = math.degrees(float(np.linalg.norm(turns, axis=1).max()))
        orientation = f"at all of {len(turns)} orientations up to {angle:g} deg from home's"
    elif turns.any():
        vector = " ".join(f"{math.degrees(value):g}" for value in turns[0])
        orientation = f"turned by {vector} deg from home's orientation"
    if criterion.contact_free:
        orientation += ","
    lines = [f"of         {what},", f"           {orientation}"]
    if criterion.contact_free:
        clearance = 1e3 * platform.clearance_m
        lines.append(
            f"           reached on a straight line from the start of the rays, with {clearance:g} "
            "mm or more between all parts"
        )
    return lines


# Pictures of a workspace: its surface by rays and by the grid, and three sections with margins.

_RAYS, _GRID = "#d1581a", "#1b4f8a"
_WIDE_in = 9.6
_FINE, _KNOTS = 90, 700
_OUTSIDE_N = -1e6
_SECTIONS = ((0, 2), (1, 2), (0, 1))
_LEGEND = [
    Line2D([], [], color=_RAYS, lw=1.4, label="border found by rays"),
    Line2D([], [], color=_GRID, lw=1.4, ls="--", label="border found by the grid"),
    Line2D([], [], color=LINES, ls="", marker="s", ms=5, label="exit points"),
    Line2D([], [], color=LINES, ls="", marker="+", ms=8, label="start of the rays"),
]


def draw_workspace(robot: Robot, settings: Search, found: Found, path: Path) -> None:
    """Write the picture as PNG.

    In space it follows figures 3.3 and 3.4 of the thesis: both surfaces, and three sections through
    the centre of the rays, coloured by the margin.
    """
    if len(settings.box.low_m) == 2:
        figure = Figure(figsize=(7.4, 5.8), layout="constrained")
        _draw_section(figure, figure.subplots(), settings, found, (0, 1))
    else:
        figure = Figure(figsize=(_WIDE_in, 0.82 * _WIDE_in), layout="constrained")
        _draw_surfaces(figure.add_subplot(2, 2, 1, projection="3d"), settings, found)
        for k, view in enumerate(_SECTIONS):
            _draw_section(figure, figure.add_subplot(2, 2, 2 + k), settings, found, view)
    figure.suptitle(f"{robot.name}: {_title(settings)}", fontsize=10, x=0.01, ha="left")
    figure.legend(handles=_LEGEND, loc="outside lower center", ncols=4)
    save_figure(figure, path)


def _title(settings: Search) -> str:
    moving = settings.criterion.acceleration_m_s2
    kind = f"wrench-feasible workspace at {moving:g} m/s2" if moving else "static workspace"
    turns = len(settings.criterion.turns_rad)
    return kind + (f", all of {turns} orientations" if turns > 1 else "")


def _draw_surfaces(ax: Any, settings: Search, found: Found) -> None:
    """Draw the grid's surface, and over it a net between the ends of rays."""
    vertices, triangles = found.grid.surface
    ax.plot_trisurf(*vertices.T, triangles=triangles, color=_GRID, alpha=0.3, linewidth=0.0)
    rays = found.rays
    each = max(1, len(rays.lengths_m) // _KNOTS)
    net = Rays(rays.centre_m, rays.directions[::each], rays.lengths_m[::each])
    edges = np.concatenate([net.triangles[:, [0, 1]], net.triangles[:, [1, 2]]])
    ax.add_collection3d(Line3DCollection(list(net.ends_m[edges]), colors=_RAYS, linewidths=0.5))
    ax.plot(*np.array(settings.criterion.platform.exit_points_m).T, "s", ms=4, color=LINES)
    low, high = np.array([settings.box.low_m, settings.box.high_m])
    ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(tuple(high - low), zoom=1.2)


def _draw_section(
    figure: Figure, ax: Axes, settings: Search, found: Found, view: tuple[int, int]
) -> None:
    i, j = view
    low, high = np.array([settings.box.low_m, settings.box.high_m])
    sides = high - low
    counts = [max(2, round(_FINE * float(sides[k] / sides.max()))) for k in view]
    cells = Box((low[i], low[j]), (high[i], high[j])).grid(*counts)
    centre = found.rays.centre_m
    points = np.broadcast_to(centre, (cells[..., 0].size, len(centre))).copy()
    points[:, view] = cells.reshape(-1, 2)
    least = settings.criterion.least_N
    margins = settings.criterion.depths(points).reshape(cells.shape[:2]) + least
    levels = MaxNLocator(8).tick_values(least, max(found.grid.deepest[1] + least, least + 1e-3))
    filled = ax.contourf(
        cells[0, :, 0], cells[:, 0, 1], np.maximum(margins, _OUTSIDE_N),
        np.unique(np.clip(levels, least, None)), cmap="YlGnBu", alpha=0.8,
        extend="max",  # a section may contain places deeper than any of the grid's
    )  # fmt: skip
    colour_bar(figure, filled, ax, "margin (N)", 0.85)
    _draw_borders(ax, found, view, cells)
    ax.plot(*np.array(settings.criterion.platform.exit_points_m)[:, view].T, "s", ms=4, c=LINES)
    ax.plot(*centre[list(view)], "+", ms=8, color=LINES)
    label_view(ax, view)
    ax.set(xlim=(low[i], high[i]), ylim=(low[j], high[j]))
    ax.grid(visible=False)
    if len(centre) == 3:
        across = ({0, 1, 2} - {i, j}).pop()
        ax.set_title(f"{'xyz'[across]} = {in_mm(centre[across : across + 1])} mm")


def _draw_borders(ax: Axes, found: Found, view: tuple[int, int], cells: FloatArray) -> None:
    """Draw the border in a plane: the ends of rays, and zero depth interpolated in the grid."""
    rays, grid = found.rays, found.grid
    points = np.broadcast_to(rays.centre_m, (cells[..., 0].size, len(rays.centre_m))).copy()
    points[:, view] = cells.reshape(-1, 2)
    sides = [
        np.linspace(*side)
        for side in zip(grid.box.low_m, grid.box.high_m, grid.depths.shape, strict=True)
    ]
    depths = np.maximum(grid.depths, _OUTSIDE_N)
    between = RegularGridInterpolator(sides, depths)(points).reshape(cells.shape[:2])
    if between.min() < 0.0 < between.max():
        ax.contour(
            cells[0, :, 0], cells[:, 0, 1], between, [0.0],
            colors=_GRID, linestyles="dashed", linewidths=1.4, zorder=3,
        )  # fmt: skip
    if len(rays.centre_m) == 2:
        ends = rays.ends_m
        border = np.stack([ends, np.roll(ends, -1, axis=0)], axis=1)
    else:
        across = ({0, 1, 2} - set(view)).pop()
        border = _section(rays.ends_m, rays.triangles, rays.centre_m, across)[:, :, view]
    ax.add_collection(LineCollection(list(border), colors=_RAYS, linewidths=1.4))


def _section(
    vertices: FloatArray, triangles: Triangles, centre_m: FloatArray, axis: int
) -> FloatArray:
    """Return the segments (s, 2, 3) in which a plane across a coordinate axis cuts a surface."""
    normal = [float(k == axis) for k in range(3)]
    cut: Callable[..., Any] = trimesh.intersections.mesh_plane
    return np.asarray(cut(trimesh.Trimesh(vertices, triangles, process=False), normal, centre_m))
