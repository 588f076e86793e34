"""A daemon whose terminal closes lowers its platform and ends."""

from __future__ import annotations

import json
import os
import pty
import select
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from daemon_rig import PATIENCE_S, cdpr

from cdpr_profiles.places import SHIPPED
from cdpr_tools.composition.simulator import OwnSimulator

RUN = [sys.executable, "-P", "-m", "cdpr_tools.cli", "run"]


def on_terminal(*words: str) -> tuple[subprocess.Popen[bytes], int]:
    """Start `cdpr run` on a new terminal. Return the process and the other end of the terminal."""
    ours, theirs = pty.openpty()
    # a new session with a controlling terminal, so that the process receives SIGHUP
    become = "import os, sys, fcntl, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    become += "os.execv(sys.argv[1], sys.argv[1:])"
    process = subprocess.Popen(
        [sys.executable, "-c", become, *RUN, *words],
        stdin=theirs, stdout=theirs, stderr=theirs, env={**os.environ, "TERM": "dumb"},
    )  # fmt: skip
    os.close(theirs)
    shown, end_s = b"", time.monotonic() + PATIENCE_S
    try:
        while b"Ctrl-C ends it" not in shown:
            if select.select([ours], [], [], 1.0)[0]:
                with suppress(OSError):
                    shown += os.read(ours, 4096)
            assert process.poll() is None, shown
            assert time.monotonic() < end_s, shown
    except BaseException:
        process.kill()
        process.wait()
        raise
    return process, ours


def test_a_closed_terminal_lowers_a_platform_for_more_than_half_a_minute(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, at = tmp_path / "planar.toml", ("--socket", str(tmp_path / "control.sock"))
    text = (SHIPPED / "robots" / "planar-3.toml").read_text()
    for key, value, instead in (("sync_period_s", 0.001, 0.004), ("\nspeed_m_s", 0.5, 0.02)):
        assert f"{key} = {value}" in text
        text = text.replace(f"{key} = {value}", f"{key} = {instead}")
    robot.write_text(text)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    bus = f"simbus:terminal-{os.getpid()}"
    simulator = OwnSimulator(
        str(robot), bus
    )  # not by the daemon, which keeps the lengths in that case
    try:
        process, ours = on_terminal(str(robot), "--bus", bus, *at, "--no-record")
        try:
            for words in (("enable",), ("tighten",), ("move", "--to", "0", "1900")):
                done = cdpr(*words, *at)
                assert done.returncode == 0, done.stderr
            os.close(ours)
            closed_s = time.monotonic()
            assert process.wait(120) == 0
            assert time.monotonic() - closed_s > 30.0
        finally:
            process.kill()
            process.wait()
    finally:
        simulator.stop()
    kept = json.loads((tmp_path / "cdpr-rt" / "lengths.planar.simulated.json").read_text())
    assert (kept["stopped"], kept["fallen"], kept["displaced"]) == (True, False, False)
