"""Frames that a leader receives and sends between two time packets."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

import pytest

from cdpr_drivers.bus.frames import FRAME
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


@pytest.mark.parametrize("packet", [b"", bytes(24), bytes(20)], ids=["gone", "24", "20"])
def test_an_invalid_packet_ends_the_bus(led: Led, packet: bytes) -> None:
    if packet:
        led.far.send(packet)
    else:
        led.far.close()
    with pytest.raises(BusError):
        led.bus.receive_until_time()
    assert led.bus.gone
