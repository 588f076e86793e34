"""Access control over real sockets."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
import stat
import time
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from waiting import until
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from cdpr_rt.service import access_control
from cdpr_rt.service.access_control import AccessPolicy, is_own_host
from cdpr_rt.service.listening import ListenError, listen_tcp, listen_unix, listener_pid
from tests.cdpr_rt.service.service_rig import KEY, Rig

THROTTLE_S = 0.2
RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


@pytest.fixture
def without_throttling(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests with many wrong requests that do not test delays of answers."""
    monkeypatch.setattr(access_control, "_THROTTLE_S", 0.0)


@pytest.fixture
def throttled(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The delay of each throttled answer, in order."""
    delays_s: list[float] = []

    async def sleep(delay_s: float) -> None:
        if delay_s > 0.0:  # no turn of the event loop
            delays_s.append(delay_s)
        await asyncio.sleep(delay_s)

    noted = SimpleNamespace(sleep=sleep, timeout=asyncio.timeout)
    monkeypatch.setattr(access_control, "asyncio", noted)
    monkeypatch.setattr(access_control, "_THROTTLE_S", THROTTLE_S)
    return delays_s


# -- the key


@pytest.mark.usefixtures("without_throttling")
def test_without_the_key_only_the_status_is_readable(rig: Rig) -> None:
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


@pytest.mark.usefixtures("without_throttling")
def test_without_a_key_file_anyone_may_read_and_stop_only(rig: Rig) -> None:
    with httpx.Client(base_url=rig.url) as client:
        refused = 0
        for path, methods in client.get("/openapi.json").json()["paths"].items():
            for method in methods:
                answer = client.request(method, path, json={})
                if path == "/page-address":
                    assert answer.status_code == 403
                elif method == "get" or path in ("/hold", "/disable"):
                    assert answer.status_code not in (401, 403, 500), path
                else:
                    assert answer.status_code == 401, path
                    assert "--key-file" in answer.json()["error"]
                    refused += 1
        assert refused > 8
    with (
        pytest.raises(InvalidStatus, match="401"),
        connect(f"ws://127.0.0.1:{rig.port}/control?client=x"),
    ):
        pass
    with connect(f"ws://127.0.0.1:{rig.port}/live") as onlooker:
        onlooker.recv()
    assert {command["do"] for command in rig.loop.commands} == {"hold", "disable"}
    assert rig.service.lease.holder() is None


@pytest.mark.usefixtures("without_throttling")
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


def test_wrong_keys_are_throttled_and_the_right_one_is_not(
    rig: Rig, throttled: list[float]
) -> None:
    with httpx.Client(base_url=rig.guarded_url, headers={"Authorization": "Bearer x"}) as guesser:
        while not throttled:
            begin = time.monotonic()
            assert guesser.post("/hold").status_code == 401
        assert time.monotonic() - begin >= THROTTLE_S
        assert httpx.post(f"{rig.guarded_url}/hold", headers=RIGHT).status_code == 200
        assert httpx.get(f"{rig.guarded_url}/control", headers=RIGHT).status_code == 200
    assert throttled == [THROTTLE_S]


def test_guesses_of_the_token_are_throttled_and_stops_are_not(
    rig: Rig, throttled: list[float]
) -> None:
    url = rig.guarded_url
    maria = {"client": "maria", "ttl_s": 10.0}
    held = httpx.post(f"{url}/control", json=maria, headers=RIGHT).json()
    with httpx.Client(base_url=url, headers={**RIGHT, "X-Control-Token": "guessed"}) as guesser:
        while not throttled:
            begin = time.monotonic()
            assert guesser.put("/control").status_code == 409
        assert time.monotonic() - begin >= THROTTLE_S
        assert guesser.post("/hold").status_code == 200
        right = {**RIGHT, "X-Control-Token": held["token"]}
        assert httpx.put(f"{url}/control", headers=right).status_code == 200
    assert throttled == [THROTTLE_S]


# -- tickets


def ticket_of(rig: Rig) -> str:
    answer = httpx.post(f"{rig.guarded_url}/ticket", headers=RIGHT)
    assert answer.json()["valid_s"] == access_control.VALID_S
    return str(answer.json()["ticket"])


def opened(rig: Rig, port: int, query: str, origin: str | None = None) -> int:
    """Return the status of the answer to opening the WebSocket of `/control`."""
    try:
        with connect(
            f"ws://127.0.0.1:{port}/control?client=page&{query}",
            origin=origin,  # type: ignore[arg-type]  # a subtype of str
        ) as connection:
            connection.recv(60.0)
    except InvalidStatus as refused:
        return refused.response.status_code
    until(lambda: rig.service.lease.holder() is None)
    return 101


def test_a_ticket_opens_one_websocket_instead_of_the_key(rig: Rig) -> None:
    ticket = ticket_of(rig)
    own = f"http://127.0.0.1:{rig.guarded_port}"
    assert opened(rig, rig.guarded_port, f"ticket={ticket}", own) == 101
    assert opened(rig, rig.guarded_port, f"ticket={ticket}", own) == 401
    assert httpx.post(f"{rig.guarded_url}/ticket").status_code == 401


def test_a_ticket_opens_nothing_for_another_page_or_address(rig: Rig) -> None:
    ticket = ticket_of(rig)
    assert opened(rig, rig.guarded_port, f"ticket={ticket}", "http://evil.example") == 403
    assert opened(rig, rig.port, f"ticket={ticket}") == 401
    with httpx.Client(base_url=rig.guarded_url) as client:
        assert client.get("/events", params={"ticket": ticket}).status_code == 401
    assert opened(rig, rig.guarded_port, f"ticket={ticket}") == 101  # it is still unused


@pytest.mark.parametrize("query", ["", "ticket=", "ticket=made-up", "x&" * 2000 + "ticket=1"])
def test_no_websocket_opens_without_a_valid_ticket(rig: Rig, query: str) -> None:
    ticket_of(rig)
    assert opened(rig, rig.guarded_port, query) == 401


def test_tickets_expire_and_their_number_is_limited() -> None:
    now_s = 0.0
    given = access_control.Tickets(lambda: now_s)
    late = given.issue()
    now_s = access_control.VALID_S
    assert not given.redeem(late)
    many = [given.issue() for _ in range(access_control.MOST_TICKETS + 1)]
    assert [given.redeem(one) for one in many] == [False] + [True] * access_control.MOST_TICKETS


def test_the_openapi_description_names_the_key(rig: Rig) -> None:
    described = httpx.get(f"{rig.guarded_url}/openapi.json").json()
    assert described["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    assert described["paths"]["/enable"]["post"]["security"] == [{"key": []}]
    assert described["paths"]["/status"]["get"]["security"] == []


# -- other websites


@pytest.mark.parametrize(
    "host", ["robot.example.com", "127.0.0.1.example.com", "localhost.evil:80", "", "[::1].x"]
)
def test_a_foreign_host_name_is_rejected(rig: Rig, host: str) -> None:
    answer = httpx.get(f"{rig.url}/status", headers={"Host": host})
    assert answer.status_code == 403


def test_a_foreign_host_name_is_rejected_also_with_the_key(rig: Rig) -> None:
    foreign = {"Host": "robot.example.com"}
    for path in ("/status", "/docs", "/control"):
        answer = httpx.get(f"{rig.guarded_url}{path}", headers={**RIGHT, **foreign})
        assert answer.status_code == 403
    answer = httpx.post(f"{rig.guarded_url}/hold", headers={**RIGHT, **foreign})
    assert answer.status_code == 403
    assert rig.loop.commands == []


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "robot.example.com"},
        {"Origin": "http://robot.example.com"},
        {"Host": "robot.example.com", "Origin": "http://robot.example.com"},
    ],
)
def test_a_page_of_another_host_opens_no_websocket(
    rig: Rig, headers: dict[str, str], caplog: pytest.LogCaptureFixture
) -> None:
    refused = rig.service.counts["refused"]
    for url, key in ((rig.url, {}), (rig.guarded_url, RIGHT)):
        for path in ("/live", "/control?client=page"):
            answer = httpx.get(f"{url}{path}", headers={**UPGRADE, **key, **headers})
            assert answer.status_code == 403
    assert rig.service.counts["refused"] == refused + 4
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "[::1]:99"])
def test_names_of_this_machine_are_accepted(rig: Rig, host: str) -> None:
    assert httpx.get(f"{rig.url}/status", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("origin", ["http://example.com", "null", "https://127.0.0.1", ""])
def test_a_page_of_another_host_cannot_even_stop_the_robot(rig: Rig, origin: str) -> None:
    for url, client in ((rig.url, httpx.Client()), ("http://robot", rig.client())):
        with client:
            answer = client.post(f"{url}/hold", headers={"Origin": origin})
            assert answer.status_code == 403
    assert rig.loop.commands == []


def test_the_services_own_page_may_stop_the_robot(rig: Rig) -> None:
    assert httpx.post(f"{rig.url}/hold", headers={"Origin": rig.url}).status_code == 200


# -- sockets


def test_the_unix_socket_is_for_this_user_only(rig: Rig) -> None:
    assert stat.S_IMODE(rig.socket.stat().st_mode) == 0o600
    assert rig.socket.stat().st_uid == os.getuid()


def test_a_socket_in_use_is_rejected_and_a_stale_one_is_replaced(rig: Rig, tmp_path: Path) -> None:
    with pytest.raises(ListenError, match="another daemon listens there"):
        listen_unix(rig.socket)
    left = tmp_path / "left.sock"
    listen_unix(left).close()
    assert left.exists()
    with listen_unix(left):
        assert listener_pid(left) == os.getpid()


def test_a_file_in_place_of_the_socket_is_left_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    with pytest.raises(ListenError, match="is not a socket"):
        listen_unix(file)
    assert file.read_text() == "mine"


def test_a_socket_that_cannot_be_created_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_path: Path) -> None:  # as for another user's socket in /tmp
        raise PermissionError(errno.EPERM, "Operation not permitted")

    left = tmp_path / "left.sock"
    listen_unix(left).close()
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(ListenError, match=r"left\.sock: Operation not permitted"):
        listen_unix(left)
    with pytest.raises(ListenError, match="name too long"):
        listen_unix(tmp_path / (300 * "x"))


def test_an_address_in_use_or_unknown_is_named(rig: Rig) -> None:
    with pytest.raises(ListenError, match=f"127.0.0.1:{rig.port}: .*in use"):
        listen_tcp("127.0.0.1", rig.port)
    with pytest.raises(ListenError, match=r"no\.such\.host"):
        listen_tcp("no.such.host.invalid", 1)


def test_a_listener_on_loopback_rejects_network_names() -> None:
    name = f"{socket.gethostname().lower()}.local:8000"
    assert is_own_host(name, AccessPolicy.on_tcp(None, "0.0.0.0").hosts)
    inside = AccessPolicy.on_tcp(None, "localhost", loopback=True)
    assert not is_own_host(name, inside.hosts)
    assert is_own_host("localhost:8000", inside.hosts)
    assert is_own_host("127.0.0.1:8000", inside.hosts)
