"""What a leader takes in between two words on the time."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

import pytest

from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.bus.simulated_bus import SimulatedBus
from cdpr_drivers.bus.socket_port import SocketPort
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

TIME = struct.Struct("<8sdd")


class Led:
    """A led bus, and the end of its socket at which the bus is played."""

    def __init__(self) -> None:
        near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.bus = SimulatedBus(SocketPort(BusUrl.parse("simbus:led"), near, {}), 0.0, 0.0)
        self.taken: list[int] = []
        self.bus.take = self._take

    def _take(self, last: int) -> None:
        self.taken += self.bus.frames.array["can_id"][:last].tolist()

    def frame(self, identifier: int) -> None:
        self.far.send(FRAME.pack(identifier, 8, bytes(8)))

    def time(self, now_s: float) -> None:
        self.far.send(TIME.pack(b"bus-time", now_s, now_s + 1.0))


@pytest.fixture
def led() -> Iterator[Led]:
    led = Led()
    yield led
    led.bus.port.close()
    led.far.close()


def test_frames_up_to_the_time_are_taken_in(led: Led) -> None:
    led.frame(1)
    led.frame(2)
    led.time(0.5)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s, led.bus.next_s) == ([1, 2], 0.5, 1.5)
    led.time(0.6)
    assert not led.bus.receive_until_time()


def test_what_a_third_party_sends_behind_the_time_belongs_to_the_next(led: Led) -> None:
    led.frame(1)
    led.time(0.5)
    for identifier in (2, 3, 4):
        led.frame(identifier)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s) == ([1], 0.5)
    led.frame(5)
    led.time(0.6)
    assert led.bus.receive_until_time()
    assert (led.taken, led.bus.now_s) == ([1, 2, 3, 4, 5], 0.6)


def test_several_words_on_the_time_are_one_each(led: Led) -> None:
    for k in (1, 2, 3):
        led.frame(k)
        led.time(float(k))
    for k in (1, 2, 3):
        assert led.bus.receive_until_time()
        assert (led.taken, led.bus.now_s) == (list(range(1, k + 1)), float(k))


@pytest.mark.parametrize("packet", [b"", bytes(24), bytes(20)], ids=["gone", "24", "20"])
def test_what_is_neither_ends_the_bus(led: Led, packet: bytes) -> None:
    led.frame(1)
    if packet:
        led.far.send(packet)
    else:
        led.far.close()
    with pytest.raises(BusError):
        led.bus.receive_until_time()
    assert led.bus.gone
