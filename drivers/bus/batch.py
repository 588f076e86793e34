"""Batches of frames in one system call: sendmmsg and recvmmsg of Linux."""

from __future__ import annotations

import errno
import os
from collections.abc import MutableSequence
from typing import Any

import numpy as np
from numba import types

from cdpr_drivers.bus.frames import FrameBuffer, FramePort
from cdpr_rt.jit import jit_unlocked

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
    """Return how many were sent, or less than 0."""
    return int(_send(descriptor, messages, n, 0))


@jit_unlocked
def _receive_all(descriptor: int, messages: int, n: int, flags: int) -> int:
    """Return how many have come, or -errno."""
    came = _receive(descriptor, messages, n, flags, 0)
    return int(came if came >= 0 else -_errno()[0])


class KernelBatch:
    """Sends or receives all rows of a buffer through a port's socket in one system call."""

    def __init__(self, port: FramePort, frames: FrameBuffer) -> None:
        self._port = port
        self._rows = frames.rows
        n, size = frames.bytes.shape
        vectors, messages = np.zeros(n, _VECTOR), np.zeros(n, _MESSAGE)
        vectors["base"] = frames.bytes.ctypes.data + size * np.arange(n)
        vectors["size"] = size
        messages["vectors"] = vectors.ctypes.data + _VECTOR.itemsize * np.arange(n)
        messages["vector_count"] = 1
        self._kept = frames.bytes, vectors, messages
        self.lengths: Any = messages.view(np.uint64).data[7::8]
        self._at = messages.ctypes.data
        # compiled here: descriptor -1 moves nothing
        _send_all(-1, self._at, 0)
        _receive_all(-1, self._at, 0, _DONTWAIT)

    def send(self) -> None:
        """See `Batch.send`; what the socket has no room for goes as the port sends it."""
        rows = self._rows
        sent = _send_all(self._port.fileno(), self._at, len(rows))
        if sent < len(rows):
            for row in rows[max(sent, 0) :]:
                self._port.send(row)

    def receive(self) -> int:
        """See `Batch.receive`."""
        came = _receive_all(self._port.fileno(), self._at, len(self._rows), _DONTWAIT)
        if came >= 0:
            return came
        if came == -errno.EAGAIN:
            return 0
        raise OSError(-came, os.strerror(-came))


class SingleFrameBatch:
    """The same, one call of the port for each row: for ports that do more than their socket."""

    def __init__(self, port: FramePort, frames: FrameBuffer) -> None:
        self._port = port
        self._rows = frames.rows
        self.lengths: MutableSequence[int] = [0] * len(frames.rows)

    def send(self) -> None:
        """See `Batch.send`."""
        for row in self._rows:
            self._port.send(row)

    def receive(self) -> int:
        """See `Batch.receive`."""
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
