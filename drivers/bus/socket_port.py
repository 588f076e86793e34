"""A frame port on a socket: the fast path to a bus."""

from __future__ import annotations

import math
import socket
import struct
import time
from collections.abc import Callable
from typing import Any

from cdpr_drivers.bus.adapters import simbus_socket
from cdpr_drivers.bus.adapters.simbus_socket import FRAME_BYTES, Filters
from cdpr_drivers.bus.batch import KernelBatch, SingleFrameBatch
from cdpr_drivers.bus.frames import BUFFER_BYTES, SEND_TIMEOUT_S, Batch, Bytes, FrameBuffer
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError


class SocketPort:
    """A `FramePort` on a SEQPACKET socket; those of other sockets are derived from it."""

    def __init__(
        self,
        url: BusUrl,
        sock: socket.socket,
        status: dict[str, Any],
        health: BusHealth | None = None,
    ) -> None:
        self.url = url
        self.status = status
        self.health = health if health is not None else BusHealth()
        self._sock = sock
        self._scratch = bytearray(FRAME_BYTES)
        timeval = struct.pack("ll", int(SEND_TIMEOUT_S), 0)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)
        self.recv_into: Callable[[bytearray | memoryview], int] = sock.recv_into
        self.fileno: Callable[[], int] = sock.fileno
        self.close: Callable[[], None] = sock.close
        self.send: Callable[[Bytes], int] = sock.send

    def recv_waiting(self, buffer: bytearray | memoryview, /) -> int:
        """Write a frame that has come already into `buffer`, return its length; never wait."""
        return self._sock.recv_into(buffer, FRAME_BYTES, socket.MSG_DONTWAIT)

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that sends or receives the rows of `frames`."""
        # a system call of Python's own socket costs less than one from compiled code
        one = len(frames.rows) == 1
        return SingleFrameBatch(self, frames) if one else KernelBatch(self, frames)

    def settimeout(self, seconds: float | None) -> None:
        """Limit the wait of `recv_into`; None waits for ever, 0 does not wait.

        The kernel keeps the time (SO_RCVTIMEO), which saves the poll that a socket time-out of
        Python's would put before each receive.
        """
        self._sock.setblocking(seconds != 0)
        set_receive_timeout(self._sock, seconds)

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from some moment on."""
        simbus_socket.set_filters(self._sock, filters)

    def drain(self) -> int:
        """Throw away the frames that wait; return how many."""
        count = 0
        try:
            while self._sock.recv_into(self._scratch, FRAME_BYTES, socket.MSG_DONTWAIT):
                count += 1
        except BlockingIOError:
            pass
        return count

    def arrival_s(self) -> float:
        """Return the time now: these sockets keep no time of arrival."""
        return time.time()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError with the reason why the bus cannot be used any more."""
        if isinstance(error, BlockingIOError):
            return BusError(f"{self.url}: the bus takes or gives no frames (time-out)")
        reason = (error.strerror or error) if error else "connection closed"
        return BusError(f"{self.url}: the bus has gone away ({reason})")


def set_receive_timeout(sock: socket.socket, seconds: float | None) -> None:
    """Have the kernel end the waits of a blocking socket; None and 0 end none."""
    fraction, whole = math.modf(seconds or 0.0)
    # 0 would mean for ever
    micro = max(int(fraction * 1e6), 1) if seconds else 0
    timeval = struct.pack("ll", int(whole), micro)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)


def open_simbus(
    url: BusUrl, filters: Filters | None, health: BusHealth | None = None
) -> SocketPort:
    """Join the simulated bus `url`.

    Raises:
        BusError: no such bus runs, or it refused.
    """
    sock = simbus_socket.connect(url.channel)
    try:
        status = simbus_socket.exchange(sock, filters)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
    except BaseException:
        sock.close()
        raise
    return SocketPort(url, sock, status, health)
