"""A failing command prints one message, exits with a status, cuts power and keeps raw data."""

from __future__ import annotations

import json
import os
import queue
import re
import resource
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import canopen
import numpy as np
import pytest
from waiting import until

from cdpr_profiles import load_winch
from cdpr_rt.identification.rawlog import read_raw_log

WINCH = "winch-mpp0923d"
PROFILES = Path(sys.modules[load_winch.__module__].__file__ or "").parent
EDS = load_winch(WINCH).drive.eds
Command = subprocess.Popen[str]

FAILED, BAD_INPUT = 1, 2
OFF, ENABLED, FAULT = 0x40, 0x27, 0x08


class Lab:
    """A simulated drive on a separate bus, and a third-party master that reads and disturbs."""

    def __init__(self, *options: str | Path) -> None:
        self.bus = f"simbus:lab-{os.getpid()}-{uuid.uuid4().hex[:6]}"
        self.process = subprocess.Popen(
            [*_cdpr("sim", "up", WINCH, "--bus", self.bus, "--exit-with-stdin", *options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self.process.stdout is not None
        assert b"ready" in self.process.stdout.readline()
        self._network = canopen.Network()
        self._network.NOTIFIER_CYCLE = 0.05
        self._network.connect(interface="simbus", channel=self.bus.partition(":")[2])
        # cycles are faster than real time: its queue would be seconds behind
        asked = [{"can_id": i + 1, "can_mask": 0x7FF} for i in (0x080, 0x580, 0x700)]
        self._network.bus.set_filters(asked)
        self.node = self._network.add_node(1, str(EDS))
        self.node.sdo.RESPONSE_TIMEOUT = 60.0

    def reset(self) -> None:
        """Restart the drive."""
        self.node.nmt.send_command(129)
        self.node.emcy.reset()
        # bus time stands for half a second after the last SYNC
        until(lambda: self.state() == OFF)

    def state(self) -> int:
        word = self.read(0x6041)
        return int(word & (0x6F if word & 0x20 else 0x4F))

    def read(self, index: int) -> int:
        """Read an object. Answers to a command that has ended may arrive first."""
        client, asked = self.node.sdo, index.to_bytes(2, "little") + b"\0"
        client.responses = queue.Queue()
        client.send_request(b"\x40" + asked + bytes(4))
        while (answer := client.responses.get(timeout=60.0))[1:4] != asked:
            continue
        assert answer[0] & 0xE3 == 0x43, answer.hex(" ")  # not an abort
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little", signed=True)

    def inject_fault(self, sub: int, value: int) -> None:
        self.node.sdo[0x2F00][sub].raw = value

    def leave(self) -> None:
        """Disconnect the third party, whose receiving thread would print the end of the bus."""
        self._network.disconnect()

    def close(self) -> None:
        with suppress(Exception):
            self.leave()
        self.process.communicate(b"", timeout=120)


@pytest.fixture(scope="module")
def shared_lab() -> Iterator[Lab]:
    lab = Lab()
    yield lab
    lab.close()


@pytest.fixture
def lab(shared_lab: Lab) -> Lab:
    shared_lab.reset()
    return shared_lab


def _cdpr(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]


def begin(*arguments: str | Path) -> Command:
    return subprocess.Popen(
        _cdpr(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def complaint(command: Command, status: int, timeout_s: float = 60.0) -> str:
    """Wait for a command that must fail. Return its message, which text and JSON share."""
    out, errors = command.communicate(timeout=timeout_s)
    assert "Traceback" not in errors + out, errors
    assert command.returncode == status, errors
    lines = [line for line in errors.splitlines() if line.startswith("cdpr: ")]
    assert len(lines) == 1, errors
    told = lines[0].removeprefix("cdpr: ")
    if "--json" in command.args:  # type: ignore[operator]
        last = json.loads(out.splitlines()[-1])
        assert last == {"ok": False, "error": told, "exit_status": status}
    return told


def fails(*arguments: str | Path, status: int = FAILED) -> str:
    return complaint(begin(*arguments, "--json"), status)


def rows_of(out: Path) -> int:
    """Check the kept cycles of the first pass and return their number."""
    log = read_raw_log(out / "raw" / "sweep-0.raw")
    cycles = log.column("cycle")
    assert np.all(np.diff(cycles) == 1)
    assert np.all(np.isfinite(log.rows))
    return len(cycles)


@contextmanager
def sweeping(lab: Lab, out: Path, *more: str) -> Iterator[Command]:
    """Yield a sweep command that has recorded for some seconds with an energised drive."""
    command = begin("cogging", "sweep", WINCH, "--bus", lab.bus, "--out", out, *more)
    try:
        file = out / "raw" / "sweep-0.raw"
        deadline = time.monotonic() + 60.0
        while not (file.exists() and file.stat().st_size > 300_000):
            assert time.monotonic() < deadline
            assert command.poll() is None, command.communicate()[1]
            time.sleep(0.01)
        yield command
    finally:
        if command.poll() is None:
            command.kill()
        command.communicate()


# -- a missing, wrong or faulty drive, before anything moves


def own_profiles(folder: Path, winch: dict[str, str], drive: dict[str, str]) -> Path:
    """Write winch and drive profiles with some lines changed."""
    for kind, name, changes in (
        ("winches", WINCH, {"drive": '"my-drive"', **winch}),
        ("drives", "generic-cia402", {"eds": f'"{EDS}"', **drive}),
    ):
        text = (PROFILES / kind / f"{name}.toml").read_text()
        for key, value in changes.items():
            text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
            assert count == 1
        stem = "my-winch" if kind == "winches" else "my-drive"
        (folder / f"{stem}.toml").write_text(text)
    return folder / "my-winch.toml"


def test_a_missing_node_is_reported(lab: Lab, tmp_path: Path) -> None:
    winch = own_profiles(tmp_path, {"node_id": "9"}, {})
    told = fails("drive", "enable", winch, "--bus", lab.bus)
    assert "node 9" in told
    assert "step B" in told
    assert "power, wiring" in told


def test_a_drive_with_a_wrong_identity_is_reported(lab: Lab, tmp_path: Path) -> None:
    winch = own_profiles(tmp_path, {}, {"product_code": "0x00000403"})
    told = fails("drive", "home", winch, "--bus", lab.bus)
    assert "step M" in told
    assert "00000402h" in told and "00000403h" in told
    assert lab.state() == OFF


def test_a_node_in_fault_is_reported_as_text(lab: Lab) -> None:
    lab.inject_fault(1, 0x3210)
    told = fails("drive", "enable", WINCH, "--bus", lab.bus)
    assert "node 1" in told
    assert "3210h (DC link over-voltage)" in told
    assert lab.state() == FAULT


def test_a_drive_that_rejects_the_mode_is_reported(lab: Lab) -> None:
    lab.inject_fault(3, 1)
    told = fails("drive", "enable", WINCH, "--bus", lab.bus)
    assert "the drive rejected mode 10 (cyclic torque)" in told
    assert lab.state() == OFF


@pytest.mark.parametrize(("sub", "value", "shown"), [(3, 2, "0 (no mode)"), (4, 8, "8 (cyclic")])
def test_a_drive_in_a_wrong_mode_is_not_enabled(lab: Lab, sub: int, value: int, shown: str) -> None:
    lab.inject_fault(sub, value)
    told = fails("drive", "enable", WINCH, "--bus", lab.bus)
    assert "mode 10 (cyclic torque) was requested" in told
    assert f"reports {shown}" in told
    assert lab.state() == OFF


def test_a_drive_without_heartbeat_is_reported(lab: Lab) -> None:
    lab.inject_fault(5, 1)
    told = fails("drive", "enable", WINCH, "--bus", lab.bus)
    assert "step K" in told
    assert lab.state() == OFF


def test_a_missing_index_is_reported(tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text("[encoder]\nindex_present = false\n")
    lab = Lab("--plant", plant)
    try:
        told = fails("commission", WINCH, "--bus", lab.bus, "--out", tmp_path / "out")
        assert "homing" in told
        assert "index" in told
        assert lab.state() == OFF
    finally:
        lab.close()


# -- during a sweep


def test_an_emergency_during_a_sweep_is_reported(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path, "--json") as command:
        assert lab.state() == ENABLED
        lab.inject_fault(1, 0x7305)
        told = complaint(command, FAILED)
    assert "7305h (incremental encoder 1)" in told
    assert str(tmp_path / "raw") in told
    assert lab.state() == FAULT
    assert rows_of(tmp_path) > 2000


def test_a_restart_of_the_drive_during_a_sweep_is_reported(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path) as command:
        lab.node.nmt.send_command(129)
        told = complaint(command, FAILED)
    assert "restarted" in told
    assert lab.state() == OFF
    assert rows_of(tmp_path) > 2000


def test_a_simulator_killed_during_a_sweep_is_reported(tmp_path: Path) -> None:
    lab = Lab()
    lab.leave()
    with sweeping(lab, tmp_path) as command:
        lab.process.kill()
        told = complaint(command, FAILED)
    lab.close()
    assert f"{lab.bus}: the bus is lost" in told
    assert rows_of(tmp_path) > 2000


def test_a_stop_during_a_sweep_brakes_and_keeps_the_data(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path) as command:
        command.send_signal(signal.SIGTERM)
        told = complaint(command, FAILED)
    assert "stopped on request" in told
    assert lab.state() == OFF
    # braked: the motor stands where it was when the recording ended
    log = read_raw_log(tmp_path / "raw" / "sweep-0.raw")
    stands_rad = lab.read(0x6064) * 2 * np.pi / 8192
    assert abs(np.degrees(stands_rad - log.column("position_rad")[-1])) < 1.0
    assert rows_of(tmp_path) > 2000


def test_a_second_master_on_the_bus_is_rejected(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path) as command:
        told = fails("drive", "enable", WINCH, "--bus", lab.bus, status=BAD_INPUT)
        assert f"process {command.pid} " in told
        assert "runs the drives on this bus" in told
        assert command.poll() is None
        assert lab.state() == ENABLED
        command.send_signal(signal.SIGINT)
        complaint(command, FAILED)


def test_a_full_disk_during_a_sweep_is_reported(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path) as command:
        resource.prlimit(command.pid, resource.RLIMIT_FSIZE, (500_000, 500_000))
        told = complaint(command, FAILED)
    assert "sweep-0.raw: cannot record" in told
    assert lab.state() == OFF
    assert rows_of(tmp_path) > 2000


def test_a_killed_master_leaves_the_drive_without_power(lab: Lab, tmp_path: Path) -> None:
    with sweeping(lab, tmp_path) as command:
        assert lab.state() == ENABLED
        command.kill()
        command.wait()
        # half a second until bus time runs again, half a second until the heartbeat is missed, then
        # the quick stop. On a busy machine, wall-clock time is ahead of bus time.
        until(lambda: lab.state() == OFF)
    assert rows_of(tmp_path) > 1000


def test_a_command_leaves_the_drive_ready_for_the_next_one(lab: Lab) -> None:
    for _ in range(2):
        command = begin("drive", "enable", WINCH, "--bus", lab.bus, "--seconds", "0.2")
        _, errors = command.communicate(timeout=120)
        assert command.returncode == 0, errors
    time.sleep(1.5)  # longer than the drive's heartbeat timeout
    assert lab.read(0x1001) == 0
    assert lab.node.emcy.active == []
