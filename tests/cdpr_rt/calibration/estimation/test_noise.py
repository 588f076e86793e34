"""How uncertain lengths and tensions were, and what uncertain tensions do to what is predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.noise import fit_with_noise_seen, tension_std_N
from cdpr_rt.calibration.estimation.parameters import DRUM
from cdpr_tools.calibrate.made_readings import Errors
from tests.cdpr_rt.calibration.camera_robot import KNOWN, CameraRobot, camera_robot


def fitted(what: CameraRobot) -> Fit:
    start = what.start()
    return fit(what.geometry, start.seen, start=start.geometry, camera=start.camera)


@pytest.mark.parametrize("tension_N", [0.8, 2.5])
def test_lengths_and_tensions_tell_how_uncertain_they_are(tension_N: float) -> None:
    guess = replace(KNOWN, length_m=3e-4, tension_N=4.0)
    what = camera_robot(40, 5, Errors(tension_N=tension_N), knowledge=guess)
    first = fitted(what)
    assert tension_std_N(first) == pytest.approx(tension_N, rel=0.12)  # 236 rows: 5 %
    _, weighed = fit_with_noise_seen(first, what.geometry)
    assert weighed.knowledge.tension_N == pytest.approx(tension_N, rel=0.12)
    assert weighed.knowledge.length_m == pytest.approx(1.5e-4, rel=0.35)
    assert weighed.cable == pytest.approx(0.0)


def test_another_mass_than_the_file_s_is_not_taken_for_noise() -> None:
    found = fitted(camera_robot(40, 5, Errors(tension_N=0.5)))
    told = tension_std_N(found)
    assert told is not None
    seen = replace(found.seen, tension_N=1.1 * found.seen.tension_N)  # as of a mass 10 % larger
    assert tension_std_N(replace(found, seen=seen)) == pytest.approx(1.1 * told, rel=1e-6)


def test_few_poses_tell_nothing_of_tensions() -> None:
    found = fitted(camera_robot(15, 5))
    few = replace(found, seen=found.seen.some(np.arange(3)), poses=found.poses[:3])
    assert tension_std_N(few) is None


def test_errors_are_as_large_as_predicted_where_tensions_err_as_much_as_they_differ() -> None:
    chi, by_noise, freedom = 0.0, 0.0, 0
    for seed in range(3):
        what = camera_robot(30, 30 + seed, Errors(tension_N=3.0, spread_N=10.0))
        found, _ = fit_with_noise_seen(fitted(what), what.geometry)
        rows, n = found.geometry.rows, what.geometry.n
        off = found.geometry.cable[:, DRUM] - what.made.drums
        drums = np.ix_(*[rows.index(DRUM) + np.arange(n) * len(rows)] * 2)
        chi += float(off @ np.linalg.solve(found.uncertainty[drums], off))
        by_noise += float(off @ np.linalg.solve(found.covariance[drums], off))
        freedom += n
    # chi squared of 24 degrees of freedom: 1 in 10^4 on both sides
    assert 0.25 < chi / freedom < 2.5
    assert by_noise / freedom > 2.5  # noise alone does not make them
