"""A bus behind a socketcand server, by its ASCII protocol in raw mode."""

from __future__ import annotations

import errno
import re
import select
import socket
import threading
import time

from cdpr_drivers.bus.frames import (
    EFF_FLAG,
    EFF_MASK,
    ERR_FLAG,
    FRAME,
    RTR_FLAG,
    SEND_TIMEOUT_S,
    SFF_MASK,
    Bytes,
)
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

_OPTIONS = ("host", "port", "lockstep")
_ANSWER_S = 5.0
_READ_BYTES = 1 << 16
_LONGEST_MESSAGE = 4096
# a peer that stays silent (power or cable lost) counts as gone after about 3 s
_KEEPALIVE = (
    (socket.TCP_KEEPIDLE, 1),
    (socket.TCP_KEEPINTVL, 1),
    (socket.TCP_KEEPCNT, 2),
    (socket.TCP_USER_TIMEOUT, 3000),
)
_MESSAGE = re.compile(rb"<([^<>]*)>")


class SocketcandAdapter:
    """A connection to a socketcand server; unlike python-can's client, it reports when it ends."""

    def __init__(self, url: BusUrl) -> None:
        """Connect and enter raw mode; raises BusError."""
        for key in url.options:
            if key not in _OPTIONS:
                raise BusError(f"{url}: unknown option {key!r}; allowed: lockstep")
        self._url = url
        self._rest = b""
        self._lost = ""
        self._sending = threading.Lock()
        host, port = str(url.options["host"]), int(url.options["port"])
        try:
            self.sock = socket.create_connection((host, port), _ANSWER_S)
        except OSError as error:
            reason = error.strerror or error
            raise BusError(f"{url}: no socketcand server at {host}:{port} ({reason})") from None
        try:
            self.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            for option, value in _KEEPALIVE:
                self.sock.setsockopt(socket.IPPROTO_TCP, option, value)
            self._greet()
        except OSError as error:
            self.sock.close()
            raise BusError(
                f"{url}: the connection to the socketcand server is lost ({error})"
            ) from None
        except BusError:
            self.sock.close()
            raise
        self.sock.settimeout(SEND_TIMEOUT_S)
        self._early = self._take(b"")
        """Frames that arrived with the greeting."""

    def _greet(self) -> None:
        channel = self._url.channel
        for command, expected in (
            ("", b"hi"), (f"< open {channel} >", b"ok"), ("< rawmode >", b"ok")
        ):  # fmt: skip
            self.sock.sendall(command.encode())
            answer = self._answer()
            if answer != expected:
                said = answer.decode("ascii", "replace")
                raise BusError(
                    f"{self._url}: the server answers {said!r} to {command or 'the connection'!r}"
                    + (f"; does it have a bus {channel!r}?" if "open" in command else "")
                )

    def _answer(self) -> bytes:
        """Return the server's next message; what follows it stays in `_rest`."""
        deadline = time.monotonic() + _ANSWER_S
        while True:
            match = _MESSAGE.search(self._rest)
            if match is not None:
                self._rest = self._rest[match.end() :]
                return match[1].strip()
            if time.monotonic() > deadline:
                raise TimeoutError("no answer")
            data = self.sock.recv(_READ_BYTES)
            if not data:
                raise OSError("connection closed")
            self._rest = (self._rest + data)[-_LONGEST_MESSAGE:]

    def read(self, wake: int, /) -> list[bytes]:
        """Return the frames that arrived; raises OSError if the connection has ended."""
        if self._early:
            frames, self._early = self._early, []
            return frames
        ready, _, _ = select.select([self.sock.fileno(), wake], [], [])
        if self.sock.fileno() not in ready:
            return []
        try:
            data = self.sock.recv(_READ_BYTES)
        except OSError as error:
            raise self._lose(error.strerror) from None
        if not data:
            raise self._lose("it closed the connection")
        return self._take(data)

    def _lose(self, reason: str | None) -> OSError:
        """Mark the connection as unusable; return the error to raise."""
        self._lost = self._lost or f"lost the socketcand server: {reason}"
        return OSError(errno.ECONNRESET, self._lost)

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
        """Send a frame; raises OSError, also for remote frames, which the protocol lacks."""
        can_id, length, data = FRAME.unpack(frame)
        if can_id & RTR_FLAG:
            raise OSError(errno.EOPNOTSUPP, "socketcand cannot send remote frames")
        head = f"{can_id & EFF_MASK:08X}" if can_id & EFF_FLAG else f"{can_id & SFF_MASK:03X}"
        # two spaces if there is no data, as python-can's client sends it
        text = f"< send {head} {length} {data[:length].hex(' ')} >".encode()
        if self._lost:
            raise OSError(errno.ECONNRESET, self._lost)
        try:
            with self._sending:
                self.sock.sendall(text)
        except (BlockingIOError, TimeoutError):
            # half a message may have been sent: the server would not understand what follows
            raise self._lose("it accepts no frames") from None
        except OSError as error:
            raise self._lose(error.strerror) from None

    def close(self) -> None:
        """Disconnect from the server."""
        with self._sending:
            self.sock.close()


def _frame_of(message: bytes) -> bytes | None:
    """Return the frame in a message; None for other messages and for malformed ones.

    A frame without data leaves its last field empty; some servers put spaces between the octets.
    """
    kind, _, rest = message.strip().partition(b" ")
    if kind not in (b"frame", b"error"):
        return None
    fields = rest.split(b" ", 2)
    try:
        can_id = int(fields[0], 16)
        if kind == b"error":
            return FRAME.pack(can_id & EFF_MASK | ERR_FLAG, 8, b"")
        data = bytes.fromhex(fields[2].decode("ascii")) if len(fields) > 2 else b""
    except ValueError:
        return None
    if len(data) > 8:
        return None
    extended = len(fields[0]) > 3
    return FRAME.pack(
        can_id & EFF_MASK | EFF_FLAG if extended else can_id & SFF_MASK, len(data), data
    )
