"""The daemon's real-time process: one robot's control loop, from boot to controlled stop."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import asdict
from types import FrameType
from typing import Any

from cdpr_rt.errors import ControlError
from cdpr_rt.realtime import settle_memory, stay_punctual
from cdpr_rt.rehearsal import rehearse_judgement
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.loop import ControlLoop
from cdpr_rt.runtime.loop_parts import LoopParts
from cdpr_rt.runtime.programs.lower import lowering_s
from cdpr_rt.runtime.programs.model import model_of
from cdpr_rt.runtime.programs.registry import (
    build_programs,
    platform_parts,
    rehearse_programs,
)
from cdpr_rt.runtime.robot_arrays import described, limits_of, supervised, winches_of
from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.state_file import state_path
from cdpr_rt.supervisor import Supervisor
from profiles import Robot, load_robot
from profiles.errors import ProfileError
from tools.bus_fit import require_fit
from tools.commissioned import compensation_of, load_profiles, with_commissioned
from tools.daemon.child import end_with
from tools.daemon.listening_machine import ListeningMachine
from tools.daemon.loop_file import POWER_OFF_SIGNAL
from tools.daemon.machine import RobotMachine
from tools.daemon.settings import RunSettings
from tools.errors import BAD_INPUT, DONE, FAILED, CommandError


def main() -> int:
    """Run the loop that the launcher has asked for; return the exit status."""
    settings = RunSettings.from_argv()
    block = SharedBlock.attach(settings.block_fd)
    try:
        robot = with_commissioned(load_robot(settings.robot), settings.commissioned)
        require_fit(robot)
        machine = (
            ListeningMachine(robot, settings)
            if settings.read_only
            else RobotMachine(robot, settings, real_time=True)
        )
        parts = loop_parts(robot, block)
    except (ProfileError, CommandError, ControlError) as error:
        print(f"cdpr: {error}", file=sys.stderr)
        return BAD_INPUT
    block.write_description(description(robot, parts))
    if parts.last is not None and robot.platform is not None:
        parts.last.path = state_path("lengths", robot.profile)
        parts.last.load(len(robot.axes), robot.platform.longest_cable_m)
    loop = ControlLoop(block, machine, parts)
    loop.notices += settle_memory()
    _obey_signals(loop)
    end_with(settings.launcher_pid)
    counters = block.counters
    if counters["start_monotonic_ns"][0] == 0:
        counters["start_monotonic_ns"] = time.monotonic_ns()
        counters["start_realtime_ns"] = time.time_ns()
    counters["loop_pid"] = os.getpid()
    loop.run()
    if loop.doubt:
        print(f"cdpr: {loop.doubt}", file=sys.stderr)
        return FAILED
    return DONE


def loop_parts(robot: Robot, block: SharedBlock) -> LoopParts:
    """Return what the loop of `robot` runs, compiled and ready."""
    axes, n, period_s = robot.axes, len(robot.axes), robot.sync_period_s
    limits = limits_of(robot)
    latencies = [axis.winch.latency_s for axis in axes]
    known = compensation_of(robot, load_profiles(robot))
    model = model_of(axes, period_s, latencies, limits, known)
    estimator = Estimator(n, period_s, winches_of(axes))
    platform = platform_parts(robot, limits, model, estimator)
    programs = build_programs(model, block, platform)
    names = [axis.name for axis in axes]
    parts = LoopParts(
        programs=programs,
        supervisor=Supervisor(supervised(limits, robot), n, period_s, names),
        estimator=estimator,
        lengths_disagree_m=float if platform is None else platform.lengths_disagree_m,
        lowering_s=0.0 if platform is None else lowering_s(platform.platform),
        last=None if platform is None else platform.last,
        punctual=stay_punctual,
    )
    rehearse_programs(programs, n, platform)
    rehearse_judgement(estimator, parts.supervisor, n)
    return parts


def description(robot: Robot, parts: LoopParts) -> dict[str, Any]:
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
        "limits": described(limits_of(robot), len(robot.axes)),
        "programs": list(parts.programs),
        "lowering_s": parts.lowering_s,
        "platform": None if robot.platform is None else asdict(robot.platform),
        "notes": list(robot.notes),
    }


def _obey_signals(loop: ControlLoop) -> None:
    def stop(_number: int, _frame: FrameType | None) -> None:
        loop.request_stop()

    def take_power(_number: int, _frame: FrameType | None) -> None:
        loop.request_power_off()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop)
    signal.signal(POWER_OFF_SIGNAL, take_power)


if __name__ == "__main__":
    sys.exit(main())
