"""The pictures of trials, one each, drawn of recordings and of what was true."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Rectangle

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.robot_arrays import limits_of
from profiles import Robot
from tools.report.style import canvas, legend_above, thinned
from tools.trials import limits, line, streaming, targets
from tools.trials.recorded import Recorded
from tools.trials.run import platform_of

_AXES = ("#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0")
_TRUE, _WANTED, _BOUND = "#2f6fb0", "#d1581a", "#b02f2f"
_EXCERPT_S = 12.0


def of_targets(recorded: Recorded, robot: Robot) -> Figure:
    """Draw where the platform stood off its targets, and where these lie."""
    places, errors = targets.errors_mm(recorded)
    figure, (off, where) = canvas(1, 2, height=3.6)
    off.plot(*errors.T, "o", color=_TRUE, ms=4, alpha=0.7, label="at a target")
    mean, sigma = errors.mean(axis=0), errors.std(axis=0, ddof=1)
    off.plot(*mean, "+", color=_WANTED, ms=12, mew=2, label="mean")
    off.add_patch(Ellipse(mean, *(6.0 * sigma), fill=False, color=_WANTED, label="3 sigma"))
    wanted = targets.THREE_SIGMA_mm
    allowed = Ellipse((0, 0), 2 * wanted, 2 * wanted, fill=False, color="#777777", ls="--")
    allowed.set_label(f"{wanted:g} mm")
    off.add_patch(allowed)
    off.set(xlabel="x error (mm)", ylabel="y error (mm)", title="true position less target")
    off.set_aspect("equal", "datalim")
    off.autoscale_view()
    where.plot(*recorded.true_m[::20].T, color="#bbbbbb", lw=0.6, label="way of the platform")
    where.plot(*places.T, "o", color=_TRUE, ms=4)
    _workspace(where, robot)
    where.set(xlabel="x (m)", ylabel="y (m)", title="targets")
    legend_above(figure, off, where)
    return figure


def of_lines(parts: dict[str, Recorded]) -> Figure:
    """Draw the true distance from each line over the way along it."""
    figure, axes = canvas(2, 1, height=2.6)
    colours = {line.WITH: _TRUE, line.WITHOUT: "#8a8f98"}
    for part, recorded in sorted(parts.items(), reverse=True):
        for ax, (way, across, _) in zip(axes, line.path_errors(recorded), strict=True):
            label = f"{part} compensation"
            ax.plot(*thinned(1e3 * way, across), color=colours[part], label=label)
    for ax, name in zip(axes, ("level line", "upright line"), strict=True):
        ax.axhline(0.0, color="black", lw=0.5)
        ax.set(ylabel="distance (mm)", title=f"{name}, {1e3 * line.SPEED_m_s:g} mm/s")
    axes[-1].set(xlabel="way along the line (mm)")
    legend_above(figure, axes[0])
    return figure


def of_limits(recorded: Recorded, robot: Robot) -> Figure:
    """Draw tensions and torques over time, within their limits, and the platform's way."""
    limit = limits_of(robot)
    figure, (tension, torque, over, way) = canvas(2, 2, height=3.2)
    minutes = recorded.time_s / 60.0
    for i, axis in enumerate(robot.axes):
        label, colour = axis.name, _AXES[i % len(_AXES)]
        values = recorded.truth["tension_N"][:, i]
        tension.plot(*thinned(minutes, values), color=colour, lw=0.4, label=label)
        sent = recorded.cycles["torque_sent_Nm"][:, i]
        torque.plot(*thinned(minutes, sent), color=colour, lw=0.4)
    for bound in (np.min(limit.tension_min_N), np.max(limit.tension_max_N)):
        tension.axhline(bound, color=_BOUND, lw=1.0)
    for sign in (-1.0, 1.0):
        torque.axhline(sign * float(np.max(limit.torque_Nm)), color=_BOUND, lw=1.0)
    tension.set(xlabel="min", ylabel="N", title="true tension of the cables, and its bounds")
    torque.set(xlabel="min", ylabel="Nm", title="torque asked of the motors, and its limit")
    acceleration = platform_of(robot).acceleration_m_s2
    beyond = [leg.overshoot_m(recorded.true_m) for leg in limits.legs(recorded, acceleration)]
    over.hist(1e3 * np.array(beyond), bins=30, color=_AXES[:2], label=["in x", "in y"])
    over.axvline(limits.OVERSHOOT_mm, color=_BOUND, lw=1.0)
    over.set(xlabel="mm", ylabel="legs", yscale="log", title="overshoot of each leg")
    way.plot(*recorded.true_m[::20].T, color=_TRUE, lw=0.3)
    _workspace(way, robot)
    way.set(xlabel="x (m)", ylabel="y (m)", title="way of the platform")
    over.legend()
    legend_above(figure, tension)
    return figure


def of_stream(recorded: Recorded, robot: Robot) -> Figure:
    """Draw an excerpt of the motion, and the commanded acceleration of all of it."""
    figure, (place, speed, step) = canvas(3, 1, height=2.3)
    time_s = recorded.time_s
    shown = time_s < _EXCERPT_S
    velocity = np.diff(recorded.setpoint_m, axis=0) / recorded.period_s
    for i, name in enumerate("xy"):
        colour = _AXES[i]
        wanted = recorded.setpoint_m[shown, i] - recorded.setpoint_m[0, i]
        true = recorded.true_m[shown, i] - recorded.setpoint_m[0, i]
        place.plot(time_s[shown], wanted, color=colour, ls="--", label=f"{name}, set-point")
        place.plot(time_s[shown], true, color=colour, label=f"{name}, true")
        speed.plot(time_s[:-1][shown[:-1]], velocity[shown[:-1], i], color=colour)
        _accelerations(step, time_s, streaming.velocity_steps_m_s(recorded)[:, i], colour)
    allowed = 1e3 * platform_of(robot).acceleration_m_s2 * recorded.period_s
    for sign in (-1.0, 1.0):
        step.axhline(sign * allowed, color=_BOUND, lw=1.0)
    place.set(ylabel="m", title="way since the beginning (excerpt)")
    speed.set(ylabel="m/s", title="commanded velocity (excerpt)")
    step.set(xlabel="s", ylabel="mm/s", title="step of the commanded velocity a cycle, its limit")
    legend_above(figure, place)
    return figure


def _accelerations(ax: Axes, time_s: FloatArray, steps: FloatArray, colour: str) -> None:
    ax.plot(*thinned(time_s[1:-1], 1e3 * steps), color=colour, lw=0.5)


def _workspace(ax: Axes, robot: Robot) -> None:
    platform = platform_of(robot)
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    ax.add_patch(Rectangle((low[0], low[1]), *(high - low), fill=False, color="#777777", ls="--"))
    ax.set_aspect("equal", "datalim")
    ax.autoscale_view()
