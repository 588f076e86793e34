"""Build the control loop from a robot's file: estimator, programs, limits, and description."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from cdpr_drivers.robot.commissioned import compensation_of, load_profiles
from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import in_force
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_profiles.platform import Platform
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.supervisor import Limits, Supervisor, no_suspects
from cdpr_rt.loop.engine import LoopParts, Lowering
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.machine import Machine
from cdpr_rt.loop.realtime import enable_realtime
from cdpr_rt.loop.stop_socket import StopSocket
from cdpr_rt.loop.warm_up import warm_up_supervision
from cdpr_rt.model.calibration_state import not_calibrated_reason
from cdpr_rt.model.robot_arrays import described, supervisor_limits, winches_of
from cdpr_rt.programs.lower import LowerProgram, lowering_s
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.own_program import OwnProgram
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.registry import (
    build_programs,
    platform_parts,
    warm_up_programs,
)
from cdpr_tools.composition.own_code import OwnCode, completed

_OTHER_CALIBRATION = "a calibration was adopted or undone; restart the daemon"


def control_loop(
    robot: Robot,
    limits: Limits,
    block: SharedBlock,
    machine: Machine,
    parts: LoopParts,
    clock_ns: Callable[[], int] | None = None,
    stops: StopSocket | None = None,
    **described: Any,
) -> ControlLoop:
    """Return the loop that runs `machine` with `parts`; write its description to `block`.

    `described` are additional entries of the description. `clock_ns`, by default CLOCK_MONOTONIC,
    is the clock by which the right to move expires. Local clients stop the motion through `stops`.
    """
    block.write_description({**description(robot, limits, parts), **described})
    return ControlLoop(block, machine, parts, clock_ns, stops)


def loop_parts(
    robot: Robot,
    limits: Limits,
    block: SharedBlock,
    *,
    learns: bool = True,
    own: OwnCode | None = None,
) -> LoopParts:
    """Return the parts that the loop of `robot` runs within `limits`, compiled and ready.

    With `learns` it learns cogging and friction of a platform's uncommissioned motors in motion.
    The user's `own` code, and the tension distribution that the robot's file names, replace
    built-in parts of the platform's control. `own` and installed packages add programs. Raises
    ProfileError if the file's code must not run, and ControlError for unsuitable code.
    """
    own = completed(own or OwnCode(), robot)
    axes, n, period_s = robot.axes, len(robot.axes), robot.sync_period_s
    latencies = [axis.winch.latency_s for axis in axes]
    known = compensation_of(robot, load_profiles(robot, limits), limits)
    model = model_of(axes, period_s, latencies, limits, known)
    estimator = Estimator(n, period_s, winches_of(axes))
    platform = platform_parts(robot, limits, model, estimator, learns=learns)
    programs = build_programs(model, block, platform, own.programs)
    lowering = None
    if platform is not None:
        lowering = Lowering(LowerProgram.name, lowering_s(platform.platform))
    parts = LoopParts(
        programs=programs,
        supervisor=Supervisor(supervisor_limits(limits, robot), n, period_s),
        estimator=estimator,
        axis_names=[axis.name for axis in axes],
        lengths_disagree=None if platform is None else platform.lengths_disagree,
        length_suspects=no_suspects if platform is None else platform.control.suspects,
        lowering=lowering,
        last_stop=None if platform is None else platform.last_stop,
        paths=None if platform is None else platform.paths,
        notices=tuple if platform is None else platform.notices,
        before_power=lambda: look_at_calibration(robot, platform),
        enable_realtime=enable_realtime,
    )
    warm_up_programs(programs, n, platform)
    warm_up_supervision(estimator, parts.supervisor, n)
    if platform is not None:  # not for the imaginary cycles of the warm-up
        platform.control.use_own(own.controller, own.tension_distribution)
    return parts


def look_at_calibration(robot: Robot, platform: PlatformParts | None) -> None:
    """Make the programs reject targets if the geometry cannot be trusted."""
    if platform is None:
        return
    try:
        known = in_force(robot) == robot.calibration
    except ProfileError as error:
        platform.not_calibrated_reason = str(error)
        return
    platform.not_calibrated_reason = (
        not_calibrated_reason(robot.profile) if known else _OTHER_CALIBRATION
    )


def description(robot: Robot, limits: Limits, parts: LoopParts) -> dict[str, Any]:
    """Return the data about a running robot for people and programs."""
    return {
        "robot": robot.name,
        "reference": robot.reference,
        "period_s": robot.sync_period_s,
        "master_heartbeat_s": robot.master_heartbeat_s,
        "axes": [
            {
                "name": axis.name,
                "bus": axis.bus,
                "node_id": axis.node_id,
                "winch": axis.winch.reference,
                "motor": axis.winch.motor.model,
                "gear_ratio": axis.winch.gear_ratio,
                "drum_radius_m": axis.winch.drum_radius_m,
                "cable_m_per_motor_rad": axis.winch.cable_m_per_motor_rad,
                "commissioned": None if axis.commissioned is None else str(axis.commissioned),
            }
            for axis in robot.axes
        ],
        "limits": described(limits, len(robot.axes)),
        "programs": list(parts.programs),
        "own_programs": {
            name: one.described()
            for name, one in parts.programs.items()
            if isinstance(one, OwnProgram)
        },
        "lowering_s": 0.0 if parts.lowering is None else parts.lowering.longest_s,
        "platform": None if robot.platform is None else _platform_description(robot.platform),
        "geometry_sha256": geometry_sha256(robot),
        "calibration": None if robot.calibration is None else robot.calibration.summary(),
        "notes": list(robot.notes),
    }


def _platform_description(platform: Platform) -> dict[str, Any]:
    body = None if platform.body is None else platform.body.model_dump()
    obstacles = [box.model_dump() for box in platform.obstacles]
    return {**asdict(platform), "body": body, "obstacles": obstacles}
