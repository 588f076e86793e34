"""The simulated bus as an interface of python-can: `can.Bus(interface="simbus", channel=NAME)`."""

from __future__ import annotations

import select
from pathlib import Path
from typing import Any

import can

from cdpr_drivers.bus.adapters import simbus_socket
from cdpr_drivers.bus.adapters.packet_bus import PacketBus, pair_of
from cdpr_drivers.errors import BusError

_LISTED_AS = "@cdpr-rt/simbus/"
"""How the kernel's table of sockets shows the abstract addresses of the buses."""


class SimBus(PacketBus):
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
        name = str(channel)
        try:
            sock = simbus_socket.connect(name)
            simbus_socket.exchange(sock, None)
        except BusError as error:
            raise can.CanInitializationError(str(error)) from error
        self._writable = select.poll()
        self._writable.register(sock, select.POLLOUT)
        super().__init__(name, f"simbus:{name}", sock, can_filters, **kwargs)

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        pairs = [(0, 0)] if filters is None else [pair_of(entry) for entry in filters]
        try:
            simbus_socket.set_filters(self._sock, pairs)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}") from error

    def _put(self, packet: bytes, timeout_s: float) -> None:
        for last in (False, True):
            try:
                self._sock.send(packet)
            except BlockingIOError:
                if last or not self._writable.poll(timeout_s * 1000.0):
                    break
            except OSError as error:
                raise self._gone(error.strerror) from error
            else:
                return
        raise can.CanOperationError(f"{self.channel_info}: the bus takes no frames (buffer full)")

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
