"""The columns of the printed motor tables agree with each other in each row.

A wrong digit in one column contradicts another one: pounds and newtons, peak and continuous values,
power and torque times speed.
"""

import math

import pytest

from cdpr_profiles import load_motor, load_motor_ratings
from cdpr_profiles.cable import N_PER_KGF
from cdpr_profiles.motor import RAD_S_PER_RPM, MotorDetail, MotorRatings, MotorSeries
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.reader import read_toml_model

SERIES = read_toml_model(SHIPPED / "motors" / "parker-mpp-mpj.series.toml", MotorSeries)
ROWS_230 = SERIES.ratings.models_230_VAC
ROWS_460 = SERIES.ratings.models_460_VAC
ROWS = {row.model: row for row in ROWS_230 + ROWS_460}

# Factors that the source evidently used.
LB_IN_PER_NM = 8.85
kg_m2_PER_lb_in_s2 = 0.45359237 * N_PER_KGF * 0.0254
KW_PER_HP = 0.75
PEAK_OVER_STALL_CURRENT = 3.16


def _within_last_digit(a: float, b: float, factor: float, digit_a: float, digit_b: float) -> bool:
    """Return whether a * factor equals b if each is rounded to its last digit."""
    return abs(a * factor - b) <= 0.5001 * (digit_a * factor + digit_b) + 3e-4 * abs(b)


@pytest.mark.parametrize("row", ROWS.values(), ids=ROWS)
def test_columns_of_a_row_agree(row: MotorRatings):
    w = _within_last_digit
    assert w(row.stall_torque_Nm, row.stall_torque_lb_in, LB_IN_PER_NM, 0.01, 0.01)
    assert w(row.peak_torque_Nm, row.peak_torque_lb_in, LB_IN_PER_NM, 0.01, 0.01)
    assert w(row.rated_power_HP, row.rated_power_kW, KW_PER_HP, 0.02, 0.01)
    assert w(row.stall_current_Arms, row.peak_current_Arms, PEAK_OVER_STALL_CURRENT, 0.01, 0.01)
    for lb_in, kg_m2 in (
        (row.mpp_inertia_lb_in_s2, row.mpp_inertia_kg_m2),
        (row.mpj_inertia_lb_in_s2, row.mpj_inertia_kg_m2),
    ):
        if lb_in is None or kg_m2 is None:
            assert lb_in is None
            assert kg_m2 is None
        else:
            assert lb_in * kg_m2_PER_lb_in_s2 == pytest.approx(kg_m2, rel=0.004)
    torque_at_rated_speed = row.rated_power_kW * 1e3 / (row.rated_speed_rpm * RAD_S_PER_RPM)
    assert 0.4 * row.stall_torque_Nm < torque_at_rated_speed < row.stall_torque_Nm


@pytest.mark.parametrize("model", SERIES.detail)
def test_columns_of_a_size_sheet_agree(model: str):
    d: MotorDetail = SERIES.detail[model]
    w = _within_last_digit
    assert w(d.stall_torque_Nm, d.stall_torque_in_lb, LB_IN_PER_NM, 0.01, 0.1)
    assert w(d.peak_torque_Nm, d.peak_torque_in_lb, LB_IN_PER_NM, 0.01, 0.1)
    assert w(d.rated_torque_Nm, d.rated_torque_in_lb, LB_IN_PER_NM, 0.01, 0.1)
    speed = d.rated_speed_rpm * RAD_S_PER_RPM
    assert w(d.rated_torque_Nm, d.rated_power_kW, speed / 1e3, 0.01, 0.01)
    k_t = d.voltage_constant_Vrms_per_krpm * math.sqrt(3) / (1e3 * RAD_S_PER_RPM)
    assert k_t == pytest.approx(d.torque_constant_Nm_per_Arms, abs=6e-4)
    from_current = d.stall_current_Arms * k_t
    assert from_current == pytest.approx(d.stall_torque_Nm, rel=0.01 + 0.05 / d.stall_current_Arms)
    assert w(d.mass_kg, d.mass_lb, 2.2046, 0.02, 0.01)
    assert d.mpp_inertia_in_lb_s2 * kg_m2_PER_lb_in_s2 == pytest.approx(
        d.mpp_inertia_kg_m2, rel=2e-4
    )
    if d.mpj_inertia_kg_m2 is None or d.mpj_inertia_in_lb_s2 is None:
        assert d.mpj_inertia_kg_m2 == d.mpj_inertia_in_lb_s2
    else:
        assert d.mpj_inertia_in_lb_s2 * kg_m2_PER_lb_in_s2 == pytest.approx(
            d.mpj_inertia_kg_m2, rel=3e-4
        )


@pytest.mark.parametrize("model", SERIES.detail)
def test_size_sheet_agrees_with_the_table_of_all_models(model: str):
    d, row = SERIES.detail[model], ROWS[model]
    assert d.stall_torque_Nm == row.stall_torque_Nm
    assert d.peak_torque_Nm == row.peak_torque_Nm
    assert d.rated_power_kW == row.rated_power_kW
    assert abs(d.rated_speed_rpm - row.rated_speed_rpm) <= 0.5
    assert abs(d.stall_current_Arms - row.stall_current_Arms) <= 0.051
    assert abs(d.peak_current_Arms - row.peak_current_Arms) <= 0.051
    assert d.mpp_inertia_kg_m2 == pytest.approx(row.mpp_inertia_kg_m2, rel=1e-3)
    assert (d.mpj_inertia_kg_m2 is None) == (row.mpj_inertia_kg_m2 is None)


def test_mpj_inertia_of_size_92_is_taken_from_the_size_sheet():
    row = load_motor_ratings("MPJ0922D")
    assert row.mpj_inertia_kg_m2 == 6.90e-4
    assert row.mpj_inertia_kg_m2 == row.mpp_inertia_lb_in_s2
    assert load_motor("MPJ0922D").rotor_inertia_kg_m2 == 4.261e-4
    assert any("0922" in note for note in SERIES.notes)
