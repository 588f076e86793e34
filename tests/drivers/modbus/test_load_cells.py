"""Load cells on a real serial line (a pseudo-terminal): values, faults of line and cell, tare."""

from __future__ import annotations

import itertools
import os
import pty
import struct
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import serial

from cdpr_drivers.modbus.channel import LineError, ModbusError, ModbusLine
from cdpr_drivers.modbus.tension import LoadCells, TensionSampler, raw_value
from cdpr_profiles.tension_sensor import TensionSensors, ValueMap, load_tension_sensors
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.exchange import TensionFault
from tests.drivers.modbus.load_cell_rig import LoadCellRig

# amplifiers in a separate process answer within 0.05 s of wall-clock time
pytestmark = pytest.mark.alone
CLOCK = PacedClock()
N = 3
_EXACT = "noise_N = 0.0\nzero_spread_N = 0.0\ngain_error = 0.0\nfilter_Hz = 500.0\nbits = 24\n"


def three() -> TensionSensors:
    whole = load_tension_sensors("rtu-load-cells-8")
    return whole.model_copy(update={"sensors": whole.sensors[:N]})


def write_toml(path: Path, type_: str, order: str, kind: str, status_address: int) -> Path:
    """Write a file of sensors with a different register map."""
    scale = 0.1 if type_.endswith("16") else 0.01
    path.write_text(f"""
name = "another manufacturer's"
baudrate = 19200
answer_timeout_s = 0.2
retries = 0
[amplifier]
lowest_N = -10.0
highest_N = 500.0
[amplifier.value]
kind = "{kind}"
address = 100
type = "{type_}"
word_order = "{order}"
scale_N = {scale}
[amplifier.status]
kind = "input"
address = {status_address}
broken_wire_bit = 7
[[sensors]]
cable = "a"
unit = 17
""")
    return path


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoadCellRig]:
    folder = tmp_path_factory.mktemp("cells")
    (folder / "amplifiers.toml").write_text(_EXACT)
    options = ("--plant", str(folder / "amplifiers.toml"))
    with LoadCellRig("rtu-load-cells-8", folder, 8, *options) as made:
        yield made


@pytest.fixture
def cells(rig: LoadCellRig) -> Iterator[LoadCells]:
    rig.tell("mend all")
    rig.pull([0.0] * 8)
    made = LoadCells(three(), rig.port, CLOCK)
    yield made
    made.close()


def until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    end_s = CLOCK.now_s + seconds
    while not condition():
        assert CLOCK.now_s < end_s
        CLOCK.sleep(0.01)


def settled(cells: LoadCells, number: int, tension_N: float) -> None:
    assert cells.read(number).tension_N == pytest.approx(tension_N, abs=0.05)


def test_each_cell_reads_the_tension_of_its_cable(rig: LoadCellRig, cells: LoadCells) -> None:
    rig.pull([20.0, 45.5, 130.25])
    for number, tension in enumerate((20.0, 45.5, 130.25)):
        settled(cells, number, tension)
        reading = cells.read(number)
        assert reading.cable == f"winch {number + 1}"
        assert reading.fault is TensionFault.NONE


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("silent", "unit 2: input registers 0 to 2: no answer within 0.05 s"),
        ("truncated", "the answer was cut off after 8 of 11 bytes"),
        ("wrong-crc", "checksum"),
        ("wrong-unit", "unit 3 answered"),
    ],
)
def test_a_disturbed_answer_is_reported_and_does_not_affect_other_cells(
    rig: LoadCellRig, cells: LoadCells, fault: str, message: str
) -> None:
    rig.tell(f"{fault} 2")
    with pytest.raises(ModbusError, match=message) as caught:
        cells.read(1)
    assert str(caught.value).startswith(f"{rig.port}: unit 2: ")
    assert cells.read(0).fault is TensionFault.NONE
    assert cells.read(2).fault is TensionFault.NONE
    rig.tell("mend 2")
    assert cells.read(1).fault is TensionFault.NONE


def test_over_range_and_broken_wire_are_distinguished(rig: LoadCellRig, cells: LoadCells) -> None:
    rig.tell("over-range 1")
    rig.tell("broken-wire 2")
    assert cells.read(0).fault is TensionFault.OVER_RANGE
    assert cells.read(1).fault is TensionFault.BROKEN_WIRE
    assert cells.read(2).fault is TensionFault.NONE
    rig.tell("mend all")
    rig.pull([1500.0])  # the amplifier detects it without a fault command
    assert cells.read(0).fault is TensionFault.OVER_RANGE


def test_a_request_is_repeated_after_a_disturbed_answer(rig: LoadCellRig) -> None:
    profile = three().model_copy(update={"retries": 5})
    cells = LoadCells(profile, rig.port, CLOCK)
    cells.read(0)
    assert cells.line.repeated == 0
    rig.tell("wrong-crc 1")
    with pytest.raises(ModbusError):
        cells.read(0)
    assert cells.line.repeated == 5
    rig.tell("mend all")
    cells.close()


def test_tare_makes_the_present_tension_zero(rig: LoadCellRig, cells: LoadCells) -> None:
    rig.pull([12.0, 7.0, 5.0])
    settled(cells, 0, 12.0)
    cells.tare(0)
    settled(cells, 0, 0.0)
    assert cells.read(1).tension_N == pytest.approx(7.0, abs=0.05)
    rig.pull([0.0, 0.0, 0.0])
    settled(cells, 0, -12.0)
    cells.tare(0)
    settled(cells, 0, 0.0)


def test_a_missing_register_is_rejected_with_a_reason(cells: LoadCells) -> None:
    with pytest.raises(ModbusError, match=r"unit 1: holding register 99: refused.*no such input"):
        cells.line.registers("holding", 1, 99, 1)
    with pytest.raises(
        ModbusError, match=r"set holding register 10 to 7: refused with exception 3"
    ):
        cells.line.write_register(1, 10, 7)


def test_the_bytes_on_the_line_follow_the_modbus_specification(rig: LoadCellRig) -> None:
    """Requests and checks are written from the specification, without the driver."""

    def crc(data: bytes) -> bytes:
        value = 0xFFFF
        for byte in data:
            value ^= byte
            for _ in range(8):
                value = (value >> 1) ^ (0xA001 * (value & 1))
        return struct.pack("<H", value)

    rig.tell("mend all")
    rig.pull([100.0])
    with serial.Serial(rig.port, 115200, timeout=60.0) as port:
        question = bytes([1, 4, 0, 0, 0, 3])
        port.write(question + crc(question))
        answer = port.read(11)
        assert answer[:3] == bytes([1, 4, 6])
        assert answer[-2:] == crc(answer[:-2])
        assert struct.unpack(">iH", answer[3:9]) == (10000, 0)


def test_the_sampler_timestamps_readings_and_survives_faults(rig: LoadCellRig) -> None:
    rig.tell("mend all")
    rig.pull([30.0, 40.0, 50.0])
    with TensionSampler(three(), rig.port, CLOCK) as sampler:
        sampler.await_readings(10.0)
        exchange, told = sampler.exchange, sampler.exchange.feedback

        def valid(wanted: list[bool]) -> bool:
            exchange.update()
            return bool((told.valid == wanted).all())

        until(lambda: valid([True, True, True]) and abs(told.tension_N[2] - 50.0) < 0.1)
        assert (told.age_s < 0.25).all()
        before = told.time_s.copy()
        until(lambda: valid([True] * 3) and bool((told.time_s > before).all()))
        rig.tell("silent 2")
        until(lambda: valid([True, False, True]))
        assert exchange.reason().startswith("winch 2: tension sensor: stale")
        assert "unit 2" in sampler.errors[1]
        rig.tell("broken-wire 1")
        until(lambda: valid([False, False, True]))
        assert told.fault[0] == TensionFault.BROKEN_WIRE
        rig.tell("mend all")
        until(lambda: valid([True, True, True]))


def test_a_missing_port_is_reported(tmp_path: Path) -> None:
    with pytest.raises(LineError, match=r"ttyNone: cannot be opened: No such file or directory"):
        TensionSampler(three(), str(tmp_path / "ttyNone"), CLOCK).start()
    plain = tmp_path / "plain"
    plain.write_text("")
    with pytest.raises(LineError, match=r"cannot be opened: .*Inappropriate ioctl"):
        TensionSampler(three(), str(plain), CLOCK).start()


def test_other_register_maps_work_and_an_unplugged_adapter_is_reported(tmp_path: Path) -> None:
    (tmp_path / "amplifiers.toml").write_text(_EXACT)
    maps = [("float32", "little", "holding", 90), ("int16", "big", "input", 101)]
    for type_, order, kind, status in maps:
        path = write_toml(tmp_path / f"{type_}.toml", type_, order, kind, status)
        profile = load_tension_sensors(path)
        options = ("--plant", str(tmp_path / "amplifiers.toml"), "--fault", "mend 17")
        with LoadCellRig(path, tmp_path, 1, *options) as rig:
            rig.pull([-7.5])
            cells = LoadCells(profile, rig.port, CLOCK)
            until(lambda cells=cells: abs(cells.read(0).tension_N + 7.5) < 0.06)
            rig.tell("broken-wire all")
            assert cells.read(0).fault is TensionFault.BROKEN_WIRE
            sampler = TensionSampler(profile, rig.port, CLOCK)
            with pytest.raises(LineError, match="no other program"):
                sampler.start()
            assert rig.tell("unplug") == {"unplugged": True}
            rig.process.wait(120)
            with pytest.raises(LineError, match="unplugged"):
                cells.read(0)
            with pytest.raises(LineError, match="cannot be opened"):
                cells.read(0)
            cells.close()


def test_raw_values_of_each_type_and_word_order_are_decoded() -> None:
    numbers = {"int16": -2, "uint16": 65534, "int32": -100000, "uint32": 3_000_000_000}
    codes = {"int16": ">h", "uint16": ">H", "int32": ">i", "uint32": ">I", "float32": ">f"}
    for type_, order in itertools.product(codes, ("big", "little")):
        value = ValueMap.model_validate(
            {"kind": "input", "address": 0, "type": type_, "word_order": order, "scale_N": 1.0}
        )
        number = numbers.get(type_, -12.5)
        packed = struct.pack(codes[type_], number)
        words = list(struct.unpack(f">{len(packed) // 2}H", packed))
        assert raw_value(value, words if order == "big" else words[::-1]) == number


def test_a_closed_sampler_leaves_no_file_descriptor_open(rig: LoadCellRig) -> None:
    count = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(3):
        with TensionSampler(three(), rig.port, CLOCK) as sampler:
            sampler.await_readings(10.0)
            assert np.isfinite(sampler.exchange.feedback.tension_N).all()
    assert len(list(Path("/proc/self/fd").iterdir())) == count


def test_an_adapter_that_echoes_is_named() -> None:
    ours, theirs = pty.openpty()
    line = ModbusLine(os.ttyname(theirs), 115200, PacedClock(), timeout_s=0.2, retries=0)
    echo = threading.Thread(target=lambda: os.write(ours, os.read(ours, 64)), daemon=True)
    echo.start()
    try:
        with pytest.raises(ModbusError, match="switch off its echo"):
            line.registers("input", 1, 0, 2)
    finally:
        line.close()
        echo.join(5.0)
        os.close(ours)
        os.close(theirs)
