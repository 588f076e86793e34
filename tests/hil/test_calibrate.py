"""`cdpr calibrate run` is killed and resumed, and `cdpr calibrate check` checks its result."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cdpr_here import cdpr_here

from cdpr_rt.calibration.readings import load_data
from tests.slower_robot import slower_robot

_PLANT = """
[geometry]
exit_errors_m = [[0.006, 0.0], [0.0, -0.006], [0.0, 0.005], [-0.004, 0.003]]
[cables]
drum_radius_errors = [0.003, -0.002, {drum}, 0.004]
[scanner]
position_sigma_m = 0.001
"""

_SLIP = "[[cables.slips]]\ncable = {cable}\nat_s = {at_s}\nslip_m = {slip_m}\n"


@pytest.fixture(autouse=True)
def _own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def killed_after(poses: int, data: Path, words: list[str]) -> None:
    """Run a command and kill it as soon as it has recorded `poses` poses."""
    command = [sys.executable, "-P", "-m", "cdpr_tools.cli", *words]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        while not data.exists() or len(load_data(data).poses) < poses:
            assert process.poll() is None, process.stderr and process.stderr.read().decode()
            time.sleep(0.05)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()


def test_a_killed_run_resumes_reports_a_slip_and_its_calibration_can_be_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cdpr_tools.calibrate.check.POSES", 6)
    plant, fine, moved = (tmp_path / f"{name}.toml" for name in ("plant", "fine", "moved"))
    fine.write_text(_PLANT.format(drum=0.0))
    plant.write_text(fine.read_text())
    moved.write_text(_PLANT.format(drum=0.02))
    folder, robot = tmp_path / "out", slower_robot(tmp_path, "planar-4")
    words = ["calibrate", "run", str(robot), "--scanner", "--plant", str(plant)]
    words += ["--out", str(folder), "--poses", "15"]
    killed_after(4, folder / "data.json", words)
    plant.write_text(fine.read_text() + _SLIP.format(cable=2, at_s=38.0, slip_m=0.012))
    again = cdpr_here(*words)
    assert again.returncode == 2 and "--resume" in again.stderr
    done = cdpr_here("calibrate", "run", robot, "--resume", "--out", folder, "--json")
    assert done.returncode == 0, done.stderr
    assert "continuing after" in done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    data = load_data(folder / "data.json")
    assert len(data.poses) == 15 and len(data.restarts) == 1 and told["poses"] == 15
    (jump,) = [fault for fault in told["faults"] if fault["kind"] == "jump"]
    assert jump["cable"] == 2 and jump["pose"] > data.restarts[0] + 1, done.stderr
    assert jump["size"] == pytest.approx(0.012, abs=0.002)
    proof = told["verification"]
    assert proof["reference"] == "scanner" and proof["poses"] == 3
    assert proof["mean_position_error_mm"] < 2.0 < proof["mean_position_error_before_mm"] + 2.0
    assert told["truth"]["mean_position_error_mm"] < 1.0
    errors = {row["name"]: row for row in told["truth"]["parameters"]}
    assert abs(errors["upper left drum"]["error"]) < 4.0 * errors["upper left drum"]["std"]
    assert told["in_force"]["version"] == 1
    page = Path(told["report"]).read_text()
    assert page.count("<figure>") >= 3 and 'src="data:image/png' in page
    # with "://", because letters alone could occur in a picture's base64
    assert "://" not in page.split("</style>")[1]
    held = cdpr_here("calibrate", "check", robot, "--plant", fine, "--json")
    assert held.returncode == 0, held.stderr + held.stdout
    other = cdpr_here("calibrate", "check", robot, "--plant", moved, "--json")
    assert other.returncode == 1, other.stderr
    change = json.loads(other.stdout.splitlines()[-1])["changes"][0]
    assert change["kind"] == "drum" and 3 in (change["cable"], *change["or_cables"])
    assert "check its drum" in other.stderr and "recalibrate" in other.stderr
