"""Eight drives run as one device on two real CAN interfaces, four on each."""

from __future__ import annotations

import json
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tolerant_drive import write_tolerant_robot

import cdpr_profiles
from cdpr_profiles import load_robot
from cdpr_rt.control.pid import Proportional
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_tools.composition.session import open_robot
from cdpr_tools.output import Output

pytestmark = pytest.mark.vcan

SIMULATED = ("--bus", "can0=socketcan:vcan0", "--bus", "can1=socketcan:vcan1")
BUSES = ("can0=socketcan:vcan0?lockstep=true", "can1=socketcan:vcan1?lockstep=true")
FRAME = struct.Struct("=IB3x8s")


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """Write a robot with long timeouts: without a leader, drives miss a delayed master."""
    path = tmp_path / "bench-8.toml"
    shipped = Path(cdpr_profiles.__file__).parent / "robots" / "bench-8.toml"
    write_tolerant_robot(path, shipped.read_text())
    return path


@pytest.fixture
def drives(robot: Path) -> Iterator[dict[str, object]]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", str(robot), *SIMULATED]
    process = subprocess.Popen(
        [*command, "--exit-with-stdin"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        yield json.loads(process.stdout.readline())["ready"]["buses"]
    finally:
        process.stdin.close()
        process.wait(120)
        process.stdout.close()


@pytest.fixture
def listeners() -> Iterator[list[socket.socket]]:
    """Yield listeners on both interfaces that receive each TPDO1 (180h to 1FFh) and SYNC."""
    sockets = []
    for name in ("vcan0", "vcan1"):
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        wanted = struct.pack("=IIII", 0x180, 0x780, 0x080, 0x7FF)
        sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, wanted)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        sock.bind((name,))
        sock.setblocking(False)
        sockets.append(sock)
    yield sockets
    for sock in sockets:
        sock.close()


def heard(sock: socket.socket) -> dict[int, int]:
    """Return the number of waiting frames per identifier."""
    counts: dict[int, int] = {}
    try:
        while True:
            identifier = FRAME.unpack(sock.recv(16))[0]
            counts[identifier] = counts.get(identifier, 0) + 1
    except BlockingIOError:
        return counts


def test_eight_drives_on_two_interfaces_are_exchanged_in_each_cycle(
    robot: Path, drives: dict[str, object], listeners: list[socket.socket]
) -> None:
    assert list(drives) == ["can0", "can1"]
    with open_robot(load_robot(str(robot)), BUSES, Output(as_json=True)) as session:
        device = session.device
        assert device.lockstep
        session.enable()
        start = device.feedback.position_rad.copy()
        speed = np.linspace(-3.0, 3.0, 8)
        controller = Proportional(np.full(8, 3.0), np.full(8, 1.5))
        session.follow(controller, TrapezoidalMove(start, speed, 0.2, 0.05))
        np.testing.assert_allclose(device.feedback.position_rad - start, 0.25 * speed, atol=0.15)
        assert np.all(device.feedback.valid)
        assert device.missed == 0
        session.disable()
        cycles = device.feedback.cycle
        assert cycles > 300
        for sock, nodes in zip(listeners, (range(1, 5), range(5, 9)), strict=True):
            # each interface carries its four drives, all SYNCs and all answers
            assert heard(sock) == {0x080: cycles} | {0x180 + node: cycles for node in nodes}
