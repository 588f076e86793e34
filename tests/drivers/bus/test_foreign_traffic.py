"""Ports among nodes that babble, repeat themselves, mix up the order or get lengths wrong."""

from __future__ import annotations

import random
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from cdpr_drivers.bus import BusUrl, open_port, open_python_can, query_status
from cdpr_drivers.bus.frames import ERR_FLAG, FRAME, RTR_FLAG

BABBLER = """
import socket, struct, sys
bus = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
bus.connect("\\0cdpr-rt/simbus/" + sys.argv[1])
bus.send(b'{"filters":[]}')
frame = struct.pack("=IB3x8s", int(sys.argv[2], 16), 8, b"babbling")
print("on air", flush=True)
while True:
    bus.send(frame)
"""


@pytest.fixture(params=["001", "7FF"])
def babbler(simulator: Any, request: pytest.FixtureRequest) -> Iterator[int]:
    """A node that sends as fast as it can, with the highest or the lowest priority."""
    process = subprocess.Popen(
        [sys.executable, "-c", BABBLER, simulator.name, request.param], stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert b"on air" in process.stdout.readline()
    yield int(request.param, 16)
    process.kill()
    process.communicate()


def test_a_babbling_node_does_not_reach_a_filtered_port(simulator: Any, babbler: int) -> None:
    """Each cycle is answered, and what comes is only what was asked for."""
    url = BusUrl.parse(f"simbus:{simulator.name}")
    port = open_port(url, [(0x181, 0x7FF)])
    port.settimeout(60.0)
    rx, sync = bytearray(16), FRAME.pack(0x080, 0, b"")
    cycles = babbled = 0
    while cycles < 200 or babbled < 1000:
        for _ in range(50):
            port.send(sync)
            port.recv_into(rx)
            assert FRAME.unpack(rx)[0] == 0x181
        cycles += 50
        babbled = query_status(simulator.name)["frames"] - 3 * cycles
    assert query_status(simulator.name)["sync_count"] == cycles
    assert port.drain() == 0
    assert port.health.rx_lost == 0
    port.close()


def test_the_acyclic_side_hears_nothing_of_it_either(simulator: Any, babbler: int) -> None:
    url = BusUrl.parse(f"simbus:{simulator.name}")
    with open_python_can(url, [(0x281, 0x7FF)]) as bus:
        port = open_port(url, [])
        port.send(FRAME.pack(0x080, 0, b""))
        message = bus.recv(60.0)
        assert message is not None
        assert (message.arbitration_id, bytes(message.data)) == (0x281, b"other")
        assert bus.recv(0.1) is None
        port.close()


def test_repeated_and_shuffled_frames_come_as_they_were_sent(simulator: Any) -> None:
    """Order is for the layer above to judge: the port neither loses nor sorts."""
    url = BusUrl.parse(f"simbus:{simulator.name}")
    port, third_party = open_port(url, [(0x180, 0x780)]), open_port(url, [])
    port.settimeout(60.0)
    sent = [FRAME.pack(0x180 + k % 4, k % 9, bytes([k]) * (k % 9)) for k in range(60)] * 2
    random.Random(5).shuffle(sent)
    for frame in sent:
        third_party.send(frame)
    rx = bytearray(16)
    for frame in sent:
        port.recv_into(rx)
        assert rx == frame
    port.close()
    third_party.close()


def test_what_no_bus_carries_is_dropped_and_counted(simulator: Any) -> None:
    url = BusUrl.parse(f"simbus:{simulator.name}")
    port, third_party = open_port(url), open_port(url, [])
    port.settimeout(60.0)
    before = query_status(simulator.name)["malformed"]
    for bad in (
        FRAME.pack(0x181, 9, bytes(8)),
        FRAME.pack(0x181, 255, bytes(8)),
        FRAME.pack(ERR_FLAG | 0x181, 8, bytes(8)),
    ):
        third_party.send(bad)
    third_party.send(FRAME.pack(RTR_FLAG | 0x701, 0, b""))
    rx = bytearray(16)
    port.recv_into(rx)
    assert rx == FRAME.pack(RTR_FLAG | 0x701, 0, b"")
    assert query_status(simulator.name)["malformed"] == before + 3
    port.close()
    third_party.close()


def test_packets_that_are_neither_frame_nor_message_harm_nobody(simulator: Any) -> None:
    rng = random.Random(7)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as third_party:
        third_party.connect(f"\0cdpr-rt/simbus/{simulator.name}")
        third_party.settimeout(60.0)
        for length in (1, 5, 15, 17, 100, 447, 448, 3000):
            third_party.send(rng.randbytes(length))
            assert b"error" in third_party.recv(65536)
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [(0x181, 0x7FF)])
    port.settimeout(60.0)
    port.send(FRAME.pack(0x080, 0, b""))
    assert port.recv_into(bytearray(16)) == 16
    port.close()
