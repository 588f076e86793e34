"""A daemon's recording from start to end, through a full disk and the death of its writer."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from mcap.reader import make_reader

PATIENCE_S = 60.0
TOLERANT = """
master_heartbeat_s = 0.5

[limits]
late_s = 5.0
missed_cycles = 500
missed_in_window = 1000
stale_cycles = 2000
"""
"""What a robot needs to run to the end on a machine that is busy with other tests."""


def cdpr(*arguments: str) -> dict[str, Any]:
    """Run a command with --json that has to succeed; return what it tells."""
    command = [sys.executable, "-m", "tools.cli", *arguments, "--json"]
    result = subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert result.returncode == 0, result.stderr
    told: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return told


def messages(path: Path, topic: str) -> list[tuple[int, dict[str, Any]]]:
    """Read a file with the `mcap` package alone."""
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(topics=[topic])
        return [(message.log_time, json.loads(message.data)) for _, _, message in found]


def service_of(launcher: int) -> int:
    """Return the service's process, by what the launcher's children run."""
    for child in Path(f"/proc/{launcher}/task/{launcher}/children").read_text().split():
        if b"service_process" in Path(f"/proc/{child}/cmdline").read_bytes():
            return int(child)
    raise AssertionError("no service process")


class Daemon:
    """A daemon of its own on a simulated bus, recording into a folder."""

    def __init__(self, folder: Path) -> None:
        self.recordings = folder / "recordings"
        self.socket = ("--socket", str(folder / "control.sock"))
        transport = httpx.HTTPTransport(uds=self.socket[1])
        self.client = httpx.Client(transport=transport, base_url="http://localhost", timeout=10.0)
        robot = folder / "bench-2.toml"
        shipped = resources.files("profiles") / "robots" / "bench-2.toml"
        robot.write_text(shipped.read_text().replace("[limits]", TOLERANT))
        files = ("--record", str(self.recordings), *self.socket)
        command = [sys.executable, "-m", "tools.cli", "run", str(robot), "--bus", "simbus:", *files]
        self.process = subprocess.Popen(
            [*command, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.wait_for("ready")

    def wait_for(self, state: str) -> None:
        """Wait until the daemon is there and in a state."""
        end = time.monotonic() + PATIENCE_S
        told: object = None
        while told != state:
            assert self.process.poll() is None, self.process.communicate()[1]
            assert time.monotonic() < end, told
            time.sleep(0.05)
            try:
                told = self.client.get("/status").json()["state"]
            except httpx.HTTPError as error:
                told = error

    def end(self) -> None:
        self.client.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        self.process.communicate(timeout=PATIENCE_S)


def fill_the_disk_for(service: int, daemon: Daemon) -> None:
    """Let the service's files grow no further; wait until it says so, the robot being active."""
    (path,) = daemon.recordings.iterdir()
    size = path.stat().st_size
    resource.prlimit(service, resource.RLIMIT_FSIZE, (size, size))
    end = time.monotonic() + PATIENCE_S
    while not (told := daemon.client.get("/status").json())["parts"]["recording"]["error"]:
        assert time.monotonic() < end
        time.sleep(0.05)
    assert told["state"] == "active"
    assert "File too large" in told["parts"]["recording"]["error"]
    events = daemon.client.get("/events").json()["events"]
    assert any("File too large" in event["text"] for event in events)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    """The files of a run in which, while the motors had power, the disk was full for the service
    and it was killed then; the next one has room again."""
    daemon = Daemon(tmp_path_factory.mktemp("run"))
    try:
        cdpr("enable", *daemon.socket)
        cdpr("jog", "left=30", "--seconds", "1", *daemon.socket)
        service = service_of(daemon.process.pid)
        fill_the_disk_for(service, daemon)
        os.kill(service, signal.SIGKILL)
        daemon.wait_for("active")
        cdpr("disable", *daemon.socket)
        cdpr("stop", *daemon.socket)
        _, errors = daemon.process.communicate(timeout=PATIENCE_S)
        assert daemon.process.returncode == 0, errors
        yield sorted(daemon.recordings.iterdir())
    finally:
        daemon.end()


def test_no_cycle_is_missing_from_the_first_to_the_last(recorded: list[Path]) -> None:
    assert [path.name[-8:] for path in recorded] == ["001.mcap", "002.mcap"]
    rows = [row for path in recorded for _, row in messages(path, "/cycle")]
    cycles = np.array([row["cycle"] for row in rows])
    assert cycles.size > 500
    assert (np.diff(cycles) == 1).all()
    assert np.allclose(np.diff([row["time_s"] for row in rows]), 0.002, atol=1e-6)
    stamps = np.array([row["stamp_ns"] for row in rows])
    assert (np.diff(stamps) > 0).all()


def test_the_rows_tell_what_the_robot_did(recorded: list[Path]) -> None:
    rows = [row for path in recorded for _, row in messages(path, "/cycle")]
    states = [row["state"] for row in rows]
    changes = [states[0], *(b for a, b in pairwise(states) if a != b)]
    assert changes[-3:] == [2, 3, 2]  # ready, active, ready
    powered = np.array(states) == 3
    torque = np.array([row["torque_sent_Nm"] for row in rows])
    assert (torque[~powered] == 0.0).all() and (np.abs(torque[powered, 0]) > 0.01).any()
    setpoint = np.degrees([row["setpoint_rad"] for row in rows])
    moved = setpoint[powered][-1] - setpoint[powered][0]
    assert 10.0 < moved[0] < 45.0 and abs(moved[1]) < 1.0
    words = np.array([row["statusword"] for row in rows])
    enabled = ((words[powered] & 0x6F) == 0x27).all(axis=1)  # operation enabled
    assert enabled.mean() > 0.8


def test_events_and_description_are_there(recorded: list[Path]) -> None:
    texts = [value["text"] for path in recorded for _, value in messages(path, "/events")]
    for text in ("state ready", "state active", "program jog", "program hold"):
        assert text in texts
    for path in recorded:
        description = messages(path, "/description")[0][1]
        assert [axis["name"] for axis in description["axes"]] == ["left", "right"]
        assert description["period_s"] == 0.002


def test_what_the_stock_reader_finds_cdpr_log_finds(recorded: list[Path]) -> None:
    first, second = cdpr("log", "info", str(recorded[0].parent))["recordings"]
    assert (first["ended"], second["ended"]) == ("not closed", "closed")
    assert first["missing_cycles"] == second["missing_cycles"] == 0
    for path, figures in zip(recorded, (first, second), strict=True):
        assert figures["rows"] == len(messages(path, "/cycle"))
        assert len(figures["events"]) == len(messages(path, "/events"))
