"""Time on the wire and arbitration order agree with the bits of frames."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.frame import EFF_FLAG, RTR_FLAG, arbitration_key, bits_by_length, worst_case_bits

LAW = settings(max_examples=100)
standard_ids = st.integers(0, 0x7FF)
extended_ids = st.integers(0, 0x1FFFFFFF).map(lambda can_id: can_id | EFF_FLAG)
# payloads with many stuff bits are rare among random ones
payloads = st.one_of(
    st.binary(max_size=8), st.lists(st.sampled_from([0x00, 0xFF, 0x0F, 0xF0, 0x87]), max_size=8)
).map(bytes)


def header_bits(can_id: int) -> str:
    """Return the bits from start of frame to RTR by ISO 11898-1."""
    remote = "1" if can_id & RTR_FLAG else "0"
    if can_id & EFF_FLAG:
        bits = f"{can_id & 0x1FFFFFFF:029b}"
        return "0" + bits[:11] + "11" + bits[11:] + remote
    return "0" + f"{can_id & 0x7FF:011b}" + remote


def crc15(bits: str) -> str:
    register = 0
    for bit in bits:
        flip = (register >> 14) ^ int(bit)
        register = (register << 1) & 0x7FFF
        if flip:
            register ^= 0x4599
    return f"{register:015b}"


def bits_on_wire(can_id: int, data: bytes) -> int:
    """Return the exact length of the frame, with its stuff bits."""
    payload = "" if can_id & RTR_FLAG else "".join(f"{byte:08b}" for byte in data)
    bits = header_bits(can_id) + "00" + f"{len(data):04b}" + payload
    bits += crc15(bits)
    stuffed, last, run = 0, "", 0
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        stuffed += 1
        if run == 5:
            stuffed += 1
            last, run = ("0" if bit == "1" else "1"), 1
    return stuffed + 1 + 2 + 7 + 3


@given(st.one_of(standard_ids, extended_ids), payloads, st.booleans())
@LAW
def test_no_frame_is_longer_than_its_worst_case(can_id: int, data: bytes, remote: bool) -> None:
    can_id |= RTR_FLAG if remote else 0
    worst = bits_by_length(can_id)[len(data)]
    actual = bits_on_wire(can_id, data)
    assert actual <= worst
    # the bound only adds stuff bits: at most one for four bits
    assert worst <= actual * 5 / 4


@pytest.mark.parametrize(("n", "bits"), [(0, 55), (4, 95), (6, 115), (8, 135)])
def test_worst_case_lengths_have_known_values(n: int, bits: int) -> None:
    assert worst_case_bits(n) == bits


def test_eight_drives_at_1_mbit_s_need_1895_us() -> None:
    cycle = worst_case_bits(0) + 8 * (worst_case_bits(4) + worst_case_bits(8))
    assert cycle == 1895


any_id = st.builds(
    lambda can_id, remote: can_id | (RTR_FLAG if remote else 0),
    st.one_of(standard_ids, extended_ids),
    st.booleans(),
)


@given(any_id, any_id, st.booleans())
@LAW
def test_the_frame_with_the_first_dominant_bit_wins(a: int, b: int, share: bool) -> None:
    if share and (a ^ b) & EFF_FLAG:
        # the same leading bits in a standard and an extended frame
        long, short = (a, b) if a & EFF_FLAG else (b, a)
        a, b = long, (short & RTR_FLAG) | (long & 0x1FFFFFFF) >> 18

    def on_wire(can_id: int) -> str:
        # the RTR bit of a standard frame is followed by its dominant IDE bit
        return header_bits(can_id) + ("" if can_id & EFF_FLAG else "0")

    if on_wire(a) != on_wire(b):
        assert (arbitration_key(a) < arbitration_key(b)) == (on_wire(a) < on_wire(b))
    else:
        assert arbitration_key(a) == arbitration_key(b)
