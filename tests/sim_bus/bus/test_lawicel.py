"""The Lawicel protocol of the serial adapter, command by command."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.bus.gateways import LawicelAdapter
from cdpr_sim_bus.frame import EFF_FLAG, RTR_FLAG, pack_frame

STANDARD = st.integers(0, 0x7FF)
EXTENDED = st.integers(0, 2**29 - 1).map(lambda i: i | EFF_FLAG)
FRAMES = st.one_of(
    st.builds(pack_frame, STANDARD | EXTENDED, st.binary(max_size=8)),
    st.builds(pack_frame, (STANDARD | EXTENDED).map(lambda i: i | RTR_FLAG)),
)


class Bench:
    """An adapter on a bus at 1 Mbit/s. It keeps the frames that it transmits."""

    def __init__(self, *lines: bytes) -> None:
        self.sent: list[bytes] = []
        self.room = True
        self.adapter = LawicelAdapter(1_000_000, self._transmit)
        for line in lines:
            assert self.adapter.obey(line) == b"\r"

    def _transmit(self, frame: bytes) -> bool:
        if self.room:
            self.sent.append(frame)
        return self.room


def test_a_channel_opens_once_and_only_with_a_bit_rate() -> None:
    adapter = Bench().adapter
    assert adapter.obey(b"O") == b"\a"
    assert adapter.obey(b"C") == b"\a"
    assert [adapter.obey(b) for b in (b"S8", b"O", b"O", b"S6", b"C", b"S6", b"O")] == [
        b"\r", b"\r", b"\a", b"\a", b"\r", b"\r", b"\r",
    ]  # fmt: skip
    assert not adapter.on_bus  # 500 kbit/s


@pytest.mark.parametrize(("registers", "right"), [(b"s0014", True), (b"s001C", False)])
def test_bus_timing_registers_set_the_bit_rate(registers: bytes, right: bool) -> None:
    # 8 quanta of 8 MHz make 1 Mbit/s, 16 make 500 kbit/s
    assert Bench(registers, b"O").adapter.on_bus is right


@given(FRAMES)
@settings(max_examples=100)
def test_the_text_of_a_frame_sends_the_same_frame(frame: bytes) -> None:
    bench = Bench(b"S8", b"O")
    line = bench.adapter.text_of(frame, 0.0)
    assert bench.adapter.obey(line[:-1]) == (b"Z\r" if line[:1] in b"TR" else b"z\r")
    assert bench.sent == [frame]


@given(st.lists(st.binary(max_size=40), max_size=8))
@settings(max_examples=100)
def test_garbage_gets_short_answers(chunks: list[bytes]) -> None:
    bench = Bench(b"S8", b"O")
    for chunk in chunks:
        for line in bench.adapter.lines(chunk + b"\r"):
            answer = bench.adapter.obey(line)
            assert answer.endswith((b"\r", b"\a"))
            assert len(answer) < 10


@given(st.binary(max_size=60), st.lists(st.integers(0, 60), max_size=5))
@settings(max_examples=100)
def test_lines_do_not_depend_on_how_input_is_split(data: bytes, cuts: list[int]) -> None:
    whole = Bench().adapter.lines(data)
    edges = sorted({0, len(data), *(min(cut, len(data)) for cut in cuts)})
    adapter = Bench().adapter
    parts = [line for a, b in itertools.pairwise(edges) for line in adapter.lines(data[a:b])]
    assert parts == whole


@pytest.mark.parametrize(
    "line",
    [b"t8000", b"t1819", b"t18120A", b"t1812ABCDE", b"tXYZ0", b"T200000000", b"t 810", b"r18111"],
)
def test_a_malformed_frame_is_rejected(line: bytes) -> None:
    bench = Bench(b"S8", b"O")
    assert bench.adapter.obey(line) == b"\a"
    assert bench.sent == []


def test_a_closed_or_listen_only_adapter_sends_nothing() -> None:
    closed, listening = Bench(b"S8"), Bench(b"S8", b"L")
    for bench in (closed, listening):
        assert bench.adapter.obey(b"t0800") == b"\a"
        assert bench.sent == []
    assert listening.adapter.on_bus


def test_flags_report_a_full_buffer_once() -> None:
    bench = Bench(b"S8", b"O")
    bench.room = False
    assert bench.adapter.obey(b"t0800") == b"\a"
    assert [bench.adapter.obey(b"F") for _ in range(2)] == [b"F02\r", b"F00\r"]


def test_an_adapter_with_the_wrong_bit_rate_becomes_error_passive() -> None:
    bench = Bench(b"S6", b"O")
    assert bench.adapter.obey(b"F") == b"F00\r"
    assert bench.adapter.obey(b"t0800") == b"\a"
    flags = [int(bench.adapter.obey(b"F")[1:3], 16) for _ in range(2)]
    assert flags[0] & 0xA4 == 0xA4
    assert flags[1] & 0x24 == 0x24  # the state persists
    assert bench.sent == []


def test_time_stamps_are_the_milliseconds_of_the_minute() -> None:
    bench = Bench(b"S8", b"Z1", b"O")
    assert bench.adapter.text_of(pack_frame(0x181, b"\x01"), 61.5) == b"t18110105DC\r"
    assert bench.adapter.obey(b"Z0") == b"\a"
