"""The same commissioning, shortened, over a real SocketCAN interface."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import profiles

pytestmark = pytest.mark.vcan

WINCH = """
name = "Winch on a virtual CAN, two milliseconds a cycle"
motor = "MPP0923D"
drive = "drive.toml"
cable = "dyneema-4.8mm"
gear_ratio = 4.0
drum_radius_m = 0.104
encoder_counts_per_turn = 8192
node_id = 5
sync_period_s = 0.002
"""
DRIVES = Path(profiles.__file__).parent / "drives"
CDPR = (sys.executable, "-m", "tools.cli")


@contextlib.contextmanager
def simulated_drive(winch: Path) -> Iterator[None]:
    command = [*CDPR, "sim", "up", str(winch), "--bus", "socketcan:vcan0", "--exit-with-stdin"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert "ready" in process.stdout.readline()
        yield
    finally:
        process.stdin.close()
        process.wait(20)
        process.stdout.close()


def test_commissioning_over_socketcan(tmp_path: Path) -> None:
    winch = tmp_path / "winch.toml"
    winch.write_text(WINCH)
    # a guest kernel with ten milliseconds a tick is heard late at times
    patient = (DRIVES / "generic-cia402.toml").read_text()
    patient = patient.replace("heartbeat_consumer_s = 0.5", "heartbeat_consumer_s = 10.0")
    patient = patient.replace('"generic-cia402.eds"', f'"{DRIVES / "generic-cia402.eds"}"', 1)
    (tmp_path / "drive.toml").write_text(patient)
    with simulated_drive(winch):
        out = tmp_path / "out"
        bus = "socketcan:vcan0?lockstep=true"
        arguments = ["commission", str(winch), "--bus", bus, "--out", str(out), "--quick"]
        result = subprocess.run(
            [*CDPR, *arguments, "--yes", "--json"],
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )
        assert result.returncode == 0, result.stderr[-2000:]
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["validation"]["judged_on"] == "encoder"
    assert told["validation"]["better"]["ratios"]["rms_position_error"] > 3
    assert 4 in told["identification"]["orders"]
