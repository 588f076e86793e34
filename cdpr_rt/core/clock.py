"""A robot's one clock: the time, waiting for it, and the tasks that share its thread."""

from __future__ import annotations

import math
import os
import select
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, Protocol, TypeVar

from cdpr_rt.core.task import Condition, Task

_T = TypeVar("_T")
_BLOCKING_POLL_S = 0.002
"""Period of polling work in another thread."""
_MADE_UP_S = 0.02
"""Most of simulated time's lag behind wall-clock time that is made up for."""
_LONGEST_GRANT_S = 0.1
"""Bus time goes on by so much at a time, so that a request to end is seen between."""


class Readable(Protocol):
    """Object with a file descriptor to wait for."""

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has come."""


class EventSource(Readable, Protocol):
    """Source of events, such as a port on a bus; none of its methods waits."""

    def poll(self) -> bool:
        """Process what has come; return whether there was anything."""

    def tick(self, now_s: float) -> float:
        """Do what is due at `now_s`; return when to be called next at the latest."""


class SteppedBus(Protocol):
    """A simulated bus whose time goes on only as far as this process lets it."""

    now_s: float
    next_s: float
    """When something happens there next by itself, as far as is known."""
    gone: bool
    """Whether it is lost, and its time with it."""

    def go(self, until_s: float) -> bool:
        """Have the bus work off what was sent, then go on to `until_s` or until a frame comes.

        Takes in the frames that come; returns whether there were any. A time that has passed
        moves nothing: all that was sent has been answered then.
        """


class Clock(ABC):
    """The time of one robot, asked by everything in its process that counts time.

    All waiting is done here: in a task it suspends that for the others, elsewhere it polls
    the sources and advances the tasks, in the order in which they were started. For one
    thread only, which is the only one that touches a bus.
    """

    lockstep = False
    """Whether time is that of simulated buses and moves only when they are granted more."""

    def __init__(self) -> None:
        self._sources: list[EventSource] = []
        self._tasks: list[Task[Any]] = []
        self._running: Task[Any] | None = None

    @property
    @abstractmethod
    def now_s(self) -> float:
        """The time in seconds since an arbitrary instant; never goes back."""

    def close(self) -> None:
        """Listen to nothing any more, and drop the tasks."""
        self._sources, self._tasks = [], []

    # -- what is listened to

    def add(self, source: EventSource) -> None:
        """Listen to `source` in all waits from now on."""
        self._sources.append(source)

    def remove(self, source: EventSource) -> None:
        """Listen to `source` no longer; one that was removed before is no error."""
        self._sources = [other for other in self._sources if other is not source]

    # -- waiting

    def sleep(self, seconds: float) -> None:
        """Wait for so long."""
        self.wait(None, self.now_s + seconds)

    def wait(self, condition: Condition | None, until_s: float = math.inf) -> bool:
        """Wait until `condition` is true, at most until `until_s`; return whether it is.

        It is asked again whenever something has come or a task has gone on; None is never true.
        """
        while True:
            if condition is not None and condition():
                return True
            if self.now_s >= until_s:
                return False
            if self._running is not None:
                self._suspend(self._running, condition, until_s)
            else:
                self._wait_once(until_s)

    def poll(self) -> None:
        """Process what has come already, so that what comes later is newer."""
        for source in self._sources:
            source.poll()

    def _suspend(self, task: Task[Any], condition: Condition | None, until_s: float) -> None:
        self._running = None
        try:
            task.suspend(condition, until_s)
        finally:
            self._running = task

    def _wait_once(self, until_s: float) -> None:
        due_s = self._tick()
        if self._advance():
            until_s = self.now_s  # what was waited for may have happened
        self._listen(min([until_s, due_s, *(task.wake_s for task in self._tasks)]))

    def _tick(self) -> float:
        now_s = self.now_s
        return min([source.tick(now_s) for source in self._sources], default=math.inf)

    @abstractmethod
    def _listen(self, until_s: float) -> None:
        """Poll the sources; where nothing has come, wait for it up to `until_s`."""

    @abstractmethod
    def sleep_until(self, until_s: float) -> None:
        """Do nothing at all until then: a cycle's deadline is not to depend on what comes."""

    # -- tasks

    def start(self, work: Callable[[], _T]) -> Task[_T]:
        """Return a task that calls `work` in the next wait or `run_tasks`."""
        task = Task(work)
        self._tasks.append(task)
        return task

    def gather(self, works: Iterable[Callable[[], _T]]) -> list[Task[_T]]:
        """Run several works as tasks side by side, and return them once all have ended.

        Whatever else ends the wait (an interrupt, being cancelled) ends them as well.
        """
        tasks = [self.start(work) for work in works]
        try:
            self.wait(lambda: all(task.done for task in tasks))
        finally:
            for task in tasks:
                self.cancel(task)
        return tasks

    def cancel(self, task: Task[Any]) -> None:
        """Have a task end where it waits; what it does on its way out may wait once more."""
        running = self._running
        try:
            task.cancel()
        finally:
            self._running = running

    def run_tasks(self) -> None:
        """Give every task that can go on its turn, without waiting; for once a cycle."""
        now_s = self.now_s
        for source in self._sources:
            source.tick(now_s)
        if self._tasks:
            self._advance()
            # what they have sent is answered before the next SYNC goes out on any bus
            self._listen(self.now_s)

    def _advance(self) -> bool:
        """Run the tasks that can go on, each until it waits; return whether there was one."""
        if self._running is not None or not self._tasks:
            return False
        now_s, ran = self.now_s, False
        for task in self._tasks:  # those which are started meanwhile have their turn as well
            if not task.done and task.is_due(now_s):
                self._running, ran = task, True
                try:
                    task.advance()
                finally:
                    self._running = None
        self._tasks = [task for task in self._tasks if not task.done]
        return ran

    def run_blocking(self, work: Callable[[], _T]) -> _T:
        """Return what `work` does, which touches no bus and may take its time, such as a file.

        Beside this thread where time is wall-clock time, at once where it stands still meanwhile.
        """
        return work()


class PacedClock(Clock):
    """CLOCK_MONOTONIC, for real buses and simulated ones in real time."""

    def __init__(self) -> None:
        super().__init__()
        # of the process before its loop takes a core for itself
        self._cores = os.sched_getaffinity(0)

    @property
    def now_s(self) -> float:
        """CLOCK_MONOTONIC."""
        return time.monotonic()

    def sleep_until(self, until_s: float) -> None:
        """Sleep until then."""
        left_s = until_s - time.monotonic()
        if left_s > 0.0:
            time.sleep(left_s)

    def await_readable(self, source: Readable, until_s: float) -> None:
        """Wait until there is something to read from `source`, at most until `until_s`."""
        select.select([source], [], [], max(until_s - self.now_s, 0.0))

    def _listen(self, until_s: float) -> None:
        waiting = select.poll()
        for source in self._sources:
            waiting.register(source.fileno(), select.POLLIN)
        came = [source.poll() for source in self._sources]
        left_s = until_s - time.monotonic()
        if any(came) or left_s <= 0.0:
            return
        if waiting.poll(None if left_s == math.inf else 1e3 * left_s):
            for source in self._sources:
                source.poll()

    def run_blocking(self, work: Callable[[], _T]) -> _T:
        """Return what `work` does in a thread of its own, on all cores the process may use."""
        future: Future[_T] = Future()

        def run() -> None:
            with suppress(OSError):  # cores that have been taken away since
                os.sched_setaffinity(0, self._cores)
            try:
                future.set_result(work())
            except BaseException as error:
                future.set_exception(error)

        threading.Thread(target=run, name="blocking", daemon=True).start()
        while not self.wait(future.done, self.now_s + _BLOCKING_POLL_S):
            continue
        return future.result()


class LockstepClock(Clock):
    """The time of simulated buses which this process leads; it goes on in waits only.

    All buses are kept at the same instant. Without any, time passes as soon as it is waited for.
    With `real_time` it goes no faster than wall-clock time: a process held up finds it slower,
    never later.
    """

    lockstep = True

    def __init__(self, buses: Sequence[SteppedBus] = (), *, real_time: bool = False) -> None:
        super().__init__()
        self._buses = list(buses)
        self._alone_s = 0.0
        self._real_time = real_time
        self._wall_ahead_s = -math.inf

    @property
    def now_s(self) -> float:
        """The time of the buses, the earliest where another client's frame has held one up."""
        buses = self._buses
        if len(buses) == 1 and not buses[0].gone:
            return buses[0].now_s
        return min([bus.now_s for bus in buses if not bus.gone], default=self._alone_s)

    def sleep_until(self, until_s: float) -> None:
        """Have time go on until then."""
        self.wait(None, until_s)

    def run_tasks(self) -> None:
        """See `Clock.run_tasks`; the next cycle is not to be early either."""
        super().run_tasks()
        if self._real_time:
            self._await_wall()

    def _await_wall(self) -> None:
        """Wait until the wall clock has come as far; little of what it is ahead is made up for."""
        if not self._real_time:
            return
        now_s, wall_s = self.now_s, time.monotonic()
        self._wall_ahead_s = max(self._wall_ahead_s, wall_s - now_s - _MADE_UP_S)
        left_s = now_s + self._wall_ahead_s - wall_s
        if left_s > 0.0:
            time.sleep(left_s)

    def _listen(self, until_s: float) -> None:
        buses = self._buses = [bus for bus in self._buses if not bus.gone]
        now_s = self._alone_s = self.now_s
        until_s = min(until_s, now_s + _LONGEST_GRANT_S)
        if not buses:
            self._alone_s = max(until_s, now_s)
        elif len(buses) == 1:
            buses[0].go(until_s)
        else:
            self._go_together(until_s)
        self._await_wall()
        for source in self._sources:
            source.poll()

    def _go_together(self, until_s: float) -> None:
        """Advance all buses to the next event of any, so that none is ahead of another's frames."""
        came = [bus.go(0.0) for bus in self._buses]
        now_s = self.now_s
        if any(came) or until_s <= now_s:
            return
        until_s = min([until_s, *(bus.next_s for bus in self._buses if bus.next_s > now_s)])
        for bus in self._buses:
            bus.go(until_s)
