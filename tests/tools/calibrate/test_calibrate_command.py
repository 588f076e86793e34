"""`cdpr calibrate` fits data offline, adopts and undoes results, and rejects invalid input."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import calibrated
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import CalibrationData, PoseReading, load_data
from cdpr_rt.calibration.verification import Verification
from cdpr_rt.model.calibration_state import mark_not_calibrated, not_calibrated_reason
from cdpr_tools.calibrate.check import before
from cdpr_tools.calibrate.finish import stop_criterion
from cdpr_tools.calibrate.run import source_of
from cdpr_tools.calibrate.study import PAIRS
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output
from tests.cdpr_rt.calibration.camera_robot import camera_robot
from tests.cdpr_rt.calibration.made_up import MadeUp, made_up
from tests.cdpr_rt.calibration.moving_robot import MovingErrors, moving_robot, uncrossed
from tests.cdpr_rt.calibration.synthetic_readings import HAND_EYE_m

pytestmark = pytest.mark.long


@pytest.fixture(autouse=True)
def _own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "100")


def data_of(what: MadeUp, path: Path, spoil: Any = None) -> Path:
    """Write the data that a run would read of a synthetic robot. Return the file."""
    robot = load_robot("spatial-8")
    lengths = what.seen.length_m.copy()
    if spoil is not None:
        spoil(lengths)
    turns = what.file.model.home_pose.Q.T
    readings = []
    for j in range(what.seen.poses):
        del_rotation = what.seen.start[j, 1:] @ turns
        vector = np.array([del_rotation[2, 1], del_rotation[0, 2], del_rotation[1, 0]])
        target = (*what.seen.start[j, 0].tolist(), *vector.tolist())
        readings.append(
            PoseReading(
                target=target,
                length_m=tuple(lengths[j].tolist()),
                tension_N=tuple(what.seen.tension_N[j].tolist()),
            )
        )
    data = CalibrationData(
        robot="spatial-8",
        geometry_sha256=geometry_sha256(robot),
        simulated=False,
        date=datetime.now(UTC).isoformat(),
        poses=tuple(readings),
    )
    data.save(path)
    return path


def points_of(what: MadeUp, path: Path, every: int = 1) -> Path:
    """Write the positions to 1 mm, as a person measures them."""
    rng = np.random.default_rng(5)
    rows = ["pose,x_mm,y_mm,z_mm,sigma_mm"]
    for j in range(0, len(what.poses), every):
        x, y, z = 1e3 * what.poses[j].p + rng.normal(0.0, 1.0, 3)
        rows.append(f"{j + 1},{x:.1f},{y:.1f},{z:.1f},1")
    path.write_text("\n".join(rows) + "\n")
    return path


def result(done: Any) -> dict[str, Any]:
    told = json.loads(done.stdout.splitlines()[-1])
    assert isinstance(told, dict)
    return told


def test_a_calibration_by_points_is_adopted_shown_and_undone(tmp_path: Path) -> None:
    what = made_up("spatial-8", 45, 12, noise_m=2e-4, home_first=True)
    data, points = data_of(what, tmp_path / "data.json"), points_of(what, tmp_path / "p.csv")
    mark_not_calibrated("spatial-8", "rail 1 was moved")
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", data, "--points", points, "--json")
    assert done.returncode == 0, done.stderr
    assert not_calibrated_reason("spatial-8") == ""
    told = result(done)
    assert told["good"] and told["frame"].startswith("the room")
    proof = told["verification"]
    assert proof["reference"] == "points"
    assert proof["mean_position_error_mm"] < 0.6 * proof["mean_position_error_before_mm"]
    assert abs(proof["scale_factor"] - 1.0) < 4.0 * proof["scale_factor_std"] < 0.01
    assert "distances between them are " in done.stderr
    assert f"calibrate fit spatial-8 --data {tmp_path} --points {points}" in done.stderr
    assert "cdpr calibrate check spatial-8 --running" in done.stderr
    assert len(told["parameters"]) == 8 * 5 + 1
    assert matplotlib.image.imread(told["picture"]).std() > 0.01
    robot = load_robot("spatial-8")
    assert calibrated(robot).calibration is not None
    shown = cdpr_here("robot", "show", "spatial-8", "--json")
    assert result(shown)["calibration"]["identity"] == told["in_force"]["identity"]
    assert "of 20" in shown.stderr and "cdpr calibrate undo spatial-8" in shown.stderr
    undone = cdpr_here("calibrate", "undo", "spatial-8", "--json")
    assert undone.returncode == 0 and result(undone)["in_force"] is None
    assert "1 was undone; before it: " in not_calibrated_reason("spatial-8")
    assert calibrated(robot) is robot
    again = cdpr_here("calibrate", "undo", "spatial-8")
    assert again.returncode == 2 and "no calibration is in force" in again.stderr


def hardly_off(tmp_path: Path, seed: int, exit_m: float) -> list[Any]:
    """Return the command that fits data of a robot whose file is nearly right."""
    what = made_up(
        *("spatial-8", 45, seed), exit_m=exit_m, drum=0.0, elongation=0.0, offset_m=0.0,
        noise_m=3e-4, home_first=True,
    )  # fmt: skip
    words = ["calibrate", "fit", "spatial-8", "--data", data_of(what, tmp_path / "data.json")]
    return [*words, "--json", "--points", points_of(what, tmp_path / "p.csv")]


def test_an_insignificant_calibration_is_adopted_only_on_request(tmp_path: Path) -> None:
    words = hardly_off(tmp_path, 21, 2.5e-4)
    done = cdpr_here(*words)
    assert done.returncode == 0, done.stderr
    told = result(done)
    assert told["good"] and not told["change"]["significant"]
    assert told["in_force"] is None and "not significant" in told["not_taken_over"]
    assert "± 3 sigma" in done.stderr and "not significant: noise alone" in done.stderr
    assert "the calibration was not adopted" in done.stderr and "--adopt" in done.stderr
    report = Path(told["report"]).read_text()
    assert "not significant" in report
    for text in (done.stderr, report):  # all figures have the same convention
        assert "3 sigma" in text and not re.search(r"\b[124] sigma", text)
    assert calibrated(load_robot("spatial-8")).calibration is None
    asked = cdpr_here(*words, "--adopt")
    assert asked.returncode == 0, asked.stderr
    assert result(asked)["in_force"]["version"] == 1 and result(asked)["not_taken_over"] is None


def test_a_calibration_that_predicts_held_out_poses_worse_is_never_adopted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Verification, "worse_than", lambda *_: True)
    words = hardly_off(tmp_path, 2, 0.0)
    done = cdpr_here(*words)
    assert done.returncode == 0 and not result(done)["change"]["significant"]
    assert "predicts unused poses worse" in result(done)["not_taken_over"]
    asked = cdpr_here(*words, "--adopt")
    assert asked.returncode == 1, asked.stderr
    assert (
        "NOT GOOD: at the poses kept for verification the errors are significantly" in asked.stderr
    )
    assert result(asked)["in_force"] is None and result(asked)["not_taken_over"]
    assert calibrated(load_robot("spatial-8")).calibration is None


def test_a_calibration_that_is_worse_only_by_noise_is_adopted_on_request(tmp_path: Path) -> None:
    asked = cdpr_here(*hardly_off(tmp_path, 2, 0.0), "--adopt")
    assert asked.returncode == 0, asked.stderr
    proof = result(asked)["verification"]
    assert proof["mean_position_error_mm"] > proof["mean_position_error_before_mm"]
    assert result(asked)["in_force"]["version"] == 1


def test_the_folder_of_a_run_is_fitted_without_points_in_the_frame_of_the_file(
    tmp_path: Path,
) -> None:
    what = made_up("spatial-8", 45, 12, noise_m=2e-4, home_first=True)
    data_of(what, tmp_path / "data.json")
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", tmp_path, "--json")
    assert done.returncode == 1, done.stderr
    assert f"fit it again: cdpr calibrate fit spatial-8 --data {tmp_path}" in done.stderr
    assert "NOT GOOD" in done.stderr and "--known-mm" in done.stderr
    told = result(done)
    assert told["poses"] == 45 and told["data"] == str(tmp_path / "data.json")
    assert "truth" not in told
    assert told["frame"].startswith("the robot's file")
    assert np.linalg.norm(told["absolute_shift_mm"]) < told["absolute_3_sigma_mm"] < 40.0
    assert told["in_force"] is None and calibrated(load_robot("spatial-8")).calibration is None
    assert "measure the platform at three poses" in done.stderr
    assert "measure one distance" in done.stderr
    residuals = told["verification"]
    assert residuals["reference"] == "none" and residuals["scale_factor"] is None
    assert residuals["length_residual_mm"] < residuals["length_residual_before_mm"]
    nothing = cdpr_here("calibrate", "fit", "spatial-8", "--data", tmp_path / "nothing")
    assert nothing.returncode == 2 and "nothing" in nothing.stderr


def test_a_slipped_encoder_is_reported_and_tolerated(tmp_path: Path) -> None:
    def slip(lengths: Any) -> None:
        lengths[20:, 6] += 0.015

    what = made_up("spatial-8", 45, 12, noise_m=2e-4, home_first=True)
    data = data_of(what, tmp_path / "data.json", slip)
    points = points_of(what, tmp_path / "p.csv")
    done = cdpr_here(
        "calibrate", "fit", "spatial-8", "--data", data, "--points", points, "--dry-run", "--json"
    )
    assert done.returncode == 0, done.stderr
    faults = result(done)["faults"]
    assert [(f["kind"], f["cable"], f["pose"]) for f in faults] == [("jump", 7, 21)]
    assert "cable 7 is -15" in done.stderr


def test_readings_in_motion_are_fitted_with_what_the_user_states(tmp_path: Path) -> None:
    robot = uncrossed(tmp_path / "wall.toml")
    what = moving_robot(robot, 3, MovingErrors(offset_s=0.02), duration_s=8.0)
    data, points = tmp_path / "data.json", tmp_path / "points.csv"
    what.data().save(data)
    fit = ("calibrate", "fit", robot.path, "--data", data, "--points", what.write_points(points))
    done = cdpr_here(*fit, "--length-noise-mm", "1.4", "--known-drum-percent", "1", "--json")
    assert done.returncode == 0, done.stderr
    told = result(done)
    assert told["noise"]["length_std_mm"] == pytest.approx(1.4)
    assert told["noise"]["time_offset_ms"] == pytest.approx(20.0, abs=1.5)
    assert told["in_force"]["version"] == 1 and not told["faults"]
    proof = told["verification"]
    assert proof["mean_position_error_mm"] < 0.5 * proof["mean_position_error_before_mm"]
    asked = cdpr_here(*fit, "--wanted-mm", "0.5", "--dry-run")
    assert asked.returncode == 1
    assert "allowed: 0.5 mm): measure more poses" in asked.stdout


def test_points_of_later_poses_do_not_end_a_run(tmp_path: Path) -> None:
    what = made_up("spatial-8", 45, 12, noise_m=2e-4, home_first=True)
    data = load_data(data_of(what, tmp_path / "data.json"))
    points, robot = points_of(what, tmp_path / "p.csv"), load_robot("spatial-8")
    asked = stop_criterion(Output(True), robot, points, CableGeometry.of(robot))
    asked(data.model_copy(update={"poses": data.poses[:30]}))


def test_points_may_be_combined_with_a_camera_only() -> None:
    robot = load_robot("spatial-8")
    assert source_of(robot, camera=True, points=True) == "camera"
    assert source_of(robot, points=True) == "points"
    with pytest.raises(BadInputError, match="or --camera with --points"):
        source_of(robot, camera=True, scanner=True, points=True)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("a,b\n1,2\n", "pose,x_mm,y_mm,z_mm,sigma_mm"),
        ("pose,x_mm,y_mm,z_mm\n1,2,three,4\n", "line 2: y_mm: value 'three'"),
        ("pose,x_mm,y_mm,z_mm\n0,2,3,4\n", "line 2: pose"),
        ("pose,x_mm,y_mm,z_mm,sigma_mm\n1,2,3,4,-1\n", "sigma_mm"),
        ("pose,x_mm,y_mm,z_mm\n1,2,3,4,5\n", "line 2: 5 cells"),
        ("pose,x_mm,y_mm,z_mm\n99,200,300,400\n", "pose 99; allowed: 1 to 45"),
        ("pose,x_mm,y_mm,z_mm\n1,0.2,,1.4\n2,-0.3,0.4,\n", "within 1.4 mm of the room's origin"),
    ],
)
def test_invalid_points_are_rejected(tmp_path: Path, text: str, named: str) -> None:
    what = made_up("spatial-8", 45, 12, home_first=True)
    data, points = data_of(what, tmp_path / "data.json"), tmp_path / "p.csv"
    points.write_text(text)
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", data, "--points", points)
    assert done.returncode == 2
    assert named in done.stderr and "Traceback" not in done.stderr


def test_invalid_data_and_requests_are_rejected(tmp_path: Path) -> None:
    few = data_of(made_up("spatial-8", 9, 12, home_first=True), tmp_path / "few.json")
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", few)
    assert done.returncode == 2 and "15 or more" in done.stderr
    other = cdpr_here("calibrate", "fit", "planar-4", "--data", few)
    assert other.returncode == 2 and "not of 'planar-4'" in other.stderr
    few.write_text("{}")
    assert cdpr_here("calibrate", "fit", "spatial-8", "--data", few).returncode == 2
    assert cdpr_here("calibrate", "fit", "spatial-8", "--data", tmp_path / "no").returncode == 2
    both = cdpr_here("calibrate", "run", "planar-4", "--redundancy", "--scanner")
    assert both.returncode == 2 and "give one of" in both.stderr
    for robot in ("planar-4", "point-4"):
        blind = cdpr_here("calibrate", "run", robot, "--camera")
        assert blind.returncode == 2 and "does not turn its platform" in blind.stderr
    none = cdpr_here("calibrate", "run", "bench-2", "--redundancy")
    assert none.returncode == 2 and "no platform" in none.stderr
    kind = cdpr_here("calibrate", "run", "planar-4", "--redundancy", "--identify", "exit,colour")
    assert kind.returncode == 2 and "colour" in kind.stderr


@pytest.mark.parametrize("name", ["images/holiday.png", "calibration.html", "data.json"])
def test_a_run_does_not_overwrite_files_of_the_user(tmp_path: Path, name: str) -> None:
    kept = tmp_path / name
    kept.parent.mkdir(exist_ok=True)
    kept.write_text("somebody else's")
    ran = ("calibrate", "run", "planar-4", "--redundancy", "--overwrite", "--out", tmp_path)
    done = cdpr_here(*ran)
    assert done.returncode == 2 and str(tmp_path / name.split("/", maxsplit=1)[0]) in done.stderr
    assert kept.read_text() == "somebody else's"
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()] == [
        Path(name)
    ]


def test_the_study_reports_each_parameter_and_the_ratio(tmp_path: Path) -> None:
    picture = tmp_path / "study.png"
    done = cdpr_here("calibrate", "study", "--draws", "4", "--png", picture, "--json")
    assert done.returncode == 0, done.stderr
    rows = result(done)["cases"]
    figures = {row["figure"] for row in rows}
    assert figures == {"3.7", "3.8", *(f"B.{k}" for k in range(1, 7)), *PAIRS}
    # sqrt(3), reduced because directions to an exit point differ
    assert all(1.4 < row["ratio"] < 1.75 for row in rows if "bias" not in row["name"])
    # a length bias appears only in initial lengths, a position bias only in exit points
    assert all(row["off_exit"] is None for row in rows if row["figure"] == "B.1")
    assert all(row["off_offset"] is None for row in rows if row["figure"] == "B.2")
    assert all(abs(row["off"]) < 1e-6 for row in rows if row["figure"] in ("B.1", "B.2"))
    assert "table 3.1" in done.stderr and "figure 3.7" in done.stderr
    for end in ("", "-B", "-C"):
        assert matplotlib.image.imread(tmp_path / f"study{end}.png").std() > 0.01


def test_a_missing_cluster_is_reported() -> None:
    done = cdpr_here("calibrate", "study", "--cluster", "127.0.0.1:1")
    # after the progress line, if generating poses takes long enough
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("cdpr: --cluster 127.0.0.1:1: ")


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"position_m": (1.2,), "position_std_m": 0.001}, r"value \[1.2\]; allowed: 3 n"),
        ({"position_m": (1.0, 2.0, 3.0)}, "both or neither"),
        ({"rotation": ((1.0, 0.0), (0.0, 1.0)), "rotation_std_rad": 0.01}, "3 rows"),
        (
            {"rotation": ((2.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)), "rotation_std_rad": 1},
            "not a rotation matrix",
        ),
    ],
)
def test_an_invalid_reading_is_rejected(given: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        PoseReading(target=(0.0,), length_m=(1.0,), tension_N=(1.0,), **given)


def test_the_first_pose_has_to_be_home(tmp_path: Path) -> None:
    data = data_of(made_up("spatial-8", 20, 12), tmp_path / "data.json")
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", data)
    assert done.returncode == 2 and "allowed: home" in done.stderr


def test_markers_and_cables_are_fitted_together(tmp_path: Path) -> None:
    what = camera_robot(20)
    what.made.data.save(tmp_path / "data.json")
    done = cdpr_here("calibrate", "fit", "spatial-8", "--data", tmp_path / "data.json", "--json")
    told = result(done)
    assert told["camera"]["position_m"] == pytest.approx(HAND_EYE_m, abs=0.01)
    assert len(told["camera"]["markers"]) == 12
    assert told["coverage"]["share_seen"] is None and len(told["coverage"]["islands"]) == 1
    proof = told["verification"]
    assert proof["reference"] == "camera"
    assert proof["by"].startswith("the camera, with a map from the images")
    assert proof["mean_position_error_mm"] < 2.0 < proof["mean_position_error_before_mm"]
    assert proof["mean_orientation_error_deg"] < 0.2
    assert "the camera, with a map from" in done.stderr
    assert "or the places of three markers" in done.stderr


def test_a_hand_eye_file_is_used_if_it_agrees_with_the_readings(tmp_path: Path) -> None:
    made = camera_robot(20, hand_eye_known=False).made.data
    assert made.camera is not None and made.camera.hand_eye is None
    made.save(tmp_path / "data.json")
    told, (x_m, *rest_m) = tmp_path / "hand-eye.toml", HAND_EYE_m
    fit = ("calibrate", "fit", "spatial-8", "--dry-run", "--json", "--data", tmp_path / "data.json")
    without = result(cdpr_here(*fit, "--out", tmp_path / "without"))
    as_without = pytest.approx(without["camera"]["position_m"], abs=1e-5)
    for off_m, believed in ((0.0, True), (0.05, False)):
        place_m = [x_m + off_m, *rest_m]
        told.write_text(f"position_m = {place_m}\nrotation_deg = [180.0, 0.0, 0.0]\n")
        done = result(cdpr_here(*fit, "--hand-eye", told, "--out", tmp_path / str(off_m)))
        for one in (without, done):
            assert one["camera"]["position_m"] == pytest.approx(HAND_EYE_m, abs=0.01)
        named = [fault["text"] for fault in done["faults"] if fault["kind"] == "hand_eye"]
        assert all("hand_eye" in text and "mm" in text for text in named)
        assert len(named) == (not believed)
        assert (done["camera"]["position_m"] != as_without) == believed


def test_a_check_fits_the_map_with_the_options_of_the_calibration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    what = camera_robot(20, hand_eye_known=False)
    what.made.data.save(tmp_path / "data.json")
    told, points = tmp_path / "hand-eye.toml", tmp_path / "p.csv"
    told.write_text(f"position_m = {list(HAND_EYE_m)}\nrotation_deg = [180.0, 0.0, 0.0]\n")
    rows = [
        f"{j + 1},{','.join(f'{x:.2f}' for x in 1e3 * what.made.poses[j, 0])},0.5"
        for j in range(0, 20, 2)
    ]
    points.write_text("\n".join(["pose,x_mm,y_mm,z_mm,sigma_mm", *rows]) + "\n")
    done = cdpr_here(
        *("calibrate", "fit", "spatial-8", "--data", tmp_path / "data.json", "--json"),
        *("--hand-eye", told, "--points", points, "--identify", "exit,offset,drum,elongation"),
        *("--known-mm", "35", "--adopt"),
    )
    assert done.returncode == 0, done.stderr
    robot, out = load_robot("spatial-8"), Output(as_json=False)
    known = calibrated(robot).calibration
    assert known is not None and known.known_exit_m == 0.035
    found = before(out, robot)
    assert found is not None
    exits = found.found.geometry.kernel_geometry()[:3].T
    assert exits == pytest.approx(np.array(known.exit_points_m), abs=1e-6)
    points.write_text(points.read_text().replace(",0.5", ",5"))
    capsys.readouterr()
    assert before(out, robot) is None and "the camera is not used" in capsys.readouterr().err
    points.unlink()
    assert before(out, robot) is None and "p.csv: is missing" in capsys.readouterr().err


def test_a_hand_eye_file_without_camera_is_rejected(tmp_path: Path) -> None:
    told = tmp_path / "hand-eye.toml"
    told.write_text("position_m = [0.0, 0.0, -0.28]\nrotation_deg = [180.0, 0.0, 0.0]\n")
    blind = data_of(made_up("spatial-8", 20, 12), tmp_path / "data.json")
    fit = cdpr_here("calibrate", "fit", "spatial-8", "--data", blind, "--hand-eye", told)
    assert fit.returncode == 2 and "--hand-eye: these poses have no images" in fit.stderr
    run = ("calibrate", "run", "spatial-8", "--out", tmp_path / "run", "--hand-eye", told)
    scanned = cdpr_here(*run, "--scanner")
    assert scanned.returncode == 2 and "--hand-eye: allowed only with --camera" in scanned.stderr
    told.write_text("position_mm = [0.0, 0.0, -280.0]\n")
    done = cdpr_here(*run)
    assert done.returncode == 2 and "hand-eye.toml: position_mm" in done.stderr
    assert "Traceback" not in done.stderr and not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "given", [("--camera",), ("--scanner",), ("--plant", "p.toml"), ("--intrinsics", "c.toml")]
)
def test_a_resumed_run_rejects_options_of_its_start(given: tuple[str, ...], tmp_path: Path) -> None:
    where = ("--resume", "--out", tmp_path)
    done = cdpr_here("calibrate", "run", "planar-4", *where, *given)
    assert done.returncode == 2
    assert (
        f"{given[0]}: cannot be combined with --resume, which continues with the options of the run"
        in done.stderr
    )
