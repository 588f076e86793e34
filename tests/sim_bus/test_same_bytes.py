"""The same packets of a leading master give the same bytes, independent of the wall clock."""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from fork_server import FORKED
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.frame import pack_frame

LAW = settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])
GO = struct.Struct("<8sdd")
SYNC = 0x080
_names = count()

SIMULATOR = """
import sys
from pathlib import Path
import numpy as np
from cdpr_profiles import load_winch
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.cia402.drive import SimDrive, transmission_of
from cdpr_sim_bus.bus.server import FleetBus, serve_fleet
from cdpr_sim_bus.robot.truth_log import PoseLog
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from dataclasses import replace

name, log = sys.argv[1], Path(sys.argv[2])
winch = load_winch("winch-mpp0923d")
plant = RobotPlant()
exits = [[0.0, 3.0], [4.0, 3.0], [2.0, 0.0]]
anchors = [[-0.05, 0.05], [0.05, 0.05], [0.0, -0.05]]
body = CableRobot(
    RobotShape(exits, anchors, 4.0, (2.0, 1.3), [0.1] * 3), plant, [transmission_of(winch)] * 3
)
drives = [
    SimDrive.for_winch(replace(winch, node_id=i + 1), own, robot=member)
    for i, (own, member) in enumerate(zip(plant.motor_plants(3, [winch] * 3), body.members()))
]
drives[0].record_with(PoseLog(log, body))
buses = [(f"{name}-a", drives[:2]), (f"{name}-b", drives[2:])]
serve_fleet(
    "robot",
    [FleetBus(bus, f"simbus:{bus}", 1_000_000, nodes) for bus, nodes in buses],
    until_stdin_ends=True,
)
"""


class Bus:
    """The socket of a master and all bytes received on it."""

    def __init__(self, name: str) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.sock.settimeout(60.0)
        self.sock.connect(f"\0cdpr-rt/simbus/{name}")
        self.heard = [b""]
        self.now_s = 0.0
        self.sock.send(b'{"lead":true}')
        while self.hear()[:1] != b"{":
            pass

    def hear(self) -> bytes:
        self.heard.append(self.sock.recv(4096))
        return self.heard[-1]

    def send(self, can_id: int, data: bytes = b"") -> None:
        self.sock.send(pack_frame(can_id, data))

    def until_time(self) -> None:
        while (packet := self.hear())[:8] != b"bus-time":
            assert packet, "the simulator has disconnected"
        _, self.now_s, _ = GO.unpack_from(packet)

    def go(self, until_s: float) -> None:
        self.sock.send(GO.pack(b"bus-go\0\0", until_s, 0.0))
        self.until_time()


@contextmanager
def simulator(log: Path) -> Iterator[tuple[subprocess.Popen[bytes], list[Bus]]]:
    name = f"same-{os.getpid()}-{next(_names)}"
    process = subprocess.Popen(
        [*FORKED, SIMULATOR, name, str(log)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdin and process.stdout
    buses: list[Bus] = []
    try:
        assert process.stdout.readline()
        buses += [Bus(f"{name}-{letter}") for letter in "ab"]
        yield process, buses
    finally:
        # end the simulator first, so that time does not follow the wall clock
        process.stdin.close()
        process.wait(120)
        process.stdout.close()
        for bus in buses:
            bus.sock.close()


def download(index: int, sub: int, value: int, size: int) -> bytes:
    head = bytes([0x2F - 4 * (size - 1), index & 0xFF, index >> 8, sub])
    return head + value.to_bytes(size, "little").ljust(4, b"\0")


def prepare(buses: list[Bus]) -> None:
    """Configure three drives to exchange position, statusword and torque at each SYNC (2 ms)."""
    nodes = [(buses[0], 1), (buses[0], 2), (buses[1], 3)]
    for bus, node in nodes:
        for request in (
            download(0x1006, 0, 2000, 4),
            download(0x1016, 1, 127 << 16 | 100, 4),
            download(0x1800, 2, 1, 1),
            download(0x6060, 0, 10, 1),
        ):
            bus.send(0x600 + node, request)
            bus.go(bus.now_s + 0.01)
        bus.send(0x000, bytes([1, node]))
        bus.go(bus.now_s)
    until_s = max(bus.now_s for bus in buses)
    for bus in buses:
        while bus.now_s < until_s:
            bus.go(until_s)


def take(buses: list[Bus], k: int, what: str, value: int) -> None:
    """Take one step like a master that keeps its buses at the same time."""
    for bus, nodes in zip(buses, ((1, 2), (3,)), strict=True):
        if what == "sync":
            for node in nodes:
                word = (6, 7, 15)[min(k // 3, 2)]
                bus.send(0x200 + node, struct.pack("<Hh", word, value))
            bus.send(0x700 + 127, b"\x05")
        elif what == "read":
            bus.send(0x600 + nodes[0], bytes([0x40, 0x64, 0x60, 0, 0, 0, 0, 0]))
    if what == "sync":
        for bus in buses:
            bus.send(SYNC)
        for bus in buses:
            bus.until_time()
        return
    until_s = buses[0].now_s + value * 1e-4 * (what == "go")
    for bus in buses:
        bus.go(0.0)
    for bus in buses:
        while bus.now_s < until_s:
            bus.go(until_s)


def play(log: Path, steps: list[tuple[str, int]], delays: list[float], stops: set[int]) -> bytes:
    """Take `steps` after pauses, with the simulator stopped at some. Return all bytes."""
    with simulator(log) as (process, buses):
        prepare(buses)
        for k, (what, value) in enumerate(steps):
            time.sleep(delays[k % len(delays)])
            if k not in stops:
                take(buses, k, what, value)
                continue
            os.kill(process.pid, signal.SIGSTOP)
            with subprocess.Popen(["sh", "-c", f"sleep 0.15; kill -CONT {process.pid}"]):
                take(buses, k, what, value)
        heard = b"|".join(packet for bus in buses for packet in bus.heard)
    return heard + log.read_bytes()


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("sync"), st.integers(-200, 200)),
        st.tuples(st.just("go"), st.integers(0, 900)),
        st.tuples(st.just("read"), st.just(0)),
    ),
    min_size=5,
    max_size=60,
)


@given(STEPS, st.lists(st.floats(0.0, 0.004), min_size=1, max_size=7), st.sets(st.integers(0, 60)))
@LAW
def test_same_packets_give_same_bytes_despite_delays(
    tmp_path: Path, steps: list[tuple[str, int]], delays: list[float], stops: set[int]
) -> None:
    """The drives of a robot share their physics. Two are on one bus, the third on another."""
    some = set(sorted(stops)[:2])
    quick = play(tmp_path / "quick.bin", steps, [0.0], set())
    assert play(tmp_path / "slow.bin", steps, delays, some) == quick
    assert len((tmp_path / "quick.bin").read_bytes()) > 1024


def test_motion_after_the_masters_death_is_logged(tmp_path: Path) -> None:
    log = tmp_path / "pose.bin"
    with simulator(log) as (_, buses):
        prepare(buses)
        died_s = buses[0].now_s
        for bus in buses:
            bus.sock.close()
        size = json.loads(log.read_bytes()[:1024])["record_bytes"]
        deadline = time.monotonic() + 60.0
        last_s = 0.0
        while last_s < died_s + 0.5:
            assert time.monotonic() < deadline
            time.sleep(0.01)
            number, last_s = struct.unpack("<Id", log.read_bytes()[-size:][:12])
        assert number == 0xFFFFFFFF
