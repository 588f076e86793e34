"""Clients and nodes of the bus, the receivers of each frame, and the order of frames."""

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
from collections.abc import Set as AbstractSet
from typing import Protocol, runtime_checkable

from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import (
    ERR_FLAG,
    HEADER,
    LONGEST_FRAME_BITS,
    SYNC_ID,
    arbitration_key,
    base_id,
    bits_by_length,
)

PACKET_BYTES = 448
"""Longest packet accepted from a client; Python allocates bytes objects of this size quickly."""

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
    """A peer that sends and receives frames through `sock`.

    With `stamped`, the kernel reports when each packet was sent. The bus uses that time even if it
    reads the packet late.
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
        """Pairs (identifier, mask) as for CAN_RAW_FILTER; None for all frames."""
        self.dropped = 0
        self.delivered = False
        """Whether a frame was delivered since this flag was last cleared."""
        self.queued: deque[bytes] = deque()
        """Frames of the client's last packet that the bus has not carried yet."""
        self.sent_s = 0.0
        """Time of sending of the last packet, in seconds of the monotonic clock, if stamped."""
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
        """Return the next packet as `recv` does, and store its time of sending."""
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
    """Return the monotonic time of a wall-clock time, not later than now.

    The wall clock is read between two readings of the monotonic clock; this is repeated if the
    process was interrupted between them. If somebody has set the wall clock since then, return now.
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
    """Enlarge the buffer to lose fewer frames; privileged processes may exceed the limit."""
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
            f"bus name {name!r}: allowed: 1 to 64 letters, digits, '_', '.' or '-', "
            "beginning with a letter or digit"
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
        BusSetupError: the kernel has no SocketCAN, or the interface does not exist.
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
    """Listens under the bus' `name`; raises BusSetupError if it is malformed or in use.

    An abstract socket has no permissions, so every user of the machine can connect. Only the user
    who runs the bus and root are accepted.
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
        """Return the connection of a client; None if not allowed or already gone."""
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
                f"simbus:{self._name}: user {uid} may not join; allowed: the user who runs the "
                "bus, and root (later attempts are not reported)",
                file=sys.stderr,
                flush=True,
            )
        return None


class LocalNode(Protocol):
    """A CAN node driven by one thread; frames are 16 bytes, laid out as `struct can_frame`.

    All times are bus time in seconds. After every call the bus sends the frames in `outbox`, in
    the order of arbitration, and clears the list (the list object itself stays the same).
    """

    outbox: list[bytes]

    @property
    def node_id(self) -> int:
        """Node id in use, 0 for a node that only listens."""

    @property
    def sync_period_s(self) -> float:
        """Communication cycle period (1006h); 0 while it is not set."""

    @property
    def accepts(self) -> AbstractSet[int] | None:
        """Identifiers (11 bits, or 29 bits with the EFF flag) that the node wants; None for all.

        A node that changes them provides a new set. The bus reads the attribute again after each
        frame that is neither SYNC nor PDO. While bus time runs without SYNC, it also does so after
        `advance`.
        """

    def receive(self, frame: bytes, now: float) -> None:
        """Process a frame seen on the bus, SYNC included; never one of the node's own."""

    def advance(self, now: float) -> None:
        """Advance timers and physics to `now`; called before a frame if time has moved."""

    def next_event(self) -> float:
        """Return the bus time of the next timer, `math.inf` if none runs."""

    def close(self) -> None:
        """Flush and close the node's files."""


@runtime_checkable
class PreparingNode(Protocol):
    """A node that can compute in advance."""

    def prepare(self, until: float) -> None:
        """Compute ahead for `advance(until)`, the probable next call; change nothing visible."""


def is_acyclic(can_id: int) -> bool:
    """Return whether the identifier belongs to acyclic traffic, which waits for gaps between PDOs.

    These are SDO, heartbeat and LSS of the predefined connection set (CiA 301). They lose
    arbitration against SYNC and PDOs, so they lengthen a cycle by one frame at most.
    """
    base = base_id(can_id)
    return 0x580 <= base <= 0x67F or 0x700 <= base <= 0x77F or base in (0x7E4, 0x7E5)


class BusLoad:
    """Worst-case bits of all frames compared with bus time.

    In lockstep, bus time stands still while a cycle's frames are sent, so their sum is compared
    with the bus time from SYNC to SYNC. In paced mode the wire is modelled frame by frame: a cycle
    overruns if the wire would still be busy at its end for longer than one frame takes.
    """

    def __init__(self, bitrate: int, *, lockstep: bool) -> None:
        self.bitrate = bitrate
        self.frames = 0
        self.overruns = 0
        self.peak_cycle_load = 0.0
        self.cycle_bits = 0
        """Bits of cyclic traffic since the last SYNC; the hub increments it with each frame."""
        self.acyclic_bits = 0
        self._lockstep = lockstep
        self._bit_s = 1.0 / bitrate
        self._longest_s = LONGEST_FRAME_BITS * self._bit_s
        self._past_bits = 0
        self._last_sync_s = -1.0
        self._busy_until_s = 0.0

    def occupy(self, now_s: float, bits: int) -> None:
        """Put a cyclic frame of `bits` on the wire at `now_s` (paced mode only)."""
        self._busy_until_s = max(self._busy_until_s, now_s) + bits * self._bit_s

    def sync(self, now_s: float) -> None:
        """Close the cycle that ends with the SYNC at `now_s`."""
        window_s = now_s - self._last_sync_s
        if self._last_sync_s >= 0.0 and window_s > 0.0:
            load = self.cycle_bits * self._bit_s / window_s
            self.peak_cycle_load = max(self.peak_cycle_load, load)
            # a bit of tolerance for the rounding of bus time
            late = self._busy_until_s - now_s - self._longest_s > 0.0
            if load > 1.0 + 1e-9 if self._lockstep else late:
                self.overruns += 1
        self._past_bits += self.cycle_bits
        self.cycle_bits = 0
        self._last_sync_s = now_s

    def load(self, now_s: float) -> float:
        """Return the share of bus time since the start during which the wire was busy."""
        bits = self._past_bits + self.cycle_bits + self.acyclic_bits
        return bits * self._bit_s / now_s if now_s > 0.0 else 0.0


_LSS_ANSWER = 0x7E4


class Route:
    """Receivers and lengths in bits of the frames with one identifier."""

    __slots__ = (
        *("acyclic", "bits", "clients", "configures"),
        *("key", "longest", "merges", "nodes", "sync"),
    )

    def __init__(self, can_id: int, clients: list[Client], nodes: list[LocalNode]) -> None:
        self.key = arbitration_key(can_id)
        self.bits = bits_by_length(can_id)
        # error frames are not traffic: they have no length
        self.longest = -1 if can_id & ERR_FLAG else 8
        self.acyclic = is_acyclic(can_id)
        self.configures = self.acyclic or base_id(can_id) == 0
        self.sync = can_id == SYNC_ID
        # identical LSS answers at the same time are one frame on a wire
        self.merges = can_id == _LSS_ANSWER
        self.clients = tuple(clients)
        self.nodes = tuple(nodes)


class Contention:
    """The next frame of each client, for arbitration; each client's frames keep their order.

    In lockstep the smallest identifier wins. In paced mode frames have times. A frame contends with
    an earlier one if it was sent while the wire could still be busy with that one. A frame that was
    sent later waits, even if the simulator was delayed and both arrived together.
    """

    def __init__(self, *, paced: bool, bitrate: int) -> None:
        self._paced = paced
        self._window_s = LONGEST_FRAME_BITS / bitrate
        self.heads: dict[Client, tuple[int, bytes]] = {}
        """The waiting frame of each client, with its arbitration key."""

    def add(self, client: Client, frame: bytes) -> None:
        """Queue the frame that `client` has just sent."""
        self.heads[client] = (arbitration_key(HEADER.unpack_from(frame)[0]), frame)

    def discard(self, client: Client) -> None:
        """Discard the frame of a client that has disconnected."""
        self.heads.pop(client, None)

    def pop(self) -> tuple[Client, bytes]:
        """Return the frame that wins arbitration, with its sender; there must be one."""
        heads = self.heads
        if len(heads) == 1:
            client, (_, frame) = heads.popitem()
            return client, frame
        contending = list(heads)
        if self._paced:
            end_s = min(client.sent_s for client in contending) + self._window_s
            contending = [client for client in contending if client.sent_s <= end_s]
        winner = min(contending, key=lambda client: heads[client][0])
        return winner, heads.pop(winner)[1]
