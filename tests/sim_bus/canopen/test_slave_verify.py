"""1020h: date and time of the configuration, void once any of it is changed."""

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


def test_it_holds_what_was_written_until_something_changes(bench: Bench) -> None:
    assert _stamp(bench) == (0, 0)
    _write_stamp(bench)
    assert _stamp(bench) == (15000, 1234567)
    bench.write(0x1017, 0, struct.pack("<H", 0))  # as it was: no change
    assert _stamp(bench) == (15000, 1234567)
    bench.write(0x1017, 0, struct.pack("<H", 100))
    assert _stamp(bench) == (0, 0)


def test_application_parameters_count_process_data_do_not(bench: Bench) -> None:
    _write_stamp(bench)
    bench.write(0x6072, 0, struct.pack("<H", 321))
    assert _stamp(bench) == (0, 0)
    _write_stamp(bench)
    bench.write(0x1003, 0, b"\0")
    bench.write(0x1010, 1, SAVE)
    assert _stamp(bench) == (15000, 1234567)


def test_a_refused_write_changes_nothing(bench: Bench) -> None:
    _write_stamp(bench)
    for index, sub, data in ((0x1016, 1, b"\x64\0\x7f\xff"), (0x1000, 0, bytes(4))):
        with pytest.raises(canopen.SdoAbortedError):
            bench.write(index, sub, data)
    assert _stamp(bench) == (15000, 1234567)


def test_it_is_stored_and_restored_with_the_parameters(bench: Bench) -> None:
    bench.write(0x1017, 0, struct.pack("<H", 100))
    _write_stamp(bench)
    bench.nmt(130)
    assert _stamp(bench) == (0, 0)  # not stored: 1017h is back to what it was as well
    bench.write(0x1017, 0, struct.pack("<H", 100))
    _write_stamp(bench)
    bench.write(0x1010, 1, SAVE)
    for reset in (130, 129):
        bench.nmt(reset)
        assert (*_stamp(bench), bench.od.get(0x1017)) == (15000, 1234567, 100)
    bench.write(0x1011, 1, LOAD)
    bench.nmt(129)
    assert _stamp(bench) == (0, 0)


def test_a_communication_reset_does_not_vouch_for_a_changed_application(bench: Bench) -> None:
    _write_stamp(bench)
    bench.write(0x1010, 1, SAVE)
    bench.write(0x6072, 0, struct.pack("<H", 321))
    bench.nmt(130)
    assert bench.od.get(0x6072) == 321
    assert _stamp(bench) == (0, 0)
    bench.nmt(129)
    assert bench.od.get(0x6072) != 321
    assert _stamp(bench) == (15000, 1234567)
