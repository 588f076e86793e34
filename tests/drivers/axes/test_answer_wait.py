"""The wait between SYNC and the first look for answers."""

from __future__ import annotations

import pytest
from typing_extensions import override

from cdpr_drivers.axes.axis_buses import AnswerWait
from cdpr_rt.core.clock import PacedClock

MOST_S = 0.02
SYNC_S = 100.0


class ClockAtSync(PacedClock):
    """Stand at the instant of the SYNC and record how long each sleep should take."""

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


def after_100_early_looks(clock: ClockAtSync, took_s: float) -> AnswerWait:
    wait = AnswerWait(clock, MOST_S)
    for _ in range(100):
        wait.learn(took_s, too_early=True)
    return wait


def test_sleep_lasts_until_answers_usually_arrive(clock: ClockAtSync) -> None:
    after_100_early_looks(clock, 0.01).sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([0.01], rel=1e-3)


def test_sleep_never_exceeds_the_deadline(clock: ClockAtSync) -> None:
    after_100_early_looks(clock, 5.0).sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([MOST_S], rel=1e-3)


def test_sleep_shortens_while_no_answer_is_missing(clock: ClockAtSync) -> None:
    wait = after_100_early_looks(clock, 0.01)
    for _ in range(500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert clock.slept_s == pytest.approx([0.01 * 0.995**500], rel=1e-3)
    for _ in range(1500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert len(clock.slept_s) == 1  # a wait this short is left to the socket


def test_no_sleep_if_answers_are_already_due(clock: ClockAtSync) -> None:
    after_100_early_looks(clock, 0.01).sleep(SYNC_S - 1.0)
    assert clock.slept_s == []
