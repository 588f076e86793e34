"""`cdpr path` without a daemon."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cdpr_here import cdpr_here
from PIL import Image

from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import load_calibrated, take_over
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.programs.path_store import PathStore, paths_folder
from tests.profiles.test_geometry_calibration import calibration

ORIGIN = "--origin=-150 100 1550"
GCODE = "G21 G90\nG0 X0 Y0 Z0\nG1 X100 F6000\nY100 Z50\nG3 X0 Y100 I-50 J0\nM2\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_text(GCODE)
    return path


def test_a_preview_writes_a_picture_and_the_plan_for_the_daemon(file, tmp_path, monkeypatch):
    for folder in ("XDG_CONFIG_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(folder, str(tmp_path))
    robot = load_robot("spatial-8")
    take_over(robot, calibration(robot))
    picture = tmp_path / "part.png"
    done = cdpr_here(
        "path", "show", file, "--robot", "spatial-8", ORIGIN, "--png", picture, "--keep", "--json"
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["ok"] and told["moves"] == 3 and told["obstacle"] is None
    assert told["gain"] > 1.0
    assert min(told["tension_min_N"]) >= min(told["tension_low_N"]) - 1e-6
    assert "planned within" in done.stderr
    with Image.open(picture) as image:
        assert min(image.size) > 500
    store = PathStore(platform_model_of(load_calibrated("spatial-8")))
    store.open(paths_folder("spatial-8"))
    store.load(told["plan"])
    plan = store.plan(told["plan"])
    assert plan.duration_s == pytest.approx(told["duration_s"])
    assert plan.line[0] == 3 and plan.line[-1] == 5


@pytest.mark.parametrize(
    ("change", "options", "told"),
    [
        (("Y100 Z50", "Y100 Z250"), [ORIGIN], "part.nc:4: at "),
        (("G21", "G20"), [ORIGIN], "part.nc:3: the path is .* perhaps 25.4 times too large"),
        (("M2", "G41 D1\nM98 P2"), [ORIGIN], r"part.nc:6: G41: .*\n.*part.nc:7: M98: "),
        (("", ""), [ORIGIN, "--ignore=G3"], "part.nc: --ignore G3: other lines depend on it"),
        (("", ""), [ORIGIN, "--z=5"], r"part.nc:2: Z: --z is only for files without Z"),
        (("", ""), ["--origin=1 2"], "--origin 1 2: allowed: 3 numbers in mm"),
    ],
)
def test_an_infeasible_path_ends_with_status_2(file, change, options, told):
    import re  # noqa: PLC0415

    file.write_text(GCODE.replace(*change) if change[0] else GCODE)
    done = cdpr_here("path", "show", file, "--robot", "spatial-8", *options)
    assert done.returncode == 2
    assert re.search(told, done.stderr), done.stderr
    assert "Traceback" not in done.stderr


def test_a_file_without_a_command_is_rejected_with_the_commands(file):
    done = cdpr_here("path", file, ORIGIN)
    assert done.returncode == 2
    assert f"{file}: name a command first: `cdpr path show {file}` or `cdpr" in done.stderr


def test_a_command_typed_as_an_option_is_rejected_with_the_right_spelling(file):
    for words in (("--run", file), (file, "--run")):
        done = cdpr_here("path", *words)
        assert done.returncode == 2
        assert f"`cdpr path run {file}`" in done.stderr


def test_options_place_the_path_of_a_file(file):
    file.write_text("M104 S200\nG0 X0 Y0\nG1 X100 F6000\n")
    placed = [ORIGIN, "--z=50", "--scale=2", "--rotate=90", "--mirror=x"]
    done = cdpr_here("path", "show", file, "--robot", "spatial-8", *placed, "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout.splitlines()[-1])
    assert figures["length_m"] == pytest.approx(0.2)
    assert figures["deviation_m"] < 1e-5
    assert "note: ignored: the line of M104 (line 1)" in done.stderr
    assert "note: the file ends without M2" in done.stderr
