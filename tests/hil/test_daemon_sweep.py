"""A daemon measures a motor of its robot by command."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from daemon_rig import RealDaemon, cdpr
from waiting import until

SWEEP = ("cogging", "sweep-axis")


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    folder = tmp_path_factory.mktemp("sweeping")
    one = RealDaemon(folder, "--record", str(folder / "recorded"), period_s=0.002)
    try:
        yield one
    finally:
        assert one.end() == 0, one.errors()


def begin(*arguments: str | Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments), "--json"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def result(command: subprocess.Popen[str], status: int = 0) -> dict[str, Any]:
    out, err = command.communicate(timeout=300.0)
    assert command.returncode == status, err
    told: dict[str, Any] = json.loads(out.splitlines()[-1])
    return told


def test_a_sweep_by_the_daemon_measures_the_cogging(daemon: RealDaemon, tmp_path: Path) -> None:
    fast = ("--turns", "1", "--speed-deg-s", "60")
    result(begin(*SWEEP, "right", "--out", tmp_path / "right", *fast, *daemon.at))
    assert daemon.status()["state"] == "ready"
    told = result(begin("cogging", "fit", tmp_path / "right"))
    assert 4 in told["identification"]["orders"]
    serials = daemon.status()["buses"]["can0"]["drives"]
    profile = json.loads((tmp_path / "right" / "cogging-profile.json").read_text())
    assert profile["identity"] == serials["right"] != serials["left"]


def test_ctrl_c_stops_the_motor_and_cuts_power(daemon: RealDaemon, tmp_path: Path) -> None:
    command = begin(*SWEEP, "left", "--out", tmp_path / "left", *daemon.at)
    until(lambda: daemon.status()["program"] == "sweep")
    os.kill(command.pid, signal.SIGINT)
    assert "stopped on request" in result(command, 1)["error"]
    assert daemon.status()["state"] == "ready"


@pytest.mark.parametrize(
    ("axis", "text"), [("middle", "allowed: left, right"), ("left", "does not record")]
)
def test_an_impossible_sweep_is_reported_before_power_is_on(
    daemon: RealDaemon, tmp_path: Path, axis: str, text: str
) -> None:
    if axis == "left":
        with_no_record = RealDaemon(tmp_path, "--no-record")
        try:
            told = cdpr(*SWEEP, axis, "--out", tmp_path / "out", *with_no_record.at)
        finally:
            with_no_record.end()
    else:
        told = cdpr(*SWEEP, axis, "--out", tmp_path / "out", *daemon.at)
    assert (told.returncode, text in told.stderr) == (2, True), told.stderr
    assert not (tmp_path / "out").exists()
