"""Preview a path before anything moves: its plan, figures and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.way_points import read_path, read_source
from cdpr_rt.programs import path_planning
from cdpr_rt.programs.path_store import paths_folder, write_plan
from cdpr_tools import style
from cdpr_tools.output import TableText, time_text
from cdpr_tools.robots.path_options import PathOptions

_ROUTE_POINTS: Final = 1500


@dataclass(frozen=True)
class Preview:
    """A plan and the tensions that it needs."""

    planner: path_planning.PathPlanner
    plan: path_planning.PathPlan
    tensions: path_planning.PathTensions | None
    obstacle: path_planning.Obstacle | None
    note: str


def preview(
    robot: Robot, file: Path, options: PathOptions, advance: path_planning.Advance
) -> Preview:
    """Plan a file's path for a robot; raises PathError, ProfileError and BadInputError."""
    read_source(file)  # a missing file is reported before anything is compiled
    options.require_use(file)
    planner = path_planning.PathPlanner(robot)
    advance("reading", 0.0)
    settings = options.settings(planner.model.positions)
    plan = planner.plan(read_path(file, planner.coordinates, settings), advance, options.line)
    tensions, obstacle = None, plan.obstacle
    if plan.timed is not None:
        advance("tensions along the path", 0.8)
        tensions = path_planning.path_tensions(planner.model, plan.timed)
        if not tensions.carried.all():
            sample = int(tensions.sample[int((~tensions.carried).argmax())])
            obstacle = path_planning.Obstacle(
                int(plan.nodes.line[plan.timed.node[sample]]),
                plan.timed.samples[sample, 0],
                "the motion of the platform needs tensions outside their bounds",
            )
    box = planner.platform
    note = path_planning.size_note(
        plan.path, np.array(box.workspace_min_m), np.array(box.workspace_max_m)
    )
    return Preview(planner, plan, tensions, obstacle, note)


def keep(shown: Preview, robot: Robot) -> str:
    """Write the plan into the folder of the robot's daemon; return its name."""
    plan, timed = shown.plan, shown.plan.timed
    assert timed is not None  # callers do not keep a path that cannot be followed
    lines = plan.nodes.line[timed.node]
    title = Path(plan.path.source).name
    if plan.next_line is not None:
        title += f" up to line {plan.path.moves[-1].line}"
    return write_plan(paths_folder(robot.profile), timed, lines, title, shown.planner.model)


def figures(shown: Preview) -> dict[str, Any]:
    """Return a preview's figures for JSON."""
    plan, timed, tensions = shown.plan, shown.plan.timed, shown.tensions
    table: dict[str, Any] = {
        "file": plan.path.source,
        "moves": len(plan.path.moves),
        "length_m": plan.nodes.length_m,
        "stops": len(plan.nodes.runs),
        "deviation_m": plan.deviation_m,
        "notices": plan.path.notices,
        "next_line": plan.next_line,
        "obstacle": None,
    }
    table["route_m"] = _route(shown)
    if shown.obstacle is not None:
        k = shown.planner.model.positions
        table["obstacle"] = {
            "line": shown.obstacle.line,
            "position_m": shown.obstacle.position[:k].tolist(),
            "rotation_rad": shown.obstacle.position[k:].tolist(),
            "text": shown.obstacle.text,
        }
    if timed is not None:
        table |= {
            "duration_s": timed.duration_s,
            "constant_limit_s": plan.constant_s,
            "gain": plan.constant_s / timed.duration_s,
            "top_speed_m_s": _top_speed(shown),
            "slowed_moves": plan.slowed,
        }
    if tensions is not None:
        table |= {
            "tension_min_N": tensions.tension_N.min(axis=0).tolist(),
            "tension_max_N": tensions.tension_N.max(axis=0).tolist(),
            "tension_low_N": tensions.low_N.tolist(),
            "tension_high_N": tensions.high_N.tolist(),
        }
    if shown.note:
        table["note"] = shown.note
    return table


def _route(shown: Preview) -> list[list[float]]:
    """Return positions at even distances along the path, for drawing it."""
    nodes, k = shown.plan.nodes, shown.planner.model.positions
    last = len(nodes.s) - 1
    at = np.linspace(0.0, nodes.s[-1], min(_ROUTE_POINTS, 2 * last + 2))
    return [
        [round(float(x), 4) for x in point]
        for point in np.stack([np.interp(at, nodes.s, nodes.q[:, i]) for i in range(k)], axis=1)
    ]


def _top_speed(shown: Preview) -> float:
    timed = shown.plan.timed
    assert timed is not None  # callers check it
    k = shown.planner.model.positions
    return float(np.linalg.norm(timed.samples[:, 1, :k], axis=1).max())


def lines(shown: Preview, robot: Robot, table: dict[str, Any]) -> list[str]:
    """Return a preview as lines of text."""
    length = f"{table['length_m']:.3f} m"
    text = [f"{table['file']}: {table['moves']} moves, {length}, {table['stops']} stops"]
    text += [f"note: {notice}" for notice in table["notices"]]
    if (line := table["next_line"]) is not None:
        text.append(
            f"note: this plan ends at line {shown.plan.path.moves[-1].line}; `cdpr path run` "
            f"continues with the next plan, which --line {line} shows"
        )
    if shown.note:
        text.append(f"note: {shown.note}")
    if shown.plan.timed is not None:
        text += [
            f"duration {time_text(table['duration_s'])}, fastest "
            f"{1e3 * table['top_speed_m_s']:.0f} mm/s",
            f"farthest from the file's lines and arcs: {1e3 * table['deviation_m']:.4f} mm",
            "with the same limits of speed and acceleration along the whole path: "
            f"{time_text(table['constant_limit_s'])}, {table['gain']:.1f} times as long",
        ]
    if table.get("slowed_moves"):
        text.append(
            f"note: {table['slowed_moves']} moves request a higher speed than the robot allows"
        )
    tensions = shown.tensions
    if tensions is not None:
        least, most = tensions.tension_N.min(axis=0), tensions.tension_N.max(axis=0)
        low, high = tensions.low_N, tensions.high_N
        rows = [
            [axis.name, f"{least[i]:.1f}", f"{most[i]:.1f}", f"{low[i]:.1f} to {high[i]:.1f}"]
            for i, axis in enumerate(robot.axes)
        ]
        text.append(TableText([["tensions, N:", "least", "most", "planned within"], *rows]))
    return text


def obstacle_text(shown: Preview) -> str:
    """Return where and why the path cannot be followed; an empty text if it can be."""
    obstacle = shown.obstacle
    if obstacle is None:
        return ""
    k = shown.planner.model.positions
    place = f"at {_listed(obstacle.position[:k], 1e3)} mm"
    if obstacle.position[k:].any():
        place += f", turned by {_listed(obstacle.position[k:], math.degrees(1.0))} deg"
    hint = "; the file has G53, positions in the room" if shown.plan.path.in_room else ""
    return f"{shown.plan.path.source}:{obstacle.line}: {place}: {obstacle.text}{hint}"


def _listed(values: FloatArray, factor: float) -> str:
    return ", ".join(f"{factor * value:.1f}" for value in values)


# The picture of a planned path: its route, speed and tensions.

_WIDE_in: Final = 7.4
_MOST_POINTS: Final = 5000
_SMALL: Final = 0.5
"""A path smaller than this share of the box of targets is also drawn enlarged."""
_FLATTEST: Final = 0.4
"""Smallest ratio of a view's height to its width, and of its width to its height."""


@dataclass(frozen=True)
class _View:
    """Two coordinates of the room; `enlarged` shows only the path instead of the whole box."""

    across: int
    up: int
    enlarged: bool


def draw_path(shown: Preview, robot: Robot, file: Path) -> None:
    """Write the picture as PNG.

    It shows the path from above and from the front, coloured by speed, in the box of targets; a
    small path is also enlarged. Below are speed and tensions over time. An obstacle is marked.
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
    named = drawn[:1]
    if timed:
        style.colour_bar(figure, drawn[-1].collections[0], drawn, "speed (mm/s)")
        speed, tension = (figure.add_subplot(grid[row, :]) for row in (1, 2))
        _draw_speed(speed, shown)
        _draw_tensions(tension, shown, robot)
        named.append(tension)
    style.legend_below(figure, *named, columns=6)
    style.save_figure(figure, file)


def _views(shown: Preview) -> list[_View]:
    """Return the views to draw: the planes, each with the whole box or enlarged."""
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
    style.box_of_targets(ax, low, high, (i, j))
    if plan.timed is None:
        place = plan.nodes.q[:, [i, j]]
        ax.plot(*place.T, color=style.SERIES[0], lw=1.0)
    else:
        step = -(-len(plan.timed.samples) // _MOST_POINTS)
        place = plan.timed.samples[::step, 0][:, [i, j]]
        speed = np.linalg.norm(plan.timed.samples[::step, 1, : len(low)], axis=1)
        parts = LineCollection(
            list(np.stack([place[:-1], place[1:]], axis=1)), cmap="viridis", lw=1.3
        )
        parts.set_array(1e3 * speed[:-1])
        ax.add_collection(parts)
    ax.plot(*plan.nodes.q[0, [i, j]], "o", ms=5, color=style.LINES, label="beginning")
    if shown.obstacle is not None:
        ax.plot(*shown.obstacle.position[[i, j]], "x", ms=11, mew=2.5, color=style.BOUND,
                label=f"line {shown.obstacle.line}: cannot be there")  # fmt: skip
    every = place if view.enlarged else np.vstack([place, [low[[i, j]]], [high[[i, j]]]])
    span = np.ptp(every, axis=0)
    # a flat path needs room for the tick labels at its side
    margin = np.maximum(0.05 * span.max(), 0.5 * (_FLATTEST * span.max() - span))
    (left, bottom), (right, top) = every.min(axis=0) - margin, every.max(axis=0) + margin
    ax.set(xlim=(left, right), ylim=(bottom, top))
    style.label_view(ax, (i, j))
    ax.xaxis.set_major_locator(MaxNLocator(5))
    if view.enlarged:
        ax.set_title("enlarged")


def _draw_speed(ax: Axes, shown: Preview) -> None:
    timed = shown.plan.timed
    assert timed is not None  # only drawn for a timed plan
    k = shown.planner.model.positions
    speed = np.linalg.norm(timed.samples[:, 1, :k], axis=1)
    ax.plot(*style.decimated(_times(shown), 1e3 * speed), color=style.SERIES[0])
    ax.set(ylabel="speed (mm/s)", xlabel="time (s)", ylim=(0.0, None))


def _draw_tensions(ax: Axes, shown: Preview, robot: Robot) -> None:
    tensions = shown.tensions
    assert tensions is not None  # every timed plan has them
    t = _times(shown)[tensions.sample]
    for i, axis in enumerate(robot.axes):
        colour = style.SERIES[i % len(style.SERIES)]
        ax.plot(
            *style.decimated(t, tensions.tension_N[:, i]), color=colour, lw=1.2, label=axis.name
        )
    for bound in (tensions.low_N.max(), tensions.high_N.min()):
        # drawn behind the tensions, which may be at a bound all the time
        ax.axhline(bound, color=style.BOUND, ls="--", lw=1.0, zorder=1)
    ax.plot([], [], color=style.BOUND, ls="--", lw=1.0, label="planned within")
    ax.set(ylabel="tension (N)", xlabel="time (s)")


def _times(shown: Preview) -> FloatArray:
    timed = shown.plan.timed
    assert timed is not None  # only used for a timed plan
    return np.asarray(np.arange(len(timed.samples)) * timed.period_s)
