"""A motor is measured over a real SocketCAN interface."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from cdpr_here import cdpr_here
from tolerant_drive import write_tolerant_drive

pytestmark = pytest.mark.vcan

WINCH = """
name = "Winch on a virtual CAN, six milliseconds a cycle"
motor = "MPP0923D"
drive = "tolerant"
cable = "dyneema-4.8mm"
gear_ratio = 4.0
drum_radius_m = 0.104
encoder_counts_per_turn = 8192
node_id = 5
sync_period_s = 0.006
"""
CDPR = (sys.executable, "-m", "cdpr_tools.cli")


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
        process.wait(120)
        process.stdout.close()


def test_a_motor_is_measured_over_socketcan(tmp_path: Path) -> None:
    """Compensation does not depend on the bus and is tested elsewhere, where cycles are cheaper."""
    winch, out = tmp_path / "winch.toml", tmp_path / "out"
    winch.write_text(WINCH)
    write_tolerant_drive(tmp_path)
    with simulated_drive(winch):
        bus = "socketcan:vcan0?lockstep=true"
        arguments = ["cogging", "sweep", str(winch), "--bus", bus, "--out", str(out), "--yes"]
        result = subprocess.run(
            [*CDPR, *arguments, "--turns", "1", "--speed-deg-s", "60"],
            capture_output=True,
            text=True,
            timeout=400,
            check=False,
        )
        assert result.returncode == 0, result.stderr[-2000:]
    told = json.loads(cdpr_here("cogging", "fit", out, "--json").stdout.splitlines()[-1])
    found = told["identification"]
    # the size is tested on a led bus, because here late SYNCs would affect it
    strongest = max(zip(found["amplitudes_Nm"], found["orders"], strict=True))
    assert strongest[1] == 4
