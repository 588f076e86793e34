"""Reads the frames of one bus in batches and hands them to a handler."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_drivers.bus.adapters.simbus_socket import Filters
from cdpr_drivers.bus.frames import FrameBuffer, FramePort
from cdpr_drivers.errors import BusError

_FRAMES = 128
_MOST_PASSES = 8


def discard(_: object) -> None:
    """Ignore what comes: nobody uses the bus."""


class FrameReader:
    """Reads the frames of a port into `frames`; `take(n)` is called for its first n rows.

    Methods raise BusError when the bus is gone.
    """

    leads_time = False
    """Whether the bus' time goes on only as far as this process lets it."""

    def __init__(self, port: FramePort) -> None:
        self.port = port
        self.frames = FrameBuffer(_FRAMES)
        self._batch = port.batch(self.frames)
        self.take: Callable[[int], None] = discard
        self.on_failure: Callable[[BusError], None] = discard
        """Called when the bus is lost while no method of this object can raise it."""
        port.settimeout(None if self.leads_time else 0.0)

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError with the reason why the bus cannot be used any more."""
        return self.port.lost(error)

    def poll(self) -> bool:
        """Process the frames that wait, up to one buffer; return whether there were any."""
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
        """Process all frames that wait; what is left of a flood is discarded."""
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
