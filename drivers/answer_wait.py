"""One wake-up for the answers of a cycle, instead of one for every frame that comes."""

from __future__ import annotations

import time
from typing import Final

_WORTH_S: Final = 5e-5
"""Shorter waits are left to the sockets."""
_RISE, _FALL = 0.1, 0.995


class AnswerWait:
    """Sleeps until the answers have usually come; learns from each cycle when that is.

    Waking up costs the host more than reading the frames of a whole cycle. `most_s` bounds the
    sleep, from SYNC on.
    """

    def __init__(self, most_s: float) -> None:
        self._most_s = most_s
        self._usual_s = 0.0

    def sleep(self, since_s: float) -> None:
        """Sleep until the answers to the SYNC of `since_s` (monotonic) have usually come."""
        left = since_s + self._usual_s - time.monotonic()
        if left > _WORTH_S:
            time.sleep(left)

    def learn(self, took_s: float, too_early: bool) -> None:
        """Take in how long all answers took, and whether some were missing after the sleep."""
        if too_early:
            took_s = min(took_s, self._most_s)
            self._usual_s += _RISE * (took_s - self._usual_s)
        else:  # they may have come earlier, which only an earlier look can show
            self._usual_s *= _FALL
