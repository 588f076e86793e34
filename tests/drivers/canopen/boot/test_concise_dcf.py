"""Concise DCF: what goes in comes out, and what is damaged is told."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drivers.canopen.boot import concise_dcf
from cdpr_drivers.canopen.boot.concise_dcf import ConciseDcfError, DcfEntry

entries = st.builds(DcfEntry, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(max_size=40))
lists = st.lists(entries, max_size=12).map(tuple)


def test_the_layout_is_that_of_1f22h() -> None:
    stream = concise_dcf.encode([DcfEntry(0x1017, 0, b"\x64\0"), DcfEntry(0x1400, 1, b"\1\2\0\0")])
    assert (
        stream.hex(" ") == "02 00 00 00 17 10 00 02 00 00 00 64 00 00 14 01 04 00 00 00 01 02 00 00"
    )


@given(lists)
def test_what_goes_in_comes_out(wanted: tuple[DcfEntry, ...]) -> None:
    assert concise_dcf.decode(concise_dcf.encode(wanted)) == wanted


@given(lists, st.data())
def test_a_stream_cut_short_is_refused(wanted: tuple[DcfEntry, ...], data: st.DataObject) -> None:
    stream = concise_dcf.encode(wanted)
    cut = data.draw(st.integers(0, len(stream) - 1))
    with pytest.raises(ConciseDcfError, match="concise DCF"):
        concise_dcf.decode(stream[:cut])


@given(lists, st.binary(min_size=1, max_size=9))
def test_bytes_behind_the_end_are_refused(wanted: tuple[DcfEntry, ...], more: bytes) -> None:
    with pytest.raises(ConciseDcfError, match="follow the last"):
        concise_dcf.decode(concise_dcf.encode(wanted) + more)


@given(st.binary(max_size=60))
def test_noise_is_decoded_or_refused_and_never_anything_else(noise: bytes) -> None:
    try:
        found = concise_dcf.decode(noise)
    except ConciseDcfError:
        return
    assert concise_dcf.encode(found) == noise


def test_a_size_beyond_the_stream_names_the_entry() -> None:
    stream = struct.pack("<IHBI", 1, 0x1A00, 3, 9) + bytes(4)
    with pytest.raises(ConciseDcfError, match=r"entry 1 of 1 \(1A00h:3\) announces 9 bytes, 4"):
        concise_dcf.decode(stream)
