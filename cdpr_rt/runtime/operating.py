"""What a procedure does with a running loop: one thing after the other, each waited for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TypeVar

from cdpr_rt.controllers.base import Controller
from cdpr_rt.cycle import Lateness
from cdpr_rt.errors import InterruptedMotionError, NotInTimeError, TripError
from cdpr_rt.exchange import AxisDevice
from cdpr_rt.raw_rows import raw_rows
from cdpr_rt.rawlog import RawLogWriter
from cdpr_rt.runtime import procedures
from cdpr_rt.runtime.loop import HOLD, IDLE, ControlLoop
from cdpr_rt.runtime.programs.track import TrackProgram
from cdpr_rt.runtime.shared_block import RowReader
from cdpr_rt.runtime.states import LoopState
from cdpr_rt.trajectory import Motion

_T = TypeVar("_T")
_DRAIN_CYCLES = 2048


class Operator:
    """Operates a loop that has a `TrackProgram`; all its methods return when what they do is done.

    `go_on` lets the loop run one turn. All raise TripError where the loop ends what goes on, after
    it has taken the power, and InterruptedMotionError as soon as `stop_requested`.
    """

    def __init__(
        self,
        loop: ControlLoop,
        track: TrackProgram,
        go_on: Callable[[], None],
        stop_requested: Callable[[], bool],
    ) -> None:
        self.loop = loop
        self._track = track
        self._go_on = go_on
        self._stop_requested = stop_requested

    @property
    def device(self) -> AxisDevice:
        """The axes, which have booted."""
        device = self.loop.machine.device
        assert device is not None  # procedures begin later
        return device

    @property
    def lateness(self) -> Lateness:
        """How the deadlines were kept."""
        cycle = self.loop.cycle
        return Lateness() if cycle is None else cycle.lateness

    def check(self, reset: bool = False) -> None:
        """Have cycles run without power and be looked at; with `reset`, drives in fault as well."""
        self._do(procedures.check(self.loop, reset))

    def enable(self) -> None:
        """Give the drives power and release the brakes; the torque is zero."""
        self._refuse_when_stopped("the drives have power")
        self._do(procedures.enable(self.loop, HOLD, None, 0))

    def disable(self) -> None:
        """Apply the brakes and take the power; cycles go on, so that work may take its time."""
        self._do(procedures.disable(self.loop))

    def reset(self) -> None:
        """Acknowledge whatever there is to acknowledge; the drives are left without power."""
        if self.loop.life.state is LoopState.ACTIVE:
            with suppress(TripError):  # what is found on the way is acknowledged as well
                self.disable()
        self._do(procedures.acknowledge(self.loop))

    def idle(self, seconds: float) -> None:
        """Let cycles run for a while."""
        left = iter(range(self.loop.cycles_in(seconds)))
        self.wait(lambda: next(left, None) is None, math.inf, "the end")

    def wait(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        """Let cycles run until `done`, which is asked once a cycle; raises NotInTimeError."""
        left = math.inf if within_s == math.inf else self.loop.cycles_in(within_s)
        while not done():
            self._refuse_when_stopped(what)
            if left <= 0:
                raise NotInTimeError(f"{what}: not within {within_s:g} s")
            left -= 1
            self._turn()

    def let_drive(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        """Have the drives move by themselves, as in homing, until `done`; without power then."""
        self.enable()
        self.loop.driving = False  # an angle may begin to count from elsewhere, and is not judged
        self.wait(done, within_s, what)
        self.disable()

    def between_cycles(self, work: Callable[[], object]) -> None:
        """Do `work`, which may wait by the clock, while no cycles run and nothing has power."""
        self._do(procedures.between_cycles(self.loop, work))

    def beside(self, work: Callable[[], _T]) -> _T:
        """Return what `work` does, which may wait by the clock, as a task beside the cycles."""
        task = self.loop.job(work)
        try:
            while not task.done:
                self._turn()
        finally:
            self.loop.machine.clock.cancel(task)
        result: _T = task.result()
        return result

    def aside(self, work: Callable[[], _T]) -> _T:
        """Return what `work` does, which touches no bus and may take its time."""
        return self.beside(lambda: self.loop.machine.clock.aside(work))

    def follow(
        self,
        controller: Controller,
        motion: Motion,
        log: RawLogWriter | None = None,
        on_progress: Callable[[float], None] | None = None,
        until: Callable[[], bool] | None = None,
    ) -> None:
        """Run `controller` along `motion` to its end, or `until` that is true after a cycle.

        Its cycles go into `log`; `on_progress` is told now and then how long it has gone on.
        However it ends, the last torque is none and what was recorded is in the file. What is asked
        for or a watch wants ends by the braking motion under the same controller.
        """
        self._refuse_when_stopped("the motion")
        loop, track = self.loop, self._track
        track.take(controller, motion)
        rows, stopping, cycles = RowReader(loop.block), False, 0
        drained_after = min(_DRAIN_CYCLES, loop.block.capacity // 2)
        loop.switch(track.name)
        try:
            while loop.program is track and not track.at_rest:
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
            if loop.program is track:
                loop.switch(IDLE)
            self._drain(rows, log)
        self._turn()
        if stopping:
            raise InterruptedMotionError("stopped on request")

    def _drain(self, rows: RowReader, log: RawLogWriter | None) -> None:
        new = rows.read()
        new = new[new["program"] == self.loop.programs.index(self._track)]
        if log is not None and new.size:
            log.write(raw_rows(new))

    def _do(self, procedure: Iterator[None]) -> None:
        failed: list[Exception] = []

        def told() -> Iterator[None]:
            try:
                yield from procedure
            except Exception as error:  # for whoever has asked
                failed.append(error)

        self.loop.begin(told())
        self._finish()
        if failed:
            raise failed[0]

    def _turn(self) -> None:
        self._go_on()
        loop = self.loop
        if (loop.reacting and loop.life.reason) or loop.life.state is LoopState.FAULT:
            self._finish()

    def _finish(self) -> None:
        while self.loop.busy:
            self._go_on()
        if self.loop.life.state is LoopState.FAULT:
            raise TripError(self.loop.life.reason)

    def _refuse_when_stopped(self, what: str) -> None:
        if self._stop_requested():
            raise InterruptedMotionError(f"stopped on request before {what}")
