"""A set-point stream in bus time: packets as on the wire, received as by the daemon."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.service.streams.stream_packet import (
    StreamAnswer,
    StreamSession,
    StreamSetpoint,
    parse,
    seal,
)
from cdpr_rt.service.streams.stream_sessions import Address, StreamSessionManager
from cdpr_tools.trials.right import RightInBusTime

_LOOPBACK: Final[Address] = ("127.0.0.1", 1)
_LOOK_NS: Final = 10_000_000


class StreamInBusTime:
    """Hands packets to the session manager that the daemon's socket serves, at the bus' time."""

    def __init__(
        self, block: SharedBlock, right: RightInBusTime, clock_ns: Callable[[], int]
    ) -> None:
        self.sessions = StreamSessionManager(block, right.lease)
        self._right = right
        self._clock_ns = clock_ns
        self._look_ns = 0

    def sender(self) -> StreamSender:
        """Return a sender under the right that is held here, which replaces any before.

        Raises LeaseError where none is held.
        """
        return StreamSender(self.sessions.issue(self._right.token))

    def take(self, data: bytes, address: Address = _LOOPBACK) -> bytes | None:
        """Take one packet as it arrives now; return the answer, None where none is due."""
        return self.sessions.receive(data, address, self._clock_ns())

    def look(self) -> None:
        """Free the stream of a sender that is silent; called every cycle."""
        now_ns = self._clock_ns()
        if now_ns >= self._look_ns:
            self._look_ns = now_ns + _LOOK_NS
            self.sessions.expire(now_ns)


class StreamSender:
    """The packets of one session, numbered and stamped."""

    def __init__(self, session: StreamSession) -> None:
        self._session = session
        self._sequence = 0

    def packet(
        self,
        sent_s: float,
        position_m: Sequence[float],
        scale: float = 1.0,
        buttons: int = 0,
        quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    ) -> bytes:
        """Return the bytes of the next set-point, sent at `sent_s` by the sender's clock."""
        self._sequence += 1
        x, y, z = position_m
        w, i, j, k = quaternion
        setpoint = StreamSetpoint(
            self._session.number, self._sequence, round(sent_s * 1e9), (x, y, z), (w, i, j, k),
            scale, buttons,
        )  # fmt: skip
        return seal(setpoint, self._session.key)

    def answer_of(self, data: bytes) -> StreamAnswer:
        """Return the robot's answer; raises PacketError for what is none of this session's."""
        packet = parse(data, self._session.key)
        assert isinstance(packet, StreamAnswer)  # the manager gives no other
        return packet
