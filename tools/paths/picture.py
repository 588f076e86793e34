"""The picture of a planned path: where it leads, how fast, and what tensions it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import cdpr_tools.report.style  # noqa: F401 - how the project's pictures look
from cdpr_profiles import Robot
from cdpr_rt.core.exchange import FloatArray
from cdpr_tools.paths.preview import Preview
from cdpr_tools.report.style import decimated

_NAMES: Final = "xyz"
_BOX, _STOP, _WRONG, _BOUND = "#7a3fa0", "#444444", "#b02f2f", "#b02f2f"
_AXES: Final = (
    "#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#8a8f98",
)  # fmt: skip
_WIDE_in: Final = 7.4
_MOST_POINTS: Final = 5000


def draw_path(shown: Preview, robot: Robot, file: Path) -> None:
    """Write the picture as PNG; raises OSError.

    The path from above and from the front, coloured by its speed, in the box of targets; below it
    speed and tensions over time. What is in the way is marked.
    """
    k = shown.planner.model.positions
    views = [(0, 1)] if k == 2 else [(0, 1), (0, 2)]
    timed = shown.plan.timed is not None
    rows = 1 + 2 * timed
    figure = Figure(figsize=(_WIDE_in, 3.6 + 2.3 * (rows - 1)), layout="constrained")
    grid = figure.add_gridspec(rows, len(views), height_ratios=[3.6] + [2.3] * (rows - 1))
    for column, view in enumerate(views):
        _draw_view(figure, figure.add_subplot(grid[0, column]), shown, view, column == 0)
    if timed:
        speed, tension = (figure.add_subplot(grid[row, :]) for row in (1, 2))
        _draw_speed(speed, shown)
        _draw_tensions(tension, shown, robot)
        handles, labels = tension.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
    figure.savefig(file, format="png")


def _draw_view(
    figure: Figure, ax: Axes, shown: Preview, view: tuple[int, int], named: bool
) -> None:
    plan, platform = shown.plan, shown.planner.platform
    i, j = view
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
        if not named or len(low) == 2:
            bar = figure.colorbar(parts, ax=ax, shrink=0.8)
            bar.set_label("speed (mm/s)")
            bar.outline.set_visible(False)
    ax.plot(*plan.nodes.q[0, [i, j]], "o", ms=5, color=_STOP, label="beginning")
    if shown.obstacle is not None:
        ax.plot(*shown.obstacle.position[[i, j]], "x", ms=11, mew=2.5, color=_WRONG,
                label=f"line {shown.obstacle.line}: cannot be there")  # fmt: skip
    every = np.vstack([place, [low[[i, j]]], [high[[i, j]]]])
    margin = 0.05 * float(np.ptp(every, axis=0).max())
    ax.set(
        xlim=(every[:, 0].min() - margin, every[:, 0].max() + margin),
        ylim=(every[:, 1].min() - margin, every[:, 1].max() + margin),
        xlabel=f"{_NAMES[i]} (m)", ylabel=f"{_NAMES[j]} (m)", aspect="equal",
    )  # fmt: skip
    if named:
        ax.legend(loc="best")
        ax.set(title=Path(plan.path.source).name)


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
        ax.plot(*decimated(t, tensions.tension_N[:, i]), color=colour, lw=0.9, label=axis.name)
    for bound in (tensions.low_N.max(), tensions.high_N.min()):
        ax.axhline(bound, color=_BOUND, ls="--", lw=1.0)
    ax.plot([], [], color=_BOUND, ls="--", lw=1.0, label="planned within")
    ax.set(ylabel="tension (N)", xlabel="time (s)")


def _times(shown: Preview) -> FloatArray:
    timed = shown.plan.timed
    assert timed is not None  # asked for drawings over time only
    return np.asarray(np.arange(len(timed.samples)) * timed.period_s)
