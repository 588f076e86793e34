"""What is impossible or doubtful about a robot's loop."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cdpr_profiles import Robot
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.feasibility.not_held import point_text
from cdpr_rt.robots.feasibility.turned_by_friction import (
    moved_by_friction_m,
    stretched_by_acceleration_m,
    turned_by_friction,
)
from cdpr_rt.robots.platform.design.designed_loop import DesignedLoop, designed_loop
from cdpr_rt.robots.platform.design.loop_design import (
    SwingsError,
    UnstableError,
    design_poses,
)
from cdpr_rt.robots.platform.design.loop_plant import CABLE_DAMPING_s, LITTLE_DAMPING_s
from cdpr_rt.robots.statics import PlatformStatics

_SLOW_Hz = 0.5
"""Slowest mode of a loop: it settles within 2 % in 2.3 s."""
_SWINGS_s = 5.0
"""Longest time in which a mode dies down to 2 %."""


def loop_findings(robot: Robot, statics: PlatformStatics) -> Iterator[Finding]:
    """Yield what is impossible or doubtful about the loop that is designed for a robot."""
    try:
        loop = designed_loop(statics.model, robot.axes, robot.sync_period_s)
    except GeometryError as error:
        if isinstance(error, SwingsError):
            text = f"value {robot.sync_period_s:g}; {error}: a shorter cycle, longer arms or less "
            text += f"tension_max_N help{_known_damping(robot)}"
            yield Finding("sync_period_s", text, impossible=True)
        elif isinstance(error, UnstableError):
            text = (
                f"{error}: anchor points that lie towards their exit points, with longer arms, help"
            )
            yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return  # else said of the tensions
    slowest_Hz = loop.slowest_rad_s / math.tau
    if slowest_Hz < _SLOW_Hz:
        off_mm = 1e3 * moved_by_friction_m(statics.model, robot.axes, loop.gains)
        yield_mm = 1e3 * stretched_by_acceleration_m(statics.model, robot.axes)
        text = (
            f"a stable loop moves the platform's slowest mode at {slowest_Hz:.2g} Hz, so that it "
            "takes long to come to rest and runs over its targets: its cables yield by "
            f"{yield_mm:.2g} mm as it is accelerated, and friction that is usual in such winches "
            f"moves it by {off_mm:.2g} mm until the control overcomes it; {_SLOW_Hz:g} Hz and more "
            "wanted: stiffer cables, less acceleration, a lighter platform or a shorter "
            "sync_period_s help"
        )
        yield Finding("platform.mass_kg", text, impossible=False)
    if loop.gains.follows_pose and (text := turned_by_friction(statics, robot.axes, loop.gains)):
        yield Finding("axes[0].anchor_point_m", text, impossible=False)
    yield from _swinging(loop, statics)
    assumed = any("damping_s" not in axis.winch.cable.model_fields_set for axis in robot.axes)
    if assumed:
        yield from _growing(loop, robot.sync_period_s, statics)


def _known_damping(robot: Robot) -> str:
    """Return that the cables' profile has them damp less than was assumed, "" where not."""
    least_s = min(axis.winch.cable.damping_s for axis in robot.axes)
    if least_s >= CABLE_DAMPING_s:
        return ""
    return f"; damping_s of the cables' profile is {1e3 * least_s:g} ms"


def _swinging(loop: DesignedLoop, statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether a platform swings for long somewhere."""
    at_poses = zip(loop.modes, design_poses(statics.model), strict=True)
    mode, place = max(at_poses, key=lambda at: at[0].dies_down_s)
    if mode.dies_down_s <= _SWINGS_s:
        return
    if loop.gains.follows_pose:
        key, held, helps = "platform.mass_kg", "", "stiffer cables, a lighter platform"
    else:  # wherever friction turns it
        key, held = "axes[0].anchor_point_m", "held by its tensions as by springs, "
        helps = "longer arms, less tension_max_N"
    text = (
        f"{held}with the platform at {point_text(place[: statics.model.positions])} m it may "
        f"swing at {mode.frequency_Hz:.2g} Hz, with {100.0 * mode.damping_ratio:.1g} % of critical "
        f"damping, for {mode.dies_down_s:.2g} s after it has moved, besides what winches rub; "
        f"up to {_SWINGS_s:g} s wanted: {helps} or a shorter sync_period_s help"
    )
    yield Finding(key, text, impossible=False)


def _growing(loop: DesignedLoop, period_s: float, statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether a mode grows somewhere if cables damp little."""
    if not loop.growing_modes:
        return
    at_poses = zip(loop.growing_modes, design_poses(statics.model), strict=True)
    mode, place = min(at_poses, key=lambda at: at[0].damping_ratio)
    text = (
        f"value {period_s:g}; the loop leans on what the cables are assumed to take out "
        f"of a swing (damping_s of their profile): with {1e3 * LITTLE_DAMPING_s:g} ms a mode at "
        f"{mode.frequency_Hz:.2g} Hz grows with the platform at "
        f"{point_text(place[: statics.model.positions])} m; a shorter cycle helps, or that value "
        "measured, which the loop is designed for then"
    )
    yield Finding("sync_period_s", text, impossible=False)
