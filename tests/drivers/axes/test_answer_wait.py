"""When the answers of a cycle are looked for."""

from __future__ import annotations

import pytest
from typing_extensions import override

from cdpr_drivers.axes.axis_buses import AnswerWait
from cdpr_rt.core.clock import PacedClock

MOST_S = 0.02
SYNC_S = 100.0


class ClockAtSync(PacedClock):
    """Shows the instant of the SYNC, and notes the sleeps that were asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.slept_s: list[float] = []

    @property
    @override
    def now_s(self) -> float:
        return SYNC_S

    @override
    def sleep_until(self, until_s: float) -> None:
        self.slept_s.append(until_s - SYNC_S)


@pytest.fixture
def clock() -> ClockAtSync:
    return ClockAtSync()


def missing(clock: ClockAtSync, took_s: float) -> AnswerWait:
    wait = AnswerWait(clock, MOST_S)
    for _ in range(100):
        wait.learn(took_s, too_early=True)
    return wait


def test_it_sleeps_until_the_answers_have_usually_come(clock: ClockAtSync) -> None:
    missing(clock, 0.01).sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([0.01], rel=1e-3)


def test_it_never_sleeps_beyond_the_deadline(clock: ClockAtSync) -> None:
    missing(clock, 5.0).sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([MOST_S], rel=1e-3)


def test_it_looks_earlier_when_nothing_was_ever_missing(clock: ClockAtSync) -> None:
    wait = missing(clock, 0.01)
    for _ in range(500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([0.01 * 0.995**500], rel=1e-3)
    for _ in range(1500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert len(clock.slept_s) == 1  # so short a wait is left to the socket


def test_a_time_that_is_over_is_not_slept(clock: ClockAtSync) -> None:
    missing(clock, 0.01).sleep(SYNC_S - 1.0)
    assert clock.slept_s == []
