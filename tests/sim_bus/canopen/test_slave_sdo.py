"""The SDO server with the client of the `canopen` package and with handmade frames."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from pathlib import Path

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.canopen.sdo import TIMEOUT_S
from tests.sim_bus.canopen.slave_bench import NODE, Bench

DOMAIN = 0x2F10
contents = st.one_of(st.binary(max_size=40), st.binary(min_size=850, max_size=2000))


def abort_of(answer: bytes) -> tuple[int, int, int]:
    command, index, sub, code = struct.unpack("<BHBI", answer)
    assert command == 0x80
    return index, sub, code


def refused(bench: Bench, index: int, sub: int, data: bytes | None = None) -> int:
    """Return the abort code of a read, or of a write if `data` is given."""
    with pytest.raises(canopen.SdoAbortedError) as caught:
        if data is None:
            bench.read(index, sub)
        else:
            bench.write(index, sub, data)
    return caught.value.code


@pytest.fixture(scope="module")
def shared(odd_eds_path: Path) -> Bench:
    return Bench(odd_eds_path).boot()


@settings(max_examples=60)
@given(content=contents, block_down=st.booleans(), block_up=st.booleans(), crc=st.booleans())
def test_bytes_survive_each_kind_of_transfer(
    shared: Bench, content: bytes, block_down: bool, block_up: bool, crc: bool
) -> None:
    sdo = shared.remote.sdo
    if block_down:
        stream = sdo.open(
            DOMAIN, 0, "wb", size=len(content), block_transfer=True, request_crc_support=crc
        )
        if content:
            stream.write(content)
        else:
            stream.raw.send(b"", end=True)
        stream.close()
    else:
        sdo.download(DOMAIN, 0, content, force_segment=len(content) % 2 == 0)
    assert shared.od.get(DOMAIN) == content
    with sdo.open(DOMAIN, 0, "rb", block_transfer=block_up, request_crc_support=crc) as stream:
        assert stream.read() == content


@pytest.mark.parametrize("lost", [1, 3, 100, 126])
def test_block_download_survives_a_lost_segment(bench: Bench, lost: int) -> None:
    content = bytes(range(256)) * 5
    bench.network.drop_to_slave = {1 + lost}
    with bench.remote.sdo.open(DOMAIN, 0, "wb", size=len(content), block_transfer=True) as stream:
        stream.write(content)
    assert bench.od.get(DOMAIN) == content


def test_block_upload_repeats_from_the_acknowledged_segment(bench: Bench) -> None:
    content = bytes(range(100))
    bench.od.set(DOMAIN, 0, content)
    request = 0x600 + NODE
    bench.sdo(struct.pack("<BHBBB", 0xA4, DOMAIN, 0, 10, 0))
    first = [data for _, data in bench.send(request, bytes([0xA3]).ljust(8, b"\0"))]
    assert [data[0] for data in first] == list(range(1, 11))
    again = [data for _, data in bench.send(request, bytes([0xA2, 4, 5]).ljust(8, b"\0"))]
    assert [data[0] for data in again] == [1, 2, 3, 4, 5]
    assert again[0][1:] == content[28:35]
    rest = [data for _, data in bench.send(request, bytes([0xA2, 5, 127]).ljust(8, b"\0"))]
    assert [data[0] for data in rest] == [1, 2, 3, 4, 5, 0x86]
    end = bench.sdo(bytes([0xA2, 6, 127]))
    received = b"".join(d[1:] for d in first[:4] + again + rest)
    unused = end[0] >> 2 & 7
    assert end[0] & 0xE3 == 0xC1
    assert received[: len(received) - unused] == content
    assert int.from_bytes(end[1:3], "little") == crc_hqx(content, 0)
    assert bench.send(request, bytes([0xA1]).ljust(8, b"\0")) == []


def test_a_block_upload_of_a_small_object_switches_to_expedited(bench: Bench) -> None:
    answer = bench.sdo(struct.pack("<BHBBB", 0xA4, 0x1000, 0, 127, 10))
    assert answer == bytes.fromhex("43001000") + (0x00020192).to_bytes(4, "little")


def test_a_block_download_with_wrong_crc_is_rejected_and_writes_nothing(bench: Bench) -> None:
    bench.od.set(DOMAIN, 0, b"old")
    bench.sdo(struct.pack("<BHBI", 0xC6, DOMAIN, 0, 7))
    bench.sdo(b"\x81abcdefg")
    answer = bench.sdo(struct.pack("<BH", 0xC1, crc_hqx(b"abcdefg", 0) ^ 1))
    assert abort_of(answer) == (DOMAIN, 0, 0x05040004)
    assert bench.od.get(DOMAIN) == b"old"


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x5FFF, 0, None, 0x06020000),
        (0x5FFF, 0, b"\0", 0x06020000),
        (0x0005, 0, None, 0x06020000),
        (0x6064, 1, None, 0x06090011),
        (0x2106, 0, None, 0x06010001),
        (0x6064, 0, b"\0\0\0\0", 0x06010002),
        (0x1008, 0, b"name", 0x06010002),
        (0x6040, 0, b"\0", 0x06070013),
        (0x6040, 0, b"\0\0\0", 0x06070012),
        (0x6040, 0, bytes(20), 0x06070012),
        (0x1600, 0, b"\x09", 0x06090031),
        (0x1003, 1, None, 0x08000024),
        (0x1003, 0, b"\x01", 0x06090030),
        (0x1010, 1, b"evas", 0x08000020),
        (0x1011, 1, b"save", 0x08000020),
        (0x1005, 0, b"\x80\0\0\x40", 0x06090030),
        (0x1019, 0, b"\x01", 0x06090030),
        (0x1014, 0, b"\x90\0\0\0", 0x06090030),
        (0x2103, 0, b"\0\xd8", 0x06090030),
        (0x2108, 0, b"\x02", 0x06090031),
    ],
)
def test_rejected_accesses_have_the_abort_code_of_the_standard(
    odd_bench: Bench, index: int, sub: int, data: bytes | None, code: int
) -> None:
    before = {(e.index, e.sub): e.value for e in odd_bench.od}
    assert refused(odd_bench, index, sub, data) == code
    assert {(e.index, e.sub): e.value for e in odd_bench.od} == before


@pytest.mark.parametrize(
    ("index", "encoded"),
    [
        (0x2100, b"\x01\x02\x80"),
        (0x2101, bytes(range(8))),
        (0x2102, struct.pack("<d", -1.25)),
        (0x2103, "größe".encode("utf-16-le")),
        (0x2104, b"\0\xff"),
        (0x2105, b"another name"),
        (0x2107, b"\xff" * 7),
        (0x2108, b"\x00"),
    ],
)
def test_objects_of_each_type_keep_written_values(
    odd_bench: Bench, index: int, encoded: bytes
) -> None:
    odd_bench.write(index, 0, encoded)
    assert odd_bench.read(index) == encoded


def test_values_beyond_the_limits_of_an_object_are_rejected(bench: Bench) -> None:
    torque = bench.od.entry(0x6071)
    torque.low, torque.high = -100, 50
    assert refused(bench, 0x6071, 0, struct.pack("<h", -101)) == 0x06090032
    assert refused(bench, 0x6071, 0, struct.pack("<h", 51)) == 0x06090031
    for value in (-100, 50):
        bench.write(0x6071, 0, struct.pack("<h", value))
        assert bench.od.get(0x6071) == value


def test_an_expedited_download_without_size_uses_the_size_of_the_object(bench: Bench) -> None:
    assert bench.sdo(bytes.fromhex("2240600006000000"))[0] == 0x60
    assert bench.od.get(0x6040) == 6


def test_wrong_toggle_bit_aborts_upload_and_download(bench: Bench) -> None:
    bench.sdo(struct.pack("<BHB", 0x40, 0x1008, 0))
    assert abort_of(bench.sdo(b"\x70")) == (0x1008, 0, 0x05030000)
    bench.sdo(struct.pack("<BHBI", 0x21, DOMAIN, 0, 14))
    assert bench.sdo(b"\x00abcdefg")[0] == 0x20
    assert abort_of(bench.sdo(b"\x00hijklmn")) == (DOMAIN, 0, 0x05030000)
    assert abort_of(bench.sdo(b"\x10hijklmn"))[2] == 0x05040001


@pytest.mark.parametrize("request_bytes", [b"\xe0", b"\x00", b"\x60", b"\xa3", b"\xa1", b"\xc1"])
def test_an_unexpected_command_is_rejected(bench: Bench, request_bytes: bytes) -> None:
    assert abort_of(bench.sdo(request_bytes))[2] == 0x05040001


def test_a_download_of_wrong_length_is_rejected(bench: Bench) -> None:
    bench.sdo(struct.pack("<BHBI", 0x21, DOMAIN, 0, 9))
    assert abort_of(bench.sdo(b"\x01abcdefg"))[2] == 0x06070013
    bench.sdo(struct.pack("<BHBI", 0x21, DOMAIN, 0, 5))
    assert abort_of(bench.sdo(b"\x01abcdefg"))[2] == 0x06070012
    assert abort_of(bench.sdo(struct.pack("<BHBI", 0x21, DOMAIN, 0, 1 << 31)))[2] == 0x05040005
    assert bench.od.get(DOMAIN) == b""


def test_a_transfer_of_a_silent_client_is_aborted_after_the_timeout(bench: Bench) -> None:
    bench.sdo(struct.pack("<BHB", 0x40, 0x1008, 0))
    ((_, identifier, data),) = bench.run_to(TIMEOUT_S + 0.1)
    assert identifier == 0x580 + NODE
    assert abort_of(data) == (0x1008, 0, 0x05040000)
    assert bench.run_to(60.0) == []


def test_a_new_request_replaces_a_transfer_and_an_abort_ends_it(bench: Bench) -> None:
    bench.sdo(struct.pack("<BHB", 0x40, 0x1008, 0))
    assert bench.sdo(struct.pack("<BHB", 0x40, 0x1000, 0))[0] == 0x43
    assert abort_of(bench.sdo(b"\x60"))[2] == 0x05040001
    bench.sdo(struct.pack("<BHB", 0x40, 0x1008, 0))
    assert bench.send(0x600 + NODE, struct.pack("<BHBI", 0x80, 0x1008, 0, 0)) == []
    assert bench.run_to(60.0) == []


def test_server_is_closed_in_stopped(bench: Bench) -> None:
    bench.sdo(struct.pack("<BHB", 0x40, 0x1008, 0))
    bench.nmt(2)
    assert bench.send(0x600 + NODE, b"\x60".ljust(8, b"\0")) == []
    assert bench.run_to(60.0) == []
    bench.nmt(128)
    assert abort_of(bench.sdo(b"\x60"))[2] == 0x05040001
