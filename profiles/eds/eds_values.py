"""Data types and values of the objects of an EDS, checked."""

from __future__ import annotations

import math

from cdpr_profiles.eds.eds_text import Number, Remarks, Section, integer, number
from cdpr_profiles.errors import value_text

DOMAIN = 0x0F
_STRINGS = (0x09, 0x0B)
_OCTETS = (0x0A, DOMAIN)
_REALS = (0x08, 0x11)
INTEGER_BITS = {
    **{0x01: 1, 0x02: 8, 0x03: 16, 0x04: 32, 0x05: 8, 0x06: 16, 0x07: 32},
    **{0x10: 24, 0x12: 40, 0x13: 48, 0x14: 56, 0x15: 64},
    **{0x16: 24, 0x18: 40, 0x19: 48, 0x1A: 56, 0x1B: 64},
}
"""Size of the integer types of CiA 301, by their code."""
_SIGNED = (0x02, 0x03, 0x04, 0x10, 0x12, 0x13, 0x14, 0x15)
_OTHERS = (*_STRINGS, *_OCTETS, *_REALS, 0x0C, 0x0D)

Value = int | float | str


def data_type_of(section: Section, remarks: Remarks) -> int | None:
    """Return the type's code, that of plain bytes for an unknown one, None where there is none."""
    text = section.get("DataType")
    data_type = integer(text)
    if data_type is None or data_type < 1:
        remarks.add(
            section.place("DataType"),
            (f"value {value_text(text)}" if text else "is missing")
            + "; allowed: a type of CiA 301, 0x0001 to 0x001B; the object is left out",
        )
        return None
    if data_type in INTEGER_BITS or data_type in _OTHERS:
        return data_type
    remarks.add(
        section.place("DataType"),
        f"value {value_text(text)} is no type of CiA 301 (0x0001 to 0x001B); taken as plain bytes",
    )
    return DOMAIN


def limits(section: Section, data_type: int, remarks: Remarks) -> tuple[int | None, int | None]:
    """Return LowLimit and HighLimit of an integer, None where they are missing or make no sense."""
    if data_type not in INTEGER_BITS:
        return None, None
    low, high = (
        _integer_value(section, key, data_type, remarks)[0] if section.get(key) else None
        for key in ("LowLimit", "HighLimit")
    )
    if low is not None and high is not None and low > high:
        remarks.add(
            section.place("LowLimit"), f"value {low} is above HighLimit {high}; both left out"
        )
        return None, None
    return low, high


def value_of(
    section: Section, key: str, data_type: int, remarks: Remarks
) -> tuple[Value | None, bool]:
    """Return the value of a key as its type has it, and whether it counts from the node id."""
    text = section.get(key)
    if not text:
        return None, False
    if data_type in _STRINGS:
        return text, False
    if data_type not in (*_REALS, *_OCTETS):
        return _integer_value(section, key, data_type, remarks)
    found = _real(text) if data_type in _REALS else _octets(text)
    if found is None and data_type != DOMAIN:
        allowed = "a number" if data_type in _REALS else "pairs of hexadecimal digits"
        remarks.add(section.place(key), f"value {value_text(text)}; allowed: {allowed}; left out")
    return found, False


def _integer_value(
    section: Section, key: str, data_type: int, remarks: Remarks
) -> tuple[int | None, bool]:
    text = section.get(key)
    found = number(text)
    bits = INTEGER_BITS.get(data_type, 64)
    low, high = (-1 << bits - 1, (1 << bits - 1) - 1) if data_type in _SIGNED else (0, 2**bits - 1)
    if found is not None and data_type in _SIGNED and high < found.value < 1 << bits:
        found = Number(found.value - (1 << bits), found.relative)  # as its bits, in hexadecimal
    if found is not None and low <= found.value <= high:
        return found.value, found.relative
    allowed = f"{low} to {high}" if found else "a number as 10, 0x0A or $NODEID+0x180"
    remarks.add(section.place(key), f"value {value_text(text)}; allowed: {allowed}; left out")
    return None, False


def _real(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in text else None


def _octets(text: str) -> str | None:
    try:
        return bytes.fromhex(text).hex()
    except ValueError:
        return None
