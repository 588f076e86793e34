"""The simulated bus as an interface of python-can: `can.Bus(interface="simbus", channel=NAME)`."""

from __future__ import annotations

import select
import time
from pathlib import Path
from typing import Any

import can

from drivers.bus import simbus_socket
from drivers.bus.packed import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG
from drivers.bus.simbus_socket import FRAME_BYTES
from drivers.errors import BusError

_EFF_MASK = 0x1FFFFFFF
_SFF_MASK = 0x7FF
_PACKET_BYTES = 4096
_LISTED_AS = "@cdpr-rt/simbus/"
"""How the kernel's table of sockets shows the abstract addresses of the buses."""


class SimBus(can.BusABC):
    """A member of the simulated bus named `channel`; filters are applied by the hub."""

    def __init__(
        self,
        channel: Any,
        can_filters: can.typechecking.CanFilters | None = None,
        **kwargs: object,
    ) -> None:
        """Join the bus; other bus parameters of python-can (bitrate, fd) have no meaning here.

        Raises:
            can.CanInitializationError: no such bus runs, or it refused.
        """
        self.channel = str(channel)
        self.channel_info = f"simbus:{self.channel}"
        self._can_protocol = can.CanProtocol.CAN_20
        try:
            self._sock = simbus_socket.connect(self.channel)
            simbus_socket.exchange(self._sock, None)
        except BusError as error:
            raise can.CanInitializationError(str(error)) from error
        self._sock.setblocking(False)
        self._readable = select.poll()
        self._readable.register(self._sock, select.POLLIN)
        self._writable = select.poll()
        self._writable.register(self._sock, select.POLLOUT)
        super().__init__(channel=self.channel, can_filters=can_filters, **kwargs)

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        pairs = [(0, 0)] if filters is None else [_pair(entry) for entry in filters]
        try:
            simbus_socket.set_filters(self._sock, pairs)
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
        if len(packet) != FRAME_BYTES:
            return None, False
        # frames may still have been under way when the filters changed: let python-can look again
        return self._message(packet), False

    def _message(self, packet: bytes) -> can.Message:
        can_id, length, data = FRAME.unpack(packet)
        extended = bool(can_id & EFF_FLAG)
        remote = bool(can_id & RTR_FLAG)
        return can.Message(
            timestamp=time.time(),
            arbitration_id=can_id & (_EFF_MASK if extended else _SFF_MASK),
            is_extended_id=extended,
            is_remote_frame=remote,
            is_error_frame=bool(can_id & ERR_FLAG),
            dlc=length,
            data=None if remote else data[:length],
            channel=self.channel,
            is_rx=True,
        )

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send `msg`, waiting up to `timeout` seconds (None: one second) for room.

        Raises:
            can.CanOperationError: the bus takes no frames, or has gone away.
        """
        if msg.is_fd or msg.is_error_frame:
            raise can.CanOperationError(f"{self.channel_info} carries classic CAN frames only")
        can_id = msg.arbitration_id
        can_id |= EFF_FLAG if msg.is_extended_id else 0
        can_id |= RTR_FLAG if msg.is_remote_frame else 0
        packet = FRAME.pack(can_id, msg.dlc, bytes(msg.data))
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
        raise can.CanOperationError(f"{self.channel_info}: the bus takes no frames (buffer full)")

    def _gone(self, reason: str | None) -> can.CanOperationError:
        return can.CanOperationError(f"{self.channel_info}: the bus has gone away ({reason})")

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self._sock.fileno()

    @property
    def state(self) -> can.BusState:
        """Error-active always: nothing disturbs the wire of a simulated bus."""
        return can.BusState.ACTIVE

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError(f"{self.channel_info}: the state cannot be set")

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


def _pair(entry: can.typechecking.CanFilter) -> tuple[int, int]:
    can_id, mask = entry["can_id"], entry["can_mask"]
    if "extended" in entry:
        # the kind of identifier is part of what is compared
        mask |= EFF_FLAG
        can_id |= EFF_FLAG if entry["extended"] else 0
    return can_id, mask
