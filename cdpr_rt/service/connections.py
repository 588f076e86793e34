"""Connections: who may keep one where there are too many, and whose turn it is."""

from __future__ import annotations

import asyncio
import fcntl
import math
import socket
import struct
import termios
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, Final, Protocol

MOST: Final = 64
MOST_OF_ONE: Final = 24
MOST_FOR_STOPS: Final = 16
"""Places beyond these, for connections that ask for nothing but a stop."""
_STOP_S, _WORK_BESIDE_S = 0.03, 0.01
"""A stop is through its passes in that time; a piece of other work is done so often meanwhile."""
_CREDENTIALS: Final = struct.Struct("3i")  # struct ucred: pid, uid, gid
_SIZE: Final = struct.Struct("i")


class Guest(Protocol):
    """One connection."""

    transport: Any
    peer: str
    """Whose it is: a process of this machine, or an address."""
    is_known: bool
    """Whether it has shown the key, or the token of who may move; strangers take no place of it."""
    since_s: float
    """When it came, or was answered last."""
    stops_only: bool
    """Whether it was let in beyond the usual number."""

    @property
    def is_idle(self) -> bool:
        """Whether it has no complete request that waits for its answer."""


class Connected(Protocol):
    """A socket, also as asyncio lets one have it."""

    @property
    def family(self) -> int:
        """Of its address."""

    def getsockopt(self, level: int, name: int, size: int, /) -> bytes:
        """Return an option's bytes."""

    def getpeername(self) -> Any:
        """Return the address of the other end."""


class Guests:
    """The connections to one listener; where they are too many, idle ones go first.

    Those who have shown the key or the token have places of their own, as many as strangers have.
    Of idle ones those of who has many go before those of who has few, old ones before new ones.
    Where none is idle the newcomer may stay for a stop.
    """

    def __init__(self) -> None:
        self._all: dict[Guest, None] = {}

    def admit(self, guest: Guest) -> bool:
        """Take one in, at the cost of another perhaps; return whether there was room."""
        alike = [one for one in self._all if one.is_known == guest.is_known]
        usual = [one for one in alike if not one.stops_only]
        of_this = [one for one in usual if one.peer == guest.peer]
        self._all[guest] = None
        if len(of_this) >= MOST_OF_ONE:
            guest.stops_only = not self._dismiss(of_this)
        elif len(usual) >= MOST:
            guest.stops_only = not self._dismiss(usual)
        if not guest.stops_only:
            return True
        others = [one for one in self._all if one.stops_only and one is not guest]
        if len(others) < MOST_FOR_STOPS or self._dismiss(others):
            return True
        del self._all[guest]
        return False

    def recognise(self, guest: Guest) -> None:
        """Count one that came as a stranger among the known, where a place of theirs is left."""
        known = [one for one in self._all if one.is_known]
        of_this = [one for one in known if one.peer == guest.peer]
        guest.is_known = len(known) < MOST and len(of_this) < MOST_OF_ONE

    def take_over(self, guest: Guest, successor: Guest) -> None:
        """Have `successor` in the place of `guest`, whose connection it goes on with."""
        if guest in self._all:
            successor.stops_only = guest.stops_only
            successor.is_known = guest.is_known
            self._all[successor] = None
            del self._all[guest]

    def forget(self, guest: Guest) -> None:
        """One has left."""
        self._all.pop(guest, None)

    def _dismiss(self, some: list[Guest]) -> bool:
        """End the first of `some` that is idle; return whether there was one."""
        counts = Counter(one.peer for one in some)
        idle = [one for one in some if one.is_idle]
        idle.sort(key=lambda one: (-counts[one.peer], one.since_s))
        for one in idle:
            if not _has_unread(one.transport):
                self.forget(one)
                one.transport.abort()
                return True
        return False


class Turns:
    """Ordinary work, a piece in each pass of the event loop: between two of them stops come in.

    However many connections ask at once, what is urgent waits for one piece of their work at most;
    and while a stop is on its way, there is one piece in 10 ms only. Those who have shown the key
    or the token queue apart: every other piece is theirs, however many strangers wait.
    """

    def __init__(self) -> None:
        self._way_until_s = self._worked_s = -math.inf
        self._next: deque[Callable[[], bool]] = deque()
        self._after: deque[Callable[[], bool]] = deque()
        self._known = self._next
        self._strangers = self._after
        self._goes_on = False

    def ask(self, work: Callable[[], bool], known: bool = False) -> None:
        """Have `work` called when it is its turn; it returns whether anything was left to do."""
        (self._known if known else self._strangers).append(work)
        if not self._goes_on:
            self._goes_on = True
            asyncio.get_running_loop().call_soon(self._pass)

    def give_way(self) -> None:
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


def peer_of(connection: Connected) -> tuple[str, int]:
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
