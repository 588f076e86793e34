"""COB-IDs of the predefined connection set (CiA 301) and the type of frame handlers."""

from __future__ import annotations

from collections.abc import Callable

FRAME_HEAD = "<IB3x"
"""Identifier and length; the kernel's structure is in host order, little endian on all hosts
this runs on, which lets one `struct` call pack head and data."""

NMT_COMMAND = 0x000
EMCY = 0x080
SDO_RESPONSE = 0x580
SDO_REQUEST = 0x600
ERROR_CONTROL = 0x700
LSS_MASTER = 0x7E5
LSS_SLAVE = 0x7E4

Handler = Callable[[bytes, float], None]
"""Takes a frame and the bus time (s) it was seen at."""


def is_restricted(identifier: int) -> bool:
    """Whether CiA 301 keeps an identifier for other services (or it is no 11-bit one)."""
    return (
        identifier > 0x7FF
        or identifier <= 0x07F
        or 0x101 <= identifier <= 0x180
        or 0x581 <= identifier <= 0x5FF
        or 0x601 <= identifier <= 0x67F
        or 0x6E0 <= identifier <= 0x6FF
        or identifier >= 0x701
    )
