"""A workspace in figures and in words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdpr_profiles import Robot
from cdpr_tools.robots.workspace.search import Found, Search, in_mm

_AGREE = 0.02


def figures(robot: Robot, settings: Search, found: Found) -> dict[str, Any]:
    """Return what was found, SI, as JSON has it."""
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
    """Return the same as lines for people."""
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
            f"mind       the rays see only a part: to {100.0 * unseen:.1f} % of the grid's places "
            "inside no straight line from their centre leads; go by the grid"
        )
    elif abs(off) > _AGREE:
        text.append("mind       grid and rays differ: take more --cells and --rays")
    if found["reaches_sides"]:
        sides = ", ".join(found["reaches_sides"])
        text.append(
            f"mind       it reaches sides of what was searched ({sides}) and may go on beyond: "
            "--low, --high"
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
        what += " along all directions at once"
    if criterion.least_N:
        what += f", {criterion.least_N:g} N kept from the bounds of tensions"
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
            "           reached straight from where the rays start, all things "
            f"{clearance:g} mm apart or more"
        )
    return lines
