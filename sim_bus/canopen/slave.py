"""Interfaces between a CANopen slave, its services and its device: timers, callbacks, states."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum
from typing import Protocol

from cdpr_sim_bus.canopen.dictionary.od import ObjectDictionary
from cdpr_sim_bus.canopen.dictionary.store import ConfigurationStamp, ParameterStore

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


class NmtState(IntEnum):
    """NMT states with the values a heartbeat carries (CiA 301)."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class SlaveApplication:
    """Base of a device: override what concerns it. `now` is bus time in seconds.

    At a SYNC in OPERATIONAL the order is `before_sync`, synchronous RPDOs written into the
    dictionary (hooks of `on_write` run), `after_rpdo`, synchronous TPDOs sampled. In
    PRE-OPERATIONAL only `before_sync` is called.
    """

    def before_sync(self, now: float) -> None:
        """Handle a SYNC: latch feedback here."""

    def after_rpdo(self, now: float) -> None:
        """Take new targets: at every SYNC in OPERATIONAL, and after each event-driven RPDO."""

    def on_nmt(self, state: NmtState) -> None:
        """Learn of a new NMT state (also INITIALISING during a reset)."""

    def on_reset_node(self) -> None:
        """Restart the application: the dictionary holds its power-on values again."""

    def on_heartbeat_lost(self, node: int) -> None:
        """Learn that a monitored node (1016h) fell silent or restarted."""

    def on_rpdo_timeout(self, number: int) -> None:
        """Learn that RPDO `number` (from 1) missed its deadline (1400h:05)."""


class SyncService(Protocol):
    """The SYNC consumer as PDOs know it."""

    counted: bool
    """Whether SYNC carries a counter (1019h)."""


class PdoTransfers(Protocol):
    """All PDOs of a node as a single one, and SYNC, know them."""

    window_s: float

    def set_state(self) -> None:
        """Start or stop with the NMT state."""

    def collect(self) -> None:
        """Sort the PDOs in use anew."""

    def at_sync(self, now: float, counter: int) -> None:
        """Handle a SYNC in OPERATIONAL."""

    def report_faults(self) -> None:
        """Report RPDOs of a wrong length, or take the report back."""


class Slave(Protocol):
    """A node, of which its services are parts; `cdpr_sim_bus.canopen.node` has the one there is."""

    od: ObjectDictionary
    app: SlaveApplication
    store: ParameterStore
    stamp: ConfigurationStamp
    timers: Timers
    node_id: int
    bus_bitrate: int
    bitrate: int
    nmt_state: NmtState
    sync_period_s: float
    outbox: list[bytes]
    now: float
    muted: bool

    @property
    def sync(self) -> SyncService:
        """Its SYNC consumer."""

    @property
    def pdo(self) -> PdoTransfers:
        """Its PDOs."""

    def communication_error(self, code: int, vendor: bytes = b"") -> None:
        """Report an error of the communication itself."""

    def communication_error_clear(self, code: int) -> None:
        """Take back an error of the communication."""

    def set_nmt_state(self, state: NmtState) -> None:
        """Change the NMT state."""

    def reset_communication(self) -> None:
        """Restart communication with its power-on values."""

    def rebuild_handlers(self) -> None:
        """Work out anew which identifiers are listened to."""
