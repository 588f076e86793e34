"""Both ends of the socket by which a stop reaches the loop without the service.

One datagram requests one stop. It carries a descriptor through which the loop answers once, so the
sender also notices if the loop ends without an answer.
"""

from __future__ import annotations

import array
import json
import os
import re
import select
import socket
import struct
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

STOPS: Final = frozenset({"hold", "disable", "shutdown"})
"""Commands that every local client may send, at any time."""
STOP_SUFFIX: Final = ".stop"
_MOST_BYTES: Final = 1024
_MOST_REPLY_BYTES: Final = 1 << 16
_MOST_UNANSWERED: Final = 32
"""Largest number of descriptors kept for answers; a further stop is carried out and answered
immediately."""
_CREDENTIALS: Final = struct.Struct("3i")  # struct ucred: pid, uid, gid
_FD_BYTES: Final = array.array("i").itemsize
_ANCILLARY: Final = socket.CMSG_SPACE(_CREDENTIALS.size) + socket.CMSG_SPACE(_FD_BYTES)
_CLIENT: Final = re.compile(r"[ -~]{1,64}")


class StopRequest:
    """One stop request; answered at most once."""

    def __init__(self, do: str, client: str, reply: socket.socket | None) -> None:
        self.do, self.client = do, client
        self._reply = reply
        self.is_surplus = False
        """Whether this stop must be answered immediately, because too many stops wait for an
        answer."""

    @property
    def is_open(self) -> bool:
        """Whether the sender may still be answered."""
        return self._reply is not None

    def answer(self, fields: Mapping[str, Any]) -> None:
        """Send the answer; never waits."""
        if self._reply is None:
            return
        with self._reply as sock, suppress(OSError):  # the sender has gone
            sock.send(json.dumps(fields).encode(), socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        self._reply = None


class StopSocket:
    """The loop's end: a datagram socket at `path`, for the loop's own user and root."""

    def __init__(self, path: Path) -> None:
        """Replace a socket that a killed loop has left at `path`. Raises OSError."""
        self.path = path
        self._taken = 0
        self._last: StopRequest | None = None
        self._unanswered: list[StopRequest] = []
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        path.unlink(missing_ok=True)
        mask = os.umask(0o177)
        try:
            self._sock.bind(str(path))
        finally:
            os.umask(mask)
        self._poll = select.poll()
        self._poll.register(self._sock, select.POLLIN)

    def take(self) -> StopRequest | None:
        """Return the next stop, or None, without waiting. Ignore anything that is not a stop."""
        if not self._poll.poll(0):
            return None
        data, ancillary, _, _ = self._sock.recvmsg(
            _MOST_BYTES, _ANCILLARY, socket.MSG_DONTWAIT | socket.MSG_CMSG_CLOEXEC
        )
        uid, reply = _unpacked(ancillary)
        request = _parsed(data, reply) if uid in (0, os.geteuid()) else None
        if request is None:
            if reply is not None:
                reply.close()
            return None
        self._unanswered = [one for one in self._unanswered if one.is_open]
        request.is_surplus = len(self._unanswered) >= _MOST_UNANSWERED
        if not request.is_surplus:
            self._unanswered.append(request)
        self._taken += 1
        self._last = request
        return request

    def figures(self) -> dict[str, Any]:
        """Return the number of stops taken, the last stop and its sender."""
        last = self._last
        return {} if last is None else {"taken": self._taken, "do": last.do, "client": last.client}

    def close(self) -> None:
        """Remove the socket; clients that still wait then see that the loop has ended."""
        self.path.unlink(missing_ok=True)
        self._sock.close()
        self._unanswered.clear()
        self._last = None


def _unpacked(ancillary: list[tuple[int, int, bytes]]) -> tuple[int | None, socket.socket | None]:
    """Return the sender's user and the socket for the answer; each is None if it is missing."""
    uid, reply = None, None
    for level, kind, data in ancillary:
        if level != socket.SOL_SOCKET:
            continue
        if kind == socket.SCM_CREDENTIALS and len(data) == _CREDENTIALS.size:
            _, uid, _ = _CREDENTIALS.unpack(data)
        elif kind == socket.SCM_RIGHTS:
            first, *more = array.array("i", data[: len(data) // _FD_BYTES * _FD_BYTES])
            try:
                reply = socket.socket(fileno=first)
            except OSError:  # the descriptor is not a socket
                more.append(first)
            for fd in more:
                os.close(fd)
    return uid, reply


def _parsed(data: bytes, reply: socket.socket | None) -> StopRequest | None:
    try:
        fields = json.loads(data)
    except (ValueError, RecursionError):
        return None
    if not isinstance(fields, dict):
        return None
    do, client = fields.get("do"), fields.get("client")
    if not (isinstance(do, str) and do in STOPS):
        return None
    named = isinstance(client, str) and _CLIENT.fullmatch(client)
    return StopRequest(do, str(client) if named else "somebody", reply)


class StopUnansweredError(Exception):
    """The loop has not answered in time."""


def send_stop(path: Path, do: str, client: str, wait_s: float) -> dict[str, Any] | None:
    """Request a stop from the loop with its socket at `path`; return its answer.

    Returns None if no loop reads there, or if the loop ended without an answer. Raises
    StopUnansweredError if the loop has not answered within `wait_s`, and PermissionError for
    another user's loop.
    """
    request = json.dumps({"do": do, "client": client}).encode()
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        ours.settimeout(wait_s)
        sock.settimeout(wait_s)
        rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [theirs.fileno()]))]
        try:
            with theirs:
                sock.connect(str(path))
                sock.sendmsg([request], rights)
            reply = ours.recv(_MOST_REPLY_BYTES)
        except TimeoutError:
            raise StopUnansweredError(f"the loop has not answered within {wait_s:g} s") from None
        except PermissionError:
            raise
        except OSError:
            return None
    answer: dict[str, Any] | None = json.loads(reply) if reply else None
    return answer
