"""Concise DCF has the layout of 1F22h, decoded here independently."""

from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from cdpr_drivers.canopen.configuration import Configuration, DcfEntry

entries = st.builds(DcfEntry, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(max_size=40))
lists = st.lists(entries, max_size=12).map(tuple)


def decoded(stream: bytes) -> tuple[DcfEntry, ...]:
    """Decode a concise DCF by CiA 302. Fail if it is too short or too long."""
    (count,) = struct.unpack_from("<I", stream)
    at, found = 4, []
    for _ in range(count):
        index, sub, size = struct.unpack_from("<HBI", stream, at)
        found.append(DcfEntry(index, sub, stream[at + 7 : at + 7 + size]))
        at += 7 + size
    assert at == len(stream)
    return tuple(found)


def test_concise_dcf_has_the_layout_of_1f22h() -> None:
    wanted = Configuration((DcfEntry(0x1017, 0, b"\x64\0"), DcfEntry(0x1400, 1, b"\1\2\0\0")))
    assert (
        wanted.concise_dcf().hex(" ")
        == "02 00 00 00 17 10 00 02 00 00 00 64 00 00 14 01 04 00 00 00 01 02 00 00"
    )


@given(lists)
def test_concise_dcf_survives_a_round_trip(wanted: tuple[DcfEntry, ...]) -> None:
    assert decoded(Configuration(wanted).concise_dcf()) == wanted
