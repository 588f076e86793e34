"""Simulated buses whose time this process leads: it goes on only as far as granted here."""

from __future__ import annotations

import contextlib
import json
import math
import socket
import struct
import time
from collections.abc import Iterable, Mapping
from typing import Any, Final

from cdpr_drivers.bus.adapters.simbus_socket import connect, control_message
from cdpr_drivers.bus.batch import KernelBatch
from cdpr_drivers.bus.frame_reader import FrameReader, discard
from cdpr_drivers.bus.frames import FRAME_BYTES, HEAD_BYTES, Batch, FrameBuffer
from cdpr_drivers.bus.socket_port import SocketPort
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_rt.core.clock import Clock, LockstepClock, PacedClock

_GO, _TIME, _FRAMES = b"bus-go\0\0", b"bus-time", b"bus-data"
_TO_MASTER: Final = {_TIME, _FRAMES}
_LAYOUT = struct.Struct("<8sdd")
_CONTROL_BYTES = 65536
_MOST_FRAMES = 26
"""In a packet to the bus."""
_ANSWER_TIMEOUT_S = 5.0
_MOST_STEPS = 10_000
_LAST_S = 0.01
"""Bus time in which the drives act on the last commands before it stands still."""
_LOST_S = 1e-3
"""Wall time of a wait when all buses are lost, which would keep the processor busy."""


class LedPort(SocketPort):
    """A port on a bus that this process leads."""

    def __init__(self, url: BusUrl, sock: socket.socket) -> None:
        super().__init__(url, sock, {"mode": "lockstep"})

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that receives the rows of `frames`, or sends them in one packet."""
        one_packet = 1 < len(frames.rows) <= _MOST_FRAMES
        return _PacketBatch(self, frames) if one_packet else super().batch(frames)


class _PacketBatch(KernelBatch):
    def __init__(self, port: LedPort, frames: FrameBuffer) -> None:
        super().__init__(port, frames)
        self._packet = frames.packet
        self._packet[: _LAYOUT.size] = _LAYOUT.pack(_FRAMES, 0.0, 0.0)

    def send(self) -> None:
        """See `Batch.send`."""
        self._port.send(self._packet)


class SimulatedBus(FrameReader):
    """A simulated bus that this process leads; `docs/wire.md` has the packets.

    Frames come in the order of the bus, up to the time that the bus has reported; so a process
    that was held up, at either end, changes nothing. `on_failure` is called once when it is lost.
    """

    leads_time = True

    def __init__(self, port: SocketPort, now_s: float, next_s: float) -> None:
        super().__init__(port)
        self.now_s, self.next_s = now_s, next_s
        self.acquired = self.gone = False
        self._ahead_s = 0.0
        """By how much its clock is ahead of the bus."""

    def set_time(self, now_s: float) -> None:
        """Set the time to `now_s`, by an offset to that of the bus."""
        self._ahead_s, self.next_s = now_s - self.now_s, now_s
        self.now_s = now_s

    def go(self, until_s: float) -> bool:
        """Have time go on to `until_s` or to a frame; see `cdpr_rt.core.clock.SteppedBus`."""
        try:
            self.port.send(_LAYOUT.pack(_GO, until_s - self._ahead_s, 0.0))
            return self.receive_until_time()
        except OSError as error:
            self.lost(error)
        except BusError:
            pass  # `lost` has reported it
        return False

    def lost(self, error: OSError | None = None) -> BusError:
        """Mark the bus as gone and return the BusError with the reason."""
        failure = super().lost(error)
        if not self.gone:
            self.gone = True
            self.on_failure(failure)
        return failure

    def receive_until_time(self) -> bool:
        """Process all frames up to the next time packet; return whether there were any.

        It follows the answers to each SYNC and each `go`, and has the last of them. Raises
        BusError.
        """
        packet, came = self.frames.packet, False
        while True:
            try:
                size = self.port.recv_into(packet)
            except OSError as error:
                raise self.lost(error) from error
            frames = (size - HEAD_BYTES) // FRAME_BYTES
            kind, now_s, next_s = _LAYOUT.unpack_from(packet)
            if frames < 0 or kind not in _TO_MASTER:
                raise self.lost()
            if frames:
                came = True
                self.take(frames)
            if kind == _TIME:
                self.now_s, self.next_s = now_s + self._ahead_s, next_s + self._ahead_s
                return came

    def poll(self) -> bool:
        """Return False: frames come with the time, or they would come by chance."""
        return False

    def settle(self) -> None:
        """Process all that has been sent."""
        self.go(0.0)

    def close(self) -> None:
        """Return the bus to the clock, which goes on leading it."""
        self.take, self.on_failure, self.acquired = discard, discard, False
        with contextlib.suppress(OSError):
            self.port.set_filters([])

    def release(self) -> None:
        """Lead no longer: the bus' time stands until another client sends there."""
        with contextlib.suppress(OSError):
            self.port.send(control_message({"lead": False}))
        self.port.close()


class SimulatedBusClock(LockstepClock):
    """The time of simulated buses, by their URLs; they stand still while nobody waits."""

    def __init__(self, buses: Mapping[str, SimulatedBus], *, real_time: bool = False) -> None:
        super().__init__(list(buses.values()), real_time=real_time)
        self._by_url = dict(buses)
        latest_s = max(bus.now_s for bus in buses.values())
        for bus in buses.values():
            for _ in range(_MOST_STEPS):
                if bus.now_s >= latest_s or bus.gone:
                    break
                bus.go(latest_s)

    def acquire(self, url: BusUrl) -> SimulatedBus | None:
        """Return the bus of that URL for use, None where it is none of these or in use.

        One that was lost is opened again. Raises BusError where that fails.
        """
        bus = self._by_url.get(str(url))
        if bus is None or bus.acquired:
            return None
        if bus.gone:
            bus.port.close()
            bus = self._by_url[str(url)] = self._lead_again(url)
        bus.acquired = True
        return bus

    def _lead_again(self, url: BusUrl) -> SimulatedBus:
        connect(url.channel).close()  # raises where there is none
        bus = _lead(url)
        if bus is None:
            raise BusError(f"{url}: the bus has come back with another clock; begin anew")
        bus.set_time(self.now_s)
        self._buses.append(bus)
        return bus

    def _listen(self, until_s: float) -> None:
        super()._listen(until_s)
        if not self._buses:
            time.sleep(_LOST_S)

    def close(self) -> None:
        """Give the lead back, in order; if this process died, time would run with wall time."""
        super().close()
        self.sleep(_LAST_S)
        for bus in self._by_url.values():
            bus.release()


def open_clock(urls: Iterable[BusUrl], *, real_time: bool = False) -> Clock:
    """Return the clock of the robot on these buses.

    Where all are simulated buses in lockstep that no other process leads, this process leads them
    from now on and their time is the clock's, in `real_time` no faster than wall time; otherwise
    the clock is CLOCK_MONOTONIC.
    """
    buses: dict[str, SimulatedBus] = {}
    for url in urls:
        led = _lead(url)
        if led is None:
            for bus in buses.values():
                bus.release()
            return PacedClock()
        buses[str(url)] = led
    return SimulatedBusClock(buses, real_time=real_time) if buses else PacedClock()


def _lead(url: BusUrl) -> SimulatedBus | None:
    """Return the bus with this process as its leader, None where it cannot be."""
    if url.interface != "simbus":
        return None
    try:
        sock = connect(url.channel)
    except BusError:
        return None  # reported by what opens the bus
    try:
        sock.settimeout(_ANSWER_TIMEOUT_S)
        sock.send(control_message({"filters": []}))
        sock.send(control_message({"lead": True}))
        answer = _answer(sock)
    except (OSError, ValueError):
        answer = None
    if answer is None:
        sock.close()
        return None
    port = LedPort(url, sock)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, bytes(16))
    next_s = answer["next_s"]
    return SimulatedBus(port, float(answer["now_s"]), math.inf if next_s is None else float(next_s))


def _answer(sock: socket.socket) -> dict[str, Any] | None:
    while len(packet := sock.recv(_CONTROL_BYTES)) == FRAME_BYTES:
        continue  # from before the filters
    answer: dict[str, Any] | None = json.loads(packet).get("lead")
    return answer
