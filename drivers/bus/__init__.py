"""CAN buses by URL, as ports for 16-byte frames."""

from __future__ import annotations

from cdpr_drivers.bus.frames import Filters, FrameBuffer, FramePort
from cdpr_drivers.bus.health import BusHealth, BusState
from cdpr_drivers.bus.simbus import open_simbus, query_status
from cdpr_drivers.bus.socketcan import open_socketcan
from cdpr_drivers.bus.url import BusUrl

__all__ = [
    "BusHealth",
    "BusState",
    "BusUrl",
    "Filters",
    "FrameBuffer",
    "FramePort",
    "open_port",
    "query_status",
]


def open_port(
    url: BusUrl,
    filters: Filters | None = None,
    health: BusHealth | None = None,
    *,
    receive_errors: bool = False,
) -> FramePort:
    """Return a port on the bus `url` that receives the frames which pass one of `filters`.

    `health` counts the errors of the bus that the port notices (default: a new counter). With
    `receive_errors` the controller's error frames are received too, if the interface has them.

    Raises:
        BusError: the bus cannot be opened.
    """
    if url.interface == "simbus":
        return open_simbus(url, filters, health)
    if url.interface == "socketcan":
        return open_socketcan(url, filters, health, receive_errors=receive_errors)
    # imported here: python-can loads slowly, and simulated buses do not need it
    from cdpr_drivers.bus.adapters import AdapterPort  # noqa: PLC0415

    return AdapterPort(url, filters, health, receive_errors=receive_errors)
