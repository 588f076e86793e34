"""Which clients may stream set-points, and which set-points reach the loop."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.setpoint_stream import BURST, MOST_RATE_Hz, Window
from cdpr_rt.service.stream_packet import (
    TAG_BYTES,
    Bye,
    Hello,
    PacketError,
    PacketFault,
    Standing,
    StreamAnswer,
    Welcome,
    parse,
    seal,
    stream_key,
)
from tests.cdpr_rt.service.stream_session_rig import BASE, HERE, KEY, MS, THERE, StreamRig


def test_a_sample_reaches_the_loop_as_it_was_sent() -> None:
    rig = StreamRig()
    state = rig.answer(replace(BASE, quaternion=(1.05, 0.0, 0.0, 0.0)))
    assert (state.standing, state.sequence, state.sent_ns) == (Standing.ACCEPTED, 1, 1000)
    assert state.robot_ns == rig.now_ns
    assert math.isnan(state.pose[0])
    sample = rig.block.samples[0]
    assert (sample["sequence"], sample["sent_ns"], sample["arrived_ns"]) == (1, 1000, rig.now_ns)
    assert sample["position_m"].tolist() == [0.1, 0.2, 0.3]
    assert sample["quaternion"].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert (sample["scale"], sample["buttons"]) == (0.125, 3)
    assert sample["right"] == rig.block.counters["right_number"][0] == 1


def test_the_answer_contains_the_robots_state_and_pose() -> None:
    rig = StreamRig()
    row = rig.block.rows[0:1]
    row["state"], row["program"], row["reaction"], row["limit"] = 3, 2, 1, 4
    row["pose"], row["pose_setpoint"] = range(7), range(7, 14)
    rig.block.counters["rows"][0] = 1
    state = rig.answer(BASE)
    assert (state.state, state.program, state.reaction, state.limit) == (3, 2, 1, 4)
    assert state.pose == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert state.pose_setpoint == (7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0)


def test_the_robot_also_measures_the_delay() -> None:
    rig = StreamRig()
    first = rig.answer(BASE)
    held = 5 * MS
    later = replace(BASE, sequence=2, echo_ns=first.robot_ns, echo_held_ns=held)
    second = rig.answer(later, ms=30.0)
    assert second.round_trip_s == pytest.approx(0.025)
    assert rig.sessions.round_trip_s == pytest.approx(0.025)


@pytest.mark.parametrize("echo_ns", [-1, 1, 1 << 62, -(1 << 63), (1 << 63) - 1])
def test_an_impossible_delay_is_ignored(echo_ns: int) -> None:
    rig = StreamRig()
    rig.now_ns = 120_000_000_000
    rig.answer(replace(BASE, echo_ns=echo_ns))
    assert math.isnan(rig.sessions.round_trip_s)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"position_m": (math.nan, 0.0, 0.0)}, PacketFault.NOT_FINITE),
        ({"position_m": (0.0, math.inf, 0.0)}, PacketFault.NOT_FINITE),
        ({"position_m": (0.0, 0.0, 20.1)}, PacketFault.ABSURD),
        ({"position_m": (1e308, 1e308, 1e308)}, PacketFault.ABSURD),
        ({"position_m": (1.0, 0.0, 0.0), "scale": 50.0}, PacketFault.ABSURD),
        ({"quaternion": (math.nan, 0.0, 0.0, 0.0)}, PacketFault.NOT_FINITE),
        ({"quaternion": (0.0, 0.0, 0.0, 0.0)}, PacketFault.ABSURD),
        ({"quaternion": (2.0, 0.0, 0.0, 0.0)}, PacketFault.ABSURD),
        ({"scale": 0.0}, PacketFault.ABSURD),
        ({"scale": -1.0}, PacketFault.ABSURD),
        ({"scale": math.inf}, PacketFault.NOT_FINITE),
        ({"scale": 101.0, "position_m": (0.0, 0.0, 0.0)}, PacketFault.ABSURD),
        ({"sent_ns": -1}, PacketFault.ABSURD),
        ({"sent_ns": 1 << 62}, PacketFault.ABSURD),
        ({"session": 0}, PacketFault.ABSURD),
    ],
)
def test_implausible_packets_are_dropped_and_counted(
    change: dict[str, object], fault: PacketFault
) -> None:
    rig = StreamRig()
    packet = replace(BASE, **{"session": rig.given.number, **change})  # type: ignore[arg-type]
    if packet.session == 0:
        with pytest.raises(PacketError, match="session 0"):
            parse(seal(packet, rig.given.key), rig.given.key)
        return
    assert rig.take(seal(packet, rig.given.key)) is None
    assert rig.sessions.counts[fault.name.lower()] == 1
    assert (rig.posted, rig.sessions.holder) == (0, None)


def test_other_versions_kinds_and_lengths_are_dropped_and_counted() -> None:
    rig = StreamRig()
    good, number, key = rig.packet(), rig.given.number, rig.given.key
    for data in (
        b"",
        good[:-1],
        good + b"\0",
        b"NOPE" + good[4:],
        good[:4] + b"\2" + good[5:],
        good[:5] + b"\x09" + good[6:],
        good[:-TAG_BYTES],
        seal(Welcome(number, bytes(16), bytes(16)), key),
        seal(StreamAnswer(number, Standing.ACCEPTED, 1, 1, 1), key),
    ):
        assert rig.take(data) is None
    counts = rig.sessions.counts
    assert (counts["size"], counts["magic"], counts["version"], counts["kind"]) == (3, 1, 1, 3)
    assert counts["unsigned"] == 1
    assert rig.posted == 0


def test_repeated_and_very_old_packets_are_rejected() -> None:
    rig = StreamRig()
    for sequence in (100, 101, 103):
        assert rig.answer(replace(BASE, sequence=sequence)).standing == Standing.ACCEPTED
    assert rig.answer(replace(BASE, sequence=101)).standing == Standing.REPEATED
    assert rig.answer(replace(BASE, sequence=102)).standing == Standing.ACCEPTED  # overtaken
    assert rig.answer(replace(BASE, sequence=102)).standing == Standing.REPEATED
    assert rig.answer(replace(BASE, sequence=39)).standing == Standing.REPEATED
    assert rig.answer(replace(BASE, sequence=40)).standing == Standing.ACCEPTED
    assert rig.answer(replace(BASE, sequence=1 << 63)).standing == Standing.REPEATED
    assert rig.answer(replace(BASE, sequence=104)).standing == Standing.ACCEPTED
    assert rig.posted == 6


def test_the_window_agrees_with_a_set_of_numbers() -> None:
    window, taken = Window(), set[int]()
    numbers = [(i * i * 7 + i * 13) % 200 + i for i in range(500)]
    for number in numbers:
        fits = number not in taken and (not taken or number > max(taken) - 64)
        assert window.take(number) == fits
        if fits:
            taken.add(number)


# -- sessions given by the control interface


def test_a_session_belongs_to_the_first_address_that_uses_it() -> None:
    rig = StreamRig()
    assert rig.answer(BASE).standing == Standing.ACCEPTED
    assert rig.take(rig.packet(2), THERE) is None
    assert rig.sessions.counts["session"] == 1
    assert rig.answer(replace(BASE, sequence=2)).standing == Standing.ACCEPTED
    assert rig.sessions.holder == HERE


def test_without_a_key_only_given_sessions_may_stream() -> None:
    """Packets of strangers are not answered and take no right."""
    rig = StreamRig()
    rig.lease.release(rig.token)
    strangers = (
        BASE.pack(),
        seal(BASE, stream_key(KEY)),
        seal(BASE, bytes(32)),
        seal(BASE, b""),
        Hello(7, bytes(16)).pack(),
        seal(Hello(7, bytes(16)), stream_key(KEY)),
        seal(Hello(7, bytes(16)), b""),
        Bye(7, 1).pack(),
    )
    for data in strangers:
        assert rig.take(data) is None
    assert (rig.posted, rig.sessions.holder, rig.lease.holder(), rig.until_ns) == (0, None, None, 0)
    counts = rig.sessions.counts
    assert (counts["unsigned"], counts["session"]) == (3, 5)


def test_only_the_holder_of_the_right_is_given_a_session() -> None:
    rig = StreamRig()
    for token in (None, "", "guessed"):
        with pytest.raises(LeaseError):
            rig.sessions.issue(token)
    rig.now_ns += 10_001 * MS
    with pytest.raises(LeaseError, match="has expired"):
        rig.sessions.issue(rig.token)


def test_packets_after_a_good_bye_are_ignored() -> None:
    """Also replayed from another port, while the sender's right is still valid."""
    rig = StreamRig()
    heard = [rig.packet(k) for k in range(1, 4)]
    for data in heard:
        assert rig.take(data) is not None
    rig.take(seal(Bye(rig.given.number, 4), rig.given.key), THERE)
    assert rig.sessions.holder == HERE, "a good-bye from another address"
    rig.take(seal(Bye(rig.given.number, 4), rig.given.key))
    heard += [rig.packet(k) for k in range(4, 9)]
    for data in heard:
        for address in (HERE, THERE):
            assert rig.take(data, address) is None
    assert (rig.posted, rig.sessions.holder) == (3, None)
    rig.given = rig.sessions.issue(rig.token)
    assert rig.answer(BASE, address=THERE).standing == Standing.ACCEPTED


def test_a_new_session_of_the_holder_ends_the_previous_one() -> None:
    rig = StreamRig()
    rig.answer(BASE)
    before = rig.packet(2)
    rig.given = rig.sessions.issue(rig.token)
    assert rig.take(before) is None
    assert rig.answer(BASE, address=THERE).standing == Standing.ACCEPTED
    assert rig.take(before) is None
    assert rig.block.samples["session"][:2].tolist() == [1, 2]


def test_a_session_ends_with_its_right() -> None:
    rig = StreamRig()
    rig.answer(BASE)
    rig.lease.release(rig.token)
    assert rig.answer(replace(BASE, sequence=2)).standing == Standing.NO_RIGHT
    other = rig.lease.take("somebody else", 10.0)
    assert rig.answer(replace(BASE, sequence=3)).standing == Standing.NO_RIGHT
    assert (rig.posted, rig.sessions.holder) == (1, None)
    past, rig.given = rig.packet(4), rig.sessions.issue(other)
    assert rig.take(past) is None
    assert rig.answer(BASE).standing == Standing.ACCEPTED
    assert rig.block.samples["right"][:2].tolist() == [1, 2]


def test_a_session_renews_its_right_and_neither_takes_nor_releases_it() -> None:
    rig = StreamRig()
    rig.answer(BASE, ms=9000.0)
    assert rig.until_ns == rig.now_ns + 10_000 * MS
    rig.answer(replace(BASE, sequence=2), ms=9000.0)
    assert rig.until_ns == rig.now_ns + 10_000 * MS
    rig.take(seal(Bye(rig.given.number, 3), rig.given.key))
    assert rig.lease.renew(rig.token).number == 1


def test_a_silent_session_continues_while_the_right_lasts() -> None:
    rig = StreamRig()
    rig.answer(BASE)
    assert rig.answer(BASE, ms=9000.0).standing == Standing.REPEATED
    assert rig.answer(replace(BASE, sequence=2)).standing == Standing.ACCEPTED
    assert rig.answer(replace(BASE, sequence=3), ms=10_001.0).standing == Standing.NO_RIGHT
    assert rig.posted == 2


def test_a_flood_from_the_holder_is_limited_to_the_allowed_rate() -> None:
    rig = StreamRig()
    standings = [rig.answer(replace(BASE, sequence=k), ms=0.5).standing for k in range(1, 2001)]
    accepted = standings.count(Standing.ACCEPTED)
    assert abs(accepted - BURST - MOST_RATE_Hz) <= 2
    assert standings.count(Standing.TOO_FAST) == 2000 - accepted
    assert rig.posted == accepted


def test_replayed_packets_neither_block_the_holder_nor_renew_its_right() -> None:
    rig = StreamRig()
    rig.answer(BASE)
    for k in range(2, 62):
        standings = {rig.answer(BASE, ms=0.1).standing for _ in range(160)}
        assert standings == {Standing.REPEATED}
        assert rig.answer(replace(BASE, sequence=k)).standing == Standing.ACCEPTED
    rig.now_ns = rig.until_ns - 100 * MS
    for _ in range(6):  # the holder is gone, and its packets are repeated
        rig.answer(BASE)
    assert rig.lease.holder() is None
