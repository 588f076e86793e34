"""A real daemon follows a hand over UDP while other clients use the same bus."""

from __future__ import annotations

import itertools
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon_rig import RealDaemon, cdpr
from waiting import until

import cdpr_rt as api
from cdpr_profiles import load_winch
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import Standing, StreamSession, StreamSetpoint

WINCH = load_winch("winch-mpp0923d")
SCALE = 0.25
RATE_Hz = 60.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("led")


@pytest.fixture(scope="module")
def daemon(folder: Path) -> Iterator[RealDaemon]:
    running = RealDaemon(folder, "--record", str(folder / "rec"))
    try:
        yield running
    finally:
        assert running.end() == 0, running.errors()


def port_of(daemon: RealDaemon) -> int:
    return int(daemon.status()["parts"]["stream"]["address"].rpartition(":")[2])


def ask(daemon: RealDaemon, path: str, token: str, **body: Any) -> dict[str, Any]:
    reply = daemon.http.post(path, json=body, headers={"X-Control-Token": token})
    assert reply.status_code == 200, reply.text
    told: dict[str, Any] = reply.json()
    return told


def follow(daemon: RealDaemon) -> str:
    """Take the right to move, enable the drives, and start following. Return the token."""
    daemon.http.post("/disable", json={})
    daemon.wait_for("ready")
    until(lambda: not daemon.http.get("/control").json()["held"])
    token = daemon.http.post("/control", json={"client": "hand", "ttl_s": 5.0}).json()["token"]
    ask(daemon, "/enable", token, program="follow")
    return str(token)


def hand_of(daemon: RealDaemon, token: str, port: int | None = None) -> StreamClient:
    """Return a sender with a session of the holder of the right to move."""
    told = ask(daemon, "/stream", token)
    given = StreamSession(told["session"], bytes.fromhex(told["key"]))
    return StreamClient(told["host"], port or told["port"], given)


def lead(client: StreamClient, path: Callable[[float], float], seconds: float) -> None:
    """Send positions x of the hand along `path` at 60 Hz."""
    begin = time.monotonic()
    for k in itertools.count():
        t = k / RATE_Hz
        if t > seconds:
            return
        time.sleep(max(0.0, begin + t - time.monotonic()))
        client.send((path(t), 0.0, 0.0), scale=SCALE)
        client.receive()


def setpoints(daemon: RealDaemon) -> list[float]:
    """Return the set-points in m of cable, which motors follow softly at this slow cycle."""
    axes = daemon.status()["axes"]
    return [float(axis["setpoint_rad"]) * WINCH.cable_m_per_motor_rad for axis in axes]


def test_a_script_leads_the_robot_and_holds_it_at_the_end(daemon: RealDaemon) -> None:
    with api.connect(socket=daemon.socket) as robot:
        robot.enable()
        before = setpoints(daemon)
        with robot.stream(scale=SCALE) as send:

            def there() -> bool:
                send([0.0, 0.0])
                robot.wait(1.0 / RATE_Hz)
                send([0.02, 0.0])
                robot.wait(0.2)
                return bool(np.subtract(setpoints(daemon), before)[0] > 0.5 * 0.02 * SCALE)

            until(there)
            assert robot.program == "follow"
        assert robot.program == "hold"


def test_the_robot_follows_a_hand_and_stops_when_it_disappears(daemon: RealDaemon) -> None:
    token = follow(daemon)
    before = setpoints(daemon)
    with hand_of(daemon, token) as hand:
        lead(hand, lambda t: 0.04 * min(t, 1.0), 1.5)
        assert hand.state is not None
        assert (hand.state.standing, hand.state.state) == (Standing.ACCEPTED, LoopState.ACTIVE)

        def there() -> bool:
            lead(hand, lambda t: 0.04, 0.1)  # on a busy machine, the robot's time is slower
            moved = np.subtract(setpoints(daemon), before)
            return bool(np.allclose(moved, [0.04 * SCALE, 0.0], rtol=0.0, atol=1e-4))

        until(there)
        # the hand disappears in motion without ending its session
        lead(hand, lambda t: 0.04 + 0.04 * t, 0.5)
        told = daemon.status()
        assert told["parts"]["stream"]["holder"] is not None
        assert told["parts"]["stream"]["packets"]["accepted"] > 60
        until(lambda: daemon.status()["program"] == "hold")
        assert "nobody holds the right to move" in daemon.status()["reason"]
        assert daemon.status()["state"] == "active"
        moved = np.subtract(setpoints(daemon), before)
        # up to the last sample and not beyond
        np.testing.assert_allclose(moved, [0.06 * SCALE, 0.0], atol=4e-4)


def test_packets_without_key_or_session_move_nothing_while_the_holder_is_silent(
    daemon: RealDaemon,
) -> None:
    """The sender is an unprivileged user who can reach the port but not the socket."""
    token = follow(daemon)
    before = setpoints(daemon)
    with hand_of(daemon, token) as hand:
        lead(hand, lambda t: 0.0, 0.2)
    daemon.http.delete("/control", headers={"X-Control-Token": token})
    guesses = StreamSession(7, bytes(32)), b"a key that is long enough"
    for access in guesses:
        with StreamClient("127.0.0.1", port_of(daemon), access) as third_party:
            lead(third_party, lambda t: 0.2 * t, 0.5)
            assert third_party.answered == 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as keyless:
        for k in range(30):
            packet = StreamSetpoint(9, k, k, (0.01 * k, 0.0, 0.0)).pack()
            keyless.sendto(packet, ("127.0.0.1", port_of(daemon)))
            time.sleep(0.02)
    assert not daemon.http.get("/control").json()["held"]
    until(lambda: daemon.status()["parts"]["stream"]["packets"]["unsigned"] == 30)
    assert daemon.status()["program"] == "hold"
    np.testing.assert_allclose(setpoints(daemon), before, atol=1e-4)


def test_a_second_daemon_is_rejected_and_a_listener_is_accepted(
    daemon: RealDaemon, folder: Path
) -> None:
    daemon.http.post("/disable", json={})
    daemon.wait_for("ready")
    other = folder / "other.sock"
    told = cdpr("run", daemon.robot, "--bus", daemon.bus, "--socket", other, "--no-record")
    assert told.returncode == 1
    assert f"process {daemon.children()['loop']} " in told.stderr
    assert "or give --read-only to listen" in told.stderr
    beside = folder / "beside"
    beside.mkdir()
    listener = RealDaemon(beside, "--read-only", "--no-record", bus=daemon.bus)
    try:
        heard = listener.status()["cycle"]["cycle"]
        follow(daemon)
        until(lambda: listener.status()["cycle"]["cycle"] > heard + 100)
        status = listener.status()
        assert (status["state"], status["read_only"]) == ("ready", True)
        held = listener.http.post("/control", json={"client": "x"}).json().get("token", "")
        refused = listener.http.post(
            "/enable", json={"program": "hold"}, headers={"X-Control-Token": held}
        )
        assert refused.status_code >= 400
        assert "listens" in refused.text
        daemon.http.post("/disable", json={})
    finally:
        assert listener.end() == 0, listener.errors()
    assert daemon.wait_for("ready")
