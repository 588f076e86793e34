"""The reported intervals contain the truth about as often as they claim."""

import numpy as np
import pytest

from cdpr_rt.control.tuning import design_pid
from cdpr_rt.identification.harmonic_model import identify_harmonic_model, refine
from tests.cdpr_rt.identification.bench import (
    BANDWIDTH,
    LATENCY,
    NOMINAL_INERTIA,
    OBSERVER,
    Bench,
    TruePlant,
    fast_legs,
)

pytestmark = pytest.mark.long

TERMS = ((1, 0.01, 5.0), (4, 0.05, 1.0), (24, 0.02, 9.0))


def test_intervals_contain_the_truth_as_often_as_claimed():
    inside, widths = [], []
    first = None
    for seed in range(3):
        bench = Bench(TruePlant(terms=TERMS, cogging_per_K=0.0, friction_per_K=0.0, seed=seed))
        fast = fast_legs(bench)
        gains = design_pid(NOMINAL_INERTIA / 1.04, LATENCY, BANDWIDTH).gains
        known = bench.oracle(LATENCY, OBSERVER)
        runs = [bench.ramp(v, 1, lead=0.2, gains=gains, comp=known)[0] for v in (22, -22)]
        first = first or identify_harmonic_model(fast + runs, NOMINAL_INERTIA, LATENCY, 4)
        found = refine(first, fast + runs)
        for order, amplitude, phase in TERMS:
            h = next(h for h in found.harmonics if h.order == order)
            inside.append(abs(h.amplitude_Nm.value - amplitude / 1.04) < h.amplitude_Nm.half_width)
            # a reading sits half a count below the angle
            late = (phase + order * 180.0 / 8192 - h.phase_deg.value + 180.0) % 360.0 - 180.0
            inside.append(abs(late) < h.phase_deg.half_width + 0.02 * order)
            widths.append(h.amplitude_Nm.half_width)
    assert np.mean(inside) > 0.85
    assert np.max(widths) < 2e-4  # and they are not merely wide
