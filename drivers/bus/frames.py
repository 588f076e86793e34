"""CAN frames of 16 bytes as Linux lays them out, buffers of them, and the ports that carry them."""

from __future__ import annotations

import errno
import math
import os
import socket
import struct
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, MutableSequence
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from cdpr_drivers.bus.health import ERR_FLAG, BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_rt.jit import jit_unlocked

Bytes = bytes | bytearray | memoryview
Filters = Iterable[tuple[int, int]]
"""Pairs (identifier, mask); a frame passes if (frame id & mask) == (identifier & mask)."""

FRAME = struct.Struct("=IB3x8s")
"""`struct can_frame` of Linux: identifier with flags, length, data."""
FRAME_BYTES = FRAME.size
FRAME_DTYPE = np.dtype([("can_id", "=u4"), ("length", "u1"), ("pad", "V3"), ("data", "u1", (8,))])
EFF_FLAG, RTR_FLAG = 0x80000000, 0x40000000
EFF_MASK, SFF_MASK = 0x1FFFFFFF, 0x7FF

HEAD_BYTES = 24
"""Size of the header of a packet of the simulated bus with several frames."""
BUFFER_BYTES = 1 << 21
SEND_TIMEOUT_S = 1.0
"""Time that `send` waits for room before it raises."""

__all__ = [
    "BUFFER_BYTES", "EFF_FLAG", "EFF_MASK", "ERR_FLAG", "FRAME", "FRAME_BYTES", "FRAME_DTYPE",
    "HEAD_BYTES", "RTR_FLAG", "SEND_TIMEOUT_S", "SFF_MASK", "Batch", "Bytes", "Filters",
    "FrameBuffer", "FramePort", "FrameReader", "KernelBatch",
]  # fmt: skip


def passes(can_id: int, filters: Filters | None) -> bool:
    """Return whether a frame with this identifier, flags included, passes; None lets all pass."""
    if filters is None:
        return True
    return any((can_id & mask) == (filter_id & mask) for filter_id, mask in filters)


class FrameBuffer:
    """Buffer of `n` frames: an array of bytes, a structured one and `n` views of the same memory.

    The memory before the frames has room for the header of a packet that contains all of them.
    """

    def __init__(self, n: int) -> None:
        memory = np.zeros(HEAD_BYTES + n * FRAME_BYTES, np.uint8)
        self.packet: memoryview = memoryview(memory.data)
        """Header and frames."""
        self.bytes: NDArray[np.uint8] = memory[HEAD_BYTES:].reshape(n, FRAME_BYTES)
        """Shape (n, 16)."""
        self.rows: list[memoryview] = [memoryview(row.data) for row in self.bytes]
        """The writable views to hand to `send` and `recv_into`."""

    @property
    def array(self) -> NDArray[np.void]:
        """Shape (n,), fields can_id, length, data (8 bytes)."""
        frames: NDArray[np.void] = self.bytes.view(FRAME_DTYPE)[:, 0]
        return frames


class FramePort(ABC):
    """A bus as 16-byte frames (`struct can_frame`) on a socket.

    `send` and `recv_into` raise OSError as sockets do, so that no layer lies between the cycle and
    the kernel. `BlockingIOError` means that the timeout passed without a frame. Any other OSError,
    or 0 from `recv_into`, means that the bus is gone; `lost` turns that into a BusError.
    """

    def __init__(
        self,
        url: BusUrl,
        sock: socket.socket,
        health: BusHealth | None = None,
        status: dict[str, Any] | None = None,
    ) -> None:
        self.url = url
        self.status = status or {}
        """Status of the simulated bus at opening; empty on other buses."""
        self.health = health if health is not None else BusHealth()
        """Counts the events that the port notices: a full transmit queue, lost frames."""
        self._sock = sock
        self._scratch = bytearray(FRAME_BYTES)
        timeval = struct.pack("ll", int(SEND_TIMEOUT_S), 0)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)
        self.recv_into: Callable[[bytearray | memoryview], int] = sock.recv_into
        """Wait for a frame up to the timeout, write it into a buffer, and return its length."""
        self.fileno: Callable[[], int] = sock.fileno
        """Return the descriptor to poll for readability."""
        self.close: Callable[[], None] = sock.close
        self.send: Callable[[Bytes], int] = sock.send

    def recv_waiting(self, buffer: bytearray | memoryview, /) -> int:
        """Write a frame that has already arrived into `buffer`, return its length; never wait."""
        return self._sock.recv_into(buffer, FRAME_BYTES, socket.MSG_DONTWAIT)

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that sends or receives the rows of `frames`."""
        # a system call of Python's own socket costs less than one from compiled code
        return (Batch if len(frames.rows) == 1 else KernelBatch)(self, frames)

    def settimeout(self, seconds: float | None) -> None:
        """Limit the wait of `recv_into`; None waits indefinitely, 0 does not wait.

        The kernel measures the time (SO_RCVTIMEO). This saves the poll that a Python socket
        timeout would put before each receive.
        """
        self._sock.setblocking(seconds != 0)
        fraction, whole = math.modf(seconds or 0.0)
        # 0 would mean an unlimited wait
        micro = max(int(fraction * 1e6), 1) if seconds else 0
        timeval = struct.pack("ll", int(whole), micro)
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)

    @abstractmethod
    def set_filters(self, filters: Filters) -> None:
        """Receive only frames that pass one of `filters`; may take effect with a delay."""

    def drain(self) -> int:
        """Discard the waiting frames; return how many there were."""
        count = 0
        try:
            while self._sock.recv_into(self._scratch, FRAME_BYTES, socket.MSG_DONTWAIT):
                count += 1
        except BlockingIOError:
            pass
        return count

    def arrival_s(self) -> float:
        """Return when the last frame arrived, seconds since 1970: the kernel's stamp, or now."""
        return time.time()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that says why the bus is no longer usable."""
        if isinstance(error, BlockingIOError):
            return BusError(f"{self.url}: the bus accepts or delivers no frames (timeout)")
        reason = (error.strerror or error) if error else "connection closed"
        return BusError(f"{self.url}: the bus is lost ({reason})")


class Batch:
    """Sends and receives the rows of a buffer, with one call of the port for each row.

    Raises OSError as a port does.
    """

    def __init__(self, port: FramePort, frames: FrameBuffer) -> None:
        self._port = port
        self._rows = frames.rows
        self.lengths: MutableSequence[int] = [0] * len(frames.rows)
        """Length of the packet received into each row, 0 if the other side has closed."""

    def send(self, then: bytes = b"") -> None:
        """Send all rows, then the frame `then` if it is not empty."""
        for row in self._rows:
            self._port.send(row)
        if then:
            self._port.send(then)

    def receive(self) -> int:
        """Fill the first rows with frames that have arrived, without waiting; return how many."""
        came = 0
        try:
            for row in self._rows:
                self.lengths[came] = self._port.recv_waiting(row)
                came += 1
                if not self.lengths[came - 1]:
                    break
        except BlockingIOError:
            pass
        return came


# Batches of frames in one system call: sendmmsg and recvmmsg of Linux.

_DONTWAIT = 0x40
_VECTOR = np.dtype([("base", "<u8"), ("size", "<u8")])
"""`struct iovec` of a 64-bit system."""
_MESSAGE = np.dtype(
    [
        *(("name", "<u8"), ("name_size", "<u8"), ("vectors", "<u8"), ("vector_count", "<u8")),
        *(("control", "<u8"), ("control_size", "<u8"), ("flags", "<u8"), ("length", "<u8")),
    ]
)
"""`struct mmsghdr` of a 64-bit system, whose shorter fields are padded to 8 bytes."""

_send: Any = types.ExternalFunction(
    "sendmmsg", types.int32(types.int32, types.uintp, types.uint32, types.int32)
)
_receive: Any = types.ExternalFunction(
    "recvmmsg", types.int32(types.int32, types.uintp, types.uint32, types.int32, types.uintp)
)
_INT_POINTER: Any = types.CPointer(types.int32)  # type: ignore[no-untyped-call]
_errno: Any = types.ExternalFunction("__errno_location", _INT_POINTER())


@jit_unlocked
def _send_all(descriptor: int, messages: int, n: int) -> int:
    """Send `n` messages; return how many were sent, or a negative number."""
    return int(_send(descriptor, messages, n, 0))


@jit_unlocked
def _receive_all(descriptor: int, messages: int, n: int, flags: int) -> int:
    """Receive up to `n` messages; return how many have arrived, or -errno."""
    came = _receive(descriptor, messages, n, flags, 0)
    return int(came if came >= 0 else -_errno()[0])


class KernelBatch(Batch):
    """Sends or receives all rows of a buffer through a port's socket in one system call."""

    def __init__(self, port: FramePort, frames: FrameBuffer) -> None:
        super().__init__(port, frames)
        n, size = frames.bytes.shape
        vectors, messages = np.zeros(n, _VECTOR), np.zeros(n, _MESSAGE)
        vectors["base"] = frames.bytes.ctypes.data + size * np.arange(n)
        vectors["size"] = size
        messages["vectors"] = vectors.ctypes.data + _VECTOR.itemsize * np.arange(n)
        messages["vector_count"] = 1
        self._kept = frames.bytes, vectors, messages
        lengths: Any = messages.view(np.uint64).data[7::8]
        self.lengths = lengths
        self._at = messages.ctypes.data
        # compile now: with descriptor -1 the call transfers nothing
        _send_all(-1, self._at, 0)
        _receive_all(-1, self._at, 0, _DONTWAIT)

    def send(self, then: bytes = b"") -> None:
        """See `Batch.send`; the port sends rows that do not fit into the socket one by one."""
        rows = self._rows
        sent = _send_all(self._port.fileno(), self._at, len(rows))
        if sent < len(rows):
            for row in rows[max(sent, 0) :]:
                self._port.send(row)
        if then:
            self._port.send(then)

    def receive(self) -> int:
        """Fill the first rows with frames that have arrived, without waiting; return how many."""
        came = _receive_all(self._port.fileno(), self._at, len(self._rows), _DONTWAIT)
        if came >= 0:
            return came
        if came == -errno.EAGAIN:
            return 0
        raise OSError(-came, os.strerror(-came))


# Reads the frames of one bus in batches and hands them to a handler.

_FRAMES = 128
_MOST_PASSES = 8


def discard(_: object) -> None:
    """Ignore the argument, for a bus that nobody uses."""


class FrameReader:
    """Reads the frames of a port into `frames`; `take(n)` is called for its first n rows.

    Methods raise BusError when the bus is gone.
    """

    leads_time = False
    """Whether this process controls how far the bus' time advances."""

    def __init__(self, port: FramePort) -> None:
        self.port = port
        self.frames = FrameBuffer(_FRAMES)
        self._batch = port.batch(self.frames)
        self.take: Callable[[int], None] = discard
        self.on_failure: Callable[[BusError], None] = discard
        """Called if the bus is lost while no method of this object can raise the error."""
        port.settimeout(None if self.leads_time else 0.0)

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that says why the bus is no longer usable."""
        return self.port.lost(error)

    def poll(self) -> bool:
        """Process waiting frames, at most one buffer; return whether there were any."""
        try:
            last = self._batch.receive()
        except OSError as error:
            raise self.lost(error) from error
        if not last:
            return False
        if not self._batch.lengths[last - 1]:
            raise self.lost()
        self.take(last)
        return True

    def settle(self) -> None:
        """Process all waiting frames; in a flood, discard the rest."""
        for _ in range(_MOST_PASSES):
            if not self.poll():
                return
        self.port.drain()

    def set_filters(self, filters: Filters) -> None:
        """Receive only frames that pass one of `filters`; may take effect with a delay."""
        try:
            self.port.set_filters(filters)
        except OSError as error:
            raise self.lost(error) from error

    def close(self) -> None:
        """Leave the bus."""
        self.port.close()
