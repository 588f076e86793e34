"""A serial CAN adapter (slcan) on a pseudo-terminal, as a member of the simulated bus.

A program of its own, `python -m cdpr_sim_bus.bus.adapters.serial_adapter NAME BITRATE`,
which ends with its standard input or with the bus. Killing it is pulling the adapter out.
"""

from __future__ import annotations

import os
import pty
import select
import sys
import time
import tty
from collections import deque

from cdpr_sim_bus.bus.adapters.gateway import join, raise_priority, receive_all, report
from cdpr_sim_bus.bus.adapters.lawicel import OVERRUN, RX_FULL, LawicelAdapter
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import FRAME_BYTES

LINE_BAUD = 1_000_000
"""Of the serial line, whatever the terminal is set to: about what USB adapters reach."""
_CHARACTER_S = 10 / LINE_BAUD
_QUEUED_FRAMES = 256
_READ_BYTES = 512
_AHEAD_S = 0.002
"""How far the host may be ahead of the line; further on, its writes wait as on a real port."""


class SerialAdapter:
    """The adapter between a pseudo-terminal and the bus; each character takes its time."""

    def __init__(self, name: str, bus_bitrate: int) -> None:
        self._bus = join(name)
        self._host, self._terminal = pty.openpty()
        # kept open, so that the adapter outlives the programs that use it
        tty.setraw(self._terminal)
        os.set_blocking(self._host, False)
        self.path = os.ttyname(self._terminal)
        self._adapter = LawicelAdapter(bus_bitrate, self._transmit)
        self._listening = False
        self._commands: deque[tuple[float, bytes]] = deque()
        self._answers: deque[tuple[float, bytes]] = deque()
        self._in_free_s = self._out_free_s = 0.0

    def run(self) -> None:
        """Serve until standard input ends or the bus goes away."""
        while True:
            now = time.monotonic()
            watched = [sys.stdin.fileno(), self._bus.fileno()]
            if self._in_free_s - now < _AHEAD_S:
                watched.append(self._host)
            ready, _, _ = select.select(watched, [], [], self._wait_s(now))
            if sys.stdin.fileno() in ready and not os.read(sys.stdin.fileno(), _READ_BYTES):
                return
            if self._bus.fileno() in ready and not self._take_frames():
                return
            now = time.monotonic()
            if self._host in ready:
                self._take_characters(now)
            while self._commands and self._commands[0][0] <= now:
                self._obey(self._commands.popleft()[1], now)
            while self._answers and self._answers[0][0] <= now:
                self._write(self._answers.popleft()[1])

    def _wait_s(self, now: float) -> float | None:
        due = [queue[0][0] for queue in (self._commands, self._answers) if queue]
        if self._in_free_s - now >= _AHEAD_S:
            due.append(self._in_free_s - _AHEAD_S / 2)
        return max(min(due) - now, 0.0) if due else None

    def _take_characters(self, now: float) -> None:
        data = os.read(self._host, _READ_BYTES)
        self._in_free_s = max(self._in_free_s, now)
        for line in self._adapter.lines(data):
            self._in_free_s += (len(line) + 1) * _CHARACTER_S
            self._commands.append((self._in_free_s, line))

    def _obey(self, line: bytes, now: float) -> None:
        self._send_text(self._adapter.obey(line), now)
        if self._adapter.on_bus != self._listening:
            self._listening = self._adapter.on_bus
            receive_all(self._bus, listen=self._listening)

    def _transmit(self, frame: bytes) -> bool:
        try:
            self._bus.send(frame)
        except BlockingIOError:
            return False
        return True

    def _take_frames(self) -> bool:
        """Pass on what came from the bus; return whether the bus is still there."""
        try:
            while packet := self._bus.recv(FRAME_BYTES):
                if not self._adapter.on_bus:
                    continue
                if len(self._answers) < _QUEUED_FRAMES:
                    self._send_text(self._adapter.text_of(packet, time.time()), time.monotonic())
                else:
                    self._adapter.flags |= RX_FULL | OVERRUN
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False

    def _send_text(self, text: bytes, now: float) -> None:
        self._out_free_s = max(self._out_free_s, now) + len(text) * _CHARACTER_S
        self._answers.append((self._out_free_s, text))

    def _write(self, text: bytes) -> None:
        try:
            os.write(self._host, text)
        except BlockingIOError:
            # not read: what the host has no room for is lost
            self._adapter.flags |= OVERRUN


def main() -> None:
    """Serve the bus and bit rate given as arguments, after reporting the terminal's path."""
    name, bitrate = sys.argv[1:]
    try:
        adapter = SerialAdapter(name, int(bitrate))
    except (BusSetupError, OSError) as error:
        report({"error": f"serial adapter: {error}"})
        return
    report({"path": adapter.path})
    raise_priority()
    adapter.run()


if __name__ == "__main__":
    main()
