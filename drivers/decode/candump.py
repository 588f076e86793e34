"""CAN frames with their time, and reading and writing candump log files (`candump -l`, `-L`)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from cdpr_drivers.bus.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, FRAME, RTR_FLAG, SFF_MASK
from cdpr_drivers.errors import DriverError

_MOST_BYTES = 8


class Frame(NamedTuple):
    """A classic CAN frame; `time_s` counts from the epoch in whole microseconds."""

    time_s: float
    can_id: int
    """Identifier without flags; in an error frame, the error classes of Linux."""
    data: bytes
    extended: bool = False
    remote: bool = False
    error: bool = False
    length: int = 0
    """Length that a remote frame requests; 0 in other frames."""

    @classmethod
    def unpack(cls, time_s: float, packet: bytes | bytearray) -> Frame:
        """Return the frame in a 16-byte `struct can_frame`; a length above 8 counts as 8."""
        word, length, data = FRAME.unpack(packet)
        length = min(length, _MOST_BYTES)
        error = bool(word & ERR_FLAG)
        # the other flags have no meaning in an error frame
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


_LINE = re.compile(
    r"\((?P<time>[0-9]{1,12}(?:\.[0-9]{1,12})?)\)\s+(?P<channel>\S+)\s+"
    r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#"
    r"(?:(?P<remote>[Rr])(?P<length>[0-8]?)|(?P<data>(?:[0-9A-Fa-f]{2}){0,8}))"
    r"(?:_[0-9A-Fa-f])?(?:\s+[RTrt])?"
)
_CAN_FD = re.compile(r"\S+\s+\S+\s+[0-9A-Fa-f]+##")
_SHOWN_CHARS = 60


class LogError(DriverError):
    """A log file cannot be read; the message names file and line."""


class LogEntry(NamedTuple):
    """A frame of a log file, with the name of its bus."""

    channel: str
    frame: Frame


def format_line(channel: str, frame: Frame) -> str:
    """Return the line that `candump -L` writes for a frame, without the end of line."""
    if frame.error:
        content = f"{frame.can_id | ERR_FLAG:08X}#{frame.data.hex().upper()}"
    elif frame.remote:
        content = f"{frame.id_text}#R{frame.length or ''}"
    else:
        content = f"{frame.id_text}#{frame.data.hex().upper()}"
    return f"({frame.time_s:017.6f}) {channel} {content}"


def parse_line(text: str) -> LogEntry:
    """Parse a line; raises ValueError with the reason."""
    match = _LINE.fullmatch(text.strip())
    if match is None:
        if _CAN_FD.match(text.strip()):
            raise ValueError("is a CAN FD frame, which CANopen does not use")
        shown = text.strip()[:_SHOWN_CHARS]
        raise ValueError(f"{shown!r} is not of the form (1699999999.123456) can0 123#DEADBEEF")
    identifier, wide = int(match["id"], 16), len(match["id"]) > 3
    error = wide and bool(identifier & ERR_FLAG)
    if not error and identifier > (EFF_MASK if wide else SFF_MASK):
        raise ValueError(f"the identifier {match['id']} has more than {29 if wide else 11} bits")
    frame = Frame(
        round(float(match["time"]), 6),
        identifier & EFF_MASK,
        bytes.fromhex(match["data"] or ""),
        wide and not error,
        match["remote"] is not None,
        error,
        int(match["length"] or 0),
    )
    return LogEntry(match["channel"], frame)


def read_log(name: str, lines: Iterable[str]) -> Iterator[LogEntry]:
    """Yield the frames of a log file; skip empty lines and comments.

    Ignore a last line without line end, which an interrupted logger leaves.

    Raises:
        LogError: a line is not a candump line; the message has `name` and the line's number.
    """
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            yield parse_line(line)
        except ValueError as error:
            if not line.endswith("\n") and number > 1:
                return
            raise LogError(f"{name}: line {number}: {error}") from None
