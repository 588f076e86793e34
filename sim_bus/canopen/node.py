"""CANopen slave: one node of CiA 301 and CiA 305 without an application of its own."""

from __future__ import annotations

from collections.abc import Callable

from sim_bus.canopen.application import NmtState, SlaveApplication
from sim_bus.canopen.od import ObjectDictionary
from sim_bus.canopen.store import ParameterStore


class CanopenSlave:
    """Communication part of a simulated device; all times are bus time in seconds.

    The first `advance` boots it. `outbox` is one list for good: whoever sends its frames
    empties it with `clear()`.
    """

    def __init__(
        self,
        od: ObjectDictionary,
        node_id: int,
        app: SlaveApplication,
        *,
        store: ParameterStore | None = None,
        bitrate: int = 1_000_000,
    ) -> None:
        self.od = od
        self.node_id = node_id
        """Active node id, 255 while unconfigured."""
        self.bitrate = bitrate
        self.nmt_state = NmtState.INITIALISING
        self.sync_period_s = 0.0
        """Communication cycle period (1006h)."""
        self.outbox: list[bytes] = []
        """16-byte frames to send."""
        self.accepts: frozenset[int] = frozenset()
        """CAN identifiers (with flags) that concern this node now."""

    def receive(self, frame: bytes, now: float) -> None:
        """Take a frame (16 bytes, struct can_frame) seen on the bus."""

    def advance(self, now: float) -> None:
        """Run what was due until `now`."""

    def next_event(self) -> float:
        """Bus time at which `advance` should be called at the latest, math.inf if none."""
        return 0.0

    def emergency(self, code: int, register_bits: int, vendor: bytes = b"") -> None:
        """Report an error: EMCY frame, 1001h (bit 0 is added), 1003h; nothing while it stands."""

    def emergency_clear(self, code: int | None = None) -> None:
        """Take back one error, or all; sends the EMCY error reset if there was any."""

    def trigger_tpdo(self, number: int) -> None:
        """Send an event-driven TPDO (number from 1) for a reason of the application's own."""

    def set_nmt_state(self, state: NmtState) -> None:
        """Change the NMT state for a reason of the application's own (6007h)."""

    def close(self) -> None:
        """End; nothing is held open."""


SyncHandler = Callable[[bytes, float], None]
