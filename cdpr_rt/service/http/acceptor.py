"""Accepting connections: a descriptor for who has sent nothing yet, stops before all else."""

from __future__ import annotations

import asyncio
import errno
import select
import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final

from cdpr_rt.service.http.access_control import URGENT_PATHS
from cdpr_rt.service.http.connections import FairQueue, peer_of

STOPS: Final = tuple(f"POST {path} ".encode() for path in sorted(URGENT_PATHS))
"""How a request for a stop begins."""
LONGEST_STOP: Final = max(map(len, STOPS))
BACKLOG: Final = 1024
MOST_PENDING: Final = 256
_HEAD_BYTES: Final = 16384
_PENDING_S, _LOOK_S = 10.0, 2.0
_AT_ONCE: Final = 32
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_FULL_S, _TELL_AGAIN_S = 0.2, 10.0
_RESET: Final = struct.pack("ii", 1, 0)


def may_stop(head: bytes) -> bool:
    """Whether a request that begins so is one for a stop, or may turn out to be."""
    return head.startswith(STOPS) or any(stop.startswith(head) for stop in STOPS)


@dataclass(eq=False)
class _PendingConnection:
    sock: socket.socket
    peer: str
    since_s: float
    is_queued: bool = False
    """Whether it has sent something, and is queued."""
    is_head_read: bool = False
    """Whether its head is whole, or longer than is looked at."""
    is_authenticated: bool = False
    """Whether it has shown the key or the token."""


class Acceptor:
    """Accepts what comes to `listener`; has `factory` make the protocol of who says something.

    `is_authenticated` says whether a request's head shows the key or the token. A request for a
    stop is attended to at once where `has_priority` says so of an authenticated connection or of an
    anonymous one, all others by way of `queue`. `factory` is given whether the connection is
    authenticated, and whether its first request has priority. Who sends nothing is ended after
    10 s, and earlier where more than 256 are pending: of the peer that has most, the oldest. `tell`
    is called, now and then, when the system gives no descriptor more.
    """

    def __init__(
        self,
        listener: socket.socket,
        factory: Callable[[bool, bool], asyncio.Protocol],
        is_authenticated: Callable[[bytes], bool],
        has_priority: Callable[[bool], bool],
        queue: FairQueue,
        tell: Callable[[str], None],
    ) -> None:
        self._listener = listener
        self._factory, self._is_authenticated = factory, is_authenticated
        self._has_priority = has_priority
        self._queue = queue
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._pending: dict[int, _PendingConnection] = {}
        self._of_peer: dict[str, dict[int, None]] = {}
        self._handovers: set[asyncio.Task[object]] = set()
        self._told_s = -_TELL_AGAIN_S
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self._epoll = select.epoll()
        listener.setblocking(False)
        listener.listen(BACKLOG)
        self._loop.add_reader(self._epoll, self._poll)
        self._listen()
        self._end_expired()

    def close(self) -> None:
        """Accept no more, and end those that are pending."""
        if self._epoll.closed:
            return
        for timer in self._timers.values():
            timer.cancel()
        self._loop.remove_reader(self._listener)
        self._loop.remove_reader(self._epoll)
        for pending in list(self._pending.values()):
            self._remove(pending).close()
        self._epoll.close()

    async def wait_closed(self) -> None:
        """Wait until those that are being handed over have been."""
        await asyncio.gather(*self._handovers, return_exceptions=True)

    def _listen(self) -> None:
        self._loop.add_reader(self._listener, self._accept)

    def _accept(self) -> None:
        for _ in range(_AT_ONCE):
            try:
                sock, _ = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                if error.errno not in _FULL:
                    raise
                self._out_of_descriptors(error)
                return
            sock.setblocking(False)
            try:
                peer, _ = peer_of(sock)
            except OSError:  # it has gone already
                sock.close()
                continue
            self._add(_PendingConnection(sock, peer, self._loop.time()))

    def _add(self, pending: _PendingConnection) -> None:
        if len(self._pending) >= MOST_PENDING:
            self._evict_one()
        fd = pending.sock.fileno()
        self._pending[fd] = pending
        self._of_peer.setdefault(pending.peer, {})[fd] = None
        # at each arrival once: what is not a whole word yet does not wake us up for ever
        self._epoll.register(fd, select.EPOLLIN | select.EPOLLRDHUP | select.EPOLLET)
        self._peek(pending)

    def _poll(self) -> None:
        """Look at what has been sent now."""
        for fd, _ in self._epoll.poll(0, _AT_ONCE):
            self._peek(self._pending[fd])

    def _peek(self, pending: _PendingConnection) -> None:
        if pending.is_head_read:
            return
        try:
            head = pending.sock.recv(_HEAD_BYTES, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError:
            head = b""
        pending.is_head_read = b"\r\n\r\n" in head or len(head) == _HEAD_BYTES
        pending.is_authenticated = pending.is_head_read and self._is_authenticated(head)
        stops = head.startswith(STOPS)
        if stops and self._has_priority(pending.is_authenticated):
            self._hand_over(pending, has_priority=True)
        elif not head:
            self._remove(pending).close()
        elif (stops or not may_stop(head)) and (pending.is_authenticated or not pending.is_queued):
            # the rest of a head that comes later may show the key: then among those who have it
            pending.is_queued = True
            self._queue.submit(partial(self._run_queued, pending), pending.is_authenticated)

    def _run_queued(self, pending: _PendingConnection) -> bool:
        if self._pending.get(pending.sock.fileno()) is not pending:
            return False  # it had to make room meanwhile
        self._hand_over(pending)
        return True

    def _hand_over(self, pending: _PendingConnection, has_priority: bool = False) -> None:
        sock = self._remove(pending)
        made = partial(self._factory, pending.is_authenticated, has_priority)
        task = self._loop.create_task(self._connect(sock, made))
        self._handovers.add(task)
        task.add_done_callback(self._handovers.discard)

    async def _connect(self, sock: socket.socket, made: Callable[[], asyncio.Protocol]) -> None:
        with suppress(OSError):  # it has gone meanwhile
            await self._loop.connect_accepted_socket(made, sock)

    def _remove(self, pending: _PendingConnection) -> socket.socket:
        fd = pending.sock.fileno()
        self._epoll.unregister(fd)
        del self._pending[fd]
        of_peer = self._of_peer[pending.peer]
        del of_peer[fd]
        if not of_peer:
            del self._of_peer[pending.peer]
        return pending.sock

    def _evict_one(self) -> None:
        """End the oldest of the peer that has most: the silent first, then the anonymous."""
        some = [self._pending[fd] for fd in max(self._of_peer.values(), key=len)]
        self._end(min(some, key=lambda one: (one.is_authenticated, one.is_queued)))

    def _end(self, pending: _PendingConnection) -> None:
        sock = self._remove(pending)
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
        sock.close()

    def _end_expired(self) -> None:
        until_s = self._loop.time() - _PENDING_S
        for pending in [one for one in self._pending.values() if one.since_s < until_s]:
            self._end(pending)
        self._timers["look"] = self._loop.call_later(_LOOK_S, self._end_expired)

    def _out_of_descriptors(self, error: OSError) -> None:
        """No descriptor is left: take one from who says nothing, or try again in a moment."""
        now_s = self._loop.time()
        if now_s - self._told_s >= _TELL_AGAIN_S:
            self._told_s = now_s
            self._tell(f"no connection more can be taken: {error.strerror}")
        if self._pending:
            self._evict_one()
            return
        self._loop.remove_reader(self._listener)
        self._timers["listen"] = self._loop.call_later(_FULL_S, self._listen)
