"""Bus time: one clock for everything that is timed on a bus."""

from __future__ import annotations

from enum import Enum

HOLD_S = 0.5
"""In lockstep, wall time without SYNC after which bus time usually runs with the wall again."""


class ClockMode(Enum):
    """How bus time goes."""

    PACED = "paced"
    """Bus time is wall time."""
    LOCKSTEP = "lockstep"
    """Each SYNC moves bus time by one communication cycle period; between them it stands."""


class BusClock:
    """Bus time in seconds since the bus was started; wall times are monotonic seconds."""

    def __init__(self, mode: ClockMode, wall_s: float) -> None:
        self.mode = mode
        self.hold_s = HOLD_S
        """Wall time without SYNC that a held clock waits for."""
        self.held = False
        """Whether bus time stands still until the next SYNC."""
        self._lockstep = mode is ClockMode.LOCKSTEP
        self._base_s = 0.0
        self._base_wall_s = wall_s
        self._last_s = 0.0

    def now(self, wall_s: float) -> float:
        """Return bus time at `wall_s`; never less than what was returned before."""
        if self.held and wall_s < self._base_wall_s:
            return self._base_s
        self.held = False
        self._last_s = max(self._last_s, self._base_s + wall_s - self._base_wall_s)
        return self._last_s

    def ask(self, wall_s: float) -> float:
        """Return bus time at `wall_s`, and let it be earlier the next time."""
        if self.held and wall_s < self._base_wall_s:
            return self._base_s
        return max(self._last_s, self._base_s + wall_s - self._base_wall_s)

    def sync(self, wall_s: float, period_s: float) -> float:
        """Take a SYNC into account and return the bus time at which it stands.

        In lockstep, with `period_s` > 0, bus time moves by exactly `period_s` and is held.
        """
        if not self._lockstep or period_s <= 0.0:
            return self.now(wall_s)
        # while held, the wall time kept is that from which bus time would run again
        before = self._base_s if self.held and wall_s < self._base_wall_s else self.now(wall_s)
        self._base_s = self._last_s = before + period_s
        self._base_wall_s = wall_s + self.hold_s
        self.held = True
        return self._base_s

    def wall_wait(self, wall_s: float, event_s: float) -> float:
        """Return how long on the wall until bus time `event_s`, or until a held clock runs."""
        if self.held:
            return max(self._base_wall_s - wall_s, 0.0)
        return max(event_s - self.ask(wall_s), 0.0)
