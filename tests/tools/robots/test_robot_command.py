"""`cdpr robot show` reports and draws robots, and rejects invalid requests."""

from __future__ import annotations

import json
import re
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from cdpr_here import cdpr_here
from matplotlib.patches import Polygon

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt import offline
from cdpr_rt.diagnosis.checks import diagnose
from cdpr_tools.robots.picture import figure_of

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")


def as_json(done: subprocess.CompletedProcess[str]) -> dict[str, object]:
    told = json.loads(done.stdout.splitlines()[-1])
    assert isinstance(told, dict)
    return told


def test_the_planar_robot_is_reported_sketched_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "planar.png"
    shown = cdpr_here("robot", "show", "planar-3", "--png", picture, "--json")
    assert shown.returncode == 0, shown.stderr
    told = as_json(shown)
    assert told["ok"] is True and told["findings"] == []
    assert told["held_share"] == 1.0 and told["reserve_in_motion_N"] > 18.0  # type: ignore[operator]
    lines = shown.stderr.splitlines()
    assert any("hold the platform in 100 % of the box" in line for line in lines)
    assert any("no problems found" in line for line in lines)
    # exit points, the filled box of targets, and the stand below it
    first = next(i for i, line in enumerate(lines) if line.strip().startswith("1  "))
    assert lines[first].split() == ["1", "2"]
    home = next(line for line in lines[first:] if "o" in line)
    left, right = lines[first].index("1"), lines[first].index("2")
    assert home.index("o") == (left + right) // 2
    assert sum(line.count("#") for line in lines[first:]) > 80
    assert not any("!" in line for line in lines[first:] if "targets" not in line)
    image = matplotlib.image.imread(picture)
    assert image.shape[0] > 400 and image.shape[1] > 800
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 200  # not a blank page


def test_a_robot_that_cannot_hold_its_platform_is_reported_and_not_run(tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    path.write_text(PLANAR.replace("mass_kg = 2.0", "mass_kg = 20.0"))
    shown = cdpr_here("robot", "show", path, "--json")
    assert shown.returncode == 2
    assert "impossible: platform.home_m: at (0.00, 1.30) m the cables would need" in shown.stderr
    assert re.search(r"a platform of up to 1\d\.\d kg is possible there", shown.stderr)
    assert "!!!" in shown.stderr
    told = as_json(shown)
    assert told["ok"] is False and told["held_share"] == 0.0
    # the robot is not run either
    run = cdpr_here("run", path, "--bus", "simbus:", "--json")
    assert run.returncode == 2
    assert f"{path}: platform.home_m: at (0.00, 1.30) m" in run.stderr
    assert "Traceback" not in run.stderr


def test_a_cycle_that_does_not_fit_its_bus_is_reported_as_by_the_daemon(
    tmp_path: Path,
) -> None:
    path = tmp_path / "slow-bus.toml"
    path.write_text(PLANAR.replace("[[buses]]", "[[buses]]\nbitrate_bit_s = 500000"))
    shown = cdpr_here("robot", "show", path, "--json")
    assert shown.returncode == 2
    assert "impossible: sync_period_s: the cycle does not fit: bus can0: 3 drives" in shown.stderr
    assert as_json(shown)["ok"] is False
    run = cdpr_here("run", path, "--bus", "simbus:", "--json")
    assert run.returncode == 2 and "the cycle does not fit: bus can0: 3 drives" in run.stderr


def test_a_swinging_bar_is_reported_with_amplitude_and_duration() -> None:
    bar = Path(__file__).parents[2] / "hil" / "others" / "bar-1m.toml"
    shown = cdpr_here("robot", "show", bar, "--json")
    assert shown.returncode == 0, shown.stderr
    swings: Any = as_json(shown)["free_rotation"]
    assert 2.0 < swings["slowest_Hz"] < swings["fastest_Hz"] < 10.0
    assert swings["swing_m"] > 2e-3 and swings["lasts_s"] > 1.0
    assert re.search(r"swings at 3\.\d to \d\.\d Hz: by .* after a move at full", shown.stderr)
    assert re.search(r"may take \d+ s to die down to 2 mm", shown.stderr)
    small = cdpr_here("robot", "show", "planar-3", "--json")
    assert as_json(small)["free_rotation"]["lasts_s"] == 0.0  # type: ignore[index]
    assert "to die down" not in small.stderr


def test_a_robot_in_space_is_reported_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "suspended.png"
    shown = cdpr_here("robot", "show", "suspended-8", "--png", picture, "--json")
    assert shown.returncode == 0, shown.stderr
    told = as_json(shown)
    assert told["held_share"] == told["target_share"] == 1.0 and told["findings"] == []
    assert told["reserve_in_motion_N"] > told["kept_for_control_N"] > 90.0  # type: ignore[operator]
    assert 6.0 < told["lowest_resonance_Hz"] < 8.0  # type: ignore[operator]
    loop = told["loop"]
    assert 0.45 <= loop["modulus_margin"] < 0.6  # type: ignore[index]
    assert 1.0 < loop["slowest_Hz"] < loop["fastest_Hz"] < 20.0  # type: ignore[index]
    assert re.search(r"gain margin of 1.8 and a phase margin of 26 deg", shown.stderr)
    assert loop["least_damping_ratio"] == pytest.approx(0.070, abs=0.004)  # type: ignore[index]
    assert "least damped oscillation: 2.3 Hz, damping ratio 0.07" in shown.stderr
    assert told["controlled"] == ["x", "y", "z", "rx", "ry", "rz"]
    assert "turns_at_most_rad" not in told
    broken = [axis["broken"] for axis in told["axes"]]  # type: ignore[attr-defined]
    swings, furthest = ([one[key] for one in broken] for key in ("swing_m", "away_m"))
    assert len(swings) == 8 and max(swings) == pytest.approx(1.49, abs=0.02)
    assert min(furthest) > 1.9  # from the ground
    assert all(one["aside_m"] < one["away_m"] for one in broken)
    assert "targets up to 15.0 deg from home's orientation" in shown.stderr
    assert re.search(r"^axis 7 +\(.*\) +1\.50 +5\d +2\.0", shown.stderr, re.MULTILINE)
    assert matplotlib.image.imread(picture).shape[0] > 1200  # three sections


def test_a_suspended_robot_that_cannot_hold_is_reported_with_a_remedy(
    tmp_path: Path,
) -> None:
    path = tmp_path / "heavy.toml"
    suspended = (SHIPPED / "robots" / "suspended-8.toml").read_text()
    path.write_text(suspended.replace("mass_kg = 100.0", "mass_kg = 900.0"))
    told = {f.key: f.text for f in diagnose(load_robot(path)) if f.impossible}
    assert "the cables would need" in told["platform.home_m"]
    assert re.search(r"a platform of up to \d+ kg is possible there", told["platform.home_m"])
    path.write_text(suspended.replace("tension_max_N = 800.0", "tension_max_N = 1500.0"))
    told = {f.key: f.text for f in diagnose(load_robot(path)) if f.impossible}
    assert "allowed: up to 1333 N" in told["limits.tension_max_N"]


def test_a_slow_control_loop_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "late.toml"
    text = (SHIPPED / "robots" / "suspended-6.toml").read_text()
    path.write_text(re.sub(r"^sync_period_s = .*$", "", text, flags=re.M))
    assert not diagnose(load_robot(path))
    path.write_text("sync_period_s = 0.004\n" + path.read_text())
    (found,) = diagnose(load_robot(path))
    assert not found.impossible and "slowest mode of a stable loop is at 0.34 Hz" in found.text
    # 60 kg at that frequency, compared with the usual 12 N in one winch of 300 N
    off_mm = re.search(r"such winches moves it by (\d+) mm", found.text)
    assert off_mm is not None
    alone_m = 12.0 / (60.0 * (2.0 * np.pi * 0.34) ** 2)
    assert alone_m / 1.5 < 1e-3 * float(off_mm[1]) < alone_m * 1.5
    yield_mm = re.search(r"stretch by ([\d.]+) mm when it", found.text)
    assert yield_mm is not None
    slower = re.sub(r"^acceleration_m_s2 = .*$", "acceleration_m_s2 = 0.1", text, flags=re.M)
    slower = re.sub(r"^sync_period_s = .*$", "sync_period_s = 0.004", slower, flags=re.M)
    path.write_text(slower)
    (found,) = diagnose(load_robot(path))
    less_mm = re.search(r"stretch by ([\d.]+) mm when it", found.text)
    accelerated = load_robot("suspended-6").platform
    assert less_mm is not None and accelerated is not None
    share = 0.1 / accelerated.acceleration_m_s2
    assert float(less_mm[1]) == pytest.approx(share * float(yield_mm[1]), rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["one-bus-8"], "has no platform; allowed: a robot with a [platform]"),
        (["planr-3"], "did you mean 'planar-3'?"),
        (["planar-3.tml"], "no such file: 'planar-3.tml'"),
        (
            [__file__.rpartition("/")[2]],
            "is not a robot file (TOML, with a name that ends in .toml)",
        ),
        (["planar-3", "--png", "/nowhere/robot.png"], "a file in a folder that can be written to"),
    ],
)
def test_a_robot_that_cannot_be_shown_is_reported_in_one_line(
    arguments: list[str], problem: str
) -> None:
    shown = cdpr_here("robot", "show", *arguments, cwd=Path(__file__).parent)
    assert shown.returncode == 2
    (line,) = shown.stderr.strip().splitlines()
    assert line.startswith("cdpr: ") and problem in line


def test_exit_points_above_each_other_share_a_name_and_the_platform_is_drawn_whole(
    tmp_path: Path,
) -> None:
    path = tmp_path / "box.toml"
    text = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    columns = iter([(x, y, z) for z in (0.8, 2.9) for x in (-1.7, 1.5) for y in (-2.2, 2.2)])
    text = re.sub(r"exit_point_m = .*", lambda _: f"exit_point_m = {list(next(columns))}", text)
    inner = "anchor_point_m = [0.03, -0.1, 0.05]"  # within the outline of the others
    path.write_text(text.replace("anchor_point_m = [0.1, -0.1, 0.3]", inner, 1))
    robot = load_robot(path)
    assert robot.platform is not None
    figure = figure_of(robot, robot.platform)
    (from_above,) = [ax for ax in figure.axes if ax.texts]
    names = [text.get_text() for text in from_above.texts]
    assert names == ["axis 1, axis 5", "axis 2, axis 6", "axis 3, axis 7", "axis 4, axis 8"]
    for ax in figure.axes:
        for outline in (patch for patch in ax.patches if isinstance(patch, Polygon)):
            if outline.get_fill():
                x, y = outline.get_xy().T
                area = abs(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1])) / 2.0
                assert area == pytest.approx(np.ptp(x) * np.ptp(y))  # a rectangle in each view


def test_colour_labels_of_a_thin_robot_do_not_overlap() -> None:
    robot = load_robot("spatial-8")
    assert robot.platform is not None
    thin = tuple((x, 0.03 * y, z) for x, y, z in robot.platform.exit_points_m)
    platform = replace(robot.platform, exit_points_m=thin, workspace_min_m=(-0.15, -0.02, 1.4),
                       workspace_max_m=(0.15, 0.1, 1.6))  # fmt: skip
    figure = figure_of(replace(robot, platform=platform), platform)
    figure.draw_without_rendering()
    (bar,) = (ax for ax in figure.axes if "distance of all tensions" in ax.get_ylabel())
    extents = [text.get_window_extent() for text in bar.get_yticklabels() if text.get_text()]
    for below, above in pairwise(extents):
        assert below.y1 < above.y0


@pytest.mark.parametrize("swings", [True, False])
def test_a_swing_in_a_table_of_readings_is_reported(tmp_path: Path, swings: bool) -> None:
    model = offline.load("planar-3")
    lengths = model.lengths(model.home)
    time, rng = np.arange(0.0, 12.0, 0.04), np.random.default_rng(4)
    wave = np.sin(2.0 * np.pi * time / 1.31)
    if not swings:
        wave = np.cumsum(rng.normal(0.0, 0.1, time.size))
    lines = ["time_s,length_1_m,length_2_m,length_3_m,roll_rad,pitch_rad"]
    for t, one in zip(time, np.radians(3.0) * wave, strict=True):
        roll, pitch = 0.6 * one + rng.normal(0.0, 1e-3), -0.8 * one + rng.normal(0.0, 1e-3)
        lines.append(",".join(f"{x:.6f}" for x in (t, *lengths, roll, pitch)))
    (tmp_path / "table.csv").write_text("\n".join(lines) + "\n")
    ended = cdpr_here("robot", "pose", "planar-3", tmp_path / "table.csv", "--json")
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout.splitlines()[-1])["swing"]
    if swings:
        assert found["amplitude_deg"] == pytest.approx(3.0, rel=0.05)
        assert found["period_s"] == pytest.approx(1.31, rel=0.02)
    else:
        assert found == {}
