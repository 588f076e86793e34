"""Timers of one slave in bus time."""

from __future__ import annotations

import math
from collections.abc import Callable

_TOLERANCE_S = 1e-9
"""Bus time is a sum of floats: what is due now may lie this much ahead."""


class Timer:
    """One alarm; `due` is infinite while it does not run."""

    __slots__ = ("_timers", "due", "fire")

    def __init__(self, timers: Timers, fire: Callable[[float], None]) -> None:
        self._timers = timers
        self.fire = fire
        self.due = math.inf

    def arm(self, due: float) -> None:
        """Let it fire once, at bus time `due` (s)."""
        self.due = due = due - _TOLERANCE_S
        timers = self._timers
        timers.next_due = min(timers.next_due, due)

    def stop(self) -> None:
        """Let it not fire."""
        self.due = math.inf


class Timers:
    """All timers of a slave. `next_due` is never too late, but may be early after `stop`."""

    def __init__(self) -> None:
        self._all: list[Timer] = []
        self.next_due = math.inf

    def add(self, fire: Callable[[float], None]) -> Timer:
        """Return a new timer, stopped, that calls `fire(now)`."""
        timer = Timer(self, fire)
        self._all.append(timer)
        return timer

    def run(self, now: float) -> None:
        """Fire what is due at `now` (s)."""
        for timer in self._all:
            if timer.due <= now:
                timer.due = math.inf
                timer.fire(now)
        self.next_due = min(timer.due for timer in self._all)
