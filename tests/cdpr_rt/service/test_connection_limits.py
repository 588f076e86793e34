"""Too many clients, too many requests and hostile clients, over real sockets."""

from __future__ import annotations

import asyncio
import http.client
import logging
import select
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from waiting import until

from cdpr_rt.service import access_control
from cdpr_rt.service import http_server as server
from cdpr_rt.service.access_control import AccessControl, AccessPolicy, Tickets
from tests.cdpr_rt.service.service_rig import KEY, Rig, raw, reachable

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


def test_a_body_that_is_too_large_is_rejected(rig: Rig) -> None:
    with rig.client() as client:
        assert client.post("/hold", content=b"x" * 16385).status_code == 413
        endless = (b"x" * 4096 for _ in range(1 << 20))
        with pytest.raises(httpx.HTTPError):  # the service closes the connection
            answer = client.post("/hold", content=endless)
            assert answer.status_code == 413
            raise httpx.WriteError("answered early")
    assert rig.loop.commands == []


def test_a_request_whose_body_never_arrives_times_out(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access_control, "_BODY_S", 0.3)
    head = b"POST /hold HTTP/1.1\r\nHost: localhost\r\nContent-Length: 10\r\n\r\n{"
    assert raw(rig, head, 60.0).startswith(b"HTTP/1.1 408")
    assert rig.loop.commands == []


def _ended(sock: socket.socket) -> bool:
    try:
        return sock.recv(100) == b""
    except ConnectionResetError:
        return True


def _idle(rig: Rig, kind: str, most: int) -> list[socket.socket]:
    """Open connections that send nothing."""
    opened = []
    for _ in range(most):
        opened.append(
            socket.socket(socket.AF_UNIX if kind == "unix" else socket.AF_INET, socket.SOCK_STREAM)
        )
        opened[-1].settimeout(60.0)
        opened[-1].connect(str(rig.socket) if kind == "unix" else ("127.0.0.1", rig.guarded_port))
    return opened


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_idle_connections_are_closed_in_favour_of_new_ones(rig: Rig, kind: str) -> None:
    silent = _idle(rig, kind, 80)
    try:
        for _ in range(5):
            ask = rig.client() if kind == "unix" else httpx.Client(base_url=rig.guarded_url)
            with ask as client:
                assert client.get("/status").status_code == 200
                assert client.post("/disable", headers=RIGHT).status_code == 200
            silent += _idle(rig, kind, 20)
    finally:
        for sock in silent:
            sock.close()
    until(lambda: reachable(rig))


@pytest.mark.parametrize("kind", ["unix", "tcp"])
@pytest.mark.parametrize("have_asked", [False, True])
def test_only_a_limited_number_of_idle_connections_per_client_is_kept(
    rig: Rig, kind: str, have_asked: bool
) -> None:
    more = 6
    kept = _idle(rig, kind, server.MOST_IDLE_OF_PEER + more)
    try:
        for sock in kept if have_asked else ():
            with suppress(ConnectionError):  # the service closed it while it was idle
                sock.sendall(b"HEAD /status HTTP/1.1\r\nHost: localhost\r\n\r\n")
                sock.recv(4096)
        until(lambda: sum(map(_has_ended, kept)) == more, 5.0)
    finally:
        for sock in kept:
            sock.close()
    until(lambda: reachable(rig))


def _has_ended(sock: socket.socket) -> bool:
    poll = select.poll()
    poll.register(sock, select.POLLRDHUP | select.POLLHUP)
    return bool(poll.poll(0))


def test_waiting_requests_of_one_client_block_neither_others_nor_its_stop(rig: Rig) -> None:
    rig.loop.answers = False  # so that each request waits
    head = (
        b"POST /check HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer "
        + KEY
        + b"\r\nContent-Length: 0\r\n\r\n"
    )
    busy: list[socket.socket] = []
    try:
        while not (busy and select.select([busy[-1]], [], [], 0.1)[0]):
            busy.append(socket.create_connection(("127.0.0.1", rig.guarded_port)))
            busy[-1].sendall(head)
            assert len(busy) < 100
        assert busy[-1].recv(100).startswith(b"HTTP/1.1 429")
        with rig.client() as other:
            assert other.get("/events").status_code == 200
        asking = ThreadPoolExecutor(1)
        stop = asking.submit(httpx.post, f"{rig.guarded_url}/hold", headers=RIGHT, timeout=60.0)
        until(lambda: int(rig.block.counters["urgent"][0]) > 0)
        rig.loop.answers = True
        assert stop.result(60.0).status_code == 200
    finally:
        for sock in busy:
            sock.close()
    until(lambda: reachable(rig))


GUESSING = """
import asyncio, sys; tried = []
ASKS = (b"POST /control HTTP/1.1\\r\\nHost: localhost\\r\\nAuthorization: Bearer x\\r\\n"
        b"Content-Length: 2\\r\\n\\r\\n{}")
async def guess():
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", int(sys.argv[1]))
            writer.write(ASKS)
            tried.append(1)
            len(tried) == 500 and print(flush=True)
            await reader.read(100)
            writer.close()
        except OSError: pass
async def guess_all():
    await asyncio.gather(*(guess() for _ in range(100)))
asyncio.run(guess_all())
"""


def test_wrong_keys_from_the_same_address_do_not_block_the_right_one(rig: Rig) -> None:
    command = [sys.executable, "-c", GUESSING, str(rig.guarded_port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as guessing:
        try:
            assert guessing.stdout is not None
            assert guessing.stdout.readline()
            for _ in range(3):
                asked = httpx.post(
                    f"{rig.guarded_url}/control", json={"client": "a", "ttl_s": 10.0}, headers=RIGHT
                )
                token = asked.json()["token"]
                mine = {**RIGHT, "X-Control-Token": token}
                assert httpx.delete(f"{rig.guarded_url}/control", headers=mine).status_code == 200
        finally:
            guessing.kill()


@pytest.mark.parametrize("sent", [b"", b"GET /sta", b"GET /status HTTP/1.1\r\nHost: local"])
def test_an_idle_connection_is_closed(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, sent: bytes
) -> None:
    monkeypatch.setattr(server, "IDLE_S", 0.2)
    assert raw(rig, sent, 3600.0) == b""


def test_an_answer_that_the_client_does_not_read_is_abandoned(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "ANSWER_S", 0.5)
    with socket.socket(socket.AF_UNIX) as sock:
        sock.connect(str(rig.socket))
        sock.sendall(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)
        poll = select.poll()
        poll.register(sock, select.POLLHUP)
        assert poll.poll(60_000.0)
        taken = 0
        while chunk := sock.recv(1 << 16):
            taken += len(chunk)
        assert taken < 100 * len(rig.client().get("/openapi.json").content) / 2


@pytest.mark.parametrize(
    "head", ["?" + 2500 * "a=1&" + " HTTP/1.1", " HTTP/1.1" + 300 * "\r\nA: b"]
)
def test_a_websocket_with_an_oversized_head_is_closed(
    rig: Rig, head: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "IDLE_S", 0.2)
    upgrade = (
        f"GET /control{head}\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", rig.port), 60.0) as sock:
        sock.sendall(upgrade.encode())
        assert _ended(sock)


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
        b"POST /enable HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"GET /status HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"POST /hold HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
        b"POST /disable HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"CONNECT 10.0.0.1:80 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /live HTTP/1.1\r\nHost: a\r\nConnection: upgrade\r\nUpgrade: websocket\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ],
)
def test_malformed_requests_have_no_effect(
    rig: Rig, text: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    answer = raw(rig, text, 2.0)
    assert not answer.startswith(b"HTTP/1.1 2")
    assert not answer.startswith(b"HTTP/1.1 5")
    assert reachable(rig)
    assert rig.loop.commands == []
    assert [one.getMessage() for one in caplog.records if one.levelno >= logging.ERROR] == []


def test_reset_connections_do_not_use_up_the_limit(rig: Rig) -> None:
    for _ in range(50):
        sock = socket.create_connection(("127.0.0.1", rig.port))
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        sock.sendall(b"POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{")
        sock.close()
    assert reachable(rig)


# Limits of requests.


def test_a_flood_of_requests_is_limited_and_a_stop_still_accepted(rig: Rig) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", rig.port, timeout=10.0)
    answers = set()
    while 429 not in answers:
        connection.request("GET", "/control")
        answer = connection.getresponse()
        answer.read()
        answers.add(answer.status)
        if answer.getheader("connection") == "close":
            connection.close()
    assert httpx.post(f"{rig.url}/hold").status_code == 200
    with rig.client() as client:  # its user's own clients are not limited
        assert client.get("/control").status_code == 200


def test_a_flood_does_not_block_the_holder_of_the_right_at_the_same_address(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(access_control, "time", SimpleNamespace(monotonic=lambda: 0.0))
    ask = _asking("the token".__eq__, AccessPolicy())

    async def flood() -> list[int]:
        while await ask() != 429:
            pass
        return [await ask(x_control_token=token) for token in ("another", "the token")]

    assert asyncio.run(flood()) == [429, 200]


@pytest.mark.parametrize("path", sorted(access_control.STOP_PATHS))
def test_only_stops_are_exempt_from_the_request_limit(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access_control, "time", SimpleNamespace(monotonic=lambda: 0.0))
    ask = _asking(lambda _token: False, AccessPolicy(key=KEY))

    async def flood() -> list[int]:
        for _ in range(1000):
            if await ask("GET", path) == 429:
                break
        others = [await ask(method, path) for method in ("GET", "HEAD", "PUT", "OPTIONS")]
        return [*others, await ask("POST", path)]

    assert asyncio.run(flood()) == [429, 429, 429, 429, 200]


def _asking(
    holds_right: Callable[[str], bool], policy: AccessPolicy
) -> Callable[..., Coroutine[Any, Any, int]]:
    """Return a function that sends a request with the key and returns the answer's status."""

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    access = AccessControl(app, policy, lambda: None, holds_right, Tickets(), lambda: 0)

    async def ask(method: str = "GET", path: str = "/control", **headers: str) -> int:
        sent: list[dict[str, Any]] = []

        async def send(message: Any) -> None:
            sent.append(message)

        headers = {"host": "localhost", "authorization": RIGHT["Authorization"], **headers}
        given = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
        scope = {"type": "http", "method": method, "path": path, "headers": given, "state": {}}
        await access({**scope, "client": ("10.0.0.1", 1)}, receive, send)
        return int(sent[0]["status"])

    return ask
