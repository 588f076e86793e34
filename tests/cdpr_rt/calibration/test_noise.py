"""Uncertainty of lengths and tensions, and its effect on predicted errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.calibration.fit import Fit, balance, fit, fit_with_noise_seen, weighed_fit
from cdpr_rt.calibration.parameters import DRUM
from cdpr_rt.calibration.residuals import length_std_m
from tests.cdpr_rt.calibration.camera_robot import KNOWN, CameraRobot, camera_robot
from tests.cdpr_rt.calibration.made_up import made_up, measured
from tests.cdpr_rt.calibration.synthetic_readings import ErrorBudget


def fitted(what: CameraRobot) -> Fit:
    start = what.start()
    return fit(what.geometry, start.seen, start=start.geometry, camera=start.camera)


@pytest.mark.parametrize("tension_N", [0.8, 2.5])
def test_noise_of_lengths_and_tensions_is_estimated(tension_N: float) -> None:
    guess = replace(KNOWN, length_m=3e-4, tension_N=4.0)
    what = camera_robot(40, 5, ErrorBudget(tension_N=tension_N), knowledge=guess)
    first = fitted(what)
    assert balance(first, first.seen).std_N == pytest.approx(tension_N, rel=0.12)  # 236 rows: 5 %
    _, weighed = fit_with_noise_seen(first, what.geometry)
    assert weighed.knowledge.tension_N == pytest.approx(tension_N, rel=0.12)
    assert weighed.knowledge.length_m == pytest.approx(1.5e-4, rel=0.35)
    assert weighed.cable == pytest.approx(0.0)


def test_a_wrong_mass_is_not_mistaken_for_noise() -> None:
    found = fitted(camera_robot(40, 5, ErrorBudget(tension_N=0.5)))
    told = balance(found, found.seen).std_N
    assert told is not None
    seen = replace(found.seen, tension_N=1.1 * found.seen.tension_N)  # as with a mass 10 % larger
    assert balance(found, seen).std_N == pytest.approx(1.1 * told, rel=1e-6)


def test_three_poses_do_not_determine_the_noise_of_tensions() -> None:
    found = fitted(camera_robot(15, 5))
    few = replace(found, seen=found.seen.some(np.arange(3)), poses=found.poses[:3])
    told = balance(few, few.seen)
    assert told.std_N is None
    assert told.tension_N == pytest.approx(few.seen.tension_N)


def test_balanced_tensions_hold_the_platform_and_have_smaller_errors() -> None:
    what = camera_robot(40, 5, ErrorBudget(tension_N=3.0))
    first = fitted(what)
    tension = first.seen.tension_N.copy()
    tension[0] += 60.0  # as for a platform on its stand
    told = balance(first, replace(first.seen, tension_N=tension))
    assert told.tension_N[0] == pytest.approx(tension[0])
    assert told.free[0] == pytest.approx(np.eye(8))
    assert told.std_N == pytest.approx(3.0, rel=0.12)
    # the balance determines six of eight directions
    assert np.trace(told.free[1:], axis1=1, axis2=2) == pytest.approx(2.0)
    moved = told.tension_N - tension
    assert np.einsum("jab,jb->ja", told.free[1:], moved[1:]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("std_N", [1.0, 20.0])  # friction of the motors at the cable
def test_tensions_determined_by_weight_are_corrected_by_it(std_N: float) -> None:
    what = made_up("suspended-6", 40, 5, noise_m=1e-4, in_balance=True)
    noise_N = np.random.default_rng(6).normal(0.0, std_N, what.seen.tension_N.shape)
    seen = measured(what, 1e-3, 2e-3, 4)
    first = fit(what.file, replace(seen, tension_N=what.seen.tension_N + noise_N))
    told = balance(first, first.seen)
    assert told.std_N == pytest.approx(std_N, rel=0.2)
    assert told.free == pytest.approx(0.0, abs=1e-12)
    assert (np.diagonal(told.free, axis1=1, axis2=2) >= 0.0).all()
    assert np.isfinite(length_std_m(what.file, told.of(first.seen))).all()
    found, weighed = fit_with_noise_seen(first, what.file)
    assert found.converged
    assert weighed.knowledge.tension_N == pytest.approx(std_N, rel=0.2)
    off = found.geometry.values() - what.true.values()
    # chi squared of 31 unknowns: 1 in 10^4 on both sides
    assert 0.3 < float(off @ np.linalg.solve(found.uncertainty, off)) / off.size < 2.3


def test_tensions_are_not_corrected_if_few_poses_are_free() -> None:
    found = fitted(camera_robot(15, 5))
    few = replace(found, seen=found.seen.some(np.arange(5)), poses=found.poses[:5])
    told = balance(few, few.seen).std_N
    tension = few.seen.tension_N.copy()
    # another force acts at two poses: 18 rows remain, minus four for the mass
    tension[:2] += np.random.default_rng(0).normal(0.0, 60.0, (2, 8))
    held = balance(few, replace(few.seen, tension_N=tension))
    assert told is not None and held.std_N is not None and held.std_N > told
    assert held.tension_N == pytest.approx(tension)
    assert held.free == pytest.approx(np.tile(np.eye(8), (5, 1, 1)))


@pytest.mark.parametrize("slope_noise", [150.0, 1e4])
def test_attenuation_of_the_elongation_is_bounded_by_its_information(slope_noise: float) -> None:
    what = made_up("spatial-8", 30, 5, noise_m=3e-4)
    first = fit(what.file, measured(what, 1e-3, 2e-3, 4))
    known = replace(what.file.knowledge, slope_noise=slope_noise)
    seen = replace(first.seen, start=first.poses).some(np.arange(30) >= 8)
    found = fit(replace(what.file, knowledge=known), seen, start=first.geometry)
    assert found.converged
    assert 0.0 <= 1.0 + found.geometry.elongation < 10.0 * (1.0 + first.geometry.elongation)
    assert np.isfinite(found.attenuation).all()
    std = np.sqrt(np.diag(found.covariance))
    assert np.linalg.eigvalsh(found.covariance / np.outer(std, std)).min() > 0.0
    assert std[-1] > np.sqrt(first.covariance[-1, -1])  # the attenuation increases the uncertainty


def test_a_fit_started_at_a_solution_stays_there() -> None:
    what = made_up("spatial-8", 30, 5, noise_m=3e-4)
    file = replace(what.file, knowledge=replace(what.file.knowledge, slope_noise=20.0))
    there = fit(file, measured(what, 1e-3, 2e-3, 4))
    assert there.total_cost < 0.0  # because of the attenuation
    again = fit(file, replace(there.seen, start=there.poses), start=there.geometry)
    assert again.converged
    assert again.geometry.values() == pytest.approx(there.geometry.values(), abs=1e-5)


def test_errors_agree_with_predictions_if_tension_errors_are_large() -> None:
    by_all, by_noise = [], []
    for seed in range(30, 33):
        what = camera_robot(40, seed, ErrorBudget(tension_N=3.0, spread_N=10.0))
        found, _ = fit_with_noise_seen(fitted(what), what.geometry)
        rows, n = found.geometry.rows, what.geometry.n
        drums = rows.index(DRUM) + np.arange(n) * len(rows)
        off = found.geometry.cable[:, DRUM] - what.made.drums
        square = found.uncertainty[np.ix_(drums, drums)]
        by_all.append([float(off @ np.linalg.solve(square, off)) / n])
        k, stretch = n * len(rows), (found.geometry.elongation - 0.43) ** 2
        by_all[-1].append(stretch / float(found.uncertainty[k, k]))
        by_noise.append(stretch / float(found.covariance[k, k]))
    drums_off, elongation_off = np.mean(by_all, axis=0)
    # chi squared of 24 and 3 degrees of freedom
    assert 0.25 < drums_off < 2.5
    assert elongation_off < 2.5
    assert np.mean(by_noise) > 2.5  # noise alone does not explain them


def with_tensions_about_those_told(what: CameraRobot, std_N: float, seed: int) -> CameraRobot:
    """Return the robot whose tensions have errors in directions that no balance determines."""
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


@pytest.mark.long
def test_errors_of_elongation_and_drums_agree_with_predictions_for_any_tension_error() -> None:
    chi = 0.0
    raw: list[float] = []
    off: dict[str, list[float]] = {"true": [], "told": []}
    for about, errors in off.items():
        for seed in range(30, 32):
            what = camera_robot(40, seed, ErrorBudget(tension_N=3.0 if about == "true" else 0.05))
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
            chi += float(error @ np.linalg.solve(covariance, error)) / len(index) / 4.0
            errors.append(error[-1])
            if about == "true":
                raw.append(first.geometry.elongation - 0.43)
    # chi squared of 36 degrees of freedom: 1 in 10^3 on both sides
    assert 0.4 < chi < 1.9
    assert max(raw) < -0.6
    assert 0.5 * np.mean(raw) < np.mean(off["true"]) < 0.0
    assert abs(np.mean(off["told"])) < 0.25
