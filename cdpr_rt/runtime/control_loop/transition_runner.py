"""Advances one transition at a time, a step a turn."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any

from cdpr_rt.core.task import Task
from cdpr_rt.errors import ControlError
from cdpr_rt.refusal import CommandRefusal, refusal_of
from cdpr_rt.runtime.control_loop.engine import Engine
from cdpr_rt.runtime.control_loop.lifecycle import RefusedError

Steps = Iterator[None]
Listener = Callable[[CommandRefusal | str], None]
"""Called at the end of a transition with the error, "" where it succeeded."""


class TransitionRunner:
    """Advances a transition's steps, one a turn, and the tasks that they wait for.

    A transition is a generator. It may be dropped at any `yield` in favour of another one. Where it
    fails it raises ControlError, whose text goes to its listeners.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._clock = engine.machine.clock
        self._steps: Steps | None = None
        self._listeners: list[Listener] = []
        self._task: Task[Any] | None = None

    @property
    def busy(self) -> bool:
        """Whether a transition is in progress."""
        return self._steps is not None

    def begin(self, steps: Steps, listener: Listener | None = None) -> None:
        """Advance `steps` once a turn from now on, in place of any other."""
        before, self._steps = self._steps, steps
        if before is not None:
            self._tell(f"given up: {self._engine.life.reason or 'something else came first'}")
        if listener is not None:
            self.listen(listener)
        self._engine.life.changed = True

    def listen(self, listener: Listener) -> None:
        """Tell `listener` of the end of the transition in progress."""
        self._listeners.append(listener)

    def advance(self) -> None:
        """Advance by a step; raises any exception but ControlError."""
        steps = self._steps
        if steps is None:
            return
        try:
            next(steps)
        except StopIteration:
            self._end(steps, "")
        except ControlError as error:
            self._end(steps, refusal_of(error) or str(error))
        except Exception as error:
            self._end(steps, f"{type(error).__name__}: {error}")
            raise

    def _end(self, steps: Steps, error: CommandRefusal | str) -> None:
        if self._steps is steps:  # it may have begun another
            self._steps = None
            self._tell(error)
        self._engine.life.changed = True

    def _tell(self, error: CommandRefusal | str) -> None:
        listeners, self._listeners = self._listeners, []
        for listener in listeners:
            listener(error)

    # -- waiting

    @property
    def task_running(self) -> bool:
        """Whether a task runs beside the cycle."""
        return self._task is not None and not self._task.done

    def start(self, work: Callable[[], Any]) -> Task[Any]:
        """Start `work` as a task beside the cycle; it runs at once up to its first wait."""
        self._task = task = self._clock.start(work)
        self._clock.run_tasks()
        return task

    def cancel(self) -> None:
        """Have the task end where it waits."""
        if self._task is not None:
            self._task.cancel()

    def run_task(self, work: Callable[[], Any]) -> Steps:
        """Run `work`, which may wait, as a task beside the cycle; raises what it raises."""
        task = self.start(work)
        while not task.done:
            yield
        task.result()

    def run_blocking(self, work: Callable[[], Any]) -> Steps:
        """Run `work`, which touches no bus, in a thread, without delaying cycles."""
        yield from self.run_task(lambda: self._clock.run_blocking(work))

    def wait_up_to(self, within_s: float, done: Callable[[], bool]) -> Generator[None, None, bool]:
        """Wait until `done`, at most `within_s`; return whether it was."""
        for _ in range(self._engine.cycles_in(within_s)):
            if done():
                return True
            yield
        return False

    def wait_until(self, done: Callable[[], bool], within_s: float, what: str) -> Steps:
        """Wait until `done`; raises RefusedError where that takes longer."""
        if not (yield from self.wait_up_to(within_s, done)):
            raise RefusedError(f"{what}: not within {within_s:g} s")
