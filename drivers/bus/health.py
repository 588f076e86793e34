"""Error states and losses of a CAN controller, from its error frames."""

from __future__ import annotations

from enum import IntEnum

ERR_FLAG = 0x20000000
ALL_ERRORS = 0x1FFFFFFF
"""Mask for CAN_RAW_ERR_FILTER that passes every class of error frame."""

# classes of error frames and their details, from linux/can/error.h
_CONTROLLER, _PROTOCOL, _BUS_OFF, _RESTARTED, _COUNTERS = 0x004, 0x008, 0x040, 0x100, 0x200
_DISTURBED = 0x001 | _PROTOCOL | 0x010 | 0x020 | 0x080
"""Classes that count as errors; lost arbitration is normal on a bus."""
_RX_OVERFLOW, _TX_OVERFLOW = 0x01, 0x02
_WARNING, _PASSIVE, _ACTIVE = 0x04 | 0x08, 0x10 | 0x20, 0x40
_CLASSES = (
    (0x001, "transmit time-out"),
    (0x002, "arbitration lost"),
    (_CONTROLLER, "controller"),
    (_PROTOCOL, "protocol violation"),
    (0x010, "transceiver"),
    (0x020, "no acknowledge from any node (wiring, bit rate, or alone on the bus)"),
    (_BUS_OFF, "bus-off"),
    (0x080, "bus error"),
    (_RESTARTED, "controller restarted after bus-off"),
)
_DETAILS = {
    _CONTROLLER: (
        (_RX_OVERFLOW, "receive overflow, frames lost"),
        (_TX_OVERFLOW, "transmit overflow"),
        (0x04, "receive warning"),
        (0x08, "transmit warning"),
        (0x10, "receive error-passive"),
        (0x20, "transmit error-passive"),
        (_ACTIVE, "error-active again"),
    ),
    _PROTOCOL: (
        (0x01, "single bit"),
        (0x02, "form"),
        (0x04, "stuffing"),
        (0x08, "dominant bit not sent"),
        (0x10, "recessive bit not sent"),
        (0x20, "overload"),
        (0x40, "active error announced"),
        (0x80, "on transmission"),
    ),
}


def error_text(classes: int, data: bytes) -> str:
    """Return an error frame as text; `classes` is its identifier without flags."""
    data = data.ljust(8, b"\0")
    details = {_CONTROLLER: data[1], _PROTOCOL: data[2]}
    parts = []
    for bit, name in _CLASSES:
        if classes & bit:
            table = _DETAILS.get(bit, ())
            detail = ", ".join(word for mask, word in table if details[bit] & mask)
            parts.append(f"{name}: {detail}" if detail else name)
    if classes & _COUNTERS:
        parts.append(f"error counters: transmit {data[6]}, receive {data[7]}")
    return "; ".join(parts) or f"classes {classes:08X}h"


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

    Plain attributes, written by the reader of the bus; any thread may read them at any time.
    """

    def __init__(self) -> None:
        self.state = BusState.ACTIVE
        self.errors = 0
        """Error frames that reported a disturbed wire or controller."""
        self.tx_full = 0
        """Times the transmit queue had no room for a frame."""
        self.rx_lost = 0
        """Received frames that were lost; a report without a number counts as one."""
        self.bus_offs = 0
        """Times the controller went bus-off."""
        self.text = ""
        """The last error and the state; empty before the first error."""

    @property
    def usable(self) -> bool:
        """Whether frames can be sent; false while bus-off."""
        return self.state is not BusState.BUS_OFF

    def counts(self) -> dict[str, int]:
        """Return all counts that are not zero, by names for a status."""
        counts = {
            "error_frames": self.errors,
            "transmit_queue_full": self.tx_full,
            "frames_lost": self.rx_lost,
            "bus_off": self.bus_offs,
        }
        return {name: count for name, count in counts.items() if count}

    def take_error(self, can_id: int, data: bytes) -> bool:
        """Process an error frame: its class bits and its 8 bytes; return whether `state` changed.

        Missing bytes count as zeros, because some adapters send shorter data.
        """
        data = bytes(data[:8]).ljust(8, b"\0")
        overflow = data[1] & (_RX_OVERFLOW | _TX_OVERFLOW) if can_id & _CONTROLLER else 0
        self.rx_lost += bool(overflow & _RX_OVERFLOW)
        is_error = bool(can_id & _DISTURBED or overflow)
        self.errors += is_error
        reason = error_text(can_id, data) if is_error else ""
        before, self.state = self.state, self._reported_state(can_id, data[1])
        changed = self.state is not before
        self.bus_offs += changed and self.state is BusState.BUS_OFF
        if changed or reason:
            self.text = f"{self.state}: {reason}" if reason else str(self.state)
        return changed

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
        return BusState.ACTIVE if can_id & _RESTARTED else self.state

    def note_tx_full(self) -> None:
        """Count one frame that found the transmit queue full."""
        self.tx_full += 1
        self.text = f"{self.state}: transmit queue full"

    def note_rx_lost(self, reason: str, count: int = 1) -> None:
        """Count received frames that were lost."""
        self.rx_lost += count
        self.text = f"{self.state}: {reason}"
