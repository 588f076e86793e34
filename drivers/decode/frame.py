"""One CAN frame with the time it was seen, as all decoding takes it."""

from __future__ import annotations

from typing import NamedTuple

from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG

EFF_MASK = 0x1FFFFFFF
SFF_MASK = 0x7FF
_MOST_BYTES = 8


class Frame(NamedTuple):
    """A classic CAN frame; `time_s` counts from the epoch in whole microseconds."""

    time_s: float
    can_id: int
    """Identifier without flags; of an error frame the error classes of Linux."""
    data: bytes
    extended: bool = False
    remote: bool = False
    error: bool = False
    length: int = 0
    """Length that a remote frame asks for; 0 in others."""

    @classmethod
    def unpack(cls, time_s: float, packet: bytes | bytearray) -> Frame:
        """Return the frame in a 16-byte `struct can_frame`; a length above 8 counts as 8."""
        word, length, data = FRAME.unpack(packet)
        length = min(length, _MOST_BYTES)
        error = bool(word & ERR_FLAG)
        # the other flags mean nothing in an error frame
        remote = bool(word & RTR_FLAG) and not error
        extended = bool(word & EFF_FLAG) and not error
        return cls(
            round(time_s, 6),
            word & (EFF_MASK if extended or error else SFF_MASK),
            b"" if remote else data[:length],
            extended,
            remote,
            error,
            length if remote else 0,
        )

    def pack(self) -> bytes:
        """Return the frame as a 16-byte `struct can_frame`."""
        word = self.can_id
        word |= EFF_FLAG if self.extended else 0
        word |= RTR_FLAG if self.remote else 0
        word |= ERR_FLAG if self.error else 0
        return FRAME.pack(word, self.length or len(self.data), self.data)

    @property
    def id_text(self) -> str:
        """The identifier as CAN tools write it: 3 hexadecimal digits, 8 with 29 bits."""
        return f"{self.can_id:08X}" if self.extended or self.error else f"{self.can_id:03X}"
