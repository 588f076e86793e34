"""Packets of the set-point stream that are damaged, forged or random."""

from __future__ import annotations

import hmac
import itertools
import math
import socket
import struct
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from waiting import until

from cdpr_rt.service import setpoint_stream, stream_client
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import StreamSetpoint
from tests.cdpr_rt.service.receiver_rig import Robot, converse, robot
from tests.cdpr_rt.service.stream_session_rig import KEY, StreamRig

HEAD = struct.Struct("<4sBBHI")
FLOATS = st.floats(allow_nan=True, allow_infinity=True)
BYTES64 = st.integers(0, (1 << 64) - 1)
SIGNED64 = st.integers(-(1 << 63), (1 << 63) - 1)
SETPOINTS = st.builds(
    lambda session, sequence, sent, echo, held, floats, buttons, right: StreamSetpoint(
        session, sequence, sent, tuple(floats[:3]), tuple(floats[3:7]), floats[7], buttons,
        echo, held, right,
    ).pack(),
    st.sampled_from([0, 1, 99, 0xFFFFFFFF]), BYTES64, SIGNED64, SIGNED64, SIGNED64,
    st.lists(FLOATS | st.sampled_from([0.0, 1.0]), min_size=8, max_size=8),
    st.integers(0, 0xFFFFFFFF), st.binary(min_size=16, max_size=16),
)  # fmt: skip
HEADED = st.builds(
    lambda magic, version, kind, status, session, rest: HEAD.pack(
        magic, version, kind, status, session
    ) + rest,
    st.sampled_from([b"CDPS", b"XXXX"]), st.integers(0, 3), st.integers(0, 7),
    st.integers(0, 65535), st.integers(0, 0xFFFFFFFF),
    st.sampled_from([12, 44, 52, 84, 116, 148, 180]).flatmap(
        lambda size: st.binary(min_size=size, max_size=size)
    ),
)  # fmt: skip


def mangled(data: bytes, cut: int, at: int, bit: int) -> bytes:
    if at < len(data):
        data = data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1 :]
    return data[: len(data) - cut] if cut else data


GOOD = StreamSetpoint(1, 1, 1, (0.0, 0.0, 0.0))
HOSTILE = (
    st.binary(max_size=300)
    | HEADED
    | SETPOINTS
    | st.builds(
        mangled,
        SETPOINTS | st.just(GOOD.pack()),
        st.sampled_from([0, 0, 1, 32]),
        st.integers(0, 170),
        st.integers(0, 7),
    )
)


PLAUSIBLE = st.builds(
    lambda sent, floats, scale: StreamSetpoint(
        1, 0, sent, tuple(floats), (0.6, 0.0, -0.8, 0.0), scale
    ),
    st.integers(-10, (1 << 63) - 1),
    st.lists(st.floats(-15.0, 15.0), min_size=3, max_size=3),
    st.floats(0.0, 2.0),
)


@pytest.fixture(scope="module", params=[None, KEY], ids=["open", "keyed"])
def besieged(request: pytest.FixtureRequest) -> Iterator[tuple[Robot, StreamClient]]:
    key = request.param
    with (
        pytest.MonkeyPatch.context() as patch,
        robot(key) as there,
        StreamClient("127.0.0.1", there.port, key or there.give()) as client,
    ):
        patch.setattr(setpoint_stream, "SILENCE_NS", 10_000_000_000)  # longer, for a busy machine
        patch.setattr(stream_client, "_SILENCE_S", 60.0)
        converse(client, lambda: client.answered >= 2)
        yield there, client


@settings(
    max_examples=120,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
@given(packets=st.lists(HOSTILE, min_size=1, max_size=12))
def test_hostile_packets_neither_pass_nor_disturb_the_holder(
    besieged: tuple[Robot, StreamClient], packets: list[bytes]
) -> None:
    there, client = besieged
    client.receive()  # a client without answers for 2.5 s would greet again
    holder = there.stream.status()["holder"]
    before = there.posted, there.count("accepted")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as enemy:
        for packet in packets:
            enemy.sendto(packet, ("127.0.0.1", there.port))
    client.send((0.0, 0.0, 0.2), scale=0.5)
    until(lambda: there.count("accepted") > before[1])  # counted once it is posted
    assert (there.posted, there.count("accepted")) == (before[0] + 1, before[1] + 1)
    assert there.stream.status()["holder"] == holder
    sample = there.block.samples[before[0] % len(there.block.samples)]
    assert sample["position_m"].tolist() == [0.0, 0.0, 0.2]


@settings(max_examples=150)
@given(packets=st.lists(HOSTILE | PLAUSIBLE, min_size=1, max_size=12))
def test_every_sample_that_reaches_the_loop_is_valid(
    alone: StreamRig, packets: list[bytes | StreamSetpoint]
) -> None:
    """The holder signs all packets, including good-byes and leaps of sequence numbers."""
    alone.now_ns += 11_000_000_000  # the right of the previous example has expired
    alone.begin()
    given, numbers = alone.given, itertools.count(1)
    before, total = alone.posted, sum(alone.sessions.counts.values())
    for packet in (GOOD, *packets):
        if isinstance(packet, StreamSetpoint):
            data = replace(packet, session=given.number, sequence=next(numbers)).pack()
        else:
            data = packet[:8] + struct.pack("<I", given.number) + packet[12:]
            data = data if len(packet) >= HEAD.size else packet
        alone.take(data + hmac.digest(given.key, data, "sha256"))
    assert sum(alone.sessions.counts.values()) == total + 1 + len(packets)
    assert alone.posted > before
    samples = alone.block.samples
    for sample in samples[: min(alone.posted, len(samples))]:
        assert all(math.isfinite(x) and abs(x) <= 20.0 for x in sample["position_m"].tolist())
        assert math.hypot(*sample["quaternion"].tolist()) == pytest.approx(1.0)
        assert 0.0 < sample["scale"] <= 100.0
        assert sample["sent_ns"] >= 0


@pytest.fixture(scope="module")
def alone() -> StreamRig:
    """Without sockets, because packets waiting in a closed socket would be lost."""
    return StreamRig()
