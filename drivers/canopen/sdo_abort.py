"""SDO abort codes in words (CiA 301, and those that CiA 302 and vendors' ranges add)."""

from __future__ import annotations

from typing import Final

TIMED_OUT: Final = 0x05040000
UNKNOWN_COMMAND: Final = 0x05040001
CRC: Final = 0x05040004
LENGTH: Final = 0x06070010
GENERAL: Final = 0x08000000
OUT_OF_MEMORY: Final = 0x05040005
NO_SUBINDEX: Final = 0x06090011
NO_DATA: Final = 0x08000024
ABSENT: Final = (0x06020000, NO_SUBINDEX, NO_DATA)
"""With which a node says that it has no such object, or nothing in it."""

_TEXTS: Final = {
    0x05030000: "toggle bit not alternated",
    0x05040000: "SDO protocol timed out",
    0x05040001: "command specifier not valid or unknown",
    0x05040002: "invalid block size",
    0x05040003: "invalid sequence number",
    0x05040004: "CRC error",
    0x05040005: "out of memory",
    0x06010000: "unsupported access to an object",
    0x06010001: "attempt to read a write only object",
    0x06010002: "attempt to write a read only object",
    0x06010003: "sub-index cannot be written, sub-index 0 must be 0 first",
    0x06010004: "complete access is not supported for this object",
    0x06020000: "object does not exist in the object dictionary",
    0x06040041: "object cannot be mapped to the PDO",
    0x06040042: "number and length of the objects to be mapped would exceed the PDO length",
    0x06040043: "general parameter incompatibility",
    0x06040047: "general internal incompatibility in the device",
    0x06060000: "access failed due to a hardware error",
    0x06070010: "data type does not match, length of service parameter does not match",
    0x06070012: "data type does not match, length of service parameter too high",
    0x06070013: "data type does not match, length of service parameter too low",
    0x06090011: "sub-index does not exist",
    0x06090030: "invalid value for parameter",
    0x06090031: "value of parameter written too high",
    0x06090032: "value of parameter written too low",
    0x06090036: "maximum value is less than minimum value",
    0x060A0023: "resource not available: SDO connection",
    0x08000000: "general error",
    0x08000020: "data cannot be transferred or stored to the application",
    0x08000021: "data cannot be transferred or stored because of local control",
    0x08000022: "data cannot be transferred or stored because of the present device state",
    0x08000023: "no object dictionary is present, or its dynamic generation failed",
    0x08000024: "no data available",
}
_GROUPS: Final = {
    0x0503: "toggle bit error",
    0x0504: "SDO protocol error",
    0x0601: "unsupported access",
    0x0602: "object does not exist",
    0x0604: "mapping or compatibility error",
    0x0606: "hardware error",
    0x0607: "length error",
    0x0609: "value error",
    0x060A: "resource not available",
    0x0800: "general error",
}


def abort_text(code: int) -> str:
    """Return an abort code in words, with the number."""
    text = _TEXTS.get(code)
    if text is None:
        group = _GROUPS.get(code >> 16)
        text = f"{group}, of a kind no standard names" if group else "a code no standard has"
    return f"{text} ({code:08X}h)"
