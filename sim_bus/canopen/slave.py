"""Shared parts of a CANopen slave, its services and device: timers, states, callbacks, COB-IDs."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum

_TOLERANCE_S = 1e-9
"""Bus time is a sum of floats: an event due now may lie this far ahead."""


class Timer:
    """One alarm; `due` is infinite while it does not run."""

    __slots__ = ("_timers", "due", "fire")

    def __init__(self, timers: Timers, fire: Callable[[float], None]) -> None:
        self._timers = timers
        self.fire = fire
        self.due = math.inf

    def arm(self, due: float) -> None:
        """Let the timer fire once, at bus time `due` (s)."""
        self.due = due = due - _TOLERANCE_S
        timers = self._timers
        timers.next_due = min(timers.next_due, due)

    def stop(self) -> None:
        """Stop the timer."""
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
        """Fire the timers due at `now` (s)."""
        for timer in self._all:
            if timer.due <= now:
                timer.due = math.inf
                timer.fire(now)
        self.next_due = min(timer.due for timer in self._all)


class NmtState(IntEnum):
    """NMT states with their values in a heartbeat (CiA 301)."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class SlaveApplication:
    """Base of a device: override the needed methods. `now` is bus time in seconds.

    At a SYNC in OPERATIONAL the order is `before_sync`, synchronous RPDOs written into the
    dictionary (hooks of `on_write` run), `after_rpdo`, synchronous TPDOs sampled. In
    PRE-OPERATIONAL only `before_sync` is called.
    """

    def before_sync(self, now: float) -> None:
        """Handle a SYNC: latch feedback here."""

    def after_rpdo(self, now: float) -> None:
        """Apply new targets: at every SYNC in OPERATIONAL, and after each event-driven RPDO."""

    def on_nmt(self, state: NmtState) -> None:
        """Handle a new NMT state (also INITIALISING during a reset)."""

    def on_reset_node(self) -> None:
        """Restart the application: the dictionary has its power-on values again."""

    def on_heartbeat_lost(self, node: int) -> None:
        """Handle the silence or restart of a monitored node (1016h)."""

    def on_rpdo_timeout(self, number: int) -> None:
        """Handle a missed deadline (1400h:05) of RPDO `number` (from 1)."""


# COB-IDs of the predefined connection set (CiA 301) and the type of the frame handlers.

FRAME_HEAD = "<IB3x"
"""Identifier and length. The kernel's structure is in host order; all supported hosts are little
endian, so a single `struct` call can pack head and data."""

NMT_COMMAND = 0x000
EMCY = 0x080
SDO_RESPONSE = 0x580
SDO_REQUEST = 0x600
ERROR_CONTROL = 0x700
LSS_MASTER = 0x7E5
LSS_SLAVE = 0x7E4

Handler = Callable[[bytes, float], None]
"""Processes a frame, given the bus time (s) at which it was seen."""


def is_restricted(identifier: int) -> bool:
    """Whether CiA 301 reserves an identifier for other services (or it is not an 11-bit one)."""
    return (
        identifier > 0x7FF
        or identifier <= 0x07F
        or 0x101 <= identifier <= 0x180
        or 0x581 <= identifier <= 0x5FF
        or 0x601 <= identifier <= 0x67F
        or 0x6E0 <= identifier <= 0x6FF
        or identifier >= 0x701
    )
