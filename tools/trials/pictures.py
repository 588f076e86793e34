"""The pictures of trials, one each, drawn from recordings and from the truth."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_tools.style import (
    BOUND,
    SERIES,
    box_of_targets,
    canvas,
    decimated,
    label_view,
    legend_above,
    legend_beside_title,
)
from cdpr_tools.trials import limits, line, path, streaming, targets
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.recorded import Recorded

_TRUE, _SETPOINT = SERIES[:2]
_STYLES = {"solid": "-", "dashed": "--", "dotted": ":"}
_EXCERPT_S = 12.0
_VIEWS = {2: ((0, 1),), 3: ((0, 1), (0, 2))}
"""The coordinates that each view shows across and up: in space from above and from the front."""


def of_targets(recorded: Recorded) -> Figure:
    """Draw the platform's errors at its targets, and where the targets lie."""
    directions = recorded.directions
    places, errors = targets.errors_mm(recorded)
    turned = targets.errors_deg(recorded)
    views = _VIEWS[directions.k]
    figure, axes = canvas(len(views) + bool(len(turned)), 2, height=3.4)
    for view, (off, where) in zip(views, zip(axes[::2], axes[1::2], strict=True), strict=False):
        _errors(off, errors[:, view], targets.THREE_SIGMA_mm[directions.k])
        name, other = (directions.names[i] for i in view)
        off.set(xlabel=f"{name} error (mm)", ylabel=f"{other} error (mm)")
        where.plot(*places[:, view].T, "o", color=_TRUE, ms=4)
        _ways(where, recorded, view)
    axes[0].set_title("true position minus target")
    axes[1].set_title("targets")
    if len(turned):
        _orientations(axes[-2], axes[-1], recorded, turned)
    legend_above(figure, *axes[:2], columns=3)
    return figure


def _errors(ax: Axes, errors: FloatArray, allowed_mm: float) -> None:
    """Draw errors (m, 2) in two directions with their mean and spread."""
    ax.plot(*errors.T, "o", color=_TRUE, ms=4, alpha=0.7, label="at a target")
    mean, sigma = errors.mean(axis=0), errors.std(axis=0, ddof=1)
    ax.plot(*mean, "+", color=_SETPOINT, ms=12, mew=2, label="mean")
    ax.add_patch(Ellipse(mean, *(6.0 * sigma), fill=False, color=_SETPOINT, label="3 sigma"))
    allowed = Ellipse((0, 0), 2 * allowed_mm, 2 * allowed_mm, fill=False, color="#777777", ls="--")
    allowed.set_label(f"{allowed_mm:g} mm")
    ax.add_patch(allowed)
    ax.set_aspect("equal", "datalim")
    ax.autoscale_view()


def _orientations(off: Axes, over: Axes, recorded: Recorded, errors: FloatArray) -> None:
    """Draw the errors (m, 3) in orientation at targets, and the true orientation over time."""
    directions = recorded.directions
    for colour, i, turn in zip(SERIES, directions.about, directions.turns, strict=False):
        name = directions.names[turn]
        off.plot(
            1 + np.arange(len(errors)), errors[:, i], "o-", color=colour, ms=3, lw=0.5, label=name
        )
    off.axhline(0.0, color="black", lw=0.5)
    off.set(xlabel="target", ylabel="deg", title="true orientation minus target")
    legend_beside_title(off)
    _angles(over, recorded)


def _angles(ax: Axes, recorded: Recorded) -> None:
    """Draw the angles from the orientation at home over time."""
    directions = recorded.directions
    true, setpoint = np.degrees(recorded.true_places), np.degrees(recorded.setpoint_places)
    minutes = recorded.time_s / 60.0
    for k, i in enumerate(directions.turns):
        ax.plot(*decimated(minutes, setpoint[:, i]), color=SERIES[k], lw=0.4, ls="--")
        ax.plot(*decimated(minutes, true[:, i]), color=SERIES[k], lw=0.6, label=directions.names[i])
    ax.set(xlabel="min", ylabel="deg", title="turned from home (dashed: wanted)")
    legend_beside_title(ax)


def of_lines(parts: dict[str, Recorded], speed_m_s: float) -> Figure:
    """Draw the true distance from each line, or angle from each turn, over the position on it."""
    found = {part: line.line_errors(recorded) for part, recorded in parts.items()}
    directions = next(iter(parts.values())).directions
    first = next(iter(found.values()))
    figure, axes = canvas(len(first), 1, height=2.2)
    colours = {line.WITH: _TRUE, line.WITHOUT: "#8a8f98"}
    for part, errors in sorted(found.items(), reverse=True):
        for ax, one in zip(axes, errors, strict=True):
            values = one.off_deg[:, directions.about] if one.is_turn else one.across_mm
            for i, style in zip(range(values.shape[1]), _STYLES.values(), strict=False):
                label = f"{part} compensation" if i == 0 else None
                way = np.degrees(one.way) if one.is_turn else 1e3 * one.way
                shown = decimated(way, values[:, i])
                ax.plot(*shown, style, color=colours[part], label=label)
    for ax, one in zip(axes, first, strict=True):
        ax.axhline(0.0, color="black", lw=0.5)
        name, k = directions.names[one.direction], directions.k
        others = [other for other in directions.names[:k] if other != name]
        curves = zip(_STYLES, directions.names[k:] if one.is_turn else others, strict=False)
        styles = ", ".join(f"{style} {other}" for style, other in curves)
        if one.is_turn:
            ax.set(ylabel="off (deg)", xlabel="angle (deg)", title=f"turn of {name} ({styles})")
        else:
            title = f"line along {name}, {1e3 * speed_m_s:g} mm/s ({styles})"
            ax.set(ylabel="distance (mm)", xlabel="position along the line (mm)", title=title)
    legend_above(figure, axes[0])
    return figure


def of_limits(recorded: Recorded, robot: Robot) -> Figure:
    """Draw tensions and torques over time, within their limits, and the platform's motion."""
    directions = recorded.directions
    views = _VIEWS[directions.k]
    figure, axes = canvas(1 + (2 + len(views) + bool(directions.turns)) // 2, 2, height=3.0)
    held, (over, *ways) = axes[:2], axes[2:]
    _held((held[0], held[1]), recorded, robot)
    true = recorded.true_places
    beyond = 1e3 * np.array([leg.overshoot(true) for leg in limits.legs(recorded)])
    names = [f"in {name}" for name in directions.names[: directions.k]]
    colours = SERIES[: directions.k]
    over.hist(beyond[:, : directions.k], bins=30, color=colours, label=names)
    over.axvline(limits.OVERSHOOT_mm, color=BOUND, lw=1.0)
    over.set(xlabel="mm", ylabel="legs", yscale="log", title="overshoot of each leg")
    legend_beside_title(over)
    _rest(ways, recorded)
    legend_above(figure, held[0])
    return figure


def of_tape(recorded: Recorded, robot: Robot) -> Figure:
    """Draw tensions and torques over time, within their limits, and the platform's motion."""
    views = len(_VIEWS[recorded.directions.k]) + bool(recorded.directions.turns)
    figure, axes = canvas(1 + (views + 1) // 2, 2, height=3.0)
    _held((axes[0], axes[1]), recorded, robot)
    _rest(axes[2:], recorded)
    legend_above(figure, axes[0])
    return figure


def _held(axes: tuple[Axes, Axes], recorded: Recorded, robot: Robot) -> None:
    """Draw tensions and torques over time, with their limits."""
    tension, torque = axes
    limit, minutes = limits_of(robot), recorded.time_s / 60.0
    for i, axis in enumerate(robot.axes):
        label, colour = axis.name, SERIES[i % len(SERIES)]
        values = recorded.truth["tension_N"][:, i]
        tension.plot(*decimated(minutes, values), color=colour, lw=0.4, label=label)
        sent = recorded.cycles["torque_sent_Nm"][:, i]
        torque.plot(*decimated(minutes, sent), color=colour, lw=0.4)
    for bound in (np.min(limit.tension_min_N), np.max(limit.tension_max_N)):
        tension.axhline(bound, color=BOUND, lw=1.0)
    for sign in (-1.0, 1.0):
        torque.axhline(sign * float(np.max(limit.torque_Nm)), color=BOUND, lw=1.0)
    tension.set(xlabel="min", ylabel="N", title="true tension of the cables, and its bounds")
    torque.set(xlabel="min", ylabel="Nm", title="commanded torque of the motors, and its limit")


def _rest(axes: list[Axes], recorded: Recorded) -> None:
    """Draw the platform's motion in each view, and its orientation if that is controlled."""
    views = _VIEWS[recorded.directions.k]
    for view, ax in zip(views, axes, strict=False):
        _ways(ax, recorded, view)
        ax.set_title("path of the platform")
    left = axes[len(views) :]
    if recorded.directions.turns:
        _angles(left.pop(0), recorded)
    for ax in left:
        ax.set_visible(False)


def of_stream(recorded: Recorded) -> Figure:
    """Draw an excerpt of the motion, and the commanded acceleration of the whole motion."""
    directions, k = recorded.directions, recorded.directions.k
    turned = directions.angle_rad > 0.0
    figure, axes = canvas(3 + 2 * turned, 1, height=2.3)
    place, speed, step = axes[:3]
    time_s, shown = recorded.time_s, recorded.time_s < _EXCERPT_S
    velocity = np.diff(recorded.setpoint_m, axis=0) / recorded.period_s
    steps = streaming.velocity_steps(recorded)
    _followed(place, recorded, range(k), 1.0)
    for i in range(k):
        speed.plot(time_s[:-1][shown[:-1]], velocity[shown[:-1], i], color=SERIES[i])
    _steps(step, recorded, 1e3 * steps[:, :k], 1e3 * directions.acceleration[0])
    place.set(ylabel="m", title="distance since the beginning (excerpt)")
    speed.set(ylabel="m/s", title="commanded velocity (excerpt)")
    step.set(
        xlabel="s", ylabel="mm/s", title="step of the commanded velocity per cycle, and its limit"
    )
    if turned:
        angle, turn = axes[3:]
        _followed(angle, recorded, directions.turns, float(np.degrees(1.0)))
        _steps(turn, recorded, np.degrees(steps[:, k:]), np.degrees(directions.acceleration[-1]))
        angle.set(ylabel="deg", title="turned since the beginning (excerpt)")
        turn.set(xlabel="s", ylabel="deg/s", title="step of the commanded angular velocity")
        legend_beside_title(angle, 6)
    legend_above(figure, place)
    return figure


def _followed(ax: Axes, recorded: Recorded, chosen: range | tuple[int, ...], unit: float) -> None:
    """Draw set-point and true place in some directions, at the beginning of the trial."""
    shown = recorded.time_s < _EXCERPT_S
    time_s, setpoint = recorded.time_s[shown], recorded.setpoint_places[shown]
    for colour, i in zip(SERIES, chosen, strict=False):
        name, begin = recorded.directions.names[i], setpoint[0, i]
        ax.plot(
            time_s,
            unit * (setpoint[:, i] - begin),
            color=colour,
            ls="--",
            label=f"{name}, set-point",
        )
        true = recorded.true_places[shown, i]
        ax.plot(time_s, unit * (true - begin), color=colour, label=f"{name}, true")


def _steps(ax: Axes, recorded: Recorded, steps: FloatArray, acceleration: float) -> None:
    """Draw the steps (c, m) of a velocity from cycle to cycle, with their limit."""
    for colour, values in zip(SERIES, steps.T, strict=False):
        ax.plot(*decimated(recorded.time_s[1:-1], values), color=colour, lw=0.5)
    for sign in (-1.0, 1.0):
        ax.axhline(sign * acceleration * recorded.period_s, color=BOUND, lw=1.0)


def _ways(ax: Axes, recorded: Recorded, view: tuple[int, int]) -> None:
    """Draw the true motion in one view, with the workspace."""
    directions: Directions = recorded.directions
    name, other = (directions.names[i] for i in view)
    ax.plot(*recorded.true_m[::20, view].T, color="#bbbbbb", lw=0.4, label="path of the platform")
    box_of_targets(ax, directions.low_m, directions.high_m, view)
    ax.set_aspect("equal", "datalim")
    ax.autoscale_view()
    ax.set(xlabel=f"{name} (m)", ylabel=f"{other} (m)")


def of_path(recorded: Recorded, robot: Robot, speed_m_s: float) -> Figure:
    """Draw the wanted and the true path, and the platform's distance from the plan."""
    errors = path.errors_of(recorded, robot, speed_m_s)
    views = _VIEWS[recorded.directions.k]
    figure = Figure(figsize=(7.4, 6.0), layout="constrained")
    grid = figure.add_gridspec(2, len(views), height_ratios=[3.2, 2.0])
    for column, (i, j) in enumerate(views):
        ax = figure.add_subplot(grid[0, column])
        ax.plot(*errors.described_m[:, [i, j]].T, color=_SETPOINT, lw=0.8, label="file")
        ax.plot(*errors.true_m[:, [i, j]].T, color=_TRUE, lw=0.8, label="true")
        label_view(ax, (i, j))
        if not column:
            legend_beside_title(ax, 2)
    over = figure.add_subplot(grid[1, :])
    over.plot(*decimated(errors.time_s, errors.off_mm), color=_TRUE, lw=0.7)
    over.axhline(path.RMS_mm, color=BOUND, lw=0.8, ls="--")
    over.set(xlabel="s", ylabel="mm", title="true distance from the planned path (dashed: wanted)")
    return figure
