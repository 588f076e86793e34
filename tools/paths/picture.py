"""The picture of a planned path: where it leads, how fast, and what tensions it takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_tools.paths.preview import Preview
from cdpr_tools.report.style import decimated, save_figure

_NAMES: Final = "xyz"
_BOX, _STOP, _WRONG, _BOUND = "#7a3fa0", "#444444", "#b02f2f", "#b02f2f"
_AXES: Final = (
    "#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#8a8f98",
)  # fmt: skip
_WIDE_in: Final = 7.4
_MOST_POINTS: Final = 5000
_SMALL: Final = 0.5
"""A path smaller than this share of the box of targets is drawn enlarged as well."""
_FLATTEST: Final = 0.4
"""Least height of a view over its width, and width over its height."""


@dataclass(frozen=True)
class _View:
    """Two coordinates of the room, and whether only the path or all of the box is shown."""

    across: int
    up: int
    enlarged: bool


def draw_path(shown: Preview, robot: Robot, file: Path) -> None:
    """Write the picture as PNG; raises OSError.

    The path from above and from the front, coloured by its speed, in the box of targets and, where
    it is small there, enlarged; below it speed and tensions over time. What is in the way is
    marked.
    """
    views = _views(shown)
    timed = shown.plan.timed is not None
    rows = 1 + 2 * timed
    figure = Figure(
        figsize=(max(_WIDE_in, 3.5 * len(views)), 3.9 + 2.3 * (rows - 1)), layout="constrained"
    )
    grid = figure.add_gridspec(rows, len(views), height_ratios=[3.6] + [2.3] * (rows - 1))
    drawn = [figure.add_subplot(grid[0, column]) for column in range(len(views))]
    for ax, view in zip(drawn, views, strict=True):
        _draw_view(ax, shown, view)
    drawn[0].set_title(Path(shown.plan.path.source).name)
    handles, labels = drawn[0].get_legend_handles_labels()
    if timed:
        bar = figure.colorbar(drawn[-1].collections[0], ax=drawn, shrink=0.8)
        bar.set_label("speed (mm/s)")
        bar.outline.set_visible(False)
        speed, tension = (figure.add_subplot(grid[row, :]) for row in (1, 2))
        _draw_speed(speed, shown)
        _draw_tensions(tension, shown, robot)
        more_handles, more_labels = tension.get_legend_handles_labels()
        handles, labels = handles + more_handles, labels + more_labels
    figure.legend(handles, labels, loc="outside lower center", ncols=6)
    save_figure(figure, file)


def _views(shown: Preview) -> list[_View]:
    """Return what is drawn: the planes, each with all of the box or enlarged."""
    platform = shown.planner.platform
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    size = np.ptp(shown.plan.nodes.q[:, : len(low)], axis=0)
    small = bool((size < _SMALL * (high - low)).all() and size.any()) and shown.obstacle is None
    if len(low) == 2:
        return [_View(0, 1, False), *[_View(0, 1, True)] * small]
    return [*[_View(0, 1, False)] * small, _View(0, 1, small), _View(0, 2, small)]


def _draw_view(ax: Axes, shown: Preview, view: _View) -> None:
    plan, platform = shown.plan, shown.planner.platform
    i, j = view.across, view.up
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    ax.add_patch(
        Rectangle((low[i], low[j]), high[i] - low[i], high[j] - low[j], fill=False, ec=_BOX,
                  lw=1.2, ls="--", label="box of targets")
    )  # fmt: skip
    if plan.timed is None:
        place = plan.nodes.q[:, [i, j]]
        ax.plot(*place.T, color=_AXES[0], lw=1.0)
    else:
        step = -(-len(plan.timed.samples) // _MOST_POINTS)
        place = plan.timed.samples[::step, 0][:, [i, j]]
        speed = np.linalg.norm(plan.timed.samples[::step, 1, : len(low)], axis=1)
        parts = LineCollection(
            list(np.stack([place[:-1], place[1:]], axis=1)), cmap="viridis", lw=1.3
        )
        parts.set_array(1e3 * speed[:-1])
        ax.add_collection(parts)
    ax.plot(*plan.nodes.q[0, [i, j]], "o", ms=5, color=_STOP, label="beginning")
    if shown.obstacle is not None:
        ax.plot(*shown.obstacle.position[[i, j]], "x", ms=11, mew=2.5, color=_WRONG,
                label=f"line {shown.obstacle.line}: cannot be there")  # fmt: skip
    every = place if view.enlarged else np.vstack([place, [low[[i, j]]], [high[[i, j]]]])
    span = np.ptp(every, axis=0)
    # a path that is flat gets room for the numbers at its side
    margin = np.maximum(0.05 * span.max(), 0.5 * (_FLATTEST * span.max() - span))
    (left, bottom), (right, top) = every.min(axis=0) - margin, every.max(axis=0) + margin
    ax.set(
        xlim=(left, right), ylim=(bottom, top),
        xlabel=f"{_NAMES[i]} (m)", ylabel=f"{_NAMES[j]} (m)", aspect="equal",
    )  # fmt: skip
    ax.xaxis.set_major_locator(MaxNLocator(5))
    if view.enlarged:
        ax.set_title("enlarged")


def _draw_speed(ax: Axes, shown: Preview) -> None:
    timed = shown.plan.timed
    assert timed is not None  # it has been drawn for one
    k = shown.planner.model.positions
    speed = np.linalg.norm(timed.samples[:, 1, :k], axis=1)
    ax.plot(*decimated(_times(shown), 1e3 * speed), color=_AXES[0])
    ax.set(ylabel="speed (mm/s)", xlabel="time (s)", ylim=(0.0, None))


def _draw_tensions(ax: Axes, shown: Preview, robot: Robot) -> None:
    tensions = shown.tensions
    assert tensions is not None  # there are for what has a time
    t = _times(shown)[tensions.sample]
    for i, axis in enumerate(robot.axes):
        colour = _AXES[i % len(_AXES)]
        ax.plot(*decimated(t, tensions.tension_N[:, i]), color=colour, lw=1.2, label=axis.name)
    for bound in (tensions.low_N.max(), tensions.high_N.min()):
        # below the tensions, which may be at a bound all the time
        ax.axhline(bound, color=_BOUND, ls="--", lw=1.0, zorder=1)
    ax.plot([], [], color=_BOUND, ls="--", lw=1.0, label="planned within")
    ax.set(ylabel="tension (N)", xlabel="time (s)")


def _times(shown: Preview) -> FloatArray:
    timed = shown.plan.timed
    assert timed is not None  # asked for drawings over time only
    return np.asarray(np.arange(len(timed.samples)) * timed.period_s)
