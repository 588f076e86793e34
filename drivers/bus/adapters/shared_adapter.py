"""An adapter that can be opened only once, shared by several ports of this process.

A serial port has one reader, and so have most vendors' drivers. A thread reads the adapter and
hands each frame, through a socket pair, to the subscribers whose filters it passes; so these wait
and poll as on any other bus. What one of them sends the others see, as on SocketCAN.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
import threading
from collections.abc import Callable
from typing import Protocol

import can

from cdpr_drivers.bus.adapters.packet_bus import PacketBus, pair_of
from cdpr_drivers.bus.adapters.simbus_socket import Filters, passes
from cdpr_drivers.bus.batch import SingleFrameBatch
from cdpr_drivers.bus.frames import BUFFER_BYTES, ERR_FLAG, FRAME_BYTES, Bytes, FrameBuffer
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.socket_port import SocketPort
from cdpr_drivers.bus.url import BusUrl, Option
from cdpr_drivers.errors import BusError

_MOST_ROUTES = 4096
_BATCH = 256
"""Frames passed on at once: 4096 bytes go through a local socket whole or not at all."""
_PRIORITY = 40
_CAN_ID = struct.Struct("=I")


class Adapter(Protocol):
    """An opened adapter. All frames are 16 bytes, laid out as `struct can_frame`."""

    def read(self, wake: int, /) -> list[bytes]:
        """Return frames that came in, waiting for some time or until descriptor `wake` is readable.

        Raises OSError, can.CanError or BusError when the adapter is lost.
        """

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; any thread may. Raises OSError."""

    def close(self) -> None:
        """Close the adapter."""


class _Subscriber:
    """One user of a shared adapter: the socket pair to it, and its filters."""

    def __init__(self, filters: Filters | None, health: BusHealth, *, receive_errors: bool) -> None:
        self.sock, self.subscriber_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        self.sock.setblocking(False)
        self.filters = None if filters is None else list(filters)
        self.health = health
        self.receive_errors = receive_errors

    def wants(self, can_id: int) -> bool:
        if can_id & ERR_FLAG:
            return self.receive_errors
        return passes(can_id, self.filters)


class SharedAdapter:
    """An adapter, the thread that reads it, and its subscribers."""

    def __init__(self, url: BusUrl, adapter: Adapter, first: _Subscriber) -> None:
        self.url = url
        self.reason = ""
        """Why the adapter is lost; empty while it is not."""
        self._adapter = adapter
        # from the beginning: frames may have come with the adapter's greeting
        self._subscribers = [first]
        self._routes: dict[int, tuple[_Subscriber, ...]] = {}
        self._lock = threading.Lock()
        self._stopping = False
        self._wake = os.eventfd(0, os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._run, name=f"reads {url}", daemon=True)
        self._thread.start()

    def add(self, subscriber: _Subscriber) -> None:
        """Pass frames on to `subscriber` from now on."""
        with self._lock:
            self._subscribers.append(subscriber)
            self._routes = {}
            if self.reason:
                subscriber.sock.close()

    def set_filters(self, subscriber: _Subscriber, filters: Filters | None) -> None:
        """Change the filters of `subscriber`."""
        with self._lock:
            subscriber.filters = None if filters is None else list(filters)
            self._routes = {}

    def remove(self, subscriber: _Subscriber) -> None:
        """Remove `subscriber`; with the last one the adapter closes."""
        with _registry_lock:
            with self._lock:
                if subscriber not in self._subscribers:
                    return
                self._subscribers.remove(subscriber)
                self._routes = {}
                subscriber.sock.close()
                last = not self._subscribers
            if last:
                self._close()

    def write(self, frame: Bytes, source: _Subscriber) -> None:
        """Send `frame`, which the other subscribers see as well; raises OSError."""
        if self.reason:
            raise OSError(errno.ENODEV, self.reason)
        if source.sock.fileno() < 0:
            raise OSError(errno.EBADF, "the port is closed")
        self._adapter.write(frame)
        if len(self._subscribers) > 1:
            self._distribute([bytes(frame)], source)

    def _run(self) -> None:
        with contextlib.suppress(PermissionError):
            # it waits and copies; a cycle that waits for it must not wait for ordinary processes
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        try:
            while not self._stopping:
                frames = self._adapter.read(self._wake)
                for start in range(0, len(frames), _BATCH):
                    self._distribute(frames[start : start + _BATCH], None)
        except Exception as error:
            # whatever a vendor's driver raises: nothing can be received any more
            self._end(str(getattr(error, "strerror", None) or error))

    def _distribute(self, frames: list[bytes], source: _Subscriber | None) -> None:
        """Send each subscriber its frames in one piece, which goes whole or not at all."""
        batches: dict[_Subscriber, list[bytes]] = {}
        routes = self._routes
        for frame in frames:
            can_id = _CAN_ID.unpack_from(frame)[0]
            subscribers = routes.get(can_id)
            for subscriber in self._route(can_id) if subscribers is None else subscribers:
                if subscriber in batches:
                    batches[subscriber].append(frame)
                elif subscriber is not source:
                    batches[subscriber] = [frame]
        for subscriber, batch in batches.items():
            try:
                subscriber.sock.send(b"".join(batch))
            except BlockingIOError:
                subscriber.health.note_rx_lost("frames came faster than they were read", len(batch))
            except OSError:
                continue  # it is about to be removed

    def _route(self, can_id: int) -> tuple[_Subscriber, ...]:
        with self._lock:
            if len(self._routes) >= _MOST_ROUTES:
                self._routes = {}
            subscribers = tuple(
                subscriber for subscriber in self._subscribers if subscriber.wants(can_id)
            )
            self._routes[can_id] = subscribers
            return subscribers

    def _end(self, reason: str) -> None:
        """Close the sockets of all subscribers: the adapter is lost."""
        with self._lock:
            self.reason = reason or "connection closed"
            for subscriber in self._subscribers:
                subscriber.sock.close()
        # at once, or a USB adapter that is plugged in again gets another name
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


def _join(
    url: BusUrl, open_adapter: Callable[[BusUrl], Adapter], subscriber: _Subscriber
) -> SharedAdapter:
    """Subscribe to the adapter of `url`, opened where it is not yet; raises BusError."""
    with _registry_lock:
        shared = _registry.get(_key(url))
        if shared is not None and shared.reason:
            shared = None  # lost; its subscribers remove themselves
        if shared is None:
            shared = _registry[_key(url)] = SharedAdapter(url, open_adapter(url), subscriber)
        elif _settings(shared.url) != _settings(url):
            raise BusError(f"{url}: is in use with other settings ({shared.url})")
        else:
            shared.add(subscriber)
        return shared


class SharedAdapterPort(SocketPort):
    """A `FramePort` on a shared adapter."""

    def __init__(
        self,
        url: BusUrl,
        open_adapter: Callable[[BusUrl], Adapter],
        filters: Filters | None,
        health: BusHealth | None = None,
        *,
        receive_errors: bool = False,
    ) -> None:
        """Subscribe; raises BusError when the adapter cannot be opened."""
        health = health if health is not None else BusHealth()
        self._subscriber = _Subscriber(filters, health, receive_errors=receive_errors)
        super().__init__(url, self._subscriber.subscriber_end, {}, health)
        try:
            self._shared = _join(url, open_adapter, self._subscriber)
        except BaseException:
            self._subscriber.subscriber_end.close()
            self._subscriber.sock.close()
            raise
        self.send = self._send
        self.close = self._close

    def batch(self, frames: FrameBuffer) -> SingleFrameBatch:
        """Return the batch that sends or receives the rows of `frames`."""
        return SingleFrameBatch(self, frames)

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from now on."""
        self._shared.set_filters(self._subscriber, filters)

    def _send(self, frame: Bytes) -> int:
        self._shared.write(frame, self._subscriber)
        return FRAME_BYTES

    def _close(self) -> None:
        self._shared.remove(self._subscriber)
        self._subscriber.subscriber_end.close()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError with the reason why the bus cannot be used any more."""
        if self._shared.reason:
            return BusError(f"{self.url}: the bus has gone away ({self._shared.reason})")
        return super().lost(error)


class SharedAdapterBus(PacketBus):
    """A python-can bus on a shared adapter."""

    _RECV_BYTES = FRAME_BYTES

    def __init__(
        self,
        url: BusUrl,
        open_adapter: Callable[[BusUrl], Adapter],
        health: BusHealth,
        can_filters: can.typechecking.CanFilters | None = None,
    ) -> None:
        """Subscribe; raises BusError when the adapter cannot be opened."""
        self._subscriber = _Subscriber([], health, receive_errors=True)
        try:
            self._shared = _join(url, open_adapter, self._subscriber)
        except BaseException:
            self._is_shutdown = True  # python-can warns of buses that were not shut down
            self._subscriber.subscriber_end.close()
            self._subscriber.sock.close()
            raise
        super().__init__(url.channel, str(url), self._subscriber.subscriber_end, can_filters)

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        pairs = None if filters is None else [pair_of(entry) for entry in filters]
        self._shared.set_filters(self._subscriber, pairs)

    def _put(self, packet: bytes, timeout_s: float) -> None:  # noqa: ARG002  # the adapter has its own
        try:
            self._shared.write(packet, self._subscriber)
        except OSError as error:
            raise self._gone(str(error.strerror or error)) from error

    def _gone(self, reason: str | None) -> can.CanOperationError:
        return super()._gone(self._shared.reason or reason)

    def shutdown(self) -> None:
        """Remove the subscription."""
        self._shared.remove(self._subscriber)
        super().shutdown()
