"""Recordings over HTTP: only this robot's files, read without occupying the service."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from http.client import HTTPConnection
from pathlib import Path

import httpx
import numpy as np
import pytest
from waiting import until

from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.service.recording import Recorder
from cdpr_rt.service.recording_folder import RecordingFolder
from cdpr_rt.service.recording_reader import CLOSED, KILLED, RecordingReader
from tests.cdpr_rt.service.recording_rig import DESCRIPTION, made_rows
from tests.cdpr_rt.service.service_rig import KEY, Rig

ROBOT = "bench"
RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}
READING = (sys.executable, "-P", "-m", "cdpr_tools.recordings.reading_process")
SLOW_TABLES = (
    sys.executable, "-c", "import sys, time; sys.argv[1] == 'columns' or time.sleep(60); print({})",
)  # fmt: skip
SLOW = (sys.executable, "-c", "import time; time.sleep(60)")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, shared: Rig) -> Iterator[Path]:
    """The rig's recordings: one closed file of 600 cycles, one that is being written, others."""
    folder = tmp_path_factory.mktemp("recordings")
    (folder.parent / "secret").write_text("treasure")
    for is_live in (False, True):
        block = SharedBlock.create(2, 1.0, 1000.0)
        block.counters["start_realtime_ns"] = time.time_ns() - (0 if is_live else 2_000_000_000)
        block.counters["start_monotonic_ns"] = began_ns = time.monotonic_ns()
        block.write_description(DESCRIPTION)
        recorder = Recorder(block, folder, ROBOT, reserve_bytes=0)
        recorder.begin()
        writer = RowWriter(block)
        rows = made_rows(0, 600)
        rows["stamp_ns"] += began_ns - rows["stamp_ns"][0]
        for row in rows:
            writer.slot()[0] = row
            writer.commit()
        recorder._take()
        recorder._sync()
        if not is_live:
            recorder.finish()
    live = max(folder.glob("*.mcap"))
    live.with_name("other-20260101T000000Z-001.mcap").write_bytes(b"treasure")
    live.with_name("bench-20260101T000000Z-001.txt").write_bytes(b"treasure")
    (folder / "bench-20260101T000000Z-002.mcap").symlink_to(folder.parent / "secret")
    os.mkfifo(folder / "bench-20260101T000000Z-003.mcap")
    shared.service.parts.append(recorder)
    yield folder
    shared.service.parts.remove(recorder)
    recorder.finish()


@pytest.fixture
def http(rig: Rig, folder: Path) -> Iterator[httpx.Client]:
    rig.service.recordings = RecordingFolder(folder, ROBOT, READING)
    with closing(rig.client()) as client:
        yield client
    rig.service.recordings = None


def names(http: httpx.Client) -> tuple[str, str]:
    """Return the names of the closed file and of the live one."""
    live, closed, *others = http.get("/recordings").json()["recordings"]
    assert (live["live"], closed["live"], others) == (True, False, [])
    assert closed["session"] in closed["name"]
    assert closed["bytes"] > 1000
    assert 0.5 < closed["duration_s"] < 10.0
    return closed["name"], live["name"]


ATTACKS = [
    "../secret", "..%2fsecret", "%2e%2e%2fsecret", "..%252fsecret", "%2fetc%2fpasswd",
    "/etc/passwd",
    "other-20260101T000000Z-001.mcap", "bench-20260101T000000Z-001.txt", "bench-*.mcap", "%00", ".",
    "bench-20260101T000000Z-002.mcap", "bench-20260101T000000Z-003.mcap", "..", "%5c..%5csecret",
    "bench-20260101T000000Z-002.mcap%00", "bench-20260101T000000Z-999.mcap", "%ff%fe", "a" * 5000,
    "bench-20260101T000000Z-002.mcap%0d%0aX-Evil:1",
]  # fmt: skip


@pytest.mark.parametrize("kind", ["", "/columns?fields=pose", "/table.csv", "/picture.png"])
def test_no_name_reaches_a_file_that_is_not_this_robots_recording(
    rig: Rig, http: httpx.Client, kind: str
) -> None:
    for name in ATTACKS:
        with closing(HTTPConnection("127.0.0.1", rig.guarded_port, 30.0)) as client:
            client.request("GET", f"/recordings/{name}{kind}", headers=RIGHT)  # changes no path
            answer = client.getresponse()
            assert answer.status in (307, 404), name  # a path that ends in / is redirected
            assert b"treasure" not in answer.read(), name
            assert answer.getheader("x-evil") is None


@pytest.mark.parametrize(
    ("query", "why"),
    [
        ("fields=nothing", "nothing"),
        ("fields=pose,--out", "--out"),
        ("fields=pose&from_s=nan", "from_s"),
        ("fields=pose&points=1e9", "points"),
        ("fields=pose&from_s=5&until_s=1", "--until"),
    ],
)
def test_wrong_requests_for_curves_are_rejected_with_the_reason(
    http: httpx.Client, query: str, why: str
) -> None:
    answer = http.get(f"/recordings/{names(http)[0]}/columns?{query}")
    assert answer.status_code == 422
    assert why in answer.json()["error"]


def test_files_arrive_whole_or_in_part_and_a_live_one_is_readable(
    http: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    closed, live = names(http)
    whole = http.get(f"/recordings/{closed}")
    assert whole.content == (folder / closed).read_bytes()
    assert closed in whole.headers["content-disposition"]
    part = http.get(f"/recordings/{closed}", headers={"Range": "bytes=100-199"})
    assert (part.status_code, part.content) == (206, whole.content[100:200])
    assert http.get(f"/recordings/{closed}", headers={"Range": "bytes=9e9-"}).status_code >= 400
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(http.get(f"/recordings/{live}").content)
    reader = RecordingReader(copy)
    assert sum(columns["cycle"].size for columns in reader.cycles(["cycle"])) == 600
    assert reader.ended == KILLED != CLOSED


def test_curves_keep_the_extremes_of_all_cycles(http: httpx.Client) -> None:
    closed, _ = names(http)
    url = f"/recordings/{closed}/columns?fields=position_rad,tension_N"
    every, few = (http.get(f"{url}&points={n}").json() for n in (2000, 40))
    assert (every["cycles"], every["each"], len(every["time_s"])) == (600, 1, 600)
    assert few["each"] > 1
    assert len(few["time_s"]) <= 42
    for name in ("position_rad[left]", "position_rad[right]"):
        assert min(few["columns"][name]) == min(every["columns"][name])
        assert max(few["columns"][name]) == max(every["columns"][name])
    assert np.all(np.diff(few["time_s"]) > 0)
    table = http.get(f"/recordings/{closed}/table.csv?fields=position_rad").text.splitlines()
    assert table[0].replace('"', "") == "elapsed_s,position_rad[left],position_rad[right]"
    assert len(table) == 601


def test_recordings_need_the_key_and_a_ticket_downloads_one(rig: Rig, http: httpx.Client) -> None:
    closed, _ = names(http)
    url = f"{rig.guarded_url}/recordings"
    assert httpx.get(url).status_code == 401
    assert httpx.get(f"{url}/{closed}").status_code == 401
    ticket = httpx.post(f"{rig.guarded_url}/ticket", headers=RIGHT).json()["ticket"]
    assert httpx.get(f"{rig.guarded_url}/events?ticket={ticket}").status_code == 401
    assert httpx.get(f"{url}/{closed}?ticket={ticket}").status_code == 200
    assert httpx.get(f"{url}/{closed}?ticket={ticket}").status_code == 401


def test_slow_reading_delays_nothing_and_ends_with_its_client(
    rig: Rig, http: httpx.Client, folder: Path
) -> None:
    recordings = rig.service.recordings = RecordingFolder(folder, ROBOT, SLOW)
    closed, _ = names(http)
    path = f"/recordings/{closed}/columns?fields=pose"
    with closing(rig.client()) as first, closing(rig.client()) as second:
        for client in (first, second):
            with pytest.raises(httpx.ReadTimeout):
                client.get(path, timeout=1.0)
        began_s = time.monotonic()
        assert http.get("/status").status_code == 200
        assert time.monotonic() - began_s < 1.0
    until(lambda: recordings._readers.total() == 0, 20.0)


def test_two_recordings_are_downloaded_at_a_time_and_block_no_curves(
    rig: Rig, http: httpx.Client, folder: Path
) -> None:
    rig.service.recordings = RecordingFolder(folder, ROBOT, SLOW_TABLES)
    path = f"/recordings/{names(http)[0]}"
    with ExitStack() as waiting:
        for _ in range(2):
            connection = HTTPConnection("127.0.0.1", rig.guarded_port)
            waiting.enter_context(closing(connection))
            connection.request("GET", f"{path}/table.csv", headers=RIGHT)
        readers = rig.service.recordings._readers
        until(lambda: readers.total() == 2)
        answer = http.get(f"{path}/table.csv")
        assert answer.status_code == 409
        assert "already being read" in answer.json()["error"]
        assert http.get(f"{path}/columns").status_code == 200
