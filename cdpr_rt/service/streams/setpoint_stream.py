"""UDP receiver of the set-point stream: a thread of its own beside the rest of the service."""

from __future__ import annotations

import contextlib
import ipaddress
import math
import select
import socket
import time
from collections.abc import Callable
from typing import Any, Final

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.errors import ControlError
from cdpr_rt.service.lease import Lease
from cdpr_rt.service.part import Part
from cdpr_rt.service.streams.stream_packet import LONGEST_BYTES
from cdpr_rt.service.streams.stream_sessions import Address, StreamSessionManager

_TURN_S: Final = 0.01
_MOST_A_TURN: Final = 100
"""Packets taken in one turn of 10 ms; of a flood the rest is left to the kernel to drop."""
_LOOK_S: Final = 0.1


class StreamError(ControlError):
    """The stream cannot be opened at this address; the message says what is allowed."""


class SetpointStream(Part):
    """Takes packets from `sock`, as `listen_udp` returns one, from `start` until `stop`.

    Set-points go into `block` while their sender has the right to move, which `lease` gives.
    Without a `key` only sessions are served that `sessions.issue` has returned. Raises
    ControlError for a key that is too short.
    """

    name = "stream"

    def __init__(
        self,
        block: SharedBlock,
        lease: Lease,
        sock: socket.socket,
        key: bytes | None = None,
        ended: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__("set-point stream", ended)
        self.sessions = StreamSessionManager(block, lease, key)
        self._sock = sock
        host, port = sock.getsockname()[:2]
        self.address: tuple[str, int] = host, port
        """The host and the port it listens at."""
        self._holders: _HoldersSocket | None = None

    def stop(self) -> None:
        """Stop; whoever holds the stream loses it."""
        super().stop()
        self.sessions.close()
        self._follow_holder(self._sock)
        self._sock.close()

    def status(self) -> dict[str, Any]:
        """Return who holds it, the delay there and back, the packets counted, what is wrong."""
        holder, delay_s = self.sessions.holder, self.sessions.round_trip_s
        return {
            "address": "{}:{}".format(*self.address),
            "holder": None if holder is None else f"{holder[0]}:{holder[1]}",
            "round_trip_s": None if math.isnan(delay_s) else delay_s,
            "packets": dict(self.sessions.counts),
            "error": self._error,
        }

    def _serve(self) -> None:
        buffer = memoryview(bytearray(LONGEST_BYTES + 1))
        first = self._sock
        while not self._end.is_set():
            socks = [first] if self._holders is None else [self._holders.sock, first]
            readable = _readable(socks)
            begin = time.monotonic()
            # the holder's own socket first: a flood of others' packets does not push it aside
            taken = sum(self._take(sock, buffer) for sock in socks if sock.fileno() in readable)
            self.sessions.expire(time.monotonic_ns())
            self._follow_holder(first)
            if taken >= _MOST_A_TURN:
                self._end.wait(max(0.0, begin + _TURN_S - time.monotonic()))

    def _take(self, sock: socket.socket, buffer: memoryview) -> int:
        for count in range(_MOST_A_TURN):
            try:
                size, address = sock.recvfrom_into(buffer, 0, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return count
            except OSError:
                continue  # what an earlier answer came to: nobody listens there any more
            answer = self.sessions.receive(bytes(buffer[:size]), address, time.monotonic_ns())
            if answer is not None:
                with contextlib.suppress(OSError):
                    sock.sendto(answer, address)
        return _MOST_A_TURN

    def _follow_holder(self, first: socket.socket) -> None:
        """Give the holder of the stream a socket of its own, and take that of the last one."""
        holder = self.sessions.holder
        if self._holders is not None and self._holders.address != holder:
            self._holders.sock.close()
            self._holders = None
        if holder is not None and self._holders is None:
            with contextlib.suppress(OSError):  # the first one serves as well
                self._holders = _HoldersSocket(first, holder)


class _HoldersSocket:
    """A second socket at the same address that gets the packets of one sender only.

    It has a queue of its own in the kernel.
    """

    def __init__(self, first: socket.socket, holder: Address) -> None:
        self.address = holder
        self.sock = socket.socket(first.family, socket.SOCK_DGRAM)
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self.sock.bind(first.getsockname())
        self.sock.connect(holder)


def _readable(socks: list[socket.socket]) -> set[int]:
    """Wait for packets for a moment; return the descriptors of sockets that have some.

    By poll, as `select` fails at descriptors from 1024, which many connections make.
    """
    poll = select.poll()
    for sock in socks:
        poll.register(sock, select.POLLIN)
    return {fd for fd, _ in poll.poll(1000.0 * _LOOK_S)}


def is_loopback(host: str) -> bool:
    """Return whether `host` reaches this machine only; raises StreamError for no address."""
    return all(ipaddress.ip_address(info[4][0]).is_loopback for info in _addresses(host, 0))


def _addresses(host: str, port: int) -> list[tuple[Any, ...]]:
    try:
        return socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StreamError(f"set-point stream: {host!r} is no address ({reason})") from None


def listen_udp(host: str, port: int, has_key: bool = False) -> socket.socket:
    """Return a socket for a stream at `host` and `port` (0: any free one).

    Raises StreamError for an address that cannot be listened at, and for one other than loopback
    without a key.
    """
    if not has_key and not is_loopback(host):
        raise StreamError(
            f"set-point stream: {host} is not loopback, and no key is shared; give a key "
            "file, or listen at 127.0.0.1"
        )
    family, kind, _, _, address = _addresses(host, port)[0]
    sock = socket.socket(family, kind)
    try:
        sock.bind(address)
        # only now, so that nobody else who listens there goes unnoticed; for the holder's socket
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    except OSError as error:
        sock.close()
        raise StreamError(f"set-point stream: {host} port {port}: {error.strerror}") from None
    return sock
