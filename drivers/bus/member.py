"""One who takes part in a bus: its only port there, as a source of the robot's clock."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from cdpr_rt.clock import Clock
from drivers.bus import open_port
from drivers.bus.health import BusHealth
from drivers.bus.intake import Intake
from drivers.bus.leading import LeadingClock
from drivers.bus.packed import FRAME
from drivers.bus.simbus_socket import Filters
from drivers.bus.url import BusUrl
from drivers.errors import BusError


class BusMember(ABC):
    """Takes in frames whenever somebody waits by `clock`, which leads the bus where it can.

    Raises BusError when the bus cannot be opened.
    """

    def __init__(self, url: BusUrl, clock: Clock, filters: Filters) -> None:
        self.url = url
        self.clock = clock
        self.health = BusHealth()
        """What the controller's error frames tell of the wire."""
        self.intake = self._open(filters)
        self.intake.take = self.take
        self.intake.failed = self._lose
        clock.add(self)

    def _open(self, filters: Filters) -> Intake:
        clock = self.clock
        led = clock.lend(self.url) if isinstance(clock, LeadingClock) else None
        if led is None:
            return Intake(open_port(self.url, filters, self.health, hears_errors=True))
        led.set_filters(filters)
        led.settle()  # what is under way still is nobody's
        return led

    # -- as a source of the clock

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self.intake.port.fileno()

    def poll(self) -> bool:
        """Take in what has come; a bus that is lost is listened to no more."""
        try:
            return self.intake.poll()
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
        """Take the first `last` frames of the intake."""
        for row in self.intake.frames.rows[:last]:
            self.take_frame(row)

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises BusError."""
        self.send_frame(FRAME.pack(identifier, len(data), data))

    def send_frame(self, frame: bytes) -> None:
        """Send one packed frame; raises BusError."""
        try:
            self.intake.port.send(frame)
        except OSError as error:
            raise self.intake.lost(error) from error

    def close(self) -> None:
        """Leave the bus; a bus that is lost is no error here, nor is a second time."""
        self.clock.remove(self)
        self.intake.close()
