"""Our programs work with those of third parties.

Our master with slaves built on `canopen.LocalNode`, our drives with the master of the `canopen`
package, and python-can's command-line tools as listeners and players on a simulated bus.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import can
import canopen
import pytest
from tolerant_drive import NAME as TOLERANT
from tolerant_drive import write_tolerant_drive
from waiting import until

from cdpr_profiles import load_winch
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.clock import ClockMode

WINCH = "winch-mpp0923d"
PROFILE = load_winch(WINCH)
EDS = str(PROFILE.drive.eds)
LONGEST_S = 60.0


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengthen the package's timeout of 0.3 s, because drives may have to wait for a core."""
    monkeypatch.setattr(canopen.sdo.SdoClient, "RESPONSE_TIMEOUT", LONGEST_S)


def cdpr(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@contextmanager
def third_party_on(name: str) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="simbus", channel=name)
    try:
        yield network
    finally:
        network.sync.stop()
        network.disconnect()


# -- third-party slaves with our master


@pytest.fixture
def empty_bus() -> Iterator[str]:
    """Yield a bus without our nodes. It is paced because third-party slaves use wall-clock time."""
    name = f"empty-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    hub = Hub([], mode=ClockMode.PACED, name=name)
    hub.listen()
    thread = threading.Thread(target=hub.run)
    thread.start()
    try:
        yield name
    finally:
        hub.stop()
        thread.join()
        hub.close()


def write_patient_winch(folder: Path, period_s: float) -> Path:
    """Write the shipped winch with two heartbeats per second of its drive. Return the file."""
    write_tolerant_drive(folder, 0.5, 1.0)
    path, text = folder / "patient.toml", PROFILE.path.read_text()
    for before, after in (
        ("sync_period_s = 0.001", f"sync_period_s = {period_s}"),
        ('"generic-cia402"', f'"{TOLERANT}"'),
    ):
        assert before in text
        text = text.replace(before, after)
    path.write_text(text)
    return path


def test_a_slave_without_process_data_boots_as_far_as_possible(
    empty_bus: str, tmp_path: Path
) -> None:
    """`LocalNode` answers SDO, but sends boot-up messages as heartbeats after a reset."""
    bus, winch = f"simbus:{empty_bus}", str(write_patient_winch(tmp_path, period_s=0.001))
    with third_party_on(empty_bus) as network:
        node = network.create_node(1, EDS)
        node.nmt.state = "PRE-OPERATIONAL"
        told = cdpr("drive", "info", WINCH, "--bus", bus, "--json")
        assert told.returncode == 0, told.stderr
        assert json.loads(told.stdout.splitlines()[-1])["profile_fits"] is True
        ended = cdpr("drive", "enable", winch, "--bus", bus)
        assert ended.returncode == 1
        assert "node 1 did not boot (step K): it sends no heartbeat" in ended.stderr
        assert node.sdo[0x1A00][2].raw == 0x60640020  # its configuration was written

        def obey(can_id: int, data: bytearray, time_s: float) -> None:
            if data[0] not in (129, 130):
                node.nmt.on_command(can_id, data, time_s)
                return
            # between two threads one of its heartbeats would be a second boot-up message
            node.nmt.stop_heartbeat()
            node.nmt.send_command(130)
            node.nmt.state = "PRE-OPERATIONAL"

        network.unsubscribe(0, node.nmt.on_command)
        network.subscribe(0, obey)
        # otherwise a heartbeat before the next reset would look like a second boot-up message
        node.nmt.state = "PRE-OPERATIONAL"
        ended = cdpr("drive", "enable", winch, "--bus", bus)
        assert ended.returncode == 1
        assert "node 1) has not answered SYNC" in ended.stderr
        assert "its TPDOs were changed" in ended.stderr
        assert len(ended.stderr.strip().splitlines()) == 1


class ThirdPartyServo:
    """A drive built on the SDO server, NMT, heartbeat and PDO maps of `canopen.LocalNode`."""

    STATES = ((0x80, 0x80, 0x40), (0x02, 0x00, 0x40), (0x0F, 0x0F, 0x27), (0x0F, 0x07, 0x23))

    def __init__(self, network: canopen.Network, node_id: int) -> None:
        self.network = network
        self.node = network.create_node(node_id, EDS)
        self.states: list[int] = []
        network.unsubscribe(0x000, self.node.nmt.on_command)
        network.subscribe(0x000, self._on_nmt)
        network.subscribe(0x080, self._on_sync)
        network.subscribe(0x200 + node_id, self._on_rpdo)
        self.node.sdo[0x6041].raw = 0x40
        self.node.nmt.state = "PRE-OPERATIONAL"

    def _on_nmt(self, can_id: int, data: bytearray, time_s: float) -> None:
        if data[0] in (129, 130):
            # between two threads one of its heartbeats would be a second boot-up message
            self.node.nmt.stop_heartbeat()
            self.node.nmt.send_command(130)
            self.node.nmt.state = "PRE-OPERATIONAL"
            return
        self.node.nmt.on_command(can_id, data, time_s)
        if data[0] == 1:
            self.node.tpdo.read()
            self.node.rpdo.read()

    def _on_rpdo(self, _id: int, data: bytearray, _time: float) -> None:
        if len(data) != 4 or self.node.nmt.state != "OPERATIONAL":
            return
        word, target = struct.unpack("<Hh", data)
        assert target == 0 or self.states[-1:] == [0x27]
        state = 0x21
        for mask, value, reached in self.STATES:
            if word & mask == value:
                state = reached
                break
        if self.states[-1:] != [state]:
            self.states.append(state)
        self.node.sdo[0x6041].raw = state
        self.node.sdo[0x6061].raw = self.node.sdo[0x6060].raw

    def _on_sync(self, _id: int, _data: bytearray, _time: float) -> None:
        if self.node.nmt.state != "OPERATIONAL":
            return
        for number in (1, 2):
            pdo = self.node.tpdo[number]
            for variable in pdo:
                variable.raw = self.node.sdo[variable.index].raw
            pdo.transmit()


def test_a_third_party_servo_is_enabled_and_disabled(empty_bus: str, tmp_path: Path) -> None:
    # slow enough for a servo that has to wait for a core
    winch = write_patient_winch(tmp_path, period_s=0.2)
    with third_party_on(empty_bus) as network:
        servo = ThirdPartyServo(network, 1)
        words = ("drive", "enable", str(winch), "--bus", f"simbus:{empty_bus}", "--seconds", "0.3")
        ended = cdpr(*words)
        assert ended.returncode == 0, ended.stderr
        assert "operation enabled, no torque" in ended.stdout
        states = servo.states
        assert states[states.index(0x21) :][:3] == [0x21, 0x23, 0x27]
        assert states[-1] == 0x40
        until(lambda: servo.node.nmt.state == "PRE-OPERATIONAL")


# -- our drives with a third-party master


@contextmanager
def simulator(*options: str) -> Iterator[str]:
    name = f"third-party-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    words = ["sim", "up", WINCH, "--bus", f"simbus:{name}", "--exit-with-stdin", *options]
    process = subprocess.Popen(
        [sys.executable, "-m", "cdpr_tools.cli", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert process.stdout is not None
        assert b"ready" in process.stdout.readline()
        yield name
    finally:
        process.communicate(timeout=120)


@pytest.fixture(scope="module")
def drives() -> Iterator[str]:
    """Yield two drives with node ids 1 and 2."""
    with simulator("--nodes", "2", "--paced") as name:
        yield name


# -- python-can's tools


@contextmanager
def tool(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command of python-can and end it by Ctrl-C, as its user does."""
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    try:
        yield process
    finally:
        process.send_signal(2)
        process.communicate(timeout=120)


def test_python_cans_logger_records_and_its_player_repeats_a_session(
    drives: str, tmp_path: Path
) -> None:
    """Playing the log of a third-party master has the same effect on the drive."""
    log = tmp_path / "session.log"
    words = ("can.logger", "-i", "simbus", "-c", drives, "-f", str(log))
    with tool(*words) as logger, third_party_on(drives) as network:
        node = network.add_node(2, EDS)
        assert logger.stdout is not None
        assert b"Connected to" in logger.stdout.readline()
        node.nmt.state = "PRE-OPERATIONAL"
        until(lambda: _ask(node) == 0 and log.exists() and log.stat().st_size > 0)
        node.sdo[0x6072].raw = 321
        node.nmt.state = "OPERATIONAL"
        network.sync.transmit()
        # it is complete when much more has been written
        size = log.stat().st_size
        until(lambda: _ask(node) == 0 and log.stat().st_size > size + 16384)
    messages = list(can.LogReader(str(log)))
    identifiers = [message.arbitration_id for message in messages]
    assert {0x000, 0x080, 0x602, 0x582, 0x282} <= set(identifiers)
    assert all(b.timestamp >= a.timestamp for a, b in pairwise(messages))
    with third_party_on(drives) as network:
        node = network.add_node(2, EDS)
        node.nmt.state = "PRE-OPERATIONAL"
        node.sdo[0x6072].raw = 111
        answers: list[bytearray] = []
        network.subscribe(0x582, lambda _id, data, _time: answers.append(data))
        player = ("can.player", "-i", "simbus", "-c", drives, "--ignore-timestamps", str(log))
        played = subprocess.run(
            [sys.executable, "-m", *player], capture_output=True, timeout=120, check=False
        )
        assert played.returncode == 0, played.stderr
        # the played answers and those of the drive, none taken for that to another request
        count = identifiers.count(0x582) + identifiers.count(0x602)
        until(lambda: len(answers) == count)
        assert node.sdo[0x6072].raw == 321


def _ask(node: canopen.RemoteNode) -> int:
    return int(node.sdo[0x1001].raw)
