"""The WebSockets: live values, clients that do not read, and the right to move."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from threading import Thread
from types import SimpleNamespace
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from waiting import until
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect, unix_connect

from cdpr_rt.service import websocket_routes
from cdpr_rt.service import websocket_routes as control_socket
from tests.cdpr_rt.service.service_rig import AXES, KEY, NOT_TIGHT, Rig, running


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with running(tmp_path_factory.mktemp("live")) as rig:
        yield rig


@pytest.fixture
def rig(shared: Rig) -> Rig:
    shared.reset()
    return shared


def ask(connection: ClientConnection, **order: Any) -> dict[str, Any]:
    connection.send(json.dumps(order))
    answer: dict[str, Any] = json.loads(connection.recv(60.0))
    return answer


def open_unix(rig: Rig, path: str) -> ClientConnection:
    return unix_connect(str(rig.socket), f"ws://robot{path}")


def closed_for(connection: ClientConnection) -> tuple[int, str]:
    with pytest.raises(ConnectionClosed) as closing:
        while True:
            connection.recv(60.0)
    assert closing.value.rcvd is not None
    return closing.value.rcvd.code, closing.value.rcvd.reason


# -- live values


def test_live_sends_every_cycle_on_request(rig: Rig) -> None:
    path = "/live?rate_Hz=20&all_cycles=true&fields=cycle,state,position_rad"
    cycles: list[int] = []
    with open_unix(rig, path) as connection:
        while len(cycles) < 100:
            message = json.loads(connection.recv(60.0))
            if message["kind"] == "cycles":
                assert message["rows"][0].keys() == {"cycle", "state", "position_rad"}
                cycles += [row["cycle"] for row in message["rows"]]
    assert all(b == a + 1 for a, b in pairwise(cycles))


def test_live_sends_description_and_status_first_and_then_changes(rig: Rig) -> None:
    with open_unix(rig, "/live?rate_Hz=50&fields=cycle,position_rad,tension_N") as connection:
        messages = [json.loads(connection.recv(60.0)) for _ in range(30)]
        rig.loop.publish(state="fault", reason="broken cable of left")
        deadline = time.monotonic() + 60.0
        missing = {"fault", "broken cable of left"}
        while missing:
            message = json.loads(connection.recv(60.0))
            missing.discard(message.get("event", {}).get("text"))
            missing.discard(message.get("status", {}).get("state"))
            assert time.monotonic() < deadline, missing
    assert [message["kind"] for message in messages[:3]] == ["description", "status", "cycle"]
    assert messages[0]["description"]["axes"][0]["name"] == AXES[0]
    cycles = [message for message in messages if message["kind"] == "cycle"]
    numbers = [message["cycle"] for message in cycles]
    assert numbers == sorted(set(numbers))
    skipped = [message["skipped"] for message in cycles[1:]]
    assert [b - a - 1 for a, b in pairwise(numbers)] == skipped
    assert cycles[0]["position_rad"] == [0.0, 1.0]
    assert cycles[0]["tension_N"] == [None, None]
    assert "velocity_rad_s" not in cycles[0]


def test_live_never_exceeds_the_requested_rate(rig: Rig) -> None:
    begin = time.monotonic()  # before messages may be sent that are not read yet
    with open_unix(rig, "/live?rate_Hz=10&fields=cycle") as connection:
        cycles = 0
        while cycles < 8:
            cycles += json.loads(connection.recv(60.0))["kind"] == "cycle"
        assert time.monotonic() - begin > 0.65


def test_a_viewer_may_stop_the_robot_on_its_connection(rig: Rig) -> None:
    with connect(f"ws://127.0.0.1:{rig.port}/live") as viewer:
        for text in ("", "{", '{"do": "enable"}', '{"do": "shutdown"}', '{"do": "program"}'):
            viewer.send(text)
        viewer.send(json.dumps({"do": "hold", "client": "\n", "id": "x"}))  # obeyed all the same
        viewer.send(json.dumps({"do": "disable", "client": "jan", "id": 4}))
        messages = (json.loads(viewer.recv(60.0)) for _ in range(1000))
        answers = [one for one in messages if one["kind"] in ("taken", "reply")][:4]
    assert [one["id"] for one in answers] == [None, None, 4, 4]
    assert answers[2] == {"kind": "taken", "id": 4}
    assert answers[3] == {"kind": "reply", "id": 4, "ok": True, "error": None}
    done = [(one["do"], one["client"]) for one in rig.loop.commands]
    assert done == [("hold", "somebody"), ("disable", "jan")]


@pytest.mark.parametrize("query", ["rate_Hz=51", "rate_Hz=0", "rate_Hz=nan", "rate_Hz=x"])
def test_invalid_and_excessive_rates_are_rejected(rig: Rig, query: str) -> None:
    with pytest.raises(InvalidStatus):
        open_unix(rig, f"/live?{query}")


def test_an_unknown_field_is_named(rig: Rig) -> None:
    with open_unix(rig, "/live?fields=cycle,colour") as connection:
        assert closed_for(connection) == (1008, "fields: colour is not a field of a cycle")


@pytest.mark.parametrize("letter", ["\x01", "\u00e9", "\U0001fff0"])
def test_a_field_with_odd_characters_is_rejected_without_a_traceback(
    rig: Rig, letter: str, caplog: pytest.LogCaptureFixture
) -> None:
    with open_unix(rig, f"/live?fields={quote(80 * letter)}") as connection:
        code, reason = closed_for(connection)
    assert code == 1008
    assert reason.startswith("fields: ") and reason.isascii()
    assert caplog.text == ""


def test_a_client_that_answers_no_ping_is_dropped_without_a_traceback(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    protocol = WebSocketsSansIOProtocol
    monkeypatch.setattr(protocol, "start_keepalive", protocol.keepalive_timeout)
    with open_unix(rig, "/live?rate_Hz=50") as connection:
        assert closed_for(connection) == (1011, "keepalive ping timeout")
    until(lambda: rig.service.counts["live_clients"] == 0)
    assert caplog.text == ""


def test_only_the_client_that_does_not_read_is_dropped(rig: Rig) -> None:
    dropped = rig.service.counts["slow_clients_dropped"]
    asleep = socket.create_connection(("127.0.0.1", rig.port))
    asleep.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    asleep.sendall(
        b"GET /live?rate_Hz=50&all_cycles=true HTTP/1.1\r\nHost: localhost\r\n"
        b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with open_unix(rig, "/live?rate_Hz=50&fields=cycle") as connection:
        deadline = time.monotonic() + 300.0
        until(lambda: rig.service.counts["live_clients"] == 2)
        while rig.service.counts["live_clients"] == 2:
            connection.recv(60.0)
            assert time.monotonic() < deadline
        json.loads(connection.recv(60.0))
    asleep.close()
    until(lambda: rig.service.counts["live_clients"] == 0)
    assert rig.service.counts["slow_clients_dropped"] == dropped + 1  # before a ping was missed


def test_a_flood_of_pings_without_reading_ends_the_connection(rig: Rig) -> None:
    flood = socket.create_connection(("127.0.0.1", rig.guarded_port))
    flood.sendall(
        b"GET /control?client=x&ttl_s=10 HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\n"
        b"Authorization: Bearer " + KEY + b"\r\n"
        b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    told = b""
    while b'"held"' not in told:
        told += flood.recv(4096)
    pings = (b"\x89\xfd" + b"\0" * 4 + b"p" * 125) * 500
    with pytest.raises(OSError, match=r"reset|pipe"):
        for _ in range(400):  # 26 MB
            flood.sendall(pings)
    flood.close()


def test_one_address_may_watch_with_many_pages_up_to_a_limit(rig: Rig) -> None:
    url, key = f"127.0.0.1:{rig.guarded_port}", {"Authorization": f"Bearer {KEY.decode()}"}
    with ExitStack() as watching:
        for _ in range(websocket_routes._MOST_LIVE):
            page = connect(f"ws://{url}/live?rate_Hz=1", additional_headers=key)
            watching.enter_context(page)
        until(lambda: rig.service.counts["live_clients"] == websocket_routes._MOST_LIVE)
        assert httpx.get(f"http://{url}/description", headers=key).status_code == 200
        with open_unix(rig, "/live") as connection:
            assert closed_for(connection)[0] == control_socket.BUSY
    until(lambda: rig.service.counts["live_clients"] == 0)


def test_few_viewers_may_watch_every_cycle(rig: Rig) -> None:
    path = "/live?all_cycles=true&fields=cycle"
    with ExitStack() as watching:
        for _ in range(websocket_routes._MOST_ALL_CYCLES):
            watching.enter_context(open_unix(rig, path)).recv(60.0)
        with open_unix(rig, path) as connection:
            code, why = closed_for(connection)
            assert (code, "every cycle" in why) == (control_socket.BUSY, True)
        watching.enter_context(open_unix(rig, "/live")).recv(60.0)
    until(lambda: rig.service.counts["live_clients"] == 0)


# -- moving


def test_the_connection_is_the_right_to_move(rig: Rig) -> None:
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        assert json.loads(connection.recv(60.0))["kind"] == "held"
        with open_unix(rig, "/control?client=jan") as other:
            code, reason = closed_for(other)
            assert code == control_socket.REFUSED
            assert "maria holds" in reason
        assert ask(connection, do="program", program="jog", wanted={"v": [1]}, id=7) == {
            "kind": "reply",
            "id": 7,
            "ok": True,
            "error": None,
            "state": "ready",
        }
        refused = ask(connection, do="program", program="pose")
        assert refused["ok"] is False and refused["refusal"] == NOT_TIGHT
        assert refused["error"].startswith("pose: the cables are not tight")
        assert ask(connection, do="set", wanted={"v": [2]})["ok"] is True
        assert rig.lease_left_s > 0.0
    until(lambda: rig.lease_until_s == 0.0)
    assert [command["do"] for command in rig.loop.commands] == ["program", "program", "set"]
    assert rig.loop.commands[2]["client"] == "maria"


def test_a_hold_overtakes_and_cancels_earlier_requests_of_its_connection(rig: Rig) -> None:
    rig.loop.answers = False
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        connection.recv(60.0)
        connection.send(json.dumps({"do": "program", "program": "jog", "id": 0}))
        until(lambda: len(rig.service.link._pending) == 1)
        for number, order in enumerate(("set", "set", "hold", "set"), 1):
            wanted = {} if order == "hold" else {"wanted": {}}
            connection.send(json.dumps({"do": order, "id": number, **wanted}))
        until(lambda: len(rig.service.link._pending) >= 2)  # the hold is posted too
        rig.loop.answers = True
        answers = {one["id"]: one for one in (json.loads(connection.recv(60.0)) for _ in range(5))}
        assert [answers[i]["ok"] for i in range(5)] == [False, False, False, True, True]
        assert answers[1]["error"] == "set: cancelled by a later stop"
    assert rig.loop.commands[0]["do"] == "hold"


def test_an_order_from_before_a_stop_that_the_client_has_not_seen_is_rejected(rig: Rig) -> None:
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection, rig.client() as client:
        connection.recv(60.0)
        order = {"do": "program", "program": "jog", "stops_seen": rig.block.stops}
        assert ask(connection, **order)["ok"]
        assert client.post("/hold").status_code == 200
        assert ask(connection, **order)["error"] == "program: cancelled by a later stop"
        order["stops_seen"] = client.get("/status").json()["stop_count"]
        assert ask(connection, **order)["ok"]


def test_a_stop_by_another_client_cancels_orders_that_wait(rig: Rig) -> None:
    rig.loop.answers = False
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        connection.recv(60.0)
        connection.send(json.dumps({"do": "program", "program": "jog", "id": 0}))
        until(lambda: len(rig.service.link._pending) == 1)
        connection.send(json.dumps({"do": "program", "program": "jog", "id": 1}))
        assert ask(connection, do="jump", id=2)["ok"] is False  # so the order before is waiting
        stopping = Thread(target=lambda: rig.client().post("/hold", json={"client": "jan"}))
        stopping.start()
        until(lambda: len(rig.service.link._pending) == 2)
        rig.loop.answers = True
        answers = {one["id"]: one for one in (json.loads(connection.recv(60.0)) for _ in range(2))}
        stopping.join()
        assert answers[1]["error"] == "program: cancelled by a later stop"
    assert rig.loop.commands[0]["do"] == "hold"


def test_a_client_that_disconnects_while_waiting_loses_the_right_immediately(rig: Rig) -> None:
    rig.loop.answers = False
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        connection.recv(60.0)
        connection.send(json.dumps({"do": "set", "wanted": {}}))
        until(lambda: len(rig.service.link._pending) == 1)
        connection.socket.shutdown(socket.SHUT_RDWR)
        until(lambda: rig.lease_until_s == 0.0)


def test_a_client_waiting_for_an_answer_keeps_the_right(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.loop.answers = False
    command = rig.service.link.command

    async def patient(do: str, wait_s: float, **fields: Any) -> Any:
        return await command(do, 20.0 * wait_s, **fields)

    monkeypatch.setattr(rig.service.link, "command", patient)
    with open_unix(rig, "/control?client=maria&ttl_s=4") as connection:
        connection.recv(60.0)
        connection.send(json.dumps({"do": "set", "wanted": {}}))
        rig.wait_for_renewal(4.5)
        rig.loop.answers = True
        assert json.loads(connection.recv(60.0))["ok"] is True


def test_a_client_that_has_lost_the_right_may_still_stop(rig: Rig) -> None:
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        token = json.loads(connection.recv(60.0))["token"]
        rig.service.lease.release(token)
        rig.service.lease.take("jan", 10.0)
        assert ask(connection, do="renew")["ok"] is False
        assert ask(connection, do="hold")["ok"] is True
    assert [command["do"] for command in rig.loop.commands] == ["hold"]


def test_a_silent_client_loses_the_right(rig: Rig) -> None:
    with open_unix(rig, "/control?client=maria&ttl_s=4") as connection:
        connection.recv(60.0)
        assert ask(connection, do="renew")["ok"] is True
        assert closed_for(connection)[0] == control_socket.SILENT
    assert rig.lease_left_s < 0.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"do": "enable"}',
        '{"do": "program"}',
        '{"do": "program", "program": "jog", "wanted": {"v": [1e999]}}',
        '{"do": "set", "wanted": {"v": NaN}}',
        '{"do": "set", "wanted": {"v": ' + "9" * 400 + "}}",
        '{"do": "set", "wanted": 1}',
        '{"do": "renew", "more": 1}',
        "[" * 9000,
        '{"do": "set", "wanted": {"v": ' + 150 * "[" + 150 * "]" + "}}",
        '{"do": "set", "wanted": {"v": ' + 900 * "[" + 900 * "]" + "}}",
        b'{"do": "hold"}',
    ],
)
def test_invalid_messages_are_answered_and_have_no_effect(rig: Rig, text: str | bytes) -> None:
    with open_unix(rig, "/control?client=maria&ttl_s=10") as connection:
        connection.recv(60.0)
        connection.send(text)
        answer = json.loads(connection.recv(60.0))
        assert answer["ok"] is False
        assert answer["error"]
        assert ask(connection, do="renew")["ok"] is True
    assert rig.loop.commands == []


def test_binary_messages_close_the_connection_without_a_traceback(
    rig: Rig, caplog: pytest.LogCaptureFixture
) -> None:
    with open_unix(rig, "/control?client=maria") as connection:
        connection.recv(60.0)
        connection.send(b'{"do": "\xff"}', text=True)
        assert closed_for(connection)[0] == 1007
    until(lambda: rig.lease_left_s < 0.0)
    assert caplog.text == ""
    assert rig.loop.commands == []


def test_a_message_too_long_or_too_many_messages_end_the_connection(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    # all messages arrive at the same time, however long reading them takes
    monkeypatch.setattr(control_socket, "time", SimpleNamespace(monotonic=lambda: 0.0))
    with open_unix(rig, "/control?client=maria") as connection:
        connection.recv(60.0)
        connection.send("x" * 20_000)
        assert closed_for(connection)[0] == 1009
    until(lambda: rig.lease_left_s < 0.0)
    with open_unix(rig, "/control?client=maria") as connection:
        connection.recv(60.0)
        for _ in range(150):
            connection.send('{"do": "renew"}')
        assert closed_for(connection)[0] == control_socket.UNFIT
    until(lambda: rig.lease_left_s < 0.0)
