"""The thesis' cogging curves: averaging, filtering and repair."""

import math

import numpy as np
import pytest

from cdpr_rt.identification.thesis import GRID, identify_thesis
from cdpr_rt.identification.windows import IdentificationError, SweepData

SPEED = math.radians(3.0)


def sweep(direction, torque, lost=()):
    """An ideal sweep whose torque follows a curve; in `lost` (degrees) the rotor runs ahead."""
    time = np.arange(round(4 * math.pi / SPEED / 1e-3)) * 1e-3
    setpoint = direction * SPEED * time
    angle = setpoint - direction * math.radians(3.0)
    degrees = np.degrees(angle) % 360.0
    value = torque(angle)
    for low, high in lost:
        ahead = (degrees > low) & (degrees < high)
        angle = np.where(ahead, setpoint + direction * math.radians(0.5), angle)
        value = np.where(ahead, -direction * 0.03, value)
    return SweepData(time, angle, value, setpoint, np.full(time.size, direction * SPEED))


def curve(direction):
    return lambda a: 0.06 * np.sin(4 * a + 0.3) + direction * 0.09


def test_the_curve_and_its_mean_are_found():
    found = identify_thesis([sweep(1, curve(1)), sweep(-1, curve(-1))])
    grid = np.arange(GRID) * 2 * math.pi / GRID + math.pi / GRID
    assert found.mean_Nm == pytest.approx([0.09, -0.09], abs=1e-4)
    assert found.repaired_fraction == 0.0
    assert found.turns == (2, 2)
    for row in found.variation_Nm:
        assert np.max(np.abs(row - 0.06 * np.sin(4 * grid + 0.3))) < 1e-3


def test_the_filter_is_a_quadratic_over_five_degrees():
    def spike(a):
        return np.where(np.abs(np.degrees(a) % 360.0 - 100.0) < 0.05, 1.0, 0.0)

    found = identify_thesis([sweep(1, spike), sweep(-1, spike)])
    touched = np.flatnonzero(np.abs(found.curve_Nm[0]) > 1e-9)
    assert (touched[-1] - touched[0]) * 360.0 / GRID == pytest.approx(5.0, abs=0.3)


def test_a_runaway_is_repaired_from_the_other_direction():
    lost = ((30.0, 50.0), (200.0, 215.0))
    found = identify_thesis([sweep(1, curve(1), lost), sweep(-1, curve(-1))])
    assert found.repaired[0].mean() == pytest.approx(35.0 / 360.0, rel=0.25)
    assert not found.repaired[1].any()
    whole = identify_thesis([sweep(1, curve(1)), sweep(-1, curve(-1))])
    assert np.max(np.abs(found.curve_Nm - whole.curve_Nm)) < 0.01
    assert found.mean_Nm == pytest.approx(whole.mean_Nm, abs=1e-3)


def test_tables_interpolate_around_the_turn():
    found = identify_thesis([sweep(1, curve(1)), sweep(-1, curve(-1))])
    assert found.tables(GRID) == pytest.approx(found.curve_Nm)
    assert found.tables(720).shape == (2, 720)


def test_sweeps_without_a_whole_turn_are_rejected():
    short = SweepData(*(a[: a.size // 4] for a in vars(sweep(1, curve(1))).values()))
    with pytest.raises(IdentificationError, match="no whole turn"):
        identify_thesis([short])


def test_broken_records_are_rejected():
    good = sweep(1, curve(1))
    with pytest.raises(IdentificationError, match="no recorded run"):
        identify_thesis([])
    short = SweepData(*(a[:-1] if n == "torque_Nm" else a for n, a in vars(good).items()))
    with pytest.raises(IdentificationError, match="lengths"):
        identify_thesis([short])
    bad = good.torque_Nm.copy()
    bad[7] = math.nan
    with pytest.raises(IdentificationError, match="torque_Nm"):
        identify_thesis(
            [
                SweepData(
                    good.time_s,
                    good.angle_rad,
                    bad,
                    good.setpoint_rad,
                    good.setpoint_velocity_rad_s,
                )
            ]
        )
