"""When the answers of a cycle are looked for."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cdpr_drivers.axes import axis_buses
from cdpr_drivers.axes.axis_buses import AnswerWait

MOST_S = 0.02
SYNC_S = 100.0


@pytest.fixture
def slept_s(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The sleeps that were asked for, by a clock that shows the instant of the SYNC."""
    slept: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: SYNC_S, sleep=slept.append)
    monkeypatch.setattr(axis_buses, "time", clock)
    return slept


def missing(took_s: float) -> AnswerWait:
    wait = AnswerWait(MOST_S)
    for _ in range(100):
        wait.learn(took_s, too_early=True)
    return wait


def test_it_sleeps_until_the_answers_have_usually_come(slept_s: list[float]) -> None:
    missing(0.01).sleep(SYNC_S)
    assert slept_s == pytest.approx([0.01], rel=1e-3)


def test_it_never_sleeps_beyond_the_deadline(slept_s: list[float]) -> None:
    missing(5.0).sleep(SYNC_S)
    assert slept_s == pytest.approx([MOST_S], rel=1e-3)


def test_it_looks_earlier_when_nothing_was_ever_missing(slept_s: list[float]) -> None:
    wait = missing(0.01)
    for _ in range(500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert slept_s == pytest.approx([0.01 * 0.995**500], rel=1e-3)
    for _ in range(1500):
        wait.learn(0.01, too_early=False)
    wait.sleep(SYNC_S)
    assert len(slept_s) == 1  # so short a wait is left to the socket


def test_a_time_that_is_over_is_not_slept(slept_s: list[float]) -> None:
    missing(0.01).sleep(SYNC_S - 1.0)
    assert slept_s == []
