"""Frames of a bus, received and kept until they are decoded."""

from __future__ import annotations

import select
import time
from collections import deque

import can

from cdpr_drivers.bus import BusUrl, Filters, bus_gone, open_port, open_python_can, query_status
from cdpr_drivers.decode import Frame
from cdpr_drivers.errors import BusError
from cdpr_tools.errors import BadInputError, raised_as

_MOST_WAITING = 1 << 20
"""Frames kept for decoding; what comes on top stays in the bus' own buffer."""
_AT_ONCE = 1000
_FRAME_BYTES = 16
_CONTROL_BYTES = 64
_LATEST_RELATIVE_s = 1e9
"""A time stamp below this does not count from the epoch."""


class SimbusSource:
    """The simulated bus through its packed frames, which keeps up with lockstep cycles."""

    def __init__(self, url: BusUrl, filters: Filters | None) -> None:
        self.name = url.channel
        self.lost: BusError | None = None
        self._url = url
        self._filtered = filters is not None
        self._port = open_port(url, filters)
        self._before = self._port.status
        self._port.settimeout(0)
        self._readable = select.poll()
        self._readable.register(self._port.fileno(), select.POLLIN)
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._seen = 0

    def receive(self, timeout_s: float) -> None:
        """Keep what has arrived, waiting up to `timeout_s`; at the end of the bus `lost` is set."""
        if self.lost or len(self._waiting) >= _MOST_WAITING:
            return
        if not self._readable.poll(timeout_s * 1e3):
            return
        packet, receive, keep = (
            bytearray(_CONTROL_BYTES),
            self._port.recv_into,
            self._waiting.append,
        )
        try:
            for _ in range(_AT_ONCE):
                length = receive(packet)
                if length == 0:
                    self.lost = self._port.lost()
                    return
                if length == _FRAME_BYTES:
                    keep((time.time(), bytes(packet[:_FRAME_BYTES])))
                    self._seen += 1
        except BlockingIOError:
            return
        except OSError as error:
            self.lost = self._port.lost(error)

    def next_frames(self, most: int) -> list[Frame]:
        """Return frames that were received, the oldest first."""
        count = min(most, len(self._waiting))
        return [Frame.unpack(*self._waiting.popleft()) for _ in range(count)]

    def ask(self) -> dict[str, float]:
        """Return what the bus says: `frames`, `bus_time_s` since we joined; whether it is `led`."""
        now = query_status(self._url.channel)
        passed = {key: now[key] - self._before[key] for key in ("frames", "bus_time_s")}
        return passed | {"led": now["led"]}

    @property
    def seen(self) -> int | None:
        """Frames received so far; None where filters keep some away."""
        return None if self._filtered else self._seen

    def close(self) -> None:
        """Leave the bus."""
        self._port.close()


class PythonCanSource:
    """Any other bus through python-can, which brings time stamps and error frames along."""

    def __init__(self, url: BusUrl, filters: Filters | None) -> None:
        self.name = url.channel.rpartition("/")[2]
        self.lost: BusError | None = None
        self._url = url
        self._bus = open_python_can(url, filters)
        self._waiting: deque[can.Message] = deque()

    def receive(self, timeout_s: float) -> None:
        """Keep what has arrived, waiting up to `timeout_s`; at the end of the bus `lost` is set."""
        try:
            for i in range(_AT_ONCE):
                if len(self._waiting) >= _MOST_WAITING:
                    return
                message = self._bus.recv(0.0 if i else timeout_s)
                if message is None:
                    return
                if message.timestamp < _LATEST_RELATIVE_s:
                    message.timestamp = time.time()
                self._waiting.append(message)
        except (can.CanError, OSError) as error:
            self.lost = bus_gone(self._url, error)

    def next_frames(self, most: int) -> list[Frame]:
        """Return frames that were received, the oldest first."""
        count = min(most, len(self._waiting))
        messages = [self._waiting.popleft() for _ in range(count)]
        return [frame_of(message) for message in messages if not message.is_fd]

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def frame_of(message: can.Message) -> Frame:
    """Return a message of python-can as a frame."""
    return Frame(
        round(message.timestamp, 6),
        message.arbitration_id,
        bytes(message.data or b""),
        message.is_extended_id and not message.is_error_frame,
        message.is_remote_frame,
        message.is_error_frame,
        message.dlc if message.is_remote_frame else 0,
    )


FrameSource = SimbusSource | PythonCanSource
"""A bus to listen to: its `name` in log files, and why it is `lost` once nothing comes any more."""


def open_source(url: BusUrl, filters: Filters | None = None) -> FrameSource:
    """Open a bus to listen to; raises BadInputError where that is not possible."""
    with raised_as(BadInputError, BusError):
        if url.interface == "simbus":
            return SimbusSource(url, filters)
        return PythonCanSource(url, filters)


def running_bus(text: str) -> BusUrl:
    """Return the bus that `text` names, which has to exist; raises BadInputError."""
    with raised_as(BadInputError, BusError):
        url = BusUrl.parse(text)
    if url.starts_own_simulator:
        found = can.detect_available_configs(interfaces=["simbus"])
        running = ", ".join(f"simbus:{config['channel']}" for config in found) or "none"
        raise BadInputError(
            f"--bus {text}: the name is missing; running on this machine: {running}"
        )
    return url
