"""How a command selects a daemon and parses its input."""

from __future__ import annotations

import json
import os
import pwd
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest

from cdpr_profiles.errors import ProfileError
from cdpr_tools.cli import main
from cdpr_tools.client.client import Daemon, axis_values, key_values, open_daemon
from cdpr_tools.commands.path import robot_by_name
from cdpr_tools.daemon.loop_file import LauncherLock
from cdpr_tools.errors import BadInputError, ConnectionLostError, NoDaemonError
from tests.cdpr_here import cdpr_here


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    path = tmp_path / "cdpr-rt"
    path.mkdir(mode=0o700)
    return path


@pytest.fixture
def listening(folder: Path) -> Iterator[list[Path]]:
    with ExitStack() as stack:
        paths = [folder / f"{name}.sock" for name in ("left", "right")]
        for path in paths:
            sock = stack.enter_context(socket.socket(socket.AF_UNIX))
            sock.bind(str(path))
            sock.listen()
        yield paths


def where(robot: str | None) -> str:
    with open_daemon(robot, None, None, None) as daemon:
        return daemon.where


def test_several_running_daemons_require_a_name(listening: list[Path]) -> None:
    with pytest.raises(BadInputError, match=r"choose one by --robot \(left, right\)"):
        where(None)
    assert where("right") == str(listening[1])


@pytest.mark.parametrize(
    ("words", "hint"), [(("status", "planar-3"), True), (("run", "planar-3", "more"), False)]
)
def test_a_robot_given_as_argument_gets_a_hint_at_the_option(
    words: tuple[str, ...], hint: bool
) -> None:
    told = " ".join(cdpr_here(*words).stderr.split())
    assert "unexpected extra argument" in told
    assert ("name the robot with --robot" in told) == hint


def test_files_of_a_killed_daemon_are_ignored(listening: list[Path], folder: Path) -> None:
    listening[0].unlink()
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(folder / "dead.sock"))
    assert where(None) == str(listening[1])
    with pytest.raises(NoDaemonError, match="no daemon runs for dead"):
        where("dead")
    starting = pytest.raises(NoDaemonError, match="the daemon for dead is starting, or ending")
    with LauncherLock(folder / "dead.sock"), starting:
        where("dead")


@contextmanager
def running(path: Path, reference: str) -> Iterator[None]:
    """Run a stand-in for a daemon that reports its robot to one command."""
    body = b'{"reference": "%s"}' % reference.encode()
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(body)

    def serve() -> None:
        listener.accept()[0].close()  # the check whether it is alive
        with listener.accept()[0] as caller:
            assert caller.recv(4096).startswith(b"GET /description")
            caller.sendall(head + body)

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()
        thread = threading.Thread(target=serve)
        thread.start()
        yield
        thread.join()
    path.unlink()


def test_a_file_selects_the_daemon_of_its_name_only_if_it_runs_that_file(folder: Path) -> None:
    own, others = folder / "mine.toml", folder / "elsewhere" / "mine.toml"
    with running(folder / "mine.sock", str(own)):
        assert where(str(own)) == str(folder / "mine.sock")
    refused = pytest.raises(BadInputError, match="the daemon of this name runs")
    with running(folder / "mine.sock", str(own)), refused:
        where(str(others))


def test_a_robot_is_found_by_the_name_of_its_daemon(folder: Path) -> None:
    with running(folder / "mine.sock", "planar-3"):
        assert robot_by_name("mine").profile == "planar-3"
    with pytest.raises(ProfileError, match="no profile named 'mine'"):
        robot_by_name("mine")


@pytest.mark.parametrize(("path", "tries"), [("/hold", 3), ("/disable", 3), ("/check", 1)])
def test_an_interrupted_stop_request_is_repeated(
    listening: list[Path], path: str, tries: int
) -> None:
    """Two connections are closed before the answer, as if there were too many."""
    asked: list[bytes] = []
    body = b'{"text": "", "state": "active"}'
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(body)

    def serve() -> None:
        for number in range(tries):
            connection, _ = served.accept()
            with connection:
                asked.append(connection.recv(1 << 16).split(b"\r\n")[0])
                if number == 2:
                    connection.sendall(head + body)

    place = listening[0].with_name("cut.sock")
    with socket.socket(socket.AF_UNIX) as served, open_daemon(None, place, None, None) as daemon:
        served.bind(str(place))
        served.listen()
        thread = threading.Thread(target=serve)
        thread.start()
        if tries > 1:
            assert daemon.post(path)["state"] == "active"
        else:
            with pytest.raises(ConnectionLostError):
                daemon.post(path)
        thread.join()
    assert asked == [f"POST {path} HTTP/1.1".encode()] * tries


def test_error_without_a_daemon_mentions_cdpr_run(folder: Path) -> None:
    with pytest.raises(NoDaemonError, match="cdpr run ROBOT"):
        where(None)


def test_mutually_exclusive_options_are_rejected() -> None:
    with pytest.raises(BadInputError, match="--url"), open_daemon("a", None, "http://x", None):
        pass


AXES: list[dict[str, Any]] = [{"name": "left"}, {"name": "x=y"}]


def test_numbers_are_assigned_to_axes_by_name() -> None:
    assert axis_values(["left=-2.5", "x=y=3"], AXES, "deg") == {0: -2.5, 1: 3.0}
    assert axis_values(["7"], AXES[:1], "deg") == {0: 7.0}
    with pytest.raises(BadInputError, match="left=3: left is given twice"):
        axis_values(["left=2", "left=3"], AXES, "deg")


@pytest.mark.parametrize("text", ["7", "left", "left=", "up=1", "left=1,5", "=1", ""])
def test_invalid_axis_values_are_rejected_with_the_allowed_form(text: str) -> None:
    with pytest.raises(BadInputError, match="deg"):
        axis_values([text], AXES, "deg")


def test_values_are_parsed_as_json() -> None:
    assert key_values(["a=1.5", "b=[1, null]", 'c="x=y"']) == {"a": 1.5, "b": [1, None], "c": "x=y"}


@pytest.mark.parametrize("text", ["a", "=1", "a=", "a=x", "a=[1", "a=NaN", "a=[1, -Infinity]"])
def test_malformed_json_is_rejected(text: str) -> None:
    with pytest.raises(BadInputError, match=r"^a|^=1"):
        key_values([text])


def test_a_command_waits_for_a_starting_daemon(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    states = ["starting", "starting", "unconfigured", "inactive", "ready"]
    asked: list[str] = []

    class Answering(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            asks_state = self.path == "/status"
            answer = {"state": states.pop(0), "reason": ""} if asks_state else {"programs": []}
            text = json.dumps(answer).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        def log_message(self, *_: Any) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        url = f"http://127.0.0.1:{server.server_port}"
        monkeypatch.setattr(sys, "argv", ["cdpr", "tighten", "--url", url])
        try:
            with pytest.raises(SystemExit) as ended:
                main()
        finally:
            server.shutdown()
            thread.join()
    told = capsys.readouterr().err
    assert asked == ["/status"] * 5 + ["/description"] and ended.value.code == 2
    assert told.count("the daemon is still starting: its control loop is loading") == 1


def test_a_user_without_a_name_can_send_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(uid: int) -> None:
        raise KeyError(f"getpwuid(): uid not found: {uid}")

    for variable in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    with httpx.Client() as http:
        assert Daemon(http, "here").name.startswith(f"#{os.getuid()}@")
