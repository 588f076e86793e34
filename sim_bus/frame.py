"""CAN frames as the bus carries them: packing, order of arbitration, time on the wire."""

from __future__ import annotations

import struct

FRAME_BYTES = 16
EFF_FLAG = 0x80000000
RTR_FLAG = 0x40000000
ERR_FLAG = 0x20000000
SFF_MASK = 0x7FF
EFF_MASK = 0x1FFFFFFF

FRAME = struct.Struct("=IB3x8s")
"""`struct can_frame` of Linux: identifier with flags, length, data."""
HEADER = struct.Struct("=IB")

SYNC_ID = 0x080


def pack_frame(can_id: int, data: bytes = b"") -> bytes:
    """Return a data frame of 16 bytes; `can_id` carries the flags."""
    return FRAME.pack(can_id, len(data), data)


def worst_case_bits(n: int, *, extended: bool = False) -> int:
    """Return the bits a frame with `n` data bytes can take at most, interframe space included.

    From start of frame to the CRC a stuff bit may follow after the first 4 bits and then after
    every 4 more (each stuff bit starts the next run of five); 13 bits (CRC delimiter,
    acknowledge, end of frame, interframe space) are never stuffed. ISO 11898-1, and Davis et al.,
    "Controller Area Network (CAN) schedulability analysis", Real-Time Systems 35 (2007).
    """
    stuffed = (54 if extended else 34) + 8 * n
    return stuffed + 13 + (stuffed - 1) // 4


SFF_BITS = tuple(worst_case_bits(n) for n in range(9))
EFF_BITS = tuple(worst_case_bits(n, extended=True) for n in range(9))
SFF_REMOTE_BITS = (SFF_BITS[0],) * 9
EFF_REMOTE_BITS = (EFF_BITS[0],) * 9
LONGEST_FRAME_BITS = EFF_BITS[8]


def bits_by_length(can_id: int) -> tuple[int, ...]:
    """Return the worst-case bits for lengths 0 to 8 of frames with this identifier."""
    if can_id & RTR_FLAG:
        return EFF_REMOTE_BITS if can_id & EFF_FLAG else SFF_REMOTE_BITS
    return EFF_BITS if can_id & EFF_FLAG else SFF_BITS


def arbitration_key(can_id: int) -> int:
    """Return a number that orders frames as arbitration does: the smallest wins the bus.

    The 11 leading bits of the identifier go first; at equal leading bits a standard data frame
    beats a standard remote frame, which beats the extended ones (recessive SRR and IDE bits).
    """
    remote = 1 if can_id & RTR_FLAG else 0
    if can_id & EFF_FLAG:
        low = can_id & 0x3FFFF
        return ((can_id & EFF_MASK) >> 18) << 21 | 1 << 20 | low << 1 | remote
    return (can_id & SFF_MASK) << 21 | remote << 19


def base_id(can_id: int) -> int:
    """Return the 11 leading bits of an identifier, standard or extended."""
    return (can_id & EFF_MASK) >> 18 if can_id & EFF_FLAG else can_id & SFF_MASK
