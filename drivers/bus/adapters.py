"""CAN adapters that can be opened only once, shared by all ports of this process.

Only one reader can use a serial port or most vendors' drivers. A thread reads the adapter and
sends each frame, through a socket pair, to the ports whose filters it passes. So the ports wait
and poll as on any other bus. A frame sent by one port reaches the others, as on SocketCAN.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
import threading
from collections.abc import Callable
from typing import Any, Protocol

import can

from cdpr_drivers.bus.frames import (
    BUFFER_BYTES,
    ERR_FLAG,
    FRAME_BYTES,
    Batch,
    Bytes,
    Filters,
    FrameBuffer,
    FramePort,
    passes,
)
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.simbus_can import message_of, packet_of
from cdpr_drivers.bus.slcan import SlcanAdapter
from cdpr_drivers.bus.socketcand import SocketcandAdapter
from cdpr_drivers.bus.url import BusUrl, Option
from cdpr_drivers.errors import BusError

_MOST_ROUTES = 4096
_BATCH = 256
"""Frames sent together: 4096 bytes go through a local socket whole or not at all."""
_PRIORITY = 40
_LOOK_S = 0.05
"""Interval at which the thread that reads a python-can bus checks whether it must end."""
_CAN_ID = struct.Struct("=I")


class Adapter(Protocol):
    """An opened adapter. All frames are 16 bytes, laid out as `struct can_frame`."""

    def read(self, wake: int, /) -> list[bytes]:
        """Return received frames; wait for some time or until descriptor `wake` is readable.

        Raises OSError, can.CanError or BusError when the adapter is lost.
        """

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; may be called from any thread. Raises OSError."""

    def close(self) -> None:
        """Close the adapter."""


class PythonCanAdapter:
    """A bus of any interface that python-can supports."""

    def __init__(self, url: BusUrl) -> None:
        """Open the bus; raises BusError."""
        options: dict[str, Any] = dict(url.options)
        options.pop("lockstep", None)  # used by this package, unknown to the interface
        try:
            self._bus = can.Bus(url.channel, url.interface, ignore_config=True, **options)
        except Exception as error:
            # vendors' modules raise any exception, such as NameError if their library is missing
            if isinstance(error.__cause__, BusError):
                raise error.__cause__ from None  # the cause's text already names the bus
            reason = str(error) or type(error).__name__
            if isinstance(error, NameError):
                reason = f"the vendor's library for {url.interface} is missing ({error})"
            raise BusError(f"{url}: cannot be opened: {reason}") from error
        self._sending = threading.Lock()

    def read(self, wake: int, /) -> list[bytes]:  # noqa: ARG002  # not all interfaces can be polled
        """Return the next frame if one arrives within a short time."""
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


_ADAPTERS: dict[str, Callable[[BusUrl], Adapter]] = {
    "slcan": SlcanAdapter,
    "socketcand": SocketcandAdapter,
}


class SharedAdapter:
    """An adapter, the thread that reads it, and its ports."""

    def __init__(self, url: BusUrl, first: AdapterPort) -> None:
        self.url = url
        self.reason = ""
        """Why the adapter was lost; empty while it works."""
        self._adapter = _ADAPTERS.get(url.interface, PythonCanAdapter)(url)
        # set from the beginning: frames may have arrived with the adapter's greeting
        self._ports = [first]
        self._routes: dict[int, tuple[AdapterPort, ...]] = {}
        self._lock = threading.Lock()
        self._stopping = False
        self._wake = os.eventfd(0, os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._run, name=f"reads {url}", daemon=True)
        self._thread.start()

    def add(self, port: AdapterPort) -> None:
        """Pass frames on to `port` from now on."""
        with self._lock:
            self._ports.append(port)
            self._routes = {}
            if self.reason:
                port.far_end.close()

    def set_filters(self, port: AdapterPort, filters: Filters | None) -> None:
        """Change the filters of `port`."""
        with self._lock:
            port.filters = None if filters is None else list(filters)
            self._routes = {}

    def remove(self, port: AdapterPort) -> None:
        """Remove `port`; close the adapter with its last port."""
        with _registry_lock:
            with self._lock:
                if port not in self._ports:
                    return
                self._ports.remove(port)
                self._routes = {}
                port.far_end.close()
                last = not self._ports
            if last:
                self._close()

    def write(self, frame: Bytes, source: AdapterPort) -> None:
        """Send `frame` to the bus and to the other ports; raises OSError."""
        if self.reason:
            raise OSError(errno.ENODEV, self.reason)
        if source.far_end.fileno() < 0:
            raise OSError(errno.EBADF, "the port is closed")
        self._adapter.write(frame)
        if len(self._ports) > 1:
            self._distribute([bytes(frame)], source)

    def _run(self) -> None:
        with contextlib.suppress(PermissionError):
            # the thread only waits and copies, but cycles need it: ordinary processes must not
            # delay it
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        try:
            while not self._stopping:
                frames = self._adapter.read(self._wake)
                for start in range(0, len(frames), _BATCH):
                    self._distribute(frames[start : start + _BATCH], None)
        except Exception as error:
            # a vendor's driver may raise any exception; after it, nothing can be received
            self._end(str(getattr(error, "strerror", None) or error))

    def _distribute(self, frames: list[bytes], source: AdapterPort | None) -> None:
        """Send each port its frames in one piece, which arrives whole or not at all."""
        batches: dict[AdapterPort, list[bytes]] = {}
        routes = self._routes
        for frame in frames:
            can_id = _CAN_ID.unpack_from(frame)[0]
            ports = routes.get(can_id)
            for port in self._route(can_id) if ports is None else ports:
                if port in batches:
                    batches[port].append(frame)
                elif port is not source:
                    batches[port] = [frame]
        for port, batch in batches.items():
            try:
                port.far_end.send(b"".join(batch))
            except BlockingIOError:
                port.health.note_rx_lost("frames came faster than they were read", len(batch))
            except OSError:
                continue  # the port is about to be removed

    def _route(self, can_id: int) -> tuple[AdapterPort, ...]:
        with self._lock:
            if len(self._routes) >= _MOST_ROUTES:
                self._routes = {}
            ports = tuple(port for port in self._ports if port.wants(can_id))
            self._routes[can_id] = ports
            return ports

    def _end(self, reason: str) -> None:
        """Close the sockets of all ports: the adapter is lost."""
        with self._lock:
            self.reason = reason or "connection closed"
            for port in self._ports:
                port.far_end.close()
        # close it now: otherwise a USB adapter that is plugged in again gets another name
        self._close_adapter()

    def _close(self) -> None:
        if _registry.get(_key(self.url)) is self:
            del _registry[_key(self.url)]
        self._stopping = True
        os.eventfd_write(self._wake, 1)
        self._thread.join()
        if not self.reason:
            self._close_adapter()
        os.close(self._wake)

    def _close_adapter(self) -> None:
        with contextlib.suppress(OSError, can.CanError):
            self._adapter.close()


_registry: dict[tuple[object, ...], SharedAdapter] = {}
_registry_lock = threading.Lock()


def _key(url: BusUrl) -> tuple[object, ...]:
    return url.interface, url.channel, url.options.get("host"), url.options.get("port")


def _settings(url: BusUrl) -> dict[str, Option]:
    return {key: value for key, value in url.options.items() if key != "lockstep"}


def _join(port: AdapterPort) -> SharedAdapter:
    """Add a port to the adapter of its URL and open the adapter if needed; raises BusError."""
    url = port.url
    with _registry_lock:
        shared = _registry.get(_key(url))
        if shared is not None and shared.reason:
            shared = None  # lost; its ports remove themselves
        if shared is None:
            shared = _registry[_key(url)] = SharedAdapter(url, port)
        elif _settings(shared.url) != _settings(url):
            raise BusError(f"{url}: is already in use with other settings ({shared.url})")
        else:
            shared.add(port)
        return shared


class AdapterPort(FramePort):
    """A `FramePort` on a shared adapter."""

    def __init__(
        self,
        url: BusUrl,
        filters: Filters | None = None,
        health: BusHealth | None = None,
        *,
        receive_errors: bool = False,
    ) -> None:
        """Join the adapter; raises BusError when it cannot be opened."""
        sock, self.far_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self.far_end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        self.far_end.setblocking(False)
        self.filters = None if filters is None else list(filters)
        self._receive_errors = receive_errors
        super().__init__(url, sock, health)
        try:
            self._shared = _join(self)
        except BaseException:
            sock.close()
            self.far_end.close()
            raise
        self.send = self._send
        self.close = self._close

    def wants(self, can_id: int) -> bool:
        """Return whether the port receives frames with this identifier and these flags."""
        return self._receive_errors if can_id & ERR_FLAG else passes(can_id, self.filters)

    def batch(self, frames: FrameBuffer) -> Batch:
        """Return the batch that sends or receives the rows of `frames`."""
        return Batch(self, frames)

    def set_filters(self, filters: Filters) -> None:
        """Receive only frames that pass one of `filters`, from now on."""
        self._shared.set_filters(self, filters)

    def _send(self, frame: Bytes) -> int:
        self._shared.write(frame, self)
        return FRAME_BYTES

    def _close(self) -> None:
        self._shared.remove(self)
        self._sock.close()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that says why the bus is no longer usable."""
        if self._shared.reason:
            return BusError(f"{self.url}: the bus is lost ({self._shared.reason})")
        return super().lost(error)
