"""Commands and the right to move over a real socket."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
import time
from typing import Any

import httpx
import pytest
from pydantic import ValidationError
from waiting import until

from cdpr_rt.service import http_models as models
from cdpr_rt.service.listening import listen_udp
from cdpr_rt.service.setpoint_stream import SetpointStream
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import Standing, StreamSession
from cdpr_rt.service.websocket_routes import Order
from tests.cdpr_rt.service.service_rig import NOT_TIGHT, Rig


def take(client: httpx.Client, name: str = "maria", ttl_s: float = 10.0) -> dict[str, str]:
    answer = client.post("/control", json={"client": name, "ttl_s": ttl_s})
    assert answer.status_code == 200, answer.text
    return {"X-Control-Token": answer.json()["token"]}


def test_motion_without_the_right_to_move_never_reaches_the_loop(rig: Rig) -> None:
    with rig.client() as client:
        for path, body in (
            ("/enable", {}),
            ("/program", {"program": "jog"}),
            ("/set", {"wanted": {}}),
        ):
            for headers in ({}, {"X-Control-Token": "made up"}):
                answer = client.post(path, json=body, headers=headers)
                assert answer.status_code == 409
                assert "right to move" in answer.json()["error"]
    assert rig.loop.commands == []


def test_the_holder_of_the_right_moves_and_others_learn_its_name(rig: Rig) -> None:
    with rig.client() as client:
        headers = take(client)
        wanted = {"velocity_rad_s": [0.5, 0]}
        answer = client.post(
            "/enable", json={"program": "jog", "wanted": wanted, "client": "maria"}, headers=headers
        )
        assert answer.json() == {"text": "", "state": "active"}
        refused = client.post("/control", json={"client": "jan"})
        assert refused.status_code == 409
        assert "maria holds the right to move" in refused.json()["error"]
        assert client.get("/control").json()["client"] == "maria"
    (command,) = rig.loop.commands
    assert command["do"] == "enable"
    assert (command["program"], command["wanted"]) == ("jog", wanted)
    assert command["client"] == "maria"


def test_a_command_carries_the_number_of_its_grant(rig: Rig) -> None:
    with rig.client() as client:
        for name in ("maria", "jan"):
            headers = take(client, name)
            for path, body in (
                ("/enable", {}),
                ("/program", {"program": "jog"}),
                ("/set", {"wanted": {}}),
                ("/lengths", {"wanted": {}}),
            ):
                assert client.post(path, json=body, headers=headers).status_code == 200
            client.delete("/control", headers=headers)
        client.post("/hold")
    numbers = [command.get("right") for command in rig.loop.commands]
    last = int(rig.block.counters["right_number"][0])
    assert numbers == [last - 1] * 4 + [last] * 4 + [None], "hold needs no right"


def test_enable_needs_no_body(rig: Rig) -> None:
    with rig.client() as client:
        assert client.post("/enable", headers=take(client)).status_code == 200
    assert rig.loop.commands[-1]["program"] == "hold"


@pytest.mark.parametrize("path", ["/enable", "/set", "/hold", "/control"])
def test_malformed_json_and_invalid_values_have_different_errors(rig: Rig, path: str) -> None:
    json_type = {"Content-Type": "application/json"}
    with rig.client() as client:
        answer = client.post(path, content=b'{"client": ', headers=json_type)
        assert answer.status_code == 400
        assert answer.json()["error"].startswith("the body is not JSON: ")
        assert client.post(path, json={"client": 1}).status_code == 422
    assert rig.loop.commands == []


def test_only_the_holder_of_the_right_is_given_a_stream_session(rig: Rig) -> None:
    with rig.client() as client:
        headers = take(client)
        answer = client.post("/stream", headers=headers)
        assert answer.status_code == 404
        assert "receives no set-point stream" in answer.json()["error"]
        stream = SetpointStream(rig.block, rig.service.lease, listen_udp("127.0.0.1", 0))
        rig.service.start_parts([stream])
        try:
            for wrong in ({}, {"X-Control-Token": "made up"}):
                assert client.post("/stream", headers=wrong).status_code == 409
            told = client.post("/stream", headers=headers).json()
            assert (told["host"], told["port"]) == stream.address
            given = StreamSession(told["session"], bytes.fromhex(told["key"]))
            with StreamClient(told["host"], told["port"], given) as hand:
                until(lambda: hand.send((0.0, 0.0, 0.0)) and hand.receive() != [])
                assert hand.state is not None
                assert hand.state.standing is Standing.ACCEPTED
                client.delete("/control", headers=headers)
                take(client, "jan")
                answered = hand.answered
                until(
                    lambda: hand.send((0.0, 0.0, 0.0)) and hand.receive() != []
                    and hand.answered > answered + 2
                )  # fmt: skip
                assert hand.state.standing is Standing.NO_RIGHT
            assert rig.block.samples["right"].max() < rig.block.counters["right_number"][0]
        finally:
            rig.service.stop_parts()
            rig.service.parts, rig.service.stream = [], None


@pytest.mark.parametrize("do", ["hold", "disable", "shutdown"])
def test_anyone_may_stop_while_another_client_moves(rig: Rig, do: str) -> None:
    with rig.client() as client:
        take(client)
        assert client.post(f"/{do}").status_code == 200
    assert [command["do"] for command in rig.loop.commands] == [do]


def test_a_shutdown_reaches_the_loop_before_the_launcher_wakes(rig: Rig) -> None:
    reached: list[list[str]] = []

    def wake() -> None:
        reached.append([command["do"] for command in rig.loop.commands])

    rig.service.wake_launcher = wake
    try:
        with rig.client() as client:
            assert client.post("/shutdown").status_code == 200
    finally:
        rig.service.wake_launcher = lambda: None
    assert reached == [["shutdown"]]


def test_silence_ends_the_right_to_move(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    ahead_ns = 0
    monkeypatch.setattr(rig.service.lease, "_clock_ns", lambda: time.monotonic_ns() + ahead_ns)
    with rig.client() as client:
        headers = take(client, ttl_s=10.0)
        assert rig.lease_left_s <= 10.0
        assert client.put("/control", headers=headers).status_code == 200
        ahead_ns = 10_000_000_000
        answer = client.put("/control", headers=headers)
        assert answer.status_code == 409
        assert "has expired" in answer.json()["error"]
        take(client, "jan")


def test_the_right_outlasts_a_long_command_but_not_a_client_that_disconnects(rig: Rig) -> None:
    rig.loop.answers = False
    with rig.client() as client:
        headers = take(client, ttl_s=5.0)
        asking = threading.Thread(
            target=lambda: client.post("/enable", json={}, headers=headers), daemon=True
        )
        asking.start()
        rig.wait_for_renewal(1.0)
        rig.loop.answers = True
        asking.join()
        assert client.delete("/control", headers=headers).status_code == 200
        rig.loop.answers = False
    with rig.client() as client:
        headers = take(client, ttl_s=5.0)
        with pytest.raises(httpx.ReadTimeout):
            client.post("/enable", json={}, headers=headers, timeout=httpx.Timeout(60.0, read=0.6))
    until(lambda: rig.lease_left_s < 0.0)


def test_a_refusal_of_the_loop_is_returned_with_its_state(rig: Rig) -> None:
    with rig.client() as client:
        answer = client.post("/check")
        assert answer.status_code == 409
        assert answer.json() == {"error": "check: node 3 does not answer", "state": "inactive"}
        wanted = {"program": "pose", "wanted": {"resume": True}}
        answer = client.post("/program", json=wanted, headers=take(client))
    assert answer.json()["error"] == "pose: the cables are not tight; run tighten first"
    assert answer.json()["refusal"] == NOT_TIGHT


def test_simultaneous_holds_are_one_command(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    rig.loop.answers = False
    answers: list[int] = []
    asked: list[str] = []
    command = rig.service.link.command

    async def counted(do: str, wait_s: float, **fields: Any) -> Any:
        answer = asyncio.create_task(command(do, 10.0 * wait_s, **fields))
        await asyncio.sleep(0.0)  # it is posted before the loop may answer
        asked.append(do)
        return await answer

    monkeypatch.setattr(rig.service.link, "command", counted)

    def ask() -> None:
        with rig.client() as client:
            answers.append(client.post("/hold").status_code)

    threads = [threading.Thread(target=ask) for _ in range(20)]
    for thread in threads:
        thread.start()
    until(lambda: len(asked) == 20)
    rig.loop.answers = True
    for thread in threads:
        thread.join()
    assert answers == [200] * 20
    assert [command["do"] for command in rig.loop.commands] == ["hold"]


def test_a_loop_that_does_not_answer_is_reported(rig: Rig) -> None:
    rig.loop.answers = False
    with rig.client() as client:
        answer = client.post("/hold")
    assert answer.status_code == 503
    assert "has not answered 'hold' within 3 s" in answer.json()["error"]


def test_a_loop_that_does_not_turn_gets_stops_only(rig: Rig) -> None:
    rig.loop.stand_still()
    rig.block.counters["loop_alive_ns"] -= 6_000_000_000
    stops = rig.block.stops
    with rig.client() as client:
        assert client.get("/status").json()["loop"]["silent_s"] > 5.0
        answer = client.post("/hold")
    assert answer.status_code == 503
    assert "has run no cycle" in answer.json()["error"]
    assert rig.block.take_command() is None
    assert rig.block.stops == stops + 1  # cancels what it would carry out if it continued
    assert rig.block.take_urgent() is not None


def test_a_dead_loop_is_reported_also_to_waiting_clients(own_rig: Rig) -> None:
    rig = own_rig
    rig.loop.answers = False
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    rig.block.counters["loop_pid"] = process.pid
    answers: list[httpx.Response] = []

    def ask() -> None:
        with rig.client() as client:
            answers.append(client.post("/acknowledge"))

    waiting = threading.Thread(target=ask)
    waiting.start()
    until(lambda: int(rig.block.counters["commands"][0]) == 1)
    process.kill()
    waiting.join()
    assert answers[0].status_code == 503
    with rig.client() as client:
        status = client.get("/status").json()
        assert (status["state"], status["reason"]) == ("dead", "the loop has ended")
        assert status["loop"]["alive"] is False
        assert client.post("/hold").status_code == 503
        rig.block.write_status({"state": "dead", "reason": "the loop has died: killed by signal 9"})
        assert client.get("/status").json()["reason"].endswith("signal 9")
        kinds = [(event["kind"], event["text"]) for event in client.get("/events").json()["events"]]
    assert ("state", "dead") in kinds
    process.wait()


@pytest.mark.parametrize(
    ("path", "body", "where"),
    [
        ("/control", "{}", "body.client"),
        ("/control", '{"client": "x", "ttl_s": NaN}', "body.ttl_s"),
        ("/control", '{"client": "x", "ttl_s": 1e999}', "body.ttl_s"),
        ("/control", '{"client": "two\\nlines"}', "body.client"),
        ("/control", '{"client": "\\ud800"}', "body.client"),
        ("/program", '{"program": "../jog"}', "body.program"),
        ("/program", '{"program": "jog", "unknown": 1}', "body.unknown"),
        ("/program", '{"program": "jog", "wanted": {"v": [NaN]}}', "body.wanted"),
        ("/program", '{"program": "jog", "wanted": {"v": 1e10}}', "body.wanted"),
        ("/program", '{"program": "jog", "wanted": {"v": [-' + "9" * 400 + "]}}", "body.wanted"),
        ("/program", '{"program": "jog", "wanted": {"\\ud800": 1}}', "body.wanted"),
        ("/set", '{"wanted": {"v": [[[[[1]]]]]}}', "body.wanted"),
        ("/set", '{"wanted": {"v": [' + "1," * 64 + "1]}}", "body.wanted"),
        ("/set", '{"wanted": 5}', "body.wanted"),
        ("/set", "[" * 5000, "parsing the body"),
        ("/set", '{"wanted": {"v": ' + "9" * 5000 + "}}", "parsing the body"),
        ("/set", "\x00", "JSON"),
    ],
)
def test_meaningless_values_are_rejected_by_name(
    rig: Rig, path: str, body: str, where: str
) -> None:
    with rig.client() as client:
        headers = {**take(client), "content-type": "application/json"}
        answer = client.post(path, content=body, headers=headers)
    assert answer.status_code in (400, 422)
    assert where in answer.json()["error"]
    assert rig.loop.commands == []


@pytest.mark.parametrize("depth", [20, 210, 900, 980, 2000])
@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('{"wanted": {"v": ', "}}"),
        ('{"wanted": ', "}"),
        ('{"client": ', "}"),
        ('{"unknown": ', ', "wanted": {}}'),
        ("", ""),
    ],
)
def test_a_body_of_any_depth_is_rejected_without_a_traceback(
    rig: Rig, capfd: pytest.CaptureFixture[str], depth: int, before: str, after: str
) -> None:
    with rig.client() as client:
        headers = {**take(client), "content-type": "application/json"}
        for opened, closed in (("[", "]"), ('{"a":', "}")):
            body = before + opened * depth + "1" + closed * depth + after
            answer = client.post("/set", content=body, headers=headers)
            assert answer.status_code in (400, 422), answer.text
            assert len(answer.json()["error"]) < 300
    assert rig.loop.commands == []
    assert capfd.readouterr().err == ""


def test_a_long_body_other_than_a_file_is_rejected_before_parsing(rig: Rig) -> None:
    many = "{" + ",".join(f'"k{k}":1' for k in range(150_000)) + "}"
    flood = ["1," * 900_000, "[" * 1_900_000, '"' * 1_900_000, "9" * 1_900_000, many]
    with rig.client() as client:
        for body in flood:
            answer = client.post("/path", content=body)
            assert answer.status_code == 422
            assert answer.json()["error"].startswith("body: more than 16384 bytes; allowed: ")


def test_a_long_file_is_accepted_with_any_characters(rig: Rig) -> None:
    text = 'G1 X1 ("a", [b]: {c})\\\n' * 60_000
    with rig.client() as client:
        answer = client.post("/path", json={"name": "part.nc", "text": text})
    assert answer.status_code == 409, "validated, and rejected because this service has no planner"
    assert "plans no paths" in answer.json()["error"]


def test_only_one_of_many_unknown_keys_is_reported() -> None:
    body = {f"key{k}": 1 for k in range(2000)} | {"wanted": {}}
    for model in (models.Set, Order):
        with pytest.raises(ValidationError) as refused:
            model.model_validate_json(json.dumps(body))
        assert refused.value.error_count() <= 2, "the first unknown key, and a missing one"
        assert "key0" in str(refused.value)


def test_a_command_too_long_for_the_loop_is_rejected(rig: Rig) -> None:
    wanted = {f"key_{k}": ["x" * 64] * 3 for k in range(30)}
    with rig.client() as client:
        answer = client.post("/set", json={"wanted": wanted}, headers=take(client))
    assert answer.status_code == 413
    assert rig.loop.commands == []


def test_the_last_of_several_changed_values_is_an_event_with_its_client(rig: Rig) -> None:
    with rig.client() as client:
        headers, began_s = take(client), time.monotonic()
        for feed in (0.3, 0.4, 0.5):
            body = {"wanted": {"feed": feed}, "client": "maria"}
            assert client.post("/set", json=body, headers=headers).status_code == 200

        def found() -> list[str]:
            events = client.get("/events").json()["events"]
            return [one["text"] for one in events if one["text"].startswith("set feed")]

        changing_s = time.monotonic() - began_s
        until(lambda: "set feed 0.5 of idle by maria" in found())
        assert len(found()) <= 1 + int(changing_s)  # a value that stays for a second is an event


def test_objects_are_read_with_access_and_written_with_the_right_to_move(rig: Rig) -> None:
    body = {"axis": 1, "index": 0x603F, "client": "maria"}
    with rig.client() as client:
        assert client.post("/object", json=body).status_code == 200
        refused = client.post("/object", json={**body, "value": 1})
        assert refused.status_code == 409
        assert "right to move" in refused.json()["error"]
        for wrong in ({"index": 0x10000}, {"sub": 256}, {"axis": -1}, {"value": 1.5}):
            assert client.post("/object", json={**body, **wrong}).status_code == 422
        client.post("/object", json={**body, "value": 1}, headers=take(client))
        events = [one["text"] for one in client.get("/events").json()["events"]]
    assert events.count("object 603Fh:0 of axis 1 set to 1 by maria") == 1
    read, written = rig.loop.commands
    assert (read["value"], written["value"]) == (None, 1)
