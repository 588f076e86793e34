"""When the answers of a cycle are looked for."""

from __future__ import annotations

import time

import pytest

from cdpr_drivers.axes.answer_wait import AnswerWait

MOST_S = 0.02


def test_it_sleeps_until_the_answers_have_usually_come() -> None:
    wait = AnswerWait(MOST_S)
    for _ in range(100):
        wait.learn(0.01, too_early=True)
    begin = time.monotonic()
    wait.sleep(begin)
    assert time.monotonic() - begin > 0.009


def test_it_never_sleeps_beyond_the_deadline() -> None:
    wait = AnswerWait(MOST_S)
    for _ in range(100):
        wait.learn(5.0, too_early=True)
    begin = time.monotonic()
    wait.sleep(begin)
    assert time.monotonic() - begin == pytest.approx(MOST_S, abs=0.015)


def test_it_looks_earlier_when_nothing_was_ever_missing() -> None:
    wait = AnswerWait(MOST_S)
    for _ in range(100):
        wait.learn(0.01, too_early=True)
    for _ in range(2000):
        wait.learn(0.01, too_early=False)
    begin = time.monotonic()
    wait.sleep(begin)
    assert time.monotonic() - begin < 0.005


def test_a_time_that_is_over_is_not_slept() -> None:
    wait = AnswerWait(MOST_S)
    for _ in range(100):
        wait.learn(0.01, too_early=True)
    begin = time.monotonic()
    wait.sleep(begin - 1.0)
    assert time.monotonic() - begin < 0.005
