"""CAN buses by URL: packed frames for the cycle, python-can for everything else."""

from __future__ import annotations

from drivers.bus.health import BusHealth, BusState
from drivers.bus.packed import FrameBuffer, FramePort, open_simbus
from drivers.bus.pythoncan import bus_gone, open_line_port, open_python_can
from drivers.bus.simbus_socket import Filters, query_status
from drivers.bus.socketcan import open_socketcan
from drivers.bus.socketcand import SocketcandPort
from drivers.bus.url import BusUrl

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
    hears_errors: bool = False,
) -> FramePort:
    """Open `url` for packed frames; only frames that pass one of `filters` come in.

    What the port notices of the bus's state goes into `health`, into one of its own without. Who
    `hears_errors` gets the controller's error frames too, where the interface tells of errors.

    Raises:
        BusError: the bus cannot be opened.
    """
    if url.interface == "simbus":
        return open_simbus(url, filters, health)
    if url.interface == "socketcan":
        return open_socketcan(url, filters, health, hears_errors=hears_errors)
    if url.interface == "socketcand":
        return SocketcandPort(url, filters, health, hears_errors=hears_errors)
    return open_line_port(url, filters, health, hears_errors=hears_errors)
