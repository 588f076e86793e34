"""CAN buses by URL: packed frames for the cycle, python-can for everything else."""

from __future__ import annotations

from drivers.bus.packed import FrameBuffer, FramePort, open_simbus, open_socketcan
from drivers.bus.pythoncan import PythonCanPort, open_python_can
from drivers.bus.simbus_socket import Filters, query_status
from drivers.bus.url import BusUrl

__all__ = [
    "BusUrl",
    "Filters",
    "FrameBuffer",
    "FramePort",
    "open_port",
    "open_python_can",
    "query_status",
]


def open_port(url: BusUrl, filters: Filters | None = None) -> FramePort:
    """Open `url` for packed frames; only frames that pass one of `filters` come in.

    Raises:
        BusError: the bus cannot be opened.
    """
    if url.interface == "simbus":
        return open_simbus(url, filters)
    if url.interface == "socketcan":
        return open_socketcan(url, filters)
    return PythonCanPort(url, filters)
