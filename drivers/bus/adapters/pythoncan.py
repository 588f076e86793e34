"""Any CAN interface that python-can knows, by URL."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import can

from cdpr_drivers.bus.adapters.packet_bus import message_of, packet_of
from cdpr_drivers.bus.adapters.shared_adapter import Adapter, SharedAdapterBus, SharedAdapterPort
from cdpr_drivers.bus.adapters.simbus_socket import Filters
from cdpr_drivers.bus.adapters.slcan import SlcanAdapter
from cdpr_drivers.bus.adapters.socketcan import SocketCanBus, interface_problem
from cdpr_drivers.bus.adapters.socketcand import SocketcandConnection
from cdpr_drivers.bus.frames import EFF_FLAG, Bytes
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

_EFF_MASK = 0x1FFFFFFF
_LOOK_S = 0.05
"""How often the reading thread looks whether it is to end."""


class PythonCanAdapter:
    """A python-can bus as an `Adapter`."""

    def __init__(self, url: BusUrl) -> None:
        """Open it; raises BusError."""
        self._bus = _open(url, BusHealth())
        self._sending = threading.Lock()

    def read(self, wake: int, /) -> list[bytes]:  # noqa: ARG002  # not all interfaces can be polled
        """Return the next frame, if one comes within a short time."""
        message = self._bus.recv(_LOOK_S)
        return [] if message is None or message.is_fd else [packet_of(message)]

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; raises OSError."""
        message = message_of(bytes(frame))
        message.is_rx = False
        try:
            with self._sending:
                self._bus.send(message)
        except can.CanError as error:
            raise OSError(str(error)) from error

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def open_shared_port(
    url: BusUrl,
    filters: Filters | None = None,
    health: BusHealth | None = None,
    *,
    receive_errors: bool = False,
) -> SharedAdapterPort:
    """Return a port on an interface that opens only once or has no socket; raises BusError."""
    open_adapter = _ADAPTERS.get(url.interface, PythonCanAdapter)
    return SharedAdapterPort(url, open_adapter, filters, health, receive_errors=receive_errors)


def open_python_can(
    url: BusUrl, filters: Filters | None = None, health: BusHealth | None = None
) -> can.BusABC:
    """Return a python-can bus for `url`, for acyclic work; `filters` None lets all through.

    Error frames come through whatever the filters, where the interface tells of errors. What
    opens only once (a serial port) is shared with every other port of this process on it. What
    the bus notices by itself, a full transmit queue or frames it had no room for, goes into
    `health`; error frames are for the caller to put there.

    Raises:
        BusError: the interface cannot be opened; the message holds the reason.
    """
    health = health if health is not None else BusHealth()
    bus: can.BusABC
    if url.interface in ("simbus", "socketcan"):
        bus = _open(url, health)
    else:
        bus = SharedAdapterBus(url, _ADAPTERS.get(url.interface, PythonCanAdapter), health)
    bus.set_filters(_python_can_filters(filters))
    return bus


def bus_gone(url: BusUrl, error: Exception) -> BusError:
    """Return the BusError for what a python-can bus on `url` raised when it was lost, said once."""
    if str(error).startswith((f"{url}: ", f"{url.interface}:{url.channel}: ")):
        return BusError(error.args[0])
    if url.interface == "socketcan" and (problem := interface_problem(url)):
        return BusError(f"{url}: the bus has gone away: {problem}")
    return BusError(f"{url}: the bus has gone away ({error})")


def _open(url: BusUrl, health: BusHealth) -> can.BusABC:
    if url.interface == "socketcan":
        problem = interface_problem(url)
        if problem:
            raise BusError(f"{url}: {problem}")
    try:
        options: dict[str, Any] = dict(url.options)
        options.pop("lockstep", None)  # ours, not the interface's
        if url.interface == "socketcan":
            return SocketCanBus(url, health, **options)
        return can.Bus(url.channel, url.interface, ignore_config=True, **options)
    except Exception as error:
        # vendors' modules raise whatever comes, a NameError where their library is missing
        if isinstance(error.__cause__, BusError):
            raise error.__cause__ from None  # it names the bus already
        if isinstance(error, NameError):
            raise BusError(
                f"{url}: cannot be opened: the vendor's library for {url.interface} is missing "
                f"({error})"
            ) from error
        raise BusError(f"{url}: cannot be opened: {error or type(error).__name__}") from error


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


_ADAPTERS: dict[str, Callable[[BusUrl], Adapter]] = {
    "slcan": SlcanAdapter,
    "socketcand": SocketcandConnection,
}
