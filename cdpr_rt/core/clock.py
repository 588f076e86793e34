"""A robot's only clock: the time, all waiting, and the tasks that share its thread."""

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
from typing import Any, Generic, Protocol, TypeVar, cast

from greenlet import getcurrent, greenlet

# Cooperative tasks: ordinary sequential code that yields while it waits.

_T = TypeVar("_T")
Condition = Callable[[], object]


class TaskCancelled(BaseException):
    """Raised in a waiting task to cancel it."""


class Task(Generic[_T]):
    """One call of `work` with its own stack; `Clock.start` creates tasks, and waits advance
    them.
    """

    def __init__(self, work: Callable[[], _T]) -> None:
        self.done = False
        """Whether the call has returned, or was cancelled."""
        self.wake_s = -math.inf
        """Latest time at which the task continues, by its clock."""
        self._condition: Condition | None = None
        self._work = work
        self._result: Any = None
        self._error: BaseException | None = None
        self._greenlet = greenlet(self._run)

    def _run(self) -> None:
        try:
            self._result = self._work()
        except (Exception, TaskCancelled) as error:
            self._error = error
        except BaseException as error:  # the caller that advances the tasks handles interrupts
            self._error = error
            raise
        finally:
            self.done = True

    def is_due(self, now_s: float) -> bool:
        """Return whether the task can continue."""
        return now_s >= self.wake_s or (self._condition is not None and bool(self._condition()))

    def advance(self) -> None:
        """Run the task until it waits or ends; raises exceptions that interrupt the process."""
        self._greenlet.parent = getcurrent()
        self._greenlet.switch()

    def suspend(self, condition: Condition | None, wake_s: float) -> None:
        """Suspend the task, from within, until its condition holds or at its wake-up time."""
        self._condition, self.wake_s = condition, wake_s
        parent = self._greenlet.parent
        assert parent is not None  # a task runs only when it is advanced
        parent.switch()

    def cancel(self) -> None:
        """End the task where it waits; its cleanup may wait once more."""
        if self.done:
            return
        if self._greenlet:
            self._greenlet.parent = getcurrent()
            self._greenlet.throw(TaskCancelled)
        else:  # the task has not begun
            self._error, self.done = TaskCancelled(), True

    def result(self) -> _T:
        """Return the result of the ended call, or raise its exception."""
        if self._error is not None:
            raise self._error
        return cast(_T, self._result)


_BLOCKING_POLL_S = 0.002
"""Period of polling work in another thread."""
_MADE_UP_S = 0.02
"""Largest lag of simulated time behind wall-clock time that the clock catches up."""
_LONGEST_GRANT_S = 0.1
"""Longest step of bus time, so that a request to end is noticed in between."""


class Readable(Protocol):
    """Object with a file descriptor that can be waited for."""

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has arrived."""


class EventSource(Readable, Protocol):
    """Source of events, such as a port on a bus; none of its methods waits."""

    def poll(self) -> bool:
        """Process all events that have arrived; return whether there was any."""

    def tick(self, now_s: float) -> float:
        """Carry out the work due at `now_s`; return the latest time of the next call."""


class SteppedBus(Protocol):
    """A simulated bus whose time advances only when this process allows it."""

    now_s: float
    next_s: float
    """Time of the next known event on the bus."""
    gone: bool
    """Whether the bus, and with it its time, is lost."""

    def go(self, until_s: float) -> bool:
        """Make the bus process all sent frames, then advance to `until_s` or until a frame arrives.

        Stores the frames that arrive; returns whether there were any. With a time in the past the
        bus does not advance, but it answers everything that was sent.
        """


class Clock(ABC):
    """The time of one robot, used by everything in its process that measures time.

    All waiting happens here. A wait in a task suspends that task so that others can run. Any other
    wait polls the sources and advances the tasks in the order in which they were started. Only one
    thread may use the clock, the same that uses the buses.
    """

    lockstep = False
    """Whether time is that of simulated buses and advances only when this process grants it."""

    def __init__(self) -> None:
        self._sources: list[EventSource] = []
        self._tasks: list[Task[Any]] = []
        self._running: Task[Any] | None = None

    @property
    @abstractmethod
    def now_s(self) -> float:
        """The time in seconds since an arbitrary instant; never goes back."""

    def close(self) -> None:
        """Remove all sources and tasks."""
        self._sources, self._tasks = [], []

    # -- sources

    def add(self, source: EventSource) -> None:
        """Listen to `source` in all waits from now on."""
        self._sources.append(source)

    def remove(self, source: EventSource) -> None:
        """Stop listening to `source`; idempotent."""
        self._sources = [other for other in self._sources if other is not source]

    # -- waiting

    def sleep(self, seconds: float) -> None:
        """Wait for a duration."""
        self.wait(None, self.now_s + seconds)

    def wait(self, condition: Condition | None, until_s: float = math.inf) -> bool:
        """Wait until `condition` is true, at most until `until_s`; return whether it is.

        The condition is checked whenever something has arrived or a task has run; None is never
        true.
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
        """Process what has already arrived, so that later events are newer."""
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
            until_s = self.now_s  # return soon, because the condition may have become true
        self._listen(min([until_s, due_s, *(task.wake_s for task in self._tasks)]))

    def _tick(self) -> float:
        now_s = self.now_s
        return min([source.tick(now_s) for source in self._sources], default=math.inf)

    @abstractmethod
    def _listen(self, until_s: float) -> None:
        """Poll the sources; if nothing has arrived, wait up to `until_s`."""

    @abstractmethod
    def sleep_until(self, until_s: float) -> None:
        """Do nothing until `until_s`, so that events do not affect a cycle's deadline."""

    # -- tasks

    def start(self, work: Callable[[], _T]) -> Task[_T]:
        """Return a task that calls `work` in the next wait or `run_tasks`."""
        task = Task(work)
        self._tasks.append(task)
        return task

    def gather(self, works: Iterable[Callable[[], _T]]) -> list[Task[_T]]:
        """Run several calls as parallel tasks, and return them once all have ended.

        If anything else ends the wait (an interrupt, a cancellation), the tasks are cancelled.
        """
        tasks = [self.start(work) for work in works]
        try:
            self.wait(lambda: all(task.done for task in tasks))
        finally:
            for task in tasks:
                self.cancel(task)
        return tasks

    def cancel(self, task: Task[Any]) -> None:
        """End a task where it waits; its cleanup may wait once more."""
        running = self._running
        try:
            task.cancel()
        finally:
            self._running = running

    @property
    def has_tasks(self) -> bool:
        """Whether tasks have been started and have not ended."""
        return bool(self._tasks)

    def run_tasks(self) -> None:
        """Run every task that can continue, without waiting; called once per cycle."""
        now_s = self.now_s
        for source in self._sources:
            source.tick(now_s)
        if self._tasks:
            self._advance()
            # frames sent by tasks must be answered before the next SYNC goes out on any bus
            self._listen(self.now_s)

    def _advance(self) -> bool:
        """Run the tasks that can continue, each until it waits; return whether there was one."""
        if self._running is not None or not self._tasks:
            return False
        now_s, ran = self.now_s, False
        for task in self._tasks:  # this includes tasks that are started during the loop
            if not task.done and task.is_due(now_s):
                self._running, ran = task, True
                try:
                    task.advance()
                finally:
                    self._running = None
        self._tasks = [task for task in self._tasks if not task.done]
        return ran

    def run_blocking(self, work: Callable[[], _T]) -> _T:
        """Run `work`, which may take long and uses no bus, such as file access; return its result.

        In wall-clock time it runs in another thread. Otherwise it runs immediately, because
        simulated time stands still.
        """
        return work()


class PacedClock(Clock):
    """CLOCK_MONOTONIC, for real buses and simulated ones in real time."""

    def __init__(self) -> None:
        super().__init__()
        # cores of the process before its loop takes one for itself
        self._cores = os.sched_getaffinity(0)

    @property
    def now_s(self) -> float:
        """CLOCK_MONOTONIC."""
        return time.monotonic()

    def sleep_until(self, until_s: float) -> None:
        """Sleep until `until_s`."""
        left_s = until_s - time.monotonic()
        if left_s > 0.0:
            time.sleep(left_s)

    def await_readable(self, source: Readable, until_s: float) -> None:
        """Wait until `source` is readable, at most until `until_s`."""
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
        """Run `work` in another thread, on all cores that the process may use; return its
        result.
        """
        future: Future[_T] = Future()

        def run() -> None:
            with suppress(OSError):  # the process may have lost some of these cores
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
    """The time of simulated buses that this process leads; it advances only in waits.

    All buses are kept at the same instant. Without any bus, time passes as soon as something waits.
    With `real_time` it is no faster than wall-clock time: if the process is delayed, time is slower
    but no cycle is late.
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
        """The earliest time of all buses; once all are lost, it continues from the latest."""
        buses, earliest_s = self._buses, math.inf
        if len(buses) == 1 and not buses[0].gone:
            return buses[0].now_s
        for bus in buses:  # a generator costs twice as much, several times a cycle
            if bus.now_s < earliest_s and not bus.gone:
                earliest_s = bus.now_s
        if earliest_s < math.inf:
            return earliest_s
        return max([self._alone_s, *(bus.now_s for bus in buses)])

    def sleep_until(self, until_s: float) -> None:
        """Advance time until `until_s`."""
        self.wait(None, until_s)

    def run_tasks(self) -> None:
        """See `Clock.run_tasks`; in real time the next cycle must not be early either."""
        super().run_tasks()
        if self._real_time:
            self._await_wall()

    def _await_wall(self) -> None:
        """Wait until wall-clock time has caught up; if it is ahead, only a small lag is caught
        up.
        """
        if not self._real_time:
            return
        now_s, wall_s = self.now_s, time.monotonic()
        self._wall_ahead_s = max(self._wall_ahead_s, wall_s - now_s - _MADE_UP_S)
        left_s = now_s + self._wall_ahead_s - wall_s
        if left_s > 0.0:
            time.sleep(left_s)

    def _listen(self, until_s: float) -> None:
        now_s = self._alone_s = self.now_s
        buses = self._buses = [bus for bus in self._buses if not bus.gone]
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
        """Advance all buses to the next event of any bus, so that no bus is ahead of another's
        frames.
        """
        came = [bus.go(0.0) for bus in self._buses]
        now_s = self.now_s
        if any(came) or until_s <= now_s:
            return
        until_s = min([until_s, *(bus.next_s for bus in self._buses if bus.next_s > now_s)])
        for bus in self._buses:
            bus.go(until_s)
