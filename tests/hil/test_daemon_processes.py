"""A real daemon's processes: what systemd hears, who may run where, what is left when one dies."""

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
from daemon_rig import RealDaemon, alive, cdpr, until
from mcap.reader import make_reader

from cdpr_tools.daemon.loop_file import LoopFile

POWERED = 0x0004  # statusword: operation enabled


class Manager:
    """The socket at which systemd listens."""

    def __init__(self, path: Path) -> None:
        self.env = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "2000000"}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))

    def heard(self, seconds: float) -> list[str]:
        """Return everything told until nothing comes for so long."""
        told: list[str] = []
        self._socket.settimeout(seconds)
        while True:
            try:
                told += self._socket.recv(4096).decode().split("\n")
            except TimeoutError:
                return told

    def hears(self, wanted: str) -> None:
        """Wait for a line."""
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
    # /proc tells of a forked process with what environment the server was started
    env = {**manager.env, "CDPR_TEST_FORKS": "0"}
    daemon = RealDaemon(tmp_path_factory.mktemp("run"), "--no-record", env=env)
    yield daemon
    daemon.end()


def test_it_is_up_without_power_and_systemd_hears_so(daemon: RealDaemon, manager: Manager) -> None:
    assert daemon.ready["socket"] == str(daemon.socket)
    assert daemon.ready["pid"] == daemon.process.pid
    manager.hears("READY=1")
    manager.hears("WATCHDOG=1")
    assert daemon.status()["state"] == "ready"
    # whoever comes later does not speak for the daemon
    for pid in daemon.children().values():
        assert b"NOTIFY_SOCKET" not in Path(f"/proc/{pid}/environ").read_bytes()


def test_the_core_of_a_loop_that_has_to_be_punctual_is_left_to_it(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record", paced=True)
    try:
        children = daemon.children()
        taken = os.sched_getaffinity(children["loop"])
        if len(taken) > 1:  # it could not have one, and says so
            assert any("none to itself" in n or "ordinary" in n for n in daemon.status()["notices"])
            return
        for pid in (daemon.process.pid, children["service"]):
            for task in Path(f"/proc/{pid}/task").iterdir():
                assert not taken & os.sched_getaffinity(int(task.name))
    finally:
        daemon.end()


def test_a_second_daemon_for_the_same_robot_is_refused(daemon: RealDaemon) -> None:
    second = cdpr("run", daemon.robot, "--bus", "simbus:", "--no-record", *daemon.at)
    assert second.returncode == 2
    assert "a daemon runs there already" in second.stderr
    assert "Traceback" not in second.stderr
    assert daemon.status()["loop"]["alive"]


def test_a_loop_that_is_killed_is_reported_and_nobody_feeds_the_watchdog(
    daemon: RealDaemon, manager: Manager
) -> None:
    children = daemon.children()
    os.kill(children["loop"], signal.SIGKILL)
    until(lambda: "the loop has died: killed by signal 9" in daemon.status()["reason"])
    told = daemon.wait_for("dead")
    assert not told["loop"]["alive"]
    manager.hears("STATUS=dead: the loop has died: killed by signal 9")
    assert "WATCHDOG=1" not in manager.heard(1.0)
    assert daemon.http.post("/hold", json={}).status_code == 503
    assert daemon.children()["service"] == children["service"]
    for command in ("ack", "enable", "hold"):
        refused = cdpr(command, *daemon.at)
        assert refused.returncode == 1
        assert (
            "killed by signal 9; its drives had been told to have no power; next: `cdpr stop`"
            in refused.stderr
        )
    shown = cdpr("status", *daemon.at).stdout
    assert "next: `cdpr stop`" in shown and "what follows is of" in shown
    stopped = cdpr("stop", *daemon.at)  # ends what is left, and is no error where nothing is
    assert stopped.returncode == 1
    assert "its loop had died: its drives had been told to have no power" in stopped.stderr
    assert daemon.process.wait(60.0) == 1
    nothing = cdpr("stop", *daemon.at)
    assert (nothing.returncode, nothing.stdout) == (0, "nothing runs\n")
    assert daemon.end() == 1
    assert not any(alive(pid) for pid in children.values())
    assert not daemon.socket.exists()


def test_a_launcher_that_is_killed_takes_everything_along_in_order(tmp_path: Path) -> None:
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
    # the motors lost their power in cycles that are recorded, the last of all
    assert any(word & POWERED for word in chain(*words))
    assert not any(word & POWERED for word in words[-1])


def test_a_loop_that_ends_is_not_taken_for_a_process_of_another_kind(tmp_path: Path) -> None:
    # one that is forked has no interpreter to take apart at its end
    daemon = RealDaemon(tmp_path, "--no-record", env={"CDPR_TEST_FORKS": "0"})
    found = LoopFile.read(LoopFile.beside(daemon.socket))
    daemon.process.terminate()
    while found.runs():
        time.sleep(0.001)
    while alive(found.pid):  # its interpreter takes a while to end
        assert not found.runs()
        time.sleep(0.001)
    assert daemon.end() == 0
