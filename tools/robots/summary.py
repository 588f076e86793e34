"""A cable robot as text, figures and a sketch made of letters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.diagnosis.predictions import (
    FRICTIONS,
    SWING_S,
    Loss,
    Swing,
    corner_swings,
    free_rotation,
    lowest_resonance_Hz,
    slips,
)
from cdpr_rt.diagnosis.subject import Subject, point_text
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.free_rotation_kernel import SWINGS_m
from cdpr_rt.model.statics import PlatformStatics, view_of
from cdpr_rt.platform.loop_design import STIFFNESS_SHARES
from cdpr_tools.output import TableText

_COLUMNS, _ROWS = 59, 23
_STIFFNESS_OFF = max(STIFFNESS_SHARES) - 1.0


def figures(s: Subject) -> dict[str, Any]:
    """Return the figures of a robot for JSON, in SI units."""
    robot, platform = s.robot, s.platform
    figures: dict[str, Any] = {
        "robot": robot.profile,
        "mass_kg": platform.mass_kg,
        "home_m": platform.home_m,
        "workspace_m": [platform.workspace_min_m, platform.workspace_max_m],
        "controlled": platform.controlled,
        "home_rotation_rad": platform.home_rotation_rad,
        "workspace_angle_rad": platform.workspace_angle_rad,
        "axes": [
            {"name": axis.name, "exit_point_m": a, "anchor_point_m": b}
            for axis, a, b in zip(
                robot.axes, platform.exit_points_m, platform.anchor_points_m, strict=True
            )
        ],
    }
    return figures | _of_tensions(s, figures["axes"])


def _of_tensions(s: Subject, axes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    statics, platform = s.statics, s.platform
    home, points, turns = np.array(platform.home_m), statics.points(), statics.orientations
    still = np.array([statics.margin_N(points, 0.0, turn) for turn in turns])
    acceleration = platform.acceleration_m_s2
    moving = np.array([statics.margin_N(points, acceleration, turn) for turn in turns])
    lengths = np.array([statics.lengths(points, turn) for turn in turns])
    at_home_m, least_N = statics.lengths(home), statics.least_tensions_N(home)
    of_drives = corner_swings(s, Loss.DRIVE)
    for figures, swings, of_drive in zip(axes, corner_swings(s), of_drives, strict=True):
        if not swings:
            continue
        figures["lowered_after"] = {"cable": _lowered(swings), "drive": _lowered(of_drive)}
        worst = max(swings, key=lambda swing: swing.swing_m)
        figures["broken"] = {
            "at_m": worst.position_m,
            "swing_m": worst.swing_m,
            "turn_rad": worst.turn_rad,
            "away_m": max(swing.away_m for swing in swings),
            "aside_m": max(swing.aside_m for swing in swings),
        }
    for i, figures in enumerate(axes):
        figures["cable_at_home_m"] = float(at_home_m[i])
        figures["least_tension_at_home_N"] = _finite(least_N[i])
        figures["cable_m"] = [float(lengths[..., i].min()), float(lengths[..., i].max())]
        figures["tension_N"] = [float(statics.low_N[i]), float(statics.high_N[i])]
        figures["torque_at_most_Nm"] = float(statics.high_N[i] * s.arm_m[i])
        figures["torque_limit_Nm"] = float(s.torque_Nm[i])
    of_all: dict[str, Any] = {
        "held_share": float(np.mean(still >= 0.0)),
        "target_share": float(np.mean(moving >= statics.model.reserve_N)),
        "kept_for_control_N": statics.model.reserve_N,
        "reserve_at_home_N": _finite(float(statics.margin_N(home))),
        "reserve_at_rest_N": _finite(still.min()),
        "reserve_in_motion_N": _finite(moving.min()),
        "lowest_resonance_Hz": float(lowest_resonance_Hz(s.model, s.axes, points).min()),
        # without a redundant cable, lengths cannot disagree
        "lengths_disagree_m": s.limits.lengths_disagree_m if s.n > s.model.size else None,
    }
    (of_lengths,) = corner_swings(s, Loss.LENGTHS)
    of_all["lowered_after_lengths"] = _lowered(of_lengths)
    most_N = np.broadcast_to(s.limits.tension_max_N, (s.n,))
    for i, slip in enumerate(slips(s)):
        axes[i]["slip"] = {key: _finite(value) for key, value in asdict(slip).items()}
        axes[i]["slip"]["allowed_N"] = _finite(most_N[i])
    of_all["loop"] = _of_loop(s)
    if statics.turns_freely:
        of_all["turns_at_most_rad"] = _finite(np.abs(statics.angle_rad(points)).max())
        turning = free_rotation(s.model)
        of_all["free_rotation"] = (
            None if turning is None else asdict(turning) | {"lasts_s": turning.lasts_s(SWINGS_m)}
        )
    return of_all


def _lowered(swings: Sequence[Swing]) -> dict[str, float] | None:
    """Return the fastest descent, and the height where friction may hold the platform, or None."""
    if not swings:
        return None
    return {
        "fastest_m_s": max(swing.fastest_m_s for swing in swings),
        "hangs_m": max(swing.hangs_m for swing in swings),
    }


def _of_loop(s: Subject) -> dict[str, float] | None:
    """Return the control loop's stability margins at its worst pose and stiffness.

    None if the cables do not hold the platform.
    """
    try:
        loop = s.loop
    except GeometryError:
        return None
    worst = min(loop.margins, key=lambda there: there.modulus)
    least = min(loop.modes, key=lambda mode: mode.damping_ratio)
    return {
        "slowest_Hz": loop.slowest_rad_s / math.tau,
        "fastest_Hz": max(there.fastest_rad_s for there in loop.margins) / math.tau,
        "modulus_margin": worst.modulus,
        "gain_margin": worst.gain,
        "phase_margin_rad": worst.phase_rad,
        "worst_at_Hz": worst.frequency_Hz,
        "least_damped_Hz": least.frequency_Hz,
        "least_damping_ratio": least.damping_ratio,
        "tensions_follow_pose": loop.gains.follows_pose,
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def lines(s: Subject, figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines of text; lengths in m, angles in degrees."""
    robot, platform = s.robot, s.platform
    text = [
        f"{robot.name} ({robot.profile})",
        f"platform   {platform.mass_kg:g} kg, {platform.speed_m_s:g} m/s and "
        f"{platform.acceleration_m_s2:g} m/s2 along each direction",
        f"at rest    {point_text(platform.home_m)} m, within {platform.home_tolerance_m:g} m",
        f"targets    {point_text(platform.workspace_min_m)} to "
        f"{point_text(platform.workspace_max_m)} m",
        *_orientation_lines(platform),
        *_tension_lines(figures),
        "",
        _table(figures["axes"]),
        "",
        *_broken_lines(figures["axes"]),
        *_lowered_lines(figures),
        "",
        *_slip_lines(figures["axes"]),
    ]
    if platform.is_planar:
        text += ["", *_sketch(s.statics, platform)]
    return text


def _orientation_lines(platform: Platform) -> list[str]:
    lines = [f"controlled {', '.join(platform.controlled)}"]
    if any(platform.home_rotation_rad):
        turned = math.degrees(math.hypot(*platform.home_rotation_rad))
        lines.append(f"           at home it is turned by {turned:.1f} deg from the room's axes")
    if platform.workspace_angle_rad > 0.0:
        lines.append(
            f"           targets up to {math.degrees(platform.workspace_angle_rad):.1f} deg from "
            f"home's orientation, {math.degrees(platform.angular_speed_rad_s):.0f} deg/s and "
            f"{math.degrees(platform.angular_acceleration_rad_s2):.0f} deg/s2"
        )
    elif len(platform.controlled) > len(platform.home_m):
        lines.append("           targets keep home's orientation")
    return lines


def _broken_lines(axes: Sequence[dict[str, Any]]) -> list[str]:
    """Return a table of how far the platform moves at worst if a cable breaks."""
    if any("broken" not in axis for axis in axes):
        return []
    turns = any(axis["broken"]["turn_rad"] > math.radians(1.0) for axis in axes)
    titles = ["worst at, m", "swings, m", *["turns, deg"] * turns, "away, m", "aside, m"]
    rows = [["cable breaks", *titles]]
    for axis in axes:
        broken = axis["broken"]
        turned = [f"{math.degrees(broken['turn_rad']):.0f}"] * turns
        lengths = [f"{broken[key]:.2f}" for key in ("swing_m", "away_m", "aside_m")]
        rows.append([axis["name"], point_text(broken["at_m"]), lengths[0], *turned, *lengths[1:]])
    return [
        TableText(rows),
        "Predicted for the worst corner of the box, or the worst target near one: how far the "
        f"platform swings within {SWING_S:g} s, and how far it gets in total and sideways until "
        "the other cables have lowered it to the ground.",
    ]


def _lowered_lines(figures: dict[str, Any]) -> list[str]:
    """Return a table of how the platform is lowered in the worst case after a loss."""
    of_lengths = figures["lowered_after_lengths"]
    if of_lengths is None:
        return []
    lost = [("all lengths", of_lengths)]
    for axis in figures["axes"]:
        lost += [(f"{what} {axis['name']}", found) for what, found in axis["lowered_after"].items()]
    rows = [["lost", "lowered at up to, m/s", "may hang at, m"]]
    for name, found in lost:
        hangs = f"{found['hangs_m']:.2f}" if found["hangs_m"] > 0.0 else "-"
        rows.append([name, f"{found['fastest_m_s']:.2f}", hangs])
    return [
        "",
        TableText(rows),
        "Predicted for the worst corner and winches with a friction of up to "
        f"{100.0 * FRICTIONS[-1]:.0f} % of the rated torque. If a height is shown, friction may "
        "hold the platform there above its stand without power.",
    ]


def _slip_lines(axes: Sequence[dict[str, Any]]) -> list[str]:
    """Return a table of the effect of an unnoticed slip, and the tension afterwards."""
    titles = ["sudden, mm", "slow, mm", "platform off, mm", "peak, N", "allowed, N"]
    rows = [["cable slips", *titles]]
    for axis in axes:
        slip = axis["slip"]
        if slip["unnoticed_m"] is None:
            seen = ["any", "any", f"{slip['off_per_m']:.2f} per mm"]
        else:
            seen = [f"{1e3 * slip[key]:.0f}" for key in ("sudden_m", "unnoticed_m", "off_m")]
        most = "-" if slip["allowed_N"] is None else f"{slip['allowed_N']:g}"
        rows.append([axis["name"], *seen, f"{slip['peak_N']:.0f}", most])
    return [
        TableText(rows),
        "Predicted for a platform at rest, at home or at the places above, whichever is worst: the "
        "largest sudden and the largest slow slip that lengths do not show, the resulting position "
        "error, and the peak tension when the cable becomes taut again.",
    ]


def _tension_lines(figures: dict[str, Any]) -> list[str]:
    # round down: 99.9 % is not 100 %
    held, taken = (math.floor(100.0 * figures[key]) for key in ("held_share", "target_share"))
    reserve, kept = figures["reserve_in_motion_N"], figures["kept_for_control_N"]
    least = "" if reserve is None or reserve < 0.0 else f" ({reserve:.0f} N at the worst place)"
    lines = [
        f"tensions   hold the platform in {held} % of the box; targets are accepted in {taken} % "
        f"of it, where tensions in motion stay at least {kept:.0f} N inside their limits, a "
        f"reserve for the control{least}",
    ]
    lowest = figures["lowest_resonance_Hz"]
    lines.append(f"resonance  of rotors and platform through the cables at {lowest:.1f} Hz or more")
    lines.append(_disagreement_line(figures["lengths_disagree_m"]))
    if figures["loop"] is not None:
        lines += _loop_lines(figures["loop"])
    turns = figures.get("turns_at_most_rad", 0.0)
    if turns != 0.0:  # the angle is 0 for a point
        turning = "turns over" if turns is None else f"turns by up to {math.degrees(turns):.1f} deg"
        lines.append(f"           the platform {turning} there, which no cable can prevent")
        lines += _free_rotation_lines(figures["free_rotation"])
    return lines


def _disagreement_line(allowed_m: float | None) -> str:
    if allowed_m is None:
        return (
            "lengths    cannot contradict each other: a cable that slips but stays tight is not "
            "noticed"
        )
    apart_mm = 1e3 * allowed_m
    return f"lengths    that contradict each other by more than {apart_mm:.1f} mm end a motion"


def _loop_lines(loop: dict[str, float]) -> list[str]:
    slowest, fastest = loop["slowest_Hz"], loop["fastest_Hz"]
    lines = [
        f"loop       has platform modes at {slowest:.1f} to {fastest:.1f} Hz; with cables up to "
        f"{100.0 * _STIFFNESS_OFF:.0f} % softer or stiffer it has a gain margin of "
        f"{loop['gain_margin']:.1f} and a phase margin of "
        f"{math.degrees(loop['phase_margin_rad']):.0f} deg",
        f"           least damped oscillation: {loop['least_damped_Hz']:.1f} Hz, damping "
        f"ratio {loop['least_damping_ratio']:.2g}",
    ]
    if not loop["tensions_follow_pose"]:
        lines.append(
            "           tensions are planned for the set-point and hold the platform there like "
            "springs"
        )
    return lines


def _free_rotation_lines(swings: dict[str, float] | None) -> list[str]:
    if swings is None:
        return []
    lines = [
        f"           this rotation swings at {swings['slowest_Hz']:.1f} to "
        f"{swings['fastest_Hz']:.1f} Hz: by {math.degrees(swings['swing_rad']):.2f} deg after a "
        f"move at full speed, {1e3 * swings['swing_m']:.1f} mm at the anchor points; friction and "
        "lifting also excite it",
    ]
    if swings["lasts_s"] > 0.0:
        lines.append(
            f"           the swing may take {swings['lasts_s']:.0f} s to die down to "
            f"{1e3 * SWINGS_m:g} mm"
        )
    return lines


def _table(axes: Sequence[dict[str, Any]]) -> TableText:
    titles = "exit point, m", "anchor point, m", "cable, m", "tension, N", "torque, Nm"
    rows = [["cable, axis", *titles]]
    for number, axis in enumerate(axes, 1):
        row = [
            f"{number} {axis['name']}",
            point_text(axis["exit_point_m"]),
            point_text(axis["anchor_point_m"], 3),
            "{:.2f} to {:.2f}".format(*axis["cable_m"]),
            "{:g} to {:g}".format(*axis["tension_N"]),
            f"{axis['torque_at_most_Nm']:.3g} of {axis['torque_limit_Nm']:g}",
        ]
        rows.append(row)
    return TableText(rows)


def _sketch(statics: PlatformStatics, platform: Platform) -> list[str]:
    """Return the plane as letters: exit points, home, box of targets and workspace."""
    shown = view_of(platform)
    low, size = np.array(shown.low_m), np.subtract(shown.high_m, shown.low_m)
    # a letter is about twice as high as it is wide
    columns = int(min(_COLUMNS, 2 * _ROWS * size[0] / size[1])) | 1
    rows = max(5, round(0.5 * columns * size[1] / size[0]))
    cells, points = np.full((rows, columns), " "), shown.grid(columns, rows)
    box = (points >= np.array(platform.workspace_min_m)).all(axis=-1)
    box &= (points <= np.array(platform.workspace_max_m)).all(axis=-1)
    cells[statics.margin_N(points) >= 0.0] = "."
    cells[box] = np.where(statics.is_target(points[box], statics.orientations), "#", "!")

    def put(position_m: Sequence[float], letter: str) -> None:
        column, row = np.round((np.array(position_m) - low) / size * [columns - 1, rows - 1])
        cells[int(row), int(column)] = letter

    for i, position_m in enumerate(platform.exit_points_m):
        put(position_m, str((i + 1) % 10))
    put(platform.home_m, "o")
    legend = [
        "1, 2 ... exit points, o at rest, # targets, . also held,",
        "! targets that are rejected",
    ]
    rows_shown = ["".join(row).rstrip() for row in cells[::-1]]
    return ["\n".join(rows_shown).strip("\n"), *legend]
