"""Clients that are too many, ask too much, or mean no good: over real sockets."""

from __future__ import annotations

import asyncio
import logging
import os
import resource
import select
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from cdpr_rt.service.http import acceptor, access_control, connections, server
from cdpr_rt.service.http.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.http.tickets import Tickets
from cdpr_rt.service.listening import listen_unix
from tests.cdpr_rt.service.http.service_rig import KEY, Rig, raw, reachable, wait_for

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


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
    """Open connections that say nothing."""
    opened = []
    for _ in range(most):
        opened.append(
            socket.socket(socket.AF_UNIX if kind == "unix" else socket.AF_INET, socket.SOCK_STREAM)
        )
        opened[-1].settimeout(60.0)
        opened[-1].connect(str(rig.socket) if kind == "unix" else ("127.0.0.1", rig.guarded_port))
    return opened


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_connections_that_ask_nothing_make_room_for_those_that_do(
    rig: Rig, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # none leaves by itself
    monkeypatch.setattr(server, "_REQUEST_S", 3600.0)
    monkeypatch.setattr(acceptor, "_PENDING_S", 3600.0)
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
    wait_for(lambda: reachable(rig))


def test_no_more_who_say_nothing_are_kept_than_need_be(rig: Rig) -> None:
    """The oldest of them leave first."""
    silent = _idle(rig, "unix", acceptor.MOST_PENDING + 10)
    try:
        assert all(_ended(sock) for sock in silent[:10])
        silent[-1].sendall(b"GET /status HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert silent[-1].recv(100).startswith(b"HTTP/1.1 200")
    finally:
        for sock in silent:
            sock.close()
    wait_for(lambda: reachable(rig))


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_connections_that_have_had_their_answer_make_room(rig: Rig, kind: str) -> None:
    more = 6
    kept = _idle(rig, kind, connections.MOST_OF_PEER + more)
    try:
        for sock in kept:
            sock.sendall(b"HEAD /status HTTP/1.1\r\nHost: localhost\r\n\r\n")
            head = b""
            while not head.endswith(b"\r\n\r\n"):
                head += (part := sock.recv(4096))
                assert part, head
        assert all(_ended(sock) for sock in kept[:more])
        for sock in kept[more:]:
            sock.setblocking(False)
            with pytest.raises(BlockingIOError):
                sock.recv(1)
    finally:
        for sock in kept:
            sock.close()
    wait_for(lambda: reachable(rig))


def test_where_every_place_is_busy_there_is_one_for_a_stop(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.loop.answers = False  # whatever is asked of it is waited for
    asked: list[str] = []
    command = rig.service.link.command

    async def noted(do: str, wait_s: float, **fields: Any) -> Any:
        asked.append(do)
        return await command(do, 10.0 * wait_s, **fields)

    monkeypatch.setattr(rig.service.link, "command", noted)
    key = b"Authorization: Bearer " + KEY
    head = b"POST /check HTTP/1.1\r\nHost: localhost\r\n" + key + b"\r\nContent-Length: 0\r\n\r\n"
    busy = []
    try:
        for _ in range(connections.MOST_OF_PEER):
            busy.append(socket.create_connection(("127.0.0.1", rig.guarded_port)))
            busy[-1].sendall(head)
        wait_for(lambda: len(asked) == connections.MOST_OF_PEER)  # all have had their turn
        status = b"GET /status HTTP/1.1\r\nHost: localhost\r\n" + key + b"\r\n\r\n"
        assert raw(rig, status, 60.0, rig.guarded_port) == b""
        wanted = head.replace(b"/check", b"/hold")
        with socket.create_connection(("127.0.0.1", rig.guarded_port), 60.0) as sock:
            for part in (wanted[:7], wanted[7:]):
                sock.sendall(part)
                time.sleep(0.1)
            rig.loop.answers = True
            answer = b""
            while not answer.endswith(b"}"):
                answer += sock.recv(4096)
            assert answer.startswith(b"HTTP/1.1 200")
            sock.sendall(status)
            assert _ended(sock)  # the place was for a stop, and for nothing else
    finally:
        for sock in busy:
            sock.close()
    assert {command["do"] for command in rig.loop.commands} == {"check", "hold"}
    wait_for(lambda: reachable(rig))


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


def test_wrong_keys_from_the_same_address_do_not_shut_out_the_right_one(rig: Rig) -> None:
    command = [sys.executable, "-c", GUESSING, str(rig.guarded_port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as guessing:
        try:
            assert guessing.stdout is not None
            assert guessing.stdout.readline()
            for _ in range(10):
                asked = httpx.post(
                    f"{rig.guarded_url}/control", json={"client": "a", "ttl_s": 10.0}, headers=RIGHT
                )
                token = asked.json()["token"]
                mine = {**RIGHT, "X-Control-Token": token}
                assert httpx.delete(f"{rig.guarded_url}/control", headers=mine).status_code == 200
        finally:
            guessing.kill()


def test_a_head_that_comes_in_parts_shows_the_key_too(rig: Rig) -> None:
    parts = (
        f"GET /control HTTP/1.1\r\nHost: localhost\r\nauthorization: Bearer {KEY.decode()}",
        "\r\n\r\n",
    )
    with socket.create_connection(("127.0.0.1", rig.guarded_port), 60.0) as sock:
        for part in parts:
            sock.sendall(part.encode())
            time.sleep(0.1)
        assert sock.recv(100).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize("sent", [b"", b"GET /sta", b"GET /status HTTP/1.1\r\nHost: local"])
def test_a_connection_that_asks_nothing_is_ended(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, sent: bytes
) -> None:
    monkeypatch.setattr(server, "_REQUEST_S", 0.2)
    monkeypatch.setattr(server, "_LOOK_S", 0.1)
    monkeypatch.setattr(acceptor, "_PENDING_S", 0.2)
    assert raw(rig, sent, 3600.0) == b""


def test_an_answer_that_is_not_taken_is_given_up(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_ANSWER_S", 0.5)
    monkeypatch.setattr(server, "_REQUEST_S", 0.5)
    monkeypatch.setattr(server, "_LOOK_S", 0.1)
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
def test_a_websocket_that_is_not_understood_takes_no_place(rig: Rig, head: str) -> None:
    upgrade = (
        f"GET /control{head}\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", rig.port), 60.0) as sock:
        sock.sendall(upgrade.encode())
        assert sock.recv(65536).startswith(b"HTTP/1.1 400 ")
        assert sock.recv(65536) == b""


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
def test_what_is_no_request_does_nothing(
    rig: Rig, text: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    answer = raw(rig, text, 2.0)
    assert not answer.startswith(b"HTTP/1.1 2")
    assert not answer.startswith(b"HTTP/1.1 5")
    assert reachable(rig)
    assert rig.loop.commands == []
    assert [one.getMessage() for one in caplog.records if one.levelno >= logging.ERROR] == []


def test_a_client_that_resets_its_connection_is_forgotten(rig: Rig) -> None:
    for _ in range(50):
        sock = socket.create_connection(("127.0.0.1", rig.port))
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        sock.sendall(b"POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{")
        sock.close()
    assert reachable(rig)


def test_no_descriptors_left_is_said_once_and_serving_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def app(_scope: Any, _add: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    async def serve() -> None:
        listener = listen_unix(tmp_path / "one.sock")
        access = AccessControl(
            app, AccessPolicy(local=True), lambda: None, lambda _token: False, Tickets()
        )
        one = server.Server(access, listener, connections.FairQueue(), told.append)
        serving = asyncio.create_task(one.serve_until_stopped())
        while not one.started:
            await asyncio.sleep(0.01)
        sock.setblocking(False)
        with _no_descriptors():
            sock.connect(str(tmp_path / "one.sock"))
            await asyncio.sleep(1.2)  # tried several times
        loop = asyncio.get_running_loop()
        await loop.sock_sendall(sock, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        assert b" 204 " in await asyncio.wait_for(loop.sock_recv(sock, 100), 60.0)
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
