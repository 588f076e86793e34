"""All programs of a robot, by name."""

from __future__ import annotations

import numpy as np

from cdpr_rt.exchange import AxisFeedback, Setpoint
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.runtime.programs.hold import HoldProgram
from cdpr_rt.runtime.programs.idle import IdleProgram
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.position_loop import PositionLoop

_REHEARSED_CYCLES = 5


def build_programs(model: RobotModel) -> dict[str, Program]:
    """Return a robot's programs by name, in the order of their numbers in its description."""
    loop = PositionLoop(model)
    programs: list[Program] = [IdleProgram(model), HoldProgram(model, loop)]
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
