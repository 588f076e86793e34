"""Interfaces between a CANopen slave and its services."""

from __future__ import annotations

from typing import Protocol

from cdpr_sim_bus.canopen.application import NmtState, SlaveApplication
from cdpr_sim_bus.canopen.dictionary.od import ObjectDictionary
from cdpr_sim_bus.canopen.dictionary.store import ParameterStore
from cdpr_sim_bus.canopen.dictionary.verify import ConfigurationStamp
from cdpr_sim_bus.canopen.timers import Timers


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
