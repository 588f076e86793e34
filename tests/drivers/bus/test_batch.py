"""Frames that go through a socket together, and those that go one by one."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from cdpr_drivers.bus.batch import SingleFrameBatch
from cdpr_drivers.bus.frames import FRAME, Batch, FrameBuffer
from cdpr_drivers.bus.socket_port import SocketPort
from cdpr_drivers.bus.url import BusUrl

N = 5


class Pair:
    """A port, and the other end of its socket."""

    def __init__(self, together: bool) -> None:
        near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.port = SocketPort(BusUrl.parse("simbus:pair"), near, {})
        self.frames = FrameBuffer(N)
        self.batch = self._batch_of(self.frames, together)
        self.out = FrameBuffer(N)
        for k, row in enumerate(self.out.rows):
            row[:] = FRAME.pack(0x180 + k, k, bytes(8))
        self.sender = self._batch_of(self.out, together)

    def _batch_of(self, frames: FrameBuffer, together: bool) -> Batch:
        return self.port.batch(frames) if together else SingleFrameBatch(self.port, frames)


@pytest.fixture(params=[True, False], ids=["together", "single"])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    pair = Pair(request.param)
    yield pair
    pair.port.close()
    pair.far.close()


def test_all_rows_go_out_in_order(pair: Pair) -> None:
    pair.sender.send()
    assert [pair.far.recv(99) for _ in range(N)] == [bytes(row) for row in pair.out.rows]


def test_what_has_come_is_taken_in_with_its_length(pair: Pair) -> None:
    pair.port.settimeout(0.0)
    assert pair.batch.receive() == 0
    packets = [bytes([k]) * (16 + k) for k in range(N + 2)]
    for packet in packets:
        pair.far.send(packet)
    assert pair.batch.receive() == N
    assert [pair.batch.lengths[k] for k in range(N)] == [16] * N
    assert [bytes(row[:16]) for row in pair.frames.rows] == [p[:16] for p in packets[:N]]
    assert pair.batch.receive() == 2
    assert pair.batch.receive() == 0


def test_the_other_ends_leaving_is_a_length_of_zero(pair: Pair) -> None:
    pair.port.settimeout(0.0)
    pair.far.send(bytes(16))
    pair.far.close()
    last = pair.batch.receive()
    assert pair.batch.lengths[0] == 16
    assert pair.batch.lengths[last - 1] == 0


def test_a_full_socket_is_told_as_by_the_port(pair: Pair) -> None:
    pair.port.settimeout(0.0)
    with pytest.raises(BlockingIOError):
        while True:
            pair.sender.send()


def test_a_closed_port_is_told(pair: Pair) -> None:
    pair.port.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        pair.batch.receive()
    with pytest.raises(OSError, match="Bad file descriptor"):
        pair.sender.send()
