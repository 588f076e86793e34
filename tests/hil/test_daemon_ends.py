"""Daemons whose terminal, reader, launcher or service fails."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

import pytest
from daemon_lab import KEY, with_key
from daemon_rig import PATIENCE_S, RealDaemon, alive, cdpr
from waiting import until

from cdpr_tools.bench.flood import Target


def test_a_daemon_whose_output_is_closed_restarts_its_service(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    daemon = RealDaemon(tmp_path, "--no-record", stderr=writer)
    try:
        os.close(writer)
        assert daemon.process.stdout is not None
        daemon.process.stdout.close()  # as if tee in `cdpr run 2>&1 | tee log` had ended
        os.close(reader)
        assert cdpr("enable", *daemon.at).returncode == 0
        before = daemon.children()
        os.kill(before["service"], signal.SIGKILL)
        until(lambda: daemon.children().get("service") not in (None, before["service"]))
        assert daemon.children()["loop"] == before["loop"]
        assert daemon.wait_for("active")["program"] == "hold"
        daemon.process.send_signal(signal.SIGINT)
        assert daemon.process.wait(PATIENCE_S) == 0
    finally:
        daemon.process.kill()
        daemon.process.wait()


def test_stop_works_while_the_launcher_process_is_stopped(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record")
    try:
        assert cdpr("enable", *daemon.at).returncode == 0
        children = daemon.children()
        os.kill(daemon.process.pid, signal.SIGSTOP)
        done = cdpr("stop", *daemon.at)  # it takes a minute at most
        assert (done.returncode, done.stdout) == (0, "stopped, power off\n"), done.stderr
        assert daemon.process.wait(PATIENCE_S) == 0
        assert not any(alive(pid) for pid in children.values())
    finally:
        daemon.process.send_signal(signal.SIGCONT)
        daemon.end()


def test_a_user_without_home_folder_can_run_a_robot(tmp_path: Path) -> None:
    env = {"HOME": "/proc/nowhere", "XDG_STATE_HOME": "/proc/nowhere", "XDG_CACHE_HOME": ""}
    daemon = RealDaemon(tmp_path, env=env)
    try:
        assert cdpr("enable", *daemon.at).returncode == 0
        assert daemon.status()["state"] == "active"
        assert "recorder" not in daemon.status()["parts"]
    finally:
        assert daemon.end() == 0
    told = daemon.errors()
    assert told.count("not recording: /proc/nowhere/cdpr-rt/recordings") == 1
    assert "Traceback" not in told


@pytest.mark.parametrize(
    ("command", "status", "told"),
    [
        ("status", 1, "no daemon answers at {}.sock ([Errno 2] No such file or directory)"),
        ("stop", 0, "nothing runs\n"),
        ("estop", 1, "NOT CONFIRMED: {}.loop: cannot be read: No such file or directory"),
    ],
)
def test_commands_work_without_home_folder(
    tmp_path: Path, command: str, status: int, told: str
) -> None:
    env = {"PATH": os.environ["PATH"], "HOME": "/proc/nowhere", "CDPR_TEST_FORKS": "0"}
    done = subprocess.run(
        [sys.executable, "-P", "-m", "cdpr_tools.cli", command, "--socket", tmp_path / "no.sock"],
        env=env, capture_output=True, text=True, check=False, timeout=PATIENCE_S,
    )  # fmt: skip
    assert done.returncode == status
    assert told.format(tmp_path / "no") in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_hold_disable_and_stop_work_while_the_service_hangs(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record")
    try:
        assert cdpr("enable", *daemon.at).returncode == 0
        service = daemon.children()["service"]
        os.kill(service, signal.SIGSTOP)
        held = cdpr("hold", *daemon.at)
        assert (held.returncode, held.stdout) == (0, "active\n"), held.stderr
        disabled = cdpr("disable", *daemon.at)
        assert (disabled.returncode, disabled.stdout) == (0, "ready\n"), disabled.stderr
        done = cdpr("stop", *daemon.at)
        assert (done.returncode, done.stdout) == (0, "stopped, power off\n"), done.stderr
        assert daemon.process.wait(PATIENCE_S) == 0
        assert not (tmp_path / "control.stop").exists()
    finally:
        daemon.end()


@pytest.mark.long
def test_hold_and_stop_work_while_all_interfaces_are_flooded(tmp_path: Path) -> None:
    options = (*with_key(tmp_path), "--no-record")
    daemon = RealDaemon(tmp_path, *options)
    parts = daemon.status()["parts"]
    http, stream = parts["service"]["http"], parts["stream"]["address"]
    target = json.dumps(asdict(Target(str(daemon.socket), http, stream, KEY)))
    command = [sys.executable, "-m", "cdpr_tools.bench.flood", target]
    try:
        assert cdpr("enable", *daemon.at).returncode == 0
        with ExitStack() as stack:
            for _ in range(2):
                flood = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE))
                stack.callback(flood.terminate)
            refused = daemon.status()["parts"]["service"]["refused"]
            until(lambda: _refused(daemon) > refused + 100)
            for _ in range(3):
                held = cdpr("hold", *daemon.at)
                assert held.stdout.startswith("active\n") or "state ready" in held.stderr
            done = cdpr("stop", *daemon.at)
            assert (done.returncode, done.stdout) == (0, "stopped, power off\n"), done.stderr
        assert daemon.process.wait(PATIENCE_S) == 0
    finally:
        daemon.end()


def _refused(daemon: RealDaemon) -> int:
    """Return how many requests were rejected, if the flooded service answers."""
    return int(daemon.status().get("parts", {}).get("service", {}).get("refused", 0))
