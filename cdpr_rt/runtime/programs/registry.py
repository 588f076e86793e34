"""All programs of a robot, by name."""

from __future__ import annotations

import numpy as np

from cdpr_rt.compensation import Compensation
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.limits import Limits
from cdpr_rt.robots.planar_control import PlanarControl
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.pose_stream import PoseStream
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.runtime.programs.follow import FollowProgram
from cdpr_rt.runtime.programs.hold import HoldProgram
from cdpr_rt.runtime.programs.idle import IdleProgram
from cdpr_rt.runtime.programs.jog import JogProgram
from cdpr_rt.runtime.programs.lower import LowerProgram
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.pid import PidProgram
from cdpr_rt.runtime.programs.platform_axes import PlatformHold, PlatformIdle, PlatformJog
from cdpr_rt.runtime.programs.platform_program import PlatformParts
from cdpr_rt.runtime.programs.pose import PoseProgram
from cdpr_rt.runtime.programs.position_loop import PositionLoop
from cdpr_rt.runtime.programs.sweep import SweepProgram
from cdpr_rt.runtime.programs.tighten import TightenProgram
from cdpr_rt.runtime.robot_arrays import can_lower
from cdpr_rt.runtime.shared_block import SharedBlock
from profiles import Robot

_REHEARSED_CYCLES = 5


def platform_parts(
    robot: Robot, limits: Limits, model: RobotModel, estimator: Estimator
) -> PlatformParts | None:
    """Return what the programs of a planar robot with three cables share; None for any other.

    Raises GeometryError where its tensions have no bounds to hold it by.
    """
    platform = robot.platform
    if platform is None or not can_lower(robot):
        return None
    low, high = (
        np.broadcast_to(bound, (model.n,)).astype(float)
        for bound in (limits.tension_min_N, limits.tension_max_N)
    )
    known = None
    if any(axis is not None for axis in model.compensation):
        known = Compensation(list(model.compensation), model.period_s)
    control = PlanarControl(
        platform, list(robot.axes), low, high, model.torque_Nm, model.period_s, known
    )
    return PlatformParts(
        platform, control, estimator, model.period_s, high, known, limits.lengths_disagree_m
    )


def build_programs(
    model: RobotModel, block: SharedBlock, parts: PlatformParts | None = None
) -> dict[str, Program]:
    """Return a robot's programs by name, in the order of their numbers in its description.

    `block` is where the set-point stream comes from, `parts` is of a robot whose platform is moved.
    """
    loop = PositionLoop(model)
    stream = PoseStream(block, model.period_s)
    if parts is not None:
        return {program.name: program for program in _of_platform(model, loop, stream, parts)}
    programs: tuple[Program, ...] = (
        IdleProgram(model),
        HoldProgram(model, loop),
        JogProgram(model, loop),
        SweepProgram(model),
        PidProgram(model, loop),
        FollowProgram(model, loop, stream),
    )
    return {program.name: program for program in programs}


def _of_platform(
    model: RobotModel, loop: PositionLoop, stream: PoseStream, parts: PlatformParts
) -> tuple[Program, ...]:
    torque_Nm, cable_m = model.torque_Nm, model.cable_m_per_rad
    return (
        PlatformIdle(parts, model),
        PlatformHold(parts, model, loop),
        PlatformJog(parts, model, loop),
        TightenProgram(parts, torque_Nm, cable_m),
        PoseProgram(parts, torque_Nm, stream),
        LowerProgram(parts, torque_Nm, cable_m),
    )


def rehearse_programs(
    programs: dict[str, Program], n: int, parts: PlatformParts | None = None
) -> None:
    """Run each program for some cycles on n axes that are not there, so that it is compiled.

    A kernel is compiled when it is called first, which may take seconds.
    """
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    _run_each(programs, feedback, setpoint, torque)
    if parts is not None:
        parts.pretend(feedback)
        for program in programs.values():
            parts.tight = True  # idle and jog slacken
            _run_each({program.name: program}, feedback, setpoint, torque)
        parts.forget()


def _run_each(
    programs: dict[str, Program],
    feedback: AxisFeedback,
    setpoint: Setpoint,
    torque: FloatArray,
) -> None:
    for program in programs.values():
        program.start(feedback, setpoint, torque)
        for _ in range(_REHEARSED_CYCLES):
            feedback.cycle += 1
            program.update(feedback, setpoint, torque)
        program.stop()
        program.update(feedback, setpoint, torque)
