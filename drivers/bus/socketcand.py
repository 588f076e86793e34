"""A bus behind a socketcand server, by its ASCII protocol in raw mode."""

from __future__ import annotations

import errno
import re
import select
import socket
import threading
import time

from drivers.bus.packed import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG, SEND_TIMEOUT_S, Bytes
from drivers.bus.url import BusUrl
from drivers.errors import BusError

_OPTIONS = ("host", "port", "lockstep")
_ANSWER_S = 5.0
_READ_BYTES = 1 << 16
_LONGEST_MESSAGE = 4096
_EFF_MASK = 0x1FFFFFFF
# a peer that falls silent for good (power, cable) is given up after about 3 s
_KEEPALIVE = (
    (socket.TCP_KEEPIDLE, 1),
    (socket.TCP_KEEPINTVL, 1),
    (socket.TCP_KEEPCNT, 2),
    (socket.TCP_USER_TIMEOUT, 3000),
)
_MESSAGE = re.compile(rb"<([^<>]*)>")


class SocketcandLine:
    """A connection to a socketcand server; its end is an error, which python-can's does not say."""

    def __init__(self, url: BusUrl) -> None:
        """Connect and enter raw mode; raises BusError."""
        for key in url.options:
            if key not in _OPTIONS:
                raise BusError(f"{url}: unknown option {key!r}; allowed: lockstep")
        self._url = url
        self._rest = b""
        self._early: list[bytes] = []
        self._sending = threading.Lock()
        host, port = str(url.options["host"]), int(url.options["port"])
        try:
            self._sock = socket.create_connection((host, port), _ANSWER_S)
        except OSError as error:
            reason = error.strerror or error
            raise BusError(f"{url}: no socketcand server at {host}:{port} ({reason})") from None
        try:
            self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            for option, value in _KEEPALIVE:
                self._sock.setsockopt(socket.IPPROTO_TCP, option, value)
            self._greet()
        except OSError as error:
            self._sock.close()
            raise BusError(f"{url}: the socketcand server went away ({error})") from None
        except BusError:
            self._sock.close()
            raise
        self._sock.settimeout(SEND_TIMEOUT_S)
        self._early = self._take(b"")

    def _greet(self) -> None:
        channel = self._url.channel
        for command, wanted in (
            ("", b"hi"), (f"< open {channel} >", b"ok"), ("< rawmode >", b"ok")
        ):  # fmt: skip
            self._sock.sendall(command.encode())
            answer = self._answer()
            if answer != wanted:
                said = answer.decode("ascii", "replace")
                raise BusError(
                    f"{self._url}: the server answers {said!r} to {command or 'the connection'!r}"
                    + (f"; has it a bus {channel!r}?" if "open" in command else "")
                )

    def _answer(self) -> bytes:
        """Return the next message; frames that come already are kept."""
        deadline = time.monotonic() + _ANSWER_S
        while True:
            match = _MESSAGE.search(self._rest)
            if match is not None:
                self._rest = self._rest[match.end() :]
                return match[1].strip()
            if time.monotonic() > deadline:
                raise TimeoutError("no answer")
            data = self._sock.recv(_READ_BYTES)
            if not data:
                raise OSError("connection closed")
            self._rest = (self._rest + data)[-_LONGEST_MESSAGE:]

    def read(self, wake: int, /) -> list[bytes]:
        """Return the frames that came in; raises OSError when the connection has ended."""
        if self._early:
            frames, self._early = self._early, []
            return frames
        ready, _, _ = select.select([self._sock.fileno(), wake], [], [])
        if self._sock.fileno() not in ready:
            return []
        try:
            data = self._sock.recv(_READ_BYTES)
        except OSError as error:
            raise OSError(error.errno, f"lost the socketcand server: {error.strerror}") from None
        if not data:
            raise OSError(errno.ECONNRESET, "lost the socketcand server: it closed the connection")
        return self._take(data)

    def _take(self, data: bytes) -> list[bytes]:
        text = self._rest + data
        frames, end = [], 0
        for match in _MESSAGE.finditer(text):
            end = match.end()
            frame = _frame_of(match[1])
            if frame is not None:
                frames.append(frame)
        self._rest = text[end:][-_LONGEST_MESSAGE:]
        return frames

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; raises OSError, also for remote frames, which the protocol has not."""
        can_id, length, data = FRAME.unpack(frame)
        if can_id & RTR_FLAG:
            raise OSError(errno.EOPNOTSUPP, "socketcand carries no remote frames")
        head = f"{can_id & _EFF_MASK:08X}" if can_id & EFF_FLAG else f"{can_id & 0x7FF:03X}"
        # without data two spaces, as python-can's own client sends it
        text = f"< send {head} {length} {data[:length].hex(' ')} >".encode()
        with self._sending:
            self._sock.sendall(text)

    def close(self) -> None:
        """Leave the server."""
        with self._sending:
            self._sock.close()


def _frame_of(message: bytes) -> bytes | None:
    """Return the frame that a message tells of; None for other messages and for rubbish.

    A frame without data leaves its last field empty; some servers put spaces between the octets.
    """
    kind, _, rest = message.strip().partition(b" ")
    if kind not in (b"frame", b"error"):
        return None
    fields = rest.split(b" ", 2)
    try:
        can_id = int(fields[0], 16)
        if kind == b"error":
            return FRAME.pack(can_id & _EFF_MASK | ERR_FLAG, 8, b"")
        data = bytes.fromhex(fields[2].decode("ascii")) if len(fields) > 2 else b""
    except ValueError:
        return None
    if len(data) > 8:
        return None
    extended = len(fields[0]) > 3
    return FRAME.pack(
        can_id & _EFF_MASK | EFF_FLAG if extended else can_id & 0x7FF, len(data), data
    )


def open_socketcand(url: BusUrl) -> SocketcandLine:
    """Connect to the server that `url` names; raises BusError."""
    return SocketcandLine(url)
