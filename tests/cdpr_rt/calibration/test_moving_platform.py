"""Calibration from readings of a platform in motion: noise, time offset, blocks and faults."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles.errors import ProfileError
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import load_points, with_points
from cdpr_rt.calibration.verification import held_out
from cdpr_rt.errors import InvalidRequestError
from tests.cdpr_rt.calibration.moving_robot import (
    MovingErrors,
    MovingRobot,
    moving_robot,
    uncrossed,
)


def calibrated(
    what: MovingRobot, folder: Path, sigma_mm: str = "", turned: bool = True, timed: bool = True
) -> Outcome:
    geometry = CableGeometry.of(what.robot)
    points = load_points(what.write_points(folder / "points.csv", sigma_mm, turned))
    seen = what.data(timed).observations(what.robot, geometry.model)
    return calibrate(what.robot, geometry, with_points(seen, points, 2), "points")


def off_by(outcome: Outcome, what: MovingRobot) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors of exit points and drums, and their predicted covariance."""
    geometry = outcome.found.geometry
    rows = len(geometry.rows)
    chosen = [i * rows + j for i in range(geometry.n) for j in (0, 1, geometry.rows.index(4))]
    assert what.robot.platform is not None
    exits = what.exits_m - np.array(what.robot.platform.exit_points_m)
    true = np.column_stack([exits, what.drums]).ravel()
    off = geometry.values()[chosen] - true
    return off, outcome.found.uncertainty[np.ix_(chosen, chosen)]


@pytest.mark.parametrize("sigma_mm", ["", "0.3"])
def test_noise_and_time_offset_are_estimated_without_inventing_faults(
    tmp_path: Path, sigma_mm: str
) -> None:
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 3, MovingErrors(offset_s=0.02))
    outcome = calibrated(what, tmp_path, sigma_mm)
    noise = outcome.noise
    assert noise is not None and not outcome.faults
    assert noise.geometry.knowledge.length_m == pytest.approx(0.0015, rel=0.3)
    assert noise.offset_s == pytest.approx(0.02, abs=max(0.001, 3.0 * noise.offset_std_s))
    assert noise.offset_std_s < 0.001
    assert noise.geometry.knowledge.alike > 1.5
    assert outcome.good and outcome.differs_from_file
    file_mm = outcome.before.mean_mm
    for share, objections in ((2.9, 0), (3.1, 1)):  # 3 sigma is no worse than with the file
        predicted = replace(outcome.predicted, position_mm=share * file_mm)
        against = replace(outcome, predicted=predicted).objections()
        assert len(against) == objections, against
        assert all(f"allowed: {3.0 * file_mm:.1f} mm" in text for text in against)
    said = "\n".join(outcome.verdict())
    assert "time offset: measured points are +" in said
    assert "noise of the lengths, estimated from the data: 1." in said


def test_errors_of_parameters_and_held_out_blocks_are_as_predicted(tmp_path: Path) -> None:
    robot = uncrossed(tmp_path / "wall.toml")
    squares, ratios = [], []
    for seed in range(10, 14):
        what = moving_robot(robot, seed)
        outcome = calibrated(what, tmp_path)
        off, covariance = off_by(outcome, what)
        squares.append(float(off @ np.linalg.solve(covariance, off)) / off.size)
        ratios.append(outcome.honesty.ratio)
        assert outcome.verified.mean_mm < 0.4 * outcome.before.mean_mm
    assert 0.2 < np.mean(squares) < 2.0  # chi squared of 48 unknowns
    assert 0.67 < np.exp(np.mean(np.log(ratios))) < 1.43


@pytest.mark.parametrize("turned", [True, False])
def test_a_slip_is_found_in_noise_that_is_alike_in_successive_readings(
    tmp_path: Path, turned: bool
) -> None:
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 5).with_slip(1, 500, 0.012)
    outcome = calibrated(what, tmp_path, turned=turned)
    (slip,) = [fault for fault in outcome.faults if fault.kind == "jump"]
    assert slip.cable == 1 and abs(slip.size - 0.012) < 0.004
    assert abs(outcome.found.seen.number(slip.pose) - 500) < 40
    assert outcome.honesty.ratio < 1.5


def test_outliers_of_motion_capture_do_not_move_the_result(tmp_path: Path) -> None:
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 6)
    clean = calibrated(what, tmp_path).found
    rng = np.random.default_rng(1)
    wrong = rng.choice(len(what.pose), 40, replace=False)
    what.pose[wrong, :2] += rng.normal(0.0, 0.2, (40, 2))
    what.pose[wrong[:20], 2] += np.pi
    outcome = calibrated(what, tmp_path)
    assert outcome.noise is not None and outcome.noise.glitches == 40
    moved = outcome.found.geometry.values() - clean.geometry.values()
    assert (np.abs(moved) < 0.5 * clean.std).all()
    assert not [fault for fault in outcome.faults if fault.kind == "jump"]


def test_blocks_of_time_verify_a_moving_platform(tmp_path: Path) -> None:
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 7)
    seen = what.data().observations(what.robot, CableGeometry.of(what.robot).model)
    held = held_out(seen)
    assert held.mean() == pytest.approx(0.2, abs=0.02)
    assert int((np.diff(held.astype(int)) == 1).sum()) == 5
    assert not held[0]


@pytest.mark.long
def test_larger_noise_at_rest_is_not_mistaken_for_faults(tmp_path: Path) -> None:
    errors = MovingErrors(length_m=0.003, alike_s=0.0, point_m=0.001)
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 8, errors, duration_s=5.0)
    outcome = calibrated(what, tmp_path, "1", timed=False)
    assert not [fault for fault in outcome.faults if fault.kind in ("jump", "outlier")]
    assert outcome.noise is not None
    assert outcome.noise.geometry.knowledge.length_m == pytest.approx(0.003, rel=0.25)
    assert outcome.honesty.ratio == pytest.approx(1.0, abs=0.35)


def test_only_readings_sorted_by_time_are_accepted(tmp_path: Path) -> None:
    what = moving_robot(uncrossed(tmp_path / "wall.toml"), 7, duration_s=1.0)
    data, model = what.data(), CableGeometry.of(what.robot).model
    poses = (*data.poses[:3], data.poses[2].model_copy(update={"time_s": None}))
    for wrong in (data.poses[:3] + data.poses[:1], poses):
        with pytest.raises(InvalidRequestError, match="pose 4: time_s is missing or not later"):
            data.model_copy(update={"poses": wrong}).observations(what.robot, model)


def test_angles_of_a_point_are_given_together(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_text("pose,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n1,1,2,3,,,\n2,1,2,3,0,,90\n")
    with pytest.raises(ProfileError, match="line 3: ry_deg: is empty"):
        load_points(file)
    file.write_text("pose,x_mm,y_mm,rz_deg,sigma_deg\n1,1,2,,\n2,1,2,90,0.1\n")
    first, second = load_points(file)
    assert first.turn_rad is None and second.turn_rad is not None
    assert second.turn_rad[2] == pytest.approx(np.pi / 2)
    assert np.degrees(second.turn_std_rad) == pytest.approx(0.1)
