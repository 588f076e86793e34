"""Accepting connections: a descriptor for who has said nothing yet, stops before all else."""

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

from cdpr_rt.service.auth import URGENT_PATHS
from cdpr_rt.service.connections import Turns, peer_of

STOPS: Final = tuple(f"POST {path} ".encode() for path in sorted(URGENT_PATHS))
"""How a request for a stop begins."""
LONGEST_STOP: Final = max(map(len, STOPS))
BACKLOG: Final = 1024
MOST_SILENT: Final = 256
_HEAD_BYTES: Final = 16384
_SILENT_S, _LOOK_S = 10.0, 2.0
_AT_ONCE: Final = 32
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_FULL_S, _TELL_AGAIN_S = 0.2, 10.0
_RESET: Final = struct.pack("ii", 1, 0)


def may_stop(head: bytes) -> bool:
    """Whether a request that begins so is one for a stop, or may turn out to be."""
    return head.startswith(STOPS) or any(stop.startswith(head) for stop in STOPS)


@dataclass(eq=False)
class _Newcomer:
    sock: socket.socket
    peer: str
    since_s: float
    asks: bool = False
    """Whether it has said something, and waits for its turn."""
    is_heard: bool = False
    """Whether its head is whole, or longer than is looked at."""
    is_known: bool = False
    """Whether it has shown the key or the token."""


class Reception:
    """Accepts what comes to `listener`; has `factory` make the protocol of who says something.

    A request for a stop is attended to at once where `goes_first` says so of who is known or not,
    all others in their turn: those whose head `knows` finds the key or the token in apart from
    strangers. `factory` is told whether one is known, and whether it goes first. Who says nothing
    is ended after 10 s, and earlier where more than 256 wait: of the peer that has most, the
    oldest. `tell` is told, now and then, that the system gives no descriptor more.
    """

    def __init__(
        self,
        listener: socket.socket,
        factory: Callable[[bool, bool], asyncio.Protocol],
        knows: Callable[[bytes], bool],
        goes_first: Callable[[bool], bool],
        turns: Turns,
        tell: Callable[[str], None],
    ) -> None:
        self._listener = listener
        self._factory, self._knows = factory, knows
        self._goes_first = goes_first
        self._turns = turns
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._silent: dict[int, _Newcomer] = {}
        self._of_peer: dict[str, dict[int, None]] = {}
        self._entering: set[asyncio.Task[object]] = set()
        self._told_s = -_TELL_AGAIN_S
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self._epoll = select.epoll()
        listener.setblocking(False)
        listener.listen(BACKLOG)
        self._loop.add_reader(self._epoll, self._look)
        self._listen()
        self._end_the_silent()

    def close(self) -> None:
        """Accept nobody more, and end those who have said nothing."""
        if self._epoll.closed:
            return
        for timer in self._timers.values():
            timer.cancel()
        self._loop.remove_reader(self._listener)
        self._loop.remove_reader(self._epoll)
        for newcomer in list(self._silent.values()):
            self._part_from(newcomer).close()
        self._epoll.close()

    async def wait_closed(self) -> None:
        """Wait until those who are about to enter have done so."""
        await asyncio.gather(*self._entering, return_exceptions=True)

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
                self._make_do(error)
                return
            sock.setblocking(False)
            try:
                peer, _ = peer_of(sock)
            except OSError:  # it has gone already
                sock.close()
                continue
            self._receive(_Newcomer(sock, peer, self._loop.time()))

    def _receive(self, newcomer: _Newcomer) -> None:
        if len(self._silent) >= MOST_SILENT:
            self._dismiss_one()
        fd = newcomer.sock.fileno()
        self._silent[fd] = newcomer
        self._of_peer.setdefault(newcomer.peer, {})[fd] = None
        # at each arrival once: what is not a whole word yet does not wake us up for ever
        self._epoll.register(fd, select.EPOLLIN | select.EPOLLRDHUP | select.EPOLLET)
        self._listen_to(newcomer)

    def _look(self) -> None:
        """See what those have to say who have said something now."""
        for fd, _ in self._epoll.poll(0, _AT_ONCE):
            self._listen_to(self._silent[fd])

    def _listen_to(self, newcomer: _Newcomer) -> None:
        if newcomer.is_heard:
            return
        try:
            head = newcomer.sock.recv(_HEAD_BYTES, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError:
            head = b""
        newcomer.is_heard = b"\r\n\r\n" in head or len(head) == _HEAD_BYTES
        newcomer.is_known = newcomer.is_heard and self._knows(head)
        stops = head.startswith(STOPS)
        if stops and self._goes_first(newcomer.is_known):
            self._enter(newcomer, goes_first=True)
        elif not head:
            self._part_from(newcomer).close()
        elif (stops or not may_stop(head)) and (newcomer.is_known or not newcomer.asks):
            # the rest of a head that comes later may show the key: then among those who have it
            newcomer.asks = True
            self._turns.ask(partial(self._have_turn, newcomer), newcomer.is_known)

    def _have_turn(self, newcomer: _Newcomer) -> bool:
        if self._silent.get(newcomer.sock.fileno()) is not newcomer:
            return False  # it had to make room meanwhile
        self._enter(newcomer)
        return True

    def _enter(self, newcomer: _Newcomer, goes_first: bool = False) -> None:
        sock = self._part_from(newcomer)
        made = partial(self._factory, newcomer.is_known, goes_first)
        task = self._loop.create_task(self._connect(sock, made))
        self._entering.add(task)
        task.add_done_callback(self._entering.discard)

    async def _connect(self, sock: socket.socket, made: Callable[[], asyncio.Protocol]) -> None:
        with suppress(OSError):  # it has gone meanwhile
            await self._loop.connect_accepted_socket(made, sock)

    def _part_from(self, newcomer: _Newcomer) -> socket.socket:
        fd = newcomer.sock.fileno()
        self._epoll.unregister(fd)
        del self._silent[fd]
        of_peer = self._of_peer[newcomer.peer]
        del of_peer[fd]
        if not of_peer:
            del self._of_peer[newcomer.peer]
        return newcomer.sock

    def _dismiss_one(self) -> None:
        """End the oldest of the peer that has most: one that has said nothing, else a stranger."""
        some = [self._silent[fd] for fd in max(self._of_peer.values(), key=len)]
        self._end(min(some, key=lambda one: (one.is_known, one.asks)))

    def _end(self, newcomer: _Newcomer) -> None:
        sock = self._part_from(newcomer)
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
        sock.close()

    def _end_the_silent(self) -> None:
        until_s = self._loop.time() - _SILENT_S
        for newcomer in [one for one in self._silent.values() if one.since_s < until_s]:
            self._end(newcomer)
        self._timers["look"] = self._loop.call_later(_LOOK_S, self._end_the_silent)

    def _make_do(self, error: OSError) -> None:
        """No descriptor is left: take one from who says nothing, or try again in a moment."""
        now_s = self._loop.time()
        if now_s - self._told_s >= _TELL_AGAIN_S:
            self._told_s = now_s
            self._tell(f"no connection more can be taken: {error.strerror}")
        if self._silent:
            self._dismiss_one()
            return
        self._loop.remove_reader(self._listener)
        self._timers["listen"] = self._loop.call_later(_FULL_S, self._listen)
