"""Cooperative tasks: ordinary sequential code that gives way where it waits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Generic, TypeVar, cast

from greenlet import getcurrent, greenlet

_T = TypeVar("_T")
Condition = Callable[[], object]


class TaskCancelled(BaseException):
    """Raised in a task, where it waits, to have it end."""


class Task(Generic[_T]):
    """One call of `work` with a stack of its own; `Clock.start` makes them and advances them."""

    def __init__(self, work: Callable[[], _T]) -> None:
        self.done = False
        """Whether the call has come back, or was cancelled."""
        self.wake_s = -math.inf
        """When it goes on at the latest, by its clock."""
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
        except BaseException as error:  # an interrupt is for whoever advances the tasks
            self._error = error
            raise
        finally:
            self.done = True

    def is_due(self, now_s: float) -> bool:
        """Return whether the task can go on."""
        return now_s >= self.wake_s or (self._condition is not None and bool(self._condition()))

    def advance(self) -> None:
        """Run the task until it waits or ends; what interrupts the process comes through."""
        self._greenlet.parent = getcurrent()
        self._greenlet.switch()

    def suspend(self, condition: Condition | None, wake_s: float) -> None:
        """Leave the task, from within, until its condition holds or its time has come."""
        self._condition, self.wake_s = condition, wake_s
        parent = self._greenlet.parent
        assert parent is not None  # a task runs only when it is advanced
        parent.switch()

    def cancel(self) -> None:
        """Have the task end where it waits; what it does on its way out may wait once more."""
        if self.done:
            return
        if self._greenlet:
            self._greenlet.parent = getcurrent()
            self._greenlet.throw(TaskCancelled)
        else:  # it has not begun
            self._error, self.done = TaskCancelled(), True

    def result(self) -> _T:
        """Return what the call returned, or raise what it raised; the task has ended."""
        if self._error is not None:
            raise self._error
        return cast(_T, self._result)
