"""The harmonic model from a single turn: what is found, and what is rejected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.identification.harmonic_model import identify_harmonic_model
from cdpr_rt.identification.result import likely_cause
from cdpr_rt.identification.thesis import identify_thesis
from cdpr_rt.identification.windows import IdentificationError, SweepData
from tests.cdpr_rt.identification.bench import Bench, TruePlant

TERMS = ((4, 0.03, 17.0), (24, 0.02, 40.0), (28, 0.008, 60.0), (72, 0.006, 5.0))


def turn(plant: TruePlant, speed_deg_s: float, turns: float = 1.03) -> SweepData:
    return Bench(plant).ramp(speed_deg_s, turns, ramp_s=0.2, kp=1.0)[0]


def part(run: SweepData, which: slice | np.ndarray) -> SweepData:
    return SweepData(*(values[which] for values in vars(run).values()))


def identified(*runs: SweepData):
    return identify_harmonic_model(runs, 1.13e-4, 0.0023, 4)


@pytest.mark.parametrize("speed", [40.0, -40.0, 15.0])
def test_one_turn_in_one_direction_shows_all_orders(speed):
    found = identified(turn(TruePlant(terms=TERMS, breakaway=0.085, kt_error=0.0), speed))
    assert found.directions == ((1,) if speed > 0.0 else (-1,))
    assert {n for n, _, _ in TERMS} <= set(found.orders)
    for order, amplitude, _ in TERMS:
        one = next(h for h in found.harmonics if h.order == order)
        assert one.amplitude_Nm.value == pytest.approx(amplitude, rel=0.25, abs=3e-3)
    same = found.coulomb_forward_Nm.value == found.coulomb_backward_Nm.value
    assert same and found.coulomb_forward_Nm.value > 0.0


@pytest.mark.parametrize("turns", [1.03, 2.03])
def test_a_curve_adds_what_many_small_orders_leave(turns: float) -> None:
    rng = np.random.default_rng(5)
    small = [(n, 1.2e-3 * rng.rayleigh(), rng.uniform(0.0, 360.0)) for n in range(1, 90)]
    terms = ((7, 0.02, 10.0), (28, 0.012, 30.0), *small)
    plant = TruePlant(terms=terms, coulomb=0.02, breakaway=0.025, kt_error=0.0)
    found = identified(turn(plant, 20.0, turns))
    angle = np.linspace(0.0, 2.0 * np.pi, 4000)
    true = plant.wave(terms, angle)
    alone = replace(found, remainder_Nm=np.zeros_like(found.remainder_Nm))
    error, before = (np.std(f.cogging_Nm(angle) - true) for f in (found, alone))
    assert error < 0.85 * before


@pytest.mark.parametrize(
    ("small_Nm", "most"),
    [pytest.param(1.5e-3, 0.4, id="curve of small orders"), pytest.param(0.0, 1.5, id="noise")],
)
def test_the_curve_of_one_turn_is_nearly_whole_only_if_noise_does_not_explain_it(
    small_Nm: float, most: float
) -> None:
    rng = np.random.default_rng(0)
    small = [(n, small_Nm * rng.rayleigh(), rng.uniform(0.0, 360.0)) for n in range(1, 60)]
    terms = ((7, 0.02, 10.0), (28, 0.012, 30.0), *small)
    plant = TruePlant(terms=terms, coulomb=0.02, breakaway=0.025, kt_error=0.0)
    found = identified(turn(plant, 20.0))
    angle = np.linspace(0.0, 2.0 * np.pi, 4000)
    true = plant.wave(terms, angle)
    alone = replace(found, remainder_Nm=np.zeros_like(found.remainder_Nm))
    error, before = (np.std(f.cogging_Nm(angle) - true) for f in (found, alone))
    assert error < most * before


def test_noise_that_does_not_repeat_adds_no_curve() -> None:
    plant = TruePlant(coulomb=0.08, breakaway=0.085, noise=2.0, kt_error=0.0)
    found = identified(*(turn(plant, speed, 3.03) for speed in (20.0, -20.0)))
    assert np.std(found.remainder_Nm) < 0.5 * found.residual_rms_Nm


def test_a_motor_without_cogging_that_turns_in_one_direction_has_no_orders():
    for seed in range(3):
        plant = TruePlant(terms=(), breakaway=0.082, seed=seed)
        assert identified(turn(plant, 12.0)).orders == ()


def test_an_inertia_that_is_wrong_by_a_factor_hardly_changes_the_cogging():
    run = turn(TruePlant(terms=TERMS, breakaway=0.085, kt_error=0.0), 40.0)
    found = [identify_harmonic_model([run], inertia, 0.0023, 4) for inertia in (1.13e-4, 6e-4)]
    angle = np.linspace(0.0, 6.28, 500)
    one, other = (f.cogging_Nm(angle) for f in found)
    assert np.std(one - other) < 0.05 * np.std(one)
    assert not found[1].inertia_measured and found[1].inertia_kg_m2.value == 6e-4


def test_an_incomplete_turn_is_rejected():
    run = turn(TruePlant(terms=TERMS, breakaway=0.085), 40.0)
    with pytest.raises(IdentificationError, match=r"contain 7\d% of a turn"):
        identified(part(run, slice(0, run.time_s.size * 3 // 4)))


def test_irregular_samples_are_rejected_with_their_share():
    run = turn(TruePlant(terms=TERMS, breakaway=0.085), 40.0)
    kept = np.random.default_rng(1).random(run.time_s.size) < 0.3
    with pytest.raises(IdentificationError, match=r"% of \d+ samples lie in pieces"):
        identified(part(run, kept))


def test_the_share_of_dropped_samples_is_in_the_result():
    run = turn(TruePlant(terms=TERMS, breakaway=0.085), 40.0)
    count = run.time_s.size
    kept = np.ones(count, bool)
    kept[count // 2 : count // 2 + 60] = False
    kept[count // 2 + 120 : count // 2 + 180] = False
    found = identified(part(run, kept))
    assert found.dropped_fraction == pytest.approx(60 / (count - 120), rel=1e-6)


def test_the_thesis_method_mirrors_a_missing_direction():
    found = identify_thesis([turn(TruePlant(terms=TERMS, breakaway=0.085), 15.0)])
    assert found.turns == (1, 0)
    assert found.mean_Nm[1] == pytest.approx(-found.mean_Nm[0])
    assert found.variation_Nm[0] == pytest.approx(found.variation_Nm[1])


@pytest.mark.parametrize(
    ("order", "text"),
    [
        (84, "12 slots and 14 poles: slots against magnets"),
        (36, "the 12 slots: unequal magnets"),
        (28, "the 14 poles: unequal slots"),
        (21, "the pole pairs: unequal poles"),
        (37, "no multiple of the pole pairs or slots"),
    ],
)
def test_slots_and_poles_explain_an_order(order, text):
    assert text in likely_cause(order, 7, 12)
