"""Limits of log lines that remote clients can cause."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator

import pytest

from cdpr_tools.daemon.service_process import BoundedLog


class Log:
    """A logger with the filter, its lines, and a clock set by the test."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._text = io.StringIO()
        self.handler = logging.StreamHandler(self._text)
        self.bounded = BoundedLog(lambda: self.now_s)
        self.handler.addFilter(self.bounded)
        self.logger = logging.getLogger("tests.bounded")
        self.logger.propagate = False
        self.logger.addHandler(self.handler)

    def lines(self) -> list[str]:
        return self._text.getvalue().splitlines()


@pytest.fixture
def log() -> Iterator[Log]:
    one = Log()
    yield one
    one.logger.removeHandler(one.handler)


def test_five_lines_of_a_kind_are_shown_and_the_rest_is_counted(log: Log) -> None:
    for k in range(1000):
        log.logger.error("refused: %s", k)
        log.logger.warning("slow") if k < 3 else None
    assert len(log.lines()) == 5 + 3
    log.now_s = 61.0
    log.bounded.report_suppressed()
    assert log.lines()[8:] == ["995 more within 60 s: refused: %s"]
    log.logger.error("refused: %s", "again")
    assert log.lines()[-1] == "refused: again"


def test_too_many_different_texts_are_counted_together(log: Log) -> None:
    for k in range(10_000):
        log.logger.error(f"made up {k}")
    shown = len(log.lines())
    assert shown < 100
    log.now_s = 61.0
    log.bounded.report_suppressed()
    assert log.lines()[shown:] == [f"{10_000 - shown} more within 60 s: other messages"]
