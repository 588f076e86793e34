"""Frames of SDO transfers (CiA 301) as a client sends and matches them; no waiting."""

from __future__ import annotations

import struct
from typing import Final

REQUEST: Final = 0x600
ANSWER: Final = 0x580
"""Identifiers of requests and answers, plus the node id."""
UPLOAD, DOWNLOAD, BLOCK_UPLOAD = 2, 3, 6
"""What the top three bits of an answer to the first request say."""

_ABORT = 0x80
_TOGGLE_BIT = 4
_FIRST = struct.Struct("<BHB4s")
_LENGTH = 8


def multiplexer(index: int, sub: int) -> bytes:
    """Return the 3 bytes by which frames name an object."""
    return struct.pack("<HB", index, sub)


def request(command: int, index: int, sub: int, data: bytes = b"") -> bytes:
    """Return the first request of a transfer; `data` are the last 4 bytes, filled up with zeros."""
    return _FIRST.pack(command, index, sub, data)


def upload_request(index: int, sub: int) -> bytes:
    """Return the request for an object's value."""
    return request(0x40, index, sub)


def segment_request(toggle: int) -> bytes:
    """Return the request for the next segment of a value; `toggle` is 0 and 1 in turn."""
    return bytes([0x60 | toggle << _TOGGLE_BIT]) + bytes(7)


def abort_request(index: int, sub: int, code: int) -> bytes:
    """Return the frame that ends a transfer."""
    return request(_ABORT, index, sub, code.to_bytes(4, "little"))


def answers(frame: bytes, what: bytes, *kinds: int) -> bool:
    """Return whether a frame answers the first request for the object of this multiplexer."""
    return len(frame) == _LENGTH and frame[0] >> 5 in kinds and frame[1:4] == what


def is_segment(frame: bytes, kind: int, toggle: int) -> bool:
    """Return whether a frame is (0) or confirms (1) the segment of this toggle bit."""
    return len(frame) == _LENGTH and frame[0] >> 5 == kind and frame[0] >> _TOGGLE_BIT & 1 == toggle


def aborts(frame: bytes, what: bytes) -> bool:
    """Return whether a frame ends the transfer of this multiplexer's object, or names none."""
    known = len(frame) == _LENGTH and frame[0] == _ABORT
    return known and frame[1:4] in (what, bytes(len(what)))


def abort_code(frame: bytes) -> int | None:
    """Return the code of a frame that aborts a transfer, None for any other."""
    return int.from_bytes(frame[4:8], "little") if frame[0] == _ABORT else None


def expedited(frame: bytes) -> bytes | None:
    """Return the value in the answer to an upload request, None where it comes in segments."""
    if not frame[0] & 0x02:
        return None
    return frame[4 : 8 - (frame[0] >> 2 & 0x03) if frame[0] & 0x01 else 8]


def segment(frame: bytes) -> tuple[bytes, bool]:
    """Return what a segment holds, and whether it is the last."""
    return frame[1 : 8 - (frame[0] >> 1 & 0x07)], bool(frame[0] & 0x01)
