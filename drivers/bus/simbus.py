"""The simulated bus: its socket and control messages, a port, and the clock of led buses."""

from __future__ import annotations

import contextlib
import json
import math
import socket
import struct
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from cdpr_drivers.bus.frames import (
    BUFFER_BYTES,
    FRAME_BYTES,
    HEAD_BYTES,
    Batch,
    Filters,
    FrameBuffer,
    FramePort,
    FrameReader,
    KernelBatch,
    discard,
)
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.clock import Clock, LockstepClock, PacedClock

_ANSWER_TIMEOUT_S = 5.0
_CONTROL_BYTES = 65536
_CLOSED = "the simulated bus closed the connection; it accepts only the user who runs it, and root"
# the hub accepts control messages below 448 bytes; a pair takes up to 24
_FILTERS_A_MESSAGE = 16

in_this_process: Final[dict[str, Callable[[], socket.socket]]] = {}
"""Buses that run in this process: by name, a function that returns a new connection."""


def connect(name: str) -> socket.socket:
    """Return a blocking socket connected to the bus `name`.

    Raises:
        BusError: no simulated bus of that name runs on this machine.
    """
    if name in in_this_process:
        return in_this_process[name]()
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        sock.connect(f"\0cdpr-rt/simbus/{name}")
    except OSError as error:
        sock.close()
        raise BusError(
            f"simbus:{name}: no simulated bus of that name is running ({error.strerror}); "
            f"`cdpr sim up` starts one"
        ) from None
    return sock


def control_message(message: dict[str, Any]) -> bytes:
    """Return `message` as a packet: JSON, padded so that its length differs from a frame's."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return text + b" " if len(text) == FRAME_BYTES else text


def set_filters(sock: socket.socket, filters: Filters) -> None:
    """Ask the hub to send only frames that pass one of `filters`; takes effect with a delay."""
    pairs = [[can_id, mask] for can_id, mask in filters]
    sock.send(control_message({"filters": pairs[:_FILTERS_A_MESSAGE]}))
    for start in range(_FILTERS_A_MESSAGE, len(pairs), _FILTERS_A_MESSAGE):
        part = pairs[start : start + _FILTERS_A_MESSAGE]
        sock.send(control_message({"more_filters": part}))


def exchange(sock: socket.socket, filters: Filters | None) -> dict[str, Any]:
    """Set `filters` (None: everything) and return the hub's status.

    Frames that arrive before the answer are dropped, because they are unfiltered.

    Raises:
        BusError: the hub did not answer in time, rejected the request, or disconnected.
    """
    before = sock.gettimeout()
    sock.settimeout(_ANSWER_TIMEOUT_S)
    try:
        if filters is not None:
            set_filters(sock, filters)
        sock.send(control_message({"status": True}))
        while True:
            packet = sock.recv(_CONTROL_BYTES)
            if not packet:
                raise BusError(_CLOSED)
            if len(packet) == FRAME_BYTES:
                continue
            answer = parse_json(packet, "its answer")
            if "error" in answer:
                raise BusError(f"the simulated bus refused: {answer['error']}")
            return dict(answer["status"])
    except (ProfileError, LookupError, TypeError, ValueError) as error:
        raise BusError(f"the simulated bus sent an invalid status: {error}") from None
    except TimeoutError:
        raise BusError(f"the simulated bus did not answer in {_ANSWER_TIMEOUT_S:g} s") from None
    except (BrokenPipeError, ConnectionResetError):
        raise BusError(_CLOSED) from None
    except OSError as error:
        raise BusError(f"the simulated bus is lost ({error.strerror})") from None
    finally:
        sock.settimeout(before)


def query_status(name: str) -> dict[str, Any]:
    """Return the status of the simulated bus `name`; docs/reference/wire.md lists its keys.

    Raises:
        BusError: the bus does not exist or does not answer.
    """
    with contextlib.closing(connect(name)) as sock:
        return exchange(sock, [])


class SimbusPort(FramePort):
    """A `FramePort` on the simulated bus, where the hub filters."""

    def set_filters(self, filters: Filters) -> None:
        """Receive only frames that pass one of `filters`; may take effect with a delay."""
        set_filters(self._sock, filters)


def open_simbus(
    url: BusUrl, filters: Filters | None, health: BusHealth | None = None
) -> SimbusPort:
    """Join the simulated bus `url`.

    Raises:
        BusError: no such bus runs, or it rejected the connection.
    """
    sock = connect(url.channel)
    try:
        status = exchange(sock, filters)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
    except BaseException:
        sock.close()
        raise
    return SimbusPort(url, sock, health, status)


# Buses whose time this process leads: time advances only as far as this process allows.

_GO, _TIME, _FRAMES = b"bus-go\0\0", b"bus-time", b"bus-data"
_TO_MASTER: Final = {_TIME, _FRAMES}
_LAYOUT = struct.Struct("<8sdd")
_MOST_FRAMES = 26
"""Maximum number of frames in a packet to the bus."""
_MOST_STEPS = 10_000
_LAST_S = 0.01
"""Bus time for the drives to act on the last commands before time stops."""
_LOST_S = 1e-3
"""Wall time of a wait if all buses are lost, so that the loop does not use all CPU time."""


class LedPort(SimbusPort):
    """A port on a bus that this process leads."""

    def __init__(self, url: BusUrl, sock: socket.socket) -> None:
        super().__init__(url, sock, status={"mode": "lockstep"})

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that receives the rows of `frames`, or sends them in one packet."""
        one_packet = 1 < len(frames.rows) <= _MOST_FRAMES
        return _PacketBatch(self, frames) if one_packet else super().batch(frames)


class _PacketBatch(KernelBatch):
    def __init__(self, port: LedPort, frames: FrameBuffer) -> None:
        super().__init__(port, frames)
        self._packet = frames.packet
        self._packet[: _LAYOUT.size] = _LAYOUT.pack(_FRAMES, 0.0, 0.0)

    def send(self, then: bytes = b"") -> None:
        """See `Batch.send`."""
        if then and len(self._rows) < _MOST_FRAMES:
            self._port.send(b"".join((self._packet, then)))
            return
        self._port.send(self._packet)
        if then:
            self._port.send(then)


class SimulatedBus(FrameReader):
    """A simulated bus that this process leads; `docs/reference/wire.md` describes the packets.

    Frames arrive in the order of the bus, up to the time that the bus has reported. So a delay of
    this process or of the bus changes no result. `on_failure` is called once when the bus is lost.
    """

    leads_time = True

    def __init__(self, port: FramePort, now_s: float, next_s: float) -> None:
        super().__init__(port)
        self.now_s, self.next_s = now_s, next_s
        self.acquired = self.gone = False
        self._ahead_s = 0.0
        """Offset by which `now_s` is ahead of the time that the bus reports."""

    def set_time(self, now_s: float) -> None:
        """Set the time to `now_s`, by an offset to the bus' time."""
        self._ahead_s, self.next_s = now_s - self.now_s, now_s
        self.now_s = now_s

    def go(self, until_s: float) -> bool:
        """Advance time to `until_s` or to the next frame; see `cdpr_rt.core.clock.SteppedBus`."""
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

        A time packet ends the answers to each SYNC and each `go`; it also carries the last of them.
        Raises BusError.
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
        """Return False: frames arrive only when time advances, so that results are reproducible."""
        return False

    def settle(self) -> None:
        """Process all frames that were sent."""
        self.go(0.0)

    def close(self) -> None:
        """Return the bus to the clock, which continues to lead it."""
        self.take, self.on_failure, self.acquired = discard, discard, False
        with contextlib.suppress(OSError):
            self.port.set_filters([])

    def release(self) -> None:
        """Stop leading: bus time stands still until another client sends on the bus."""
        with contextlib.suppress(OSError):
            self.port.send(control_message({"lead": False}))
        self.port.close()


class SimulatedBusClock(LockstepClock):
    """The clock of simulated buses, by their URLs; its time stands still while nobody waits."""

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
        """Return the bus of that URL for use; None if it is not led here or is in use.

        A lost bus is opened again. Raises BusError if that fails.
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
        connect(url.channel).close()  # raises if the bus does not exist
        bus = _lead(url)
        if bus is None:
            raise BusError(f"{url}: the bus was restarted with another clock; open it again")
        bus.set_time(self.now_s)
        self._buses.append(bus)
        return bus

    def _listen(self, until_s: float) -> None:
        super()._listen(until_s)
        if not self._buses:
            time.sleep(_LOST_S)

    def close(self) -> None:
        """Stop leading properly; if this process just ended, bus time would follow wall time."""
        super().close()
        self.sleep(_LAST_S)
        for bus in self._by_url.values():
            bus.release()


def open_clock(urls: Iterable[BusUrl], *, real_time: bool = False) -> Clock:
    """Return the clock of the robot on these buses.

    If all are simulated buses in lockstep that no other process leads, this process leads them
    from now on. Their time is then the clock's; with `real_time` it is no faster than wall time.
    Otherwise the clock is CLOCK_MONOTONIC.
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
    """Return the bus with this process as its leader, or None if it cannot lead."""
    if url.interface != "simbus":
        return None
    try:
        sock = connect(url.channel)
    except BusError:
        return None  # the caller that opens the bus reports the error
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
        continue  # sent before the filters were set
    answer: dict[str, Any] | None = json.loads(packet).get("lead")
    return answer
