"""A sleep until the answers of a cycle are expected: one wake-up a cycle, not one a frame."""

from __future__ import annotations

import time
from typing import Final

_SHORTEST_SLEEP_S: Final = 5e-5
"""Shorter waits are left to the sockets."""
_RISE, _FALL = 0.1, 0.995


class AnswerWait:
    """Sleeps until the answers have usually come, and adapts that time from cycle to cycle.

    Waking up costs the host more than reading the frames of a whole cycle. `most_s` bounds the
    sleep, from SYNC on.
    """

    def __init__(self, most_s: float) -> None:
        self._most_s = most_s
        self._expected_s = 0.0

    def sleep(self, since_s: float) -> None:
        """Sleep until the answers to the SYNC of `since_s` (monotonic) have usually come."""
        left = since_s + self._expected_s - time.monotonic()
        if left > _SHORTEST_SLEEP_S:
            time.sleep(left)

    def learn(self, took_s: float, too_early: bool) -> None:
        """Adapt to how long all answers took and whether some were missing after the sleep."""
        if too_early:
            took_s = min(took_s, self._most_s)
            self._expected_s += _RISE * (took_s - self._expected_s)
        else:  # they may have come earlier, which only an earlier look can show
            self._expected_s *= _FALL
