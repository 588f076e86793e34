"""The scale of distances between poses not used, and how well it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdpr_rt.calibration.markers.geometry.rotations import exponentials
from cdpr_rt.calibration.verification.verification import Scale

TRUE, NOISE_m = 1.002, 5e-4


def test_the_scale_is_that_of_distances_and_its_deviation_that_of_trials() -> None:
    rng = np.random.default_rng(3)
    found = []
    for _ in range(200):
        told = rng.uniform(-0.4, 0.4, (10, 3))
        turn = exponentials(rng.normal(size=(1, 3)))[0]
        measured = TRUE * told @ turn.T + 2.0 + rng.normal(0.0, NOISE_m, told.shape)
        found.append(Scale.of(told, measured))
    factors = np.array([one.factor for one in found])
    predicted = np.sqrt(np.mean([one.std**2 for one in found]))
    assert factors.mean() == pytest.approx(TRUE, abs=4.0 * factors.std() / math.sqrt(200))
    assert 0.8 < predicted / factors.std() < 1.3


def test_two_poses_and_poses_at_one_place_tell_no_scale() -> None:
    for told in (np.eye(3)[:2], np.ones((5, 3))):
        scale = Scale.of(told, 1.01 * told)
        assert math.isnan(scale.factor) and math.isnan(scale.std)
