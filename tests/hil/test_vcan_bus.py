"""Frames on a real vcan0: python-can, raw sockets and our ports agree."""

import multiprocessing
import socket
import struct
import time

import can
import pytest

from cdpr_drivers.bus.socketcan import open_socketcan
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

CYCLES = 300
pytestmark = pytest.mark.vcan

FRAME = struct.Struct("=IB3x8s")


@pytest.fixture
def raw():
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind(("vcan0",))
        bus.settimeout(60.0)
        yield bus


def test_two_clients_exchange_frames_through_their_filters():
    with (
        can.Bus("vcan0", interface="socketcan") as one,
        can.Bus(
            "vcan0", interface="socketcan", can_filters=[{"can_id": 0x180, "can_mask": 0x780}]
        ) as two,
    ):
        for can_id in (0x080, 0x181, 0x201, 0x1FF, 0x701):
            one.send(can.Message(arbitration_id=can_id, data=[1, 2, 3], is_extended_id=False))
        seen = [two.recv(60.0) for _ in range(2)]
        assert [m.arbitration_id for m in seen if m] == [0x181, 0x1FF]
        assert two.recv(0.05) is None
        two.send(can.Message(arbitration_id=0x601, data=b"12345678", is_extended_id=False))
        answer = one.recv(60.0)
        assert answer is not None
        assert (answer.arbitration_id, bytes(answer.data)) == (0x601, b"12345678")


def test_a_raw_socket_transfers_packed_frames(raw: socket.socket):
    with can.Bus("vcan0", interface="socketcan") as other:
        raw.send(FRAME.pack(0x201, 4, b"\x0f\x00\xf4\x01"))
        message = other.recv(60.0)
        assert message is not None
        assert (message.arbitration_id, bytes(message.data)) == (0x201, b"\x0f\x00\xf4\x01")
        other.send(can.Message(arbitration_id=0x181, data=range(8), is_extended_id=False))
        assert FRAME.unpack(raw.recv(16)) == (0x181, 8, bytes(range(8)))


def test_a_socket_port_filters_waits_and_drains():
    url = BusUrl.parse("socketcan:vcan0")
    port = open_socketcan(url, [(0x181, 0x7FF), (0x080, 0x7FF)])
    other = open_socketcan(url, None)
    buffer = bytearray(16)
    try:
        port.settimeout(60.0)
        for can_id in (0x080, 0x182, 0x181):
            other.send(FRAME.pack(can_id, 2, b"ab"))
        for can_id in (0x080, 0x181):
            assert port.recv_into(buffer) == 16
            assert FRAME.unpack(buffer)[:2] == (can_id, 2)
        port.settimeout(0.1)
        start = time.monotonic()
        with pytest.raises(BlockingIOError):
            port.recv_into(buffer)
        assert time.monotonic() - start > 0.09
        for _ in range(5):
            other.send(FRAME.pack(0x181, 0, b""))
        drained, end = 0, time.monotonic() + 60.0
        while drained < 5 and time.monotonic() < end:
            drained += port.drain()
        assert drained == 5
        port.settimeout(0)
        with pytest.raises(BlockingIOError):
            port.recv_into(buffer)
    finally:
        port.close()
        other.close()


def test_error_for_a_missing_interface_names_it():
    with pytest.raises(BusError, match="there is no network interface 'vcan77'"):
        open_socketcan(BusUrl.parse("socketcan:vcan77"), None)


def _answer_each_sync(count: int) -> None:
    port = open_socketcan(BusUrl.parse("socketcan:vcan0"), [(0x080, 0x7FF)])
    buffer = bytearray(16)
    port.send(FRAME.pack(0x701, 1, b"\0"))
    for k in range(count):
        port.recv_into(buffer)
        port.send(FRAME.pack(0x181, 4, struct.pack("<I", k)))
    port.close()


def test_cycles_between_two_processes_lose_no_frame():
    port = open_socketcan(BusUrl.parse("socketcan:vcan0"), None)
    port.settimeout(60.0)
    slave = multiprocessing.get_context("fork").Process(target=_answer_each_sync, args=(CYCLES,))
    slave.start()
    buffer = bytearray(16)
    sync = FRAME.pack(0x080, 0, b"")
    try:
        port.recv_into(buffer)
        assert FRAME.unpack(buffer)[0] == 0x701
        for k in range(CYCLES):
            port.send(sync)
            port.recv_into(buffer)
            can_id, length, data = FRAME.unpack(buffer)
            assert (can_id, length, data[:4]) == (0x181, 4, struct.pack("<I", k))
    finally:
        slave.join(20)
        port.close()
    assert slave.exitcode == 0
