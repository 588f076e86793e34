"""A participant of a bus: one port, read whenever the robot's clock waits."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from cdpr_drivers.bus import open_port
from cdpr_drivers.bus.adapters.simbus_socket import Filters
from cdpr_drivers.bus.frame_reader import FrameReader
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.simulated_bus import SimulatedBusClock
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_rt.core.clock import Clock


class BusMember(ABC):
    """Base of what sends and receives frames on one bus; a source of `clock`.

    Frames come in whenever somebody waits by `clock`, which leads the bus where it can.

    Raises BusError when the bus cannot be opened.
    """

    def __init__(self, url: BusUrl, clock: Clock, filters: Filters) -> None:
        self.url = url
        self.clock = clock
        self.health = BusHealth()
        """State of the wire by the controller's error frames."""
        self.reader = self._open(filters)
        self.reader.take = self.take
        self.reader.on_failure = self._lose
        clock.add(self)

    def _open(self, filters: Filters) -> FrameReader:
        clock = self.clock
        led = clock.acquire(self.url) if isinstance(clock, SimulatedBusClock) else None
        if led is None:
            return FrameReader(open_port(self.url, filters, self.health, receive_errors=True))
        led.set_filters(filters)
        led.settle()  # discards what is still under way
        return led

    # -- as a source of the clock

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self.reader.port.fileno()

    def poll(self) -> bool:
        """Process the frames that have come; a bus that is lost is removed from the clock."""
        try:
            return self.reader.poll()
        except BusError as error:
            self._lose(error)
            return True

    def tick(self, now_s: float) -> float:  # noqa: ARG002  # nothing is due by itself
        """Return that nothing is ever due."""
        return math.inf

    def _lose(self, error: BusError) -> None:
        self.clock.remove(self)
        self.on_loss(error)

    # -- frames

    @abstractmethod
    def on_loss(self, error: BusError) -> None:
        """Take note that the bus is gone."""

    @abstractmethod
    def take_frame(self, frame: memoryview) -> None:
        """Take one frame that has come in."""

    def take(self, last: int) -> None:
        """Take the first `last` frames of the reader."""
        for row in self.reader.frames.rows[:last]:
            self.take_frame(row)

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises BusError."""
        self.send_frame(FRAME.pack(identifier, len(data), data))

    def send_frame(self, frame: bytes) -> None:
        """Send one packed frame; raises BusError."""
        try:
            self.reader.port.send(frame)
        except OSError as error:
            raise self.reader.lost(error) from error

    def close(self) -> None:
        """Leave the bus; a bus that is lost is no error here, nor is a second time."""
        self.clock.remove(self)
        self.reader.close()
