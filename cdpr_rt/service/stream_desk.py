"""Who may stream set-points and which of them count; knows bytes and time, but no socket."""

from __future__ import annotations

import contextlib
import math
import secrets
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from cdpr_rt.runtime.shared_block import SAMPLE, SharedBlock
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.stream_packet import (
    NO_RIGHT,
    NONCE_BYTES,
    Bye,
    Fault,
    Hello,
    Kind,
    PacketError,
    Standing,
    StreamAnswer,
    StreamSetpoint,
    Welcome,
    parse,
    peek,
    right_digest,
    seal,
    session_key,
    stream_key,
)

SILENCE_NS: Final = 1_000_000_000
"""After so long without a set-point the stream is free for others."""
MOST_RATE_Hz: Final = 250.0
"""Set-points a second that are taken of one sender, in the mean."""
BURST: Final = 50
"""Set-points that may come at once, as after a stall of the network."""

_WINDOW = 64
_LONGEST_STEP = 1 << 20
_LONGEST_ROUND_TRIP_NS = 60_000_000_000

_GREETINGS = "hello", "bye", "silent"
_COUNTED = [each.name.lower() for each in (*Fault, *Standing)] + [*_GREETINGS]

Address = tuple[Any, ...]
"""Of a sender, as the socket tells it."""


class Window:
    """Which sequence numbers have come: each counts once, and none from long before."""

    def __init__(self) -> None:
        self.highest = -1
        self._seen = 0

    def take(self, sequence: int) -> bool:
        """Return whether the number is new, and note it."""
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
    """One sender's use of the stream, from its first set-point to its last."""

    name: int
    number: int
    address: Address
    key: bytes | None
    token: str
    borrowed: bool
    """Whether the right is that of the token's holder, who gives it back himself."""
    last_ns: int
    credit: float = BURST
    window: Window = field(default_factory=Window)


class StreamDesk:
    """Takes packets, posts what counts into `block`, and says what is to be answered.

    The first sender with the right to move holds the stream until it says good-bye or has been
    silent for `SILENCE_NS`. With a shared `key` nobody is answered who does not know it, and what
    was sent once cannot be sent again by others: each session has a key of its own, made of a
    nonce that the robot uses once. Raises ControlError for a key that is too short.
    """

    def __init__(self, block: SharedBlock, lease: Lease, key: bytes | None = None) -> None:
        self.counts: Counter[str] = Counter(dict.fromkeys(_COUNTED, 0))
        """Packets by what became of them: names of `Fault` and `Standing`, and the greetings."""
        self.round_trip_s = math.nan
        """Delay there and back of the newest set-point that told it."""
        self._block = block
        self._lease = lease
        self._key = None if key is None else stream_key(key)
        self._nonce = secrets.token_bytes(NONCE_BYTES)
        self._session: _Session | None = None
        self._sessions = 0
        self._sample = np.zeros((), SAMPLE)

    @property
    def holder(self) -> Address | None:
        """Return the address of who holds the stream."""
        return None if self._session is None else self._session.address

    def take(self, data: bytes, address: Address, now_ns: int) -> bytes | None:
        """Take one packet that came at `now_ns`; return the answer, None where none is due."""
        self.expire(now_ns)
        try:
            packet, key = self._open(data, address)
        except PacketError as error:
            self.counts[error.fault.name.lower()] += 1
            return None
        if isinstance(packet, Hello):
            self.counts["hello"] += 1
            return seal(Welcome(packet.session, packet.nonce, self._nonce), self._key)
        if isinstance(packet, Bye):
            self.counts["bye"] += 1
            if self._owns(packet.session, address):
                self._end()
            return None
        if isinstance(packet, StreamSetpoint):
            standing = self._judge(packet, address, key, now_ns)
            if standing in (Standing.BUSY, Standing.NO_RIGHT):
                self._renew_nonce()
            self.counts[standing.name.lower()] += 1
            return seal(self._state(packet, standing, now_ns), key)
        self.counts["kind"] += 1  # an answer, that nobody sends to a robot
        return None

    def expire(self, now_ns: int) -> None:
        """Free the stream of a sender that has been silent for too long."""
        session = self._session
        if session is not None and now_ns - session.last_ns > SILENCE_NS:
            self.counts["silent"] += 1
            self._end()

    def close(self) -> None:
        """Free the stream, as when its holder says good-bye."""
        self._end()

    def _open(self, data: bytes, address: Address) -> tuple[Any, bytes | None]:
        """Return the packet and the key its tag was made with; raises PacketError."""
        if self._key is None:
            return parse(data, None), None
        kind, name = peek(data, True)
        if kind in (Kind.HELLO, Kind.WELCOME):
            return parse(data, self._key), self._key
        session = self._session
        if session is not None and self._owns(name, address):
            return parse(data, session.key), session.key
        key = session_key(self._key, self._nonce, name)
        return parse(data, key), key

    def _owns(self, name: int, address: Address) -> bool:
        session = self._session
        return session is not None and (session.name, session.address) == (name, address)

    def _judge(
        self, packet: StreamSetpoint, address: Address, key: bytes | None, now_ns: int
    ) -> Standing:
        """Say what becomes of a set-point, and post it where it counts."""
        if self._session is None:
            self._begin(packet, address, key, now_ns)
            if self._session is None:
                return Standing.NO_RIGHT
        elif not self._owns(packet.session, address):
            return Standing.BUSY
        session = self._session
        # before all else: what others send once more costs the holder nothing and keeps nothing up
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
            self._end()
            return Standing.NO_RIGHT
        self._post(packet, session, now_ns)
        return Standing.ACCEPTED

    def _begin(
        self, packet: StreamSetpoint, address: Address, key: bytes | None, now_ns: int
    ) -> None:
        borrowed = packet.right != NO_RIGHT
        token = self._borrow(packet.right) if borrowed else self._ask(address)
        if token is None:
            return
        self._sessions += 1
        self._session = _Session(
            packet.session, self._sessions, address, key, token, borrowed, now_ns
        )
        self._renew_nonce()

    def _borrow(self, digest: bytes) -> str | None:
        return self._lease.find(digest, right_digest)

    def _ask(self, address: Address) -> str | None:
        host, port = address[:2]
        try:
            return self._lease.take(f"set-point stream from {host} port {port}", SILENCE_NS * 1e-9)
        except LeaseError:
            return None

    def _end(self) -> None:
        session, self._session = self._session, None
        if session is not None and not session.borrowed:
            with contextlib.suppress(LeaseError):  # it has run out, or is somebody else's by now
                self._lease.release(session.token)

    def _renew_nonce(self) -> None:
        """Use up the nonce: what was sent with it opens no session, or no other one, later."""
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
        sample["session"] = session.number
        self._block.post_sample(sample)
        there_and_back_ns = now_ns - packet.echo_ns - packet.echo_held_ns
        if packet.echo_ns > 0 and 0 <= there_and_back_ns < _LONGEST_ROUND_TRIP_NS:
            self.round_trip_s = there_and_back_ns * 1e-9

    def _state(self, packet: StreamSetpoint, standing: Standing, now_ns: int) -> StreamAnswer:
        block = self._block
        written = int(block.counters["rows"][0])
        told = packet.session, standing, packet.sequence, packet.sent_ns, now_ns
        if not written:
            return StreamAnswer(*told, round_trip_s=self.round_trip_s)
        row = block.rows[(written - 1) % block.capacity]
        return StreamAnswer(
            *told,
            int(row["state"]),
            int(row["program"]),
            int(row["reaction"]),
            int(row["limit"]),
            tuple(row["pose"].tolist()),
            tuple(row["pose_setpoint"].tolist()),
            self.round_trip_s,
        )
