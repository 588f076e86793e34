"""The Modbus TCP client returns a valid answer or raises a clear error."""

from __future__ import annotations

import random
import socket
import threading
from collections.abc import Callable, Iterator

import pytest

from cdpr_drivers.modbus.channel import ModbusError, ModbusTcp
from cdpr_rt.core.clock import PacedClock

Answer = Callable[[bytes], bytes]


class Babbler:
    """A device whose answers the test defines frame by frame."""

    def __init__(self) -> None:
        self.answer: Answer = lambda request: b""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                peer, _ = self._listener.accept()
            except OSError:
                return
            with peer:
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                while request := _received(peer):
                    peer.sendall(self.answer(request))

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()


def _received(peer: socket.socket) -> bytes:
    try:
        return peer.recv(300)
    except OSError:
        return b""


def framed(request: bytes, body: bytes, length: int | None = None) -> bytes:
    """Return `body` with the header of an answer to `request`."""
    announced = len(body) + 1 if length is None else length
    return request[:4] + announced.to_bytes(2, "big") + request[6:7] + body


@pytest.fixture
def device() -> Iterator[Babbler]:
    babbler = Babbler()
    yield babbler
    babbler.close()


@pytest.fixture
def client(device: Babbler) -> Iterator[ModbusTcp]:
    opened = ModbusTcp("127.0.0.1", device.port, 1, 60.0, PacedClock())
    yield opened
    opened.close()


def test_a_valid_answer_is_read(device: Babbler, client: ModbusTcp) -> None:
    device.answer = lambda request: framed(request, bytes([2, 2, 0b00000101, 1]))
    assert client.inputs(7, 9) == [True, False, True, *[False] * 5, True]
    device.answer = lambda request: framed(request, bytes([3, 4, 0x12, 0x34, 0xFF, 0xFF]))
    assert client.registers(100, 2) == [0x1234, 0xFFFF]
    device.answer = lambda request: request  # the right unit
    client.write_coil(5, True)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (bytes([1, 2, 0, 0]), "function 1 was answered, but 2 was requested"),
        (bytes([2, 1, 0]), "8 bits arrived, not 9"),
        (bytes([0x82, 2]), "exception 2 .illegal data address"),
        (bytes([0x82, 200]), "exception 200 .unknown exception"),
    ],
)
def test_a_wrong_answer_is_reported(
    device: Babbler, client: ModbusTcp, body: bytes, said: str
) -> None:
    device.answer = lambda request: framed(request, body)
    with pytest.raises(
        ModbusError, match=f"127.0.0.1:{device.port}: discrete inputs 7 to 15: .*{said}"
    ):
        client.inputs(7, 9)
    device.answer = lambda request: framed(request, bytes([2, 2, 0, 0]))
    assert client.inputs(7, 9) == [False] * 9  # the next request works


def test_an_echo_of_a_different_write_is_rejected(device: Babbler, client: ModbusTcp) -> None:
    device.answer = lambda request: framed(request, bytes([5, 0, 6, 0xFF, 0]))
    with pytest.raises(ModbusError, match="set coil 5 to 1: the answer belongs to another request"):
        client.write_coil(5, True)
    device.answer = lambda request: framed(request, bytes([16, 0, 100, 0, 1]))
    with pytest.raises(ModbusError, match="another request"):
        client.write_registers(100, [1, 2])


def test_arbitrary_bytes_give_an_answer_or_a_modbus_error(device: Babbler) -> None:
    dice = random.Random(3)
    client = ModbusTcp("127.0.0.1", device.port, 1, 0.03, PacedClock())

    def anything(request: bytes) -> bytes:
        code = request[7]
        bodies = [
            bytes([code]) + dice.randbytes(dice.randrange(20)),
            bytes([code, dice.randrange(256)]),
            bytes([code | 0x80]) + dice.randbytes(dice.randrange(3)),
            dice.randbytes(dice.randrange(1, 30)),
        ]
        length = dice.choice([None] * 6 + [0, 1, 300, 0xFFFF])
        whole = framed(request, dice.choice(bodies), length)
        return dice.choice([whole] * 5 + [dice.randbytes(20), whole + whole])

    device.answer = anything
    requests: list[Callable[[], object]] = [
        lambda: client.inputs(0, 9),
        lambda: client.coils(3, 8),
        lambda: client.registers(5, 2),
        lambda: client.write_coil(1, True),
        lambda: client.write_registers(3, [1, 2]),
    ]
    refused = 0
    for _ in range(100):
        try:
            dice.choice(requests)()
        except ModbusError as error:
            assert str(error).startswith(f"127.0.0.1:{device.port}: ")
            refused += 1
    client.close()
    assert refused > 50
