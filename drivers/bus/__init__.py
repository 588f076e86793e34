"""CAN buses by URL: 16-byte frames for the cycle, python-can for everything else."""

from __future__ import annotations

from cdpr_drivers.bus.adapters.pythoncan import bus_gone, open_python_can, open_shared_port
from cdpr_drivers.bus.adapters.simbus_socket import Filters, query_status
from cdpr_drivers.bus.adapters.socketcan import open_socketcan
from cdpr_drivers.bus.adapters.socketcand import SocketcandPort
from cdpr_drivers.bus.frames import FrameBuffer, FramePort
from cdpr_drivers.bus.health import BusHealth, BusState
from cdpr_drivers.bus.socket_port import open_simbus
from cdpr_drivers.bus.url import BusUrl

__all__ = [
    "BusHealth",
    "BusState",
    "BusUrl",
    "Filters",
    "FrameBuffer",
    "FramePort",
    "bus_gone",
    "open_line_port",
    "open_port",
    "open_python_can",
    "query_status",
]


def open_port(
    url: BusUrl,
    filters: Filters | None = None,
    health: BusHealth | None = None,
    *,
    receive_errors: bool = False,
) -> FramePort:
    """Return a port on the bus `url` which receives the frames that pass one of `filters`.

    `health` counts what the port notices of the bus's state (a new one where left out). With
    `receive_errors` the controller's error frames come in too, where the interface has them.

    Raises:
        BusError: the bus cannot be opened.
    """
    if url.interface == "simbus":
        return open_simbus(url, filters, health)
    if url.interface == "socketcan":
        return open_socketcan(url, filters, health, receive_errors=receive_errors)
    if url.interface == "socketcand":
        return SocketcandPort(url, filters, health, receive_errors=receive_errors)
    return open_shared_port(url, filters, health, receive_errors=receive_errors)
