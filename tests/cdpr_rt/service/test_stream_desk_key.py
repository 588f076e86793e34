"""Sessions of the set-point stream that begin with a shared key."""

from __future__ import annotations

import hashlib
import hmac
import struct
from dataclasses import replace

import pytest
from stream_desk_rig import BASE, HERE, KEY, MS, THERE, Desk

from cdpr_rt.errors import ControlError
from cdpr_rt.service.stream_desk import SILENCE_NS
from cdpr_rt.service.stream_packet import (
    Bye,
    Fault,
    Hello,
    PacketError,
    Standing,
    StreamAnswer,
    parse,
    right_digest,
    seal,
    session_key,
    stream_key,
)


def test_the_first_sender_holds_the_stream_until_it_is_silent() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    assert desk.answer(BASE, key).standing == Standing.ACCEPTED
    other = replace(BASE, session=8)
    assert desk.answer(other, desk.greet(8, THERE), THERE).standing == Standing.BUSY
    assert desk.answer(other, desk.greet(8)).standing == Standing.BUSY  # from the first's address
    assert desk.posted == 1
    desk.now_ns += SILENCE_NS
    assert desk.answer(other, desk.greet(8, THERE), THERE).standing == Standing.ACCEPTED
    assert desk.block.samples["session"][:2].tolist() == [1, 2]


def test_a_good_bye_frees_the_stream_and_the_right() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    desk.answer(BASE, key)
    assert desk.take(seal(Bye(8, 9), key)) is None
    assert desk.take(seal(Bye(7, 9), key), THERE) is None
    assert desk.desk.holder == HERE
    assert desk.take(seal(Bye(7, 9), key)) is None
    assert (desk.desk.holder, desk.until_ns, desk.lease.holder()) == (None, 0, None)


def test_with_the_key_the_stream_takes_the_right_to_move_and_lives_by_it() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    desk.answer(BASE, key)
    holder = desk.lease.holder()
    assert holder is not None
    assert holder.client == "set-point stream from 127.0.0.1 port 4000"
    assert desk.until_ns == desk.now_ns + SILENCE_NS
    desk.answer(replace(BASE, sequence=2), key, ms=300.0)
    assert desk.until_ns == desk.now_ns + SILENCE_NS


def test_with_the_key_but_without_the_right_nothing_gets_through() -> None:
    desk = Desk(KEY)
    desk.lease.take("somebody", 1.0)
    assert desk.answer(BASE, desk.greet()).standing == Standing.NO_RIGHT
    assert (desk.posted, desk.desk.holder) == (0, None)
    desk.now_ns += 1100 * MS
    assert desk.answer(BASE, desk.greet()).standing == Standing.ACCEPTED


def test_a_right_held_already_is_shared_and_stays_its_holders() -> None:
    desk = Desk(KEY)
    token = desk.lease.take("console", 1.0)
    for wrong in (right_digest("guessed"), right_digest("")):
        packet = replace(BASE, right=wrong)
        assert desk.answer(packet, desk.greet()).standing == Standing.NO_RIGHT
    mine, key = replace(BASE, right=right_digest(token)), desk.greet()
    assert desk.answer(mine, key, ms=800.0).standing == Standing.ACCEPTED
    assert desk.until_ns == desk.now_ns + 1000 * MS
    desk.take(seal(Bye(7, 9), key))
    assert desk.lease.renew(token)
    key = desk.greet()
    assert desk.answer(mine, key).standing == Standing.ACCEPTED
    desk.lease.release(token)
    assert desk.answer(replace(mine, sequence=2), key).standing == Standing.NO_RIGHT
    assert (desk.posted, desk.desk.holder, desk.until_ns) == (2, None, 0)
    late = replace(mine, right=right_digest(desk.lease.take("console", 1.0)))
    assert desk.answer(late, desk.greet(), ms=1001.0).standing == Standing.NO_RIGHT


def test_a_given_session_goes_before_those_that_begin_with_the_key() -> None:
    desk = Desk(KEY)
    desk.begin()
    assert desk.answer(BASE, desk.greet(), THERE).standing == Standing.BUSY
    assert desk.answer(BASE).standing == Standing.ACCEPTED
    desk.lease.release(desk.token)
    assert desk.answer(BASE, desk.greet(), THERE).standing == Standing.ACCEPTED


def test_forged_packets_use_up_nothing_of_who_has_the_key() -> None:
    desk = Desk(KEY)
    wrong = seal(Hello(7, bytes(16)), stream_key(b"another key that is long"))
    for k in range(10_000):
        assert desk.take(wrong, HERE if k % 2 else (f"10.1.{k >> 8}.{k & 255}", 1), ms=0.0) is None
    assert desk.desk.counts["tag"] == 10_000
    assert desk.take(seal(Hello(7, bytes(16)), stream_key(KEY)), ms=0.0) is not None


def test_a_key_must_be_one() -> None:
    with pytest.raises(ControlError, match="at least 16"):
        Desk(b"short")


def test_with_a_key_nobody_without_it_is_answered() -> None:
    desk = Desk(KEY)
    good = seal(BASE, desk.greet())
    for data in (
        BASE.pack(),
        Hello(7, bytes(16)).pack(),
        seal(Hello(7, bytes(16)), stream_key(b"another key that is long")),
        seal(BASE, stream_key(KEY)),
        good[:-1] + bytes([good[-1] ^ 1]),
        good[:40] + bytes([good[40] ^ 1]) + good[41:],
        seal(replace(BASE, session=8), session_key(stream_key(KEY), bytes(16), 8)),
    ):
        assert desk.take(data) is None
    assert desk.posted == 0
    assert (desk.desk.counts["tag"], desk.desk.counts["unsigned"]) == (5, 2)
    assert desk.take(good) is not None
    assert desk.posted == 1


def test_what_was_sent_once_opens_no_second_session() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    heard = [seal(replace(BASE, sequence=k), key) for k in range(1, 4)]
    for data in heard:
        assert desk.take(data) is not None
    desk.take(seal(Bye(7, 4), key))
    posted = desk.posted
    for data in heard:
        assert desk.take(data) is None
        assert desk.take(data, THERE) is None
    assert (desk.posted, desk.desk.holder) == (posted, None)


@pytest.mark.parametrize("obstacle", ["busy", "no right"])
def test_what_was_refused_is_of_no_use_later(obstacle: str) -> None:
    desk = Desk(KEY)
    first, free_after_ms = desk.greet(9, THERE), 1500.0
    if obstacle == "busy":
        assert desk.answer(replace(BASE, session=9), first, THERE).standing == Standing.ACCEPTED
    else:
        desk.lease.take("somebody", 1.0)
    key = desk.greet()
    heard = seal(BASE, key)
    data = desk.take(heard)
    assert data is not None
    state = parse(data, key)
    assert isinstance(state, StreamAnswer)
    assert state.standing in (Standing.BUSY, Standing.NO_RIGHT)
    posted = desk.posted
    assert desk.take(heard, ms=free_after_ms) is None
    assert desk.posted == posted


def test_a_sessions_packets_belong_to_its_address() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    assert desk.answer(BASE, key).standing == Standing.ACCEPTED
    assert desk.take(seal(replace(BASE, sequence=2), key), THERE) is None
    assert desk.answer(replace(BASE, sequence=2), key).standing == Standing.ACCEPTED


def test_answers_cannot_be_made_without_the_key() -> None:
    desk = Desk(KEY)
    key = desk.greet()
    data = desk.take(seal(BASE, key))
    assert data is not None
    with pytest.raises(PacketError) as caught:
        parse(data[:-1] + bytes([data[-1] ^ 1]), key)
    assert caught.value.fault == Fault.TAG
    with pytest.raises(PacketError):
        parse(data, stream_key(KEY))


@pytest.mark.parametrize("key", [None, KEY])
def test_a_sender_written_after_the_documentation_gets_on(key: bytes | None) -> None:
    """Offsets and formulas as docs/setpoint-stream.md has them, without the module's help."""

    def sealed(body: bytearray, secret: bytes) -> bytes:
        return bytes(body) + hmac.new(secret, body, hashlib.sha256).digest()

    def packet(kind: int, size: int) -> bytearray:
        body = bytearray(size)
        struct.pack_into("<4sBBHI", body, 0, b"CDPS", 1, kind, 0, session)
        return body

    desk = Desk(key)
    session, secret = desk.given.number, desk.given.key
    if key is not None:
        session = 4711
        secret = hmac.new(key, b"cdpr-rt set-point stream 1", hashlib.sha256).digest()
        hello = packet(1, 64)
        hello[16:32] = b"0123456789abcdef"
        welcome = desk.take(sealed(hello, secret))
        assert welcome is not None
        assert (len(welcome), welcome[5], welcome[16:32]) == (96, 2, hello[16:32])
        nonce = welcome[32:48] + struct.pack("<I", 4711)
        secret = hmac.new(secret, nonce, hashlib.sha256).digest()
    body = packet(3, 128)
    struct.pack_into("<I", body, 12, 5)
    struct.pack_into("<Qqqq", body, 16, 1, 123456789, desk.now_ns, 20 * MS)
    struct.pack_into("<3d4dd", body, 48, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, 0.0, 0.25)
    answer = desk.take(sealed(body, secret), ms=50.0)
    assert answer is not None
    assert len(answer) == 192
    assert struct.unpack_from("<BHI", answer, 5) == (4, 1, session)
    assert struct.unpack_from("<Qqq", answer, 16) == (1, 123456789, desk.now_ns)
    assert struct.unpack_from("<d", answer, 152)[0] == pytest.approx(0.03)
    sample = desk.block.samples[0]
    assert sample["position_m"].tolist() == [0.1, 0.2, 0.3]
    assert (sample["buttons"], sample["scale"]) == (5, 0.25)
    bye = packet(5, 24)
    struct.pack_into("<Q", bye, 16, 2)
    assert desk.take(sealed(bye, secret)) is None
    assert desk.desk.holder is None
