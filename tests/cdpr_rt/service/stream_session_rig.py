"""A rig of the set-point stream with its memory block and lease, on a test clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.service.lease import Lease
from cdpr_rt.service.setpoint_stream import StreamSessionManager
from cdpr_rt.service.stream_packet import (
    Hello,
    StreamAnswer,
    StreamSession,
    StreamSetpoint,
    Welcome,
    parse,
    seal,
    session_key,
    stream_key,
)

KEY = b"a key that is long enough"
HERE, THERE = ("127.0.0.1", 4000), ("127.0.0.1", 4001)
MS = 1_000_000
BASE = StreamSetpoint(7, 1, 1000, (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0), 0.125, 3)


class StreamRig:
    """A rig with its block and lease, on a test clock.

    Without a shared key its holder has the right to move under `token`, and the session `given`.
    """

    def __init__(self, key: bytes | None = None) -> None:
        self.now_ns = 5_000_000_000
        self.block = SharedBlock.create(2, 0.1, 1000.0)
        self.lease = Lease(PublishedRight(self.block), lambda: self.now_ns)
        self.sessions = StreamSessionManager(self.block, self.lease, key)
        self.token = ""
        self.given = StreamSession(7, bytes(32))
        if key is None:
            self.begin()

    def begin(self, ttl_s: float = 10.0) -> None:
        """Take the right, and a session for it."""
        self.token = self.lease.take("console", ttl_s)
        self.given = self.sessions.issue(self.token)

    def take(self, data: bytes, address: tuple[str, int] = HERE, ms: float = 20.0) -> bytes | None:
        self.now_ns += round(ms * MS)
        return self.sessions.receive(data, address, self.now_ns)

    def packet(self, sequence: int = 1, **change: Any) -> bytes:
        """Return a set-point of the given session."""
        packet = replace(BASE, session=self.given.number, sequence=sequence, **change)
        return seal(packet, self.given.key)

    def answer(
        self,
        packet: StreamSetpoint,
        key: bytes | None = None,
        address: tuple[str, int] = HERE,
        ms: float = 20.0,
    ) -> StreamAnswer:
        """Return the answer to a packet of the given session, or of one under `key`."""
        if key is None:
            packet, key = replace(packet, session=self.given.number), self.given.key
        data = self.take(seal(packet, key), address, ms)
        assert data is not None
        state = parse(data, key)
        assert isinstance(state, StreamAnswer)
        return state

    def greet(self, session: int = 7, address: tuple[str, int] = HERE) -> bytes:
        """Return the key of a session."""
        shared = stream_key(KEY)
        data = self.take(seal(Hello(session, b"n" * 16), shared), address)
        assert data is not None
        welcome = parse(data, shared)
        assert isinstance(welcome, Welcome)
        assert welcome.nonce == b"n" * 16
        return session_key(shared, welcome.robot_nonce, session)

    @property
    def posted(self) -> int:
        return int(self.block.counters["samples"][0])

    @property
    def until_ns(self) -> int:
        """The published time until which the right is held."""
        return int(self.block.counters["right_until_ns"][0])
