"""Ports on the simulated bus and on python-can interfaces, and batches of frames."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import can
import numpy as np
import pytest

from cdpr_drivers.bus import BusUrl, FrameBuffer, FramePort, open_port, query_status
from cdpr_drivers.bus.frames import EFF_FLAG, FRAME, RTR_FLAG, Batch
from cdpr_drivers.bus.simbus import SimbusPort
from cdpr_drivers.errors import BusError
from tests.drivers.bus.port_frames import frame, receive


@pytest.fixture
def url(simulator: Any) -> BusUrl:
    return BusUrl.parse(f"simbus:{simulator.name}")


@pytest.fixture
def port(url: BusUrl) -> Iterator[FramePort]:
    """Yield a port that receives the answers to SYNC."""
    opened = open_port(url, [(0x180, 0x780)])
    opened.settimeout(60.0)
    yield opened
    opened.close()


def test_a_port_exchanges_100_cycles_over_the_simulated_bus(
    simulator: Any, port: FramePort
) -> None:
    assert (port.status["mode"], port.status["nodes"]) == ("lockstep", [1])
    assert port.status["truth_log"] == "truth.bin"
    tx, rx = FrameBuffer(2), FrameBuffer(1)
    tx.array["can_id"] = 0x201, 0x80
    tx.array["length"] = 4, 0
    for k in range(100):
        tx.array["data"][0, :4] = k, 1, 2, 3
        assert port.send(tx.rows[0]) == 16
        port.send(tx.rows[1])
        assert port.recv_into(rx.rows[0]) == 16
        assert (rx.array["can_id"][0], rx.array["length"][0]) == (0x181, 4)
        np.testing.assert_array_equal(rx.array["data"][0, :4], (k, 1, 2, 3))
    status = query_status(simulator.name)
    assert (status["sync_count"], status["frames"], status["dropped"]) == (100, 400, 0)


def test_filters_may_exceed_one_control_message(url: BusUrl) -> None:
    filters = [(EFF_FLAG | can_id, 0xFFFFFFFF) for can_id in range(100)] + [(0x281, 0x7FF)]
    port, other = open_port(url, filters), open_port(url, [])
    port.settimeout(60.0)
    for can_id in (EFF_FLAG | 5, EFF_FLAG | 40, EFF_FLAG | 99, EFF_FLAG | 100, 0x80):
        other.send(frame(can_id))
    for can_id in (EFF_FLAG | 5, EFF_FLAG | 40, EFF_FLAG | 99):
        assert receive(port) == frame(can_id)
    assert receive(port) == frame(0x281, b"other")
    port.close()
    other.close()


@pytest.mark.parametrize("timeout_s", [0, 0.02, 0.2])
def test_a_wait_ends_at_its_timeout(url: BusUrl, timeout_s: float) -> None:
    port = open_port(url, [])
    port.settimeout(timeout_s)
    started = time.monotonic()
    with pytest.raises(BlockingIOError) as caught:
        port.recv_into(bytearray(16))
    assert timeout_s <= time.monotonic() - started
    assert "timeout" in str(port.lost(caught.value))
    port.close()


def test_drain_discards_waiting_frames(simulator: Any, port: FramePort) -> None:
    for _ in range(7):
        port.send(frame(0x80))
    while query_status(simulator.name)["sync_count"] < 7:
        pass
    assert port.drain() == 7
    assert port.drain() == 0
    port.send(frame(0x80))
    assert port.recv_into(bytearray(16)) == 16


def test_a_killed_simulator_is_noticed(simulator: Any, port: FramePort) -> None:
    simulator.kill()
    assert port.recv_into(bytearray(16)) == 0
    assert "is lost (connection closed)" in str(port.lost())
    with pytest.raises(OSError) as caught:
        port.send(frame(0x80))
    assert "is lost (Broken pipe)" in str(port.lost(caught.value))


def test_a_simulator_killed_with_frames_unread_is_noticed(simulator: Any) -> None:
    """If the other end leaves data unread, the kernel reports the connection as reset."""
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [])
    port.settimeout(60.0)
    simulator.process.send_signal(19)
    port.send(frame(0x80))
    simulator.kill()
    try:
        error = None
        assert port.recv_into(bytearray(16)) == 0
    except OSError as caught:
        error = caught
    assert isinstance(port.lost(error), BusError)
    port.close()


def test_a_missing_bus_is_reported() -> None:
    with pytest.raises(BusError, match=r"no simulated bus of that name.*cdpr sim up"):
        open_port(BusUrl.parse("simbus:nobody-home"))
    with pytest.raises(BusError, match="simbus:nobody-home"):
        query_status("nobody-home")
    with pytest.raises(BusError, match="socketcan:nocan9"):
        open_port(BusUrl.parse("socketcan:nocan9"))
    with pytest.raises(BusError, match="slcan:/dev/nothing"):
        open_port(BusUrl.parse("slcan:/dev/nothing?bitrate=1000000"))


def test_a_bus_that_does_not_answer_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cdpr_drivers.bus.simbus._ANSWER_TIMEOUT_S", 0.1)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stuck:
        stuck.bind("\0cdpr-rt/simbus/stuck")
        stuck.listen(1)
        with pytest.raises(BusError, match=r"did not answer in 0\.1 s"):
            query_status("stuck")


def test_a_python_can_interface_works_like_other_ports() -> None:
    port = open_port(BusUrl.parse("virtual:packed-port"), [(0x180, 0x780), (EFF_FLAG, EFF_FLAG)])
    port.settimeout(60.0)
    with can.Bus("packed-port", interface="virtual") as peer:
        port.send(frame(0x201, b"\x0f\x00\x10\x27"))
        message = peer.recv(60.0)
        assert message is not None
        assert (message.arbitration_id, message.is_extended_id) == (0x201, False)
        assert bytes(message.data) == b"\x0f\x00\x10\x27"
        port.send(FRAME.pack(0x123456 | EFF_FLAG | RTR_FLAG, 3, b""))
        message = peer.recv(60.0)
        assert message is not None
        assert (message.arbitration_id, message.is_extended_id) == (0x123456, True)
        assert (message.is_remote_frame, message.dlc) == (True, 3)
        for can_id in (0x80, 0x181):
            peer.send(can.Message(arbitration_id=can_id, data=b"12345678", is_extended_id=False))
        assert receive(port) == frame(0x181, b"12345678")
        peer.send(can.Message(arbitration_id=0x1F, is_remote_frame=True, dlc=2))
        assert receive(port) == FRAME.pack(0x1F | EFF_FLAG | RTR_FLAG, 2, b"")
        for _ in range(3):
            peer.send(can.Message(arbitration_id=0x181, is_extended_id=False))
        deadline, drained = time.monotonic() + 60.0, 0
        while drained < 3 and time.monotonic() < deadline:  # a thread of the port forwards them
            drained += port.drain()
        assert drained == 3
        port.settimeout(0.01)
        with pytest.raises(BlockingIOError):
            port.recv_into(bytearray(16))
        port.close()
        with pytest.raises(OSError, match="closed") as caught:
            port.send(frame(0x80))
        assert "is lost" in str(port.lost(caught.value))


# -- a node that babbles


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
    """Run a node that sends as fast as it can, with the highest or the lowest priority."""
    process = subprocess.Popen(
        [sys.executable, "-c", BABBLER, simulator.name, request.param], stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert b"on air" in process.stdout.readline()
    yield int(request.param, 16)
    process.kill()
    process.communicate()


def test_a_babbling_node_does_not_reach_a_filtered_port(simulator: Any, babbler: int) -> None:
    """Each cycle is answered, and only frames that pass the filter arrive."""
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [(0x181, 0x7FF)])
    port.settimeout(60.0)
    cycles = babbled = 0
    while cycles < 200 or babbled < 1000:
        for _ in range(50):
            port.send(frame(0x080))
            assert FRAME.unpack(receive(port))[0] == 0x181
        cycles += 50
        babbled = query_status(simulator.name)["frames"] - 3 * cycles
    assert query_status(simulator.name)["sync_count"] == cycles
    assert port.drain() == 0
    assert port.health.rx_lost == 0
    port.close()


# -- batches

N = 5


class Pair:
    """A port and the other end of its socket."""

    def __init__(self, together: bool) -> None:
        near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.port = SimbusPort(BusUrl.parse("simbus:pair"), near)
        self.frames = FrameBuffer(N)
        self.batch = self._batch_of(self.frames, together)
        self.out = FrameBuffer(N)
        for k, row in enumerate(self.out.rows):
            row[:] = FRAME.pack(0x180 + k, k, bytes(8))
        self.sender = self._batch_of(self.out, together)

    def _batch_of(self, frames: FrameBuffer, together: bool) -> Batch:
        return self.port.batch(frames) if together else Batch(self.port, frames)


@pytest.fixture(params=[True, False], ids=["together", "single"])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    pair = Pair(request.param)
    yield pair
    pair.port.close()
    pair.far.close()


def test_all_rows_go_out_in_order(pair: Pair) -> None:
    pair.sender.send()
    assert [pair.far.recv(99) for _ in range(N)] == [bytes(row) for row in pair.out.rows]


def test_received_frames_keep_their_length(pair: Pair) -> None:
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


def test_a_closed_peer_is_received_as_length_zero(pair: Pair) -> None:
    pair.port.settimeout(0.0)
    pair.far.send(bytes(16))
    pair.far.close()
    last = pair.batch.receive()
    assert pair.batch.lengths[0] == 16
    assert pair.batch.lengths[last - 1] == 0


def test_a_full_socket_raises_blocking_io_error(pair: Pair) -> None:
    pair.port.settimeout(0.0)
    with pytest.raises(BlockingIOError):
        while True:
            pair.sender.send()


def test_a_batch_on_a_closed_port_raises_os_error(pair: Pair) -> None:
    pair.port.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        pair.batch.receive()
    with pytest.raises(OSError, match="Bad file descriptor"):
        pair.sender.send()
