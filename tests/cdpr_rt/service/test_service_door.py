"""Who is let in, and clients that mean no good: over real sockets."""

from __future__ import annotations

import asyncio
import http.client
import os
import resource
import select
import socket
import stat
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from service_rig import KEY, Rig, running, wait_for

from cdpr_rt.service import auth, server
from cdpr_rt.service.auth import Door, Gate
from cdpr_rt.service.server import ListenError, listen_tcp, listen_unix

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with running(tmp_path_factory.mktemp("door")) as rig:
        yield rig


@pytest.fixture
def rig(shared: Rig) -> Rig:
    shared.reset()
    return shared


def raw(rig: Rig, text: bytes, wait_s: float = 5.0) -> bytes:
    """Send bytes, return what came until the other side closed or paused."""
    with socket.create_connection(("127.0.0.1", rig.port), wait_s) as sock:
        sock.sendall(text)
        sock.settimeout(wait_s)
        try:
            return sock.recv(65536)
        except (TimeoutError, ConnectionResetError):
            return b""


# -- the key


def test_without_the_key_there_is_the_status_and_nothing_else(rig: Rig) -> None:
    with httpx.Client(base_url=rig.guarded_url) as client:
        assert client.get("/status").status_code == 200
        paths = client.get("/openapi.json").json()["paths"]
        asked = 0
        for path, methods in paths.items():
            for method in methods:
                if path == "/status":
                    continue
                answer = client.request(method, path, json={})
                assert answer.status_code == 401, path
                assert answer.headers["www-authenticate"] == "Bearer"
                asked += 1
        assert asked > 12
        assert client.post("/status").status_code == 401
    assert rig.loop.commands == []


@pytest.mark.parametrize(
    "given",
    ["", "Bearer", "Bearer x", f"Basic {KEY.decode()}", f"Bearer {KEY.decode()}x", "Bearer \xe9"],
)
def test_a_wrong_key_opens_nothing(rig: Rig, given: str) -> None:
    headers = {"Authorization": given.encode("latin-1")}
    answer = httpx.post(f"{rig.guarded_url}/hold", headers=headers)
    assert answer.status_code == 401
    assert rig.loop.commands == []


def test_the_key_opens_everything(rig: Rig) -> None:
    assert httpx.post(f"{rig.guarded_url}/hold", headers=RIGHT).status_code == 200
    assert [command["do"] for command in rig.loop.commands] == ["hold"]


# -- pages of others


@pytest.mark.parametrize(
    "host", ["robot.example.com", "127.0.0.1.example.com", "localhost.evil:80", "", "[::1].x"]
)
def test_a_name_that_was_pointed_here_is_not_ours(rig: Rig, host: str) -> None:
    answer = httpx.get(f"{rig.url}/status", headers={"Host": host})
    assert answer.status_code == 403


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "[::1]:99"])
def test_this_machines_own_names_are_ours(rig: Rig, host: str) -> None:
    assert httpx.get(f"{rig.url}/status", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("origin", ["http://example.com", "null", "https://127.0.0.1", ""])
def test_a_page_of_another_host_cannot_even_stop_the_robot(rig: Rig, origin: str) -> None:
    for url, client in ((rig.url, httpx.Client()), ("http://robot", rig.client())):
        with client:
            answer = client.post(f"{url}/hold", headers={"Origin": origin})
            assert answer.status_code == 403
    assert rig.loop.commands == []


def test_a_page_of_our_own_may(rig: Rig) -> None:
    assert httpx.post(f"{rig.url}/hold", headers={"Origin": rig.url}).status_code == 200


# -- too much


def test_a_body_too_large_is_not_taken_in(rig: Rig) -> None:
    with rig.client() as client:
        assert client.post("/hold", content=b"x" * 16385).status_code == 413
        endless = (b"x" * 4096 for _ in range(1 << 20))
        with pytest.raises(httpx.HTTPError):  # the connection is closed in its face
            answer = client.post("/hold", content=endless)
            assert answer.status_code == 413
            raise httpx.WriteError("answered early")
    assert rig.loop.commands == []


def test_a_body_that_never_comes_is_given_up(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(auth, "_BODY_S", 0.3)
    head = b"POST /hold HTTP/1.1\r\nHost: localhost\r\nContent-Length: 10\r\n\r\n{"
    assert raw(rig, head).startswith(b"HTTP/1.1 408")
    assert rig.loop.commands == []


def test_requests_without_end_are_slowed_down_and_a_stop_still_comes_through(rig: Rig) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", rig.port, timeout=10.0)
    answers = set()
    begin = time.monotonic()
    while 429 not in answers:
        connection.request("GET", "/control")
        answer = connection.getresponse()
        answer.read()
        answers.add(answer.status)
        assert time.monotonic() - begin < 20.0
        if answer.getheader("connection") == "close":
            connection.close()
    assert httpx.post(f"{rig.url}/hold").status_code == 200
    with rig.client() as client:  # others have their own measure
        assert client.get("/control").status_code == 200


def test_a_flood_does_not_shut_out_the_one_that_may_move_from_the_same_address(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(auth, "time", SimpleNamespace(monotonic=lambda: 0.0))

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    gate = Gate(app, Door(local=True), lambda: None, "the token".__eq__)

    async def ask(**headers: str) -> int:
        sent: list[dict[str, Any]] = []

        async def send(message: Any) -> None:
            sent.append(message)

        given = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
        scope = {"type": "http", "method": "GET", "path": "/control", "headers": given}
        await gate({**scope, "client": ("10.0.0.1", 1)}, receive, send)
        return int(sent[0]["status"])

    async def flood() -> list[int]:
        while await ask() != 429:
            pass
        return [await ask(x_control_token=token) for token in ("another", "the token")]

    assert asyncio.run(flood()) == [429, 200]


def test_one_that_takes_all_connections_leaves_the_others_theirs(rig: Rig) -> None:
    greedy = [socket.create_connection(("127.0.0.1", rig.port)) for _ in range(60)]
    try:
        closed = 0
        for sock in greedy:
            sock.settimeout(0.05)
            try:
                closed += sock.recv(1) == b""
            except TimeoutError:
                continue
            except ConnectionResetError:
                closed += 1
        assert closed >= 60 - server._MOST_OF_ONE
        with rig.client() as client:
            assert client.get("/status").status_code == 200
    finally:
        for sock in greedy:
            sock.close()
    wait_for(lambda: _reachable(rig))


def _reachable(rig: Rig) -> bool:
    try:
        return httpx.get(f"{rig.url}/status").status_code == 200
    except httpx.HTTPError:
        return False


@pytest.mark.parametrize("sent", [b"", b"GET /sta", b"GET /status HTTP/1.1\r\nHost: local"])
def test_a_connection_that_asks_nothing_is_ended(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, sent: bytes
) -> None:
    monkeypatch.setattr(server, "_REQUEST_S", 0.2)
    monkeypatch.setattr(server, "_LOOK_S", 0.1)
    begin = time.monotonic()
    assert raw(rig, sent, 8.0) == b""
    assert time.monotonic() - begin < 6.0


def test_an_answer_that_is_not_taken_is_given_up(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_ANSWER_S", 0.5)
    monkeypatch.setattr(server, "_REQUEST_S", 0.5)
    monkeypatch.setattr(server, "_LOOK_S", 0.1)
    with socket.socket(socket.AF_UNIX) as sock:
        sock.connect(str(rig.socket))
        sock.sendall(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)
        poll = select.poll()
        poll.register(sock, select.POLLHUP)
        assert poll.poll(8000.0)
        taken = 0
        while chunk := sock.recv(1 << 16):
            taken += len(chunk)
        assert taken < 100 * len(rig.client().get("/openapi.json").content) / 2


@pytest.mark.parametrize(
    "text",
    [
        b"\x00\xff\xfe" * 100,
        b"GET " + b"/" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 10_000 + b"\r\n",
        b"GET /%ff%00%fe HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"POST /hold HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
        b"POST /hold HTTP/1.1\r\nHost: a\r\nHost: b\r\nContent-Length: 2\r\n\r\n{}",
        b"POST /hold HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"POST /hold HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
        b"POST /disable HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"CONNECT 10.0.0.1:80 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /live HTTP/1.1\r\nHost: a\r\nConnection: upgrade\r\nUpgrade: websocket\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ],
)
def test_what_is_no_request_does_nothing(rig: Rig, text: bytes) -> None:
    answer = raw(rig, text, 2.0)
    assert not answer.startswith(b"HTTP/1.1 2")
    assert not answer.startswith(b"HTTP/1.1 5")
    assert _reachable(rig)
    assert rig.loop.commands == []


def test_a_client_that_resets_its_connection_is_forgotten(rig: Rig) -> None:
    for _ in range(50):
        sock = socket.create_connection(("127.0.0.1", rig.port))
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        sock.sendall(b"POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{")
        sock.close()
    assert _reachable(rig)


def test_no_descriptors_left_is_said_once_and_serving_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def app(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    async def serve() -> None:
        server.watch_tables(asyncio.get_running_loop(), told.append)
        one = server.Server(app, listen_unix(tmp_path / "one.sock"))
        serving = asyncio.create_task(one.run_until_told())
        while not one.started:
            await asyncio.sleep(0.01)
        sock.setblocking(False)
        with _no_descriptors():
            sock.connect(str(tmp_path / "one.sock"))
            await asyncio.sleep(1.2)  # asyncio tries once a second
        loop = asyncio.get_running_loop()
        await loop.sock_sendall(sock, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        assert b" 204 " in await asyncio.wait_for(loop.sock_recv(sock, 100), 5.0)
        one.should_exit = True
        await serving

    told: list[str] = []
    with socket.socket(socket.AF_UNIX) as sock:
        asyncio.run(serve())
    assert told == ["no connection more can be taken: Too many open files"]
    assert caplog.text == ""


@contextmanager
def _no_descriptors() -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    free = os.dup(0)
    resource.setrlimit(resource.RLIMIT_NOFILE, (free + 1, limits[1]))
    held = [free]
    with suppress(OSError):
        while True:
            held.append(os.dup(0))
    try:
        yield
    finally:
        for one in held:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


# -- sockets


def test_the_unix_socket_is_for_this_user_only(rig: Rig) -> None:
    assert stat.S_IMODE(rig.socket.stat().st_mode) == 0o600
    assert rig.socket.stat().st_uid == os.getuid()


def test_a_socket_in_use_is_refused_and_one_left_behind_is_replaced(
    rig: Rig, tmp_path: Path
) -> None:
    with pytest.raises(ListenError, match="another daemon listens there"):
        listen_unix(rig.socket)
    left = tmp_path / "left.sock"
    listen_unix(left).close()
    assert left.exists()
    with listen_unix(left):
        assert server._answers(left)


def test_a_file_in_the_sockets_place_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    with pytest.raises(ListenError, match="something else"):
        listen_unix(file)
    assert file.read_text() == "mine"


def test_an_address_in_use_is_named(rig: Rig) -> None:
    with pytest.raises(ListenError, match=f"127.0.0.1:{rig.port}: .*in use"):
        listen_tcp("127.0.0.1", rig.port)
    with pytest.raises(ListenError, match=r"no\.such\.host"):
        listen_tcp("no.such.host.invalid", 1)
