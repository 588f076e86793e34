"""SI values of the units of a drive's torque, velocity and acceleration objects."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cdpr_profiles import DriveProfile

_OF_RATED = {"per_mille_of_rated": 1e-3, "percent_of_rated": 1e-2}
_ABSOLUTE_Nm = {"mNm": 1e-3, "cNm": 1e-2}
CURRENTS_Arms = {"mA_rms": 1e-3, "mA_peak": 1e-3 / math.sqrt(2.0)}
"""Units of torque that are units of current."""
_SAME_TORQUE = 0.5
"""Relative tolerance for matching torques. It may be large, because the units of 6076h differ by
a factor of 1000."""
_RATED_Nm = {"mNm": 1e-3, "uNm": 1e-6}
_RAD_S_PER_RPM = math.tau / 60.0


def torque_unit_Nm(
    drive: DriveProfile, rated_torque_Nm: float, constant_Nm_per_Arms: float
) -> float:
    """Return the torque of one unit of 6071h, 6072h, 6077h and, per second, of 6087h.

    Rated torque and torque constant of the motor are the references of relative units and of
    currents.
    """
    unit = drive.torque_unit
    if unit in CURRENTS_Arms:
        return CURRENTS_Arms[unit] * constant_Nm_per_Arms
    return _OF_RATED[unit] * rated_torque_Nm if unit in _OF_RATED else _ABSOLUTE_Nm[unit]


def rated_torque_unit_Nm(drive: DriveProfile) -> float:
    """Return the torque of one unit of 6076h."""
    return _RATED_Nm[drive.rated_torque_unit]


def suspected_unit(drive: DriveProfile, shown_Nm: float, expected_Nm: float) -> str:
    """Return the unit of 6076h in which a drive reports the expected torque; "" if none fits."""
    shown = shown_Nm / rated_torque_unit_Nm(drive)
    return next(
        (
            name
            for name, unit_Nm in _RATED_Nm.items()
            if name != drive.rated_torque_unit
            and abs(shown * unit_Nm - expected_Nm) < _SAME_TORQUE * expected_Nm
        ),
        "",
    )


def whole_units(limit: float, unit: float) -> int:
    """Return the whole number of units within a limit, with a tolerance for rounding of 1e-9."""
    return int(limit / unit + 1e-9)


def velocity_unit_rad_s(drive: DriveProfile, counts_per_turn: int) -> float:
    """Return the speed of one unit of 6099h."""
    return _RAD_S_PER_RPM if drive.velocity_unit == "rpm" else math.tau / counts_per_turn


VELOCITY_UNITS = {0x00B4_4700: "rpm", 0x00B5_0300: "counts_per_s"}
"""`velocity_unit` of a profile by 60A9h (prefix, numerator, denominator by CiA 303-2)."""


def acceleration_unit_rad_s2(drive: DriveProfile, counts_per_turn: int) -> float:
    """Return the acceleration of one unit of 609Ah."""
    per_second = drive.acceleration_unit == "rpm_per_s"
    return _RAD_S_PER_RPM if per_second else math.tau / counts_per_turn


def torque_settings(
    drive: DriveProfile, unit_Nm: float, limit_Nm: float
) -> Iterator[tuple[int, int]]:
    """Yield index and value of the objects that limit the torque: limit and, if given, slope.

    A limit that is not a whole number of units is rounded down.
    """
    yield 0x6072, min(whole_units(limit_Nm, unit_Nm), 0xFFFF) if unit_Nm > 0.0 else 0
    if drive.torque_slope_Nm_s is not None and unit_Nm > 0.0:
        yield 0x6087, round(min(drive.torque_slope_Nm_s / unit_Nm, 0xFFFFFFFF))
