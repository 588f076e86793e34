"""CANopen data types (CiA 301): how a value is laid out in bytes, little endian."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort

Value = int | float | str | bytes
"""What an object holds: integers and booleans as int, strings as str, domains as bytes."""

VISIBLE_STRING = 0x09
OCTET_STRING = 0x0A
UNICODE_STRING = 0x0B
DOMAIN = 0x0F


@dataclass(frozen=True, slots=True)
class Codec:
    """One data type: its size, its struct letter and the two conversions.

    `size` is None for types of any length; `letter` is empty where `struct` has none, and such
    an object cannot be mapped into a PDO.
    """

    size: int | None
    letter: str
    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Value]
    zero: Value
    low: int | None = None
    high: int | None = None


def _integer(size: int, signed: bool, letter: str = "") -> Codec:
    bits = 8 * size
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)

    def encode(value: int) -> bytes:
        return int(value).to_bytes(size, "little", signed=signed)

    def decode(data: bytes) -> int:
        return int.from_bytes(data, "little", signed=signed)

    return Codec(size, letter, encode, decode, 0, low, high)


def _real(letter: str) -> Codec:
    layout = struct.Struct("<" + letter)
    return Codec(layout.size, letter, layout.pack, lambda data: float(layout.unpack(data)[0]), 0.0)


def _decode_utf16(data: bytes) -> str:
    try:
        return data.decode("utf-16-le")
    except UnicodeDecodeError as error:
        raise SdoAbort(Abort.INVALID_VALUE) from error


_BYTES = Codec(None, "", bytes, bytes, b"")

CODECS: dict[int, Codec] = {
    0x01: Codec(1, "B", lambda value: bytes([bool(value)]), lambda data: data[0], 0, 0, 1),
    0x02: _integer(1, True, "b"),
    0x03: _integer(2, True, "h"),
    0x04: _integer(4, True, "i"),
    0x05: _integer(1, False, "B"),
    0x06: _integer(2, False, "H"),
    0x07: _integer(4, False, "I"),
    0x08: _real("f"),
    VISIBLE_STRING: Codec(
        None, "", lambda value: value.encode("latin-1"), lambda data: data.decode("latin-1"), ""
    ),
    OCTET_STRING: _BYTES,
    UNICODE_STRING: Codec(None, "", lambda value: value.encode("utf-16-le"), _decode_utf16, ""),
    0x0C: Codec(6, "", bytes, bytes, bytes(6)),
    0x0D: Codec(6, "", bytes, bytes, bytes(6)),
    DOMAIN: _BYTES,
    0x10: _integer(3, True),
    0x11: _real("d"),
    0x12: _integer(5, True),
    0x13: _integer(6, True),
    0x14: _integer(7, True),
    0x15: _integer(8, True, "q"),
    0x16: _integer(3, False),
    0x18: _integer(5, False),
    0x19: _integer(6, False),
    0x1A: _integer(7, False),
    0x1B: _integer(8, False, "Q"),
}
"""Codec by data type index (0001h to 001Bh)."""
