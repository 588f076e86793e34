"""The daemon on a real SocketCAN interface, with simulated drives in a separate process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon_rig import RealDaemon, write_robot
from tolerant_drive import write_tolerant_robot

pytestmark = pytest.mark.vcan

BUS = "can0=socketcan:vcan0"
PERIOD_S = 0.05  # the guest kernel is slow and has one processor
LIMITS = """
late_s = 5.0
missed_cycles = 200
missed_in_window = 500
stale_cycles = 1000
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """Write a robot whose master and drives tolerate the delays in LIMITS."""
    path = write_robot(tmp_path, PERIOD_S, LIMITS)
    write_tolerant_robot(path, path.read_text())
    return path


@pytest.fixture
def drives(robot: Path) -> Iterator[None]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", str(robot), "--bus", BUS]
    process = subprocess.Popen(
        [*command, "--paced", "--exit-with-stdin"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert "ready" in json.loads(process.stdout.readline())
        yield
    finally:
        process.stdin.close()
        process.wait(120)
        process.stdout.close()


@pytest.mark.usefixtures("drives")
def test_enabled_held_and_stopped_under_control_over_socketcan(tmp_path: Path, robot: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record", "--yes", bus=BUS, robot=robot)
    try:
        assert not daemon.status()["lockstep"]
        token = daemon.http.post("/control", json={"client": "test", "ttl_s": 10}).json()["token"]
        may = {"X-Control-Token": token}
        enabled = daemon.http.post("/enable", json={}, headers=may)
        assert enabled.status_code == 200, enabled.text
        told = daemon.wait_for("active")
        assert told["program"] == "hold"
        assert all(axis["statusword"] & 0x6F == 0x27 for axis in told["axes"])
        assert daemon.http.post("/disable", json={}).status_code == 200
        assert all(axis["statusword"] & 0x6F != 0x27 for axis in daemon.wait_for("ready")["axes"])
    finally:
        status = daemon.end()
    assert status == 0
