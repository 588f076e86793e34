"""Real daemons, and helpers that their tests share."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from daemon_rig import RealDaemon
from waiting import until

KEY = "the key of a robot in a test"
RIGHT = {"Authorization": f"Bearer {KEY}"}


@contextmanager
def running(
    folder: Path, *options: str, period_s: float, env: dict[str, str] | None = None
) -> Iterator[RealDaemon]:
    one = RealDaemon(folder, "--no-record", *options, period_s=period_s, env=env)
    try:
        yield one
    finally:
        assert one.end() == 0, one.errors()


def with_key(folder: Path) -> tuple[str, ...]:
    """Return the options that make a daemon listen on TCP too, for clients with the key."""
    key_file = folder / "key"
    key_file.write_text(KEY)
    key_file.chmod(0o600)
    return "--http", "127.0.0.1:0", "--key-file", str(key_file)


def happened(daemon: RealDaemon) -> str:
    return "\n".join(" ".join(event) for event in events(daemon)[-20:])


def events(daemon: RealDaemon) -> list[tuple[str, str]]:
    events = daemon.http.get("/events", params={"most": 512}).json()["events"]
    return [(event["kind"], event["text"]) for event in events]


@contextmanager
def with_power(daemon: RealDaemon) -> Iterator[RealDaemon]:
    """Enable the daemon's drives in program hold, with the right to move released."""
    until(lambda: not daemon.status()["control"]["held"])
    if daemon.status()["state"] != "active":
        with holding(daemon) as headers:
            answer = daemon.http.post("/enable", json={}, headers=headers)
            assert answer.status_code == 200, answer.text
    yield daemon
    assert daemon.status()["state"] == "active", happened(daemon)
    daemon.http.post("/hold")
    until(lambda: settled(daemon.status()))


def settled(status: dict[str, Any]) -> bool:
    return all(at_rest(axis) for axis in status["axes"])


def at_rest(axis: dict[str, Any]) -> bool:
    error = axis["position_rad"] - axis["setpoint_rad"]
    return abs(error) < math.radians(8.0) and abs(axis["velocity_rad_s"]) < 0.2


@contextmanager
def holding(daemon: RealDaemon, ttl_s: float = 5.0) -> Iterator[dict[str, str]]:
    answer = daemon.http.post("/control", json={"client": "test", "ttl_s": ttl_s})
    assert answer.status_code == 200, answer.text
    headers = {"X-Control-Token": answer.json()["token"]}
    try:
        yield headers
    finally:
        daemon.http.request("DELETE", "/control", headers=headers)


def angles(daemon: RealDaemon) -> list[float]:
    return [math.degrees(axis["position_rad"]) for axis in daemon.status()["axes"]]


def setpoints(daemon: RealDaemon) -> list[float]:
    return [math.degrees(axis["setpoint_rad"]) for axis in daemon.status()["axes"]]
