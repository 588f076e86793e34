"""Tension sensors and winch calibrations as files: what ships, and what is refused by name."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from cdpr_profiles.devices.tension_sensor import load_tension_sensors
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.places import SHIPPED
from cdpr_profiles.winch_calibration import WinchCalibration

TEXT = (SHIPPED / "tension_sensors" / "rtu-load-cell-1.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("baudrate = 115200", "baudrate = 115201", "baudrate: value 115201; allowed: 1200 or"),
        ("baudrate = 115200", "baud = 115200", "baud: unknown key; did you mean 'baudrate'"),
        ('type = "int32"', 'type = "int24"', "amplifier.value.type: value 'int24'"),
        (
            'address = 0\ntype = "int32"',
            'address = 65535\ntype = "int32"',
            "value.address: 65535 for int32; allowed: up to 65534",
        ),
        ("scale_N = 0.01", "scale_N = 0.0", "amplifier.value.scale_N"),
        ("unit = 1", "unit = 248", r"sensors\[0\].unit: value 248"),
        ("lowest_N = -100.0", "lowest_N = 2000.0", "lowest_N = 2000.0 must be below 1000.0"),
        ("over_range_bit = 0\nbroken_wire_bit = 1", "", "at least one of over_range_bit"),
        ("stale_after_s = 0.25", "stale_after_s = 0.06", "stale_after_s: value 0.06"),
        ("[[sensors]]", '[[sensors]]\ncable = "x"\nunit = 1\n[[sensors]]', "unit .1, 1.; allowed"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, named: str) -> None:
    assert TEXT.count(old) == 1
    path = tmp_path / "sensors.toml"
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ProfileError, match=named) as caught:
        load_tension_sensors(path)
    assert str(path) in str(caught.value)


def test_a_name_that_is_not_there_is_answered_with_those_that_are() -> None:
    with pytest.raises(ProfileError, match="did you mean 'rtu-load-cells-8'"):
        load_tension_sensors("rtu-load-cells-9")


def test_a_calibration_is_read_as_it_was_written(tmp_path: Path) -> None:
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
