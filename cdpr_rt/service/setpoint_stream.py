"""UDP receiver of the set-point stream, in a separate thread of the service."""

from __future__ import annotations

import contextlib
import math
import secrets
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.errors import ControlError
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.part import Part
from cdpr_rt.service.rows import newest_row
from cdpr_rt.service.stream_packet import (
    LONGEST_BYTES,
    NO_RIGHT,
    NONCE_BYTES,
    Bye,
    Hello,
    Packet,
    PacketError,
    PacketFault,
    PacketKind,
    Standing,
    StreamAnswer,
    StreamSession,
    StreamSetpoint,
    Welcome,
    parse,
    peek,
    right_digest,
    seal,
    session_key,
    stream_key,
)

# Decision who may stream set-points, and which of them are valid; needs bytes and time, no socket.

SILENCE_NS: Final = 1_000_000_000
"""A session that began with the shared key ends after this time without a set-point."""
MOST_RATE_Hz: Final = 250.0
"""Average number of set-points per second accepted from one sender."""
BURST: Final = 50
"""Number of set-points accepted in one burst, for example after a network delay."""

_WINDOW = 64
_LONGEST_STEP = 1 << 20
_LONGEST_ROUND_TRIP_NS = 60_000_000_000

_GREETINGS = "hello", "bye", "silent"
_COUNTED = [each.name.lower() for each in (*PacketFault, *Standing)] + [*_GREETINGS]

Address = tuple[Any, ...]
"""Address of a sender, as the socket returns it."""


class Window:
    """Window of received sequence numbers: each number is accepted once, and old ones never."""

    def __init__(self) -> None:
        self.highest = -1
        self._seen = 0

    def take(self, sequence: int) -> bool:
        """Return whether the number is new, and record it."""
        ahead = sequence - self.highest
        if self.highest < 0:
            self.highest, self._seen = sequence, 1
            return True
        if ahead > _LONGEST_STEP or ahead <= -_WINDOW:
            return False
        if ahead > 0:
            self._seen = (self._seen << ahead | 1) & ((1 << _WINDOW) - 1)
            self.highest = sequence
            return True
        if self._seen >> -ahead & 1:
            return False
        self._seen |= 1 << -ahead
        return True


@dataclass
class _Session:
    """Session of one sender, under one grant of the right to move."""

    name: int
    key: bytes
    token: str
    """Token of the right to move, which the session renews."""
    right: int
    """The number of the grant of that token."""
    given: bool
    """Whether the control interface has given the session to the holder; then silence does not end
    it."""
    own: bool = False
    """Whether the session has taken the right itself, and so releases it at its end."""
    address: Address | None = None
    """Address of the first packet; packets from others are ignored."""
    over: bool = False
    """Whether the right of the session has ended: later packets are answered, but not used."""
    last_ns: int = 0
    credit: float = BURST
    window: Window = field(default_factory=Window)

    def is_of(self, name: int, address: Address) -> bool:
        """Whether a packet with this session number, from this address, belongs to the session."""
        return self.name == name and self.address in (None, address)


class StreamSessionManager:
    """Receives packets, posts valid samples into `block`, and returns the answers.

    One session holds the stream. The control interface gives a session to the holder of the right
    to move by `issue`, or a session begins with a shared `key`. Senders without either get no
    answer. A session is bound to one grant of the right and to the first address that uses it.
    After its end, its packets are not used. Any thread may use the manager. Raises ControlError for
    a key that is too short.
    """

    def __init__(self, block: SharedBlock, lease: Lease, key: bytes | None = None) -> None:
        self.counts: Counter[str] = Counter(dict.fromkeys(_COUNTED, 0))
        """Numbers of packets by outcome: names of `PacketFault`, of `Standing`, and greetings."""
        self.round_trip_s = math.nan
        """Round-trip delay, from the newest set-point that reported it."""
        self._block = block
        self._lease = lease
        self._key = None if key is None else stream_key(key)
        self._nonce = secrets.token_bytes(NONCE_BYTES)
        self._session: _Session | None = None
        self._sessions = 0
        self._sample = np.zeros((), SAMPLE)
        self._lock = threading.Lock()

    @property
    def holder(self) -> Address | None:
        """Return the address of the stream's holder."""
        session = self._session
        return None if session is None or session.over else session.address

    def issue(self, token: str | None) -> StreamSession:
        """Give the holder of the right to move a session, in place of any other.

        Raises LeaseError if `token` is not the holder's, or if its procedure moves the robot.
        """
        with self._lock:
            right = self._lease.renew(token, moves=True).number
            given = StreamSession(secrets.randbelow((1 << 32) - 1) + 1, secrets.token_bytes(32))
            self._begin(_Session(given.number, given.key, token or "", right, given=True))
            return given

    def receive(self, data: bytes, address: Address, now_ns: int) -> bytes | None:
        """Process one packet received at `now_ns`; return the answer, or None."""
        with self._lock:
            self._expire(now_ns)
            try:
                packet, key = self._open(data, address)
            except PacketError as error:
                self.counts[error.fault.name.lower()] += 1
                return None
            return self._answer(packet, key, address, now_ns)

    def expire(self, now_ns: int) -> None:
        """End a session whose right has ended, or whose sender was silent for too long."""
        with self._lock:
            self._expire(now_ns)

    def close(self) -> None:
        """Free the stream, for example when its holder says good-bye."""
        with self._lock:
            self._end()

    def _expire(self, now_ns: int) -> None:
        session = self._session
        if session is None or session.over:
            return
        if not self._lease.is_held_by(session.token):
            session.over = True
        elif not session.given and now_ns - session.last_ns > SILENCE_NS:
            self.counts["silent"] += 1
            self._end()

    def _open(self, data: bytes, address: Address) -> tuple[Packet, bytes]:
        """Return the packet and the key of its tag; raises PacketError."""
        kind, name = peek(data)
        session = self._session
        if session is not None and session.is_of(name, address):
            return parse(data, session.key), session.key
        if self._key is None:
            raise PacketError(PacketFault.SESSION, f"session {name} is unknown")
        # attempts are not limited: forgers could use up a limit, and a tag cannot be guessed anyway
        greets = kind in (PacketKind.HELLO, PacketKind.WELCOME)
        key = self._key if greets else session_key(self._key, self._nonce, name)
        return parse(data, key), key

    def _answer(self, packet: Packet, key: bytes, address: Address, now_ns: int) -> bytes | None:
        if isinstance(packet, Hello):
            self.counts["hello"] += 1
            return seal(Welcome(packet.session, packet.nonce, self._nonce), key)
        if isinstance(packet, Bye):
            self.counts["bye"] += 1
            if self._session is not None and self._session.is_of(packet.session, address):
                self._end()
            return None
        if isinstance(packet, StreamSetpoint):
            standing = self._evaluate(packet, address, key, now_ns)
            if standing in (Standing.BUSY, Standing.NO_RIGHT):
                self._renew_nonce()
            self.counts[standing.name.lower()] += 1
            return seal(self._state(packet, standing, now_ns), key)
        self.counts["kind"] += 1  # the packet is an answer, which no sender should send to a robot
        return None

    def _evaluate(
        self, packet: StreamSetpoint, address: Address, key: bytes, now_ns: int
    ) -> Standing:
        """Return the outcome of a set-point, and post it if it is valid."""
        session = self._session
        if session is None or not session.is_of(packet.session, address):
            if session is not None and not session.over:
                return Standing.BUSY
            session = self._begin_with_key(packet, key, address)
            if session is None:
                return Standing.NO_RIGHT
        if session.address is None:
            session.address, session.last_ns = address, now_ns
        # checked first, so that replayed packets neither use up the holder's rate nor renew its
        # session
        if not session.window.take(packet.sequence):
            return Standing.REPEATED
        credit = session.credit + (now_ns - session.last_ns) * 1e-9 * MOST_RATE_Hz
        session.credit, session.last_ns = min(credit, BURST), now_ns
        if session.credit < 1.0:
            return Standing.TOO_FAST
        session.credit -= 1.0
        try:
            self._lease.renew(session.token)
        except LeaseError:
            session.over = True
            if not session.given:
                self._end()  # the sender will greet again
            return Standing.NO_RIGHT
        self._post(packet, session, now_ns)
        return Standing.ACCEPTED

    def _begin_with_key(
        self, packet: StreamSetpoint, key: bytes, address: Address
    ) -> _Session | None:
        """Begin a session under the right named in the packet, or under a new one; None if
        impossible.
        """
        own = packet.right == NO_RIGHT
        try:
            token = (
                self._take_right(address) if own else self._lease.find(packet.right, right_digest)
            )
            right = self._lease.renew(token).number
        except LeaseError:
            return None
        return self._begin(_Session(packet.session, key, token or "", right, given=False, own=own))

    def _take_right(self, address: Address) -> str:
        host, port = address[:2]
        return self._lease.take(f"set-point stream from {host} port {port}", SILENCE_NS * 1e-9)

    def _begin(self, session: _Session) -> _Session:
        self._end()
        self._sessions += 1
        self._session = session
        self._renew_nonce()
        return session

    def _end(self) -> None:
        session, self._session = self._session, None
        if session is not None and session.own:
            with contextlib.suppress(
                LeaseError
            ):  # the right has expired, or another client has taken it
                self._lease.release(session.token)

    def _renew_nonce(self) -> None:
        """Replace the nonce, so that old packets cannot open a session later."""
        self._nonce = secrets.token_bytes(NONCE_BYTES)

    def _post(self, packet: StreamSetpoint, session: _Session, now_ns: int) -> None:
        sample = self._sample
        sample["sequence"] = packet.sequence
        sample["sent_ns"] = packet.sent_ns
        sample["arrived_ns"] = now_ns
        sample["position_m"] = packet.position_m
        sample["quaternion"] = packet.quaternion
        sample["scale"] = packet.scale
        sample["buttons"] = packet.buttons
        sample["session"] = self._sessions
        sample["right"] = session.right
        self._block.post_sample(sample)
        there_and_back_ns = now_ns - packet.echo_ns - packet.echo_held_ns
        if packet.echo_ns > 0 and 0 <= there_and_back_ns < _LONGEST_ROUND_TRIP_NS:
            self.round_trip_s = there_and_back_ns * 1e-9

    def _state(self, packet: StreamSetpoint, standing: Standing, now_ns: int) -> StreamAnswer:
        row = newest_row(self._block)
        echoed = packet.session, standing, packet.sequence, packet.sent_ns, now_ns
        if row is None:
            return StreamAnswer(*echoed, round_trip_s=self.round_trip_s)
        return StreamAnswer(
            *echoed,
            int(row["state"]),
            int(row["program"]),
            int(row["reaction"]),
            int(row["limit"]),
            tuple(row["pose"].tolist()),
            tuple(row["pose_setpoint"].tolist()),
            self.round_trip_s,
        )


_TURN_S: Final = 0.01
_MOST_A_TURN: Final = 100
"""Largest number of packets read in 10 ms; the kernel drops the rest of a flood."""
_LOOK_S: Final = 0.1


class StreamError(ControlError):
    """No stream is received; the message says what is allowed."""


class SetpointStream(Part):
    """Reads packets from `sock`, made by `listen_udp`, from `start` until `stop`.

    Set-points are written to `block` while their sender has the right to move, see `lease`. Without
    a `key`, only sessions that `sessions.issue` has returned are served. Raises ControlError for a
    key that is too short.
    """

    name = "stream"

    def __init__(
        self,
        block: SharedBlock,
        lease: Lease,
        sock: socket.socket,
        key: bytes | None = None,
        ended: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__("set-point stream", ended)
        self.sessions = StreamSessionManager(block, lease, key)
        self._sock = sock
        host, port = sock.getsockname()[:2]
        self.address: tuple[str, int] = host, port
        """Host and port at which the stream listens."""
        self._holders: _HoldersSocket | None = None

    def stop(self) -> None:
        """Stop; the holder loses the stream."""
        super().stop()
        self.sessions.close()
        self._follow_holder(self._sock)
        self._sock.close()

    def status(self) -> dict[str, Any]:
        """Return the holder, the round-trip delay, the packet counts and the error."""
        holder, delay_s = self.sessions.holder, self.sessions.round_trip_s
        return {
            "address": "{}:{}".format(*self.address),
            "holder": None if holder is None else f"{holder[0]}:{holder[1]}",
            "round_trip_s": None if math.isnan(delay_s) else delay_s,
            "packets": dict(self.sessions.counts),
            "error": self._error,
        }

    def _serve(self) -> None:
        buffer = memoryview(bytearray(LONGEST_BYTES + 1))
        first = self._sock
        while not self._end.is_set():
            socks = [first] if self._holders is None else [self._holders.sock, first]
            readable = _readable(socks)
            begin = time.monotonic()
            # the holder's own socket comes first, so that a flood of other packets does not delay
            # it
            taken = sum(self._take(sock, buffer) for sock in socks if sock.fileno() in readable)
            self.sessions.expire(time.monotonic_ns())
            self._follow_holder(first)
            if taken >= _MOST_A_TURN:
                self._end.wait(max(0.0, begin + _TURN_S - time.monotonic()))

    def _take(self, sock: socket.socket, buffer: memoryview) -> int:
        for count in range(_MOST_A_TURN):
            try:
                size, address = sock.recvfrom_into(buffer, 0, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return count
            except OSError:
                continue  # error from an earlier answer: its receiver has gone
            answer = self.sessions.receive(bytes(buffer[:size]), address, time.monotonic_ns())
            if answer is not None:
                with contextlib.suppress(OSError):
                    sock.sendto(answer, address)
        return _MOST_A_TURN

    def _follow_holder(self, first: socket.socket) -> None:
        """Give the holder of the stream a separate socket, and close that of the last holder."""
        holder = self.sessions.holder
        if self._holders is not None and self._holders.address != holder:
            self._holders.sock.close()
            self._holders = None
        if holder is not None and self._holders is None:
            with contextlib.suppress(OSError):  # the first socket is sufficient
                self._holders = _HoldersSocket(first, holder)


class _HoldersSocket:
    """A second socket at the same address that gets the packets of one sender only.

    The kernel gives it a separate queue.
    """

    def __init__(self, first: socket.socket, holder: Address) -> None:
        self.address = holder
        self.sock = socket.socket(first.family, socket.SOCK_DGRAM)
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self.sock.bind(first.getsockname())
        self.sock.connect(holder)


def _readable(socks: list[socket.socket]) -> set[int]:
    """Wait for packets for a moment; return the descriptors of sockets that have some.

    It uses poll, because `select` fails for descriptors from 1024 on, which many connections can
    reach.
    """
    poll = select.poll()
    for sock in socks:
        poll.register(sock, select.POLLIN)
    return {fd for fd, _ in poll.poll(1000.0 * _LOOK_S)}
