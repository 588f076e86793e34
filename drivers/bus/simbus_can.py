"""The simulated bus as an interface of python-can: `can.Bus(interface="simbus", channel=NAME)`."""

from __future__ import annotations

import select
import time
from pathlib import Path
from typing import Any

import can

from cdpr_drivers.bus import frames, simbus
from cdpr_drivers.errors import BusError

_LISTED_AS = "@cdpr-rt/simbus/"
"""How the kernel's table of sockets shows the abstract addresses of the buses."""
_PACKET_BYTES = 4096


def message_of(packet: frames.Bytes, channel: str | None = None) -> can.Message:
    """Return a packed frame as a python-can message, received now."""
    can_id, length, data = frames.FRAME.unpack(packet)
    error = bool(can_id & frames.ERR_FLAG)
    extended = bool(can_id & frames.EFF_FLAG) or error
    remote = bool(can_id & frames.RTR_FLAG) and not error
    return can.Message(
        timestamp=time.time(),
        arbitration_id=can_id & (frames.EFF_MASK if extended else frames.SFF_MASK),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=error,
        dlc=length,
        data=None if remote else data[:length],
        channel=channel,
        is_rx=True,
    )


def packet_of(message: can.Message) -> bytes:
    """Return a python-can message (no CAN FD) as a packed frame."""
    can_id = message.arbitration_id
    can_id |= frames.EFF_FLAG if message.is_extended_id and not message.is_error_frame else 0
    can_id |= frames.RTR_FLAG if message.is_remote_frame else 0
    can_id |= frames.ERR_FLAG if message.is_error_frame else 0
    return frames.FRAME.pack(can_id, message.dlc, bytes(message.data[:8]))


def _pair_of(entry: can.typechecking.CanFilter) -> tuple[int, int]:
    """Return a python-can filter as a pair (identifier, mask), including the kind of identifier."""
    can_id, mask = entry["can_id"], entry["can_mask"]
    if "extended" in entry:
        mask |= frames.EFF_FLAG
        can_id |= frames.EFF_FLAG if entry["extended"] else 0
    return can_id, mask


class SimBus(can.BusABC):
    """A member of the simulated bus named `channel`; filters are applied by the hub."""

    def __init__(
        self,
        channel: Any,
        can_filters: can.typechecking.CanFilters | None = None,
        **kwargs: object,
    ) -> None:
        """Join the bus; other bus parameters of python-can (bitrate, fd) are ignored.

        Raises:
            can.CanInitializationError: no such bus runs, or it rejected the connection.
        """
        self.channel = str(channel)
        self.channel_info = f"simbus:{channel}"
        self._can_protocol = can.CanProtocol.CAN_20
        try:
            self._sock = simbus.connect(self.channel)
            simbus.exchange(self._sock, None)
        except BusError as error:
            raise can.CanInitializationError(str(error)) from error
        self._sock.setblocking(False)
        self._readable, self._writable = select.poll(), select.poll()
        self._readable.register(self._sock, select.POLLIN)
        self._writable.register(self._sock, select.POLLOUT)
        super().__init__(channel=self.channel, can_filters=can_filters, **kwargs)

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        pairs = [(0, 0)] if filters is None else [_pair_of(entry) for entry in filters]
        try:
            simbus.set_filters(self._sock, pairs)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}") from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        limit_ms = None if timeout is None else max(timeout, 0.0) * 1000.0
        if not self._readable.poll(limit_ms):
            return None, False
        try:
            packet = self._sock.recv(_PACKET_BYTES)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise self._gone(error.strerror) from error
        if not packet:
            raise self._gone("connection closed")
        # frames may have been in transit when the filters changed: python-can filters again
        return message_of(packet, self.channel) if len(
            packet
        ) == frames.FRAME_BYTES else None, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send `msg`, waiting up to `timeout` seconds (None: one second) for room.

        Raises:
            can.CanOperationError: the bus accepts no frames, or is gone.
        """
        if msg.is_fd or msg.is_error_frame:
            raise can.CanOperationError(f"{self.channel_info} carries classic CAN frames only")
        packet = packet_of(msg)
        limit_ms = 1000.0 if timeout is None else timeout * 1000.0
        for last in (False, True):
            try:
                self._sock.send(packet)
            except BlockingIOError:
                if last or not self._writable.poll(limit_ms):
                    break
            except OSError as error:
                raise self._gone(error.strerror) from error
            else:
                return
        raise can.CanOperationError(f"{self.channel_info}: the bus accepts no frames (buffer full)")

    def _gone(self, reason: str | None) -> can.CanOperationError:
        return can.CanOperationError(f"{self.channel_info}: the bus is lost ({reason})")

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self._sock.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._sock.close()

    @staticmethod
    def _detect_available_configs() -> list[can.typechecking.AutoDetectedConfig]:
        """Return the simulated buses that run on this machine."""
        table = Path("/proc/net/unix").read_text(encoding="ascii", errors="replace")
        addresses = {line.split()[-1] for line in table.splitlines()}
        return [
            {"interface": "simbus", "channel": address.removeprefix(_LISTED_AS)}
            for address in sorted(addresses)
            if address.startswith(_LISTED_AS)
        ]
