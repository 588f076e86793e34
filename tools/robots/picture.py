"""The picture of a planar robot: exit points, cables, platform, and where they can hold it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from matplotlib.ticker import MaxNLocator

import tools.report.style  # noqa: F401 - how the project's pictures look
from profiles import Robot
from profiles.platform import Platform
from tools.robots.statics import Box, PlanarStatics, can_be_computed, statics_of, view_of

_CABLE, _PLATFORM, _TARGETS = "#444444", "#d1581a", "#7a3fa0"
_WIDE_in = 7.4


def draw_robot(robot: Robot, platform: Platform, path: Path) -> None:
    """Write the picture of a planar robot as PNG; raises OSError.

    Where tensions are known for it (three cables), the workspace that they allow is coloured by
    how far the tensions can stay from their bounds.
    """
    shown = view_of(platform)
    width, height = np.subtract(shown.high_m, shown.low_m)
    figure = Figure(figsize=(_WIDE_in, _WIDE_in * height / width * 0.9), layout="constrained")
    ax = figure.subplots()
    if can_be_computed(robot):
        _draw_workspace(figure, ax, statics_of(robot), shown)
    _draw_machine(ax, robot, platform)
    (left, right), (bottom, top) = zip(shown.low_m, shown.high_m, strict=True)
    ax.set(title=robot.name, xlabel="x (m)", ylabel="y (m)", aspect="equal")
    ax.set(xlim=(left, right), ylim=(bottom, top))
    ax.grid(visible=False)
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    figure.savefig(path, format="png")


def _draw_workspace(figure: Figure, ax: Axes, statics: PlanarStatics, shown: Box) -> None:
    points = shown.grid(181, 141)
    xs, ys = points[0, :, 0], points[:, 0, 1]
    still = np.nan_to_num(statics.reserve_N(points), neginf=-1e3)
    moving = statics.controlled.reserve_N(points, statics.platform.acceleration_m_s2)
    moving = np.nan_to_num(moving, neginf=-1e3)
    if still.max() > 0.0:
        levels = MaxNLocator(9).tick_values(0.0, float(still.max()))
        filled = ax.contourf(xs, ys, still, levels, cmap="YlGnBu", alpha=0.75)
        bar = figure.colorbar(filled, ax=ax, shrink=0.8, format="%.0f")
        bar.set_label("distance of all tensions from their limits, at rest (N)")
        bar.outline.set_visible(False)
    if moving.max() > 0.0:
        ax.contour(xs, ys, moving, [0.0], colors=_CABLE, linestyles="dotted", linewidths=1.0)
        ax.plot([], [], ":", color=_CABLE, lw=1.0, label="targets can be taken")


def _draw_machine(ax: Axes, robot: Robot, platform: Platform) -> None:
    home = np.array(platform.home_m)
    exits, anchors = np.array(platform.exit_points_m), home + np.array(platform.anchor_points_m)
    middle = exits.mean(axis=0)
    for axis, a, b in zip(robot.axes, exits, anchors, strict=True):
        ax.plot(*zip(a, b, strict=True), color=_CABLE, lw=1.2)
        away = (0, 9) if a[1] >= middle[1] else (0, -17)
        ax.annotate(axis.name, a, xytext=away, textcoords="offset points", ha="center")
    ax.plot([], [], color=_CABLE, lw=1.2, label="cables, at rest")
    ax.plot(*exits.T, "s", ms=6, color=_CABLE, label="exit points")
    around = np.argsort(np.arctan2(*(anchors - anchors.mean(axis=0)).T[::-1]))
    ax.add_patch(Polygon(anchors[around], color=_PLATFORM, alpha=0.9, zorder=3))
    ax.plot(*home, "o", ms=3, color=_PLATFORM, label="platform, at rest", zorder=3)
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    width, height = high - low
    ax.add_patch(
        Rectangle(
            (low[0], low[1]), width, height, fill=False, ec=_TARGETS, lw=1.4, ls="--",
            label="box of targets",
        )
    )  # fmt: skip
