"""Commands wait for a starting daemon without socket, but not for one that nobody starts."""

from __future__ import annotations

import os
import signal
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler
from pathlib import Path

import pytest
from typing_extensions import override

from cdpr_tools.client.client import await_socket, open_daemon
from cdpr_tools.daemon.loop_file import LauncherLock, launcher_loads, launcher_pid, started
from cdpr_tools.daemon.paths import LAUNCHER_SUFFIX, default_socket
from cdpr_tools.errors import NoDaemonError
from cdpr_tools.output import Output
from tests.cdpr_here import cdpr_here


@pytest.fixture
def path(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the future path of the socket of the daemon `mine`, in a short folder."""
    with tempfile.TemporaryDirectory(prefix="cdpr-") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield default_socket("mine")


def where(robot: str) -> str:
    with open_daemon(robot, None, None, None) as daemon:
        return daemon.where


class ComesUp(Output):
    """Create the socket as soon as a command reports that it waits."""

    def __init__(self, path: Path) -> None:
        super().__init__(as_json=True)
        self.path, self.told = path, list[str]()
        self.server = socket.socket(socket.AF_UNIX)

    @override
    def note(self, text: str) -> None:
        self.told.append(text)
        self.server.bind(str(self.path))
        self.server.listen()


@pytest.mark.parametrize("named", [True, False])
def test_a_command_waits_for_a_daemon_whose_launcher_runs(path: Path, named: bool) -> None:
    out = ComesUp(path)
    with LauncherLock(path), out.server:
        await_socket("mine" if named else None, None if named else path, out)
    assert out.told == [
        "the daemon is still starting: its simulated drives and processes are starting ..."
    ]
    assert not path.with_suffix(LAUNCHER_SUFFIX).exists()


def test_a_command_does_not_wait_without_a_launcher(path: Path) -> None:
    out = ComesUp(path)
    await_socket(None, None, out)
    mark = path.with_suffix(LAUNCHER_SUFFIX)
    mark.write_text(f"{os.getpid()} {started(os.getpid()) - 1}")  # another process has this pid now
    await_socket("mine", None, out)
    mark.write_text("no process")
    await_socket("mine", None, out)
    mark.unlink()
    os.mkfifo(mark)
    assert launcher_pid(mark) is None
    assert out.told == []


def test_a_command_waits_for_a_launcher_that_still_loads_its_program(path: Path) -> None:
    script = path.parent / "cdpr"
    script.write_text(
        "import sys\n"
        "for line in sys.stdin:\n"
        "    file = open(line.strip(), 'w')\n"
        "    print(flush=True)\n"
    )
    command = [sys.executable, "-P", str(script), "run", "mine"]
    with subprocess.Popen(
        command, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as loading:
        assert loading.stdin is not None and loading.stdout is not None
        assert not launcher_loads("another", None)
        assert not launcher_loads(None, path)
        with pytest.raises(NoDaemonError, match="mine is starting, or ending"):
            where("mine")
        out = ComesUp(path)
        with out.server:
            await_socket(None, None, out)
        assert len(out.told) == 1
        path.unlink()
        print(path.with_suffix(LAUNCHER_SUFFIX), file=loading.stdin, flush=True)
        loading.stdout.readline()
        assert not launcher_loads(None, None)


class StillStarting(BaseHTTPRequestHandler):
    """Answer like the service of a daemon whose loop is still loading."""

    def do_GET(self) -> None:
        content = b'{"state": "starting"}'
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    @override
    def log_message(self, *_: object) -> None:
        pass

    @override
    def address_string(self) -> str:
        return ""


@pytest.mark.parametrize("answers", [False, True])
def test_stop_ends_a_starting_daemon(path: Path, answers: bool) -> None:
    if answers:
        server = socketserver.UnixStreamServer(str(path), StillStarting)
        threading.Thread(target=server.serve_forever, daemon=True).start()
    starts = (
        "import signal, sys; from pathlib import Path\n"
        "from cdpr_tools.daemon.loop_file import LauncherLock\n"
        "lock = LauncherLock(Path(sys.argv[1])); print(flush=True); signal.pause()"
    )
    command = [sys.executable, "-c", starts, path]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as launcher:
        assert launcher.stdout is not None and launcher.stdout.readline()
        done = cdpr_here("stop", "--robot", "mine")
        launcher.kill()
    assert (done.returncode, done.stdout) == (0, "mine: its daemon was starting; it has ended\n")
    assert launcher.returncode == -signal.SIGTERM
    if answers:
        server.shutdown()
        server.server_close()
        path.unlink()
    assert cdpr_here("stop", "--robot", "mine").stdout == "nothing runs\n"
