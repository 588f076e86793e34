"""Files of load cells, safety I/Os, rails and calibrated winches are read or rejected."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from cdpr_profiles import ProfileError
from cdpr_profiles.catalogue import load_profile, load_rail_drive
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.rail import load_rail
from cdpr_profiles.safety_io import load_safety_io
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_profiles.winch_calibration import WinchCalibration

CELL, IO, CIA402, MODBUS = (
    Path("tension_sensors/rtu-load-cell-1.toml"), Path("safety_io/modbus-remote-io.toml"),
    Path("rails/rail-cia402.toml"), Path("rails/rail-modbus.toml"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (CELL, "baudrate = 115200", "baudrate = 115201", "baudrate: value 115201; allowed: 1200"),
        (CELL, "baudrate = 115200", "baud = 115200", "baud: unknown key; did you mean 'baudrate'"),
        (CELL, 'type = "int32"', 'type = "int24"', "amplifier.value.type: value 'int24'"),
        (CELL, 'address = 0\ntype = "int32"', 'address = 65535\ntype = "int32"',
         "amplifier.value: address: 65535 for int32; allowed: up to 65534"),
        (CELL, "scale_N = 0.01", "scale_N = 0.0", "amplifier.value.scale_N"),
        (CELL, "unit = 1", "unit = 248", "sensors[0].unit: value 248"),
        (CELL, "lowest_N = -100.0", "lowest_N = 2000.0", "lowest_N = 2000.0 must be below 1000.0"),
        (CELL, "over_range_bit = 0\nbroken_wire_bit = 1", "", "at least one of over_range_bit"),
        (CELL, "stale_after_s = 0.25", "stale_after_s = 0.06", "stale_after_s: value 0.06"),
        (CELL, "[[sensors]]", '[[sensors]]\ncable = "x"\nunit = 1\n[[sensors]]', "unit [1, 1]; "),
        (IO, "{ input = 2 }", "{ input = 3 }", "input 3 is already used by axes[0].brake.feedback"),
        (IO, "coil = 1 }", "coil = 0 }", "coil 0 is already used by contactor.output"),
        (IO, "{ coil = 1 }", "{ coil = 1, inverted = true }", "a brake must hold"),
        (IO, "trip_timeout_s = 0.2", "trip_timeout_s = 0.03", "at least two poll periods (0.04)"),
        (IO, "input = 7,", "input = 4000,", "input 4000; allowed: less than 1968 from the first"),
        (IO, "port = 502", "port = 70000", "port: value 70000; allowed: less than or equal to 6"),
        (IO, 'axis = "rail 1"', 'axis = "winch 1"', "allowed: each once"),
        (IO, "[chain]", "[chian]", "did you mean 'chain'?"),
        (IO, "timeout_s = 0.5", "timeout_s = 0.01", "watchdog.timeout_s: value 0.01"),
        (CIA402, 'kind = "cia402"', 'kind = "modbus"', "kind: value 'modbus'"),
        (CIA402, "travel_max_m = 1.2", "travel_max_m = -1.0", "below travel_max_m (-1.0)"),
        (CIA402, "direction = 1", "direction = 0", "value 0; allowed: -1 or 1"),
        (CIA402, "speed_m_s", "sped_m_s", "did you mean 'speed_m_s'?"),
        (MODBUS, 'kind = "modbus"', 'kind = "cia402"', "(given: modbus)"),
        (MODBUS, "halt = 2", "halt = 1", "command: bits [0, 1, 1, 3]; allowed: each once"),
        (MODBUS, "fault = 3", "fault = 30", "modbus.status.fault: value 30"),
        (MODBUS, "metre_per_unit = 1e-5", "metre_per_unit = 0.0", "metre_per_unit: value 0.0"),
    ],
)  # fmt: skip
def test_error_for_a_wrong_value_names_file_and_key(
    tmp_path: Path, file: Path, old: str, new: str, told: str
) -> None:
    text = (SHIPPED / file).read_text()
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ProfileError) as error:
        load_profile(file.parent.name, str(path))  # type: ignore[arg-type]
    assert str(path) in str(error.value) and told in str(error.value)


def test_error_for_an_unknown_name_suggests_the_likely_one(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="did you mean 'rtu-load-cells-8'"):
        load_tension_sensors("rtu-load-cells-9")
    with pytest.raises(ProfileError, match="did you mean 'modbus-remote-io'"):
        load_safety_io("modbus-remot-io")
    path = tmp_path / "rail.toml"
    path.write_text((SHIPPED / CIA402).read_text().replace("generic-cia402", "generic-cia403"))
    cia402 = load_rail(path).cia402
    assert cia402 is not None
    with pytest.raises(ProfileError, match="'generic-cia403'; did you mean 'generic-cia402'"):
        load_rail_drive(path, cia402)


def test_a_reference_to_a_safety_io_may_replace_host_and_port() -> None:
    shipped = load_safety_io("modbus-remote-io")
    assert (shipped.host, shipped.port, shipped.chain.input) == ("127.0.0.1", 502, 0)
    moved = load_safety_io("modbus-remote-io@plc-7:1502")
    assert (moved.host, moved.port, moved.axes) == ("plc-7", 1502, shipped.axes)
    assert load_safety_io("modbus-remote-io@10.0.0.5").port == 502
    with pytest.raises(ProfileError, match=r"port: value 'x'; allowed: a number"):
        load_safety_io("modbus-remote-io@host:x")


def test_the_shipped_rails_load() -> None:
    cia402 = load_rail("rail-cia402").cia402
    assert cia402 is not None and load_rail("rail-modbus").modbus is not None
    assert 1 in load_rail_drive("rail-cia402", cia402).supported_modes


def test_a_winch_calibration_is_read_back_as_written(tmp_path: Path) -> None:
    made = WinchCalibration(
        winch='a "quoted" winch: Förderseil 🏗',
        motor="MPP0923D",
        drive_serial=7,
        date=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
        method="masses",
        gain_m=0.025,
        gain_half_width_m=1e-5,
        nominal_gain_m=0.026,
        bias_Nm=-0.004,
        bias_half_width_Nm=0.001,
        friction_Nm=0.08,
        friction_half_width_Nm=0.001,
        friction_per_N_m=0.00125,
        friction_per_N_half_width_m=1.25e-5,
        residual_rms_Nm=1e-4,
        lowest_tension_N=20.0,
        highest_tension_N=98.0,
        raw_data=("raw/mass-2kg.raw", "raw/mass-5kg.raw"),
    )
    path = tmp_path / "winch-calibration.toml"
    made.save(path)
    assert WinchCalibration.load_file(path) == made
    assert made.torque_Nm(100.0) == pytest.approx(2.496)
    assert made.friction_at_Nm(100.0) == pytest.approx(0.205)
    path.write_text(path.read_text().replace("gain_m = 0.025", "gain_m = -0.025"))
    with pytest.raises(ProfileError, match=r"gain_m: value -0\.025"):
        WinchCalibration.load_file(path)
    with pytest.raises(ProfileError, match="cannot be written"):
        made.save(tmp_path / "none" / "file.toml")
