"""Error states and losses of a CAN controller, from its error frames."""

from __future__ import annotations

from enum import IntEnum

ERR_FLAG = 0x20000000
ALL_ERRORS = 0x1FFFFFFF
"""Mask for CAN_RAW_ERR_FILTER that lets every class of error frame through."""

# classes of error frames and their details, from linux/can/error.h
_TX_TIMEOUT, _LOST_ARBITRATION, _CONTROLLER, _PROTOCOL = 0x001, 0x002, 0x004, 0x008
_TRANSCEIVER, _NO_ACK, _BUS_OFF, _BUS_ERROR = 0x010, 0x020, 0x040, 0x080
_RESTARTED, _COUNTERS = 0x100, 0x200
_RX_OVERFLOW, _TX_OVERFLOW = 0x01, 0x02
_WARNING, _PASSIVE, _ACTIVE = 0x04 | 0x08, 0x10 | 0x20, 0x40
_CLASSES = (
    (_TX_TIMEOUT, "transmission timed out"),
    (_PROTOCOL, "frame damaged on the wire"),
    (_TRANSCEIVER, "transceiver fault"),
    (_NO_ACK, "nobody acknowledges (cable, bit rate, power of the other nodes)"),
    (_BUS_ERROR, "bus error"),
)


class BusState(IntEnum):
    """Error state of a CAN controller (ISO 11898-1); higher is worse."""

    ACTIVE = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3

    def __str__(self) -> str:
        return ("error-active", "error-warning", "error-passive", "bus-off")[self]


class BusHealth:
    """State of the wire and counts of its errors; ports and the network of a bus may share one.

    Plain attributes, written by whoever reads the bus, read by anybody at any time.
    """

    def __init__(self) -> None:
        self.state = BusState.ACTIVE
        self.errors = 0
        """Error frames that reported a disturbed wire or controller."""
        self.tx_full = 0
        """Times the transmit queue had no room for a frame."""
        self.rx_lost = 0
        """Received frames that were lost; one for each report without a number."""
        self.bus_offs = 0
        """Times the controller went bus-off."""
        self.restarts = 0
        """Times the controller came back from bus-off."""
        self.counters = (0, 0)
        """Transmit and receive error counters, where the controller reports them."""
        self.text = ""
        """The last error in words, with the state; empty while there was none."""

    @property
    def usable(self) -> bool:
        """Whether frames can go out: false while bus-off."""
        return self.state is not BusState.BUS_OFF

    def counts(self) -> dict[str, int]:
        """Return what a status tells of them: all that are not zero, by names that people read."""
        counts = {
            "error_frames": self.errors,
            "transmit_queue_full": self.tx_full,
            "frames_lost": self.rx_lost,
            "bus_off": self.bus_offs,
        }
        return {name: count for name, count in counts.items() if count}

    def take_error(self, can_id: int, data: bytes) -> bool:
        """Process an error frame: its class bits and its 8 bytes; return whether `state` changed.

        Shorter data, as some adapters give, counts as zeros.
        """
        data = bytes(data[:8]).ljust(8, b"\0")
        words = [text for bit, text in _CLASSES if can_id & bit]
        if can_id & _COUNTERS:
            self.counters = data[6], data[7]
        if can_id & _CONTROLLER and data[1] & _RX_OVERFLOW:
            self.rx_lost += 1
            words.append("receive buffer of the controller overflowed: frames lost")
        if can_id & _CONTROLLER and data[1] & _TX_OVERFLOW:
            words.append("transmit buffer of the controller overflowed")
        # lost arbitration alone is how a bus works, counters alone are no trouble
        self.errors += bool(words)
        state = self._reported_state(can_id, data[1])
        before = self.state
        self.enter(state, ", ".join(words))
        return self.state is not before

    def _reported_state(self, can_id: int, detail: int) -> BusState:
        if can_id & _BUS_OFF:
            return BusState.BUS_OFF
        if can_id & _CONTROLLER:
            if detail & _PASSIVE:
                return BusState.PASSIVE
            if detail & _WARNING:
                return BusState.WARNING
            if detail & _ACTIVE:
                return BusState.ACTIVE
        if can_id & _RESTARTED:
            return BusState.ACTIVE
        return self.state

    def enter(self, state: BusState, reason: str = "") -> None:
        """Note that the controller is in `state`, and why where that is known."""
        if state is not self.state:
            self.bus_offs += state is BusState.BUS_OFF
            self.restarts += self.state is BusState.BUS_OFF
            self.state = state
        elif not reason:
            return
        self.text = f"{state}: {reason}" if reason else str(state)

    def note_tx_full(self) -> None:
        """Count one frame that found the transmit queue full."""
        self.tx_full += 1
        self.text = f"{self.state}: transmit queue full"

    def note_rx_lost(self, reason: str, count: int = 1) -> None:
        """Count received frames that were lost."""
        self.rx_lost += count
        self.text = f"{self.state}: {reason}"
