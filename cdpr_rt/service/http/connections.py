"""Limits of connections and request rates, and the order in which requests are served."""

from __future__ import annotations

import asyncio
import fcntl
import math
import socket
import struct
import termios
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from typing import Any, Final, Protocol

MOST: Final = 64
MOST_OF_PEER: Final = 24
MOST_FOR_STOPS: Final = 16
"""Places beyond these, for connections that ask for nothing but a stop."""
MOST_PEERS: Final = 1024
"""Most peers of which rates are kept; the one not seen for longest is forgotten first."""
_STOP_S, _WORK_BESIDE_S = 0.03, 0.01
"""A stop is through its passes in that time; a piece of other work is done so often meanwhile."""
_CREDENTIALS: Final = struct.Struct("3i")  # struct ucred: pid, uid, gid
_SIZE: Final = struct.Struct("i")


class Connection(Protocol):
    """One connection."""

    transport: Any
    peer: str
    """Peer: a process of this machine, or an address."""
    is_authenticated: bool
    """Whether it has shown the key, or the token of who may move."""
    since_s: float
    """When it came, or was answered last."""
    stops_only: bool
    """Whether it was let in beyond the usual number."""

    @property
    def is_idle(self) -> bool:
        """Whether it has no complete request that waits for its answer."""


class ConnectionLimiter:
    """The connections to one listener; where they are too many, idle ones go first.

    Those who have shown the key or the token have places of their own, as many as the anonymous.
    Of idle ones those of who has many go before those of who has few, old ones before new ones.
    Where none is idle the pending may stay for a stop.
    """

    def __init__(self) -> None:
        self._all: dict[Connection, None] = {}

    def admit(self, connection: Connection) -> bool:
        """Take one in, at the cost of another perhaps; return whether there was room."""
        alike = [one for one in self._all if one.is_authenticated == connection.is_authenticated]
        usual = [one for one in alike if not one.stops_only]
        of_this = [one for one in usual if one.peer == connection.peer]
        self._all[connection] = None
        if len(of_this) >= MOST_OF_PEER:
            connection.stops_only = not self._evict_idle(of_this)
        elif len(usual) >= MOST:
            connection.stops_only = not self._evict_idle(usual)
        if not connection.stops_only:
            return True
        others = [one for one in self._all if one.stops_only and one is not connection]
        if len(others) < MOST_FOR_STOPS or self._evict_idle(others):
            return True
        del self._all[connection]
        return False

    def note_authenticated(self, connection: Connection) -> None:
        """Count one that came anonymous as authenticated, where a place of these is left."""
        known = [one for one in self._all if one.is_authenticated]
        of_this = [one for one in known if one.peer == connection.peer]
        connection.is_authenticated = len(known) < MOST and len(of_this) < MOST_OF_PEER

    def replace(self, connection: Connection, successor: Connection) -> None:
        """Replace `connection` by `successor`, which takes over its transport."""
        if connection in self._all:
            successor.stops_only = connection.stops_only
            successor.is_authenticated = connection.is_authenticated
            self._all[successor] = None
            del self._all[connection]

    def remove(self, connection: Connection) -> None:
        """One has left."""
        self._all.pop(connection, None)

    def _evict_idle(self, some: list[Connection]) -> bool:
        """End the first of `some` that is idle; return whether there was one."""
        counts = Counter(one.peer for one in some)
        idle = [one for one in some if one.is_idle]
        idle.sort(key=lambda one: (-counts[one.peer], one.since_s))
        for one in idle:
            if not _has_unread(one.transport):
                self.remove(one)
                one.transport.abort()
                return True
        return False


class TokenBuckets:
    """A bucket of `burst` tokens for each peer, filled at `rate_Hz`."""

    def __init__(self, rate_Hz: float, burst: float) -> None:
        self._rate_Hz = rate_Hz
        self._burst = burst
        self._peers: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, peer: str, now_s: float) -> bool:
        """Take a token of `peer`; return whether there was one."""
        left, before_s = self._peers.pop(peer, (self._burst, now_s))
        left = min(self._burst, left + (now_s - before_s) * self._rate_Hz)
        allowed = left >= 1.0
        self._peers[peer] = (left - 1.0 if allowed else left), now_s
        if len(self._peers) > MOST_PEERS:
            self._peers.popitem(last=False)
        return allowed


class FairQueue:
    """Ordinary work, a piece in each pass of the event loop: between two of them stops come in.

    However many connections ask at once, what is urgent waits for one piece of their work at most;
    and while a stop is on its way, there is one piece in 10 ms only. Those who have shown the key
    or the token queue apart: every other piece is theirs, however many others wait.
    """

    def __init__(self) -> None:
        self._way_until_s = self._worked_s = -math.inf
        self._next: deque[Callable[[], bool]] = deque()
        self._after: deque[Callable[[], bool]] = deque()
        self._authenticated = self._next
        self._anonymous = self._after
        self._goes_on = False

    def submit(self, work: Callable[[], bool], authenticated: bool = False) -> None:
        """Queue `work`; when it is called it returns whether anything was left to do."""
        (self._authenticated if authenticated else self._anonymous).append(work)
        if not self._goes_on:
            self._goes_on = True
            asyncio.get_running_loop().call_soon(self._pass)

    def yield_to_stop(self) -> None:
        """Have ordinary work step back for a moment: a stop has come."""
        self._way_until_s = asyncio.get_running_loop().time() + _STOP_S

    def _pass(self) -> None:
        loop = asyncio.get_running_loop()
        now_s = loop.time()
        if now_s < self._way_until_s and now_s - self._worked_s < _WORK_BESIDE_S:
            loop.call_later(_WORK_BESIDE_S / 4.0, self._pass)
            return
        self._worked_s = now_s
        try:
            while (waiting := self._next or self._after) and not waiting.popleft()():
                pass
            self._next, self._after = self._after, self._next
        finally:
            self._goes_on = bool(self._next or self._after)
            if self._goes_on:
                loop.call_soon(self._pass)


def peer_of(connection: socket.socket) -> tuple[str, int]:
    """Return who is at the other end: address and port, or a process of this machine and 0.

    Raises OSError where nobody is any more.
    """
    if connection.family == socket.AF_UNIX:
        data = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        pid, uid, _ = _CREDENTIALS.unpack(data)
        return f"process {pid} of user {uid}", 0
    host, port = connection.getpeername()[:2]
    return str(host), int(port)


def _has_unread(transport: Any) -> bool:
    """Whether something has come that was not looked at yet."""
    connection = transport.get_extra_info("socket")
    if connection is None or connection.fileno() < 0:
        return False
    size: int = _SIZE.unpack(fcntl.ioctl(connection, termios.FIONREAD, bytes(_SIZE.size)))[0]
    return size > 0
