"""1020h keeps date and time of the configuration until a parameter changes."""

from __future__ import annotations

import struct

import canopen
import pytest

from tests.sim_bus.canopen.slave_bench import Bench

SAVE = b"save"
LOAD = b"load"


def _stamp(bench: Bench) -> tuple[int, int]:
    return bench.od.get_int(0x1020, 1), bench.od.get_int(0x1020, 2)


def _write_stamp(bench: Bench) -> None:
    bench.write(0x1020, 1, struct.pack("<I", 15000))
    bench.write(0x1020, 2, struct.pack("<I", 1234567))


def test_the_stamp_is_kept_until_a_parameter_changes(bench: Bench) -> None:
    assert _stamp(bench) == (0, 0)
    _write_stamp(bench)
    assert _stamp(bench) == (15000, 1234567)
    bench.write(0x1017, 0, struct.pack("<H", 0))  # unchanged
    assert _stamp(bench) == (15000, 1234567)
    bench.write(0x1017, 0, struct.pack("<H", 100))
    assert _stamp(bench) == (0, 0)


def test_a_rejected_write_keeps_the_stamp(bench: Bench) -> None:
    _write_stamp(bench)
    for index, sub, data in ((0x1016, 1, b"\x64\0\x7f\xff"), (0x1000, 0, bytes(4))):
        with pytest.raises(canopen.SdoAbortedError):
            bench.write(index, sub, data)
    assert _stamp(bench) == (15000, 1234567)


def test_the_stamp_is_stored_and_restored_with_the_parameters(bench: Bench) -> None:
    bench.write(0x1017, 0, struct.pack("<H", 100))
    _write_stamp(bench)
    bench.nmt(130)
    assert _stamp(bench) == (0, 0)  # not stored: 1017h is also restored
    bench.write(0x1017, 0, struct.pack("<H", 100))
    _write_stamp(bench)
    bench.write(0x1010, 1, SAVE)
    for reset in (130, 129):
        bench.nmt(reset)
        assert (*_stamp(bench), bench.od.get(0x1017)) == (15000, 1234567, 100)
    bench.write(0x1011, 1, LOAD)
    bench.nmt(129)
    assert _stamp(bench) == (0, 0)
