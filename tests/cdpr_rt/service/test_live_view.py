"""The live view, watched by a WebSocket client that knows only Foxglove's protocol."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from foxglove.messages import Timestamp
from waiting import until
from websockets.asyncio.client import connect

from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.service import foxglove_view
from cdpr_rt.service.foxglove_view import MOST_VIEWERS, CableScene, LiveView
from cdpr_rt.service.listening import listen_tcp
from tests.cdpr_rt.service.recording_rig import block_with_clock, made_rows, put

PROTOCOL = "foxglove.sdk.v1"
LONGEST_S = 60.0


@contextmanager
def running(block: SharedBlock) -> Iterator[LiveView]:
    view = LiveView(block, "bench", listen_tcp("127.0.0.1", 0))
    view.start()
    try:
        yield view
    finally:
        view.stop()


@contextmanager
def repeating(block: SharedBlock, row: Row) -> Iterator[None]:
    """Write one row repeatedly, as a loop at 1 kHz would."""
    end = threading.Event()
    writer = RowWriter(block)

    def write() -> None:
        while not end.wait(0.005):
            for _ in range(5):
                put(writer, row)

    thread = threading.Thread(target=write)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


Messages = dict[str, list[tuple[int, bytes]]]


def seen(*topics: str, times: int = 1) -> Callable[[Messages], bool]:
    return lambda messages: all(len(messages.get(topic, ())) >= times for topic in topics)


async def watch(
    url: str, done: Callable[[Messages], bool]
) -> tuple[dict[str, dict[str, Any]], Messages]:
    """Subscribe to all topics; return the channels and the messages of each, with log times."""
    channels: dict[int, dict[str, Any]] = {}
    messages: Messages = {}
    async with connect(url, subprotocols=[PROTOCOL]) as socket:  # type: ignore[list-item]
        while not done(messages):
            text = await asyncio.wait_for(socket.recv(), LONGEST_S)
            if isinstance(text, bytes):
                subscription, log_time = struct.unpack_from("<IQ", text, 1)
                topic = channels[subscription]["topic"]
                messages.setdefault(topic, []).append((log_time, text[13:]))
            elif (said := json.loads(text))["op"] == "advertise":
                new = {channel["id"]: channel for channel in said["channels"]}
                names = {channel["topic"] for channel in channels.values()}
                assert not names & {channel["topic"] for channel in new.values()}
                channels |= new
                wanted = [{"id": number, "channelId": number} for number in new]
                await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            elif said["op"] == "unadvertise":
                for number in said["channelIds"]:
                    del channels[number]
    return {channel["topic"]: channel for channel in channels.values()}, messages


def test_a_client_receives_axes_tensions_pose_and_times() -> None:
    block = block_with_clock()
    row = made_rows(100, 1)
    row["position_rad"], row["setpoint_rad"] = [[math.pi, 1.0]], [[math.pi / 2, 1.0]]
    row["tension_N"] = [[55.0, np.nan]]
    row["compute_s"], row["stream_age_s"] = 2e-4, 0.5
    row["pose"] = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]
    with running(block) as view, repeating(block, row):
        topics = ("/axes", "/tensions", "/cycle_time", "/state", "/pose")
        begin = time.monotonic()
        watched = watch(view.status()["url"], seen(*topics, times=11))
        channels, messages = asyncio.run(watched)
        seconds = time.monotonic() - begin
    for topic in ("/axes", "/tensions", "/cycle_time", "/state"):
        check = jsonschema_rs.Draft7Validator(json.loads(channels[topic]["schema"]))
        for _, data in messages[topic]:
            check.validate(json.loads(data))
    time_ns, data = messages["/axes"][-1]
    axes = json.loads(data)
    assert axes["left"]["position_deg"] == pytest.approx(180.0)
    assert axes["left"]["error_deg"] == pytest.approx(-90.0)
    assert "cable_length_m" not in axes["right"]  # unknown values are left out
    assert time_ns == 1_800_000_000_100_000_000
    assert json.loads(messages["/tensions"][-1][1]) == {"left": 55.0}
    cycle_time = json.loads(messages["/cycle_time"][-1][1])
    assert cycle_time["compute_ms"] == pytest.approx(0.2)
    assert cycle_time["stream_age_s"] == 0.5  # not a wall time, so unchanged
    assert json.loads(messages["/state"][-1][1]) == {"state": "active", "reaction": "none"}
    assert channels["/pose"]["schemaName"] == "foxglove.PoseInFrame"
    assert struct.pack("<d", 3.0) in messages["/pose"][-1][1]
    assert "/pose_setpoint" in channels and "/pose_setpoint" not in messages
    # decimated to at most 50 Hz
    assert len(messages["/axes"]) <= seconds * 50 + 5


def test_events_appear_in_the_live_log() -> None:
    block = block_with_clock()
    with running(block) as view, repeating(block, made_rows(100, 1)):
        trip = iter([{"state": "fault", "reason": "cable of left: 2 N"}])

        def tripped_and_told(messages: Messages) -> bool:
            if "/axes" in messages and (status := next(trip, None)) is not None:
                block.write_status(status)
            return any(b"cable of left: 2 N" in data for _, data in messages.get("/log", ()))

        asyncio.run(watch(view.status()["url"], tripped_and_told))


def test_the_view_reports_why_it_ended() -> None:
    block, told = block_with_clock(), list[str]()
    listener = listen_tcp("127.0.0.1", 0)
    view = LiveView(block, "bench", listener, ended=told.append)
    listener.close()
    view.start()
    view.stop()
    (text,) = told
    assert text.startswith("the live view ended: ") and "Bad file descriptor" in text
    assert view.status()["error"] == text


def test_axes_with_names_that_differ_only_in_punctuation_are_all_shown() -> None:
    block = block_with_clock()
    block.write_description({"axes": [{"name": "top left"}, {"name": "top_left"}]})
    with running(block) as view, repeating(block, made_rows(100, 1)):
        _, messages = asyncio.run(watch(view.status()["url"], seen("/axes")))
    assert set(json.loads(messages["/axes"][-1][1])) == {"top_left", "top_left_"}


UPGRADE = (
    "GET / HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    f"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: {PROTOCOL}\r\n"
)
FOXGLOVE = "https://app.foxglove.dev"


def _asked(view: LiveView, *headers: str) -> str:
    """Return the first line of the answer to a request for the view with these headers."""
    port = int(view.status()["url"].rsplit(":", 1)[1])
    with socket.create_connection(("127.0.0.1", port), LONGEST_S) as client:
        client.sendall((UPGRADE + "".join(f"{line}\r\n" for line in headers) + "\r\n").encode())
        return client.recv(4096).decode("latin-1").split("\r\n")[0]


@pytest.mark.parametrize(
    "headers",
    [
        ("Host: localhost", "Origin: http://evil.example"),
        ("Host: localhost", "Origin: null"),
        ("Host: localhost", "Origin: "),
        ("Host: localhost", f"Origin: {FOXGLOVE}.evil.example"),
        ("Host: localhost", f"Origin: {FOXGLOVE}", "Origin: http://evil.example"),
        ("Host: rebound.evil.example:8765",),
        ("Host: rebound.evil.example", f"Origin: {FOXGLOVE}"),
        (f"Host: {socket.gethostname()}.local:8765",),  # another machine may answer to it
        ("Host: ",),
    ],
)
def test_a_page_of_another_host_is_rejected(headers: tuple[str, ...]) -> None:
    view = LiveView(block_with_clock(), "bench", listen_tcp("127.0.0.1", 0), [FOXGLOVE])
    view.start()
    try:
        assert " 403 " in _asked(view, *headers)
        told = view.status()
        assert (told["refused"], told["viewers"]) == (1, 0)
        assert told["refused_last"].startswith(("Origin: ", "Host: "))
    finally:
        view.stop()


@pytest.mark.parametrize("origin", [(), (f"Origin: {FOXGLOVE}",), (f"origin: {FOXGLOVE.upper()}",)])
def test_programs_and_allowed_pages_may_watch(origin: tuple[str, ...]) -> None:
    view = LiveView(block_with_clock(), "bench", listen_tcp("127.0.0.1", 0), [f"{FOXGLOVE}/"])
    view.start()
    try:
        for host in ("localhost", "127.0.0.1:8765", "[::1]:1"):
            assert " 101 " in _asked(view, f"Host: {host}", *origin)
    finally:
        view.stop()


def _listening() -> set[str]:
    """Return the inodes of this process' sockets that listen on TCP."""
    mine = set()
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):
            mine.add(str(entry.readlink()).removeprefix("socket:[").removesuffix("]"))
    told = "".join(Path(f"/proc/net/{file}").read_text() for file in ("tcp", "tcp6"))
    lines = [line.split() for line in told.splitlines()]
    return {line[9] for line in lines if line[3] == "0A" and line[9] in mine}


def test_the_view_listens_on_a_single_port() -> None:
    before = _listening()
    with running(block_with_clock()) as view:
        asyncio.run(watch(view.status()["url"], lambda _: True))
        assert len(_listening() - before) == 1


def test_repeated_connections_use_few_descriptors() -> None:
    with running(block_with_clock()) as view:
        address = ("127.0.0.1", int(view.status()["url"].rsplit(":", 1)[1]))
        before, most = len(list(Path("/proc/self/fd").iterdir())), 0
        open_here = []
        for _ in range(400):
            open_here.append(socket.create_connection(address, LONGEST_S))
            used = len(list(Path("/proc/self/fd").iterdir())) - len(open_here)
            most = max(most, used - before)
        assert most <= 6 * MOST_VIEWERS
    for one in open_here:
        one.close()


@contextmanager
def _joined(view: LiveView) -> Iterator[socket.socket]:
    """A viewer that has subscribed to everything and does nothing else."""
    with socket.socket() as viewer:
        viewer.settimeout(60.0)
        viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        viewer.connect(("127.0.0.1", int(view.status()["url"].rsplit(":", 1)[1])))
        viewer.sendall(f"{UPGRADE}Host: localhost\r\n\r\n".encode())
        assert b" 101 " in viewer.recv(4096)
        wanted = [{"id": number, "channelId": number} for number in range(1, 9)]
        text = json.dumps({"op": "subscribe", "subscriptions": wanted}).encode()
        viewer.sendall(_frame(0x81, text))
        yield viewer


def _frame(head: int, data: bytes) -> bytes:
    """Return a client's frame; the mask is 0."""
    return struct.pack(">BBH4x", head, 0xFE, len(data)) + data


def test_a_viewer_that_never_reads_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foxglove_view, "_TIMEOUT_S", 0.2)
    monkeypatch.setattr(foxglove_view, "_MOST_UNSENT_BYTES", 4096)
    block = block_with_clock()
    with running(block) as view, repeating(block, made_rows(100, 1)), _joined(view):
        until(lambda: not view.status()["viewers"], LONGEST_S)
        assert view.status()["error"] == ""


@pytest.mark.parametrize("head", [0x81, 0x82, 0x89, 0x01], ids=["text", "data", "ping", "part"])
def test_a_viewer_that_floods_the_view_is_disconnected(head: int) -> None:
    with running(block_with_clock()) as view, _joined(view) as viewer:
        with suppress(ConnectionError):
            for _ in range(100):  # 13 MB: more than the limit even if all of it is read
                viewer.sendall(_frame(head, b"x" * 125) * 1000)
        until(lambda: not view.status()["viewers"], LONGEST_S)
        assert view.status()["error"] == ""


def test_invalid_messages_have_no_effect() -> None:
    block = block_with_clock()
    nonsense: list[str | bytes] = [
        "",
        "[" * 30_000,
        "[]",
        '{"op": "subscribe"}',
        '{"op": "subscribe", "subscriptions": [1, {"id": -1, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1000}, {"id": [], "x": 1}]}',
        '{"op": "unsubscribe", "subscriptionIds": [[], {}, 99]}',
        b"\x01\x02",
    ]

    async def beside_nonsense(url: str) -> None:
        async with connect(url, subprotocols=[PROTOCOL]) as client:  # type: ignore[list-item]
            for one in nonsense:
                await client.send(one)
            await client.send('{"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 1}]}')
            while not isinstance(data := await asyncio.wait_for(client.recv(), LONGEST_S), bytes):
                pass
            assert data[:5] == struct.pack("<BI", 1, 7)
            await client.send('{"op": "unsubscribe", "subscriptionIds": [7]}')
            with pytest.raises(TimeoutError):
                while True:
                    await asyncio.wait_for(client.recv(), 0.5)

    with running(block) as view, repeating(block, made_rows(100, 1)):
        asyncio.run(beside_nonsense(view.status()["url"]))
        assert view.status()["error"] == ""


def test_renamed_axes_replace_the_topics() -> None:
    block = block_with_clock()

    def renamed(messages: Messages) -> bool:
        axes = [set(json.loads(data)) for _, data in messages.get("/axes", ())]
        if len(axes) == 1:
            block.write_description({"axes": [{"name": "front"}, {"name": "rear"}]})
        return {"front", "rear"} in axes

    with running(block) as view, repeating(block, made_rows(100, 1)):
        channels, messages = asyncio.run(watch(view.status()["url"], renamed))
    assert "front" in json.loads(channels["/axes"]["schema"])["properties"]
    assert {"left", "right"} == set(json.loads(messages["/axes"][0][1]))


def test_idle_connections_make_room_and_excess_viewers_get_503(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with running(block_with_clock()) as view:
        port = int(view.status()["url"].rsplit(":", 1)[1])
        silent = [socket.create_connection(("127.0.0.1", port)) for _ in range(3 * MOST_VIEWERS)]
        assert " 101 " in _asked(view, "Host: localhost")
        watching = []
        for _ in range(MOST_VIEWERS):
            watching.append(socket.create_connection(("127.0.0.1", port), LONGEST_S))
            watching[-1].sendall(f"{UPGRADE}Host: localhost\r\n\r\n".encode())
            assert b" 101 " in watching[-1].recv(4096)
        assert " 503 " in _asked(view, "Host: localhost")
    for one in (*silent, *watching):  # closed with the view
        one.close()
    assert not caplog.records


def test_the_limit_of_viewers_holds_for_simultaneous_connections() -> None:
    with running(block_with_clock()) as view:
        port = int(view.status()["url"].rsplit(":", 1)[1])
        request = f"{UPGRADE}Host: localhost\r\n\r\n".encode()
        watching, answers = [], list[bytes]()
        for at_once in (MOST_VIEWERS - 1, MOST_VIEWERS - 4):
            new = [socket.create_connection(("127.0.0.1", port), LONGEST_S) for _ in range(at_once)]
            for one in new:
                one.sendall(request)
            answers += [one.recv(4096) for one in new]
            watching += new
        assert sum(b" 101 " in answer for answer in answers) == MOST_VIEWERS
        assert sum(b" 503 " in answer for answer in answers) == MOST_VIEWERS - 5
        assert view.status()["viewers"] == MOST_VIEWERS
    for one in watching:
        one.close()


def test_the_view_waits_while_no_cycles_run() -> None:
    block = block_with_clock()
    with running(block) as view:
        time.sleep(0.2)
        assert view.status()["error"] == ""
        with repeating(block, made_rows(100, 1)):
            _, messages = asyncio.run(watch(view.status()["url"], seen("/axes")))
    assert messages["/axes"]


# Cables and platform in the 3D panel.

EXITS, ANCHORS = [[-2.0, 3.0], [2.0, 3.0], [0.0, 0.0]], [[-0.1, 0.0], [0.1, 0.0], [0.0, -0.1]]
LIMITS = {"tension_min_N": [20.0] * 3, "tension_max_N": [120.0] * 3, "slack_N": [3.0] * 3}
DESCRIPTION = {"platform": {"exit_points_m": EXITS, "anchor_points_m": ANCHORS}, "limits": LIMITS}


def doubles(point: list[float]) -> bytes:
    """Return a point in protobuf: a tag and eight bytes each, without zeros."""
    tagged = zip((b"\x09", b"\x11", b"\x19"), point, strict=True)
    return b"".join(tag + struct.pack("<d", value) for tag, value in tagged if value)


def colour(r: float, g: float, b: float) -> bytes:
    return doubles([r, g, b]) + b"\x21" + struct.pack("<d", 1.0)


def test_cables_end_at_the_turned_platform_and_are_coloured_by_tension() -> None:
    half = math.sqrt(0.5)
    pose = np.array([0.5, 1.5, 0.0, half, 0.0, 0.0, half])  # turned by a quarter
    tension = np.array([20.0, 120.0, 1.0])
    scene = CableScene(DESCRIPTION).update(pose, tension, Timestamp(sec=1, nsec=0)).encode()
    for exit_point in EXITS:
        assert doubles([*exit_point, 0.0]) in scene
    coordinates = {
        struct.unpack_from("<d", scene, k + 1)[0]
        for k in range(len(scene) - 9)
        if scene[k : k + 1] == b"\x11"
    }
    # the first anchor point, to the left before, is now below the middle
    assert any(value == pytest.approx(1.4, abs=1e-12) for value in coordinates)
    for shade in (colour(0.0, 0.0, 1.0), colour(1.0, 0.0, 0.0), colour(0.6, 0.6, 0.6)):
        assert shade in scene


def test_equal_tension_limits_still_give_colours() -> None:
    limits = {**LIMITS, "tension_min_N": [50.0] * 3, "tension_max_N": [50.0] * 3}
    view = CableScene({**DESCRIPTION, "limits": limits})
    pose, tension = np.array([0.5, 1.5, 0.0, 1.0, 0.0, 0.0, 0.0]), np.array([49.0, 50.0, 51.0])
    scene = view.update(pose, tension, Timestamp(sec=1, nsec=0)).encode()
    assert colour(0.0, 0.0, 1.0) in scene and colour(1.0, 0.0, 0.0) in scene


def test_robots_without_a_platform_have_no_scene() -> None:
    with pytest.raises((KeyError, TypeError)):
        CableScene({"platform": None})
