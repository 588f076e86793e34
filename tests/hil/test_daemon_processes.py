"""Processes of a real daemon: notifications to systemd, cores, and the death of each process."""

from __future__ import annotations

import json
import os
import signal
import socket
import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest
from daemon_rig import RealDaemon, alive, cdpr
from mcap.reader import make_reader
from waiting import until

from cdpr_tools.daemon.loop_file import LoopFile

POWERED = 0x0004  # statusword: operation enabled


class Manager:
    """The socket of systemd for notifications."""

    def __init__(self, path: Path) -> None:
        self.env = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "2000000"}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))

    def hears(self, wanted: str) -> None:
        """Wait for a notification."""
        self._socket.settimeout(60.0)
        told, end = list[str](), time.monotonic() + 60.0
        while wanted not in told:
            assert time.monotonic() < end, told
            told += self._socket.recv(4096).decode().split("\n")


@pytest.fixture(scope="module")
def manager(tmp_path_factory: pytest.TempPathFactory) -> Manager:
    return Manager(tmp_path_factory.mktemp("systemd") / "notify")


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory, manager: Manager) -> Iterator[RealDaemon]:
    # of a forked process, /proc shows the environment of the fork server
    env = {**manager.env, "CDPR_TEST_FORKS": "0"}
    daemon = RealDaemon(tmp_path_factory.mktemp("run"), "--no-record", env=env)
    yield daemon
    daemon.end()


def test_a_daemon_starts_without_power_and_notifies_systemd(
    daemon: RealDaemon, manager: Manager
) -> None:
    assert daemon.ready["socket"] == str(daemon.socket)
    assert daemon.ready["pid"] == daemon.process.pid
    manager.hears("READY=1")
    manager.hears("WATCHDOG=1")
    assert daemon.status()["state"] == "ready"
    # only the launcher may notify systemd
    for pid in daemon.children().values():
        assert b"NOTIFY_SOCKET" not in Path(f"/proc/{pid}/environ").read_bytes()


def test_other_processes_leave_the_core_of_a_real_time_loop_alone(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record", paced=True)
    try:
        children = daemon.children()
        taken = os.sched_getaffinity(children["loop"])
        if len(taken) > 1:  # the loop could not get a separate core, and reports it
            assert any(
                "no separate core" in n or "ordinary" in n for n in daemon.status()["notices"]
            )
            return
        for pid in (daemon.process.pid, children["service"]):
            for task in Path(f"/proc/{pid}/task").iterdir():
                assert not taken & os.sched_getaffinity(int(task.name))
    finally:
        daemon.end()


def test_loop_and_service_end_properly_after_the_launcher_was_killed(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--record", str(tmp_path / "log"))
    children = daemon.children()
    assert set(children) == {"loop", "service", "simulator"}
    try:
        enabled = cdpr("enable", *daemon.at)
        assert enabled.returncode == 0, enabled.stderr
        daemon.process.kill()
        until(lambda: not any(alive(pid) for pid in children.values()))
    finally:
        for pid in children.values():
            if alive(pid):
                os.kill(pid, signal.SIGKILL)
        daemon.end()
    (log,) = (tmp_path / "log").iterdir()
    with log.open("rb") as file:
        found = make_reader(file).iter_messages(["/cycle"])
        words = [json.loads(message.data)["statusword"] for _, _, message in found]
    # the recording shows power in some cycles and none in the last
    assert any(word & POWERED for word in chain(*words))
    assert not any(word & POWERED for word in words[-1])


def test_a_loop_file_does_not_report_an_ending_process_as_running(tmp_path: Path) -> None:
    # not forked: a forked process exits without tearing down its interpreter
    daemon = RealDaemon(tmp_path, "--no-record", env={"CDPR_TEST_FORKS": "0"})
    found = LoopFile.read(LoopFile.beside(daemon.socket))
    daemon.process.terminate()
    while found.runs():
        time.sleep(0.001)
    while alive(found.pid):  # the interpreter takes a while to exit
        assert not found.runs()
        time.sleep(0.001)
    assert daemon.end() == 0
