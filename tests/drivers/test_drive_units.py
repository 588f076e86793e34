"""Units of a drive's objects agree with values computed by hand."""

from __future__ import annotations

import math

import pytest

from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.drive_units import torque_settings, torque_unit_Nm
from cdpr_profiles import DriveProfile, load_drive

GENERIC = load_drive("generic-cia402")


def drive(**keys: object) -> DriveProfile:
    return GENERIC.model_copy(update=keys)


@pytest.mark.parametrize(
    ("unit", "step_Nm", "half_a_Nm"),
    [
        ("per_mille_of_rated", 0.0024, 208),
        ("percent_of_rated", 0.024, 20),  # rounded down: a limit is never exceeded
        ("mNm", 0.001, 500),
        ("cNm", 0.01, 50),
        ("mA_rms", 0.0005, 1000),
        ("mA_peak", 0.0005 / 2.0**0.5, 1414),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_torques_are_converted_to_each_torque_unit(
    unit: str, step_Nm: float, half_a_Nm: int, sign: int
) -> None:
    one = drive(torque_unit=unit, torque_sign=sign)
    assert torque_unit_Nm(one, 2.4, 0.5) == pytest.approx(step_Nm)
    axis = AxisConfig(1, one, 2.4, 8192, 0x3AD, 2.0, 0.5)
    assert axis.Nm_per_unit == pytest.approx(sign * step_Nm)
    # the drive's limit has no sign
    assert list(torque_settings(one, step_Nm, 0.5)) == [(0x6072, half_a_Nm)]


def test_a_torque_slope_is_per_second_and_clamped_to_its_object() -> None:
    slow = drive(torque_unit="cNm", torque_slope_Nm_s=20.0)
    assert list(torque_settings(slow, 1e-2, 1.0)) == [(0x6072, 100), (0x6087, 2000)]
    fast = drive(torque_unit="mNm", torque_slope_Nm_s=1e9)
    assert list(torque_settings(fast, 1e-3, 100.0)) == [(0x6072, 0xFFFF), (0x6087, 0xFFFFFFFF)]


@pytest.mark.parametrize(
    ("velocity", "acceleration", "units"),
    [("counts_per_s", "counts_per_s2", (1000, 4000)), ("rpm", "rpm_per_s", (15, 60))],
)
def test_speeds_and_accelerations_are_converted_to_the_units_of_the_profile(
    velocity: str, acceleration: str, units: tuple[int, int]
) -> None:
    one = drive(velocity_unit=velocity, acceleration_unit=acceleration)
    axis = AxisConfig(1, one, 3.0, 4000, 0x3AD, 2.0)
    quarter_turn = math.tau / 4
    assert (axis.speed_units(quarter_turn), axis.acceleration_units(4 * quarter_turn)) == units
    assert axis.speed_units(1e-9) == 1, "a speed of zero units would never arrive"
