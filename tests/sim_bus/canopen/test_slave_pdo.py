"""PDOs: transmission types, timers, mapping rules and deadlines. SYNC with and without counter."""

from __future__ import annotations

import struct
from pathlib import Path

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.sim_bus.canopen.slave_bench import GENERIC_EDS, NODE, RTR, Bench, Recorder

TPDO1, TPDO2, RPDO1 = 0x180 + NODE, 0x280 + NODE, 0x200 + NODE
EMCY = 0x80 + NODE
POSITION, MODE_DISPLAY = 0x60640020, 0x60610008
CONTROLWORD, TARGET_TORQUE, MAX_TORQUE = 0x60400010, 0x60710010, 0x60720010


def code_of(call: object, *args: object) -> int:
    with pytest.raises(canopen.SdoAbortedError) as caught:
        call(*args)  # type: ignore[operator]
    return caught.value.code


def emcy_codes(frames: list[tuple[int, bytes]]) -> list[int]:
    return [int.from_bytes(data[:2], "little") for identifier, data in frames if identifier == EMCY]


@pytest.fixture
def running(bench: Bench) -> Bench:
    """Return a slave in OPERATIONAL with TPDO2 disabled and TPDO1 as in the EDS."""
    bench.write(0x1801, 1, (0x80000000 | TPDO2).to_bytes(4, "little"))
    return bench.start()


def test_a_sync_first_latches_then_applies_rpdos_then_acts_then_samples_tpdos(bench: Bench) -> None:
    order: list[str] = []

    class Application(Recorder):
        def before_sync(self, now: float) -> None:
            order.append("before_sync")

        def after_rpdo(self, now: float) -> None:
            order.append("after_rpdo")

    bench = Bench(app=Application())
    bench.od.on_write(0x6071, 0, lambda value: order.append("target"))
    bench.od.on_read(0x6064, 0, lambda: order.append("sample") or 0)
    bench.boot().start()
    bench.send(RPDO1, struct.pack("<Hh", 0, 1))
    bench.send(RPDO1, struct.pack("<Hh", 0, 2))
    assert order == []
    bench.sync()
    assert order == ["before_sync", "target", "after_rpdo", "sample"]
    assert bench.od.get(0x6071) == 2


def test_pdos_are_inactive_outside_operational(bench: Bench) -> None:
    assert bench.sync() == []
    bench.send(RPDO1, struct.pack("<Hh", 6, 0))
    bench.start()
    bench.send(RPDO1, struct.pack("<Hh", 7, 0))
    bench.nmt(128)
    assert bench.sync() == []
    bench.start()
    bench.sync()
    assert bench.od.get(0x6040) == 0


def test_type_0_is_sent_at_the_sync_after_a_change(running: Bench) -> None:
    running.configure_pdo(0x1801, [MODE_DISPLAY], 0)
    sent = []
    for mode in (0, 0, 10, 10, 6, 10):
        running.od.set(0x6061, 0, mode)
        sent.append([data for identifier, data in running.sync() if identifier == TPDO2])
    assert sent == [[b"\0"], [], [b"\x0a"], [], [b"\x06"], [b"\x0a"]]


@pytest.mark.parametrize("n", [2, 3, 240])
def test_type_n_is_sent_at_each_nth_sync(running: Bench, n: int) -> None:
    running.configure_pdo(0x1801, [MODE_DISPLAY], n)
    turns = [k for k in range(1, 3 * n + 1) if any(i == TPDO2 for i, _ in running.sync())]
    assert turns == [n, 2 * n, 3 * n]


def test_type_252_answers_a_remote_request_with_the_sample_of_the_last_sync(running: Bench) -> None:
    running.configure_pdo(0x1801, [POSITION], 252)
    assert running.send(TPDO2 | RTR) == []
    running.od.set(0x6064, 0, 1)
    running.sync()
    running.od.set(0x6064, 0, 2)
    assert running.send(TPDO2 | RTR) == [(TPDO2, b"\1\0\0\0")]


def test_type_253_answers_a_remote_request_with_a_fresh_sample(running: Bench) -> None:
    running.configure_pdo(0x1801, [POSITION], 253)
    running.od.set(0x6064, 0, 2)
    assert all(identifier != TPDO2 for identifier, _ in running.sync())
    assert running.send(TPDO2 | RTR) == [(TPDO2, b"\2\0\0\0")]
    running.write(0x1801, 1, (0x40000000 | TPDO2).to_bytes(4, "little"))
    assert running.send(TPDO2 | RTR) == []


@pytest.mark.parametrize("transmission", [254, 255])
def test_event_driven_pdo_is_sent_on_change_but_not_within_the_inhibit_time(
    running: Bench, transmission: int
) -> None:
    running.configure_pdo(0x1801, [MODE_DISPLAY], transmission, sub3=50)
    start = running.now
    running.run_to(start + 0.1)
    running.od.set(0x6061, 0, 1)
    assert running.run_to(start + 0.1) == [(start + 0.1, TPDO2, b"\1")]
    running.od.set(0x6061, 0, 2)
    assert running.run_to(start + 0.102) == []
    running.od.set(0x6061, 0, 3)
    ((when, _, data),) = running.run_to(start + 0.2)
    assert (when, data) == (pytest.approx(start + 0.105), b"\3")


def test_event_driven_pdo_is_sent_once_at_the_start(running: Bench) -> None:
    running.nmt(128)
    running.configure_pdo(0x1801, [MODE_DISPLAY], 255)
    assert running.nmt(1) == [(TPDO2, b"\0")]
    assert running.sync() == [(TPDO1, bytes(8))]


def test_an_sdo_write_triggers_an_event_driven_pdo(running: Bench) -> None:
    running.configure_pdo(0x1801, [MAX_TORQUE], 255)
    sent = running.send(0x600 + NODE, bytes.fromhex("2b7260003412 0000"))
    assert (TPDO2, b"\x34\x12") in sent


def test_event_timer_repeats_a_pdo_without_change(running: Bench) -> None:
    running.configure_pdo(0x1801, [MODE_DISPLAY], 255, sub5=20)
    start = running.now
    times = [when - start for when, identifier, _ in running.run_to(start + 0.1) if identifier]
    assert times == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1])


def test_event_driven_rpdo_acts_immediately(running: Bench) -> None:
    running.configure_pdo(0x1400, [CONTROLWORD, TARGET_TORQUE], 255)
    running.app.events.clear()
    running.send(RPDO1, struct.pack("<Hh", 6, 99))
    assert (running.od.get(0x6040), running.od.get(0x6071)) == (6, 99)
    assert running.app.events == [("after_rpdo", running.now)]


def test_a_missed_rpdo_deadline_is_reported_and_cleared(running: Bench) -> None:
    running.write(0x1400, 5, (30).to_bytes(2, "little"))
    assert running.run_to(running.now + 1.0) == []
    t = running.now
    running.send(RPDO1, bytes(4))
    running.run_to(t + 0.02)
    running.send(RPDO1, bytes(4))
    assert running.run_to(t + 0.049) == []
    ((when, identifier, data),) = running.run_to(t + 1.0)
    assert when == pytest.approx(t + 0.05)
    assert (identifier, data[:4]) == (EMCY, b"\x50\x82\x11\x01")
    assert ("rpdo_timeout", 1) in running.app.events
    assert emcy_codes(running.send(RPDO1, bytes(4))) == [0]
    assert running.od.get(0x1001) == 0


def test_a_pdo_of_wrong_length_raises_an_emergency_and_a_short_one_is_dropped(
    running: Bench,
) -> None:
    assert emcy_codes(running.send(RPDO1, b"\x07\0\0")) == [0x8210]
    assert emcy_codes(running.send(RPDO1, b"\x07\0\0")) == []
    running.sync()
    assert running.od.get(0x6040) == 0
    assert emcy_codes(running.send(RPDO1, b"\x06\0\0\0\0")) == [0, 0x8220]
    running.sync()
    assert running.od.get(0x6040) == 6
    assert emcy_codes(running.send(RPDO1, bytes(4))) == [0]


def test_pdo_errors_are_reported_again_after_a_communication_reset(running: Bench) -> None:
    assert emcy_codes(running.send(RPDO1, b"")) == [0x8210]
    running.nmt(130)
    assert running.od.get(0x1001) == 0
    running.start()
    assert emcy_codes(running.send(RPDO1, b"")) == [0x8210]


def test_a_value_out_of_range_in_a_pdo_is_ignored(running: Bench) -> None:
    running.od.entry(0x6072).high = 1000
    running.configure_pdo(0x1400, [CONTROLWORD, MAX_TORQUE], 1)
    running.od.set(0x6072, 0, 500)
    running.send(RPDO1, struct.pack("<HH", 6, 1001))
    running.sync()
    assert (running.od.get(0x6040), running.od.get(0x6072)) == (6, 500)


def test_invalid_mappings_are_rejected(bench: Bench) -> None:
    def entry(value: int) -> bytes:
        return value.to_bytes(4, "little")

    write = bench.write
    assert code_of(write, 0x1600, 0, b"\0") == 0x08000022
    assert code_of(write, 0x1600, 1, entry(TARGET_TORQUE)) == 0x08000022
    write(0x1400, 1, entry(0x80000000 | RPDO1))
    assert code_of(write, 0x1600, 1, entry(TARGET_TORQUE)) == 0x08000022
    write(0x1600, 0, b"\0")
    assert code_of(write, 0x1600, 1, entry(POSITION)) == 0x06040041  # not writable
    assert code_of(write, 0x1600, 1, entry(0x60710020)) == 0x06040041  # not the object's length
    assert code_of(write, 0x1600, 1, entry(0x10050020)) == 0x06040041  # not mappable
    assert code_of(write, 0x1600, 1, entry(0x5FFF0010)) == 0x06020000
    assert code_of(write, 0x1600, 1, entry(0x60710110)) == 0x06090011
    assert code_of(write, 0x1600, 1, entry(0x00050008)) == 0x06020000  # this EDS has no dummies
    write(0x1600, 1, entry(0x607A0020))
    write(0x1600, 2, entry(0x60FF0020))
    write(0x1600, 3, entry(TARGET_TORQUE))
    assert code_of(write, 0x1600, 0, b"\3") == 0x06040042
    assert bench.od.get(0x1600) == 0
    write(0x1600, 0, b"\2")
    assert code_of(write, 0x1600, 1, entry(TARGET_TORQUE)) == 0x08000022
    write(0x1400, 1, entry(RPDO1))
    bench.start()
    bench.send(RPDO1, struct.pack("<ii", -1, 77))
    bench.sync()
    assert (bench.od.get(0x607A), bench.od.get(0x60FF)) == (-1, 77)


def test_invalid_communication_parameters_are_rejected(bench: Bench) -> None:
    def long(value: int) -> bytes:
        return value.to_bytes(4, "little")

    write = bench.write
    assert code_of(write, 0x1800, 1, long(0x190)) == 0x06090030  # exists
    write(0x1800, 1, long(0x80000190))
    for reserved in (0x000, 0x07F, 0x101, 0x180, 0x581, 0x601, 0x6E0, 0x701, 0x7FF, 0x800):
        assert code_of(write, 0x1800, 1, long(reserved)) == 0x06090030
    assert code_of(write, 0x1800, 1, long(0x20000190)) == 0x06090030  # 29 bits
    write(0x1800, 3, b"\x0a\0")
    write(0x1800, 1, long(0x190))
    assert code_of(write, 0x1800, 3, b"\x0b\0") == 0x06090030
    assert code_of(write, 0x1800, 2, b"\xf5") == 0x06090030
    assert code_of(write, 0x1400, 2, b"\xfc") == 0x06090030
    bench.start()
    assert [identifier for identifier, _ in bench.sync()][:1] == [0x190]


def test_dummies_may_only_be_mapped_in_rpdos(odd_bench: Bench) -> None:
    odd_bench.configure_pdo(0x1400, [0x00060010, 0x00050008, TARGET_TORQUE], 1)
    odd_bench.start()
    odd_bench.send(RPDO1, struct.pack("<HBh", 0xFFFF, 0xFF, -9))
    odd_bench.sync()
    assert odd_bench.od.get(0x6071) == -9
    odd_bench.write(0x1800, 1, (0x80000000 | TPDO1).to_bytes(4, "little"))
    odd_bench.write(0x1A00, 0, b"\0")
    with pytest.raises(canopen.SdoAbortedError) as caught:
        odd_bench.write(0x1A00, 1, (0x00050008).to_bytes(4, "little"))
    assert caught.value.code == 0x06040041


def test_pdos_follow_sync_counter_and_start_value(running: Bench) -> None:
    running.configure_pdo(0x1801, [MODE_DISPLAY], 2, sub6=5)
    running.write(0x1019, 0, b"\x08")
    sent = [
        counter
        for counter in [3, 4, 5, 6, 7, 8, 1, 2]
        if any(i == TPDO2 for i, _ in running.sync(bytes([counter])))
    ]
    assert sent == [5, 7, 1]
    assert emcy_codes(running.sync()) == [0x8240]
    assert emcy_codes(running.sync(b"\3")) == [0]
    running.write(0x1006, 0, (1000).to_bytes(4, "little"))
    assert running.slave.sync_period_s == pytest.approx(1e-3)
    assert code_of(running.write, 0x1019, 0, b"\0") == 0x08000022


def test_an_rpdo_after_the_synchronous_window_is_discarded(running: Bench) -> None:
    running.write(0x1007, 0, (300).to_bytes(4, "little"))
    running.sync()
    running.run_to(running.now + 0.0002)
    running.send(RPDO1, struct.pack("<Hh", 6, 0))
    running.sync()
    assert running.od.get(0x6040) == 6
    running.run_to(running.now + 0.0004)
    running.send(RPDO1, struct.pack("<Hh", 7, 0))
    running.sync()
    assert running.od.get(0x6040) == 6


def test_sync_identifier_can_be_moved(running: Bench) -> None:
    running.write(0x1005, 0, (0x90).to_bytes(4, "little"))
    assert running.sync() == []
    assert running.send(0x90) == [(TPDO1, bytes(8))]
    assert 0x90 in running.slave.accepts
    assert 0x80 not in running.slave.accepts


NUMBERS = {0x6040: "H", 0x6060: "b", 0x6071: "h", 0x607A: "i", 0x60FF: "i", 0x6072: "H"}


@settings(max_examples=40)
@given(
    indexes=st.permutations(sorted(NUMBERS)),
    count=st.integers(1, 6),
    data=st.binary(min_size=8, max_size=8),
)
def test_any_mapping_transfers_the_values_of_its_objects(
    indexes: list[int], count: int, data: bytes
) -> None:
    bench = Bench().boot()
    chosen = indexes[:count]
    while struct.calcsize("<" + "".join(NUMBERS[i] for i in chosen)) > 8:
        chosen.pop()
    layout = struct.Struct("<" + "".join(NUMBERS[i] for i in chosen))
    for index in chosen:
        bench.od.entry(index).low = bench.od.entry(index).codec.low
        bench.od.entry(index).high = bench.od.entry(index).codec.high
    entries = [i << 16 | 8 * struct.calcsize("<" + NUMBERS[i]) for i in chosen]
    bench.configure_pdo(0x1400, entries, 1)
    bench.configure_pdo(0x1800, entries, 1)
    bench.start()
    frame = data[: layout.size]
    bench.send(RPDO1, frame)
    sent = dict(bench.sync())
    assert sent[TPDO1] == frame
    assert tuple(bench.od.get(i) for i in chosen) == layout.unpack(frame)


def test_a_pdo_whose_default_map_contradicts_the_eds_starts_empty(tmp_path: Path) -> None:
    eds = tmp_path / "odd.eds"
    eds.write_text(GENERIC_EDS.read_text().replace("0x60640020", "0x60650820"))
    assert Bench(eds).od.get(0x1A00) == 0
    assert Bench(GENERIC_EDS).od.get(0x1A00) > 0
