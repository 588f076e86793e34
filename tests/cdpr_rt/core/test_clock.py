"""Time and cooperative tasks in lockstep and paced: order, waits, timeouts, cancelling."""

from __future__ import annotations

import math
import signal
import socket
import threading
import time
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_rt.core.clock import Clock, LockstepClock, PacedClock, TaskCancelled


class Line:
    """A real socket as a source. It records what it receives and when it is ticked."""

    def __init__(self, clock: Clock, tick_s: float = math.inf) -> None:
        self.sock, self.peer = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.sock.setblocking(False)
        self.came: list[bytes] = []
        self.ticks: list[float] = []
        self._every_s, self._due_s = tick_s, 0.0
        clock.add(self)

    def fileno(self) -> int:
        return self.sock.fileno()

    def poll(self) -> bool:
        try:
            self.came.append(self.sock.recv(100))
        except BlockingIOError:
            return False
        return True

    def tick(self, now_s: float) -> float:
        if now_s >= self._due_s:
            self.ticks.append(now_s)
            self._due_s = now_s + self._every_s
        return self._due_s


naps = st.lists(st.sampled_from([0.0, 0.001, 0.25, 0.5, 1.0, 3.0]), max_size=6)


@given(st.lists(naps, max_size=5))
def test_tasks_continue_by_time_and_then_in_starting_order(plans: list[list[float]]) -> None:
    clock = LockstepClock()
    told: list[tuple[float, int]] = []

    def nap(number: int, plan: list[float]) -> Callable[[], int]:
        def work() -> int:
            for seconds in plan:
                clock.sleep(seconds)
                told.append((clock.now_s, number))
            return number

        return work

    tasks = clock.gather(nap(number, plan) for number, plan in enumerate(plans))
    assert [task.result() for task in tasks] == list(range(len(plans)))
    assert told == sorted(told)
    assert clock.now_s == pytest.approx(max((sum(plan) for plan in plans), default=0.0))


def test_lockstep_time_advances_only_in_waits() -> None:
    clock = LockstepClock()
    time.sleep(0.02)
    assert clock.now_s == 0.0
    began = time.monotonic()
    assert not clock.wait(lambda: False, 3600.0)
    assert clock.now_s == 3600.0
    assert time.monotonic() - began < 60.0


def test_a_wait_ends_with_an_event_before_its_timeout() -> None:
    clock = PacedClock()
    line = Line(clock)
    threading.Timer(0.05, line.peer.send, [b"here"]).start()
    assert clock.wait(lambda: line.came, clock.now_s + 60.0)
    assert line.came == [b"here"]


def test_a_wait_without_event_lasts_its_timeout() -> None:
    clock = PacedClock()
    Line(clock)
    for seconds in (0.0, 0.0004, 0.003, 0.02):
        until = clock.now_s + seconds
        assert not clock.wait(lambda: False, until)
        assert clock.now_s >= until


@pytest.mark.parametrize("kind", [PacedClock, LockstepClock])
def test_tasks_may_wait_for_each_other_in_a_chain(kind: type[Clock]) -> None:
    clock = kind()

    def deep(levels: int) -> int:
        clock.sleep(0.001)
        return (
            1 + sum(t.result() for t in clock.gather([lambda: deep(levels - 1)] * 2))
            if levels
            else 1
        )

    assert clock.start(lambda: deep(3)).done is False
    assert [task.result() for task in clock.gather([lambda: deep(3)])] == [15]


def test_an_exception_of_a_task_is_raised_by_its_result() -> None:
    clock = LockstepClock()

    def fail() -> None:
        clock.sleep(1.0)
        raise ValueError("no")

    bad, good = clock.gather([fail, lambda: clock.sleep(2.0)])
    assert good.result() is None
    with pytest.raises(ValueError, match="no"):
        bad.result()
    assert clock.now_s == 2.0


def test_a_cancelled_task_ends_at_its_wait_and_cleans_up() -> None:
    clock = LockstepClock()
    left: list[str] = []

    def work() -> None:
        try:
            clock.sleep(math.inf)
        except Exception:  # error handling of a driver must not keep the task alive
            left.append("caught")
        finally:
            left.append("finally")
            clock.sleep(1.0)
            left.append("waited")

    task, unborn = clock.start(work), clock.start(lambda: left.append("unborn"))
    clock.cancel(unborn)
    clock.run_tasks()
    clock.cancel(task)
    assert left == ["finally"]
    clock.sleep(2.0)
    assert left == ["finally", "waited"]
    assert task.done
    with pytest.raises(TaskCancelled):
        task.result()


def test_the_canceller_of_a_task_can_still_wait() -> None:
    clock = LockstepClock()
    task = clock.start(lambda: clock.sleep(math.inf))
    clock.run_tasks()
    clock.cancel(task)
    clock.sleep(1.0)
    assert clock.now_s == 1.0
    assert task.done


def test_an_interrupt_is_raised_and_ends_all_tasks() -> None:
    clock = PacedClock()
    ended: list[int] = []

    def work(number: int) -> None:
        try:
            if number == 1:
                signal.raise_signal(signal.SIGINT)
            clock.sleep(60.0)
        finally:
            ended.append(number)

    with pytest.raises(KeyboardInterrupt):
        clock.gather([lambda: work(0), lambda: work(1), lambda: work(2)])
    assert ended == [1, 0]  # the third had not started


def test_run_tasks_does_not_wait_and_runs_each_task_once() -> None:
    clock = LockstepClock()
    steps: list[int] = []
    task = clock.start(lambda: [(steps.append(k), clock.sleep(0.001 * k)) for k in range(3)])
    clock.run_tasks()
    assert steps == [0, 1]  # a wait of zero does not yield to other tasks
    clock.run_tasks()
    assert steps == [0, 1]
    assert clock.now_s == 0.0
    clock.wait(lambda: task.done)
    assert steps == [0, 1, 2]


def test_sources_are_ticked_at_their_times_during_a_wait() -> None:
    clock = LockstepClock()
    line = Line(clock, tick_s=0.25)
    clock.sleep(1.1)
    assert line.ticks == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    clock.remove(line)
    clock.remove(line)
    clock.sleep(1.0)
    assert len(line.ticks) == 5


@pytest.mark.parametrize("kind", [PacedClock, LockstepClock])
def test_run_blocking_returns_results_and_raises_errors(kind: type[Clock]) -> None:
    clock = kind()
    steps: list[str] = []
    ran = threading.Event()

    def slow() -> int:
        if clock.lockstep:
            time.sleep(0.1)
        else:
            assert ran.wait(60.0)
        steps.append("slow")
        return threading.get_ident()

    def run() -> None:
        steps.append("other")
        ran.set()

    other = clock.start(run)
    here = clock.run_blocking(slow) == threading.get_ident()
    clock.wait(lambda: other.done)
    # other tasks continue meanwhile if paced; in lockstep, time stands still
    assert (steps, here) == (
        (["slow", "other"], True) if clock.lockstep else (["other", "slow"], False)
    )
    with pytest.raises(ZeroDivisionError):
        clock.run_blocking(lambda: 1 // 0)


def test_real_time_simulation_is_never_ahead_of_the_wall_clock() -> None:
    clock = LockstepClock(real_time=True)
    clock.sleep(0.01)
    began_s, begin_s = time.monotonic(), clock.now_s
    for _ in range(10):
        clock.sleep(0.02)
        assert clock.now_s - begin_s <= time.monotonic() - began_s + 0.02


def test_real_time_simulation_does_not_catch_up_after_a_delay() -> None:
    clock = LockstepClock(real_time=True)
    clock.sleep(0.01)
    time.sleep(0.3)  # as on a busy machine
    clock.sleep(0.001)
    began_s = time.monotonic()
    clock.sleep(0.1)
    assert time.monotonic() - began_s > 0.07
