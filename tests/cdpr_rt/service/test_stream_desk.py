"""Who may stream set-points, and which of them reach the loop."""

from __future__ import annotations

import hashlib
import hmac
import math
import struct
from dataclasses import replace

import pytest

from cdpr_rt.errors import ControlError
from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.service.lease import Lease
from cdpr_rt.service.stream_desk import BURST, SILENCE_NS, MOST_RATE_Hz, StreamDesk, Window
from cdpr_rt.service.stream_packet import (
    Bye,
    Fault,
    Hello,
    PacketError,
    Standing,
    StreamAnswer,
    StreamSetpoint,
    Welcome,
    parse,
    right_digest,
    seal,
    session_key,
    stream_key,
)

KEY = b"a key that is long enough"
HERE, THERE = ("127.0.0.1", 4000), ("127.0.0.1", 4001)
MS = 1_000_000
BASE = StreamSetpoint(7, 1, 1000, (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0), 0.125, 3)


class Desk:
    """A desk with its block and lease, on a clock of its own."""

    def __init__(self, key: bytes | None = None) -> None:
        self.now_ns = 5_000_000_000
        self.block = SharedBlock.create(2, 0.1, 1000.0)
        self.until_ns = 0
        self.lease = Lease(self._publish, lambda: self.now_ns)
        self.desk = StreamDesk(self.block, self.lease, key)

    def _publish(self, until_ns: int) -> None:
        self.until_ns = until_ns

    def take(self, data: bytes, address: tuple[str, int] = HERE, ms: float = 20.0) -> bytes | None:
        self.now_ns += round(ms * MS)
        return self.desk.take(data, address, self.now_ns)

    def answer(
        self,
        packet: StreamSetpoint,
        key: bytes | None = None,
        address: tuple[str, int] = HERE,
        ms: float = 20.0,
    ) -> StreamAnswer:
        data = self.take(seal(packet, key), address, ms)
        assert data is not None
        state = parse(data, key)
        assert isinstance(state, StreamAnswer)
        return state

    def greet(self, session: int = 7, address: tuple[str, int] = HERE) -> bytes:
        """Return the key of a session."""
        shared = stream_key(KEY)
        data = self.take(seal(Hello(session, b"n" * 16), shared), address)
        assert data is not None
        welcome = parse(data, shared)
        assert isinstance(welcome, Welcome)
        assert welcome.nonce == b"n" * 16
        return session_key(shared, welcome.robot_nonce, session)

    @property
    def posted(self) -> int:
        return int(self.block.counters["samples"][0])


def test_a_sample_reaches_the_loop_as_it_was_sent() -> None:
    desk = Desk()
    state = desk.answer(replace(BASE, quaternion=(1.05, 0.0, 0.0, 0.0)))
    assert (state.standing, state.sequence, state.sent_ns) == (Standing.ACCEPTED, 1, 1000)
    assert state.robot_ns == desk.now_ns
    assert math.isnan(state.pose[0])
    sample = desk.block.samples[0]
    assert (sample["sequence"], sample["sent_ns"], sample["arrived_ns"]) == (1, 1000, desk.now_ns)
    assert sample["position_m"].tolist() == [0.1, 0.2, 0.3]
    assert sample["quaternion"].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert (sample["scale"], sample["buttons"]) == (0.125, 3)


def test_the_answer_tells_how_the_robot_stands() -> None:
    desk = Desk()
    row = desk.block.rows[0:1]
    row["state"], row["program"], row["reaction"], row["limit"] = 3, 2, 1, 4
    row["pose"], row["pose_setpoint"] = range(7), range(7, 14)
    desk.block.counters["rows"][0] = 1
    state = desk.answer(BASE)
    assert (state.state, state.program, state.reaction, state.limit) == (3, 2, 1, 4)
    assert state.pose == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert state.pose_setpoint == (7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0)


def test_the_robot_sees_the_delay_as_well() -> None:
    desk = Desk()
    first = desk.answer(BASE)
    held = 5 * MS
    later = replace(BASE, sequence=2, echo_ns=first.robot_ns, echo_held_ns=held)
    second = desk.answer(later, ms=30.0)
    assert second.round_trip_s == pytest.approx(0.025)
    assert desk.desk.round_trip_s == pytest.approx(0.025)


@pytest.mark.parametrize("echo_ns", [-1, 1, 1 << 62, -(1 << 63), (1 << 63) - 1])
def test_a_delay_that_cannot_be_is_not_believed(echo_ns: int) -> None:
    desk = Desk()
    desk.now_ns = 120_000_000_000
    desk.answer(replace(BASE, echo_ns=echo_ns))
    assert math.isnan(desk.desk.round_trip_s)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"position_m": (math.nan, 0.0, 0.0)}, Fault.NOT_FINITE),
        ({"position_m": (0.0, math.inf, 0.0)}, Fault.NOT_FINITE),
        ({"position_m": (0.0, 0.0, 20.1)}, Fault.ABSURD),
        ({"position_m": (1e308, 1e308, 1e308)}, Fault.ABSURD),
        ({"position_m": (1.0, 0.0, 0.0), "scale": 50.0}, Fault.ABSURD),
        ({"quaternion": (math.nan, 0.0, 0.0, 0.0)}, Fault.NOT_FINITE),
        ({"quaternion": (0.0, 0.0, 0.0, 0.0)}, Fault.ABSURD),
        ({"quaternion": (2.0, 0.0, 0.0, 0.0)}, Fault.ABSURD),
        ({"scale": 0.0}, Fault.ABSURD),
        ({"scale": -1.0}, Fault.ABSURD),
        ({"scale": math.inf}, Fault.NOT_FINITE),
        ({"scale": 101.0, "position_m": (0.0, 0.0, 0.0)}, Fault.ABSURD),
        ({"sent_ns": -1}, Fault.ABSURD),
        ({"sent_ns": 1 << 62}, Fault.ABSURD),
        ({"session": 0}, Fault.ABSURD),
    ],
)
def test_nonsense_is_dropped_and_counted(change: dict[str, object], fault: Fault) -> None:
    desk = Desk()
    assert desk.take(replace(BASE, **change).pack()) is None  # type: ignore[arg-type]
    assert desk.desk.counts[fault.name.lower()] == 1
    assert (desk.posted, desk.until_ns) == (0, 0)


def test_other_versions_kinds_and_lengths_are_dropped_and_counted() -> None:
    desk = Desk()
    good = BASE.pack()
    for data in (
        b"",
        good[:-1],
        good + b"\0",
        b"NOPE" + good[4:],
        good[:4] + b"\2" + good[5:],
        good[:5] + b"\x09" + good[6:],
        seal(BASE, stream_key(KEY)),  # tagged, and no key is shared
        Welcome(7, bytes(16), bytes(16)).pack(),
        StreamAnswer(7, Standing.ACCEPTED, 1, 1, 1).pack(),
    ):
        assert desk.take(data) is None
    counts = desk.desk.counts
    assert (counts["size"], counts["magic"], counts["version"], counts["kind"]) == (4, 1, 1, 3)
    assert desk.posted == 0


def test_repeated_and_very_old_ones_count_once() -> None:
    desk = Desk()
    for sequence in (100, 101, 103):
        assert desk.answer(replace(BASE, sequence=sequence)).standing == Standing.ACCEPTED
    assert desk.answer(replace(BASE, sequence=101)).standing == Standing.REPEATED
    assert desk.answer(replace(BASE, sequence=102)).standing == Standing.ACCEPTED  # overtaken
    assert desk.answer(replace(BASE, sequence=102)).standing == Standing.REPEATED
    assert desk.answer(replace(BASE, sequence=39)).standing == Standing.REPEATED
    assert desk.answer(replace(BASE, sequence=40)).standing == Standing.ACCEPTED
    assert desk.answer(replace(BASE, sequence=1 << 63)).standing == Standing.REPEATED
    assert desk.answer(replace(BASE, sequence=104)).standing == Standing.ACCEPTED
    assert desk.posted == 6


def test_the_window_agrees_with_a_set() -> None:
    window, taken = Window(), set[int]()
    numbers = [(i * i * 7 + i * 13) % 200 + i for i in range(500)]
    for number in numbers:
        fits = number not in taken and (not taken or number > max(taken) - 64)
        assert window.take(number) == fits
        if fits:
            taken.add(number)


def test_the_first_sender_holds_the_stream_until_it_is_silent() -> None:
    desk = Desk()
    desk.answer(BASE)
    other = replace(BASE, session=8)
    assert desk.answer(other, address=THERE).standing == Standing.BUSY
    assert desk.answer(BASE, address=THERE).standing == Standing.BUSY  # under the first's name
    assert desk.answer(other).standing == Standing.BUSY  # from the first's address
    assert desk.posted == 1
    assert desk.answer(other, address=THERE, ms=SILENCE_NS / MS).standing == Standing.ACCEPTED
    assert desk.answer(replace(BASE, sequence=2)).standing == Standing.BUSY
    assert desk.block.samples["session"][:2].tolist() == [1, 2]


def test_a_good_bye_frees_the_stream_and_the_right() -> None:
    desk = Desk()
    desk.answer(BASE)
    assert desk.take(Bye(8, 9).pack()) is None
    assert desk.take(Bye(7, 9).pack(), THERE) is None
    assert desk.desk.holder == HERE
    assert desk.take(Bye(7, 9).pack()) is None
    assert (desk.desk.holder, desk.until_ns, desk.lease.holder()) == (None, 0, None)


def test_the_stream_takes_the_right_to_move_and_lives_by_it() -> None:
    desk = Desk()
    desk.answer(BASE)
    holder = desk.lease.holder()
    assert holder is not None
    assert holder.client == "set-point stream from 127.0.0.1 port 4000"
    assert desk.until_ns == desk.now_ns + SILENCE_NS
    desk.answer(replace(BASE, sequence=2), ms=300.0)
    assert desk.until_ns == desk.now_ns + SILENCE_NS


def test_without_the_right_nothing_gets_through() -> None:
    desk = Desk()
    desk.lease.take("somebody", 1.0)
    assert desk.answer(BASE).standing == Standing.NO_RIGHT
    assert (desk.posted, desk.desk.holder) == (0, None)
    desk.now_ns += 1100 * MS
    assert desk.answer(BASE).standing == Standing.ACCEPTED


def test_a_right_held_already_is_shared_and_stays_its_holders() -> None:
    desk = Desk()
    token = desk.lease.take("console", 1.0)
    wrong = replace(BASE, right=right_digest("guessed"))
    assert desk.answer(wrong).standing == Standing.NO_RIGHT
    mine = replace(BASE, right=right_digest(token))
    assert desk.answer(mine, ms=900.0).standing == Standing.ACCEPTED
    assert desk.until_ns == desk.now_ns + 1000 * MS
    desk.take(Bye(7, 9).pack())
    assert desk.lease.renew(token)
    assert desk.answer(mine).standing == Standing.ACCEPTED
    desk.lease.release(token)
    assert desk.answer(replace(mine, sequence=2)).standing == Standing.NO_RIGHT
    assert (desk.posted, desk.desk.holder, desk.until_ns) == (2, None, 0)


def test_a_digest_gives_no_right_that_has_ended() -> None:
    desk = Desk()
    assert desk.answer(replace(BASE, right=right_digest(""))).standing == Standing.NO_RIGHT
    token = desk.lease.take("console", 1.0)
    late = replace(BASE, right=right_digest(token))
    assert desk.answer(late, ms=1001.0).standing == Standing.NO_RIGHT


def test_a_flood_from_the_holder_is_cut_to_what_the_loop_takes() -> None:
    desk = Desk()
    standings = [desk.answer(replace(BASE, sequence=k), ms=0.5).standing for k in range(1, 2001)]
    accepted = standings.count(Standing.ACCEPTED)
    assert abs(accepted - BURST - MOST_RATE_Hz) <= 2
    assert standings.count(Standing.TOO_FAST) == 2000 - accepted
    assert desk.posted == accepted


def test_repeating_what_the_holder_has_sent_neither_silences_nor_outlives_it() -> None:
    desk = Desk()
    desk.answer(BASE)
    for k in range(2, 62):
        standings = {desk.answer(BASE, ms=0.1).standing for _ in range(160)}
        assert standings == {Standing.REPEATED}
        assert desk.answer(replace(BASE, sequence=k)).standing == Standing.ACCEPTED
    for _ in range(SILENCE_NS // (20 * MS)):  # the holder is gone, its packets still come
        desk.answer(BASE)
    other = replace(BASE, session=8)
    assert desk.answer(other, address=THERE).standing == Standing.ACCEPTED


# -- with a shared key


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
    assert desk.desk.counts["tag"] + desk.desk.counts["size"] == 7
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
        tag = hmac.new(secret, body, hashlib.sha256).digest()
        return bytes(body) + (tag if key else b"")

    def packet(kind: int, size: int) -> bytearray:
        body = bytearray(size)
        struct.pack_into("<4sBBHI", body, 0, b"CDPS", 1, kind, 0, 4711)
        return body

    desk = Desk(key)
    secret = hmac.new(key or b"", b"cdpr-rt set-point stream 1", hashlib.sha256).digest()
    hello = packet(1, 64)
    hello[16:32] = b"0123456789abcdef"
    welcome = desk.take(sealed(hello, secret))
    assert welcome is not None
    assert (len(welcome), welcome[5], welcome[16:32]) == (96 if key else 64, 2, hello[16:32])
    nonce = welcome[32:48] + struct.pack("<I", 4711)
    secret = hmac.new(secret, nonce, hashlib.sha256).digest()
    body = packet(3, 128)
    struct.pack_into("<I", body, 12, 5)
    struct.pack_into("<Qqqq", body, 16, 1, 123456789, desk.now_ns, 20 * MS)
    struct.pack_into("<3d4dd", body, 48, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, 0.0, 0.25)
    answer = desk.take(sealed(body, secret), ms=50.0)
    assert answer is not None
    assert len(answer) == (192 if key else 160)
    assert struct.unpack_from("<BHI", answer, 5) == (4, 1, 4711)
    assert struct.unpack_from("<Qqq", answer, 16) == (1, 123456789, desk.now_ns)
    assert struct.unpack_from("<d", answer, 152)[0] == pytest.approx(0.03)
    sample = desk.block.samples[0]
    assert sample["position_m"].tolist() == [0.1, 0.2, 0.3]
    assert (sample["buttons"], sample["scale"]) == (5, 0.25)
    bye = packet(5, 24)
    struct.pack_into("<Q", bye, 16, 2)
    assert desk.take(sealed(bye, secret)) is None
    assert desk.desk.holder is None
