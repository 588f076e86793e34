"""`cdpr estop`, and modules planted in the working directory, with real daemons."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from daemon_lab import running
from daemon_rig import NAME, PATIENCE_S, RealDaemon, alive, cdpr
from test_daemon_kills import (
    NODES,
    PATIENT,
    PERIOD_S,
    expect_stop,
    in_motion,
    slow_daemon,
    third_party,
)
from waiting import until

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.cia402 import POWER_OFF, State, state_of
from cdpr_tools.daemon import estop as emergency_stop
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile, started

SILENT, FOR_GOOD = 6, 0xFFFF  # of 2F00h
paced = pytest.mark.alone
"""Marks of tests with drives that follow the wall clock."""


def estop(*arguments: str | Path, **env: str) -> tuple[int, dict[str, Any]]:
    """Return the exit status and the JSON of the command."""
    done = subprocess.run(
        [sys.executable, "-P", "-m", "cdpr_tools.cli", "estop", *map(str, arguments), "--json"],
        env={**os.environ, **env},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    made = slow_daemon(tmp_path_factory.mktemp("run"))
    yield made
    made.end()


@paced
def test_estop_cuts_power_immediately_while_the_service_hangs_and_leaves_a_fault(
    daemon: RealDaemon,
) -> None:
    service = daemon.children()["service"]
    with in_motion(daemon) as ear:
        os.kill(service, signal.SIGSTOP)
        try:
            status, told = estop(*daemon.at)
        finally:
            os.kill(service, signal.SIGCONT)
        (robot,) = told["robots"]
        assert (status, told["ok"], robot["robot"]) == (0, True, NAME), told
        assert "every drive confirms it (fault: emergency stop by cdpr estop)" in robot["text"]
        words = [data[0] for _, data in ear.of(0x201)]
        assert 0x02 not in {word & 0x0F for word in words}  # without quick stop or braking
        assert state_of(int.from_bytes(ear.of(0x181)[-1][1][:2], "little")) in POWER_OFF
    assert daemon.wait_for("fault")["reason"] == "emergency stop by cdpr estop"
    assert "fault" in cdpr("enable", *daemon.at).stderr
    assert cdpr("ack", *daemon.at).returncode == 0


@paced
def test_estop_kills_a_hanging_loop_and_reports_it_as_unconfirmed(tmp_path: Path) -> None:
    daemon = slow_daemon(tmp_path)
    try:
        with in_motion(daemon) as ear:
            loop = daemon.children()["loop"]
            at_s = time.monotonic()
            os.kill(loop, signal.SIGSTOP)
            status, told = estop(*daemon.at)
            assert status == 1
            assert not told["robots"][0]["confirmed"]
            assert "has run no cycle for 1 s and was killed" in told["robots"][0]["text"]
            assert not alive(loop)
            expect_stop(ear, at_s)
        status, told = estop(*daemon.at)
        assert status == 1
        assert "its loop has ended; its drives stop within 0.2 s without its heartbeat" in str(told)
    finally:
        daemon.end()


@paced
def test_estop_of_a_listener_stops_nothing_and_reports_the_observed_drives(
    daemon: RealDaemon, tmp_path: Path
) -> None:
    options = ("--no-record", "--read-only")
    listener = RealDaemon(tmp_path, *options, bus=daemon.bus, period_s=PERIOD_S, limits=PATIENT)
    try:
        with in_motion(daemon) as ear:
            status, told = estop(*listener.at)
            assert (status, told["robots"][0]["confirmed"]) == (1, False)
            assert "only listens: stop the master" in told["robots"][0]["text"]
            for node in NODES:  # as their master commands
                word = int.from_bytes(ear.of(0x180 + node)[-1][1][:2], "little")
                assert state_of(word) is State.OPERATION_ENABLED
            assert estop(*daemon.at)[0] == 0
        status, told = estop(*listener.at)
        assert (status, told["robots"][0]["confirmed"]) == (0, True), told
    finally:
        listener.end()
    daemon.wait_for("fault")
    assert cdpr("ack", *daemon.at).returncode == 0


@paced
def test_estop_does_not_confirm_a_drive_that_does_not_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(emergency_stop, "_CONFIRM_S", 1.5)
    daemon = slow_daemon(tmp_path)
    try:
        with in_motion(daemon) as ear:
            with third_party(ear.bus) as network:
                network.write(NODES[0], 0x2F00, SILENT, FOR_GOOD)
            one = emergency_stop.EmergencyStop(daemon.socket.with_suffix(".loop"))
            with closing(one):
                outcome = one.outcome()
            assert not outcome.confirmed
            assert "not every drive has confirmed within 1.5 s" in outcome.text
            assert "fault" in outcome.text
            # the other drive has lost its power
            word = int.from_bytes(ear.of(0x180 + NODES[1])[-1][1][:2], "little")
            assert state_of(word) in POWER_OFF
    finally:
        daemon.end()


@paced
def test_stop_reports_a_drive_that_does_not_confirm_once(tmp_path: Path) -> None:
    daemon = slow_daemon(tmp_path)
    try:
        assert cdpr("enable", *daemon.at).returncode == 0
        with third_party(BusUrl.parse(f"{daemon.bus}-can0")) as network:
            network.write(NODES[0], 0x2F00, SILENT, FOR_GOOD)
        daemon.wait_for("fault")
        stopped = cdpr("stop", *daemon.at)
        assert stopped.returncode == 1
        assert "these drives do not answer and may have power" in stopped.stderr
    finally:
        ended = daemon.end()
    assert ended == 1
    told = [line for line in daemon.errors().splitlines() if line.startswith("cdpr: ")]
    assert len(told) == 1 and "does not confirm that its power stage is off" in told[0]


def test_estop_signals_no_process_for_a_stale_loop_file(tmp_path: Path) -> None:
    own = started(os.getpid())
    named = LoopFile(
        robot=NAME,
        pid=os.getpid(),
        started=own - 1,  # an earlier process with the same pid
        block_fd=3,
        uid=os.geteuid(),
        drives_stop_s=0.2,
    )
    named.write(tmp_path / "left.loop")
    signalled: list[int] = []
    before = signal.signal(POWER_OFF_SIGNAL, lambda number, _: signalled.append(number))
    try:
        status, told = estop("--socket", tmp_path / "left.sock")
    finally:
        signal.signal(POWER_OFF_SIGNAL, before)
    assert not signalled
    assert (status, told["robots"][0]["confirmed"]) == (1, False)
    assert "its loop has ended" in told["robots"][0]["text"]


def test_estop_requires_a_name_or_all_if_several_robots_run(tmp_path: Path) -> None:
    runtime = tmp_path / "cdpr-rt"
    runtime.mkdir(mode=0o700)
    env = {"XDG_RUNTIME_DIR": str(tmp_path)}
    status, told = estop(**env)
    assert (status, "no running loop was found" in told["error"]) == (1, True)
    (tmp_path / "one").mkdir()
    with running(tmp_path / "one", period_s=0.02) as one:
        found = until((tmp_path / "one" / "control.loop").exists)
        assert found
        for name in ("left", "right"):
            named = (tmp_path / "one" / "control.loop").read_text()
            (runtime / f"{name}.loop").write_text(named)
        status, told = estop(**env)
        assert (status, "name one of left, right" in told["error"]) == (2, True)
        assert estop("left", "--all", **env)[0] == 2
        assert estop("left", "--robot", "right", **env)[0] == 2
        status, told = estop("letf", **env)
        assert (status, "running: left, right; --all stops it" in told["error"]) == (1, True)
        assert one.status()["state"] == "ready"  # no robot was stopped
        status, told = estop("--all", **env)
        assert (status, len(told["robots"])) == (0, 2)
        one.wait_for("fault")
        for words in (("left",), ("--robot", "left"), ("left", "--robot", "left")):
            status, told = estop(*words, **env)
            assert (status, len(told["robots"])) == (0, 1)


def test_no_module_is_loaded_from_the_working_directory(tmp_path: Path) -> None:
    planted = tmp_path / "planted"
    planted.mkdir()
    text = f"open({str(tmp_path / 'loaded')!r}, 'a').write(__name__ + ' ')\nraise SystemExit(3)\n"
    packages = ("cdpr_rt", "cdpr_drivers", "cdpr_profiles", "cdpr_sim_bus", "cdpr_tools")
    for package in (*packages, "tools", "drivers", "profiles", "sim_bus", "multiprocessing"):
        (planted / package).mkdir()
        (planted / package / "__init__.py").write_text(text)
    for module in ("fastapi", "uvicorn", "numpy", "json"):
        (planted / f"{module}.py").write_text(text)
    folder = tmp_path / "run"
    folder.mkdir()
    daemon = RealDaemon(folder, "--no-record", cwd=planted)
    assert daemon.end() == 0
    assert not (tmp_path / "loaded").exists()
