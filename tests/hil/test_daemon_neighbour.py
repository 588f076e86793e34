"""Another user of the machine can neither stop, read nor control a real daemon.

If root runs the tests, attempts are made as uid 65534 without groups. Otherwise no other user is
available: then owner and permissions of files are checked instead.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from daemon_lab import KEY, with_key
from daemon_rig import RealDaemon, cdpr
from test_daemon_stream import port_of
from waiting import until

from cdpr_rt.loop.stop_socket import send_stop
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile

NOBODY = 65534
IS_ROOT = os.geteuid() == 0


@pytest.fixture(scope="module")
def daemon() -> Iterator[RealDaemon]:
    """Yield a daemon whose files are in a folder that all users may read."""
    folder = Path(tempfile.mkdtemp(prefix="cdpr-neighbour-"))
    folder.chmod(0o755)
    before = os.umask(0o000)
    try:
        options = ("--stream", "127.0.0.1:0", "--live", "0", "--record", str(folder / "rec"))
        made = RealDaemon(folder, *with_key(folder), *options)
        try:
            yield made
        finally:
            assert made.end() == 0, made.errors()
    finally:
        os.umask(before)
        shutil.rmtree(folder)


def as_nobody(attempt: Callable[[], object]) -> str:
    """Return the result of `attempt` as an unprivileged user, or the name of its error."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            if IS_ROOT:
                os.setgroups([])
                os.setresgid(NOBODY, NOBODY, NOBODY)
                os.setresuid(NOBODY, NOBODY, NOBODY)
            told = repr(attempt())
        except BaseException as error:
            told = type(error).__name__
        os.write(writer, told.encode()[:4000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        told = pipe.read().decode()
    os.waitpid(pid, 0)
    return told


def is_denied(path: Path, attempt: Callable[[], object]) -> bool:
    """Return whether another user is denied what `path` gives access to."""
    if IS_ROOT:
        return as_nobody(attempt) == "PermissionError"
    held = path.stat()
    return held.st_uid == os.geteuid() and not held.st_mode & 0o077


def connect(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as sock:
        sock.connect(str(path))


def ask_to_hold(path: Path) -> None:
    send_stop(path, "hold", "nobody", 5.0)


def loop_of(daemon: RealDaemon) -> LoopFile:
    return LoopFile.read(daemon.socket.with_suffix(".loop"))


def test_files_and_sockets_of_the_daemon_are_closed_to_other_users(daemon: RealDaemon) -> None:
    folder = daemon.socket.parent
    until(lambda: any((folder / "rec").iterdir()))
    (recording,) = (folder / "rec").iterdir()
    assert is_denied(daemon.socket, lambda: connect(daemon.socket))
    stops = daemon.socket.with_suffix(".stop")
    assert is_denied(stops, lambda: ask_to_hold(stops))
    for path in (recording, daemon.socket.with_suffix(".loop"), folder / "key"):
        assert is_denied(path, path.read_bytes), path
    assert is_denied(folder / "rec", lambda: list((folder / "rec").iterdir()))


def test_other_users_can_neither_signal_nor_inspect_the_daemons_processes(
    daemon: RealDaemon,
) -> None:
    loop = loop_of(daemon)
    for pid in (loop.pid, daemon.children()["service"], daemon.process.pid):
        proc = Path(f"/proc/{pid}")
        for number in (POWER_OFF_SIGNAL, signal.SIGTERM, signal.SIGKILL):
            assert is_denied(proc / "environ", lambda p=pid, n=number: os.kill(p, n))
        for name in ("environ", "mem"):
            assert is_denied(proc / name, (proc / name).read_bytes)
        assert is_denied(proc / "fd", lambda p=proc: list((p / "fd").iterdir()))
        # all users may read this: it does not contain the key
        assert KEY not in as_nobody((proc / "cmdline").read_bytes)
    shared = Path(f"/proc/{loop.pid}/fd/{loop.block_fd}")
    assert is_denied(shared.parent, lambda: os.open(shared, os.O_RDONLY))
    assert daemon.status()["state"] == "ready"


def http_port_of(daemon: RealDaemon) -> int:
    return int(until(daemon.status)["parts"]["service"]["http"].rpartition(":")[2])


def bind(kind: socket.SocketKind, port: int) -> None:
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if IS_ROOT:  # the kernel only lets the same user share a port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        sock.bind(("127.0.0.1", port))
        if kind is socket.SOCK_STREAM:
            sock.listen()


def live_port_of(daemon: RealDaemon) -> int:
    return int(until(daemon.status)["parts"]["live_view"]["url"].rpartition(":")[2])


def test_another_user_cannot_take_a_port_while_the_service_restarts(daemon: RealDaemon) -> None:
    http, live, stream = http_port_of(daemon), live_port_of(daemon), port_of(daemon)
    ports = {http: socket.SOCK_STREAM, live: socket.SOCK_STREAM, stream: socket.SOCK_DGRAM}
    service = daemon.children()["service"]

    def take() -> object:
        refused, got, end_s = 0, [], time.monotonic() + 0.5
        while not got and (time.monotonic() < end_s or refused <= 10):
            for port, kind in ports.items():
                try:
                    bind(kind, port)
                    got.append(port)
                except OSError:
                    refused += 1
        return refused > 10, sorted(set(got))

    os.kill(service, signal.SIGKILL)
    until(lambda: "service" not in daemon.children())
    assert as_nobody(take) == "(True, [])"
    # the restarted service answers requests made meanwhile
    with httpx.Client(base_url=f"http://127.0.0.1:{http}") as client:
        assert client.get("/status", timeout=60.0).status_code == 200
    assert [http_port_of(daemon), live_port_of(daemon), port_of(daemon)] == list(ports)
    assert daemon.children()["service"] != service


@pytest.mark.parametrize("option", ["--http", "--stream", "--live"])
def test_a_daemon_does_not_start_if_its_port_is_in_use(
    daemon: RealDaemon, tmp_path: Path, option: str
) -> None:
    ports = {"--http": http_port_of, "--stream": port_of, "--live": live_port_of}
    port = ports[option](daemon)
    at = ("--socket", str(tmp_path / "other.sock"), option, str(port))
    second = cdpr("run", daemon.robot, "--bus", "simbus:", "--no-record", *at)
    assert second.returncode == 1
    assert second.stderr.startswith(f"cdpr: {option}")
    assert second.stderr.endswith(f"{port}: Address already in use\n")
    assert second.stderr.count("\n") == 1
