"""Drives stop after the loop was killed, stopped or terminated in motion, as seen on the bus."""

from __future__ import annotations

import os
import signal
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from daemon_rig import RealDaemon
from waiting import until

from cdpr_drivers.bus import BusUrl, open_port
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import POWER_OFF, State, state_of
from cdpr_profiles import load_drive
from cdpr_profiles.eds import load_dictionary
from cdpr_rt.core.clock import PacedClock

pytestmark = pytest.mark.alone

PERIOD_S, HEARTBEAT_S = 0.002, 0.1
PATIENT = "missed_cycles = 50\nmissed_in_window = 500\nlate_s = 0.5"
NODES = (1, 2)
SPEED_rad_s = 2.0
# during other tests, this process and the simulator may be late
SLACK_S = 0.15


class Ear:
    """Record all frames on the daemon's bus with their times."""

    def __init__(self, daemon: RealDaemon) -> None:
        self.bus = BusUrl.parse(f"{daemon.bus}-can0")
        self.frames: list[tuple[float, int, bytes]] = []
        self._port = open_port(self.bus)
        self._port.settimeout(0.1)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._hear, daemon=True)
        self._thread.start()

    def _hear(self) -> None:
        buffer = bytearray(16)
        while not self._ended.is_set():
            try:
                if not self._port.recv_into(buffer):
                    return
            except BlockingIOError:
                continue
            identifier, length, data = FRAME.unpack(buffer)
            self.frames.append((time.monotonic(), identifier, data[:length]))

    def of(self, identifier: int, since_s: float = 0.0) -> list[tuple[float, bytes]]:
        frames = list(self.frames)
        return [(at, data) for at, i, data in frames if i == identifier and at >= since_s]

    def torques(self, node: int, since_s: float) -> list[int]:
        """Return the target torques sent to a drive, in its units."""
        return [struct.unpack_from("<h", data, 2)[0] for _, data in self.of(0x200 + node, since_s)]

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._port.close()


def slow_daemon(folder: Path) -> RealDaemon:
    """Return a daemon whose drives do not wait for it."""
    return RealDaemon(folder, "--no-record", period_s=PERIOD_S, limits=PATIENT, paced=True)


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    made = slow_daemon(tmp_path_factory.mktemp("run"))
    yield made
    made.end()


@contextmanager
def in_motion(daemon: RealDaemon) -> Iterator[Ear]:
    """Move both axes at speed for a second at least."""
    held = daemon.http.post("/control", json={"client": "test", "ttl_s": 10.0})
    assert held.status_code == 200, held.text
    token = {"X-Control-Token": held.json()["token"]}
    speeds = [SPEED_rad_s, -SPEED_rad_s]
    for path, body in (
        ("/enable", {"client": "test"}),
        ("/program", {"client": "test", "program": "jog", "wanted": jog(speeds)}),
    ):
        answer = daemon.http.post(path, json=body, headers=token)
        assert answer.status_code == 200, answer.text
    ear = Ear(daemon)
    try:
        try:
            until(lambda: all(abs(speed_of(ear, n)) > 0.5 * SPEED_rad_s for n in NODES))
        except AssertionError:
            raise AssertionError(f"no motion: {daemon.status()}") from None
        yield ear
    finally:
        ear.close()
        with suppress(httpx.HTTPError):
            daemon.http.delete("/control", headers=token)


def jog(speeds: list[float]) -> dict[str, Any]:
    return {"velocity_rad_s": speeds, "timeout_s": 2.0}


def speed_of(ear: Ear, node: int) -> float:
    """Return a motor's speed from its last positions on the bus, in rad/s."""
    heard = ear.of(0x180 + node)[-50:]
    if len(heard) < 50:
        return 0.0
    counts = [struct.unpack_from("<i", data, 2)[0] for _, data in heard]
    return (counts[-1] - counts[0]) / 8192 * 6.2832 / (heard[-1][0] - heard[0][0])


@contextmanager
def third_party(bus: BusUrl) -> Iterator[CanNetwork]:
    """Join the bus as a second client."""
    eds = load_drive("generic-cia402").eds
    network = CanNetwork(bus, PacedClock(), NODES, 126, 1.0)
    try:
        for node in NODES:
            network.add_node(node, load_dictionary(eds, node))
        yield network
    finally:
        network.close()


def ask_drives(bus: BusUrl) -> list[State]:
    """Read the state of each drive by SDO, as a third party."""
    with third_party(bus) as network:
        return [state_of(network.read_int(node, 0x6041)) for node in NODES]


def lost_master_s(ear: Ear, since_s: float) -> dict[int, float]:
    """Return the time until each drive reported that its master is lost (EMCY 8130h)."""
    found = {}
    for node in NODES:
        for at, data in ear.of(0x080 + node, since_s):
            if struct.unpack_from("<H", data)[0] == 0x8130:
                found.setdefault(node, at - since_s)
    return found


def expect_stop(ear: Ear, at_s: float) -> None:
    """Check that the drives detect the loss of their master within two heartbeats and cut power."""
    until(lambda: len(lost_master_s(ear, at_s)) == len(NODES))
    assert max(lost_master_s(ear, at_s).values()) < 2 * HEARTBEAT_S + SLACK_S
    until(lambda: all(state in POWER_OFF for state in ask_drives(ear.bus)))
    # without further commands
    assert not ear.of(0x200 + NODES[0], at_s + SLACK_S)


def test_drives_stop_within_two_heartbeats_of_a_hanging_loop(daemon: RealDaemon) -> None:
    loop = daemon.children()["loop"]
    with in_motion(daemon) as ear:
        at_s = time.monotonic()
        os.kill(loop, signal.SIGSTOP)
        expect_stop(ear, at_s)
        resumed_s = time.monotonic()
        os.kill(loop, signal.SIGCONT)
        told = daemon.wait_for("fault")
        assert "8130h" in told["reason"]
        assert not any(any(ear.torques(node, resumed_s)) for node in NODES)
        answer = daemon.http.post("/acknowledge", json={"client": "test"})
        assert answer.status_code == 200, answer.text
        daemon.wait_for("ready")
        assert all(state in POWER_OFF for state in ask_drives(ear.bus))


def test_a_terminated_daemon_brakes_and_then_cuts_power(daemon: RealDaemon) -> None:
    with in_motion(daemon) as ear:
        at_s = time.monotonic()
        daemon.process.send_signal(signal.SIGTERM)
        assert daemon.process.wait(120) == 0, daemon.errors()
        words = [struct.unpack_from("<H", data)[0] for _, data in ear.of(0x201, at_s)]
        assert words[-1] & 0x0F == 0  # disable voltage
        states = [state_of(struct.unpack_from("<H", d)[0]) for _, d in ear.of(0x181, at_s)]
        assert states[0] == State.OPERATION_ENABLED
        assert states[-1] in POWER_OFF
        # braked by the controller: torque was sent until standstill
        enabled = [d for _, d in ear.of(0x181, at_s) if state_of(d[0] | d[1] << 8) == 4]
        counts = [struct.unpack_from("<i", data, 2)[0] for data in enabled[-4:]]
        assert abs(counts[-1] - counts[0]) / 8192 * 6.2832 / (3 * PERIOD_S) < 0.5 * SPEED_rad_s


def test_drives_stop_within_two_heartbeats_of_a_killed_loop(tmp_path: Path) -> None:
    daemon = slow_daemon(tmp_path)
    try:
        with in_motion(daemon) as ear:
            at_s = time.monotonic()
            os.kill(daemon.children()["loop"], signal.SIGKILL)
            expect_stop(ear, at_s)
            assert "killed by signal 9" in daemon.wait_for("dead")["reason"]
    finally:
        daemon.end()
