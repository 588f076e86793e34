"""The cycle engine: exchange with the axes, run the active program, record the row."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import Reaction
from cdpr_rt.runtime.control_loop.lifecycle import Lifecycle
from cdpr_rt.runtime.control_loop.loop_parts import LoopParts
from cdpr_rt.runtime.cycle_rows import CycleRows
from cdpr_rt.runtime.machine import Machine
from cdpr_rt.runtime.right import RightToMove

IDLE: Final = "idle"
HOLD: Final = "hold"
TURN_S: Final = 0.005
_TOO_OLD_S: Final = 0.1
"""Age of answers from which on no torque is sent that was computed from them."""
"""Duration of a turn while no cycles run."""

Judge = Callable[[Cycle, FloatArray], int]
"""Limits the torque, (n,) in place, and returns the reaction to what was exceeded or has failed."""


class Engine:
    """Runs the machine's axes under the active program; knows neither commands nor stops.

    A cycle allocates no memory that stays and does not log. It waits in its exchange alone: for its
    deadline, and for the axes' answers.
    """

    def __init__(
        self,
        block: SharedBlock,
        machine: Machine,
        parts: LoopParts,
        clock_ns: Callable[[], int],
    ) -> None:
        self.block = block
        self.machine = machine
        self.parts = parts
        self.programs = list(parts.programs.values())
        self.life = Lifecycle()
        self.program = parts.programs[IDLE]
        self.program_number = 0
        self.last_program = self.program
        """The one of the last cycle, also where its verdict has put another in its place."""
        self.program_error = ""
        """The exception of the program in this cycle, as text."""
        self.setpoint = Setpoint(block.n)
        self.cycling = False
        """Whether cycles run."""
        self.driving = False
        """Whether the drives have power and obey the program."""
        self.reacting = Reaction.NONE
        """The reaction that is ending the motion, NONE while none is."""
        self.missed = 0
        self.cycle: Cycle | None = None
        self.notices: list[str] = []
        self.lost_bus = ""
        """Error of a lost bus, by which cycles cannot go on; "" for none."""
        self.exchange_s = 0.0
        """Time from the last SYNC to its last answer."""
        self.compute_s = 0.0
        """Time from that answer until the last command had been sent."""
        self.answered = 0
        """Number of axes that answered the last SYNC."""
        self.asked_Nm: FloatArray = np.zeros(block.n)
        """Torque commanded by the program, before limits, (n,)."""
        self.reaction = self.limit = 0
        """Reaction of the supervisor in the last cycle, and the limit that caused it."""
        self.limit_axis = -1
        """Axis that exceeded it, -1 where it is of no single axis."""
        self.lengths_disagree_m = math.nan
        """Largest normalised residual of a platform's cable lengths, nan without power."""
        self.right = RightToMove(block, clock_ns)
        self._realtime = False
        self._rows = CycleRows(block)

    def start_cycles(self) -> None:
        """Run cycles from the next turn on, over the device that the machine has opened."""
        device = self.machine.device
        assert device is not None  # it has been opened
        if not device.lockstep and not self._realtime:
            self._realtime = True
            self.notices += self.parts.enable_realtime()
        if self.cycle is None or self.cycle.device is not device:
            self.cycle = Cycle(device, self.machine.watches)
            self.parts.estimator.forget_lengths()  # after a boot angles count from anywhere
        self.cycle.begin()
        self.parts.estimator.reset()
        self.lost_bus = ""
        self.cycling = True
        self.switch(IDLE)

    def stop_cycles(self) -> None:
        """Stop running cycles."""
        self.cycling = self.driving = False

    def cycles_in(self, seconds: float) -> int:
        """Return how many cycles a time lasts, at least one."""
        cycle = self.cycle
        return max(1, round(seconds / (cycle.device.period_s if cycle else TURN_S)))

    def run_cycle(self, judge: Judge) -> None:
        """Exchange with the axes, run the program, supervise its torque, send and record it."""
        cycle, machine = self.cycle, self.machine
        assert cycle is not None  # cycles run
        device = cycle.device
        feedback, torque = device.feedback, device.command.torque_Nm
        self.answered = 0
        try:
            self.answered = cycle.exchange()
        except machine.failures as error:
            self.lost_bus = str(error)
        came_ns, came_s = time.monotonic_ns(), machine.clock.now_s
        self.exchange_s = (came_ns - cycle.began_ns) * 1e-9
        self.missed += device.n - self.answered
        estimator = self.parts.estimator
        estimator.update(
            feedback,
            machine.read_tension(),
            cycle.elapsed_s,
            self.program.controller.motor_loss_Nm,
            self.program.controller.cogging_Nm,
        )
        if self.program.needs_lease:
            self._watch_right()
        program = self.last_program = self.program
        self.program_error = ""
        try:
            program.update(feedback, self.setpoint, torque)
        except Exception as error:  # any mistake of a program stops the drives
            torque[:] = np.nan
            self.program_error = f"program {program.name}: {type(error).__name__}: {error}"
        self.asked_Nm[:] = torque
        self.reaction = judge(cycle, torque)
        if machine.clock.now_s - came_s > _TOO_OLD_S:
            torque[:] = 0.0  # of a process that was stopped meanwhile, whose drives have let go
        try:
            cycle.transmit()
        except machine.failures as error:
            self.lost_bus = str(error)
        sent_ns = time.monotonic_ns()
        self.compute_s = (sent_ns - came_ns) * 1e-9
        supervisor = self.parts.supervisor
        self.limit = int(supervisor.limit) if self.reaction else 0
        self.limit_axis = supervisor.axis if self.limit else -1
        self._rows.write(self)

    def _watch_right(self) -> None:
        """Hold where the client that started the motion has lost the right to move."""
        if not self.driving or self.reacting:
            return
        lost = self.right.loss()
        if lost:
            self.hold(f"{self.program.name}: {lost}; held")

    # -- programs

    def drive(self) -> None:
        """Hold the axes, whose drives are now enabled."""
        self.parts.supervisor.reset()
        self.driving = True
        self.switch(HOLD)

    def hold(self, reason: str, details: Mapping[str, Any] | None = None) -> None:
        """End the motion and hold the axes, for `reason`."""
        self.life.set_reason(reason, details)
        self.switch(HOLD)

    def switch(self, name: str, arguments: Mapping[str, Any] | None = None, right: int = 0) -> None:
        """Change to another program; raises ProgramError and changes nothing then.

        `right` is the number of the grant of the right to move that it runs under, 0 for none.
        """
        program = self.parts.programs[name]
        checked = None if arguments is None else program.check(arguments)
        cycle = self.cycle
        assert cycle is not None  # cycles run
        device = cycle.device
        if not self.driving and not self.machine.read_only:
            device.command.torque_Nm[:] = 0.0
        program.start(device.feedback, self.setpoint, device.command.torque_Nm)
        if arguments is not None:
            program.apply(checked)
        self.program, self.right.mover = program, right
        self.program_number = self.programs.index(program)
        self._rows.follow(self)
        self.life.changed = True
