"""A loop operated by a procedure in the same process, step by step."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import Protocol, TypeVar

from cdpr_rt.control.base import Controller
from cdpr_rt.core.cycle import Lateness
from cdpr_rt.core.exchange import AxisDevice
from cdpr_rt.core.shared_block import RowReader
from cdpr_rt.core.states import LoopState
from cdpr_rt.errors import InterruptedMotionError, NotInTimeError, TripError
from cdpr_rt.identification.rawlog import RawLogWriter, raw_rows
from cdpr_rt.loop.engine import HOLD, IDLE, Steps
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.motion.trajectory import Motion
from cdpr_rt.programs.track import TrackProgram

_T = TypeVar("_T")
_DRAIN_CYCLES = 2048


class Notifier(Protocol):
    """Receives reports on the progress of a procedure."""

    def note(self, text: str) -> None:
        """Report a line about the present step."""

    def progress(
        self, what: str, total_s: float
    ) -> AbstractContextManager[Callable[[float], None]]:
        """Return a function that is called with the seconds of bus time done, out of `total_s`."""


@dataclass(frozen=True)
class Tolerance:
    """Limits of a motion in a procedure; a rotor without load may swing by several turns without
    harm.
    """

    following_error_rad: float = 4.0 * math.tau
    speed_rad_s: float | None = None
    """Each motor's speed limit; a share of its rated speed if omitted."""


class Operator:
    """Operates a loop that has a `TrackProgram`; its methods return when they are done.

    `go_on` makes the loop run one turn. All methods raise TripError if the loop has ended the
    motion and removed the power, and InterruptedMotionError when `stop_requested` is true.
    """

    def __init__(
        self,
        loop: ControlLoop,
        track: TrackProgram,
        go_on: Callable[[], None],
        stop_requested: Callable[[], bool],
    ) -> None:
        self.loop = loop
        self._engine, self._runner, self._transitions = loop.engine, loop.runner, loop.transitions
        self._life = loop.life
        self._track = track
        self._go_on = go_on
        self._stop_requested = stop_requested

    @property
    def device(self) -> AxisDevice:
        """The booted axes."""
        device = self._engine.machine.device
        assert device is not None  # procedures begin after the boot
        return device

    @property
    def lateness(self) -> Lateness:
        """Statistics of the deadlines."""
        cycle = self._engine.cycle
        return Lateness() if cycle is None else cycle.lateness

    def check(self, reset: bool = False) -> None:
        """Run the check of the bus, without power; `reset` resets drives in fault."""
        self._do(self._transitions.check(reset))

    def enable(self) -> None:
        """Enable the drives and release the brakes; the torque is zero."""
        self._refuse_when_stopped("the drives have power")
        self._do(self._transitions.enable(HOLD, {}, 0, self._engine.block.stops))

    def disable(self) -> None:
        """Apply the brakes and remove the power; cycles continue."""
        self._do(self._transitions.disable())

    def reset(self) -> None:
        """Acknowledge faults; the drives are left without power."""
        if self._life.state is LoopState.ACTIVE:
            with suppress(TripError):  # this also acknowledges faults found during the reset
                self.disable()
        self._do(self._transitions.acknowledge())

    def idle(self, seconds: float) -> None:
        """Run cycles for a while."""
        left = iter(range(self._engine.cycles_in(seconds)))
        self.wait(lambda: next(left, None) is None, math.inf, "the end")

    def wait(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        """Run cycles until `done`, which is checked once per cycle; raises NotInTimeError."""
        left = math.inf if within_s == math.inf else self._engine.cycles_in(within_s)
        while not done():
            self._refuse_when_stopped(what)
            if left <= 0:
                raise NotInTimeError(f"{what}: not complete after {within_s:g} s")
            left -= 1
            self._turn()

    def let_drive(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        """Let the drives move autonomously, as in homing, until `done`; then remove their power."""
        self.enable()
        self._engine.driving = False  # the origin of an angle may change, so angles are not checked
        self.wait(done, within_s, what)
        self.disable()

    def between_cycles(self, work: Callable[[], object]) -> None:
        """Run `work`, which may wait by the clock, while no cycles run and no drive has power."""
        self._do(self._transitions.between_cycles(work))

    def run_task(self, work: Callable[[], _T]) -> _T:
        """Run `work`, which may wait by the clock, in parallel with the cycles; return its
        result.
        """
        task = self._runner.start(work)
        try:
            while not task.done:
                self._turn()
        finally:
            self._engine.machine.clock.cancel(task)
        result: _T = task.result()
        return result

    def run_blocking(self, work: Callable[[], _T]) -> _T:
        """Run `work`, which may take long and uses no bus; return its result."""
        return self.run_task(lambda: self._engine.machine.clock.run_blocking(work))

    def follow(
        self,
        controller: Controller,
        motion: Motion,
        log: RawLogWriter | None = None,
        on_progress: Callable[[float], None] | None = None,
        until: Callable[[], bool] | None = None,
    ) -> None:
        """Run `controller` along `motion` to its end, or until `until` is true after a cycle.

        The cycles are written to `log`. `on_progress` is called from time to time with the time of
        the motion. The last torque is zero and the recorded cycles are in the file, however the
        motion ends. A requested stop, or a stop by a watch, ends the motion with its braking ramp
        under the same controller.
        """
        self._refuse_when_stopped("the motion")
        engine, track = self._engine, self._track
        track.take(controller, motion)
        rows, stopping, cycles = RowReader(engine.block), False, 0
        drained_after = min(_DRAIN_CYCLES, engine.block.capacity // 2)
        engine.switch(track.name)
        try:
            while engine.program is track and not track.at_rest:
                self._go_on()
                cycles += 1
                if until is not None and until():
                    break
                if not stopping and self._stop_requested():
                    stopping = True
                    track.stop()
                if cycles % drained_after == 0:
                    self._drain(rows, log)
                    if on_progress is not None:
                        on_progress(track.progress()["time_s"])
        finally:
            if engine.program is track:
                engine.switch(IDLE)
            self._drain(rows, log)
        self._turn()
        if stopping:
            raise InterruptedMotionError("stopped on request")

    def _drain(self, rows: RowReader, log: RawLogWriter | None) -> None:
        new = rows.read()
        new = new[new["program"] == self._engine.programs.index(self._track)]
        if log is not None and new.size:
            log.write(raw_rows(new))

    def _do(self, transition: Steps) -> None:
        failed: list[Exception] = []

        def watched() -> Steps:
            try:
                yield from transition
            except Exception as error:  # raised again below
                failed.append(error)

        self._runner.begin(watched())
        self._finish()
        if failed:
            raise failed[0]

    def _turn(self) -> None:
        self._go_on()
        ended = self._engine.reacting and self._life.reason
        if ended or self._life.state is LoopState.FAULT:
            self._finish()

    def _finish(self) -> None:
        while self._runner.busy:
            self._go_on()
        if self._life.state is LoopState.FAULT:
            raise TripError(self._life.reason)

    def _refuse_when_stopped(self, what: str) -> None:
        if self._stop_requested():
            raise InterruptedMotionError(f"stopped on request before {what}")
