"""Bus time: one clock for everything that is timed on a bus."""

from __future__ import annotations

from enum import Enum

HOLD_S = 0.5
"""Wall time without SYNC after which a bus that nobody leads runs with the wall again."""


class ClockMode(Enum):
    """How bus time goes."""

    PACED = "paced"
    """Bus time is wall time."""
    LOCKSTEP = "lockstep"
    """SYNC and the master that leads the bus move bus time; where nobody leads, the wall too."""


class BusClock:
    """Bus time in seconds since the bus was started; wall times are monotonic seconds.

    A paced clock runs with the wall. One in lockstep stands at 0 at first.
    """

    def __init__(self, mode: ClockMode, wall_s: float) -> None:
        self.mode = mode
        self.stands = mode is ClockMode.LOCKSTEP
        """Whether bus time changes by `move` and `sync` only."""
        self.held = False
        """Whether bus time waits for the next SYNC, for `HOLD_S` of wall time at the most."""
        self._base_s = 0.0
        self._base_wall_s = wall_s
        self._last_s = 0.0

    def now(self, wall_s: float) -> float:
        """Return bus time at `wall_s`; never less than what was returned before."""
        if self.stands or (self.held and wall_s < self._base_wall_s):
            return self._base_s
        self.held = False
        self._last_s = max(self._last_s, self._base_s + wall_s - self._base_wall_s)
        return self._last_s

    def ask(self, wall_s: float) -> float:
        """Return bus time at `wall_s`, and let it be earlier the next time."""
        if self.stands or (self.held and wall_s < self._base_wall_s):
            return self._base_s
        return max(self._last_s, self._base_s + wall_s - self._base_wall_s)

    def stand(self, wall_s: float) -> None:
        """Stop at `wall_s`, to be moved by `move` and `sync` alone."""
        self._base_s = self.now(wall_s)
        self.stands, self.held = True, False

    def move(self, to_s: float) -> None:
        """Set a clock that stands to bus time `to_s`, not less than now."""
        self._base_s = self._last_s = to_s

    def run(self, wall_s: float) -> None:
        """Let a clock that stands go on with the wall from `wall_s`."""
        if self.stands:
            self._base_wall_s = wall_s
            self.stands = False

    def sync(self, wall_s: float, period_s: float) -> float:
        """Take a SYNC into account and return the bus time of it.

        In lockstep, with `period_s` > 0, bus time moves by exactly `period_s`; a clock that had
        run with the wall is held then.
        """
        if self.mode is ClockMode.PACED or period_s <= 0.0:
            return self.now(wall_s)
        if self.stands:
            self.move(self._base_s + period_s)
            return self._base_s
        # while held, the wall time kept is that from which bus time would run again
        before = self._base_s if self.held and wall_s < self._base_wall_s else self.now(wall_s)
        self._base_s = self._last_s = before + period_s
        self._base_wall_s = wall_s + HOLD_S
        self.held = True
        return self._base_s

    def wall_wait(self, wall_s: float, event_s: float) -> float:
        """Return how long on the wall until bus time `event_s`, or until a held clock runs."""
        if self.held:
            return max(self._base_wall_s - wall_s, 0.0)
        return max(event_s - self.ask(wall_s), 0.0)
