"""Callbacks of a device built on the CANopen slave."""

from __future__ import annotations

from enum import IntEnum


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
