"""A bus behind a socketcand server, by its ASCII protocol in raw mode."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import select
import socket
import sys
import threading
import time
from collections import deque

from cdpr_drivers.bus.adapters.simbus_socket import Filters, passes
from cdpr_drivers.bus.batch import SingleFrameBatch
from cdpr_drivers.bus.frames import (
    EFF_FLAG,
    ERR_FLAG,
    FRAME,
    FRAME_BYTES,
    RTR_FLAG,
    SEND_TIMEOUT_S,
    Bytes,
    FrameBuffer,
)
from cdpr_drivers.bus.health import BusHealth
from cdpr_drivers.bus.socket_port import SocketPort, set_receive_timeout
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

_OPTIONS = ("host", "port", "lockstep")
_ANSWER_S = 5.0
_READ_BYTES = 1 << 16
_LONGEST_MESSAGE = 4096
_MOST_IDENTIFIERS = 4096
_EFF_MASK = 0x1FFFFFFF
# a peer that falls silent for good (power, cable) is given up after about 3 s
_KEEPALIVE = (
    (socket.TCP_KEEPIDLE, 1),
    (socket.TCP_KEEPINTVL, 1),
    (socket.TCP_KEEPCNT, 2),
    (socket.TCP_USER_TIMEOUT, 3000),
)
_MESSAGE = re.compile(rb"<([^<>]*)>")


class SocketcandConnection:
    """A connection to a socketcand server; its end is an error, unlike with python-can's client."""

    def __init__(self, url: BusUrl) -> None:
        """Connect and enter raw mode; raises BusError."""
        for key in url.options:
            if key not in _OPTIONS:
                raise BusError(f"{url}: unknown option {key!r}; allowed: lockstep")
        self._url = url
        self._rest = b""
        self._lost = ""
        self._early: list[bytes] = []
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
            raise BusError(f"{url}: the socketcand server went away ({error})") from None
        except BusError:
            self.sock.close()
            raise
        self.sock.settimeout(SEND_TIMEOUT_S)
        self._early = self._take(b"")

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
            data = self.sock.recv(_READ_BYTES)
            if not data:
                raise OSError("connection closed")
            self._rest = (self._rest + data)[-_LONGEST_MESSAGE:]

    def read(self, wake: int, /) -> list[bytes]:
        """Return the frames that came in; raises OSError when the connection has ended."""
        if self._early:
            return self.early()
        ready, _, _ = select.select([self.sock.fileno(), wake], [], [])
        return self.receive() if self.sock.fileno() in ready else []

    def early(self) -> list[bytes]:
        """Return the frames that came with the greeting, once."""
        frames, self._early = self._early, []
        return frames

    def receive(self, flags: int = 0) -> list[bytes]:
        """Return the frames that came in; raises OSError, BlockingIOError at the time-out."""
        try:
            data = self.sock.recv(_READ_BYTES, flags)
        except BlockingIOError:
            raise
        except OSError as error:
            raise self._lose(error.strerror) from None
        if not data:
            raise self._lose("it closed the connection")
        return self._take(data)

    def _lose(self, reason: str | None) -> OSError:
        """Note that the connection is of no use any more; return the error to raise."""
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
        """Send a frame; raises OSError, also for remote frames, which the protocol has not."""
        can_id, length, data = FRAME.unpack(frame)
        if can_id & RTR_FLAG:
            raise OSError(errno.EOPNOTSUPP, "socketcand carries no remote frames")
        head = f"{can_id & _EFF_MASK:08X}" if can_id & EFF_FLAG else f"{can_id & 0x7FF:03X}"
        # without data two spaces, as python-can's own client sends it
        text = f"< send {head} {length} {data[:length].hex(' ')} >".encode()
        if self._lost:
            raise OSError(errno.ECONNRESET, self._lost)
        try:
            with self._sending:
                self.sock.sendall(text)
        except (BlockingIOError, TimeoutError):
            # half a message may have gone: nothing that followed would be understood
            raise self._lose("it takes no frames") from None
        except OSError as error:
            raise self._lose(error.strerror) from None

    def close(self) -> None:
        """Leave the server."""
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


class SocketcandPort(SocketPort):
    """A `FramePort` on its own connection, read by the caller without a thread."""

    def __init__(
        self,
        url: BusUrl,
        filters: Filters | None,
        health: BusHealth | None,
        *,
        receive_errors: bool = False,
    ) -> None:
        """Connect; raises BusError."""
        self._connection = SocketcandConnection(url)
        super().__init__(url, self._connection.sock, {}, health)
        self._connection.sock.setblocking(True)  # time-outs are the kernel's
        self._filters = None if filters is None else list(filters)
        self._receive_errors = receive_errors
        self._passes: dict[int, bool] = {}
        self._flags = 0
        self._pending: deque[bytes] = deque()
        # readable while the connection is or frames taken from it wait here
        self._ready = select.epoll()
        self._ready.register(self._connection.sock, select.EPOLLIN)
        self._waits = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._ready.register(self._waits, select.EPOLLIN)
        self._signalled = False
        self._enqueue(self._connection.early())
        self._signal()
        self.send = self._send
        self.recv_into = self._recv_into
        self.fileno = self._ready.fileno
        self.close = self._close

    def batch(self, frames: FrameBuffer) -> SingleFrameBatch:
        """Return the batch that sends or receives the rows of `frames`."""
        return SingleFrameBatch(self, frames)

    def settimeout(self, seconds: float | None) -> None:
        """Limit the wait of `recv_into`; None waits for ever, 0 does not wait."""
        self._flags = socket.MSG_DONTWAIT if seconds == 0 else 0
        set_receive_timeout(self._connection.sock, seconds)

    def set_filters(self, filters: Filters) -> None:
        """Have only frames come in that pass one of `filters`, from now on."""
        self._filters = list(filters)
        self._passes = {}

    def drain(self) -> int:
        """Throw away the frames that wait; return how many."""
        count = 0
        with contextlib.suppress(BlockingIOError):
            while True:
                count += len(self._pending)
                self._pending.clear()
                self._enqueue(self._connection.receive(socket.MSG_DONTWAIT))
        self._signal()
        return count

    def recv_waiting(self, buffer: bytearray | memoryview, /) -> int:
        """Write a frame that has come already into `buffer`, return its length; never wait."""
        return self._take(buffer, socket.MSG_DONTWAIT)

    def _recv_into(self, buffer: bytearray | memoryview) -> int:
        return self._take(buffer, self._flags)

    def _take(self, buffer: bytearray | memoryview, flags: int) -> int:
        while not self._pending:
            self._enqueue(self._connection.receive(flags))
        buffer[:FRAME_BYTES] = self._pending.popleft()
        self._signal()
        return FRAME_BYTES

    def _signal(self) -> None:
        """Make the descriptor readable while frames wait here."""
        if self._signalled is not bool(self._pending):
            self._signalled = not self._signalled
            if self._signalled:
                os.eventfd_write(self._waits, 1)
            else:
                os.eventfd_read(self._waits)

    def _send(self, frame: Bytes) -> int:
        self._connection.write(frame)
        return FRAME_BYTES

    def _close(self) -> None:
        if not self._ready.closed:
            self._ready.close()
            os.close(self._waits)
            self._connection.close()

    def _enqueue(self, frames: list[bytes]) -> None:
        """Queue the frames that pass the filters, and error frames where they are asked for."""
        for frame in frames:
            can_id = int.from_bytes(frame[:4], sys.byteorder)
            is_passed = self._passes.get(can_id)
            if is_passed is None:
                is_passed = passes(can_id, self._filters)
                if can_id & ERR_FLAG:
                    is_passed = self._receive_errors
                if len(self._passes) < _MOST_IDENTIFIERS:
                    self._passes[can_id] = is_passed
            if is_passed:
                self._pending.append(frame)
