"""Fast path to a bus: packed 16-byte frames over a socket, in buffers allocated once."""

from __future__ import annotations

import math
import socket
import struct
import time
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.bus import simbus_socket
from drivers.bus.health import ERR_FLAG, BusHealth
from drivers.bus.simbus_socket import FRAME_BYTES, Filters
from drivers.bus.url import BusUrl
from drivers.errors import BusError

if TYPE_CHECKING:
    from collections.abc import Callable

Bytes = bytes | bytearray | memoryview

FRAME = struct.Struct("=IB3x8s")
"""`struct can_frame` of Linux: identifier with flags, length, data."""
FRAME_DTYPE = np.dtype([("can_id", "=u4"), ("length", "u1"), ("pad", "V3"), ("data", "u1", (8,))])
EFF_FLAG = 0x80000000
RTR_FLAG = 0x40000000

BUFFER_BYTES = 1 << 21
SEND_TIMEOUT_S = 1.0
"""How long `send` waits for room before it gives up."""

__all__ = [
    "BUFFER_BYTES", "EFF_FLAG", "ERR_FLAG", "FRAME", "FRAME_BYTES", "FRAME_DTYPE", "RTR_FLAG",
    "SEND_TIMEOUT_S", "Bytes", "FrameBuffer", "FramePort", "PackedPort", "open_simbus",
    "set_receive_timeout",
]  # fmt: skip


class FrameBuffer:
    """Room for `n` frames, seen as an array of bytes, as a structured one and as `n` views.

    `row_bytes` is more than 16 where other packets come between the frames.
    """

    def __init__(self, n: int, row_bytes: int = FRAME_BYTES) -> None:
        self.bytes: NDArray[np.uint8] = np.zeros((n, row_bytes), np.uint8)
        """Shape (n, row_bytes)."""
        self.rows: list[memoryview] = [memoryview(row.data) for row in self.bytes]
        """The writable views to hand to `send` and `recv_into`."""

    @property
    def array(self) -> NDArray[np.void]:
        """Shape (n,), fields can_id, length, data (8 bytes)."""
        frames: NDArray[np.void] = self.bytes[:, :FRAME_BYTES].view(FRAME_DTYPE)[:, 0]
        return frames


class FramePort(Protocol):
    """A bus as packed frames.

    `send` and `recv_into` raise OSError as sockets do, so that nothing stands between the cycle
    and the kernel: `BlockingIOError` when the time-out passed without a frame, any other OSError
    or a `recv_into` of 0 when the bus is gone; `lost` words that as a BusError.
    """

    url: BusUrl
    status: dict[str, Any]
    """What the simulated bus told about itself at opening; empty on other buses."""
    health: BusHealth
    """Where the port counts what it notices: a full transmit queue, frames it had no room for."""

    def send(self, frame: Bytes, /) -> int:
        """Send one 16-byte frame."""

    def recv_into(self, buffer: bytearray | memoryview, /) -> int:
        """Wait for a frame up to the time-out, write it into `buffer`, return its length."""

    def recv_waiting(self, buffer: bytearray | memoryview, /) -> int:
        """Write a frame that has come already into `buffer`, return its length; never wait."""

    def settimeout(self, seconds: float | None) -> None:
        """Limit the wait of `recv_into`; None waits for ever, 0 does not wait."""

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from some moment on."""

    def drain(self) -> int:
        """Throw away the frames that wait; return how many."""

    def arrival_s(self) -> float:
        """Return when the last frame came in: the kernel's stamp where it gives one, else now.

        Seconds since 1970, as `time.time()`.
        """

    def fileno(self) -> int:
        """Return the descriptor to poll for readability."""

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that tells why the bus cannot be used any more."""

    def close(self) -> None:
        """Leave the bus."""


class PackedPort:
    """Packed frames on a SEQPACKET socket; the one for raw CAN sockets is derived from it."""

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
        """Return the BusError that tells why the bus cannot be used any more."""
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
) -> PackedPort:
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
    return PackedPort(url, sock, status, health)
