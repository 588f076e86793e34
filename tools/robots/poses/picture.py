"""The picture of a list of poses: where they are, how far they are turned, and their ways."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.reach.reachable import Reach
from cdpr_tools.report.style import save_figure
from cdpr_tools.robots.poses.choice import Chosen

_WAY, _START, _BOX, _OBSTACLE = "#999999", "#d1581a", "#7a3fa0", "#cccccc"
_NAMES = "xyz"


def draw_poses(title: str, reach: Reach, chosen: Chosen, path: Path) -> None:
    """Write the picture as PNG; raises OSError."""
    model = reach.model
    k, turned = model.positions, model.size > model.positions
    views = [(0, 1)] if k == 2 else [(0, 2), (1, 2), (0, 1)]
    figure = Figure(figsize=(3.9 * len(views) + 1.2, 4.2), layout="constrained")
    box = np.subtract(model.platform.workspace_max_m, model.platform.workspace_min_m)
    widths = [float(box[i]) for i, _ in views]  # one scale for all, about
    all_axes = figure.subplots(1, len(views), squeeze=False, width_ratios=widths)[0]
    angle = np.degrees(np.linalg.norm(chosen.positions[:, k:], axis=1))
    for ax, view in zip(all_axes, views, strict=True):
        _draw_view(ax, reach, chosen, angle if turned else None, view)
    if turned:
        bar = figure.colorbar(all_axes[-1].collections[-1], ax=list(all_axes), shrink=0.8)
        bar.set_label("turned from home's orientation (deg)")
        bar.outline.set_visible(False)
    figure.suptitle(title)
    handles, labels = all_axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    save_figure(figure, path)


def _draw_view(
    ax: Axes, reach: Reach, chosen: Chosen, angle_deg: FloatArray | None, view: tuple[int, int]
) -> None:
    i, j = view
    platform, start = reach.model.platform, reach.start
    for position in chosen.positions:
        ax.plot([start[i], position[i]], [start[j], position[j]], "-", color=_WAY, lw=0.4, zorder=1)
    low, high = platform.workspace_min_m, platform.workspace_max_m
    ax.plot(
        [low[i], high[i], high[i], low[i], low[i]], [low[j], low[j], high[j], high[j], low[j]],
        "--", color=_BOX, lw=1.0, label="box of targets",
    )  # fmt: skip
    ax.plot(start[i], start[j], "s", color=_START, ms=7, zorder=4, label="start")
    for box in platform.obstacles:
        size = np.subtract(box.max_m, box.min_m)
        corner = (box.min_m[i], box.min_m[j])
        ax.add_patch(Rectangle(corner, float(size[i]), float(size[j]), fc=_OBSTACLE, ec=_WAY))
    x, y = chosen.positions[:, i], chosen.positions[:, j]
    if angle_deg is None:
        ax.scatter(x, y, s=16, color="#2f6fb0", zorder=3, label="pose")
    else:
        shown = Normalize(0.0, max(float(angle_deg.max()), math.degrees(1e-3)))
        ax.scatter(x, y, s=16, c=angle_deg, cmap="viridis", norm=shown, zorder=3, label="pose")
    ax.set(xlabel=f"{_NAMES[i]} (m)", ylabel=f"{_NAMES[j]} (m)", aspect="equal")
    ax.xaxis.set_major_locator(MaxNLocator(6))
