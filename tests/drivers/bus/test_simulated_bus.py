"""Frames that a leader receives and sends between two time packets."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

import pytest

from cdpr_drivers.bus.frames import FRAME, Batch, FrameBuffer
from cdpr_drivers.bus.simbus import LedPort, SimulatedBus
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

PACKET = struct.Struct("<8sdd")


def frame(identifier: int) -> bytes:
    return FRAME.pack(identifier, 8, bytes(8))


class Led:
    """A led bus and the end of its socket where the test plays the bus."""

    def __init__(self) -> None:
        near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.port = LedPort(BusUrl.parse("simbus:led"), near)
        self.bus = SimulatedBus(self.port, 0.0, 0.0)
        self.taken: list[int] = []
        self.bus.take = self._take

    def _take(self, last: int) -> None:
        self.taken += self.bus.frames.array["can_id"][:last].tolist()

    def send(self, kind: bytes, now_s: float, *identifiers: int) -> None:
        frames = b"".join(map(frame, identifiers))
        self.far.send(PACKET.pack(kind, now_s, now_s + 1.0) + frames)

    def time(self, now_s: float, *identifiers: int) -> None:
        self.send(b"bus-time", now_s, *identifiers)

    def sent(self) -> list[bytes]:
        """Return the packets that the bus has received."""
        packets = []
        self.far.setblocking(False)
        while True:
            try:
                packets.append(self.far.recv(4096))
            except BlockingIOError:
                return packets


@pytest.fixture
def led() -> Iterator[Led]:
    led = Led()
    yield led
    led.bus.port.close()
    led.far.close()


def test_frames_of_a_time_packet_are_received_with_it(led: Led) -> None:
    led.time(0.5, 1, 2)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s, led.bus.next_s) == ([1, 2], 0.5, 1.5)
    led.time(0.6)
    assert not led.bus.receive_until_time()


def test_data_packets_are_received_before_the_time_packet(led: Led) -> None:
    led.send(b"bus-data", 0.0, *range(128))
    led.time(0.5, 128)
    led.time(0.6, 129)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s) == ([*range(129)], 0.5)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s) == ([*range(130)], 0.6)


def commands(led: Led, n: int) -> tuple[Batch, FrameBuffer, bytes]:
    """Return a batch of n frames, their buffer, and the frames as sent."""
    buffer = FrameBuffer(n)
    for k, row in enumerate(buffer.rows):
        row[:] = frame(0x200 + k)
    return led.port.batch(buffer), buffer, b"".join(map(bytes, buffer.rows))


def test_two_to_26_commands_are_sent_in_one_packet(led: Led) -> None:
    for n in (2, 4, 26):
        batch, _, frames = commands(led, n)
        batch.send()
        assert led.sent() == [PACKET.pack(b"bus-data", 0.0, 0.0) + frames]


SYNC = frame(0x80)


def test_a_sync_after_2_to_25_commands_is_in_their_packet(led: Led) -> None:
    for n in (2, 25):
        batch, _, frames = commands(led, n)
        batch.send(SYNC)
        assert led.sent() == [PACKET.pack(b"bus-data", 0.0, 0.0) + frames + SYNC]


@pytest.mark.parametrize("n", [1, 26, 27])
def test_a_sync_after_other_numbers_of_commands_follows_alone(led: Led, n: int) -> None:
    batch, _, _ = commands(led, n)
    batch.send(SYNC)
    assert led.sent()[-1] == SYNC


@pytest.mark.parametrize("n", [1, 27])
def test_a_single_command_or_more_than_26_are_sent_one_by_one(led: Led, n: int) -> None:
    batch, _, frames = commands(led, n)
    batch.send()
    assert led.sent() == [frames[at : at + 16] for at in range(0, len(frames), 16)]


@pytest.mark.parametrize("packet", [b"", bytes(24), bytes(20)], ids=["gone", "24", "20"])
def test_an_invalid_packet_ends_the_bus(led: Led, packet: bytes) -> None:
    if packet:
        led.far.send(packet)
    else:
        led.far.close()
    with pytest.raises(BusError):
        led.bus.receive_until_time()
    assert led.bus.gone
