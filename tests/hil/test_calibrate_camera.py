"""`cdpr calibrate run --camera` with several faults of robot, camera and marker sheets."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cdpr_here import cdpr_here

from cdpr_profiles.places import SHIPPED
from cdpr_rt.calibration.readings import load_data

_PLANT = """
seed = 3
[geometry]
exit_sigma_m = 0.02
[cables]
stiffness_error = -0.3
drum_radius_sigma = 0.008
slips = [{ cable = 5, at_s = 45.0, slip_m = 0.015 }]
[camera]
samples = 8
[camera.lens]
width_px = 640
height_px = 512
focal_px = [553.0, 554.0]
centre_px = [322.0, 252.0]
[[camera.grids]]
rows = 5
columns = 6
size_m = 0.18
position_sigma_m = 0.01
turn_sigma_deg = 3.0
[[camera.markers]]
id = 50
size_m = 0.1
position_m = [-0.15, 0.26, 0.0]
mirrored = true
[[camera.faults]]
kind = "unplugged"
from_image = 5
"""
_LENS = """
width_px = 640
height_px = 512
focal_px = [553.4, 554.3]
centre_px = [321.7, 252.2]
distortion = [-0.112, 0.083, 4e-4, -3e-4, -0.012]
sigmas = [0.5, 0.5, 0.3, 0.3, 1e-3, 5e-3, 1e-4, 1e-4, 1e-2]
"""


@pytest.fixture(autouse=True)
def _own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def test_a_camera_run_survives_a_slip_a_mirrored_sheet_and_an_unplugged_camera(
    tmp_path: Path,
) -> None:
    plant, lens, robot = (tmp_path / f"{name}.toml" for name in ("plant", "lens", "spatial-8"))
    plant.write_text(_PLANT)
    lens.write_text(_LENS)
    # half the cycle rate, which takes half the time
    shipped = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    robot.write_text(shipped.replace("sync_period_s = 0.001", "sync_period_s = 0.002"))
    done = cdpr_here(
        *("calibrate", "run", robot, "--camera", "--poses", "17", "--plant", plant),
        *("--intrinsics", lens, "--out", tmp_path / "out", "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert "pose 1: marker 50 is printed as a mirror image, and is left out" in done.stderr
    assert "sends no more images" in done.stderr and "opening it again" in done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    (jump,) = (fault for fault in told["faults"] if fault["kind"] != "marker")
    assert (jump["kind"], jump["cable"]) == ("jump", 5)
    assert jump["size"] == pytest.approx(0.015, abs=0.001)
    assert all("marker 50" in one["text"] for one in told["faults"] if one["kind"] == "marker")
    data = load_data(tmp_path / "out" / "data.json")
    assert len(data.poses) == told["poses"] == 17
    assert all(pose.image and pose.image.markers for pose in data.poses)
    assert len(list((tmp_path / "out" / "images").iterdir())) == 17
    proof, truth = told["verification"], told["truth"]
    assert proof["mean_position_error_mm"] < 0.5 * proof["mean_position_error_before_mm"]
    assert truth["mean_position_error_mm"] < told["predicted_3_sigma_mm"] < 5.0
    assert truth["mean_orientation_error_deg"] < 0.3
    assert told["in_force"]["version"] == 1
