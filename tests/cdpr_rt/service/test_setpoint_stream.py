"""The set-point stream over real UDP sockets, with its client and strangers."""

from __future__ import annotations

import math
import os
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from cdpr_rt.service import setpoint_stream
from cdpr_rt.service.listening import ListenError, listen_udp
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import (
    Hello,
    Standing,
    StreamSession,
    StreamSetpoint,
    seal,
)
from tests.cdpr_rt.service.receiver_rig import Robot, converse, robot, until
from tests.cdpr_rt.service.stream_session_rig import KEY


@pytest.mark.parametrize("key", [None, KEY])
@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_a_client_streams_and_receives_the_robots_state(host: str, key: bytes | None) -> None:
    with (
        robot(key, host) as there,
        StreamClient(host, there.port, key or there.give()) as client,
    ):
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


def test_a_second_client_waits_until_the_first_has_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(setpoint_stream, "SILENCE_NS", 10_000_000_000)  # longer, for a busy machine
    with robot(KEY) as there, StreamClient("127.0.0.1", there.port, KEY) as second:
        with StreamClient("127.0.0.1", there.port, KEY) as first:
            converse(first, lambda: first.answered >= 2)
            converse(second, lambda: there.count("busy") > 0)
            assert there.stream.status()["holder"] is not None
        taken = there.count("accepted")
        converse(second, lambda: there.count("accepted") >= taken + 3)


def test_strangers_on_this_machine_neither_stream_nor_get_the_right() -> None:
    """Clients that reach the port but not the control interface, also after the right has ended."""
    with robot() as there, StreamClient("127.0.0.1", there.port, there.give()) as hand:
        converse(hand, lambda: hand.answered >= 2)
        until(lambda: hand.receive() is not None and hand.answered == hand.sent)
        there.lease.release(there.token)
        posted = there.posted
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
            StreamClient("127.0.0.1", there.port, KEY) as guest,
            StreamClient("127.0.0.1", there.port, StreamSession(5, bytes(32))) as guesser,
        ):
            stranger.connect(("127.0.0.1", there.port))
            for sequence in range(30):
                stranger.send(StreamSetpoint(5, sequence, sequence, (0.0, 0.0, 0.1)).pack())
                for one in (guest, guesser):
                    one.send((0.0, 0.0, 0.1))
                    assert one.receive() == []
                time.sleep(0.01)
            until(lambda: there.count("unsigned") == 30 and there.count("session") > 30)
            with pytest.raises(BlockingIOError):
                stranger.recv(1, socket.MSG_DONTWAIT)
        assert (there.posted, there.lease.holder(), there.until_ns) == (posted, None, 0)


def test_a_wrong_key_is_not_answered() -> None:
    with robot(KEY) as there:
        with StreamClient("127.0.0.1", there.port, b"another key that is long") as client:
            for _ in range(20):
                assert not client.send((0.0, 0.0, 0.0))
                assert client.receive() == []
                time.sleep(0.01)
        guessed = StreamSession(5, KEY)
        with StreamClient("127.0.0.1", there.port, guessed) as client:
            for _ in range(20):
                client.send((0.0, 0.0, 0.0))
                assert client.receive() == []
        until(lambda: there.count("tag") >= 21)
        assert (there.posted, there.until_ns) == (0, 0)


def test_forged_hellos_do_not_block_a_client_with_the_key() -> None:
    forged = seal(Hello(7, bytes(16)), b"a key of its own")
    with robot(KEY) as there, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as forger:
        forger.connect(("127.0.0.1", there.port))
        for _ in range(10):  # more at a time than any limit of attempts
            before = there.count("tag")
            for _ in range(100):
                forger.send(forged)
            until(lambda least=before + 100: there.count("tag") >= least)
        with StreamClient("127.0.0.1", there.port, KEY) as client:
            converse(client, lambda: forger.send(forged) > 0 and client.answered >= 5)
        assert there.posted >= 5


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
