"""Whole commissionings of simulated motors: required results, and results beside an oracle's."""

import math

import pytest

from cdpr_rt.control.validation import ratios
from cdpr_rt.identification.harmonic_model import identify_harmonic_model
from tests.cdpr_rt.identification.bench import Bench, TruePlant, commission, compensation, validate

pytestmark = pytest.mark.long

FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")


def true_amplitude(bench: Bench, amplitude: float) -> float:
    p = bench.plant
    return amplitude * (1 + p.cogging_per_K * bench.rise) / (1 + p.kt_error)


def assert_near_oracle(figures):
    for name in FIGURES:
        reached, ideal = getattr(figures["harmonic"], name), getattr(figures["oracle"], name)
        assert reached <= 1.5 * ideal, (name, reached, ideal)


@pytest.fixture(scope="module")
def default():
    return commission(TruePlant())


def test_the_default_motor_is_identified(default):
    harmonic, plant = default.harmonic, default.bench.plant
    assert harmonic.orders == (4,)
    amplitude = true_amplitude(default.bench, 0.06)
    assert harmonic.amplitudes_Nm[0] == pytest.approx(amplitude, rel=2e-3)
    inertia = harmonic.inertia_kg_m2
    assert abs(inertia.value - plant.inertia / 1.04) < inertia.half_width
    assert harmonic.latency_s.value == pytest.approx(0.00232, abs=2e-4)
    friction = (1 + plant.friction_per_K * default.bench.rise) / 1.04
    assert harmonic.coulomb_forward_Nm.value == pytest.approx(0.08 * 1.05 * friction, rel=0.01)
    assert harmonic.coulomb_backward_Nm.value == pytest.approx(0.08 * 0.95 * friction, rel=0.01)
    assert harmonic.viscous_Nms_rad.value == pytest.approx(5e-4 / 1.04, rel=0.05)
    assert harmonic.friction.stribeck_speed_rad_s == pytest.approx(0.2, rel=0.2)
    assert harmonic.coverage == 1.0
    assert harmonic.harmonics[0].per_pole_pair == 1.0


def test_the_default_motor_runs_smoothly_under_compensation(default):
    figures = validate(default)
    thesis = ratios(figures["none"], figures["thesis"])
    harmonic = ratios(figures["none"], figures["harmonic"])
    assert thesis.rms_position_error >= 3
    assert thesis.peak_pid_effort >= 6
    assert thesis.peak_velocity_error >= 5
    assert harmonic.rms_position_error >= 10
    assert harmonic.peak_pid_effort >= 10
    assert harmonic.peak_velocity_error >= 8
    assert_near_oracle(figures)


def test_a_motor_with_slots_runaway_odd_encoder_and_drift_is_identified():
    plant = TruePlant(
        terms=((24, 0.04, 10.0), (72, 0.02, 33.0)),
        counts=10007,
        cogging_per_K=-0.004,
        time_constant=300.0,
        seed=5,
    )
    done = commission(plant)
    assert done.thesis.repaired_fraction > 0.1
    assert {24, 72} <= set(done.harmonic.orders)
    for order, amplitude, _ in plant.terms:
        found = next(h for h in done.harmonic.harmonics if h.order == order)
        assert found.amplitude_Nm.value == pytest.approx(
            true_amplitude(done.bench, amplitude), rel=0.01
        )
    assert_near_oracle(validate(done))


def test_ripple_by_current_sensor_offset_is_found_at_low_friction():
    plant = TruePlant(
        terms=((24, 0.01, 3.0),),
        offset_terms=((4, 0.08, 17.0),),
        coulomb=0.012,
        breakaway=0.016,
        asymmetry=0.5,
        seed=3,
    )
    done = commission(plant)
    assert done.harmonic.orders[0] == 4
    assert done.harmonic.amplitudes_Nm[0] == pytest.approx(0.08, rel=5e-3)
    assert "current sensor" in done.harmonic.harmonics[0].hint
    assert_near_oracle(validate(done))


def test_a_motor_without_cogging_has_no_harmonic_orders():
    bench = Bench(TruePlant(terms=()))
    sweeps = [bench.ramp(v, 1, lead=0.05, kp=1.9)[0] for v in (3, -3)]
    found = identify_harmonic_model(sweeps, 1.13e-4, 0.0023, 4)
    assert found.orders == ()
    assert not found.inertia_measured
    assert found.inertia_kg_m2.value == 1.13e-4
    assert math.isclose(float(abs(found.tables(64)).max()), 0.0)


def test_compensation_looks_ahead_by_the_identified_latency(default):
    assert compensation(default.harmonic).look_ahead_s == default.harmonic.latency_s.value
