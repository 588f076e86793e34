"""A cable robot in words, figures and a sketch made of letters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.robot_arrays import limits_of
from profiles import Robot
from profiles.platform import Platform
from tools.robots.statics import can_be_computed, statics_of, view_of

_GRID = 25
_COLUMNS, _ROWS = 65, 23


def figures(robot: Robot, platform: Platform) -> dict[str, Any]:
    """Return what can be said of the robot in numbers, SI, as JSON has it."""
    told: dict[str, Any] = {
        "robot": robot.profile,
        "mass_kg": platform.mass_kg,
        "home_m": platform.home_m,
        "workspace_m": [platform.workspace_min_m, platform.workspace_max_m],
        "axes": [
            {"name": axis.name, "exit_point_m": a, "anchor_point_m": b}
            for axis, a, b in zip(
                robot.axes, platform.exit_points_m, platform.anchor_points_m, strict=True
            )
        ],
    }
    if can_be_computed(robot):
        told |= _of_tensions(robot, platform, told["axes"])
    return told


def _of_tensions(
    robot: Robot, platform: Platform, axes: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    statics, limits = statics_of(robot), limits_of(robot)
    home, points = np.array(platform.home_m), statics.box.grid(_GRID, _GRID)
    still = statics.reserve_N(points)
    moving = statics.reserve_N(points, platform.acceleration_m_s2)
    lengths, angle = statics.geometry.lengths(points), statics.angle_rad(points)
    at_home_m, least_N = statics.geometry.lengths(home), statics.least_tensions_N(home)
    for i, told in enumerate(axes):
        told["cable_at_home_m"] = float(at_home_m[i])
        told["least_tension_at_home_N"] = float(least_N[i])
        told["cable_m"] = [float(lengths[..., i].min()), float(lengths[..., i].max())]
        told["tension_N"] = [float(statics.low_N[i]), float(statics.high_N[i])]
        gain = abs(robot.axes[i].winch.cable_m_per_motor_rad)
        told["torque_at_most_Nm"] = float(statics.high_N[i]) * gain
        told["torque_limit_Nm"] = float(np.broadcast_to(limits.torque_Nm, (len(axes),))[i])
    return {
        "held_share": float(np.mean(still >= 0.0)),
        "target_share": float(np.mean(statics.is_target(points))),
        "reserve_at_rest_N": _finite(still.min()),
        "reserve_in_motion_N": _finite(moving.min()),
        "turns_at_most_rad": _finite(np.abs(angle).max()),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def lines(robot: Robot, platform: Platform, told: dict[str, Any]) -> list[str]:
    """Return the same as lines for people; lengths in m, angles in degrees."""
    text = [
        f"{robot.name} ({robot.profile})",
        f"platform   {platform.mass_kg:g} kg, {platform.speed_m_s:g} m/s and "
        f"{platform.acceleration_m_s2:g} m/s2 along each direction",
        f"at rest    {_point(platform.home_m)} m, within {platform.home_tolerance_m:g} m",
        f"targets    {_point(platform.workspace_min_m)} to {_point(platform.workspace_max_m)} m",
    ]
    if "held_share" in told:
        text += _tension_lines(told)
    text += ["", *_table(told["axes"])]
    if platform.is_planar:
        text += ["", *_sketch(robot, platform)]
    return text


def _tension_lines(told: dict[str, Any]) -> list[str]:
    held, taken = 100.0 * told["held_share"], 100.0 * told["target_share"]
    reserve, turns = told["reserve_in_motion_N"], told["turns_at_most_rad"]
    spare = "" if reserve is None or reserve < 0.0 else f", with {reserve:.0f} N to spare in motion"
    turning = "turns over" if turns is None else f"turns by up to {math.degrees(turns):.1f} deg"
    return [
        f"tensions   hold it in {held:.0f} % of the box; targets are taken in {taken:.0f} %{spare}",
        f"           it {turning} there, which no cable can prevent",
    ]


def _table(axes: Sequence[dict[str, Any]]) -> list[str]:
    coordinates = len(axes[0]["exit_point_m"])
    a, b = 9 * coordinates, 10 * coordinates
    rows = [f"{'axis':16}{'exit point, m':>{a}}{'anchor point, m':>{b}}"]
    if "tension_N" in axes[0]:
        rows[0] += f"{'cable, m':>16}{'tension, N':>14}{'torque, Nm':>16}"
    for axis in axes:
        row = f"{axis['name']:16}{_point(axis['exit_point_m']):>{a}}"
        row += f"{_point(axis['anchor_point_m'], 3):>{b}}"
        if "tension_N" in axis:
            cable = "{:.2f} to {:.2f}".format(*axis["cable_m"])
            tension = "{:g} to {:g}".format(*axis["tension_N"])
            torque = f"{axis['torque_at_most_Nm']:.1f} of {axis['torque_limit_Nm']:g}"
            row += f"{cable:>16}{tension:>14}{torque:>16}"
        rows.append(row)
    return rows


def _sketch(robot: Robot, platform: Platform) -> list[str]:
    """Return the plane as letters: exit points, home, box of targets, where it can be held."""
    shown = view_of(platform)
    low, size = np.array(shown.low_m), np.subtract(shown.high_m, shown.low_m)
    # a letter is about twice as high as it is wide
    columns = int(min(_COLUMNS, 2 * _ROWS * size[0] / size[1])) | 1
    rows = max(5, round(0.5 * columns * size[1] / size[0]))
    cells, points = np.full((rows, columns), " "), shown.grid(columns, rows)
    known = can_be_computed(robot)
    box = (points >= np.array(platform.workspace_min_m)).all(axis=-1)
    box &= (points <= np.array(platform.workspace_max_m)).all(axis=-1)
    if known:
        statics = statics_of(robot)
        cells[statics.reserve_N(points) >= 0.0] = "."
        cells[box] = np.where(statics.is_target(points[box]), "#", "!")
    else:
        cells[box] = "#"

    def put(position_m: Sequence[float], letter: str) -> None:
        column, row = np.round((np.array(position_m) - low) / size * [columns - 1, rows - 1])
        cells[int(row), int(column)] = letter

    for i, position_m in enumerate(platform.exit_points_m):
        put(position_m, str((i + 1) % 10))
    put(platform.home_m, "o")
    legend = "1, 2 ... exit points   o at rest   # targets"
    if known:
        legend += "   . held as well   ! targets that are not taken"
    return ["".join(row).rstrip() for row in cells[::-1]] + [legend]


def _point(position_m: Sequence[float] | FloatArray, digits: int = 2) -> str:
    return "(" + ", ".join(f"{value:.{digits}f}" for value in position_m) + ")"
