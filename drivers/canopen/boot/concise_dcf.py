"""Concise DCF: what is to be written into one device, as CiA 302 keeps it in 1F22h."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass

from cdpr_drivers.errors import DriverError

_COUNT = struct.Struct("<I")
_HEAD = struct.Struct("<HBI")


class ConciseDcfError(DriverError):
    """Bytes that are no concise DCF; says at which entry they go wrong."""


@dataclass(frozen=True)
class DcfEntry:
    """One object to write: index, sub-index and the data as SDO carries it."""

    index: int
    sub: int
    data: bytes

    @property
    def value(self) -> int:
        """The data as an unsigned integer."""
        return int.from_bytes(self.data, "little")


def encode(entries: Iterable[DcfEntry]) -> bytes:
    """Return `entries` as the DOMAIN of 1F22h: their number, then index, sub, size and data each.

    All numbers are little-endian (U32; U16, U8, U32).
    """
    parts = [_HEAD.pack(e.index, e.sub, len(e.data)) + e.data for e in entries]
    return _COUNT.pack(len(parts)) + b"".join(parts)


def decode(stream: bytes) -> tuple[DcfEntry, ...]:
    """Return the entries of a concise DCF; raises ConciseDcfError when it is damaged."""
    if len(stream) < _COUNT.size:
        raise ConciseDcfError(f"concise DCF: {len(stream)} bytes, too few for the entry count")
    (count,) = _COUNT.unpack_from(stream)
    at = _COUNT.size
    entries = []
    for number in range(1, count + 1):
        if len(stream) - at < _HEAD.size:
            raise ConciseDcfError(f"concise DCF: cut short in entry {number} of {count}")
        index, sub, size = _HEAD.unpack_from(stream, at)
        at += _HEAD.size
        if len(stream) - at < size:
            raise ConciseDcfError(
                f"concise DCF: entry {number} of {count} ({index:04X}h:{sub}) announces {size} "
                f"bytes, {len(stream) - at} follow"
            )
        entries.append(DcfEntry(index, sub, stream[at : at + size]))
        at += size
    if at != len(stream):
        raise ConciseDcfError(
            f"concise DCF: {len(stream) - at} bytes follow the last of {count} entries"
        )
    return tuple(entries)
