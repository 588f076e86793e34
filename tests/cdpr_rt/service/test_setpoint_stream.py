"""The set-point stream over real UDP sockets, with its client and strangers."""

from __future__ import annotations

import math
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from waiting import until

from cdpr_rt.service.listening import ListenError, listen_udp
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import Standing
from tests.cdpr_rt.service.receiver_rig import Robot, converse, robot
from tests.cdpr_rt.service.stream_session_rig import KEY


@pytest.mark.parametrize("key", [None, KEY])
@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_a_client_streams_and_receives_the_robots_state(host: str, key: bytes | None) -> None:
    with robot(key, host) as there, StreamClient(host, there.port, key or there.give()) as client:
        begin = time.monotonic()
        told: dict[str, Any] = {}

        def holds_it() -> bool:
            """The client holds the right, unless a busy machine has made it silent."""
            told.update(there.stream.status())
            return told["holder"] is not None and there.until_ns > time.monotonic_ns()

        # the robot knows the delay once a packet has reported it
        converse(
            client,
            lambda: (
                client.answered >= 5
                and client.state is not None
                and not math.isnan(client.state.round_trip_s)
                and client.state.standing == Standing.ACCEPTED
                and holds_it()
            ),
        )
        assert client.state is not None
        passed_s = time.monotonic() - begin
        assert 0.0 < client.round_trip_s < passed_s
        assert 0.0 <= client.state.round_trip_s < passed_s
        assert there.posted >= 5
        assert told["round_trip_s"] is not None
        client.close()
        until(lambda: there.stream.status()["holder"] is None)
        assert (there.until_ns == 0) is (key is not None), "its own right, or the console's"


def test_a_client_continues_after_the_robot_has_restarted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cdpr_rt.service.stream_client._SILENCE_S", 0.3)
    with robot(KEY) as first:
        port = first.port
        client = StreamClient("127.0.0.1", port, KEY)
        converse(client, lambda: client.answered >= 2)
    for _ in range(30):  # while no robot listens
        client.send((0.0, 0.0, 0.0))
        client.receive()
        time.sleep(0.01)
    again = Robot(KEY, port=port)
    try:
        converse(client, lambda: again.posted >= 3)
    finally:
        client.close()
        again.stream.stop()


def test_a_stream_on_all_addresses_needs_a_key() -> None:
    for host in ("0.0.0.0", "::"):
        with pytest.raises(ListenError, match="others can reach it; give a key"):
            listen_udp(host, 0)
        listen_udp(host, 0, has_key=True).close()


def test_an_address_in_use_is_reported() -> None:
    with robot() as there, StreamClient("127.0.0.1", there.port, there.give()) as client:
        converse(client, lambda: client.answered >= 1)  # with the holder's socket in place
        with pytest.raises(ListenError, match="in use"):
            listen_udp("127.0.0.1", there.port)


FLOOD = """
import socket, sys, time
from cdpr_rt.service.stream_packet import StreamSetpoint, seal
socks = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(8)]
for sock in socks:
    sock.connect(("127.0.0.1", int(sys.argv[1])))
    sock.setblocking(False)
parcels = [b"x" * 128, bytes(1400), b"CDPS" + bytes(124)]
setpoint = StreamSetpoint(5, 1, 1, (0.0, 0.0, 0.0))
parcels += [setpoint.pack(), seal(setpoint, b"a key of its own")]
print(flush=True)
while True:
    for sock in socks:
        for parcel in parcels:
            try:
                sock.send(parcel)
            except OSError:
                time.sleep(0.0002)
"""


@contextmanager
def flooding(port: int) -> Iterator[None]:
    """Send random packets and strangers' set-points as fast as a separate process can."""
    command = [sys.executable, "-c", FLOOD, str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            yield
        finally:
            process.kill()


def test_a_flood_neither_blocks_the_holder_nor_fills_memory() -> None:
    with robot() as there, StreamClient("127.0.0.1", there.port, there.give()) as client:
        converse(client, lambda: client.answered >= 2)
        with flooding(there.port):
            until(lambda: there.count("magic") > 1000)
            size_kB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            cpu_s, begin_s = time.process_time(), time.monotonic()
            sent, posted = client.sent, there.posted
            converse(client, lambda: client.sent >= sent + 60)
            share = (time.process_time() - cpu_s) / (time.monotonic() - begin_s)
            until(lambda: there.posted >= posted + 60)
            assert share < 0.6
            assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < size_kB + 20_000
            assert there.count("session") > 0


def test_file_descriptors_beyond_1024_do_not_end_the_stream() -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2048, limits[1]), limits[1]))
    held: list[int] = []
    try:
        while not held or held[-1] < 1024:
            held.append(os.dup(0))
        with robot() as there, StreamClient("127.0.0.1", there.port, there.give()) as client:
            converse(client, lambda: client.answered >= 5)
            assert there.stream.status()["holder"] is not None
    finally:
        for one in held:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
