"""What comes in from one bus, read in batches and handed to whoever uses the bus."""

from __future__ import annotations

from collections.abc import Callable

from drivers.bus.packed import FRAME_BYTES, FrameBuffer, FramePort
from drivers.bus.simbus_socket import Filters
from drivers.errors import BusError

_FRAMES = 128
_MOST_PASSES = 8


def leave_aside(_: object) -> None:
    """Do nothing: nobody uses the bus."""


class Intake:
    """Reads the frames of a port; `take` is told in how many of the first `rows` they lie.

    Methods raise BusError when the bus is gone.
    """

    leads = False
    """Whether the bus' time goes on only as far as this process lets it."""

    def __init__(self, port: FramePort, row_bytes: int = FRAME_BYTES) -> None:
        self.port = port
        self.frames = FrameBuffer(_FRAMES, row_bytes)
        self.take: Callable[[int], None] = leave_aside
        self.failed: Callable[[BusError], None] = leave_aside
        """Told that the bus is gone, where no caller can be."""
        port.settimeout(None if self.leads else 0.0)

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that tells why the bus cannot be used any more."""
        return self.port.lost(error)

    def poll(self) -> bool:
        """Take in what waits, a buffer full at the most; return whether there was anything."""
        receive, last = self.port.recv_waiting, 0
        try:
            for row in self.frames.rows:
                if not receive(row):
                    raise self.lost()
                last += 1
        except BlockingIOError:
            pass
        except OSError as error:
            raise self.lost(error) from error
        if last:
            self.take(last)
        return last > 0

    def settle(self) -> None:
        """Take in all that waits; what is left of a flood is thrown away."""
        for _ in range(_MOST_PASSES):
            if not self.poll():
                return
        self.port.drain()

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from some moment on."""
        try:
            self.port.set_filters(filters)
        except OSError as error:
            raise self.lost(error) from error

    def close(self) -> None:
        """Leave the bus."""
        self.port.close()
