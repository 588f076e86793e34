"""The control loop of the daemon: one cycle after the other, whatever state the robot is in."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from cdpr_rt.cycle import Cycle
from cdpr_rt.errors import ControlError
from cdpr_rt.exchange import FloatArray, Setpoint
from cdpr_rt.limits import BLINDING, MISLEADING, Limit
from cdpr_rt.runtime import procedures
from cdpr_rt.runtime.cycle_rows import CycleRows
from cdpr_rt.runtime.lifecycle import Lifecycle
from cdpr_rt.runtime.loop_parts import LoopParts
from cdpr_rt.runtime.machine import Machine
from cdpr_rt.runtime.orders import Orders
from cdpr_rt.runtime.right import RightToMove
from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.runtime.states import LoopState, Reaction
from cdpr_rt.runtime.status import StatusPage
from cdpr_rt.runtime.stop_requests import StopRequests
from cdpr_rt.task import Task

IDLE, HOLD, LOWER = "idle", "hold", "lower"
_TURN_S = 0.005


class ControlLoop:
    """Runs the machine's axes until it is told to end; shares nothing but `block`.

    Within a cycle nothing is allocated that stays, waited for, or logged. Commands are looked at
    after the cycle's own command has been sent; what takes several cycles is a generator that is
    advanced once a cycle, what waits for answers on a bus a task, which is advanced as often.
    `clock_ns` is the clock that the right to move runs out by, and the status is renewed by.
    """

    def __init__(
        self,
        block: SharedBlock,
        machine: Machine,
        parts: LoopParts,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.block = block
        self.machine = machine
        self.parts = parts
        self.programs = list(parts.programs.values())
        self.life = Lifecycle()
        self.program = parts.programs[IDLE]
        self.program_number = 0
        self.setpoint = Setpoint(block.n)
        self.cycling = False
        """Whether cycles run."""
        self.driving = False
        """Whether the drives have power and obey the program."""
        self.first_program = HOLD
        """What runs once the drives have got their power."""
        self.reacting = Reaction.NONE
        """What ends the present motion, NONE while nothing does."""
        self.ended = False
        self.doubt = ""
        """Which drive is not known to be without power at the end."""
        self.missed = 0
        self.cycle: Cycle | None = None
        self.notices: list[str] = []
        self.lost_bus = ""
        """Why cycles cannot go on, as a bus has gone away."""
        self.exchange_s = 0.0
        """From the last SYNC to its last answer."""
        self._requests = StopRequests(self)
        self._job: Task[Any] | None = None
        self._program_error, self._punctual = "", False
        self._rows = CycleRows(block)
        self._asked: FloatArray = np.zeros(block.n)
        self._alive = block.counters["loop_alive_ns"].data
        self.right = RightToMove(block, clock_ns)
        self._orders = Orders(self)
        self.status = StatusPage(self, clock_ns)
        self._procedure: Iterator[None] | None = None
        self.lowering_blind = False
        """Whether the winches that are left let the platform down, whatever is known of it."""

    # -- running

    def run(self) -> None:
        """Boot, check, then turn until told to end; the drives have no power afterwards."""
        try:
            self.begin(procedures.start_up(self))
            while not self.ended:
                self.turn()
        finally:
            if self._job is not None:
                self._job.cancel()
            self.machine.close()
            self.status.publish()

    def turn(self) -> None:
        """Run one cycle, or wait a moment where none run; then what may follow it."""
        self._alive[0] = time.monotonic_ns()
        if self.cycling:
            self._run_cycle()
            self.machine.clock.turn()
        else:
            self.machine.clock.sleep(_TURN_S)
        self._requests.watch()
        self._orders.take()
        if self._procedure is not None:
            self._advance(self._procedure)
        self.status.look()

    def request_stop(self) -> None:
        """Have the loop end under control. For signal handlers."""
        self._requests.stop = True

    def request_power_off(self) -> None:
        """Have the power taken at once, whatever goes on. For signal handlers."""
        self._requests.power_off = True

    def start_cycles(self) -> None:
        """Run cycles from the next turn on, over the device that the machine has opened."""
        device = self.machine.device
        assert device is not None  # it has been opened
        if not device.lockstep and not self._punctual:
            self._punctual = True
            self.notices += self.parts.punctual()
        if self.cycle is None or self.cycle.device is not device:
            self.cycle = Cycle(device, self.machine.watches)
            self.parts.estimator.forget_lengths()  # drives that have booted count from anywhere
        self.cycle.begin()
        self.parts.estimator.reset()
        self.lost_bus = ""
        self.cycling = True
        self.switch(IDLE)

    def stop_cycles(self) -> None:
        """Run no cycles for now."""
        self.cycling = self.driving = False

    def _run_cycle(self) -> None:
        cycle, machine = self.cycle, self.machine
        assert cycle is not None  # cycles run
        device = cycle.device
        feedback, torque = device.feedback, device.command.torque_Nm
        answered = 0
        try:
            answered = cycle.exchange()
        except machine.failures as error:
            self.lost_bus = str(error)
        came_ns = time.monotonic_ns()
        self.exchange_s = (came_ns - cycle.began_ns) * 1e-9
        self.missed += device.n - answered
        estimator = self.parts.estimator
        estimator.update(
            feedback,
            machine.read_tension(),
            cycle.elapsed_s,
            self.program.controller.compensation_Nm,
        )
        if self.program.needs_lease:
            self._watch_right()
        program, self._program_error = self.program, ""
        try:
            program.update(feedback, self.setpoint, torque)
        except Exception as error:  # whatever a program does wrong: its drives are stopped
            torque[:] = np.nan
            self._program_error = f"program {program.name}: {type(error).__name__}: {error}"
        self._asked[:] = torque
        reaction = self._judge(cycle, torque)
        try:
            cycle.transmit()
        except machine.failures as error:
            self.lost_bus = str(error)
        sent_ns = time.monotonic_ns()
        supervisor = self.parts.supervisor
        limit = int(supervisor.limit) if reaction else 0
        self._rows.write(
            program,
            feedback.cycle,
            feedback.time_s,
            cycle.began_ns,
            cycle.late_s,
            self.exchange_s,
            (sent_ns - came_ns) * 1e-9,
            self.missed,
            cycle.lateness.late,
            program.stream_age_s,
            program.stream_buttons,
            self.life.state,
            self.program_number,
            reaction,
            limit,
            supervisor.axis if limit else -1,
            answered,
        )

    # -- judging

    def _judge(self, cycle: Cycle, torque: FloatArray) -> int:
        """Clamp the torque; react to what was exceeded or has failed; return the reaction."""
        supervisor = self.parts.supervisor
        reaction = 0
        if self.driving:
            estimate = self.parts.estimator.estimate
            reaction = supervisor.check(cycle.device.feedback, estimate, self.setpoint, torque)
            if self.parts.lengths_disagree_m is not None:
                reaction = supervisor.compare_lengths(self.parts.lengths_disagree_m())
        else:
            torque[:] = 0.0
        # in a fault the drives' complaints are known, and putting them in words takes its time
        known = self.life.state is LoopState.FAULT or self.lowering_blind
        failure = self.lost_bus or ("" if known else cycle.device.alarm())
        alarm = stop = ""
        if cycle.watches:
            alarm, stop = cycle.watch_alarm(), cycle.stop_reason()
        if failure or alarm or stop:
            if not self.driving:
                supervisor.reset()
            for limit, reason in (
                (Limit.DRIVE, failure),
                (Limit.SAFETY_ALARM, alarm),
                (Limit.SAFETY_STOP, stop),
            ):
                if reason:
                    reaction = supervisor.report(limit, reason)
        if reaction > Reaction.CLAMP:
            self._react(Reaction(reaction), torque)
        return reaction

    def _react(self, reaction: Reaction, torque: FloatArray) -> None:
        supervisor, state = self.parts.supervisor, self.life.state
        if state not in (LoopState.READY, LoopState.ACTIVE):
            return  # in a fault it is known already; while the bus is checked the check sees it
        if self.lost_bus:
            reaction = max(reaction, Reaction.QUICK_STOP)  # nobody can be led to a standstill
        if self.lowering_blind and supervisor.limit is Limit.NOT_FINITE:
            reaction = max(reaction, Reaction.QUICK_STOP)  # what lets the platform down has failed
        # what is let down blind may be fast without anything wrong with its lengths
        doubtful = supervisor.limit in ({Limit.ENCODER_JUMP} if self.lowering_blind else MISLEADING)
        if reaction > Reaction.HOLD and doubtful and LOWER in self.parts.programs:
            self.parts.estimator.forget_lengths()
        if reaction <= self.reacting and not self._misleads_lowering():
            return
        reason = self._program_error or supervisor.reason()
        if reaction is Reaction.HOLD:
            if self.program.name != HOLD and self.driving:
                self.life.blame(reason, supervisor.details())
                self.switch(HOLD)
            return
        self.life.blame(reason, supervisor.details())
        if state is LoopState.ACTIVE:
            self.stop(reaction, LoopState.FAULT, torque)
        else:
            self.machine.power_off()
            self.begin(procedures.fall(self))
        self.status.touch()

    def _misleads_lowering(self) -> bool:
        """Whether a platform that is being taken home is not to be led there any more."""
        goes_home = self.driving and self.lowers and not self.lowering_blind
        return goes_home and self.parts.supervisor.limit in BLINDING

    def stop(self, reaction: Reaction, then: LoopState, torque: FloatArray | None = None) -> None:
        """End the motion as `reaction` says and go to state `then`."""
        brakes = reaction is Reaction.CONTROLLED_STOP and self.driving
        if brakes and not self._begins_to_brake(then):
            brakes, reaction = False, Reaction.QUICK_STOP
        self.reacting = reaction
        if not brakes:
            if reaction is Reaction.QUICK_STOP:
                self.machine.quick_stop()
            else:
                self.machine.power_off()
            self.driving = False
            if torque is not None:
                torque[:] = 0.0
            self.switch(IDLE)
        self.begin(procedures.come_to_rest(self, then))

    def _begins_to_brake(self, then: LoopState) -> bool:
        """Have the program brake; whether it does."""
        fault = then is LoopState.FAULT and LOWER in self.parts.programs
        blind = fault and self.parts.supervisor.limit in BLINDING
        if blind and not self.lowers:
            return False
        try:
            if blind:
                self._lower_blind()
            else:
                self.program.stop()
        except Exception:  # whatever a program does wrong: the drives can brake by themselves
            traceback.print_exc()
            return False
        return True

    @property
    def lowers(self) -> bool:
        """Whether a platform is let down before the power goes, as no brakes would hold it."""
        return LOWER in self.parts.programs and not self.machine.has_brakes

    def _lower_blind(self) -> None:
        """Let the platform down by the winches that are left, whatever is known of its pose."""
        if not self.lowering_blind:
            self.lowering_blind = True
            self.switch(LOWER, {"blind": True})

    # -- programs

    def drive(self) -> None:
        """Hold the axes, whose drives have got their power."""
        self.parts.supervisor.reset()
        self.lowering_blind = False
        self.driving = True
        self.switch(HOLD)

    def switch(self, name: str, wanted: Mapping[str, Any] | None = None, right: int = 0) -> None:
        """Go on with another program; raises ProgramError and goes on as before.

        `right` is the number of the taking on whose behalf it moves, 0 for nobody's.
        """
        program = self.parts.programs[name]
        if wanted is not None:
            program.check(wanted)
        cycle = self.cycle
        assert cycle is not None  # cycles run
        device = cycle.device
        if not self.driving and not self.machine.read_only:
            device.command.torque_Nm[:] = 0.0
        program.start(device.feedback, self.setpoint, device.command.torque_Nm)
        if wanted is not None:
            program.command(wanted)
        self.program, self.right.mover = program, right
        self.program_number = self.programs.index(program)
        estimate = self.parts.estimator.estimate
        self._rows.follow(cycle, self.setpoint, estimate, program, self._asked)
        self.status.touch()

    def _watch_right(self) -> None:
        """Hold in place of a motion that is nobody's any more, or that of a past holder."""
        if not self.driving or self.reacting:
            return
        lost = self.right.lost()
        if lost:
            self.life.blame(f"{self.program.name}: {lost}; held")
            self.switch(HOLD)

    # -- what takes longer than a cycle

    @property
    def busy(self) -> bool:
        """Whether something is being done that takes longer."""
        return self._procedure is not None

    def begin(self, procedure: Iterator[None]) -> None:
        """Advance `procedure` once a turn from now on, in place of any other."""
        before, self._procedure = self._procedure, procedure
        if before is not None:
            self._orders.done(f"given up: {self.life.reason or 'something else came first'}")
        self.status.touch()

    def _advance(self, procedure: Iterator[None]) -> None:
        try:
            next(procedure)
            return
        except StopIteration:
            told = ""
        except ControlError as error:
            told = str(error)
        except Exception as error:  # a mistake, of a program for instance: no power, the loop stays
            traceback.print_exc()
            told = f"{type(error).__name__}: {error}"
            self.life.blame(told)
            if self.life.state is LoopState.ACTIVE:
                self.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        if self._procedure is procedure:
            self._procedure = None
            self._orders.done(told)
        self.status.touch()

    @property
    def works_slowly(self) -> bool:
        """Whether slow work runs beside the cycle."""
        return self._job is not None and not self._job.done

    def job(self, work: Callable[[], Any]) -> Task[Any]:
        """Start slow work beside the cycle; what need not wait is done at once."""
        self._job = job = self.machine.clock.start(work)
        self.machine.clock.turn()
        return job

    def cycles_in(self, seconds: float) -> int:
        """Return how many cycles a time lasts, at least one."""
        cycle = self.cycle
        return max(1, round(seconds / (cycle.device.period_s if cycle else _TURN_S)))
