"""Any other CAN interface: packed frames on top of python-can."""

from __future__ import annotations

from typing import Any

import can

from drivers.bus.packed import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG, Bytes
from drivers.bus.simbus_socket import FRAME_BYTES, Filters
from drivers.bus.url import BusUrl
from drivers.errors import BusError

_EFF_MASK = 0x1FFFFFFF
_SFF_MASK = 0x7FF


def open_python_can(url: BusUrl, filters: Filters | None = None) -> can.BusABC:
    """Return a python-can bus for `url`, for acyclic work; `filters` None lets all through.

    Raises:
        BusError: the interface cannot be opened; the message holds python-can's reason.
    """
    try:
        options: dict[str, Any] = dict(url.options)
        options.pop("lockstep", None)  # ours, not the interface's
        bus = can.Bus(url.channel, url.interface, ignore_config=True, **options)
        bus.set_filters(_python_can_filters(filters))
    except BusError:
        raise
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        raise BusError(f"{url}: cannot be opened: {error}") from error
    return bus


def _python_can_filters(filters: Filters | None) -> list[can.typechecking.CanFilter] | None:
    if filters is None:
        return None
    result: list[can.typechecking.CanFilter] = []
    for can_id, mask in filters:
        entry: can.typechecking.CanFilter = {
            "can_id": can_id & _EFF_MASK,
            "can_mask": mask & _EFF_MASK,
        }
        if mask & EFF_FLAG:
            entry["extended"] = bool(can_id & EFF_FLAG)
        result.append(entry)
    return result


class PythonCanPort:
    """A FramePort on a python-can bus, for the interfaces that have no packed socket."""

    def __init__(self, url: BusUrl, filters: Filters | None) -> None:
        self.url = url
        self.status: dict[str, object] = {}
        self._bus = open_python_can(url, filters)
        self._timeout_s: float | None = None

    def send(self, frame: Bytes, /) -> int:
        """Send one 16-byte frame."""
        can_id, length, data = FRAME.unpack(frame)
        extended = bool(can_id & EFF_FLAG)
        message = can.Message(
            arbitration_id=can_id & (_EFF_MASK if extended else _SFF_MASK),
            is_extended_id=extended,
            is_remote_frame=bool(can_id & RTR_FLAG),
            dlc=length,
            data=None if can_id & RTR_FLAG else data[:length],
        )
        try:
            self._bus.send(message)
        except can.CanError as error:
            raise OSError(str(error)) from error
        return FRAME_BYTES

    def recv_into(self, buffer: bytearray | memoryview, /) -> int:
        """Wait for a frame up to the time-out, write it into `buffer`, return its length."""
        try:
            message = self._bus.recv(self._timeout_s)
        except can.CanError as error:
            raise OSError(str(error)) from error
        if message is None:
            raise BlockingIOError
        can_id = message.arbitration_id
        can_id |= EFF_FLAG if message.is_extended_id else 0
        can_id |= RTR_FLAG if message.is_remote_frame else 0
        can_id |= ERR_FLAG if message.is_error_frame else 0
        FRAME.pack_into(buffer, 0, can_id, message.dlc, bytes(message.data))
        return FRAME_BYTES

    def settimeout(self, seconds: float | None) -> None:
        """Limit the wait of `recv_into`; None waits for ever, 0 does not wait."""
        self._timeout_s = seconds

    def drain(self) -> int:
        """Throw away the frames that wait; return how many."""
        count = 0
        while self._bus.recv(0) is not None:
            count += 1
        return count

    def fileno(self) -> int:
        """Return the descriptor to poll, -1 where the interface has none."""
        return self._bus.fileno()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that tells why the bus cannot be used any more."""
        if isinstance(error, BlockingIOError):
            return BusError(f"{self.url}: the bus takes or gives no frames (time-out)")
        return BusError(f"{self.url}: the bus has gone away ({error or 'connection closed'})")

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()
