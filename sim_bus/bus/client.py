"""Clients of the bus, their filters and lost frames, and the socket at which they arrive."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import re
import select
import socket
import struct
import sys
import time
from collections import deque
from collections.abc import Callable

from cdpr_sim_bus.errors import BusSetupError

PACKET_BYTES = 448
"""Longest packet taken from a client; a bytes object of this size comes from Python's own pool."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_SO_SNDBUFFORCE = 32
_SO_TIMESTAMPNS = 35
_TIMESPEC = struct.Struct("ll")
_ANCILLARY_BYTES = socket.CMSG_SPACE(_TIMESPEC.size)
_SEND_BUFFER_BYTES = 1 << 22
_BACKLOG = 64
_SEND_ATTEMPTS = 500
_SEND_RETRY_S = 0.0002
_CLOCK_READINGS, _PUT_OFF_S = 3, 5e-5


class Client:
    """A peer that sends and takes frames through `sock`.

    With `stamped` the kernel tells when each packet was sent, so that it counts as sent then
    whenever it is read.
    """

    __slots__ = (
        "delivered",
        "dropped",
        "essential",
        "filters",
        "queued",
        "receive",
        "send",
        "sent_s",
        "sock",
    )

    def __init__(
        self, sock: socket.socket, *, essential: bool = False, stamped: bool = False
    ) -> None:
        sock.setblocking(False)
        _enlarge_buffer(sock)
        self.sock = sock
        self.essential = essential
        """Whether the bus ends with this socket (a real CAN interface)."""
        self.filters: list[tuple[int, int]] | None = None
        """Pairs (identifier, mask) as for CAN_RAW_FILTER, None for everything."""
        self.dropped = 0
        self.delivered = False
        """Whether a frame was delivered since this was last cleared."""
        self.queued: deque[bytes] = deque()
        """Frames of its last packet that have not been carried yet."""
        self.sent_s = 0.0
        """When the last packet was sent, in seconds of the monotonic clock, where stamped."""
        self.receive: Callable[[int], bytes] = sock.recv
        if stamped:
            sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            self.receive = self._receive_stamped
        self.send: Callable[[bytes], object] = self._send_retrying if essential else sock.send

    def wants(self, can_id: int) -> bool:
        """Return whether a frame with this identifier and these flags passes the filters."""
        if self.filters is None:
            return True
        return any((can_id & mask) == (filter_id & mask) for filter_id, mask in self.filters)

    def _receive_stamped(self, size: int) -> bytes:
        """Return the next packet as `recv` does, and note when it was sent."""
        packet, ancillary, _, _ = self.sock.recvmsg(size, _ANCILLARY_BYTES)
        if ancillary:
            seconds, ns = _TIMESPEC.unpack(ancillary[0][2])
            self.sent_s = sent_at(seconds + 1e-9 * ns)
        else:
            self.sent_s = time.monotonic()
        return packet

    def _send_retrying(self, frame: bytes) -> None:
        """Send, waiting while the transmit queue of a CAN interface is full."""
        for _ in range(_SEND_ATTEMPTS):
            try:
                self.sock.send(frame)
            except OSError as error:
                if error.errno not in (errno.ENOBUFS, errno.EAGAIN):
                    raise
                select.select([], [], [], _SEND_RETRY_S)
            else:
                return
        raise BlockingIOError


def sent_at(stamp_s: float) -> float:
    """Return the time of the monotonic clock at a time of the wall clock, now at the latest.

    The wall clock is read between two readings of the monotonic one, again where this process was
    put off between them. If the wall clock was set meanwhile, the packet counts as sent now.
    """
    shortest_s, sent_s = math.inf, 0.0
    for _ in range(_CLOCK_READINGS):
        before_s, wall_s, after_s = time.monotonic(), time.time(), time.monotonic()
        if after_s - before_s < shortest_s:
            shortest_s = after_s - before_s
            sent_s = before_s - max(0.0, wall_s - stamp_s)
        if shortest_s < _PUT_OFF_S:
            break
    return sent_s


def _enlarge_buffer(sock: socket.socket) -> None:
    """Let a client fall far behind before it loses frames; privileged processes may go further."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
    with contextlib.suppress(PermissionError):
        sock.setsockopt(socket.SOL_SOCKET, _SO_SNDBUFFORCE, _SEND_BUFFER_BYTES)


def bus_address(name: str) -> str:
    """Return the abstract AF_UNIX address of the bus `name`."""
    return f"\0cdpr-rt/simbus/{name}"


def listening_socket(name: str) -> socket.socket:
    """Return the socket on which clients of the bus `name` arrive.

    Raises:
        BusSetupError: the name is malformed or in use.
    """
    if _NAME.fullmatch(name) is None:
        raise BusSetupError(
            f"bus name {name!r}: allowed are 1 to 64 letters, digits, '_', '.' or '-', beginning "
            "with a letter or digit"
        )
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK)
    try:
        sock.bind(bus_address(name))
    except OSError as error:
        sock.close()
        if error.errno == errno.EADDRINUSE:
            raise BusSetupError(
                f"simbus:{name} is in use by another simulator; choose another name or stop it"
            ) from None
        raise BusSetupError(f"simbus:{name} cannot be opened: {error.strerror}") from None
    sock.listen(_BACKLOG)
    return sock


def raw_can_socket(interface: str) -> socket.socket:
    """Return a raw CAN socket on the network interface.

    Raises:
        BusSetupError: the kernel has no SocketCAN, or there is no such interface.
    """
    try:
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except OSError as error:
        raise BusSetupError(
            f"socketcan:{interface}: this kernel has no SocketCAN ({error.strerror})"
        ) from None
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SEND_BUFFER_BYTES)
        sock.bind((interface,))
    except OSError as error:
        sock.close()
        raise BusSetupError(
            f"socketcan:{interface}: cannot use this network interface ({error.strerror})"
        ) from None
    return sock


_CREDENTIALS = struct.Struct("3i")  # struct ucred: pid, uid, gid


class Listener:
    """Listens under the bus' `name`; raises BusSetupError where it is malformed or in use.

    An abstract socket has no permissions, so that every user of the machine can connect: let in
    are the user who runs the bus, and root.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._sock = listening_socket(name)
        self._allowed = frozenset({os.geteuid(), 0})
        self._refusal_printed = False

    def fileno(self) -> int:
        """Return the descriptor that is readable when a client arrives."""
        return self._sock.fileno()

    def close(self) -> None:
        """Close the listening socket."""
        self._sock.close()

    def accept(self) -> socket.socket | None:
        """Return the connection of a client, None where its user may not connect or it has left."""
        try:
            sock, _ = self._sock.accept()
        except OSError:
            return None
        data = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        uid = _CREDENTIALS.unpack(data)[1]
        if uid in self._allowed:
            return sock
        sock.close()
        if not self._refusal_printed:
            self._refusal_printed = True
            print(
                f"simbus:{self._name}: user {uid} may not join; allowed: the user who runs the bus,"
                " and root (others after this one are not told)",
                file=sys.stderr,
                flush=True,
            )
        return None
