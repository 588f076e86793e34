"""The simplex search against scipy's and on functions whose minimum is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize, rosen

from cdpr_rt.identification.simplex import minimise


@settings(derandomize=True, deadline=None, max_examples=40)
@given(goal=st.lists(st.floats(-3, 3), min_size=1, max_size=4), scale=st.floats(0.1, 10))
def test_bowl(goal, scale):
    centre = np.array(goal)
    weights = scale * (1.0 + np.arange(centre.size))
    at, low = minimise(
        lambda x: float(weights @ (x - centre) ** 2), np.zeros(centre.size), 0.3, 600
    )
    assert at == pytest.approx(centre, abs=0.02)
    assert low < 0.01 * scale


def test_as_good_as_scipy_with_the_same_effort():
    start = np.array([-1.0, 1.5, 0.5])
    simplex = np.vstack([start, start + 0.3 * np.eye(3)])
    options = {"maxfev": 150, "initial_simplex": simplex, "xatol": 0.0, "fatol": 0.0}
    other = minimize(rosen, start, method="Nelder-Mead", options=options)
    _, low = minimise(rosen, start, 0.3, 150)
    assert low < 2.0 * other.fun + 1e-3


def test_stays_within_the_evaluations():
    calls = []
    minimise(lambda x: calls.append(1) or float(rosen(x)), np.zeros(3), 0.3, 50)
    assert len(calls) <= 50 + 4
