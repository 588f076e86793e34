"""Sender of the set-point stream, for teleoperation and tests."""

from __future__ import annotations

import math
import secrets
import socket
import time
from collections.abc import Sequence
from typing import Self

from cdpr_rt.service.stream_packet import (
    LONGEST_BYTES,
    NO_RIGHT,
    NONCE_BYTES,
    Bye,
    Hello,
    PacketError,
    Standing,
    StreamAnswer,
    StreamSession,
    StreamSetpoint,
    Welcome,
    parse,
    right_digest,
    seal,
    session_key,
    stream_key,
)

_HELLO_AGAIN_S = 0.5
_SILENCE_S = 2.5
"""A new session begins after this time without an answer, which is longer than any round trip."""


class StreamClient:
    """Sends set-points to the robot at `host` and `port` and receives its answers; never waits.

    `access` is the session from the control interface, or the key shared with the robot. With a
    key, `token` names a right to move that the caller already holds. Without `token` the stream
    requests the right itself. There is no thread: call `send` 30 to 60 times a second, and
    `receive` in between, or whenever `fileno` is readable. Raises OSError if the host does not
    exist.
    """

    def __init__(
        self,
        host: str,
        port: int,
        access: StreamSession | bytes,
        token: str | None = None,
    ) -> None:
        family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        self._sock = socket.socket(family, kind)
        self._sock.setblocking(False)
        self._sock.connect(address)
        self._right = NO_RIGHT if token is None else right_digest(token)
        self.state: StreamAnswer | None = None
        """The newest answer, None before the first."""
        self.round_trip_s = math.nan
        """Round-trip delay of the newest answer."""
        self.sent = 0
        self.answered = 0
        self._sequence = 0
        self._echo_ns = self._echo_at_ns = self._heard_ns = 0
        self._shared = self._key = b""
        if isinstance(access, StreamSession):
            self._session, self._key = access.number, access.key
        else:
            self._shared = stream_key(access)
            self._begin_session()

    @property
    def ready(self) -> bool:
        """Whether set-points can be sent: with a given session immediately, otherwise after the
        greeting.
        """
        return bool(self._key)

    def fileno(self) -> int:
        """Return the descriptor to poll for answers."""
        return self._sock.fileno()

    def send(
        self,
        position_m: Sequence[float],
        quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        scale: float = 1.0,
        buttons: int = 0,
    ) -> bool:
        """Send one set-point; return False if the robot has not greeted yet, or is absent.

        `position_m` is (3,), `quaternion` (4,) w x y z of length 1.
        """
        now_ns = time.monotonic_ns()
        if self._shared and self.ready and now_ns - self._heard_ns > _SILENCE_S * 1e9:
            self._begin_session()
        if not self.ready:
            self._greet(now_ns)
            return False
        x, y, z = position_m
        w, i, j, k = quaternion
        self._sequence += 1
        packet = StreamSetpoint(
            self._session, self._sequence, now_ns, (x, y, z), (w, i, j, k), scale, buttons,
            self._echo_ns, now_ns - self._echo_at_ns if self._echo_ns else 0, self._right,
        )  # fmt: skip
        if not self._put(seal(packet, self._key)):
            return False
        self.sent += 1
        return True

    def receive(self) -> list[StreamAnswer]:
        """Return the answers that have arrived, in order."""
        answers: list[StreamAnswer] = []
        while True:
            try:
                data = self._sock.recv(LONGEST_BYTES + 1)
            except BlockingIOError:
                return answers
            except OSError:
                continue  # no process listens at that address, perhaps not yet
            now_ns = time.monotonic_ns()
            answer = self._open(data)
            if isinstance(answer, Welcome):
                self._key = session_key(self._shared, answer.robot_nonce, self._session)
                self._heard_ns = now_ns
            elif isinstance(answer, StreamAnswer):
                self._note(answer, now_ns)
                answers.append(answer)

    def close(self) -> None:
        """Release the stream for other senders."""
        if self.ready:
            self._put(seal(Bye(self._session, self._sequence + 1), self._key))
        self._sock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _begin_session(self) -> None:
        self._session = secrets.randbelow((1 << 32) - 1) + 1
        self._nonce = secrets.token_bytes(NONCE_BYTES)
        self._key = b""
        self._sequence = 0
        self._echo_ns = self._echo_at_ns = 0
        self._greeted_ns = 0
        self._heard_ns = time.monotonic_ns()

    def _greet(self, now_ns: int) -> None:
        if now_ns - self._greeted_ns > _HELLO_AGAIN_S * 1e9:
            self._greeted_ns = now_ns
            self._put(seal(Hello(self._session, self._nonce), self._shared))

    def _open(self, data: bytes) -> Welcome | StreamAnswer | None:
        """Return an answer for this session, None for anything else."""
        try:
            packet = parse(data, self._key or self._shared)
        except PacketError:
            return None
        if isinstance(packet, Welcome):
            mine = not self.ready and packet.nonce == self._nonce
        else:
            mine = isinstance(packet, StreamAnswer) and self.ready
        if not mine or packet.session != self._session:
            return None
        return packet if isinstance(packet, Welcome | StreamAnswer) else None

    def _note(self, answer: StreamAnswer, now_ns: int) -> None:
        self._heard_ns = now_ns
        self.answered += 1
        if self.state is None or answer.robot_ns >= self._echo_ns:
            self.state = answer
            self._echo_ns, self._echo_at_ns = answer.robot_ns, now_ns
            self.round_trip_s = (now_ns - answer.sent_ns) * 1e-9
        refused = answer.standing in (Standing.BUSY, Standing.NO_RIGHT)
        if refused and self._shared:
            # the robot has replaced the nonce
            self._begin_session()
            self._greeted_ns = now_ns

    def _put(self, data: bytes) -> bool:
        try:
            self._sock.send(data)
        except OSError:
            return False  # no buffer, route or receiver: the packet is lost
        return True
