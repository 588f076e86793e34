"""The comparison of a calibration with the truth, and its report, on a synthetic robot."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from markupsafe import escape

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.outcome import Outcome
from cdpr_tools.calibrate import truth_comparison
from cdpr_tools.calibrate.page import found_figure, write_report
from cdpr_tools.calibrate.rig import OutsidePose, OutsidePoses
from cdpr_tools.calibrate.truth_comparison import TruthComparison, compare_with_truth
from cdpr_tools.composition.robot_physics import TrueGeometry
from tests.cdpr_rt.calibration.camera_robot import CameraRobot, camera_robot

SCANNER_m, SCANNER_rad = 5e-4, 5e-4
ELONGATION = 0.43


@pytest.fixture(scope="module")
def robot() -> CameraRobot:
    return camera_robot(25)


@pytest.fixture(scope="module")
def outcome(robot: CameraRobot) -> Outcome:
    return calibrate(robot.robot, robot.geometry, robot.seen, "camera", robot.images)


@pytest.fixture
def known(robot: CameraRobot, outcome: Outcome, monkeypatch: pytest.MonkeyPatch) -> TruthComparison:
    """Return the comparison of the outcome with the synthetic truth."""
    made, rng = robot.made, np.random.default_rng(1)
    sheets = [
        SimpleNamespace(name=str(marker), place=lambda _, k=k: made.markers_m[k], rotation=turn)
        for k, (marker, turn) in enumerate(
            zip(robot.images.setup.sheets.placed or range(12), made.marker_rotation, strict=True)
        )
    ]
    monkeypatch.setattr("cdpr_sim_bus.camera.scene.build_scene", lambda _: sheets)
    true = TrueGeometry(made.exits_m, made.drums, ELONGATION)
    monkeypatch.setattr(truth_comparison, "true_geometry", lambda *_: true)

    def as_tuples(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(row) for row in matrix.tolist())

    poses = []
    for pose in made.poses[: len(robot.made.data.poses)]:
        turn = cv2.Rodrigues(rng.normal(0.0, SCANNER_rad, 3))[0]
        poses.append(
            OutsidePose(
                true_position_m=tuple(pose[0].tolist()),
                true_rotation=as_tuples(pose[1:]),
                position_m=tuple((pose[0] + rng.normal(0.0, SCANNER_m, 3)).tolist()),
                position_std_m=SCANNER_m,
                rotation=as_tuples(turn @ pose[1:]),
                rotation_std_rad=SCANNER_rad,
            )
        )
    return compare_with_truth(robot.robot, None, outcome, OutsidePoses(poses=tuple(poses)))


def test_errors_are_those_of_held_out_poses(known: TruthComparison, outcome: Outcome) -> None:
    proof, truth = known.verification(), known.true_errors()
    assert known.index.tolist() == outcome.unused.index.tolist() == [4, 9, 14, 19, 24]
    assert truth["mean_position_error_mm"] < 0.5 * proof["mean_position_error_before_mm"]
    assert truth["mean_orientation_error_deg"] < 0.2
    # the errors of the scanner at this pose and at the first one add to it
    assert 1.0 < proof["of_which_scanner_mm"] < 1.6
    assert abs(proof["mean_position_error_mm"] - truth["mean_position_error_mm"]) < 2.0
    assert abs(proof["scale_factor"] - 1.0) < 4.0 * proof["scale_factor_std"] < 0.02
    assert all("distances between them are" in line for line in known.lines() if "mean" in line)
    frame = proof["in_marker_frame"]
    # corners 0.3 mm off the plane of a 150 mm sheet tilt its frame by 0.3 / 75: 6 mm at a
    # distance of 1.5 m, one standard deviation
    assert frame["mean_position_error_mm"] < 3.0 * 6.0 and frame["marker"] in range(12)
    drums = [row for row in truth["parameters"] if row["name"].endswith("drum")]
    assert len(drums) == 8
    sigmas = [row["error"] / row["std"] for row in truth["parameters"]]
    assert np.sqrt(np.mean(np.square(sigmas))) < 2.0


def test_the_report_is_one_file_including_pictures(
    known: TruthComparison, outcome: Outcome, robot: CameraRobot, tmp_path: Path
) -> None:
    shown = [len(one.image.markers) if one.image else 0 for one in robot.made.data.poses]
    images = tmp_path / "images"
    images.mkdir()
    blank = np.full((1024, 1280), 200, np.uint8)
    cv2.imwrite(str(images / f"pose-{int(np.argmax(shown)) + 1:04d}.png"), blank)
    page = tmp_path / "calibration.html"
    write_report(page, outcome, robot.made.data, known, ["put it back <there>"], images)
    text = page.read_text()
    assert text.count("<figure>") == 5 and text.count("data:image/jpeg") == 1
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert "put it back &lt;there&gt;" in text
    for line in (*outcome.proof(), *(fault.text for fault in outcome.faults)):
        assert text.count(escape(line)) == 1, line
    assert known.scanner.scale.text in text and outcome.verified.scale.text in text
    assert outcome.cover is not None and "12 markers seen." in text
    assert "true error" in text and "cable 8 exit point z" in text
    write_report(page, outcome, robot.made.data, None, [], tmp_path / "nowhere")
    assert page.read_text().count("<figure>") == 3


def test_the_picture_labels_axes_and_distinguishes_their_residuals(outcome: Outcome) -> None:
    names = [axis.name for axis in outcome.robot.axes]
    above, below = found_figure(outcome).axes
    assert [text.get_text().split("\n")[1] for text in above.get_xticklabels()] == names
    dots = [line for line in below.get_lines() if line.get_label() in names]
    assert [line.get_label() for line in dots] == names
    assert len({str(line.get_color()) for line in dots}) == 8
