"""A receiver of the set-point stream on a real socket, with its memory block and lease."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.listening import listen_udp
from cdpr_rt.service.setpoint_stream import SetpointStream
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import StreamSession


class Robot:
    """A receiver with its memory block and lease."""

    def __init__(self, key: bytes | None = None, host: str = "127.0.0.1", port: int = 0) -> None:
        self.block = SharedBlock.create(1, 0.1, 1000.0)
        self.lease = Lease(PublishedRight(self.block))
        sock = listen_udp(host, port, has_key=key is not None)
        self.stream = SetpointStream(self.block, self.lease, sock, key)
        self.stream.start()
        _, self.port = self.stream.address

    def give(self) -> StreamSession:
        """Take the right to move if nobody has it, and return a session for its holder."""
        with contextlib.suppress(LeaseError):
            self.token = self.lease.take("console", 10.0)
        return self.stream.sessions.issue(self.token)

    @property
    def until_ns(self) -> int:
        return int(self.block.counters["right_until_ns"][0])

    @property
    def posted(self) -> int:
        return int(self.block.counters["samples"][0])

    def count(self, name: str) -> int:
        return int(self.stream.status()["packets"][name])


@contextmanager
def robot(key: bytes | None = None, host: str = "127.0.0.1") -> Iterator[Robot]:
    one = Robot(key, host)
    try:
        yield one
    finally:
        one.stream.stop()


def converse(client: StreamClient, what: Callable[[], bool], seconds: float = 60.0) -> None:
    """Stream at about 100 Hz until `what`."""
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, f"not in time; {client.state}"
        client.send((0.0, 0.0, 0.1))
        time.sleep(0.01)
        client.receive()
