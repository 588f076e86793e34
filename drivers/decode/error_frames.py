"""Error frames, as a controller's driver on Linux reports trouble on the wire."""

from __future__ import annotations

# linux/can/error.h: classes in the identifier
_CLASSES = (
    (0x001, "transmit time-out"),
    (0x002, "arbitration lost"),
    (0x004, "controller"),
    (0x008, "protocol violation"),
    (0x010, "transceiver"),
    (0x020, "no acknowledge from any node (wiring, bit rate, or alone on the bus)"),
    (0x040, "bus-off"),
    (0x080, "bus error"),
    (0x100, "controller restarted after bus-off"),
)
_CONTROLLER = (
    (0x01, "receive overflow"),
    (0x02, "transmit overflow"),
    (0x04, "receive warning"),
    (0x08, "transmit warning"),
    (0x10, "receive error-passive"),
    (0x20, "transmit error-passive"),
    (0x40, "error-active again"),
)
_PROTOCOL = (
    (0x01, "single bit"),
    (0x02, "form"),
    (0x04, "stuffing"),
    (0x08, "dominant bit not sent"),
    (0x10, "recessive bit not sent"),
    (0x20, "overload"),
    (0x40, "active error announced"),
    (0x80, "on transmission"),
)
_COUNTERS = 0x200


def error_text(classes: int, data: bytes) -> str:
    """Return an error frame in words; `classes` is its identifier without flags."""
    data = data.ljust(8, b"\0")
    details = {0x004: _names(_CONTROLLER, data[1]), 0x008: _names(_PROTOCOL, data[2])}
    parts = []
    for bit, name in _CLASSES:
        if classes & bit:
            detail = details.get(bit)
            parts.append(f"{name}: {detail}" if detail else name)
    if classes & _COUNTERS:
        parts.append(f"error counters: transmit {data[6]}, receive {data[7]}")
    return "; ".join(parts) or f"classes {classes:08X}h"


def _names(table: tuple[tuple[int, str], ...], value: int) -> str:
    return ", ".join(name for bit, name in table if value & bit)
