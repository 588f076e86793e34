"""A bus in a thread, with nodes whose behaviour the test defines."""

from __future__ import annotations

import itertools
import json
import math
import os
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import pytest

from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.frame import SYNC_ID, pack_frame

_numbers = itertools.count()


class StubNode:
    """Answer each SYNC with `answers`, send a frame at each of `timers`, and record everything."""

    def __init__(
        self,
        node_id: int = 1,
        *,
        sync_period_s: float = 0.0,
        answers: tuple[bytes, ...] = (),
        timers: tuple[float, ...] = (),
        accepts: frozenset[int] | None = None,
    ) -> None:
        self.node_id = node_id
        self.sync_period_s = sync_period_s
        self.outbox: list[bytes] = []
        self.accepts = accepts
        self.answers = answers
        self.timers = list(timers)
        self.seen: list[tuple[bytes, float]] = []
        self.advanced: list[float] = []
        self.closed = False

    def receive(self, frame: bytes, now: float) -> None:
        self.seen.append((frame, now))
        if int.from_bytes(frame[:4], "little") == SYNC_ID:
            self.outbox.extend(self.answers)

    def advance(self, now: float) -> None:
        self.advanced.append(now)
        while self.timers and self.timers[0] <= now:
            self.timers.pop(0)
            self.outbox.append(pack_frame(0x700 + self.node_id, b"\x05"))

    def next_event(self) -> float:
        return self.timers[0] if self.timers else math.inf

    def close(self) -> None:
        self.closed = True


class Member:
    """A client on a plain socket that does not use the library under test."""

    def __init__(self, name: str) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.sock.settimeout(60.0)
        self.sock.connect(f"\0cdpr-rt/simbus/{name}")
        self.status()

    def send(self, can_id: int, data: bytes = b"") -> None:
        self.sock.send(pack_frame(can_id, data))

    def recv(self) -> bytes:
        return self.sock.recv(65536)

    def recv_id(self) -> int:
        return int.from_bytes(self.recv()[:4], "little")

    def ask(self, message: object) -> dict[str, object]:
        """Send a control message and return the answer, discarding frames before it."""
        text = json.dumps(message).encode()
        self.sock.send(text + b" " * (len(text) == 16))
        while len(packet := self.recv()) == 16:
            pass
        answer = json.loads(packet)
        assert isinstance(answer, dict)
        return answer

    def status(self) -> dict[str, object]:
        return self.ask({"status": True})["status"]  # type: ignore[return-value]

    def lead(self) -> tuple[float, float]:
        """Take the lead and return bus time and the time of the next event."""
        answer = self.ask({"lead": True})["lead"]
        assert isinstance(answer, dict)
        return answer["now_s"], math.inf if answer["next_s"] is None else answer["next_s"]

    def until_time(self) -> tuple[list[bytes], float, float]:
        """Return frames up to the next time packet, the bus time, and that of the next event."""
        frames = list[bytes]()
        while True:
            packet = self.recv()
            mark, now_s, next_s = struct.unpack_from("<8sdd", packet)
            frames += [packet[at : at + 16] for at in range(24, len(packet), 16)]
            if mark == b"bus-time":
                return frames, now_s, next_s
            assert mark == b"bus-data"

    def go(self, until_s: float) -> tuple[list[bytes], float, float]:
        """Let the bus run until `until_s`. Return the result of `until_time`."""
        self.sock.send(struct.pack("<8sdd", b"bus-go\0\0", until_s, 0.0))
        return self.until_time()

    def sync(self) -> tuple[list[bytes], float, float]:
        """Send the SYNC of a leader. Return the result of `until_time`."""
        self.send(SYNC_ID)
        return self.until_time()

    def filters(self, *pairs: tuple[int, int]) -> None:
        self.sock.send(json.dumps({"filters": pairs}).encode().ljust(17))
        self.status()

    def quiet(self) -> bool:
        """Return whether no frame waits after the bus has processed all sent frames."""
        self.sock.send(b'{"status":true}  ')
        return len(self.recv()) != 16


class RunningBus:
    """A hub in a thread, with its clients."""

    def __init__(self, nodes: tuple[StubNode, ...], mode: ClockMode, bitrate: int) -> None:
        self.name = f"t{os.getpid()}-{next(_numbers)}"
        self.hub = Hub(nodes, mode=mode, bitrate=bitrate, name=self.name)
        self.hub.listen()
        self.thread = threading.Thread(target=self.hub.run)
        self.thread.start()
        self.members: list[Member] = []

    def join(self) -> Member:
        member = Member(self.name)
        self.members.append(member)
        return member

    def close(self) -> None:
        self.hub.stop()
        self.thread.join(60.0)
        assert not self.thread.is_alive()
        self.hub.close()
        for member in self.members:
            member.sock.close()


StartBus = Callable[..., RunningBus]


@pytest.fixture
def start_bus() -> Iterator[StartBus]:
    buses: list[RunningBus] = []

    def start(
        *nodes: StubNode, mode: ClockMode = ClockMode.LOCKSTEP, bitrate: int = 1_000_000
    ) -> RunningBus:
        buses.append(RunningBus(nodes, mode, bitrate))
        return buses[-1]

    yield start
    for bus in buses:
        bus.close()


@pytest.fixture
def stub_node() -> type[StubNode]:
    return StubNode
