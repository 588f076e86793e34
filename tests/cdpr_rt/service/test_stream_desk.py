"""Who may stream set-points, and which of them reach the loop."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from stream_desk_rig import BASE, HERE, KEY, MS, THERE, Desk

from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.stream_desk import BURST, MOST_RATE_Hz, Window
from cdpr_rt.service.stream_packet import (
    TAG_BYTES,
    Bye,
    Fault,
    Hello,
    PacketError,
    Standing,
    StreamAnswer,
    Welcome,
    parse,
    seal,
    stream_key,
)


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
    assert sample["right"] == desk.block.counters["right_number"][0] == 1


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
    packet = replace(BASE, **{"session": desk.given.number, **change})  # type: ignore[arg-type]
    if packet.session == 0:
        with pytest.raises(PacketError, match="session 0"):
            parse(seal(packet, desk.given.key), desk.given.key)
        return
    assert desk.take(seal(packet, desk.given.key)) is None
    assert desk.desk.counts[fault.name.lower()] == 1
    assert (desk.posted, desk.desk.holder) == (0, None)


def test_other_versions_kinds_and_lengths_are_dropped_and_counted() -> None:
    desk = Desk()
    good, number, key = desk.packet(), desk.given.number, desk.given.key
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
        assert desk.take(data) is None
    counts = desk.desk.counts
    assert (counts["size"], counts["magic"], counts["version"], counts["kind"]) == (3, 1, 1, 3)
    assert counts["unsigned"] == 1
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


# -- sessions that the control interface has given


def test_a_session_belongs_to_the_first_address_that_uses_it() -> None:
    desk = Desk()
    assert desk.answer(BASE).standing == Standing.ACCEPTED
    assert desk.take(desk.packet(2), THERE) is None
    assert desk.desk.counts["session"] == 1
    assert desk.answer(replace(BASE, sequence=2)).standing == Standing.ACCEPTED
    assert desk.desk.holder == HERE


def test_without_a_key_nobody_streams_to_whom_no_session_was_given() -> None:
    """Whoever can open the port: no right is taken for them, and none of them is answered."""
    desk = Desk()
    desk.lease.release(desk.token)
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
        assert desk.take(data) is None
    assert (desk.posted, desk.desk.holder, desk.lease.holder(), desk.until_ns) == (0, None, None, 0)
    counts = desk.desk.counts
    assert (counts["unsigned"], counts["session"]) == (3, 5)


def test_only_the_holder_of_the_right_is_given_a_session() -> None:
    desk = Desk()
    for token in (None, "", "guessed"):
        with pytest.raises(LeaseError):
            desk.desk.give(token)
    desk.now_ns += 10_001 * MS
    with pytest.raises(LeaseError, match="run out"):
        desk.desk.give(desk.token)


def test_nothing_counts_any_more_after_a_good_bye() -> None:
    """Replayed from any port, while the right of its sender is still valid."""
    desk = Desk()
    heard = [desk.packet(k) for k in range(1, 4)]
    for data in heard:
        assert desk.take(data) is not None
    desk.take(seal(Bye(desk.given.number, 4), desk.given.key), THERE)
    assert desk.desk.holder == HERE, "somebody else's good-bye"
    desk.take(seal(Bye(desk.given.number, 4), desk.given.key))
    heard += [desk.packet(k) for k in range(4, 9)]
    for data in heard:
        for address in (HERE, THERE):
            assert desk.take(data, address) is None
    assert (desk.posted, desk.desk.holder) == (3, None)
    desk.given = desk.desk.give(desk.token)
    assert desk.answer(BASE, address=THERE).standing == Standing.ACCEPTED


def test_another_session_of_the_same_holder_ends_the_one_before() -> None:
    desk = Desk()
    desk.answer(BASE)
    before = desk.packet(2)
    desk.given = desk.desk.give(desk.token)
    assert desk.take(before) is None
    assert desk.answer(BASE, address=THERE).standing == Standing.ACCEPTED
    assert desk.take(before) is None
    assert desk.block.samples["session"][:2].tolist() == [1, 2]


def test_a_session_ends_with_the_right_that_it_was_given_for() -> None:
    desk = Desk()
    desk.answer(BASE)
    desk.lease.release(desk.token)
    assert desk.answer(replace(BASE, sequence=2)).standing == Standing.NO_RIGHT
    other = desk.lease.take("somebody else", 10.0)
    assert desk.answer(replace(BASE, sequence=3)).standing == Standing.NO_RIGHT
    assert (desk.posted, desk.desk.holder) == (1, None)
    past, desk.given = desk.packet(4), desk.desk.give(other)
    assert desk.take(past) is None
    assert desk.answer(BASE).standing == Standing.ACCEPTED
    assert desk.block.samples["right"][:2].tolist() == [1, 2]


def test_a_session_renews_its_right_and_neither_takes_nor_releases_it() -> None:
    desk = Desk()
    desk.answer(BASE, ms=9000.0)
    assert desk.until_ns == desk.now_ns + 10_000 * MS
    desk.answer(replace(BASE, sequence=2), ms=9000.0)
    assert desk.until_ns == desk.now_ns + 10_000 * MS
    desk.take(seal(Bye(desk.given.number, 3), desk.given.key))
    assert desk.lease.renew(desk.token).number == 1


def test_who_was_silent_goes_on_while_the_right_lasts() -> None:
    desk = Desk()
    desk.answer(BASE)
    assert desk.answer(BASE, ms=9000.0).standing == Standing.REPEATED
    assert desk.answer(replace(BASE, sequence=2)).standing == Standing.ACCEPTED
    assert desk.answer(replace(BASE, sequence=3), ms=10_001.0).standing == Standing.NO_RIGHT
    assert desk.posted == 2


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
    desk.now_ns = desk.until_ns - 100 * MS
    for _ in range(6):  # the holder is gone, its packets still come
        desk.answer(BASE)
    assert desk.lease.holder() is None
