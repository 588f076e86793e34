"""The frame of a calibration is kept if nothing determines it, and its accuracy reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.calibration.calibrate import calibrate, in_frame_of_file, position_shift
from cdpr_rt.calibration.fit import Fit, fit
from cdpr_rt.calibration.parameters import EXIT
from tests.cdpr_rt.calibration.camera_robot import KNOWN, camera_robot
from tests.cdpr_rt.calibration.made_up import made_up, measured
from tests.cdpr_rt.calibration.synthetic_readings import ErrorBudget

RIGHT = ErrorBudget(
    exit_m=0.0, home_m=1e-4, home_deg=0.01, drum=0.0, elongation=0.03, print_scale=3e-4
)
WRONG_EXITS = replace(RIGHT, exit_m=0.005)
TAPE = replace(KNOWN, exit_m=0.05)


def turned(found: Fit, turn: np.ndarray, shift: np.ndarray) -> Fit:
    """Return a fit moved as a rigid body."""
    exits, cable = found.geometry.kernel_geometry()[:3].T, found.geometry.cable.copy()
    cable[:, EXIT] += exits @ turn.T + shift - exits
    return replace(found, geometry=replace(found.geometry, cable=cable))


@pytest.mark.parametrize("robot", ["planar-4", "spatial-8"])
def test_a_rigidly_moved_fit_is_returned_to_the_frame_of_the_file(robot: str) -> None:
    what = made_up(robot, 30, 3, exit_m=0.0, drum=0.0, elongation=0.0, offset_m=0.0)
    found = fit(what.file, what.seen)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.01]).as_matrix()
    moved = turned(found, turn, np.array([0.01, -0.02, 0.0]))
    poses = what.seen.start[:20]
    assert np.linalg.norm(position_shift(moved, what.file, poses)) > 0.01
    # exit points determine nothing of the frame, or all of it
    back = in_frame_of_file(moved, what.file, poses, exits_std_m=10.0)
    assert np.abs(position_shift(back.found, what.file, poses)).max() < 1e-5
    assert back.share == pytest.approx(1.0, rel=1e-3)
    stays = in_frame_of_file(moved, what.file, poses, exits_std_m=1e-6)
    assert stays.found.geometry.cable == pytest.approx(moved.geometry.cable, abs=1e-6)


def test_a_camera_keeps_the_frame_of_a_right_file_and_detects_a_wrong_one() -> None:
    right = camera_robot(25, 3, RIGHT, hand_eye_known=False, knowledge=TAPE)
    kept = calibrate(right.robot, right.geometry, right.seen, "camera", right.images)
    assert not kept.differs_from_file, kept.verdict()
    assert np.linalg.norm(kept.shift_m) < 0.5e-3
    assert kept.absolute.position_mm > 10.0 > kept.predicted_3_sigma_mm
    wrong = camera_robot(25, 3, WRONG_EXITS, hand_eye_known=False, knowledge=TAPE)
    told = calibrate(wrong.robot, wrong.geometry, wrong.seen, "camera", wrong.images)
    assert told.differs_from_file, told.verdict()


@pytest.mark.parametrize("robot", ["planar-4", "spatial-8"])
def test_points_keep_a_right_file_and_correct_a_wrong_one(robot: str) -> None:
    none = {"exit_m": 0.0, "drum": 0.0, "elongation": 0.0, "offset_m": 0.0}
    for errors, told in (({**none, "elongation": 0.03}, False), ({**none, "drum": 0.006}, True)):
        what = made_up(robot, 45, 6, noise_m=2e-4, home_first=True, **errors)  # type: ignore[arg-type]
        seen = measured(what, 1e-3, 2e-3, 8)
        outcome = calibrate(load_robot(robot), what.file, seen, "points")
        assert outcome.good and outcome.differs_from_file == told, outcome.verdict()
        assert outcome.absolute.position_mm > outcome.predicted_3_sigma_mm


def test_absolute_accuracy_includes_the_common_scale_error_of_points() -> None:
    what = made_up("spatial-8", 45, 6, noise_m=2e-4, home_first=True)
    right = measured(what, 1e-3, 2e-3, 8)
    wrong = replace(right, position_m=1.004 * right.position_m)
    robot = load_robot("spatial-8")
    by_right, by_wrong = (calibrate(robot, what.file, seen, "points") for seen in (right, wrong))
    off_mm = 1e3 * np.abs(by_wrong.shift_m - by_right.shift_m).max()
    assert by_wrong.good and off_mm > by_wrong.predicted_3_sigma_mm
    assert off_mm < by_wrong.absolute.position_mm
    assert "scale, origin, axes" in by_wrong.frame() and "0.9 % (3 sigma)" in by_wrong.frame()


def test_the_verdict_reports_accuracy_of_absolute_positions_and_orientations() -> None:
    what = made_up("spatial-8", 45, 4, noise_m=2e-4, home_first=True)
    outcome = calibrate(load_robot("spatial-8"), what.file, measured(what, 1e-3, 2e-3, 8), "points")
    text = "\n".join(outcome.verdict())
    assert "absolute positions change by" in text
    assert outcome.predicted.orientation_deg is not None
    assert f"orientations by {outcome.predicted.orientation_deg:.3f} deg" in text
    assert outcome.absolute.orientation_deg is not None
    assert f"absolute orientations by {outcome.absolute.orientation_deg:.2f} deg" in text
    poor = replace(outcome, predicted=replace(outcome.predicted, orientation_deg=0.2))
    assert not poor.accuracy().endswith("good") and "0.15 deg wanted" in poor.accuracy()
