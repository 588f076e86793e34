"""Leading simulated buses: their time goes on only as far as this process lets it."""

from __future__ import annotations

import contextlib
import json
import math
import socket
import struct
import time
from collections.abc import Iterable, Mapping
from typing import Any

from cdpr_rt.clock import Clock, LockstepClock, PacedClock
from drivers.bus.intake import Intake, leave_aside
from drivers.bus.packed import FRAME_BYTES, PackedPort
from drivers.bus.simbus_socket import connect, control_message
from drivers.bus.url import BusUrl
from drivers.errors import BusError

_GO, _TIME = b"bus-go\0\0", b"bus-time"
_LAYOUT = struct.Struct("<8sdd")
_CONTROL_BYTES = 65536
_ANSWER_TIMEOUT_S = 5.0
_MOST_STEPS = 10_000
_LAST_S = 0.01
"""In which the drives act on what was sent last, before their time stands."""
_LOST_S = 1e-3
"""What a wait takes of the wall when all buses are lost: it would keep the processor busy."""


class LedBus(Intake):
    """A simulated bus that this process leads; `docs/wire.md` has the packets.

    What it takes in comes in the bus' own order, up to the moment at which the bus has told its
    time; so a process that was held up, at either end, changes nothing. That it is lost is told to
    `failed` as well, once.
    """

    leads = True

    def __init__(self, port: PackedPort, now_s: float, next_s: float) -> None:
        super().__init__(port, _LAYOUT.size)
        self.now_s, self.next_s = now_s, next_s
        self.lent = self.gone = False
        self._ahead_s = 0.0
        """By how much its clock is ahead of the bus."""

    def put_ahead(self, now_s: float) -> None:
        """Have the time be `now_s` now, whatever the bus calls it."""
        self._ahead_s, self.next_s = now_s - self.now_s, now_s
        self.now_s = now_s

    def go(self, until_s: float) -> bool:
        """Have time go on to `until_s` or to a frame; see `cdpr_rt.clock.LedBus`."""
        try:
            self.port.send(_LAYOUT.pack(_GO, until_s - self._ahead_s, 0.0))
            return self.take_answers()
        except OSError as error:
            self.lost(error)
        except BusError:
            pass  # it has been told
        return False

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that tells why the bus is gone, which it is from now on."""
        told = super().lost(error)
        if not self.gone:
            self.gone = True
            self.failed(told)
        return told

    def take_answers(self) -> bool:
        """Take in all frames up to the next word on the time; return whether there were any.

        It follows the answers to each SYNC and each `go`. Raises BusError.
        """
        receive, rows, came = self.port.recv_into, self.frames.rows, False
        while True:
            last = size = 0
            try:
                for row in rows:
                    size = receive(row)
                    if size != FRAME_BYTES:
                        break
                    last += 1
            except OSError as error:
                raise self.lost(error) from error
            if last:
                came = True
                self.take(last)
            if size != FRAME_BYTES:
                kind, now_s, next_s = _LAYOUT.unpack_from(rows[last])
                if size != _LAYOUT.size or kind != _TIME:
                    raise self.lost()
                self.now_s, self.next_s = now_s + self._ahead_s, next_s + self._ahead_s
                return came

    def poll(self) -> bool:
        """Return False: frames come with the time, or they would come by chance."""
        return False

    def settle(self) -> None:
        """Take in all that has been sent."""
        self.go(0.0)

    def close(self) -> None:
        """Give the bus back to the clock, which leads it further."""
        self.take, self.failed, self.lent = leave_aside, leave_aside, False
        with contextlib.suppress(OSError):
            self.port.set_filters([])

    def give_back(self) -> None:
        """Lead no longer: the bus' time stands until somebody else speaks there."""
        with contextlib.suppress(OSError):
            self.port.send(control_message({"lead": False}))
        self.port.close()


class LeadingClock(LockstepClock):
    """The time of simulated buses, by their URLs; they stand still while nobody waits."""

    def __init__(self, buses: Mapping[str, LedBus], *, real_time: bool = False) -> None:
        super().__init__(list(buses.values()), real_time=real_time)
        self._by_url = dict(buses)
        latest_s = max(bus.now_s for bus in buses.values())
        for bus in buses.values():
            for _ in range(_MOST_STEPS):
                if bus.now_s >= latest_s or bus.gone:
                    break
                bus.go(latest_s)

    def lend(self, url: BusUrl) -> LedBus | None:
        """Return the bus of that URL, None where it is none of these or somebody has it.

        One that was lost is looked for anew. Raises BusError where it is not there, or not to lead.
        """
        bus = self._by_url.get(str(url))
        if bus is None or bus.lent:
            return None
        if bus.gone:
            bus.port.close()
            bus = self._by_url[str(url)] = self._lead_anew(url)
        bus.lent = True
        return bus

    def _lead_anew(self, url: BusUrl) -> LedBus:
        connect(url.channel).close()  # tells that there is none
        bus = _lead(url)
        if bus is None:
            raise BusError(f"{url}: the bus has come back with another clock; begin anew")
        bus.put_ahead(self.now_s)
        self._buses.append(bus)
        return bus

    def _listen(self, until_s: float) -> None:
        super()._listen(until_s)
        if not self._buses:
            time.sleep(_LOST_S)

    def close(self) -> None:
        """Give the lead back, in order; if this process died, time would run with the wall."""
        super().close()
        self.sleep(_LAST_S)
        for bus in self._by_url.values():
            bus.give_back()


def open_clock(urls: Iterable[BusUrl], *, real_time: bool = False) -> Clock:
    """Return the clock of the robot on these buses.

    That of simulated buses in lockstep which nobody else leads is theirs, and this process leads
    them from now on, in `real_time` no faster than the wall; any other is CLOCK_MONOTONIC.
    """
    buses: dict[str, LedBus] = {}
    for url in urls:
        led = _lead(url)
        if led is None:
            for bus in buses.values():
                bus.give_back()
            return PacedClock()
        buses[str(url)] = led
    return LeadingClock(buses, real_time=real_time) if buses else PacedClock()


def _lead(url: BusUrl) -> LedBus | None:
    """Return the bus with this process as its leader, None where it cannot be."""
    if url.interface != "simbus":
        return None
    try:
        sock = connect(url.channel)
    except BusError:
        return None  # to be told by whoever needs the bus
    try:
        sock.settimeout(_ANSWER_TIMEOUT_S)
        sock.send(control_message({"filters": []}))
        sock.send(control_message({"lead": True}))
        told = _answer(sock)
    except (OSError, ValueError):
        told = None
    if told is None:
        sock.close()
        return None
    port = PackedPort(url, sock, {"mode": "lockstep"})
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, bytes(16))
    next_s = told["next_s"]
    return LedBus(port, float(told["now_s"]), math.inf if next_s is None else float(next_s))


def _answer(sock: socket.socket) -> dict[str, Any] | None:
    while len(packet := sock.recv(_CONTROL_BYTES)) == FRAME_BYTES:
        continue  # from before the filters
    answer: dict[str, Any] | None = json.loads(packet).get("lead")
    return answer
