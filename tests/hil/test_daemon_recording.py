"""A daemon's recording is complete despite a full disk and the death of the writer."""

from __future__ import annotations

import json
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon_rig import RealDaemon, cdpr
from mcap.reader import make_reader
from waiting import until
from websockets.sync.client import connect

PERIOD_s = 0.01


def output_of(*arguments: str | Path) -> dict[str, Any]:
    """Run a command with --json that must succeed. Return its output."""
    result = cdpr(*arguments, "--json")
    assert result.returncode == 0, result.stderr
    value: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return value


def messages(path: Path, topic: str) -> list[tuple[int, dict[str, Any]]]:
    """Read messages of a file with the `mcap` package."""
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(topics=[topic])
        return [(message.log_time, json.loads(message.data)) for _, _, message in found]


def fill_the_disk_for(service: int, daemon: RealDaemon, folder: Path) -> None:
    """Limit the size of the service's files. Wait until it reports that, with an active robot."""
    (path,) = folder.iterdir()
    size = path.stat().st_size
    resource.prlimit(service, resource.RLIMIT_FSIZE, (size, size))
    until(lambda: daemon.status()["parts"]["recording"]["error"])
    status = daemon.status()
    assert status["state"] == "active"
    assert "File too large" in status["parts"]["recording"]["error"]
    events = daemon.http.get("/events").json()["events"]
    assert any("File too large" in event["text"] for event in events)


def watch_live(daemon: RealDaemon) -> dict[str, Any]:
    """Return the first message on axes that a client of the live view receives."""
    url = until(lambda: daemon.status()["parts"]["live_view"]["url"])
    with connect(url, subprotocols=["foxglove.sdk.v1"]) as client:  # type: ignore[list-item]
        while True:
            message = client.recv(timeout=60.0)
            if isinstance(message, bytes):
                value: dict[str, Any] = json.loads(message[13:])
                return value
            for channel in json.loads(message).get("channels", []):
                if channel["topic"] == "/axes":
                    wanted = [{"id": 1, "channelId": channel["id"]}]
                    client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


@contextmanager
def few_files(most: int) -> Iterator[None]:
    """Limit the open files of processes started in this block, unless they raise the limit."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    """Return the files of a run with a full disk and a killed service.

    Both happen while the motors have power. The restarted service can write again.
    """
    folder = tmp_path_factory.mktemp("run")
    recordings = folder / "recordings"
    with few_files(512):
        daemon = RealDaemon(folder, "--record", str(recordings), "--live", "0")
    try:
        output_of("enable", *daemon.at)
        assert set(watch_live(daemon)) == {"left", "right"}
        output_of("jog", "left=30", "--seconds", "1", *daemon.at)
        service = daemon.children()["service"]
        # enough for files and clients, but not for endless clients, which take memory too
        assert 512 < resource.prlimit(service, resource.RLIMIT_NOFILE)[0] <= 4096
        fill_the_disk_for(service, daemon, recordings)
        os.kill(service, signal.SIGKILL)
        until(lambda: daemon.children().get("service", service) != service)
        daemon.wait_for("active")
        output_of("disable", *daemon.at)
    finally:
        assert daemon.end() == 0
    yield sorted(recordings.iterdir())


def test_no_cycle_is_missing_in_the_recording(recorded: list[Path]) -> None:
    assert [path.name[-8:] for path in recorded] == ["001.mcap", "002.mcap"]
    rows = [row for path in recorded for _, row in messages(path, "/cycle")]
    cycles = np.array([row["cycle"] for row in rows])
    assert cycles.size > 200
    assert (np.diff(cycles) == 1).all()
    assert np.allclose(np.diff([row["time_s"] for row in rows]), PERIOD_s, atol=1e-6)
    timings = [row for path in recorded for _, row in messages(path, "/timing")]
    assert [row["cycle"] for row in timings] == cycles.tolist()
    stamps = np.array([row["stamp_ns"] for row in timings])
    assert (np.diff(stamps) > 0).all()


def test_the_rows_show_what_the_robot_did(recorded: list[Path]) -> None:
    rows = [row for path in recorded for _, row in messages(path, "/cycle")]
    states = [row["state"] for row in rows]
    changes = [states[0], *(b for a, b in pairwise(states) if a != b)]
    assert changes[-3:] == [2, 3, 2]  # ready, active, ready
    powered = np.array(states) == 3
    torque = np.array([row["torque_sent_Nm"] for row in rows])
    assert (torque[~powered] == 0.0).all() and (np.abs(torque[powered, 0]) > 0.01).any()
    setpoint = np.degrees([row["setpoint_rad"] for row in rows])
    moved = setpoint[powered].max(axis=0) - setpoint[powered][0]
    assert 10.0 < moved[0] < 45.0 and abs(moved[1]) < 1.0
    words = np.array([row["statusword"] for row in rows])
    enabled = ((words[powered] & 0x6F) == 0x27).all(axis=1)  # operation enabled
    assert enabled.mean() > 0.8


def test_the_recording_contains_events_and_description(recorded: list[Path]) -> None:
    texts = [value["text"] for path in recorded for _, value in messages(path, "/events")]
    for text in ("state ready", "state active", "program jog", "program hold"):
        assert text in texts
    for path in recorded:
        description = messages(path, "/description")[0][1]
        assert [axis["name"] for axis in description["axes"]] == ["left", "right"]
        assert description["period_s"] == PERIOD_s


def test_cdpr_log_finds_as_many_messages_as_the_mcap_reader(recorded: list[Path]) -> None:
    first, second = output_of("log", "info", str(recorded[0].parent))["recordings"]
    assert (first["ended"], second["ended"]) == ("not closed", "closed")
    assert first["missing_cycles"] == second["missing_cycles"] == 0
    for path, figures in zip(recorded, (first, second), strict=True):
        assert figures["rows"] == len(messages(path, "/cycle"))
        assert len(figures["events"]) == len(messages(path, "/events"))
