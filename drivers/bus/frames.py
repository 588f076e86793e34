"""CAN frames of 16 bytes as Linux lays them out, buffers of them, and the interface of a port."""

from __future__ import annotations

import struct
from collections.abc import MutableSequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.bus.adapters.simbus_socket import FRAME_BYTES, Filters
from cdpr_drivers.bus.health import ERR_FLAG, BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

Bytes = bytes | bytearray | memoryview

FRAME = struct.Struct("=IB3x8s")
"""`struct can_frame` of Linux: identifier with flags, length, data."""
FRAME_DTYPE = np.dtype([("can_id", "=u4"), ("length", "u1"), ("pad", "V3"), ("data", "u1", (8,))])
EFF_FLAG = 0x80000000
RTR_FLAG = 0x40000000

HEAD_BYTES = 24
"""Of a packet of the simulated bus that has several frames."""
BUFFER_BYTES = 1 << 21
SEND_TIMEOUT_S = 1.0
"""How long `send` waits for room before it gives up."""

__all__ = [
    "BUFFER_BYTES", "EFF_FLAG", "ERR_FLAG", "FRAME", "FRAME_BYTES", "FRAME_DTYPE", "HEAD_BYTES",
    "RTR_FLAG", "SEND_TIMEOUT_S", "Batch", "Bytes", "FrameBuffer", "FramePort",
]  # fmt: skip


class FrameBuffer:
    """Buffer of `n` frames: an array of bytes, a structured one and `n` views of the same memory.

    Before the frames there is room for the head of a packet that has all of them.
    """

    def __init__(self, n: int) -> None:
        memory = np.zeros(HEAD_BYTES + n * FRAME_BYTES, np.uint8)
        self.packet: memoryview = memoryview(memory.data)
        """Head and frames."""
        self.bytes: NDArray[np.uint8] = memory[HEAD_BYTES:].reshape(n, FRAME_BYTES)
        """Shape (n, 16)."""
        self.rows: list[memoryview] = [memoryview(row.data) for row in self.bytes]
        """The writable views to hand to `send` and `recv_into`."""

    @property
    def array(self) -> NDArray[np.void]:
        """Shape (n,), fields can_id, length, data (8 bytes)."""
        frames: NDArray[np.void] = self.bytes.view(FRAME_DTYPE)[:, 0]
        return frames


class Batch(Protocol):
    """Sends and receives the rows of a `FrameBuffer` together; raises OSError as a port does."""

    @property
    def lengths(self) -> MutableSequence[int]:
        """Length of the packet received into each row, 0 where the other side has closed."""

    def send(self) -> None:
        """Send all rows."""

    def receive(self) -> int:
        """Fill the first rows with what has come, without waiting; return how many."""


class FramePort(Protocol):
    """A bus as 16-byte frames (`struct can_frame`).

    `send` and `recv_into` raise OSError as sockets do, so that nothing stands between the cycle
    and the kernel: `BlockingIOError` when the time-out passed without a frame, any other OSError
    or a `recv_into` of 0 when the bus is gone; `lost` words that as a BusError.
    """

    url: BusUrl
    status: dict[str, Any]
    """Status of the simulated bus at opening; empty on other buses."""
    health: BusHealth
    """Counts what the port notices: a full transmit queue, frames it had no room for."""

    def send(self, frame: Bytes, /) -> int:
        """Send one 16-byte frame."""

    def recv_into(self, buffer: bytearray | memoryview, /) -> int:
        """Wait for a frame up to the time-out, write it into `buffer`, return its length."""

    def recv_waiting(self, buffer: bytearray | memoryview, /) -> int:
        """Write a frame that has come already into `buffer`, return its length; never wait."""

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that sends or receives the rows of `frames`."""

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
        """Return the BusError with the reason why the bus cannot be used any more."""

    def close(self) -> None:
        """Leave the bus."""
