"""A loop file is trusted only if file and process belong to the same user."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_tools.daemon.estop import EmergencyStop, EmergencyStopResult
from cdpr_tools.daemon.loop_file import LauncherLock, LoopFile, find_loops, started
from cdpr_tools.daemon.paths import find_sockets, is_trusted, unsearched_folders
from cdpr_tools.errors import BadInputError, WorkFailedError

NOBODY = 65534
OBEYS = "import signal, sys; signal.signal(signal.SIGUSR1, print); print(1, flush=True); input()"
DOES_NOT = "print(1, flush=True); input()"
IGNORES = OBEYS.replace("print)", "signal.SIG_IGN)")


def cdpr(*arguments: str | Path, **env: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "cdpr_tools.cli", *map(str, arguments)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, **env},
        stdin=subprocess.DEVNULL,
    )


@pytest.fixture
def process(request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-c", request.param]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as made:
        assert made.stdout is not None
        assert made.stdout.readline() == b"1\n"
        yield made
        made.kill()


def named(of: int, **other: Any) -> dict[str, Any]:
    told = {"robot": "r", "uid": os.geteuid(), "pid": of, "started": started(of)}
    return {**told, "block_fd": 0, "drives_stop_s": 0.2, **other}


def stopped(path: Path) -> EmergencyStopResult:
    with closing(EmergencyStop(path)) as stop:
        return stop.outcome()


def give_away(path: Path) -> None:
    """Give a file to another user. If the tests do not run as root, open it to all instead."""
    if os.geteuid() == 0:
        os.chown(path, NOBODY, NOBODY)
    else:
        path.chmod(0o777)


@pytest.mark.parametrize("process", [DOES_NOT], indirect=True)
def test_a_process_without_signal_handler_is_not_signalled(
    tmp_path: Path, process: subprocess.Popen[bytes]
) -> None:
    path = tmp_path / "r.loop"
    path.write_text(json.dumps(named(process.pid)))
    outcome = stopped(path)
    assert not outcome.confirmed
    assert f"process {process.pid} is not a loop of user {os.geteuid()}" in outcome.text
    assert process.poll() is None


@pytest.mark.parametrize("process", [IGNORES], indirect=True)
def test_a_process_that_ignores_the_signal_counts_as_ended_loop(
    tmp_path: Path, process: subprocess.Popen[bytes]
) -> None:
    path = tmp_path / "r.loop"
    path.write_text(json.dumps(named(process.pid)))
    assert not LoopFile.read(path).runs()
    outcome = stopped(path)
    assert not outcome.confirmed
    assert outcome.text.startswith("its loop has ended; its drives stop within")
    assert process.poll() is None


@pytest.mark.parametrize("process", [OBEYS], indirect=True)
def test_a_loop_file_for_another_users_process_is_not_trusted(
    tmp_path: Path, process: subprocess.Popen[bytes]
) -> None:
    path = tmp_path / "r.loop"
    path.write_text(json.dumps(named(process.pid)))
    found = LoopFile.read(path)
    assert found.runs()
    with pytest.raises(WorkFailedError, match="is not a loop of user 65534"):
        found.model_copy(update={"uid": NOBODY}).runs()
    path.write_text(json.dumps(named(process.pid, uid=NOBODY)))
    with pytest.raises(WorkFailedError, match="does not name a loop: it belongs to user"):
        LoopFile.read(path)
    assert is_trusted(path, os.geteuid())
    assert not is_trusted(path, NOBODY)
    assert not is_trusted(tmp_path / "gone" / "r.loop", NOBODY)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"pid": 10**20}, "allowed: 64 bits"),
        ({"pid": 2**22 + 1}, "less than or equal to 4194304"),
        ({"pid": 1}, "greater than 1"),
        ({"started": -1}, "greater than or equal to 0"),
        ({"drives_stop_s": float("inf")}, "allowed: a finite number"),
        ({"block_fd": 2**63}, "less than or equal to 1048576"),
        ({"more": 1}, "Extra inputs are not permitted"),
        ("[" * 2000, "is nested too deeply"),
        ("{}", "Field required"),
        (" " * 5000, "is not valid JSON"),
    ],
    ids=map(str, range(9)),  # texts contain the pid of the test process
)
def test_a_file_that_no_daemon_wrote_is_rejected_with_a_reason(
    tmp_path: Path, change: str | dict[str, Any], told: str
) -> None:
    path = tmp_path / "r.loop"
    text = change if isinstance(change, str) else json.dumps(named(os.getpid()) | change)
    path.write_text(text)
    outcome = stopped(path)
    assert not outcome.confirmed
    assert told in outcome.text


def test_a_pipe_or_link_instead_of_a_loop_file_is_rejected_immediately(tmp_path: Path) -> None:
    path, other = tmp_path / "r.loop", tmp_path / "other"
    os.mkfifo(path)
    assert "is not a regular file" in stopped(path).text
    path.unlink()
    other.write_text(json.dumps(named(os.getpid())))
    path.symlink_to(other)
    assert "cannot be read" in stopped(path).text


def test_control_characters_in_a_robots_name_are_escaped(tmp_path: Path) -> None:
    path = tmp_path / "r.loop"
    path.write_text(json.dumps(named(os.getpid(), robot="\x1b[2J")))
    assert LoopFile.read(path).robot == r"\x1b[2J"


@pytest.mark.parametrize("process", [OBEYS], indirect=True)
def test_a_runtime_folder_of_another_user_is_not_searched(
    tmp_path: Path, process: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = tmp_path / "cdpr-rt"
    folder.mkdir(mode=0o700)
    (folder / "r.loop").write_text(json.dumps(named(process.pid)))
    assert find_loops("r") == [folder / "r.loop"]
    assert unsearched_folders() == ""
    give_away(folder)
    assert find_loops("r") == find_sockets("r") == []
    for command in (("estop",), ("estop", "r"), ("status",), ("disable",)):
        told = cdpr(*command)
        assert told.returncode == 1
        assert f"{folder} is open to others or not this user's" in told.stderr
        assert "Traceback" not in told.stderr
    assert process.poll() is None


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ("left", True),  # the name of the robot
        ("r", True),  # the name of the socket
        ("right", False),
        ("left.toml", True),
        ("elsewhere/left.toml", False),
    ],
)
def test_a_loop_is_found_by_the_name_or_file_of_its_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: str, found: bool
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "cdpr-rt" / "r.loop"
    path.parent.mkdir(mode=0o700)
    runs = str(tmp_path / "left.toml")
    path.write_text(json.dumps(named(os.getpid(), robot="left", reference=runs)))
    assert find_loops(asked) == [path] * found


def test_shared_memory_of_another_loop_does_not_confirm_power_off(tmp_path: Path) -> None:
    """Only the memory of the signalled loop counts."""
    block = SharedBlock.create(1, 0.1, 100.0)
    block.counters["loop_pid"] = os.getpid()
    command = [sys.executable, "-c", OBEYS]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, pass_fds=[block.fd]
    ) as loop:
        assert loop.stdout is not None and loop.stdout.readline() == b"1\n"
        path = tmp_path / "r.loop"
        path.write_text(json.dumps(named(loop.pid, block_fd=block.fd)))
        outcome = stopped(path)
        loop.kill()
    assert not outcome.confirmed
    assert "the shared memory belongs to another loop" in outcome.text


def test_a_socket_of_another_user_is_rejected(tmp_path: Path) -> None:
    if os.geteuid() == 0:  # only root can create a socket of another user here
        path = tmp_path / "r.sock"
        path.touch()
        os.chown(path, NOBODY, NOBODY)
        told = cdpr("disable", "--socket", path)
        assert told.returncode == 2
        assert f"{path}: belongs to user {NOBODY}, not to you or root" in told.stderr
    told = cdpr("disable", "--socket", tmp_path / "none.sock")
    assert told.returncode == 1
    assert "no daemon answers" in told.stderr


@pytest.mark.parametrize("process", [OBEYS], indirect=True)
def test_a_second_daemon_is_rejected_while_the_service_of_the_first_starts(
    tmp_path: Path, process: subprocess.Popen[bytes]
) -> None:
    run = ("run", "bench-2", "--bus", "simbus:", "--no-record", "--socket")
    told = cdpr(*run, tmp_path / "r.loop")
    assert told.returncode == 2
    assert "r.loop: allowed: a name that ends in .sock" in told.stderr
    (tmp_path / "r.loop").write_text(json.dumps(named(process.pid)))
    told = cdpr(*run, tmp_path / "r.sock")
    assert told.returncode == 2
    assert "a daemon already runs there" in told.stderr


def test_a_lock_remains_until_an_inheriting_process_has_ended(tmp_path: Path) -> None:
    control, file = tmp_path / "control.sock", tmp_path / "control.launcher"
    with LauncherLock(control) as lock:
        child = subprocess.Popen(
            [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=[lock.fd]
        )
    assert file.exists()
    with pytest.raises(BadInputError, match="a daemon already runs there"):
        LauncherLock(control)
    child.communicate(b"\n", timeout=60)
    with LauncherLock(control):
        pass
    assert not file.exists()
