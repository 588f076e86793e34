"""CAN frames on the bus: packing, arbitration, time on the wire; and a log of all frames."""

from __future__ import annotations

import errno
import fcntl
import heapq
import math
import struct
import sys
from pathlib import Path

from cdpr_profiles.bounded_input import may_replace
from cdpr_profiles.errors import printable

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
    """Return the maximum number of bits of a frame with `n` data bytes, with interframe space.

    From start of frame to the CRC a stuff bit may follow after the first 5 bits and then after
    every 4 more, because each stuff bit starts the next run of five. 13 bits (CRC delimiter,
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
    """Return a number that orders frames by arbitration: the smallest wins the bus.

    The 11 leading bits of the identifier are sent first. If they are equal, a standard data frame
    beats a standard remote frame, and both beat extended frames (recessive SRR and IDE bits).
    """
    remote = 1 if can_id & RTR_FLAG else 0
    if can_id & EFF_FLAG:
        low = can_id & 0x3FFFF
        return ((can_id & EFF_MASK) >> 18) << 21 | 1 << 20 | low << 1 | remote
    return (can_id & SFF_MASK) << 21 | remote << 19


def base_id(can_id: int) -> int:
    """Return the 11 leading bits of an identifier, standard or extended."""
    return (can_id & EFF_MASK) >> 18 if can_id & EFF_FLAG else can_id & SFF_MASK


_WRITTEN_AT = 4096
_MOST_WAITING = 1 << 18


class FrameLog:
    """Writes its listeners' frames in order of bus time, then in the order of the buses.

    So the order does not depend on which bus the simulator polled first. If the file becomes
    unwritable, the log ends with a message and the buses continue.
    """

    def __init__(self, path: Path) -> None:
        """Create the file, replacing an earlier log; raises OSError.

        Times count from zero, so nobody can mistake the log for a recording in real time.
        """
        if not may_replace(path, b"(0000"):
            raise FileExistsError(errno.EEXIST, "exists and is not a log of a simulator")
        self._file = path.open("ab", buffering=0)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.is_file():
                self._file.truncate(0)
        except BlockingIOError:
            self._file.close()
            raise OSError(errno.EBUSY, "another simulator is writing to it") from None
        self._listeners: list[FrameListener] = []
        self._waiting = 0

    def listener(self, channel: str) -> FrameListener:
        """Return a listener for one more bus, called `channel` in the log."""
        listener = FrameListener(self, channel)
        self._listeners.append(listener)
        return listener

    def count(self) -> None:
        """Count one more waiting frame."""
        self._waiting += 1
        if self._waiting % _WRITTEN_AT == 0:
            # a bus that permanently lags behind the others must not fill the memory
            over = self._waiting >= _MOST_WAITING
            self._write(math.inf if over else min(listener.now_s for listener in self._listeners))

    def close(self) -> None:
        """Write the waiting frames and close the file; safe to repeat."""
        self._write(math.inf)
        self._file.close()

    def _write(self, before_s: float) -> None:
        """Write the frames before `before_s`; no bus can add earlier ones any more."""
        parts = [listener.take(before_s) for listener in self._listeners]
        self._waiting -= sum(map(len, parts))
        lines = heapq.merge(*parts, key=lambda entry: entry[0])
        data = memoryview(b"".join(_line(*entry) for entry in lines))
        try:
            while data and not self._file.closed:
                data = data[self._file.write(data) :]
        except OSError as error:
            name = printable(self._file.name)
            print(f"frame log {name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()


class FrameListener:
    """A node without an id that receives every frame of its bus and sends nothing."""

    node_id = 0
    sync_period_s = 0.0
    accepts = None

    def __init__(self, log: FrameLog, channel: str) -> None:
        self.outbox: list[bytes] = []
        self.now_s = 0.0
        """Bus time that the bus has reached."""
        self._log = log
        self._channel = channel.encode()
        self._frames: list[tuple[float, bytes, bytes]] = []

    def receive(self, frame: bytes, now: float) -> None:
        """Store a frame for the log."""
        self.now_s = now
        self._frames.append((now, self._channel, frame))
        self._log.count()

    def advance(self, now: float) -> None:
        """Store the bus time reached."""
        self.now_s = now

    def next_event(self) -> float:
        """Return infinity: no event is ever scheduled."""
        return math.inf

    def close(self) -> None:
        """Complete the log, because no frames follow."""
        self._log.close()

    def take(self, before_s: float) -> list[tuple[float, bytes, bytes]]:
        """Remove and return time, channel and frame of the frames before `before_s`."""
        frames = self._frames
        count = len(frames)
        while count and frames[count - 1][0] >= before_s:
            count -= 1
        self._frames = frames[count:]
        return frames[:count]


def _line(time_s: float, channel: bytes, frame: bytes) -> bytes:
    can_id, length, data = FRAME.unpack(frame)
    wide = can_id & EFF_FLAG
    identifier = b"%08X" % (can_id & EFF_MASK) if wide else b"%03X" % (can_id & SFF_MASK)
    if can_id & RTR_FLAG:
        content = b"R%d" % length if length else b"R"
    else:
        content = data[:length].hex().upper().encode()
    return b"(%017.6f) %s %s#%s\n" % (time_s, channel, identifier, content)
