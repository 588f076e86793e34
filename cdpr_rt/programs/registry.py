"""All programs of a robot, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.platform.cable_control import CableControl
from cdpr_rt.programs.axis_program import AxisProgram, PositionLoop
from cdpr_rt.programs.base import Program
from cdpr_rt.programs.follow import FollowProgram
from cdpr_rt.programs.idle import IdleProgram
from cdpr_rt.programs.jog import JogProgram
from cdpr_rt.programs.lower import LowerProgram
from cdpr_rt.programs.model import AxesModel
from cdpr_rt.programs.own_program import OwnProgram, checked_programs
from cdpr_rt.programs.path import PathProgram
from cdpr_rt.programs.pid import PidProgram
from cdpr_rt.programs.platform_axes import PlatformHold, PlatformIdle, PlatformJog
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.pose import PoseProgram
from cdpr_rt.programs.sweep import SweepProgram
from cdpr_rt.programs.tighten import TightenProgram

_WARM_UP_CYCLES = 5


def platform_parts(
    robot: Robot, limits: Limits, model: AxesModel, estimator: Estimator, *, learns: bool = True
) -> PlatformParts | None:
    """Return the shared parts of a platform's programs; None without a platform.

    If `learns`, the control learns friction and cogging of uncommissioned motors in motion. Raises
    GeometryError if the bounds of the tensions do not allow them to hold the platform.
    """
    if robot.platform is None:
        return None
    known = None
    if any(axis is not None for axis in model.compensation):
        known = Compensation(list(model.compensation), model.period_s)
    of_platform = platform_model_of(robot, limits)
    control = CableControl(
        of_platform, robot.axes, model.torque_Nm, robot.sync_period_s, known, learns=learns
    )
    names = [axis.name for axis in robot.axes]
    return PlatformParts(
        of_platform, control, estimator, model.period_s, known, limits.lengths_disagree_m, names
    )


def build_programs(
    model: AxesModel,
    block: SharedBlock,
    parts: PlatformParts | None = None,
    own: Sequence[tuple[str, Any]] = (),
) -> dict[str, Program]:
    """Return a robot's programs by name, in the order of their numbers in its description.

    `block` has the set-point stream. `parts` are given if the robot has a platform to move. In that
    case, `own` are user-written programs, see `checked_programs`. Raises ControlError.
    """
    loop = PositionLoop(model)
    stream = PoseStream(block, model.period_s)
    if parts is not None:
        built_in = {program.name: program for program in _of_platform(model, loop, stream, parts)}
        return built_in | {
            one.name: OwnProgram(one, parts, model.torque_Nm, stream)
            for one in checked_programs(own, built_in)
        }
    programs: tuple[Program, ...] = (
        IdleProgram(model),
        AxisProgram(model, loop),  # the program `hold`
        JogProgram(model, loop),
        SweepProgram(model),
        PidProgram(model, loop),
        FollowProgram(model, loop, stream),
    )
    return {program.name: program for program in programs}


def _of_platform(
    model: AxesModel, loop: PositionLoop, stream: PoseStream, parts: PlatformParts
) -> tuple[Program, ...]:
    torque_Nm, cable_m = model.torque_Nm, model.cable_m_per_rad
    path = PathProgram(parts, torque_Nm)
    return (
        PlatformIdle(parts, model),
        PlatformHold(parts, model, loop, path),
        PlatformJog(parts, model, loop),
        TightenProgram(parts, torque_Nm, cable_m),
        PoseProgram(parts, torque_Nm, stream),
        LowerProgram(parts, torque_Nm, cable_m),
        path,
    )


def warm_up_programs(
    programs: dict[str, Program], n: int, parts: PlatformParts | None = None
) -> None:
    """Run each program for some cycles on n imaginary axes, so that its kernels are compiled.

    The first call of a kernel compiles it, which may take seconds.
    """
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    _run_each(programs, feedback, setpoint, torque)
    if parts is not None:
        parts.assume_at_home(feedback)
        for program in programs.values():
            parts.tight = True  # `idle` and `jog` have marked the cables as slack
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
        for _ in range(_WARM_UP_CYCLES):
            feedback.cycle += 1
            program.update(feedback, setpoint, torque)
        program.stop()
        program.update(feedback, setpoint, torque)
