"""All programs of a robot, by name."""

from __future__ import annotations

import numpy as np

from cdpr_rt.exchange import AxisFeedback, Setpoint
from cdpr_rt.runtime.pose_stream import PoseStream
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.runtime.programs.follow import FollowProgram
from cdpr_rt.runtime.programs.hold import HoldProgram
from cdpr_rt.runtime.programs.idle import IdleProgram
from cdpr_rt.runtime.programs.jog import JogProgram
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.pid import PidProgram
from cdpr_rt.runtime.programs.position_loop import PositionLoop
from cdpr_rt.runtime.programs.sweep import SweepProgram
from cdpr_rt.runtime.shared_block import SharedBlock

_REHEARSED_CYCLES = 5


def build_programs(model: RobotModel, block: SharedBlock) -> dict[str, Program]:
    """Return a robot's programs by name, in the order of their numbers in its description.

    `block` is where the set-point stream comes from.
    """
    loop = PositionLoop(model)
    stream = PoseStream(block, model.period_s)
    programs: tuple[Program, ...] = (
        IdleProgram(model),
        HoldProgram(model, loop),
        JogProgram(model, loop),
        SweepProgram(model),
        PidProgram(model, loop),
        FollowProgram(model, loop, stream),
    )
    return {program.name: program for program in programs}


def rehearse_programs(programs: dict[str, Program], n: int) -> None:
    """Run each program for some cycles on n axes that are not there, so that it is compiled.

    A kernel is compiled when it is called first, which may take seconds.
    """
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    for program in programs.values():
        program.start(feedback, setpoint, torque)
        for _ in range(_REHEARSED_CYCLES):
            feedback.cycle += 1
            program.update(feedback, setpoint, torque)
        program.stop()
        program.update(feedback, setpoint, torque)
