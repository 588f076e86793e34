"""A python-can bus on a socket that carries packed frames, one a packet."""

from __future__ import annotations

import select
import socket
import time
from abc import abstractmethod

import can

from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, FRAME_BYTES, RTR_FLAG

_EFF_MASK = 0x1FFFFFFF
_SFF_MASK = 0x7FF


def message_of(packet: bytes | memoryview, channel: str | None = None) -> can.Message:
    """Return a packed frame as python-can's message, received now."""
    can_id, length, data = FRAME.unpack(packet)
    error = bool(can_id & ERR_FLAG)
    extended = bool(can_id & EFF_FLAG) or error
    remote = bool(can_id & RTR_FLAG) and not error
    return can.Message(
        timestamp=time.time(),
        arbitration_id=can_id & (_EFF_MASK if extended else _SFF_MASK),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=error,
        dlc=length,
        data=None if remote else data[:length],
        channel=channel,
        is_rx=True,
    )


def packet_of(message: can.Message) -> bytes:
    """Return python-can's message (no CAN FD) as a packed frame."""
    can_id = message.arbitration_id
    can_id |= EFF_FLAG if message.is_extended_id and not message.is_error_frame else 0
    can_id |= RTR_FLAG if message.is_remote_frame else 0
    can_id |= ERR_FLAG if message.is_error_frame else 0
    return FRAME.pack(can_id, message.dlc, bytes(message.data[:8]))


def pair_of(entry: can.typechecking.CanFilter) -> tuple[int, int]:
    """Return python-can's filter as a pair (identifier, mask), the kind of identifier included."""
    can_id, mask = entry["can_id"], entry["can_mask"]
    if "extended" in entry:
        mask |= EFF_FLAG
        can_id |= EFF_FLAG if entry["extended"] else 0
    return can_id, mask


class PacketBus(can.BusABC):
    """What the buses on such a socket have in common; a subclass says how frames go out."""

    _RECV_BYTES = 4096

    def __init__(
        self,
        channel: str,
        channel_info: str,
        sock: socket.socket,
        can_filters: can.typechecking.CanFilters | None,
        **kwargs: object,
    ) -> None:
        self.channel = channel
        self.channel_info = channel_info
        self._can_protocol = can.CanProtocol.CAN_20
        self._sock = sock
        self._sock.setblocking(False)
        self._readable = select.poll()
        self._readable.register(self._sock, select.POLLIN)
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        limit_ms = None if timeout is None else max(timeout, 0.0) * 1000.0
        if not self._readable.poll(limit_ms):
            return None, False
        try:
            packet = self._sock.recv(self._RECV_BYTES)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise self._gone(error.strerror) from error
        if not packet:
            raise self._gone("connection closed")
        if len(packet) != FRAME_BYTES:
            return None, False
        # frames may still have been under way when the filters changed: let python-can look again
        message = message_of(packet, self.channel)
        return message, message.is_error_frame

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send `msg`, waiting up to `timeout` seconds (None: one second) for room.

        Raises:
            can.CanOperationError: the bus takes no frames, or has gone away.
        """
        if msg.is_fd or msg.is_error_frame:
            raise can.CanOperationError(f"{self.channel_info} carries classic CAN frames only")
        self._put(packet_of(msg), 1.0 if timeout is None else timeout)

    @abstractmethod
    def _put(self, packet: bytes, timeout_s: float) -> None:
        """Send a packed frame; raises can.CanOperationError."""

    def _gone(self, reason: str | None) -> can.CanOperationError:
        return can.CanOperationError(f"{self.channel_info}: the bus has gone away ({reason})")

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self._sock.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._sock.close()
