"""A platform that hangs on four cables is calibrated with its tilt by the equilibrium."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.fit import locate, moved
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import linearise
from tests.cdpr_rt.calibration.made_up import MadeUp, made_up, measured

IDENTIFIED = ("exit", "offset", "drum")
_STEP = 1e-6


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """Return the file of a robot like point-4 whose platform has four anchor points."""
    text = (SHIPPED / "robots" / "point-4.toml").read_text()
    text = text.replace("mass_kg", 'controlled = ["x", "y", "z"]\nmass_kg', 1)
    for corner in ("-0.1, 0.1", "0.1, 0.1", "0.1, -0.1", "-0.1, -0.1"):
        text = text.replace("[0.0, 0.0, 0.0]", f"[{corner}, 0.1]", 1)
    path = tmp_path / "hanging.toml"
    path.write_text(text)
    return path


def true_poses(what: MadeUp) -> np.ndarray:
    return np.array([pose.array for pose in what.poses])


def mean_error_mm(geometry: CableGeometry, seen: Observations, what: MadeUp) -> float:
    """Return the mean error of positions by lengths alone."""
    off_m = locate(geometry, seen).poses[:, 0] - true_poses(what)[:, 0]
    return 1e3 * float(np.linalg.norm(off_m, axis=1).mean())


def assumed(what: MadeUp, seen: Observations) -> Observations:
    """Return observations with the planned tensions instead of the measured ones."""
    model = what.file.model
    weights = np.tile(model.weight(), (seen.poses, 1))
    planned, _ = model.planned_tensions(seen.start, weights)
    return replace(seen, tension_N=planned, tension_assumed=True)


def test_derivatives_agree_with_finite_differences_at_rest(robot: Path) -> None:
    what = made_up(str(robot), 8, 3, identified=(*IDENTIFIED, "anchor"), elongation=0.0)
    poses, none = true_poses(what), np.zeros(0)
    at = linearise(what.true, what.seen, poses, none)
    assert np.abs(at.residual).max() < 1e-6
    values = what.true.values()
    for k in range(values.size):
        step = np.zeros(values.size)
        step[k] = _STEP
        there, back = (
            linearise(what.true.with_values(values + s), what.seen, poses, none).residual
            for s in (step, -step)
        )
        told = (there - back) / (2 * _STEP)
        assert at.by_parameter[..., k] == pytest.approx(told, abs=1e-5 * np.abs(told).max())
    for k in range(6):
        step = np.zeros((len(poses), 6))
        step[:, k] = _STEP
        there, back = (
            linearise(what.true, what.seen, moved(poses, s, what.true.free), none).residual
            for s in (step, -step)
        )
        told = (there - back) / (2 * _STEP)
        assert at.by_pose[..., k] == pytest.approx(told, abs=1e-5 * np.abs(told).max())


def test_lengths_give_the_tilted_pose_for_the_true_geometry(robot: Path) -> None:
    what = made_up(str(robot), 12, 5, identified=IDENTIFIED, elongation=0.0)
    there = locate(what.true, what.seen)
    assert there.poses == pytest.approx(true_poses(what), abs=1e-6)
    tilt = np.arccos(0.5 * (np.trace(there.poses[:, 1:], axis1=1, axis2=2) - 1.0))
    assert np.degrees(tilt).max() > 5.0


@pytest.mark.parametrize("tensions", ["measured", "assumed"])
@pytest.mark.parametrize("std_rad", [None, 2e-3], ids=["points", "points and rotations"])
def test_a_calibration_finds_the_geometry_and_blames_no_cable(
    robot: Path, tensions: str, std_rad: float | None
) -> None:
    what = made_up(
        str(robot), 30, 3, identified=IDENTIFIED, elongation=0.0, noise_m=3e-4, home_first=True
    )
    seen = measured(what, 1e-3, std_rad, 5)
    if tensions == "assumed":
        seen = assumed(what, seen)
    outcome = calibrate(load_robot(str(robot)), what.file, seen, "points")
    assert outcome.good
    assert outcome.faults == []
    assert mean_error_mm(what.file, seen, what) > 20.0
    assert mean_error_mm(outcome.found.geometry, seen, what) < 1.5
    assert 0.7 < outcome.honesty.ratio < 1.5
