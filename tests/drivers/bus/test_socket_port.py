"""Packed frames on the simulated bus and on python-can interfaces."""

from __future__ import annotations

import socket
import time
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from cdpr_drivers.bus import BusUrl, FrameBuffer, open_port, query_status
from cdpr_drivers.bus.frames import EFF_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.bus.socket_port import SocketPort
from cdpr_drivers.errors import BusError


def frame(can_id: int, data: bytes = b"") -> bytes:
    return FRAME.pack(can_id, len(data), data)


def test_one_cycle_over_the_simulated_bus(simulator: Any) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [(0x180, 0x780)])
    port.settimeout(60.0)
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
    port.close()


def test_opening_tells_what_the_bus_is(simulator: Any) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"))
    assert (port.status["mode"], port.status["nodes"]) == ("lockstep", [1])
    assert port.status["truth_log"] == "truth.bin"
    port.close()


def test_many_filters(simulator: Any) -> None:
    """More filters than one control message holds."""
    filters = [(EFF_FLAG | can_id, 0xFFFFFFFF) for can_id in range(100)] + [(0x281, 0x7FF)]
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), filters)
    other = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [])
    port.settimeout(60.0)
    rx = bytearray(16)
    for can_id in (EFF_FLAG | 5, EFF_FLAG | 40, EFF_FLAG | 99, EFF_FLAG | 100, 0x80):
        other.send(frame(can_id))
    for can_id in (EFF_FLAG | 5, EFF_FLAG | 40, EFF_FLAG | 99):
        port.recv_into(rx)
        assert rx == frame(can_id)
    port.recv_into(rx)
    assert rx == frame(0x281, b"other")
    port.close()
    other.close()


@pytest.mark.parametrize("timeout_s", [0, 0.02, 0.2])
def test_time_out(simulator: Any, timeout_s: float) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [])
    port.settimeout(timeout_s)
    started = time.monotonic()
    with pytest.raises(BlockingIOError) as caught:
        port.recv_into(bytearray(16))
    assert timeout_s <= time.monotonic() - started
    assert "time-out" in str(port.lost(caught.value))
    port.close()


def test_drain(simulator: Any) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [(0x180, 0x780)])
    port.settimeout(60.0)
    for _ in range(7):
        port.send(frame(0x80))
    while query_status(simulator.name)["sync_count"] < 7:
        pass
    assert port.drain() == 7
    assert port.drain() == 0
    port.send(frame(0x80))
    assert port.recv_into(bytearray(16)) == 16
    port.close()


def test_a_killed_simulator_is_noticed(simulator: Any) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"), [(0x180, 0x780)])
    port.settimeout(60.0)
    simulator.kill()
    assert port.recv_into(bytearray(16)) == 0
    assert "gone away (connection closed)" in str(port.lost())
    with pytest.raises(OSError) as caught:
        port.send(frame(0x80))
    assert "gone away (Broken pipe)" in str(port.lost(caught.value))
    port.close()


def test_a_simulator_killed_with_frames_unread_is_noticed(simulator: Any) -> None:
    """The kernel reports a connection whose other end left data unread as reset."""
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


def test_a_bus_that_is_not_there() -> None:
    with pytest.raises(BusError, match=r"no simulated bus of that name.*cdpr sim up"):
        open_port(BusUrl.parse("simbus:nobody-home"))
    with pytest.raises(BusError, match="simbus:nobody-home"):
        query_status("nobody-home")
    with pytest.raises(BusError, match="socketcan:nocan9"):
        open_port(BusUrl.parse("socketcan:nocan9"))
    with pytest.raises(BusError, match="slcan:/dev/nothing"):
        open_port(BusUrl.parse("slcan:/dev/nothing?bitrate=1000000"))


def test_a_bus_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cdpr_drivers.bus.adapters.simbus_socket._ANSWER_TIMEOUT_S", 0.1)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stuck:
        stuck.bind("\0cdpr-rt/simbus/stuck")
        stuck.listen(1)
        with pytest.raises(BusError, match=r"did not answer in 0\.1 s"):
            query_status("stuck")


def test_any_python_can_interface_gives_the_same_port() -> None:
    port = open_port(BusUrl.parse("virtual:packed-port"), [(0x180, 0x780), (EFF_FLAG, EFF_FLAG)])
    port.settimeout(60.0)
    with can.Bus("packed-port", interface="virtual") as peer:
        rx = bytearray(16)
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
        assert port.recv_into(rx) == 16
        assert rx == frame(0x181, b"12345678")
        peer.send(can.Message(arbitration_id=0x1F, is_remote_frame=True, dlc=2))
        port.recv_into(rx)
        assert rx == FRAME.pack(0x1F | EFF_FLAG | RTR_FLAG, 2, b"")
        for _ in range(3):
            peer.send(can.Message(arbitration_id=0x181, is_extended_id=False))
        deadline, drained = time.monotonic() + 60.0, 0
        while drained < 3 and time.monotonic() < deadline:  # a thread of the port's passes them on
            drained += port.drain()
        assert drained == 3
        port.settimeout(0.01)
        with pytest.raises(BlockingIOError):
            port.recv_into(rx)
        port.close()
        with pytest.raises(OSError, match="closed") as caught:
            port.send(frame(0x80))
        assert "gone away" in str(port.lost(caught.value))


def test_frame_buffers_are_one_memory() -> None:
    buffer = FrameBuffer(3)
    buffer.rows[1][:] = frame(0x181 | EFF_FLAG, b"abc")
    assert buffer.array["can_id"].tolist() == [0, 0x181 | EFF_FLAG, 0]
    assert bytes(buffer.array["data"][1]) == b"abc\0\0\0\0\0"
    buffer.array["length"][2] = 8
    assert buffer.rows[2][4] == 8


def test_the_cycle_calls_the_socket_itself(simulator: Any) -> None:
    port = open_port(BusUrl.parse(f"simbus:{simulator.name}"))
    assert isinstance(port, SocketPort)
    assert isinstance(getattr(port.send, "__self__", None), socket.socket)
    assert isinstance(getattr(port.recv_into, "__self__", None), socket.socket)
    assert Path(f"/proc/self/fd/{port.fileno()}").exists()
    port.close()
