"""The fit agrees with synthetic truths, numeric derivatives and an independent solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from cdpr_profiles import load_robot
from cdpr_rt.calibration.fit import fit, locate, moved
from cdpr_rt.calibration.parameters import KINDS, CableGeometry, Knowledge
from cdpr_rt.calibration.residuals import encoder_lengths, linearise
from cdpr_rt.errors import InvalidRequestError
from tests.cdpr_rt.calibration.made_up import made_up, measured
from tests.heavy_cables import cables_on

ROBOTS = ("planar-3", "planar-4", "point-4", "suspended-8", "spatial-8")
STRAIGHT = ("planar-3", "planar-4", "point-4", "spatial-8")
_STEP = 1e-6


@pytest.mark.parametrize("robot", STRAIGHT)
def test_derivatives_agree_with_finite_differences(robot: str) -> None:
    kinds = tuple(kind for kind in KINDS if kind != "pulley")  # radii are not negative
    what = made_up(robot, 12, 3, identified=kinds)
    geometry = what.file.with_values(np.random.default_rng(1).normal(0.0, 0.01, what.file.size))
    seen = measured(what, 1e-3, 2e-3, 5)
    seen = replace(seen, jumps=((1, 5),), target_m=np.array([0.1, -0.2, 0.0]))
    poses, jumps = seen.start, np.array([0.004])
    at = linearise(geometry, seen, poses, jumps)

    def residual(values: np.ndarray) -> np.ndarray:
        size = geometry.size
        return linearise(geometry.with_values(values[:size]), seen, poses, values[size:]).residual

    values = np.append(geometry.values(), jumps)
    for k in range(values.size):
        step = np.zeros(values.size)
        step[k] = _STEP
        told = (residual(values + step) - residual(values - step)) / (2 * _STEP)
        scale = max(float(np.abs(told).max()), 1.0)
        assert at.by_parameter[..., k] == pytest.approx(told, abs=2e-6 * scale)
    for k in range(len(geometry.free)):
        step = np.zeros((len(poses), len(geometry.free)))
        step[:, k] = _STEP
        there = linearise(geometry, seen, moved(poses, step, geometry.free), jumps).residual
        back = linearise(geometry, seen, moved(poses, -step, geometry.free), jumps).residual
        told = (there - back) / (2 * _STEP)
        assert at.by_pose[..., k] == pytest.approx(told, rel=2e-3, abs=2e-6 * np.abs(told).max())


def test_the_derivative_by_a_pulley_radius_agrees_with_finite_differences() -> None:
    what = made_up("spatial-8", 6, 4, identified=("pulley",))
    cable = what.file.cable.copy()
    cable[:, 8] = 0.04
    geometry = replace(what.file, cable=cable)
    at = linearise(geometry, what.seen, what.seen.start, np.zeros(0))
    for k in range(geometry.size):
        values = geometry.values()
        values[k] += _STEP
        there = linearise(geometry.with_values(values), what.seen, what.seen.start, np.zeros(0))
        values[k] -= 2 * _STEP
        back = linearise(geometry.with_values(values), what.seen, what.seen.start, np.zeros(0))
        told = (there.residual - back.residual) / (2 * _STEP)
        assert at.by_parameter[..., k] == pytest.approx(told, rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_truth_is_found_without_noise(robot: str) -> None:
    what = made_up(robot, 40, 11)
    # with almost no prior knowledge
    loose = Knowledge(exit_m=5.0, offset_m=5.0, drum=0.5, elongation=50.0)
    seen = measured(what, 1e-7, 1e-7, 1)
    found = fit(replace(what.file, knowledge=loose), seen)
    assert found.converged
    off = found.geometry.cable - what.true.cable
    assert np.abs(off[:, :4]).max() < 2e-4
    assert np.abs(off[:, 4]).max() < 1e-4
    if what.file.compliance_1_N.any():
        assert found.geometry.elongation == pytest.approx(what.true.elongation, abs=2e-2)


def test_the_fit_agrees_with_an_independent_solver_of_the_thesis_equations() -> None:
    what = made_up("spatial-8", 30, 5, drum=0.0, elongation=-1.0, identified=("exit", "offset"))
    rigid = replace(what.file, compliance_1_N=np.zeros(8))
    seen = measured(what, 1e-7, 1e-7, 2)
    poses = np.array([pose.array for pose in what.poses])
    lengths = what.seen.length_m
    a, b = what.file.kernel_geometry()[:3].T, what.file.kernel_geometry()[3:6].T

    def squares(v: np.ndarray) -> np.ndarray:  # (3.18)
        x = v.reshape(8, 4)
        c = poses[:, None, 0] + np.einsum("jab,ib->jia", poses[:, 1:], b) - a - x[:, :3]
        return np.asarray(((c**2).sum(axis=2) - (lengths + x[:, 3]) ** 2).ravel())

    theirs = least_squares(squares, np.zeros(32), method="lm", xtol=1e-14, ftol=1e-14).x
    ours = fit(replace(rigid, knowledge=Knowledge(10.0, 10.0)), seen, robust=False)
    assert ours.geometry.cable[:, :4] == pytest.approx(theirs.reshape(8, 4), abs=2e-5)


@settings(max_examples=12)
@given(seed=st.integers(0, 10_000), robot=st.sampled_from(["planar-4", "point-4", "spatial-8"]))
def test_errors_agree_with_their_predicted_covariance(seed: int, robot: str) -> None:
    known = Knowledge(exit_m=0.008, offset_m=0.01, drum=0.003, length_m=3e-4, tension_N=1e-6)
    what = made_up(robot, 40, seed, noise_m=3e-4, elongation=-0.3)
    found = fit(replace(what.file, knowledge=known), measured(what, 1e-3, 2e-3, seed + 1))
    off = found.geometry.values() - what.true.values()
    whitened = np.linalg.solve(
        np.linalg.cholesky(found.uncertainty + 1e-18 * np.eye(off.size)), off
    )
    # chi squared of 17 to 41 unknowns, far within one in 10^6
    assert 0.15 < float((whitened**2).mean()) < 3.5


@pytest.mark.parametrize("robot", ["planar-4", "spatial-8"])
def test_a_translation_of_the_room_translates_the_result(robot: str) -> None:
    what = made_up(robot, 25, 8, noise_m=1e-4)
    shift = np.array([0.3, -0.2, 0.0])
    seen = measured(what, 1e-4, 1e-3, 3)
    aside = replace(
        seen,
        position_m=seen.position_m + shift * np.isfinite(seen.position_std_m),
        start=seen.start + np.pad(shift[None], ((0, 3), (0, 0))),
    )
    loose = replace(what.file, knowledge=Knowledge(exit_m=50.0))
    here, there = fit(loose, seen), fit(loose, aside)
    k = what.file.coordinates
    moved_by = there.geometry.cable[:, :k] - here.geometry.cable[:, :k]
    assert moved_by == pytest.approx(np.tile(shift[:k], (what.file.n, 1)), abs=2e-4)


def test_the_mean_of_exit_points_stays_without_measured_poses() -> None:
    what = made_up("spatial-8", 60, 2, noise_m=1e-4)
    found = fit(what.file, what.seen)
    assert np.abs(found.geometry.cable[:, :3].mean(axis=0)).max() < 2e-3


def test_the_true_geometry_gives_the_true_poses() -> None:
    what = made_up("spatial-8", 20, 6)
    there = locate(what.true, what.seen)
    true = np.array([pose.array for pose in what.poses])
    assert there.poses == pytest.approx(true, abs=1e-8)


def test_missing_poses_are_rejected() -> None:
    what = made_up("planar-4", 5, 1)
    with pytest.raises(InvalidRequestError, match="no poses"):
        fit(what.file, what.seen.some(np.zeros(5, bool)))


def test_an_unknown_kind_of_parameter_is_rejected() -> None:
    with pytest.raises(InvalidRequestError, match="colour"):
        CableGeometry.of(load_robot("planar-4"), ("exit", "colour"))
    with pytest.raises(InvalidRequestError, match="no platform"):
        CableGeometry.of(load_robot("bench-2"))


WEIGHT_N_m = 2.0


def test_lengths_of_heavy_cables_correspond_to_tensions_at_the_winches() -> None:
    robot = load_robot("suspended-8")
    assert robot.platform is not None
    cable = robot.axes[0].winch.cable.model_copy(update={"weight_per_length_N_m": WEIGHT_N_m})
    axes = [replace(axis, winch=replace(axis.winch, cable=cable)) for axis in robot.axes]
    platform = replace(robot.platform, cable_weights_N_m=(WEIGHT_N_m,) * len(axes))
    geometry = CableGeometry.of(replace(robot, platform=platform, axes=tuple(axes)))
    winch_N = np.linspace(180.0, 260.0, len(axes))
    for place_m in ((0.0, 0.0, 0.75), (2.0, -1.0, 2.0)):
        poses = np.vstack([place_m, np.eye(3)])[None]
        true_m, _ = cables_on(platform, place_m, [cable.stiffness_N] * len(axes), winch_N)
        told_m = encoder_lengths(geometry, poses, winch_N[None])[0]
        np.testing.assert_allclose(told_m, true_m, atol=1e-5)
