"""Who may stream set-points and which of them count; knows bytes and time, but no socket."""

from __future__ import annotations

import contextlib
import math
import secrets
import threading
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.streams.stream_packet import (
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

SILENCE_NS: Final = 1_000_000_000
"""After so long without a set-point a session that began with the shared key ends."""
MOST_RATE_Hz: Final = 250.0
"""Set-points a second that are taken of one sender, in the mean."""
BURST: Final = 50
"""Set-points that may come at once, as after a stall of the network."""

_WINDOW = 64
_LONGEST_STEP = 1 << 20
_LONGEST_ROUND_TRIP_NS = 60_000_000_000

_GREETINGS = "hello", "bye", "silent"
_COUNTED = [each.name.lower() for each in (*PacketFault, *Standing)] + [*_GREETINGS]

Address = tuple[Any, ...]
"""Of a sender, as the socket tells it."""


class Window:
    """Window of received sequence numbers: each counts once, and none from long before."""

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
    """One sender's use of the stream, under one grant of the right to move."""

    name: int
    key: bytes
    token: str
    """That of the right, which it renews."""
    right: int
    """The number of the grant that the token belongs to."""
    given: bool
    """Whether the control interface has given it to the holder; such a one bears silence."""
    own: bool = False
    """Whether it has asked for the right itself, and so gives it back at its end."""
    address: Address | None = None
    """That of the first packet; no other counts."""
    over: bool = False
    """Whether its right has ended: what still comes is answered, and does not count."""
    last_ns: int = 0
    credit: float = BURST
    window: Window = field(default_factory=Window)

    def is_of(self, name: int, address: Address) -> bool:
        """Whether a packet with this name, from there, belongs to it."""
        return self.name == name and self.address in (None, address)


class StreamSessionManager:
    """Receives packets, posts valid samples into `block`, and returns the answers.

    One session holds the stream. The control interface gives it to the holder of the right to move
    by `issue`, or it begins with a shared `key`: nobody is answered who has neither. It is bound to
    one grant of the right and to the first address that uses it; after its end nothing of it
    counts. Any thread may use it. Raises ControlError for a key that is too short.
    """

    def __init__(self, block: SharedBlock, lease: Lease, key: bytes | None = None) -> None:
        self.counts: Counter[str] = Counter(dict.fromkeys(_COUNTED, 0))
        """Packets by what became of them: names of `PacketFault`, of `Standing`, and greetings."""
        self.round_trip_s = math.nan
        """Delay there and back of the newest set-point that told it."""
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
        """Return the address of who holds the stream."""
        session = self._session
        return None if session is None or session.over else session.address

    def issue(self, token: str | None) -> StreamSession:
        """Give the holder of the right to move a session, in place of any other.

        Raises LeaseError where `token` is not the holder's.
        """
        with self._lock:
            right = self._lease.renew(token).number
            given = StreamSession(secrets.randbelow((1 << 32) - 1) + 1, secrets.token_bytes(32))
            self._begin(_Session(given.number, given.key, token or "", right, given=True))
            return given

    def receive(self, data: bytes, address: Address, now_ns: int) -> bytes | None:
        """Take one packet that came at `now_ns`; return the answer, None where none is due."""
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
        """Free the stream, as when its holder says good-bye."""
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
        """Return the packet and the key its tag was made with; raises PacketError."""
        kind, name = peek(data)
        session = self._session
        if session is not None and session.is_of(name, address):
            return parse(data, session.key), session.key
        if self._key is None:
            raise PacketError(PacketFault.SESSION, f"session {name} is none that was given")
        # no limit of tries: only who forges could use it up, and a tag is not guessed anyway
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
        self.counts["kind"] += 1  # an answer, that nobody sends to a robot
        return None

    def _evaluate(
        self, packet: StreamSetpoint, address: Address, key: bytes, now_ns: int
    ) -> Standing:
        """Say what becomes of a set-point, and post it where it counts."""
        session = self._session
        if session is None or not session.is_of(packet.session, address):
            if session is not None and not session.over:
                return Standing.BUSY
            session = self._begin_with_key(packet, key, address)
            if session is None:
                return Standing.NO_RIGHT
        if session.address is None:
            session.address, session.last_ns = address, now_ns
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
            session.over = True
            if not session.given:
                self._end()  # its sender greets again
            return Standing.NO_RIGHT
        self._post(packet, session, now_ns)
        return Standing.ACCEPTED

    def _begin_with_key(
        self, packet: StreamSetpoint, key: bytes, address: Address
    ) -> _Session | None:
        """Begin a session with the right that is named, or its own; None where it has none."""
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
        sample["session"] = self._sessions
        sample["right"] = session.right
        self._block.post_sample(sample)
        there_and_back_ns = now_ns - packet.echo_ns - packet.echo_held_ns
        if packet.echo_ns > 0 and 0 <= there_and_back_ns < _LONGEST_ROUND_TRIP_NS:
            self.round_trip_s = there_and_back_ns * 1e-9

    def _state(self, packet: StreamSetpoint, standing: Standing, now_ns: int) -> StreamAnswer:
        block = self._block
        written = int(block.counters["rows"][0])
        echoed = packet.session, standing, packet.sequence, packet.sent_ns, now_ns
        if not written:
            return StreamAnswer(*echoed, round_trip_s=self.round_trip_s)
        row = block.rows[(written - 1) % block.capacity]
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
