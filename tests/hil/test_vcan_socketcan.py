"""SocketCAN beyond frames: error frames, timestamps, full queues and links that go down."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import pty
import select
import signal
import socket
import struct
import subprocess
import termios
import time
import tty
from collections.abc import Iterator

import pytest
import serial
import vcan_replay
from fork_server import FORKED

from cdpr_drivers.bus import BusHealth, BusState, BusUrl, open_port
from cdpr_drivers.bus.frames import ERR_FLAG, FRAME
from cdpr_drivers.bus.socketcan import SocketCanPort
from cdpr_drivers.errors import BusError

pytestmark = pytest.mark.vcan

VCAN0, VCAN1 = BusUrl.parse("socketcan:vcan0"), BusUrl.parse("socketcan:vcan1")
N_SLCAN, SIOCGIFNAME, SIOCGIFFLAGS, SIOCSIFFLAGS = 17, 0x8910, 0x8913, 0x8914


def set_link(name: str, *, up: bool) -> None:
    """Bring a network interface up or down."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        request = struct.pack("16sH22x", name.encode(), 0)
        (flags,) = struct.unpack_from("H", fcntl.ioctl(sock, SIOCGIFFLAGS, request), 16)
        flags = flags | 1 if up else flags & ~1
        fcntl.ioctl(sock, SIOCSIFFLAGS, struct.pack("16sH22x", name.encode(), flags))


def test_frames_have_the_kernels_timestamps() -> None:
    port, peer = open_port(VCAN0, [(0x181, 0x7FF)]), open_port(VCAN0, [])
    port.settimeout(60.0)
    before = time.time()
    peer.send(FRAME.pack(0x181, 0, b""))
    assert select.select([port.fileno()], [], [], 60.0)[0]
    after = time.time()
    time.sleep(0.3)
    buffer = bytearray(16)
    port.recv_into(buffer)
    assert before - 0.01 <= port.arrival_s() <= after + 0.01
    port.close()
    peer.close()


def test_error_frames_update_the_bus_health_and_disturb_no_cycle() -> None:
    """On a vcan, a program can send the error frames that a driver would create."""
    cyclic, source = open_port(VCAN0), open_port(VCAN0, [])
    cyclic.settimeout(0.05)
    acyclic = open_port(VCAN0, [(0x701, 0x7FF)], receive_errors=True)
    acyclic.settimeout(60.0)
    buffer = bytearray(16)
    health = BusHealth()
    told = [
        (ERR_FLAG | 0x004, bytes([0, 0x08]), BusState.WARNING),
        (ERR_FLAG | 0x004, bytes([0, 0x20]), BusState.PASSIVE),
        (ERR_FLAG | 0x040, b"", BusState.BUS_OFF),
        (ERR_FLAG | 0x100, b"", BusState.ACTIVE),
    ]
    for can_id, data, state in told:
        source.send(FRAME.pack(can_id, 8, data))
        acyclic.recv_into(buffer)
        assert buffer == FRAME.pack(can_id, 8, data)
        assert health.take_error(can_id, data)
        assert health.state is state
    assert health.bus_offs == 1
    with pytest.raises(BlockingIOError):
        cyclic.recv_into(buffer)
    acyclic.close()
    cyclic.close()
    source.close()


@pytest.fixture
def down() -> Iterator[None]:
    set_link("vcan1", up=False)
    yield
    set_link("vcan1", up=True)


def test_an_interface_that_is_down_is_reported(down: None) -> None:
    with pytest.raises(BusError, match=r"'vcan1' is down; .* sudo ip link set vcan1 up"):
        open_port(VCAN1)
    with pytest.raises(BusError, match="'lo' is not a CAN interface"):
        open_port(BusUrl.parse("socketcan:lo"))


def test_readers_and_senders_detect_an_interface_that_goes_down() -> None:
    port, peer = open_port(VCAN1), open_port(VCAN1, [])
    port.settimeout(60.0)
    peer.send(FRAME.pack(0x181, 0, b""))
    assert port.recv_into(bytearray(16)) == 16
    set_link("vcan1", up=False)
    try:
        with pytest.raises(OSError, match="down") as caught:
            port.recv_into(bytearray(16))
        assert "the bus is lost: the network interface 'vcan1' is down" in str(
            port.lost(caught.value)
        )
        with pytest.raises(OSError, match=r".") as caught:
            peer.send(FRAME.pack(0x181, 0, b""))
        assert "'vcan1' is down" in str(peer.lost(caught.value))
    finally:
        set_link("vcan1", up=True)
        port.close()
        peer.close()


def kernel_slcan(terminal: int) -> str:
    """Attach the kernel's slcan driver to a terminal. Return its active network interface."""
    try:
        fcntl.ioctl(terminal, termios.TIOCSETD, struct.pack("i", N_SLCAN))
    except OSError as error:
        if vcan_replay.REPORTS_VARIABLE in os.environ:
            raise
        pytest.skip(f"this kernel has no slcan or lets only root use it ({error.strerror})")
    name = fcntl.ioctl(terminal, SIOCGIFNAME, bytes(40))[:16].rstrip(b"\0").decode()
    set_link(name, up=True)
    return name


@pytest.fixture
def stalled_adapter() -> Iterator[tuple[int, str]]:
    """Yield an interface of the kernel's slcan driver on a terminal that nobody reads."""
    host, terminal = pty.openpty()
    tty.setraw(terminal)
    name = kernel_slcan(terminal)
    yield host, name
    os.close(terminal)
    os.close(host)


def test_a_full_transmit_queue_is_counted_and_reported(stalled_adapter: tuple[int, str]) -> None:
    host, name = stalled_adapter
    health = BusHealth()
    port = open_port(BusUrl.parse(f"socketcan:{name}"), [], health)
    assert isinstance(port, SocketCanPort)
    frame = FRAME.pack(0x201, 8, bytes(8))
    started = time.monotonic()
    with pytest.raises(OSError, match="buffer space") as caught:
        for _ in range(2000):
            port.send(frame)
    assert caught.value.errno == errno.ENOBUFS
    assert time.monotonic() - started < 300.0
    assert health.tx_full > 100
    assert f"transmit queue of {name} has been full" in str(port.lost(caught.value))
    # the bus works again as soon as the adapter reads frames
    os.set_blocking(host, False)
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        with contextlib.suppress(BlockingIOError):
            os.read(host, 65536)
        with contextlib.suppress(OSError):
            port.send(frame)
            break
    else:
        raise AssertionError("no frame got out again")
    port.close()


SIMULATOR = """
import math
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.bus.server import serve

class Node:
    node_id, sync_period_s, accepts = 1, 0.001, frozenset((0x80, 0x201))
    def __init__(self): self.outbox, self.data = [], bytes(8)
    def receive(self, frame, now):
        if frame[:2] == b"\\x80\\x00":
            self.outbox.append(pack_frame(0x181, self.data))
        else:
            self.data = frame[8:16]
    def advance(self, now): pass
    def next_event(self): return math.inf
    def close(self): pass

serve([Node()], "simbus:kernel-slcan", until_stdin_ends=True, slcan=True)
"""


def test_the_kernels_slcan_driver_works_with_the_simulated_adapter() -> None:
    simulator = subprocess.Popen(
        [*FORKED, SIMULATOR], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert simulator.stdout is not None
    ready = json.loads(simulator.stdout.readline())["ready"]
    with serial.Serial(ready["slcan"], timeout=60.0) as terminal:
        terminal.write(b"S8\rO\r")
        assert terminal.read(2) == b"\r\r"
        url = BusUrl.parse(f"socketcan:{kernel_slcan(terminal.fileno())}")
        port = open_port(url, [(0x181, 0x7FF)])
        port.settimeout(60.0)
        buffer = bytearray(16)
        for k in range(100):
            port.send(FRAME.pack(0x201, 8, bytes([k, 1, 2, 3, 4, 5, 6, 255])))
            port.send(FRAME.pack(0x080, 0, b""))
            port.recv_into(buffer)
            assert FRAME.unpack(buffer) == (0x181, 8, bytes([k, 1, 2, 3, 4, 5, 6, 255]))
        # unplugged: the driver removes its interface
        os.kill(ready["slcan_pid"], signal.SIGKILL)
        with pytest.raises(OSError, match=r".") as caught:
            port.recv_into(buffer)
        assert "is lost" in str(port.lost(caught.value))
        assert not isinstance(caught.value, BlockingIOError)
        port.close()
    simulator.communicate(timeout=120)
