"""Sessions of the set-point stream that begin with a shared key."""

from __future__ import annotations

import hashlib
import hmac
import struct
from dataclasses import replace

import pytest

from cdpr_rt.errors import ControlError
from cdpr_rt.service.setpoint_stream import SILENCE_NS
from cdpr_rt.service.stream_packet import (
    Bye,
    Hello,
    Standing,
    StreamAnswer,
    parse,
    right_digest,
    seal,
    session_key,
    stream_key,
)
from tests.cdpr_rt.service.stream_session_rig import BASE, HERE, KEY, MS, THERE, StreamRig


def test_the_first_sender_holds_the_stream_until_it_is_silent() -> None:
    rig = StreamRig(KEY)
    key = rig.greet()
    assert rig.answer(BASE, key).standing == Standing.ACCEPTED
    other = replace(BASE, session=8)
    assert rig.answer(other, rig.greet(8, THERE), THERE).standing == Standing.BUSY
    assert rig.answer(other, rig.greet(8)).standing == Standing.BUSY  # from the first's address
    assert rig.posted == 1
    rig.now_ns += SILENCE_NS
    assert rig.answer(other, rig.greet(8, THERE), THERE).standing == Standing.ACCEPTED
    assert rig.block.samples["session"][:2].tolist() == [1, 2]


def test_a_good_bye_frees_the_stream_and_the_right() -> None:
    rig = StreamRig(KEY)
    key = rig.greet()
    rig.answer(BASE, key)
    assert rig.take(seal(Bye(8, 9), key)) is None
    assert rig.take(seal(Bye(7, 9), key), THERE) is None
    assert rig.sessions.holder == HERE
    assert rig.take(seal(Bye(7, 9), key)) is None
    assert (rig.sessions.holder, rig.until_ns, rig.lease.holder()) == (None, 0, None)


def test_with_the_key_the_stream_takes_and_renews_the_right_to_move() -> None:
    rig = StreamRig(KEY)
    key = rig.greet()
    rig.answer(BASE, key)
    holder = rig.lease.holder()
    assert holder is not None
    assert holder.client == "set-point stream from 127.0.0.1 port 4000"
    assert rig.until_ns == rig.now_ns + SILENCE_NS
    rig.answer(replace(BASE, sequence=2), key, ms=300.0)
    assert rig.until_ns == rig.now_ns + SILENCE_NS


def test_a_stream_shares_the_right_of_its_holder_without_ending_it() -> None:
    rig = StreamRig(KEY)
    token = rig.lease.take("console", 1.0)
    for wrong in (right_digest("guessed"), right_digest("")):
        packet = replace(BASE, right=wrong)
        assert rig.answer(packet, rig.greet()).standing == Standing.NO_RIGHT
    mine, key = replace(BASE, right=right_digest(token)), rig.greet()
    assert rig.answer(mine, key, ms=800.0).standing == Standing.ACCEPTED
    assert rig.until_ns == rig.now_ns + 1000 * MS
    rig.take(seal(Bye(7, 9), key))
    assert rig.lease.renew(token)
    key = rig.greet()
    assert rig.answer(mine, key).standing == Standing.ACCEPTED
    rig.lease.release(token)
    assert rig.answer(replace(mine, sequence=2), key).standing == Standing.NO_RIGHT
    assert (rig.posted, rig.sessions.holder, rig.until_ns) == (2, None, 0)
    late = replace(mine, right=right_digest(rig.lease.take("console", 1.0)))
    assert rig.answer(late, rig.greet(), ms=1001.0).standing == Standing.NO_RIGHT


def test_a_given_session_has_priority_over_sessions_with_the_key() -> None:
    rig = StreamRig(KEY)
    rig.begin()
    assert rig.answer(BASE, rig.greet(), THERE).standing == Standing.BUSY
    assert rig.answer(BASE).standing == Standing.ACCEPTED
    rig.lease.release(rig.token)
    assert rig.answer(BASE, rig.greet(), THERE).standing == Standing.ACCEPTED


def test_forged_packets_do_not_block_a_sender_with_the_key() -> None:
    rig = StreamRig(KEY)
    wrong = seal(Hello(7, bytes(16)), stream_key(b"another key that is long"))
    for k in range(10_000):
        assert rig.take(wrong, HERE if k % 2 else (f"10.1.{k >> 8}.{k & 255}", 1), ms=0.0) is None
    assert rig.sessions.counts["tag"] == 10_000
    assert rig.take(seal(Hello(7, bytes(16)), stream_key(KEY)), ms=0.0) is not None


def test_a_short_key_is_rejected() -> None:
    with pytest.raises(ControlError, match="at least 16"):
        StreamRig(b"short")


def test_packets_without_the_key_are_not_answered() -> None:
    rig = StreamRig(KEY)
    good = seal(BASE, rig.greet())
    for data in (
        BASE.pack(),
        Hello(7, bytes(16)).pack(),
        seal(Hello(7, bytes(16)), stream_key(b"another key that is long")),
        seal(BASE, stream_key(KEY)),
        good[:-1] + bytes([good[-1] ^ 1]),
        good[:40] + bytes([good[40] ^ 1]) + good[41:],
        seal(replace(BASE, session=8), session_key(stream_key(KEY), bytes(16), 8)),
    ):
        assert rig.take(data) is None
    assert rig.posted == 0
    assert (rig.sessions.counts["tag"], rig.sessions.counts["unsigned"]) == (5, 2)
    assert rig.take(good) is not None
    assert rig.posted == 1


def test_a_replayed_packet_opens_no_second_session() -> None:
    rig = StreamRig(KEY)
    key = rig.greet()
    heard = [seal(replace(BASE, sequence=k), key) for k in range(1, 4)]
    for data in heard:
        assert rig.take(data) is not None
    rig.take(seal(Bye(7, 4), key))
    posted = rig.posted
    for data in heard:
        assert rig.take(data) is None
        assert rig.take(data, THERE) is None
    assert (rig.posted, rig.sessions.holder) == (posted, None)


@pytest.mark.parametrize("obstacle", ["busy", "no right"])
def test_a_rejected_packet_cannot_be_used_later(obstacle: str) -> None:
    rig = StreamRig(KEY)
    first, free_after_ms = rig.greet(9, THERE), 1500.0
    if obstacle == "busy":
        assert rig.answer(replace(BASE, session=9), first, THERE).standing == Standing.ACCEPTED
    else:
        rig.lease.take("somebody", 1.0)
    key = rig.greet()
    heard = seal(BASE, key)
    data = rig.take(heard)
    assert data is not None
    state = parse(data, key)
    assert isinstance(state, StreamAnswer)
    assert state.standing in (Standing.BUSY, Standing.NO_RIGHT)
    posted = rig.posted
    assert rig.take(heard, ms=free_after_ms) is None
    assert rig.posted == posted


@pytest.mark.parametrize("key", [None, KEY])
def test_a_sender_written_by_the_documentation_is_accepted(key: bytes | None) -> None:
    """Follow docs/reference/setpoint-stream.md alone, without the module's help."""

    def sealed(body: bytearray, secret: bytes) -> bytes:
        return bytes(body) + hmac.new(secret, body, hashlib.sha256).digest()

    def packet(kind: int, size: int) -> bytearray:
        body = bytearray(size)
        struct.pack_into("<4sBBHI", body, 0, b"CDPS", 1, kind, 0, session)
        return body

    rig = StreamRig(key)
    session, secret = rig.given.number, rig.given.key
    if key is not None:
        session = 4711
        secret = hmac.new(key, b"cdpr-rt set-point stream 1", hashlib.sha256).digest()
        hello = packet(1, 64)
        hello[16:32] = b"0123456789abcdef"
        welcome = rig.take(sealed(hello, secret))
        assert welcome is not None
        assert (len(welcome), welcome[5], welcome[16:32]) == (96, 2, hello[16:32])
        nonce = welcome[32:48] + struct.pack("<I", 4711)
        secret = hmac.new(secret, nonce, hashlib.sha256).digest()
    body = packet(3, 128)
    struct.pack_into("<I", body, 12, 5)
    struct.pack_into("<Qqqq", body, 16, 1, 123456789, rig.now_ns, 20 * MS)
    struct.pack_into("<3d4dd", body, 48, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, 0.0, 0.25)
    answer = rig.take(sealed(body, secret), ms=50.0)
    assert answer is not None
    assert len(answer) == 192
    assert struct.unpack_from("<BHI", answer, 5) == (4, 1, session)
    assert struct.unpack_from("<Qqq", answer, 16) == (1, 123456789, rig.now_ns)
    assert struct.unpack_from("<d", answer, 152)[0] == pytest.approx(0.03)
    sample = rig.block.samples[0]
    assert sample["position_m"].tolist() == [0.1, 0.2, 0.3]
    assert (sample["buttons"], sample["scale"]) == (5, 0.25)
    bye = packet(5, 24)
    struct.pack_into("<Q", bye, 16, 2)
    assert rig.take(sealed(bye, secret)) is None
    assert rig.sessions.holder is None
