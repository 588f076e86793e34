"""The verdict of a calibration on data, undetermined parameters and itself."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.camera_geometry import exponentials
from cdpr_rt.calibration.faults import fit_without_faults, without_slack
from cdpr_rt.calibration.fit import fit
from cdpr_rt.calibration.outcome import CalibrationFiles, calibration_of
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.verification import (
    Scale,
    open_directions,
    predicted_std,
    require_enough,
    verify,
    with_more_poses,
)
from cdpr_rt.errors import InvalidRequestError
from tests.cdpr_rt.calibration.made_up import made_up, measured

_NO_SLACK = np.zeros(8)


@pytest.mark.parametrize("robot", ["planar-4", "point-4", "spatial-8"])
def test_good_data_have_no_faults(robot: str) -> None:
    what = made_up(robot, 50, 9, noise_m=3e-4)
    slack = np.zeros(what.file.n)
    for seen in (measured(what, 1e-3, 2e-3, 4), what.seen):
        assert fit_without_faults(what.file, seen, slack)[1] == []


@pytest.mark.parametrize(("robot", "blind"), [("planar-4", False), ("spatial-8", True)])
def test_a_slipped_encoder_and_a_caught_cable_are_reported(robot: str, blind: bool) -> None:
    what = made_up(robot, 50, 9, noise_m=2e-4)
    seen = what.seen if blind else measured(what, 1e-3, 2e-3, 4)
    lengths = seen.length_m.copy()
    lengths[25:, 1] += 0.008
    lengths[12, 0] += 0.025
    found, faults = fit_without_faults(
        what.file, replace(seen, length_m=lengths), np.zeros(what.file.n)
    )
    named = {(fault.kind, fault.pose): {fault.cable, *fault.alike} for fault in faults}
    assert set(named) == {("jump", 25), ("outlier", 12)}
    assert 1 in named["jump", 25]
    assert 0 in named["outlier", 12]
    assert abs(found.jumps_m) == pytest.approx([0.008], abs=2e-3)
    assert any("slipped" in fault.text and "pose 26" in fault.text for fault in faults)


def test_a_slack_cable_is_omitted_by_its_tension() -> None:
    what = made_up("spatial-8", 40, 3, noise_m=2e-4)
    tension, lengths = what.seen.tension_N.copy(), what.seen.length_m.copy()
    tension[7, 3], lengths[7, 3] = 0.4, lengths[7, 3] + 0.05
    seen = replace(what.seen, tension_N=tension, length_m=lengths)
    found, faults = fit_without_faults(what.file, seen, np.full(8, 1.0))
    assert [(f.kind, f.cable, f.pose) for f in faults] == [("slack", 3, 7)]
    assert "0.4 N" in faults[0].text
    assert not found.seen.used[7, 3]


def test_a_wrong_drum_is_reported_with_its_error() -> None:
    what = made_up("spatial-8", 50, 5, noise_m=2e-4)
    cable = what.true.cable.copy()
    wrong = 0.05
    lengths = what.seen.length_m.copy()
    lengths[:, 4] = what.seen.reference_m[4] + (lengths[:, 4] - what.seen.reference_m[4]) / 1.05
    seen = replace(measured(what, 1e-3, 2e-3, 4), length_m=lengths)
    found, faults = fit_without_faults(what.file, seen, _NO_SLACK)
    drums = [fault for fault in faults if fault.kind == "drum"]
    assert [fault.cable for fault in drums] == [4]
    assert drums[0].size == pytest.approx(wrong + cable[4, 4], abs=4e-3)
    assert "drum_radius_m" in drums[0].text
    assert found.converged


def test_frame_and_scale_are_reported_as_undetermined_without_points() -> None:
    what = made_up("spatial-8", 60, 7, noise_m=2e-4)
    blind = [one.what for one in open_directions(fit(what.file, what.seen))]
    for axis in "xyz":
        assert any(f"together along {axis}" in text for text in blind)
        assert any(f"rotation of all exit points together about {axis}" in text for text in blind)
    assert any("scale" in text for text in blind)
    seen = measured(what, 1e-3, 2e-3, 4)
    told = [one.what for one in open_directions(fit(what.file, seen))]
    assert not any("together" in text or "scale" in text for text in told)


def test_unobservable_parameters_are_reported_with_their_cable() -> None:
    what = made_up("spatial-8", 40, 7, noise_m=2e-4)
    seen = measured(what, 1e-3, 2e-3, 4)
    used = seen.used.copy()
    used[:, 5] = False
    found = fit(what.file, replace(seen, used=used))
    opened = [one for one in open_directions(found) if "cable 6" in one.what]
    assert len(opened) >= 4
    assert all("cable 6" in one.advice for one in opened)
    called = replace(what.file, cable_names=("",) * 5 + ("lower left", "", ""))
    named = open_directions(fit(called, replace(seen, used=used)))
    assert [one.what for one in named] == [
        one.what.replace("cable 6", "lower left") for one in open_directions(found)
    ]
    assert sum("(lower left)" in one.advice for one in named) == len(opened)


def test_too_few_poses_are_rejected_with_the_missing_number() -> None:
    what = made_up("spatial-8", 60, 7)
    with pytest.raises(InvalidRequestError, match=r"at least \d+ more poses"):
        require_enough(what.file, what.seen.some(np.arange(8)))
    require_enough(what.file, what.seen)
    robot = load_robot("spatial-8")
    with pytest.raises(InvalidRequestError, match="15 or more"):
        calibrate(robot, what.file, what.seen.some(np.arange(9)), "redundancy")


def test_a_robot_without_redundancy_needs_points() -> None:
    what = made_up("point-4", 20, 7)
    used = what.seen.used.copy()
    used[:, 0] = False
    with pytest.raises(InvalidRequestError, match="--points"):
        require_enough(what.file, replace(what.seen, used=used))


@pytest.mark.parametrize("robot", ["planar-4", "spatial-8"])
def test_predicted_deviations_of_poses_agree_with_trials(robot: str) -> None:
    squares = predicted = 0.0
    for seed in range(6):
        what = made_up(robot, 30, 100 + seed, noise_m=3e-4)
        found = fit(what.file, measured(what, 1e-3, 2e-3, seed))
        true = np.array([pose.array for pose in what.poses])
        exact = made_up(robot, 30, 100 + seed)
        k = what.file.coordinates
        there = verify(found.geometry, np.zeros(0), measured(exact, 1e-9, None, 1))
        squares += float((there.errors_m**2).mean())
        predicted += float((predicted_std(found, true)[:, :k] ** 2).mean())
    assert 0.15 < squares / predicted < 4.0


def test_a_calibration_is_verified_on_held_out_poses_and_written() -> None:
    robot = load_robot("spatial-8")
    what = made_up("spatial-8", 50, 4, noise_m=2e-4, home_first=True)
    outcome = calibrate(robot, what.file, measured(what, 1e-3, 2e-3, 8), "points")
    assert outcome.good, outcome.objections()
    assert outcome.verified.poses == 10
    assert outcome.verified.mean_mm < 0.5 * outcome.before.mean_mm
    found = calibration_of(outcome, 3, CalibrationFiles("data.json"), simulated=True)
    assert found.faults(robot) == []
    soft = replace(outcome.found.geometry, elongation=-2.45)
    wrong = replace(outcome, found=replace(outcome.found, geometry=soft))
    assert not wrong.good and "elongation_scale" in wrong.objections()[-1]
    told = found.applied(robot)
    assert told.platform is not None
    scale = told.axes[2].winch.drum_radius_m / robot.axes[2].winch.drum_radius_m
    assert scale == pytest.approx(found.drum_scales[2])
    words = "\n".join(outcome.verdict())
    assert "verified on" in words
    assert "3 sigma" in words


@pytest.mark.parametrize("robot", ["planar-3", "spatial-8"])
def test_changes_that_noise_explains_are_not_significant(robot: str) -> None:
    chances = []
    for seed in range(4):
        right = made_up(
            *(robot, 45, seed), exit_m=0.0, drum=0.0, elongation=0.0, offset_m=0.0, noise_m=3e-4,
            home_first=True,
        )  # fmt: skip
        outcome = calibrate(load_robot(robot), right.file, measured(right, 1e-3, 2e-3, 8), "points")
        assert outcome.good, outcome.objections()
        chances.append(outcome.change.chance)
        if not outcome.differs_from_file:
            assert "may already be right" in "\n".join(outcome.verdict())
    assert min(chances) > 0.001 and np.mean(chances) > 0.1  # 0.5 on average
    wrong = made_up(robot, 45, 1, exit_m=0.003, drum=0.001, offset_m=0.0, noise_m=3e-4)
    outcome = calibrate(load_robot(robot), wrong.file, measured(wrong, 1e-3, 2e-3, 8), "points")
    assert outcome.differs_from_file and outcome.insignificance() is None


def test_a_calibration_that_predicts_held_out_poses_worse_is_not_adopted_on_request() -> None:
    right = made_up(
        *("planar-3", 45, 1), exit_m=0.0, drum=0.0, elongation=0.0, offset_m=0.0, noise_m=3e-4,
        home_first=True,
    )  # fmt: skip
    outcome = calibrate(
        load_robot("planar-3"), right.file, measured(right, 1e-3, 2e-3, 8), "points"
    )
    asked = replace(outcome, adopt=True)
    assert not outcome.differs_from_file and outcome.good
    before = outcome.before.errors_m
    other_way = 1.05 * before[::-1]  # the mean is larger, but errors are not larger at most poses
    gross = before.copy()
    gross[2] *= 40.0  # an outlier, so that the mean is uncertain
    for errors_m, worse in (
        *((1.1 * before, True), (0.9 * before, False), (other_way, False), (gross, True)),
    ):
        told = replace(asked, verified=replace(asked.verified, errors_m=errors_m))
        assert told.worse == worse and told.good != worse
        said = "NOT GOOD: at the poses kept for verification the errors are significantly larger"
        assert any(said in line for line in told.verdict()) == worse
        assert replace(told, adopt=False).good  # not significant, and reported as such
    for errors_m, worse in ((before[:1], False), (3.0 * before[:1], True)):
        one = replace(asked.before, errors_m=before[:1])
        assert replace(one, errors_m=errors_m).worse_than(one) == worse


def test_noise_seldom_makes_a_calibration_worse_and_a_wrong_file_is_detected() -> None:
    robot, told, swapped = load_robot("planar-4"), 0, 0
    for exit_m in (0.0, 0.004):
        for seed in range(6):
            what = made_up(
                *(robot.profile, 45, seed), exit_m=exit_m, drum=0.0, elongation=0.0, offset_m=0.0,
                noise_m=3e-4, home_first=True,
            )  # fmt: skip
            outcome = calibrate(robot, what.file, what.seen, "redundancy")
            if exit_m == 0.0:
                told += outcome.worse
            else:  # the file in place of the calibration
                assert not outcome.worse
                swapped += outcome.before.worse_than(outcome.verified)
    assert told <= 1 and swapped >= 5


def test_a_slip_beside_a_held_out_pose_excludes_its_cable_there() -> None:
    what = made_up("planar-4", 45, 9, noise_m=2e-4)
    seen = measured(what, 1e-3, 2e-3, 4)
    lengths = seen.length_m.copy()
    lengths[24:, 1] += (
        0.012  # pose 25 is held out: 24 and 26 do not show whether the slip preceded it
    )
    outcome = calibrate(
        load_robot("planar-4"), what.file, replace(seen, length_m=lengths), "points"
    )
    unused = outcome.unused
    assert outcome.verified_left_out == 1 and 24 in unused.index
    assert not unused.seen.used[unused.index == 24, 1].any()
    assert outcome.verified.worst_mm < 5.0
    assert outcome.verified.residual_m < 1e-3


def test_contradictory_measurements_are_not_good() -> None:
    robot = load_robot("planar-4")
    what = made_up("planar-4", 16, 4, noise_m=2e-4)
    rng = np.random.default_rng(1)
    lengths = what.seen.length_m + rng.normal(0.0, 0.02, what.seen.length_m.shape)
    outcome = calibrate(
        robot, what.file, replace(measured(what, 1e-3, 2e-3, 8), length_m=lengths), "points"
    )
    assert not outcome.good
    assert "NOT GOOD" in "\n".join(outcome.verdict())


SPATIAL = (SHIPPED / "robots" / "spatial-8.toml").read_text()


def named(folder: Path) -> Path:
    path = folder / "named.toml"
    path.write_text(SPATIAL.replace("[[axes]]", '[[axes]]\nname = "c1"', 1))
    return path


def test_a_cable_has_the_name_of_its_axis_or_its_number(tmp_path: Path) -> None:
    geometry = CableGeometry.of(load_robot(str(named(tmp_path))))
    assert geometry.names()[0] == "c1 exit point x"
    assert geometry.names()[len(geometry.rows)] == "cable 2 exit point x"
    assert geometry.cables_text(1, (0, 2)) == "cable 2 (or c1, cable 3)"


def test_a_slack_cable_is_reported_by_name(tmp_path: Path) -> None:
    what = made_up(str(named(tmp_path)), 20, 3, noise_m=2e-4)
    seen = measured(what, 1e-3, 2e-3, 4)
    seen.tension_N[4, 0] = 0.5
    slack_N = np.full(what.file.n, 1.0)
    assert without_slack(what.file, seen, slack_N)[1][0].text.startswith("c1 was slack at pose 5")


def test_predicted_covariance_with_more_poses_equals_that_of_doubled_poses() -> None:
    what = made_up("spatial-8", 30, 3)
    seen = measured(what, 1e-3, 1e-3, 3)
    found, twice = fit(what.file, seen), fit(what.file, seen.some(np.tile(np.arange(30), 2)))
    told = np.sqrt(np.diag(with_more_poses(found, 30).covariance))
    by_noise = np.sqrt(np.diag(twice.covariance))
    truly = by_noise * np.sqrt(found.variance_factor / max(twice.variance_factor, 1.0))
    if found.variance_factor < 1.0:
        truly = by_noise / np.sqrt(max(twice.variance_factor, 1.0))
    np.testing.assert_allclose(told, truly, rtol=0.02)
    assert (told < found.std).all()


def test_unobservable_parameters_keep_their_prior() -> None:
    what = made_up("spatial-8", 30, 3)
    found = fit(what.file, what.seen)
    before = what.file.known_std() ** 2
    held = replace(found, covariance=np.diag(before), variance_factor=1.0)
    assert np.diag(with_more_poses(held, 1000).covariance) == pytest.approx(before)


TRUE, NOISE_m = 1.002, 5e-4


def test_scale_factor_and_its_deviation_agree_with_trials() -> None:
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


def test_scale_is_nan_for_two_poses_or_identical_positions() -> None:
    for told in (np.eye(3)[:2], np.ones((5, 3))):
        scale = Scale.of(told, 1.01 * told)
        assert math.isnan(scale.factor) and math.isnan(scale.std)
