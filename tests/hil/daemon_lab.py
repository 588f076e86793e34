"""Real daemons that are asked, or move, and what is common to their tests."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from daemon_rig import RealDaemon, until

KEY = "the key of a robot in a test"
RIGHT = {"Authorization": f"Bearer {KEY}"}
TOO_BUSY = "answers to SYNC are unsteady"
# what another test beside this one does to the machine is none of its business
PATIENT = """
missed_cycles = 500
missed_in_window = 5000
window_cycles = 10000
stale_cycles = 5000
late_s = 10.0
"""


@contextmanager
def running(folder: Path, *options: str, period_s: float) -> Iterator[RealDaemon]:
    one = RealDaemon(folder, "--no-record", *options, period_s=period_s, limits=PATIENT)
    try:
        yield one
    finally:
        assert one.end() == 0, one.errors()


def with_key(folder: Path) -> tuple[str, ...]:
    """Return the options with which it listens on TCP too, to who knows the key."""
    key_file = folder / "key"
    key_file.write_text(KEY)
    key_file.chmod(0o600)
    return "--http", "127.0.0.1:0", "--key-file", str(key_file)


def happened(daemon: RealDaemon) -> str:
    return "\n".join(" ".join(event) for event in events(daemon)[-20:])


def events(daemon: RealDaemon) -> list[tuple[str, str]]:
    told = daemon.http.get("/events", params={"most": 512}).json()["events"]
    return [(event["kind"], event["text"]) for event in told]


@contextmanager
def with_power(daemon: RealDaemon) -> Iterator[RealDaemon]:
    """Have it hold; nobody holds the right to move.

    What ended an earlier test, as a machine too busy for the simulated bus, is acknowledged.
    """
    until(lambda: not daemon.status()["control"]["held"])
    if daemon.status()["state"] != "active":
        until(daemon._is_ready)
        with holding(daemon) as headers:
            answer = daemon.http.post("/enable", json={}, headers=headers)
            assert answer.status_code == 200, answer.text
    yield daemon
    status = daemon.status()
    if TOO_BUSY in status["reason"]:
        return
    assert status["state"] == "active", happened(daemon)
    daemon.http.post("/hold")
    until(lambda: settled(daemon.status()))


def settled(status: dict[str, Any]) -> bool:
    return TOO_BUSY in status["reason"] or all(at_rest(axis) for axis in status["axes"])


def again_where_the_machine_was_too_busy(test: Callable[..., None]) -> Callable[..., None]:
    """Try up to three times where the simulated bus did not keep pace, which ends the motion."""

    @functools.wraps(test)
    def tried(**given: Any) -> None:
        for left in (2, 1, 0):
            try:
                test(**given)
                return
            except AssertionError:
                if not left or TOO_BUSY not in given["quick"].status()["reason"]:
                    raise
                with with_power(given["quick"]):
                    pass

    return tried


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
