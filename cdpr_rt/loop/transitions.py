"""Transitions between the loop's states: boot, check, enable, disable, acknowledge, shut down."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping
from typing import Any, Final

from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.engine import HOLD, Engine, RefusedError, Steps, TransitionRunner
from cdpr_rt.loop.safe_stop import SafeStop

CHECK_S: Final = 0.25
"""Duration of a check of the bus."""
_CHECK_CYCLES: Final = 20
_SETTLE_CYCLES: Final = 5
_ATTEMPTS: Final = 4
_MODE_S: Final = 2.0
_POWER_ON_S: Final = 4.0
_FAULT_RESET_S: Final = 2.0
RELEASED: Final = "a procedure runs the drives; the loop takes them again when it ends"


class Transitions:
    """The transitions between states, each as steps for a `TransitionRunner`."""

    def __init__(self, engine: Engine, runner: TransitionRunner, safe_stop: SafeStop) -> None:
        self._engine = engine
        self._runner = runner
        self._safe_stop = safe_stop
        self._machine, self._life = engine.machine, engine.life
        self.check_result: dict[str, Any] = {}
        """Results of the last check of the bus."""
        self.first_program = HOLD
        """The program that runs once the drives are enabled."""
        self.released = False
        """Whether a procedure may run the drives."""
        self.ended = False
        """Whether the loop has been shut down."""
        self.power_off_unconfirmed = ""
        """Drive that has not confirmed its power-off at the end, as text."""

    def start_up(self) -> Steps:
        """Boot and check; if either fails, set the reason of the fault."""
        try:
            yield from self.configure()
            yield from self.check()
        except ControlError as error:
            self._life.set_reason(str(error))

    def configure(self) -> Steps:
        """Boot the drives; the state is then inactive, or unconfigured if the boot fails."""
        life, machine, run_task = self._life, self._machine, self._runner.run_task
        self.released = False
        self._engine.stop_cycles()
        if machine.device is not None:
            yield from run_task(machine.close)
        life.enter(LoopState.UNCONFIGURED)
        life.clear_reason()
        try:
            yield from run_task(machine.open)
        except ControlError as error:
            life.set_reason(str(error))
            raise
        life.enter(LoopState.INACTIVE)

    def release(self) -> Steps:
        """Close the buses, so that another program can run the drives; they have no power."""
        self._engine.stop_cycles()
        unconfirmed: list[str] = []
        if self._machine.device is not None:
            close = self._machine.close
            yield from self._runner.run_task(lambda: unconfirmed.append(close()))
        self._life.enter(LoopState.UNCONFIGURED)
        if any(unconfirmed):
            self._life.set_reason(unconfirmed[0])
            raise RefusedError(unconfirmed[0])
        self.released = True
        self._life.set_reason(RELEASED)

    # -- checking the bus

    def check(self, reset: bool = False) -> Steps:
        """Run cycles without power and check every answer; then enter ready, or inactive on
        failure.

        A drive in fault fails the check, unless `reset`.
        """
        engine, life, machine = self._engine, self._life, self._machine
        if engine.cycling:
            engine.stop_cycles()
            yield from self._runner.run_task(machine.pause)
        life.enter(LoopState.INACTIVE)
        life.clear_reason()
        try:
            yield from self._runner.run_task(machine.prepare)
            if not machine.clock.lockstep:
                gc.collect()  # the garbage collector is off in paced cycles
            engine.start_cycles()
            if reset:
                yield from self._reset_faults()
            yield from self._check_cycles()
        except ControlError as error:
            life.set_reason(str(error))
            yield from self._safe_stop.explain()
            yield from self._safe_stop.leave_cycles()
            raise RefusedError(life.reason) from error
        life.enter(LoopState.READY)
        if machine.read_only:
            engine.switch(HOLD)

    def _reset_faults(self) -> Steps:
        machine = self._machine
        for _ in range(_SETTLE_CYCLES):  # each drive reports its state in these cycles
            yield
        if not machine.intact():
            return  # a drive that has to boot again keeps its fault
        machine.reset_faults()
        yield
        try:
            yield from self._runner.wait_until(
                machine.faultless, _FAULT_RESET_S, "the reset of all faults"
            )
        except RefusedError as error:
            raise RefusedError(f"{error}: {', '.join(machine.states())}") from error

    def _check_cycles(self) -> Steps:
        machine, cycle = self._machine, self._engine.cycle
        assert cycle is not None  # cycles run
        device = cycle.device
        for _ in self._runner.wait_up_to(_MODE_S, machine.prepared):
            self._raise_on_trouble()
            yield
        if not machine.prepared():
            raise RefusedError(machine.unprepared())
        cycles = max(_CHECK_CYCLES, round(CHECK_S / device.period_s))
        limits = self._engine.parts.supervisor.limits
        allowed = cycles * device.n * limits.missed_in_window / limits.window_cycles
        missed = 0
        # delays of this computer end, but a bad bus stays bad
        for _ in range(_ATTEMPTS):
            yield from self._count_answers(cycles)
            missed = self.check_result["missed"]
            if missed <= max(1.0, allowed):
                return
        raise RefusedError(
            f"check: {missed} of {cycles * device.n} answers did not come in time, in the "
            f"last of {_ATTEMPTS} attempts; see `cdpr bus monitor`"
        )

    def _count_answers(self, cycles: int) -> Steps:
        """Count the answers in some cycles, and keep the results for the status."""
        engine, machine, cycle = self._engine, self._machine, self._engine.cycle
        assert cycle is not None  # cycles run
        for _ in range(_SETTLE_CYCLES):
            yield
        missed, late, slowest_s = engine.missed, cycle.lateness.late, 0.0
        for _ in range(cycles):
            yield
            self._raise_on_trouble()
            if not machine.unpowered() and not machine.read_only:
                raise RefusedError(f"check: a drive has power: {', '.join(machine.states())}")
            slowest_s = max(slowest_s, engine.exchange_s)
        self.check_result = {
            "cycles": cycles,
            "missed": engine.missed - missed,
            "late": cycle.lateness.late - late,
            "slowest_exchange_s": slowest_s,
        }

    def _raise_on_trouble(self) -> None:
        cycle = self._engine.cycle
        assert cycle is not None  # cycles run
        lost = self._engine.lost_bus
        faults = [lost] if lost is not None else [*cycle.device.faults(), *cycle.watch_faults()]
        if faults:
            life = self._life
            life.set_cause(faults[0], Reaction.NONE)
            for fault in faults:
                life.add_fault(fault)
            raise RefusedError(life.reason)

    def between_cycles(self, work: Callable[[], Any]) -> Steps:
        """Run `work`, which may wait, while no cycles run; rejected while drives are enabled."""
        if self._life.state is not LoopState.READY:
            raise RefusedError(f"cycles do not stop in state {self._life.state.label}")
        self._engine.stop_cycles()
        yield from self._runner.run_task(self._machine.pause)
        task = self._runner.start(work)
        while not task.done:
            yield
        self._engine.start_cycles()
        task.result()

    def write_object(self, work: Callable[[], None]) -> Steps:
        """Let `work` write an object of a drive without power, then boot and check all drives.

        The boot restores all settings on which the loop relies. It follows even if the drive
        rejects the object.
        """
        if self._engine.cycling:
            self._engine.stop_cycles()
            yield from self._runner.run_task(self._machine.pause)
        self._life.enter(LoopState.INACTIVE)
        rejected: ControlError | None = None
        try:
            yield from self._runner.run_task(work)
        except ControlError as error:
            rejected = error
        yield from self.configure()
        yield from self.check()
        if rejected is not None:
            raise rejected

    # -- power

    def enable(self, program: str, arguments: Mapping[str, Any], right: int, stops: int) -> Steps:
        """Enable the drives, hold, release the brakes, then run `program`.

        If the grant number `right` has expired by then, the drives keep holding. The power stays
        off if there were more than `stops` stops before it would be switched on.
        """
        engine, life, machine = self._engine, self._life, self._machine
        engine.parts.programs[program].check(arguments)
        self.first_program = program
        life.clear_reason()
        yield from self._runner.run_blocking(engine.parts.before_power)
        last = engine.parts.last_stop
        if last is not None:
            yield from self._runner.run_blocking(last.require_writable)
        if engine.block.stops != stops:
            raise RefusedError("enable: cancelled by a later stop")
        machine.power_on()
        life.enter(LoopState.ACTIVE)
        try:
            yield from self._runner.wait_until(
                machine.powered, _POWER_ON_S, "the power of all drives"
            )
        except ControlError as error:
            life.set_reason(f"{error}: {', '.join(machine.states())}")
            self._safe_stop.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
            raise ControlError(life.reason) from error
        device = machine.device
        if last is not None and device is not None:
            position_rad = device.feedback.position_rad.copy()
            yield from self._runner.run_blocking(lambda: last.begin_to_move(position_rad))
        self._safe_stop.without_pose = False
        engine.drive()
        machine.set_brakes(True)
        while not machine.brakes_are(True):
            yield
        if self.first_program == HOLD:
            return
        why_not = engine.right.refusal(right)
        if why_not:
            life.set_reason(f"{program}: {why_not}; the robot holds")
            raise RefusedError(life.reason)
        engine.switch(program, arguments, right)

    def disable(self) -> Steps:
        """Stop under control and remove the power."""
        engine = self._engine
        if self._life.state is LoopState.ACTIVE:
            engine.reacting = Reaction.CONTROLLED_STOP
            if engine.driving:
                engine.program.stop()
            else:
                self._machine.power_off()
            yield from self._safe_stop.come_to_rest(LoopState.READY)

    def acknowledge(self) -> Steps:
        """Clear latched faults, boot again if necessary, and check."""
        life, machine = self._life, self._machine
        earlier, keys = life.earlier if life.earlier[0] else (life.reason, frozenset(life.faults))
        try:
            if machine.device is not None:
                yield from self._runner.run_task(machine.acknowledge)
            intact = self._engine.cycling and machine.intact()
            if intact:
                yield from self._reset_faults()
            else:
                yield from self.configure()
            yield from self.check(reset=not intact)
        except ControlError as error:
            life.enter(LoopState.FAULT)
            life.set_reason(str(error))
            if earlier != life.reason and not keys & set(life.faults):
                life.earlier = earlier, keys
            raise

    def shut_down(self) -> Steps:
        """Stop under control, leave the drives without power, and end the loop."""
        engine, life = self._engine, self._life
        if life.state is LoopState.ACTIVE:
            if engine.reacting is Reaction.NONE:
                yield from self.disable()
            else:
                yield from self._safe_stop.come_to_rest(LoopState.READY)
        engine.stop_cycles()
        unconfirmed: list[str] = []
        try:
            yield from self._runner.run_task(lambda: unconfirmed.append(self._machine.close()))
        except ControlError as error:  # such as a contactor that stays closed
            unconfirmed.append(str(error))
        if any(unconfirmed):
            self.power_off_unconfirmed = unconfirmed[0]
            life.set_reason(self.power_off_unconfirmed)
        life.enter(LoopState.UNCONFIGURED)
        self.ended = True
