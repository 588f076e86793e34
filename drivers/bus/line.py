"""One adapter, several members: what an interface that opens only once is shared by.

A serial port has one reader, and so have most vendors' drivers. A thread reads the line and hands
each frame, through a socket pair, to the members that want it; so a member waits and polls as on
any other bus. What one member sends the others see, as on SocketCAN.
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

from drivers.bus.health import BusHealth
from drivers.bus.packed import BUFFER_BYTES, ERR_FLAG, FRAME_BYTES, Bytes, PackedPort
from drivers.bus.packet_bus import PacketBus, pair_of
from drivers.bus.simbus_socket import Filters, passes
from drivers.bus.url import BusUrl, Option
from drivers.errors import BusError

_MOST_ROUTES = 4096
_BATCH = 256
"""Frames handed on at once: 4096 bytes go through a local socket whole or not at all."""
_PRIORITY = 40
_CAN_ID = struct.Struct("=I")


class Line(Protocol):
    """An opened adapter. All frames are 16 bytes, laid out as `struct can_frame`."""

    def read(self, wake: int, /) -> list[bytes]:
        """Return frames that came in, waiting for some time or until descriptor `wake` is readable.

        Raises OSError, can.CanError or BusError when the line is lost.
        """

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; any thread may. Raises OSError."""

    def close(self) -> None:
        """Let the adapter go."""


class _Member:
    """One who takes part: the socket that leads to it, and what it wants to hear."""

    def __init__(self, filters: Filters | None, health: BusHealth, *, hears_errors: bool) -> None:
        self.sock, self.own_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        self.sock.setblocking(False)
        self.filters = None if filters is None else list(filters)
        self.health = health
        self.hears_errors = hears_errors

    def wants(self, can_id: int) -> bool:
        if can_id & ERR_FLAG:
            return self.hears_errors
        return passes(can_id, self.filters)


class SharedLine:
    """A line, the thread that reads it, and its members."""

    def __init__(self, url: BusUrl, line: Line, first: _Member) -> None:
        self.url = url
        self.reason = ""
        """Why the line is lost; empty while it is not."""
        self._line = line
        # from the beginning: frames may have come with the line's greeting
        self._members = [first]
        self._routes: dict[int, tuple[_Member, ...]] = {}
        self._lock = threading.Lock()
        self._stopping = False
        self._wake = os.eventfd(0, os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._run, name=f"reads {url}", daemon=True)
        self._thread.start()

    def add(self, member: _Member) -> None:
        """Let `member` hear from now on."""
        with self._lock:
            self._members.append(member)
            self._routes = {}
            if self.reason:
                member.sock.close()

    def set_filters(self, member: _Member, filters: Filters | None) -> None:
        """Change what `member` wants to hear."""
        with self._lock:
            member.filters = None if filters is None else list(filters)
            self._routes = {}

    def leave(self, member: _Member) -> None:
        """Let `member` go; with the last one the line closes."""
        with _registry_lock:
            with self._lock:
                if member not in self._members:
                    return
                self._members.remove(member)
                self._routes = {}
                member.sock.close()
                last = not self._members
            if last:
                self._close()

    def write(self, frame: Bytes, source: _Member) -> None:
        """Send `frame`, which the other members see as well; raises OSError."""
        if self.reason:
            raise OSError(errno.ENODEV, self.reason)
        if source.sock.fileno() < 0:
            raise OSError(errno.EBADF, "the port is closed")
        self._line.write(frame)
        if len(self._members) > 1:
            self._hand_out([bytes(frame)], source)

    def _run(self) -> None:
        with contextlib.suppress(PermissionError):
            # it waits and copies; a cycle that waits for it must not wait for ordinary processes
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        try:
            while not self._stopping:
                frames = self._line.read(self._wake)
                for start in range(0, len(frames), _BATCH):
                    self._hand_out(frames[start : start + _BATCH], None)
        except Exception as error:
            # whatever a vendor's driver raises: there is nothing to hear any more
            self._end(str(getattr(error, "strerror", None) or error))

    def _hand_out(self, frames: list[bytes], source: _Member | None) -> None:
        """Give each member what it wants in one piece, which goes whole or not at all."""
        batches: dict[_Member, list[bytes]] = {}
        routes = self._routes
        for frame in frames:
            can_id = _CAN_ID.unpack_from(frame)[0]
            members = routes.get(can_id)
            for member in self._route(can_id) if members is None else members:
                if member in batches:
                    batches[member].append(frame)
                elif member is not source:
                    batches[member] = [frame]
        for member, batch in batches.items():
            try:
                member.sock.send(b"".join(batch))
            except BlockingIOError:
                member.health.note_rx_lost("frames came faster than they were read", len(batch))
            except OSError:
                continue  # it is about to leave

    def _route(self, can_id: int) -> tuple[_Member, ...]:
        with self._lock:
            if len(self._routes) >= _MOST_ROUTES:
                self._routes = {}
            members = tuple(member for member in self._members if member.wants(can_id))
            self._routes[can_id] = members
            return members

    def _end(self, reason: str) -> None:
        """Tell the members that the line is lost: their sockets end."""
        with self._lock:
            self.reason = reason or "connection closed"
            for member in self._members:
                member.sock.close()
        # at once, or a USB adapter that is plugged in again gets another name
        self._close_line()

    def _close(self) -> None:
        if _registry.get(_key(self.url)) is self:
            del _registry[_key(self.url)]
        self._stopping = True
        os.eventfd_write(self._wake, 1)
        self._thread.join()
        if not self.reason:
            self._close_line()
        os.close(self._wake)

    def _close_line(self) -> None:
        with contextlib.suppress(OSError, can.CanError):
            self._line.close()


_registry: dict[tuple[object, ...], SharedLine] = {}
_registry_lock = threading.Lock()


def _key(url: BusUrl) -> tuple[object, ...]:
    return url.interface, url.channel, url.options.get("host"), url.options.get("port")


def _settings(url: BusUrl) -> dict[str, Option]:
    return {key: value for key, value in url.options.items() if key != "lockstep"}


def _join(url: BusUrl, open_line: Callable[[BusUrl], Line], member: _Member) -> SharedLine:
    """Join the line of `url`, opening it where nobody in this process has; raises BusError."""
    with _registry_lock:
        shared = _registry.get(_key(url))
        if shared is not None and shared.reason:
            shared = None  # lost; those who still hold it leave by themselves
        if shared is None:
            shared = _registry[_key(url)] = SharedLine(url, open_line(url), member)
        elif _settings(shared.url) != _settings(url):
            raise BusError(f"{url}: is in use with other settings ({shared.url})")
        else:
            shared.add(member)
        return shared


class LinePort(PackedPort):
    """A FramePort on a shared line."""

    def __init__(
        self,
        url: BusUrl,
        open_line: Callable[[BusUrl], Line],
        filters: Filters | None,
        health: BusHealth | None = None,
        *,
        hears_errors: bool = False,
    ) -> None:
        """Join the line; raises BusError when it cannot be opened."""
        health = health if health is not None else BusHealth()
        self._member = _Member(filters, health, hears_errors=hears_errors)
        super().__init__(url, self._member.own_end, {}, health)
        try:
            self._shared = _join(url, open_line, self._member)
        except BaseException:
            self._member.own_end.close()
            self._member.sock.close()
            raise
        self.send = self._send
        self.close = self._close

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from now on."""
        self._shared.set_filters(self._member, filters)

    def _send(self, frame: Bytes) -> int:
        self._shared.write(frame, self._member)
        return FRAME_BYTES

    def _close(self) -> None:
        self._shared.leave(self._member)
        self._member.own_end.close()

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that tells why the bus cannot be used any more."""
        if self._shared.reason:
            return BusError(f"{self.url}: the bus has gone away ({self._shared.reason})")
        return super().lost(error)


class LineBus(PacketBus):
    """A python-can bus on a shared line."""

    _RECV_BYTES = FRAME_BYTES

    def __init__(
        self,
        url: BusUrl,
        open_line: Callable[[BusUrl], Line],
        health: BusHealth,
        can_filters: can.typechecking.CanFilters | None = None,
    ) -> None:
        """Join the line; raises BusError when it cannot be opened."""
        self._member = _Member([], health, hears_errors=True)
        try:
            self._shared = _join(url, open_line, self._member)
        except BaseException:
            self._is_shutdown = True  # python-can warns of buses that were not shut down
            self._member.own_end.close()
            self._member.sock.close()
            raise
        super().__init__(url.channel, str(url), self._member.own_end, can_filters)

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        pairs = None if filters is None else [pair_of(entry) for entry in filters]
        self._shared.set_filters(self._member, pairs)

    def _put(self, packet: bytes, timeout_s: float) -> None:  # noqa: ARG002  # the line has its own
        try:
            self._shared.write(packet, self._member)
        except OSError as error:
            raise self._gone(str(error.strerror or error)) from error

    def _gone(self, reason: str | None) -> can.CanOperationError:
        return super()._gone(self._shared.reason or reason)

    def shutdown(self) -> None:
        """Leave the line."""
        self._shared.leave(self._member)
        super().shutdown()
