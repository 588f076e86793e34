"""Bus time: one clock for all timed events on a bus."""

from __future__ import annotations

from enum import Enum

HOLD_S = 0.5
"""Wall time without SYNC after which a bus without a leader runs with the wall clock again."""


class ClockMode(Enum):
    """How bus time advances."""

    PACED = "paced"
    """Bus time is wall time."""
    LOCKSTEP = "lockstep"
    """SYNC and the master that leads the bus advance bus time; without a leader, wall time too."""


class BusClock:
    """Bus time in seconds since the bus was started; wall times are monotonic seconds.

    A paced clock runs with wall time. A lockstep clock is initially stopped at 0.
    """

    def __init__(self, mode: ClockMode, wall_s: float) -> None:
        self.mode = mode
        self.stopped = mode is ClockMode.LOCKSTEP
        """Whether only `move` and `sync` change bus time."""
        self.held = False
        """Whether bus time waits for the next SYNC, for at most `HOLD_S` of wall time."""
        self._base_s = 0.0
        self._base_wall_s = wall_s
        self._last_s = 0.0

    def now(self, wall_s: float) -> float:
        """Return bus time at `wall_s`; never less than a value returned before."""
        if self.stopped or (self.held and wall_s < self._base_wall_s):
            return self._base_s
        self.held = False
        self._last_s = max(self._last_s, self._base_s + wall_s - self._base_wall_s)
        return self._last_s

    def peek(self, wall_s: float) -> float:
        """Return bus time at `wall_s`; later calls may return earlier times."""
        if self.stopped or (self.held and wall_s < self._base_wall_s):
            return self._base_s
        return max(self._last_s, self._base_s + wall_s - self._base_wall_s)

    def stop(self, wall_s: float) -> None:
        """Stop at `wall_s`: only `move` and `sync` change bus time from now on."""
        self._base_s = self.now(wall_s)
        self.stopped, self.held = True, False

    def move(self, to_s: float) -> None:
        """Set a stopped clock to bus time `to_s`, not less than now."""
        self._base_s = self._last_s = to_s

    def run(self, wall_s: float) -> None:
        """Let a stopped clock run with the wall clock from `wall_s`."""
        if self.stopped:
            self._base_wall_s = wall_s
            self.stopped = False

    def sync(self, wall_s: float, period_s: float) -> float:
        """Process a SYNC and return its bus time.

        In lockstep, with `period_s` > 0, bus time moves by exactly `period_s`; a clock that was
        running with the wall clock is then held.
        """
        if self.mode is ClockMode.PACED or period_s <= 0.0:
            return self.now(wall_s)
        if self.stopped:
            self.move(self._base_s + period_s)
            return self._base_s
        # while held, the stored wall time is the one from which bus time would run again
        before = self._base_s if self.held and wall_s < self._base_wall_s else self.now(wall_s)
        self._base_s = self._last_s = before + period_s
        self._base_wall_s = wall_s + HOLD_S
        self.held = True
        return self._base_s

    def wall_wait(self, wall_s: float, event_s: float) -> float:
        """Return the wall time until bus time `event_s`, or until a held clock runs again."""
        if self.held:
            return max(self._base_wall_s - wall_s, 0.0)
        return max(event_s - self.peek(wall_s), 0.0)
