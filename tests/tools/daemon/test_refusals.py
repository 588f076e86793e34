"""Rejections by the loop are reported in the words of the command line."""

from __future__ import annotations

import pickle
import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.client.client import open_daemon
from cdpr_tools.client.refusals import DaemonRefusalError, in_typed_words
from cdpr_tools.errors import BadInputError, CrowdedError, ServiceRefusalError, WorkFailedError

WHY = {"why": "on the way, at 250.0, -1500.0 mm turned by 5.7 deg: cable 1"}
RANGE = {"index": 1, "low": -1.0, "high": 1.0}


def text_of(refusal: CommandRefusal, *typed: Any, **words: Any) -> str:
    with pytest.raises(DaemonRefusalError) as raised, in_typed_words(*typed, **words):
        raise DaemonRefusalError.of(refusal)
    return str(raised.value)


def test_rejections_quote_the_request_as_typed() -> None:
    refusal = CommandRefusal(RefusalCode.NOT_FEASIBLE, "pose", {"position_m": [0.3, 2.0]}, WHY)
    assert text_of(refusal, "move", "--to 300 2000") == f"--to 300 2000: {WHY['why']}"
    refusal = CommandRefusal(RefusalCode.NOT_TIGHT, "pose")
    assert text_of(refusal, "move", "--to 300 2000").startswith("move: the cables are not tight")


def test_rejections_give_allowed_values_as_typed() -> None:
    nothing = {"left": "target", "instead": "position_m"}
    refusal = CommandRefusal(RefusalCode.NOTHING_LEFT, "pose", {"resume": True}, nothing)
    text = text_of(refusal, "resume", instead="cdpr move --to")
    assert text == "resume: there is no target to continue; allowed: cdpr move --to"
    # the same arguments with a different rejection of the command
    states = {"state": "ready", "allowed": ["active"]}
    refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "program", arguments=states)
    text = text_of(refusal, "resume", instead="cdpr move --to")
    assert text == (
        "resume: not allowed in state ready; allowed in active; `cdpr enable` switches the power on"
    )
    sources = {"why": "the cables' lengths are not known", "allowed": ["home"]}
    refusal = CommandRefusal(RefusalCode.BAD_SOURCE, "tighten", {"from": "lengths"}, sources)
    text = text_of(refusal, "tighten", "tighten --from lengths", option="--from ")
    assert text == "tighten --from lengths: the cables' lengths are not known; allowed: --from home"


@pytest.mark.parametrize(
    ("asked", "index", "text"),
    [
        ({"velocity_rad_s": 2.0}, 1, "right=114.592: allowed: -57.3 to 57.3 deg/s"),
        ({"cable_m": 2.0}, 0, "left=2000: allowed: -1000 to 1000 mm"),
        ({"speed_rad_s": 2.0}, None, "--speed 114.592: allowed: -57.3 to 57.3 deg/s"),
        ({"back_m": 2.0}, None, "path back 2000: allowed: -1000 to 1000 mm"),
    ],
)
def test_a_number_out_of_range_is_reported_in_the_typed_units(
    asked: dict[str, float], index: int | None, text: str
) -> None:
    refusal = CommandRefusal(RefusalCode.OUT_OF_RANGE, "pid", asked, {**RANGE, "index": index})
    with pytest.raises(BadInputError) as raised, in_typed_words("move", "", ("left", "right")):
        raise DaemonRefusalError.of(refusal)
    assert str(raised.value) == text


def test_a_number_without_an_option_is_reported_as_the_loop_does() -> None:
    refusal = CommandRefusal(
        RefusalCode.OUT_OF_RANGE, "path", {"feed": 2.0}, {**RANGE, "index": None}
    )
    assert text_of(refusal, "path", "--feed") == str(refusal)


@pytest.mark.parametrize(
    ("state", "allowed", "remedy"),
    [
        ("ready", ["active"], "; `cdpr enable` switches the power on"),
        ("ready", ["inactive"], ""),
        (
            "fault",
            ["ready", "active"],
            "; `cdpr status` gives the reason, `cdpr ack` acknowledges it",
        ),
        ("shutting-down", ["active"], ""),
    ],
)
def test_the_proposed_action_depends_on_the_state(
    state: str, allowed: list[str], remedy: str
) -> None:
    states = {"state": state, "allowed": allowed}
    refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "jog", arguments=states)
    text = str(DaemonRefusalError.of(refusal))
    assert text == f"jog: not allowed in state {state}; allowed in {' or '.join(allowed)}{remedy}"
    # the text of another rejection gets none
    assert text_of(
        CommandRefusal(RefusalCode.NOT_CALIBRATED, "jog", {}, {"why": text}), "jog"
    ).endswith(text)


def test_the_error_can_be_pickled_and_reworded() -> None:
    states = {"state": "ready", "allowed": ["active"]}
    refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "jog", arguments=states)
    error = DaemonRefusalError.of(refusal)
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is DaemonRefusalError
    assert (str(copy), copy.refusal) == (str(error), refusal)
    other = type(error)("jog: words")
    assert str(other) == "jog: words"
    with pytest.raises(DaemonRefusalError, match=r"^jog: words$"), in_typed_words("move"):
        raise other


@pytest.mark.parametrize(
    ("state", "refusal", "kind", "words"),
    [
        (
            b'"ready"',
            b'{"code": "not_tight", "command": "pose", "asked": {}, "arguments": {}}',
            DaemonRefusalError,
            "pose: the cables are not tight; run tighten first",
        ),
        (
            b'"ready"',
            b'{"code": "of another version", "command": "pose"}',
            DaemonRefusalError,
            "its words",
        ),
        (b'"ready"', b"null", DaemonRefusalError, "its words"),
        (
            b"null",
            b"null",
            ServiceRefusalError,
            "its words",
        ),  # a rejection by the service, such as for the right to move
    ],
)
def test_a_rejection_by_the_daemon_is_raised_with_its_code(
    tmp_path: Path, state: bytes, refusal: bytes, kind: type[Exception], words: str
) -> None:
    body = b'{"error": "its words", "state": %s, "refusal": %s}' % (state, refusal)
    head = b"HTTP/1.1 409 Conflict\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(body)

    def serve() -> None:
        connection, _ = served.accept()
        with connection:
            connection.recv(1 << 16)
            connection.sendall(head + body)

    place = tmp_path / "one.sock"
    with socket.socket(socket.AF_UNIX) as served, open_daemon(None, place, None, None) as daemon:
        served.bind(str(place))
        served.listen()
        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(WorkFailedError) as raised:
            daemon.post("/program")
        thread.join()
    assert type(raised.value) is kind
    assert str(raised.value) == words


def test_a_stop_is_sent_again_to_a_service_with_too_many_connections() -> None:
    crowded = b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 19\r\nConnection: close\r\n\r\n"
    held = b'{"state": "active", "text": ""}'
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(held)
    answers = [crowded + b"Service Unavailable"] * 3 + [head + held]

    def serve() -> None:
        for answer in answers:
            connection, _ = served.accept()
            with connection:
                connection.recv(1 << 16)
                connection.sendall(answer)

    with socket.create_server(("127.0.0.1", 0)) as served:
        served.settimeout(10.0)
        url = f"http://127.0.0.1:{served.getsockname()[1]}"
        with open_daemon(None, None, url, None) as daemon, ThreadPoolExecutor(1) as pool:
            served_all = pool.submit(serve)
            with pytest.raises(CrowdedError, match="too many connections"):
                daemon.post("/program")
            assert daemon.post("/hold")["state"] == "active"
            served_all.result()
