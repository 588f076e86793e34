"""Emergency messages (CiA 301): their text, a log, and the errors that are still active."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass

from cdpr_drivers.cia402 import fault_text

LENGTH = 8
_LAYOUT = struct.Struct("<HB5s")
_KEPT = 256
_FLOOD, _FLOOD_WINDOW_S = 100, 1.0
"""More messages than this from one node within the window are a flood."""
_REGISTER_BITS = (
    "generic",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile",
    "reserved",
    "manufacturer",
)


def register_text(register: int) -> str:
    """Return the classes of error in an error register (1001h), as text."""
    words = [name for bit, name in enumerate(_REGISTER_BITS) if register >> bit & 1]
    return ", ".join(words) or "no error"


@dataclass(frozen=True)
class Emergency:
    """One EMCY message and its time of arrival."""

    node_id: int
    code: int
    register: int
    vendor: bytes
    at_s: float
    """Time of arrival, by the robot's clock."""

    @classmethod
    def from_frame(cls, node_id: int, data: bytes, at_s: float) -> Emergency:
        """Return the message in the 8 bytes of an EMCY frame received at `at_s`."""
        code, register, vendor = _LAYOUT.unpack(data)
        return cls(node_id, code, register, vendor, at_s)

    @property
    def is_reset(self) -> bool:
        """Whether the message reports that an error has cleared (error codes 00xxh)."""
        return not self.code >> 8

    @property
    def text(self) -> str:
        """The message without its sender."""
        what = "error reset" if self.is_reset else fault_text(self.code)
        text = f"{what}; error register {self.register:02X}h ({register_text(self.register)})"
        if any(self.vendor):
            text += f"; manufacturer {self.vendor.hex(' ').upper()}"
        return text

    def __str__(self) -> str:
        return f"node {self.node_id}: {self.text}"


@dataclass(frozen=True)
class ErrorRecord:
    """One entry of a node's own error history (1003h)."""

    code: int
    additional: int
    """The manufacturer's additional information."""

    def __str__(self) -> str:
        return fault_text(self.code)


class EmergencyLog:
    """Log of the emergency messages of one bus."""

    def __init__(self) -> None:
        self.kept: deque[Emergency] = deque(maxlen=_KEPT)
        """The last messages of all nodes, oldest first."""
        self._standing: dict[int, dict[int, Emergency]] = {}
        self._recent: dict[int, tuple[float, int]] = {}

    def add(self, emergency: Emergency) -> str:
        """Store a message; in a flood, return the number of messages and the last one, else ""."""
        self.kept.append(emergency)
        standing = self._standing.setdefault(emergency.node_id, {})
        if not emergency.is_reset:
            standing[emergency.code] = emergency
        else:
            # the register shows which classes of error remain; bit 0 stands for any of them
            remain = emergency.register & ~1
            for code in [c for c, e in standing.items() if not e.register & remain]:
                if remain or not emergency.register:
                    del standing[code]
        return self._flood(emergency)

    def forget(self, node_id: int) -> None:
        """Clear the active errors of a node that has restarted; the history is kept."""
        self._standing.pop(node_id, None)

    def standing(self, node_id: int) -> list[Emergency]:
        """Return the errors of a node that are still active, oldest first."""
        return list(self._standing.get(node_id, {}).values())

    def of(self, node_id: int) -> list[Emergency]:
        """Return the stored messages of one node, oldest first."""
        return [emergency for emergency in list(self.kept) if emergency.node_id == node_id]

    def _flood(self, emergency: Emergency) -> str:
        node_id = emergency.node_id
        since, count = self._recent.get(node_id, (emergency.at_s, 0))
        if emergency.at_s - since > _FLOOD_WINDOW_S:
            since, count = emergency.at_s, 0
        count += 1
        self._recent[node_id] = since, count
        if count <= _FLOOD:
            return ""
        return (
            f"{count} emergency messages within {_FLOOD_WINDOW_S:g} s, the last "
            f"{fault_text(emergency.code)}"
        )
