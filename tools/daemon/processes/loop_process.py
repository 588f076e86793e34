"""The daemon's real-time process: one robot's control loop, from boot to controlled stop."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import asdict
from pathlib import Path
from types import FrameType
from typing import Any

from cdpr_drivers.errors import DriverError
from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_drivers.robot.commissioned import compensation_of, load_profiles, with_commissioned
from cdpr_drivers.robot.listening_machine import ListeningMachine
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_drivers.robot.robot_buses import refuse_simulated_calibration, robot_urls
from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import geometry_sha256
from cdpr_profiles.calibration.in_force import in_force, load_calibrated
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import Platform
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.limits import Limits
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.supervisor import Supervisor
from cdpr_rt.errors import ControlError
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.platform.lower import LowerProgram, lowering_s
from cdpr_rt.programs.platform.paths.path_progress import paths_folder
from cdpr_rt.programs.platform.paths.path_store import PathStore
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.registry import (
    build_programs,
    platform_parts,
    warm_up_programs,
)
from cdpr_rt.robots.checks import refuse_impossible
from cdpr_rt.robots.persistence.calibration_state import not_calibrated_reason
from cdpr_rt.robots.robot_arrays import described, limits_of, supervisor_limits, winches_of
from cdpr_rt.runtime.control_loop.loop import ControlLoop
from cdpr_rt.runtime.control_loop.loop_parts import LoopParts, Lowering
from cdpr_rt.runtime.machine import Machine
from cdpr_rt.runtime.realtime import enable_realtime, freeze_memory
from cdpr_rt.runtime.warm_up import warm_up_supervision
from cdpr_rt.state_file import state_path
from cdpr_tools.compiling import tell_of_compiling
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL
from cdpr_tools.daemon.processes.child import end_with_launcher
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import BAD_INPUT, DONE, FAILED

_OTHER_CALIBRATION = "a calibration was taken over or undone; start the daemon anew"


def main() -> int:
    """Run the loop that the launcher has asked for; return the exit status."""
    tell_of_compiling("the control loop")
    settings = RunSettings.from_argv()
    block = SharedBlock.attach(settings.block_fd)
    try:
        robot = load_calibrated(settings.robot)
        refuse_impossible(robot)
        refuse_simulated_calibration(robot, settings.buses)
        robot = with_commissioned(robot, settings.commissioned)
        require_fit(robot)
        machine: Machine
        if settings.read_only:
            machine = ListeningMachine(robot, settings.buses)
        else:
            machine = RobotMachine(
                robot, settings.buses, settings.safety_io, settings.tension_port, real_time=True
            )
        limits = limits_of(robot)
        parts = loop_parts(robot, limits, block)
    except (ProfileError, DriverError, ControlError) as error:
        print(f"cdpr: {error}", file=sys.stderr)
        return BAD_INPUT
    simulated = any(url.is_simulated for url in robot_urls(robot, settings.buses).values())
    block.write_description({**description(robot, limits, parts), "simulated": simulated})
    if parts.last is not None and robot.platform is not None:
        parts.last.path = _lengths_file(robot, settings)
        parts.last.geometry = robot.geometry_identity
        parts.last.load(len(robot.axes), robot.platform.longest_cable_m)
    if parts.paths is not None:
        _open_paths(parts.paths, robot, settings, block)
    loop = ControlLoop(block, machine, parts)
    loop.engine.notices += freeze_memory()
    _obey_signals(loop)
    end_with_launcher(settings.launcher_pid)
    counters = block.counters
    if counters["start_monotonic_ns"][0] == 0:
        counters["start_monotonic_ns"] = time.monotonic_ns()
        counters["start_realtime_ns"] = time.time_ns()
    counters["loop_pid"] = os.getpid()
    try:
        loop.run()
    finally:  # so that who finds the process while it ends knows that, and does it no harm
        signal.signal(POWER_OFF_SIGNAL, signal.SIG_IGN)
    if unconfirmed := loop.transitions.power_off_unconfirmed:
        print(f"cdpr: {unconfirmed}", file=sys.stderr)
        return FAILED
    return DONE


def _lengths_file(robot: Robot, settings: RunSettings) -> Path | None:
    """Return where the lengths of the last stop are kept, a simulation's apart from a robot's.

    A simulator that begins with the daemon begins at home, whatever became of the one before.
    """
    if settings.own_simulator:
        return None
    return state_path(
        "lengths", f"{robot.profile}.simulated" if settings.simulated else robot.profile
    )


def _open_paths(paths: PathStore, robot: Robot, settings: RunSettings, block: SharedBlock) -> None:
    """Have planned paths from their folder; a robot without one runs all the same."""
    try:
        paths.open(
            paths_folder(robot.profile), block.counters["path"], simulated=settings.simulated
        )
    except ControlError as error:
        print(f"cdpr: paths cannot be followed: {error}", file=sys.stderr)


def loop_parts(
    robot: Robot, limits: Limits, block: SharedBlock, *, learns: bool = True
) -> LoopParts:
    """Return what the loop of `robot` runs within `limits`, compiled and ready.

    `learns`: of a platform's motors that were not commissioned, it learns in motion what they do.
    """
    axes, n, period_s = robot.axes, len(robot.axes), robot.sync_period_s
    latencies = [axis.winch.latency_s for axis in axes]
    known = compensation_of(robot, load_profiles(robot))
    model = model_of(axes, period_s, latencies, limits, known)
    estimator = Estimator(n, period_s, winches_of(axes))
    platform = platform_parts(robot, limits, model, estimator, learns=learns)
    programs = build_programs(model, block, platform)
    lowering = None
    if platform is not None:
        lowering = Lowering(LowerProgram.name, lowering_s(platform.platform))
    names = [axis.name for axis in axes]
    parts = LoopParts(
        programs=programs,
        supervisor=Supervisor(supervisor_limits(limits, robot), n, period_s, names),
        estimator=estimator,
        lengths_disagree_m=None if platform is None else platform.lengths_disagree_m,
        lowering=lowering,
        last=None if platform is None else platform.last,
        paths=None if platform is None else platform.paths,
        notices=tuple if platform is None else platform.notices,
        before_power=lambda: look_at_calibration(robot, platform),
        enable_realtime=enable_realtime,
    )
    warm_up_programs(programs, n, platform)
    warm_up_supervision(estimator, parts.supervisor, n)
    return parts


def look_at_calibration(robot: Robot, platform: PlatformParts | None) -> None:
    """Have the programs refuse targets where the geometry may not be believed."""
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
    """Return what people and programs should know of a robot that is run."""
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
        "lowering_s": 0.0 if parts.lowering is None else parts.lowering.longest_s,
        "platform": None if robot.platform is None else _told(robot.platform),
        "geometry_sha256": geometry_sha256(robot),
        "calibration": None if robot.calibration is None else robot.calibration.summary(),
        "notes": list(robot.notes),
    }


def _told(platform: Platform) -> dict[str, Any]:
    body = None if platform.body is None else platform.body.model_dump()
    obstacles = [box.model_dump() for box in platform.obstacles]
    return {**asdict(platform), "body": body, "obstacles": obstacles}


def _obey_signals(loop: ControlLoop) -> None:
    def stop(_number: int, _frame: FrameType | None) -> None:
        loop.request_stop()

    def remove_power(_number: int, _frame: FrameType | None) -> None:
        loop.request_power_off()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop)
    signal.signal(POWER_OFF_SIGNAL, remove_power)


if __name__ == "__main__":
    sys.exit(main())
