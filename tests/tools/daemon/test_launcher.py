"""The launcher starts, watches and ends the daemon's two processes, here stand-ins."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import launcher_rig
import pytest
from waiting import until

from cdpr_tools.daemon.loop_file import LauncherLock, LoopFile
from cdpr_tools.errors import BadInputError

pytestmark = pytest.mark.long

TIMEOUT_S = 60.0
SAME_PRESS_S = 2.0


class Daemon:
    """A running launcher and the socket of systemd."""

    def __init__(self, folder: Path, plan: dict[str, Any], watchdog_s: float = 0.0) -> None:
        self.folder = folder
        (folder / "plan.json").write_text(json.dumps(plan))
        self.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.manager.bind(str(folder / "notify"))
        self.manager.settimeout(TIMEOUT_S)
        env = {**os.environ, "PYTHONPATH": str(Path(launcher_rig.__file__).parent)}
        env["NOTIFY_SOCKET"] = str(folder / "notify")
        if watchdog_s:
            env["WATCHDOG_USEC"] = str(int(watchdog_s * 1e6))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "launcher_rig", str(folder)],
            env=env,
            stdout=subprocess.PIPE,
            text=True,
        )

    def line(self, key: str) -> dict[str, Any]:
        """Return the next line that has `key`."""
        assert self.process.stdout is not None
        for text in self.process.stdout:
            told: dict[str, Any] = json.loads(text)
            if key in told:
                return told
        raise AssertionError(f"the launcher ended without a word of {key}")

    def heard(self, wanted: str) -> list[str]:
        """Wait until systemd receives `wanted`. Return all notifications until then."""
        told, end = list[str](), time.monotonic() + TIMEOUT_S
        self.manager.settimeout(TIMEOUT_S)
        while wanted not in told:
            assert time.monotonic() < end, told
            told += self.manager.recv(4096).decode().split("\n")
        return told

    def stuff(self) -> None:
        """Fill systemd's queue."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as other:
            other.setblocking(False)
            with suppress(BlockingIOError):
                while True:
                    other.sendto(b"X_OTHER=1", str(self.folder / "notify"))

    def feeds(self, times: int = 2) -> None:
        """Wait until the watchdog has been fed `times` times from now on."""
        self.drain()
        for _ in range(times):
            self.heard("WATCHDOG=1")

    def drain(self) -> int:
        """Read all waiting notifications. Return how often they feed the watchdog."""
        count = 0
        self.manager.settimeout(0.0)
        with suppress(BlockingIOError):
            while True:
                count += self.manager.recv(4096) == b"WATCHDOG=1"
        return count

    def fed(self, seconds: float) -> int:
        """Return how often the watchdog is fed within `seconds`."""
        self.drain()
        time.sleep(seconds)
        return self.drain()

    def starves(self) -> None:
        """Wait until the watchdog is no longer fed."""
        until(lambda: not self.fed(0.6), TIMEOUT_S)

    def pid(self, who: str) -> int:
        return int((self.folder / f"{who}.pid").read_text())

    def log(self) -> list[str]:
        return (self.folder / "log").read_text().split("\n")[:-1]

    def ends(self) -> int:
        return self.process.wait(TIMEOUT_S)


Start = Callable[..., Daemon]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    daemons = []

    def run(
        plan: dict[str, Any] | None = None,
        watchdog_s: float = 0.0,
        before: Callable[[Path], None] = Path.exists,
    ) -> Daemon:
        before(tmp_path)
        daemons.append(Daemon(tmp_path, plan or {}, watchdog_s))
        return daemons[-1]

    yield run
    for daemon in daemons:
        for who in ("loop", "service"):
            _kill(daemon.folder / f"{who}.pid")
        daemon.process.kill()
        daemon.process.communicate()
        daemon.manager.close()


def _kill(pid_file: Path) -> None:
    if pid_file.exists() and _is_child(int(pid_file.read_text())):
        os.kill(int(pid_file.read_text()), signal.SIGKILL)


def _is_child(pid: int) -> bool:
    try:
        return b"stand_in" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def test_notifications_are_repeated_until_systemd_accepts_them(start: Start) -> None:
    daemon = start({"stopping_s": 1.0, "loading_s": 0.5}, watchdog_s=0.4)
    daemon.stuff()  # before the first notification
    daemon.line("ready")
    (daemon.folder / "fault").touch()
    assert daemon.line("told")["told"] == "fault: left: too fast"
    told = daemon.heard("STATUS=fault: left: too fast")
    assert told.count("READY=1") == 1
    assert "STATUS=ready" not in told  # only the newest state is sent
    os.kill(daemon.pid("service"), signal.SIGKILL)
    assert "killed by signal 9" in daemon.line("told")["told"]  # without repeating the fault
    daemon.feeds()
    daemon.stuff()
    daemon.process.terminate()
    daemon.heard("STOPPING=1")
    assert daemon.ends() == 0


@pytest.mark.parametrize(
    ("number", "told"),
    [(signal.SIGKILL, "killed by signal 9"), (signal.SIGSTOP, "has not responded for 1 s")],
)
def test_a_dead_or_hanging_service_is_restarted_and_the_loop_continues(
    start: Start, number: signal.Signals, told: str
) -> None:
    daemon = start({"stalled_s": 1.0 if number == signal.SIGSTOP else 60.0})
    daemon.line("ready")
    loop, service = daemon.pid("loop"), daemon.pid("service")
    os.kill(service, number)
    assert told in daemon.line("told")["told"]
    until(lambda: daemon.pid("service") != service, TIMEOUT_S)
    assert daemon.pid("loop") == loop
    assert _is_child(loop)


def test_a_service_that_hangs_before_its_first_turn_is_restarted(start: Start) -> None:
    daemon = start({"freeze_service": True, "service_start_s": 5.0})
    assert "has not responded for 5 s" in daemon.line("told")["told"]
    assert daemon.line("ready")["ready"]["state"] == "ready"
    daemon.process.terminate()
    assert daemon.ends() == 0


def test_a_service_busy_before_its_first_turn_is_not_restarted(start: Start) -> None:
    daemon = start({"service_works_s": 3.0, "service_start_s": 2.0})
    assert daemon.line("ready")["ready"]["state"] == "ready"  # without an earlier notice
    daemon.process.terminate()
    assert daemon.ends() == 0


def test_a_dead_loop_is_reported_and_the_service_remains(start: Start) -> None:
    daemon = start(watchdog_s=0.4)
    daemon.line("ready")
    daemon.heard("WATCHDOG=1")
    service = daemon.pid("service")
    os.kill(daemon.pid("loop"), signal.SIGKILL)
    status = daemon.line("told")["status"]
    assert (status["state"], status["reason"]) == (
        "dead",
        "the loop has died: killed by signal 9",
    )
    daemon.heard("STATUS=dead: the loop has died: killed by signal 9")
    assert daemon.fed(0.5) == 0
    assert _is_child(service)
    assert daemon.pid("service") == service
    daemon.process.terminate()
    assert "killed by signal 9" in daemon.line("reason")["reason"]
    assert daemon.ends() == 1


def test_a_hanging_loop_does_not_feed_the_watchdog_and_is_killed_at_the_end(start: Start) -> None:
    daemon = start({"stalled_s": 1.0}, watchdog_s=0.4)
    daemon.line("ready")
    daemon.feeds()
    loop = daemon.pid("loop")
    os.kill(loop, signal.SIGSTOP)
    assert "has run no cycle" in daemon.line("told")["told"]
    daemon.starves()
    os.kill(loop, signal.SIGCONT)
    assert "runs again" in daemon.line("told")["told"]
    daemon.feeds()
    os.kill(loop, signal.SIGSTOP)
    assert "has run no cycle" in daemon.line("told")["told"]
    daemon.process.terminate()
    assert "was killed" in daemon.line("reason")["reason"]
    assert daemon.ends() == 1
    assert daemon.log() == ["service stopped"]


def test_a_stalled_loop_in_lockstep_is_not_reported(start: Start) -> None:
    daemon = start({"status": {"lockstep": True}, "stalled_s": 1.0}, watchdog_s=0.4)
    daemon.line("ready")
    loop = daemon.pid("loop")
    os.kill(loop, signal.SIGSTOP)
    daemon.heard("WATCHDOG=1")
    daemon.starves()  # the launcher has detected the stall
    os.kill(loop, signal.SIGCONT)
    daemon.feeds()
    (daemon.folder / "fault").touch()
    assert daemon.line("told")["told"] == "fault: left: too fast", "no earlier notice"


def test_a_loop_that_turns_again_gets_its_time_to_end(start: Start) -> None:
    daemon = start({"stalled_s": 2.0, "stopping_s": 4.0})
    daemon.line("ready")
    os.kill(daemon.pid("loop"), signal.SIGSTOP)
    assert "has run no cycle" in daemon.line("told")["told"]
    daemon.process.terminate()
    os.kill(daemon.pid("loop"), signal.SIGCONT)
    assert daemon.line("reason")["reason"] == ""
    assert daemon.ends() == 0
    assert daemon.log() == ["loop stopped", "service stopped"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_request_to_end_cuts_power_immediately(
    start: Start, number: signal.Signals
) -> None:
    daemon = start({"stopping_s": 600.0, "lowering_s": 20.0, "same_press_s": SAME_PRESS_S})
    daemon.line("ready")
    daemon.process.send_signal(number)
    daemon.process.send_signal(
        number
    )  # repeated by a parent program, it counts as the same request
    told = daemon.line("told")["told"]
    assert "the platform is lowered" in told
    assert "up to 50 s" in told
    assert "Press Ctrl-C again to remove the power immediately" in told
    time.sleep(1.5 * SAME_PRESS_S)
    daemon.process.send_signal(signal.SIGHUP)  # a closing terminal does not count as second request
    time.sleep(0.5)
    assert not (daemon.folder / "log").exists()
    daemon.process.send_signal(number)
    assert daemon.line("told")["told"] == "the power is removed now"
    assert "the power was removed" in daemon.line("reason")["reason"]
    assert daemon.ends() == 1
    assert daemon.log() == ["power taken", "loop stopped", "service stopped"]


def test_an_error_of_the_launcher_leaves_the_loop_time_to_lower(start: Start) -> None:
    plan = {"mistake": "in the middle of it", "stopping_s": 3.0, "lowering_s": 30.0, "stop_s": 1.0}
    daemon = start(plan)
    daemon.line("ready")
    daemon.process.terminate()  # the launcher then fails while printing
    assert daemon.ends() == 1
    assert daemon.log() == ["loop stopped", "service stopped"]


def test_the_loop_ends_first_if_the_service_cannot_be_started(start: Start) -> None:
    daemon = start({"no_service": True, "stopping_s": 1.0})
    assert daemon.ends() == 1
    assert daemon.log() == ["loop stopped"]
    assert not (daemon.folder / "control.launcher").exists()


def test_a_socket_of_another_process_does_not_make_the_daemon_ready(
    start: Start, tmp_path: Path
) -> None:
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(tmp_path / "control.sock"))
        other.listen()
        daemon = start({"refuse_service": 1})
        assert daemon.process.stdout is not None
        told = [json.loads(line) for line in daemon.process.stdout]
    assert not any("ready" in line for line in told)
    assert "the service could not start" in told[-1]["reason"]
    assert daemon.ends() == 1


def test_the_robot_is_locked_until_the_loop_of_a_killed_launcher_has_ended(start: Start) -> None:
    daemon = start({"stopping_s": 2.0})
    daemon.line("ready")
    loop, control = daemon.pid("loop"), daemon.folder / "control.sock"
    with pytest.raises(BadInputError, match=f"already runs there, process {daemon.process.pid};"):
        LauncherLock(control)
    daemon.process.kill()
    daemon.process.wait()
    assert _is_child(loop)
    end = time.monotonic() + TIMEOUT_S
    while time.monotonic() < end:
        with suppress(BadInputError), LauncherLock(control):
            assert not _is_child(loop)
            assert not LoopFile.beside(control).exists()  # the file named the loop that has ended
            return
    raise AssertionError("the robot stays locked")


def test_a_private_file_names_the_running_loop_which_ends_before_the_service(start: Start) -> None:
    daemon = start({"stopping_s": 0.5})
    assert daemon.line("ready")["ready"]["state"] == "ready"
    daemon.heard("READY=1")
    path = daemon.folder / "control.loop"
    named = LoopFile.read(path)
    assert (named.pid, named.drives_stop_s) == (daemon.pid("loop"), 0.2)
    assert path.stat().st_mode & 0o777 == 0o600
    pidfd = named.open()
    assert pidfd is not None
    os.close(pidfd)
    # a different process with the same pid does not match
    assert named.model_copy(update={"started": named.started + 1}).open() is None
    daemon.process.terminate()
    assert daemon.ends() == 0
    # the recording contains the whole controlled stop
    assert daemon.log() == ["loop stopped", "service stopped"]
    assert named.open() is None
    assert not path.exists()


def test_a_daemon_that_cannot_write_its_loop_file_ends_before_it_is_ready(start: Start) -> None:
    def in_the_way(folder: Path) -> None:
        (folder / "control.loop").mkdir()
        (folder / "control.loop.new").mkdir()  # this name is not used

    daemon = start(before=in_the_way)
    reason = daemon.line("reason")["reason"]
    path = daemon.folder / "control.loop"
    assert reason == f"{path}: cannot be written, for `cdpr estop`: Is a directory"
    assert daemon.ends() == 2
    # the service is ended too, maybe before it has started
    assert "loop stopped" in daemon.log()
    assert set(daemon.log()) <= {"loop stopped", "service stopped"}
    assert not list(daemon.folder.glob(".control*"))


def test_a_file_of_another_daemon_is_not_removed(start: Start) -> None:
    daemon = start()
    daemon.line("ready")
    path = daemon.folder / "control.loop"
    other = LoopFile.read(path).model_copy(update={"pid": os.getpid()})
    other.write(path)
    daemon.process.terminate()
    assert daemon.ends() == 0
    assert LoopFile.read(path) == other


def test_ending_the_daemon_while_the_loop_loads_succeeds(start: Start) -> None:
    daemon = start({"loading_s": 30.0})
    until((daemon.folder / "loop.pid").exists, TIMEOUT_S)
    daemon.process.terminate()
    assert daemon.line("reason")["reason"] == ""
    assert daemon.ends() == 0


@pytest.mark.parametrize("status", [1, 2])
def test_a_loop_that_cannot_start_ends_the_daemon_with_its_status(
    start: Start, status: int
) -> None:
    daemon = start({"refuse": status})
    assert "could not start" in daemon.line("reason")["reason"]
    assert daemon.ends() == status


@pytest.mark.parametrize(("status", "times"), [(1, 4), (2, 1)])
def test_a_service_that_cannot_start_ends_the_daemon_after_retries(
    start: Start, status: int, times: int
) -> None:
    daemon = start({"refuse_service": status})
    assert "the service could not start" in daemon.line("reason")["reason"]
    assert daemon.ends() == status
    assert daemon.log().count("service refused") == times


@pytest.mark.parametrize("why", ["", "node 1: does not confirm that its power stage is off"])
def test_a_loop_that_was_shut_down_ends_the_daemon_without_reporting_it_dead(
    start: Start, why: str
) -> None:
    daemon = start({"unconfirmed": why})
    daemon.line("ready")
    (daemon.folder / "shutdown").touch()
    assert daemon.line("reason")["reason"] == why
    assert daemon.ends() == bool(why)
    assert daemon.log() == ["loop stopped", "service stopped"]


def test_loop_and_service_end_after_their_launcher_was_killed(start: Start) -> None:
    daemon = start()
    daemon.line("ready")
    loop, service = daemon.pid("loop"), daemon.pid("service")
    daemon.process.kill()
    until(lambda: not _is_child(loop), TIMEOUT_S)
    until(lambda: not _is_child(service), TIMEOUT_S)
    assert sorted(daemon.log()) == ["loop stopped", "service stopped"]
