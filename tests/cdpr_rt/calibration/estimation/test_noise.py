"""How uncertain lengths and tensions were, and what uncertain tensions do to what is predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.noise import (
    balance,
    fit_with_noise_seen,
    weighed_fit,
)
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
    assert balance(first, first.seen).std_N == pytest.approx(tension_N, rel=0.12)  # 236 rows: 5 %
    _, weighed = fit_with_noise_seen(first, what.geometry)
    assert weighed.knowledge.tension_N == pytest.approx(tension_N, rel=0.12)
    assert weighed.knowledge.length_m == pytest.approx(1.5e-4, rel=0.35)
    assert weighed.cable == pytest.approx(0.0)


def test_another_mass_than_the_file_s_is_not_taken_for_noise() -> None:
    found = fitted(camera_robot(40, 5, Errors(tension_N=0.5)))
    told = balance(found, found.seen).std_N
    assert told is not None
    seen = replace(found.seen, tension_N=1.1 * found.seen.tension_N)  # as of a mass 10 % larger
    assert balance(found, seen).std_N == pytest.approx(1.1 * told, rel=1e-6)


def test_few_poses_tell_nothing_of_tensions() -> None:
    found = fitted(camera_robot(15, 5))
    few = replace(found, seen=found.seen.some(np.arange(3)), poses=found.poses[:3])
    told = balance(few, few.seen)
    assert told.std_N is None
    assert told.tension_N == pytest.approx(few.seen.tension_N)


def test_balanced_tensions_hold_the_platform_and_err_less() -> None:
    what = camera_robot(40, 5, Errors(tension_N=3.0))
    first = fitted(what)
    tension = first.seen.tension_N.copy()
    tension[0] += 60.0  # as of a platform on its stand
    told = balance(first, replace(first.seen, tension_N=tension))
    assert told.tension_N[0] == pytest.approx(tension[0])
    assert told.free[0] == pytest.approx(np.eye(8))
    assert told.std_N == pytest.approx(3.0, rel=0.12)
    # six of eight directions are told by the balance
    assert np.trace(told.free[1:], axis1=1, axis2=2) == pytest.approx(2.0)
    moved = told.tension_N - tension
    assert np.einsum("jab,jb->ja", told.free[1:], moved[1:]) == pytest.approx(0.0, abs=1e-9)


def with_tensions_about_those_told(what: CameraRobot, std_N: float, seed: int) -> CameraRobot:
    """Return the robot whose true tensions err about told ones, in what no balance tells."""
    made, n = what.made, what.geometry.n
    rng, tension = np.random.default_rng(seed), what.seen.tension_N
    arm = np.einsum("jab,ib->jia", made.poses[:40, 1:], what.geometry.kernel_geometry()[3:6].T)
    away = made.exits_m - made.poses[:40, None, 0] - arm
    straight = np.linalg.norm(away, axis=2)
    wrenches = np.concatenate([away, np.cross(arm, away)], axis=2) / straight[..., None]
    free = np.array([np.eye(n) - np.linalg.pinv(one.T) @ one.T for one in wrenches])
    err_N = np.einsum("jab,jb->ja", free, rng.normal(0.0, std_N, (40, n)))
    soft = what.geometry.compliance_1_N * 1.43
    longer = straight / (1.0 + soft * (tension + err_N)) - straight / (1.0 + soft * tension)
    lengths = what.seen.length_m + longer - longer[0]
    return replace(what, seen=replace(what.seen, length_m=lengths))


def test_elongation_and_drums_err_as_predicted_whichever_tensions_err() -> None:
    chi = 0.0
    raw: list[float] = []
    off: dict[str, list[float]] = {"true": [], "told": []}
    for about, errors in off.items():
        for seed in range(30, 33):
            what = camera_robot(40, seed, Errors(tension_N=3.0 if about == "true" else 0.05))
            if about == "told":
                what = with_tensions_about_those_told(what, 3.0, seed)
            weighed = replace(what.geometry, knowledge=replace(KNOWN, tension_N=3.0, yielding=1.43))
            first = found = fitted(replace(what, geometry=weighed))
            for again in (False, True):
                known = replace(weighed.knowledge, slope_noise=again * found.slope_noise)
                found = weighed_fit(found, replace(weighed, knowledge=known), first.seen)
            rows, n = found.geometry.rows, what.geometry.n
            index = np.append(rows.index(DRUM) + np.arange(n) * len(rows), n * len(rows))
            drums = found.geometry.cable[:, DRUM] - what.made.drums
            error = np.append(drums, found.geometry.elongation - 0.43)
            covariance = found.uncertainty[np.ix_(index, index)]
            chi += float(error @ np.linalg.solve(covariance, error)) / len(index) / 6.0
            errors.append(error[-1])
            if about == "true":
                raw.append(first.geometry.elongation - 0.43)
    print(chi, raw, off)
    # chi squared of 54 degrees of freedom: 1 in 10^3 on both sides
    assert 0.5 < chi < 1.7
    assert max(raw) < -0.6
    assert 0.5 * np.mean(raw) < np.mean(off["true"]) < 0.0
    assert abs(np.mean(off["told"])) < 0.25
