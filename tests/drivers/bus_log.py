"""Record all frames on a simulated bus with a separate client."""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from cdpr_drivers.bus.simbus import connect, exchange

_FRAME = struct.Struct("=IB3x8s")
_SYNC = 0x080


@dataclass(frozen=True)
class Seen:
    """One frame. `cycle` counts the SYNCs before it, so that bus time is cycle x period."""

    cycle: int
    identifier: int
    data: bytes


class BusLog:
    """Frames in the order of the bus."""

    def __init__(self, bus: str) -> None:
        self.frames: list[Seen] = []
        self._sock = connect(bus.removeprefix("simbus:"))
        exchange(self._sock, None)
        self._sock.settimeout(0.05)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        cycle = 0
        while True:
            try:
                packet = self._sock.recv(64)
            except TimeoutError:
                if self._stop.is_set():
                    return
                continue
            if len(packet) != 16:
                return
            identifier, length, data = _FRAME.unpack(packet)
            cycle += identifier == _SYNC
            self.frames.append(Seen(cycle, identifier, data[:length]))

    def of(self, identifier: int) -> list[Seen]:
        return [frame for frame in list(self.frames) if frame.identifier == identifier]

    def close(self) -> None:
        """Record the frames still in flight, then disconnect."""
        self._stop.set()
        self._thread.join()
        self._sock.close()


@contextmanager
def logged(bus: str) -> Iterator[BusLog]:
    log = BusLog(bus)
    try:
        yield log
    finally:
        log.close()
