"""Log files of candump (`candump -l`, `-L`) in and out, without loss.

python-can's reader and writer of the same format drop the classes of error frames and the length
of remote frames, so they serve as an independent reference in the tests only.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from cdpr_drivers.bus.frames import ERR_FLAG
from cdpr_drivers.decode.frame import EFF_MASK, Frame
from cdpr_drivers.errors import DriverError

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
    """A frame of a log file, with the name of the bus it was on."""

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
            raise ValueError("is a CAN FD frame, which no CANopen bus carries")
        shown = text.strip()[:_SHOWN_CHARS]
        raise ValueError(f"{shown!r} is not of the form (1699999999.123456) can0 123#DEADBEEF")
    identifier, wide = int(match["id"], 16), len(match["id"]) > 3
    error = wide and bool(identifier & ERR_FLAG)
    if not error and identifier > (EFF_MASK if wide else 0x7FF):
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
    """Yield the frames of a log file; empty lines and comments are passed over.

    A last line without its end, which a logger leaves that was cut off, counts as not written.

    Raises:
        LogError: a line is no line of candump; the message has `name` and the line's number.
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
