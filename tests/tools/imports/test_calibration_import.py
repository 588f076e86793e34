"""Cable lengths and poses of motion capture become data for `cdpr calibrate fit`."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_robot
from cdpr_rt.calibration.readings import load_data
from cdpr_rt.model.platform_model import platform_model_of

ROBOT = "planar-3"
MODEL = platform_model_of(load_robot(ROBOT))
CLOCK_S = 1.812
MAP = """\
rate_Hz = 50
[cables]
time = { name = "t", unit = "ms" }
lengths = [{ name = "l1", unit = "mm" }, { name = "l2", unit = "mm" }, { name = "l3", unit = "mm" }]
tensions = [{ name = "f1" }, { name = "f2" }, { name = "f3" }]
[pose]
time = { name = "time_s", offset = -1.812 }
position = [{ name = "P Position X" }, { name = "P Position Y" }, { name = "P Position Z" }]
axes = ["z", "y", "-x"]
"""


def cable_lengths_m(place_m: np.ndarray) -> np.ndarray:
    """Return the lengths (k, 3) at positions (k, 2) without rotation."""
    platform = MODEL.platform
    exits, anchors = (np.array(p) for p in (platform.exit_points_m, platform.anchor_points_m))
    return np.linalg.norm((exits - anchors)[None, :, :2] - place_m[:, None], axis=2)


def recorded(
    folder: Path, start_m: np.ndarray | None = None, poses_Hz: float = 120.0
) -> tuple[Path, Path, Path]:
    """Write lengths at 100 Hz, and an OptiTrack export in another frame and clock."""
    start = MODEL.home[:2] if start_m is None else start_m
    (folder / "map.toml").write_text(MAP)

    def place(time: np.ndarray) -> np.ndarray:
        return start + np.column_stack([0.3 * (1.0 - np.cos(time)), 0.2 * np.sin(time)])

    time = np.arange(0.0, 4.0, 0.01)
    lengths = cable_lengths_m(place(time))
    rows = ["t,l1,l2,l3,f1,f2,f3"]
    for t, row in zip(time, 1e3 * lengths, strict=True):
        rows.append(f"{1e3 * t:.0f},{row[0]:.5f},{row[1]:.5f},{row[2]:.5f},50,50,50")
    (folder / "lengths.csv").write_text("\n".join(rows) + "\n")
    seen = np.arange(0.0, 4.0, 1.0 / poses_Hz)
    lines = [
        "Format Version,1.23,Length Units,Meters",
        ",Name,P,P,P",
        ",,Position,Position,Position",
        "Frame,Time (Seconds),X,Y,Z",
    ]
    for k, (t, (x, y)) in enumerate(zip(seen, place(seen), strict=True)):
        hidden = 2.0 < t < 2.5
        cells = ",," if hidden else f"-0.1,{y:.6f},{x:.6f}"
        lines.append(f"{k},{t + CLOCK_S:.6f},{cells}")
    (folder / "take.csv").write_text("\n".join(lines) + "\n")
    return folder / "lengths.csv", folder / "take.csv", folder / "map.toml"


def run(folder: Path, files: tuple[Path, Path, Path]) -> subprocess.CompletedProcess[str]:
    lengths, take, mapping = files
    return cdpr_here(
        *("import", "calibration", ROBOT, lengths, "--poses", take, "--map", mapping),
        *("--out", folder / "out", "--overwrite", "--json"),
    )


def test_poses_are_interpolated_at_the_times_of_the_lengths(tmp_path: Path) -> None:
    result = run(tmp_path, recorded(tmp_path))
    assert result.returncode == 0, result.stderr
    data = load_data(tmp_path / "out" / "data.json")
    told = json.loads(result.stdout.splitlines()[-1])
    # 50 a second for 4 s, without the half second in which the body was hidden
    assert told["poses"] == len(data.poses) == pytest.approx(175, abs=3)
    seen = data.observations(load_robot(ROBOT), MODEL)
    expected = cable_lengths_m(seen.start[:, 0, :2])
    assert np.abs(seen.length_m - expected).max() < 1e-4
    assert np.abs(seen.position_m[:, :2] - seen.start[:, 0, :2]).max() < 1e-9
    assert (seen.tension_N == 50.0).all()
    assert any("left out 59 of 480 rows without a pose" in one for one in told["notes"])


def test_poses_of_a_slow_camera_are_interpolated_but_not_across_a_gap(tmp_path: Path) -> None:
    result = run(tmp_path, recorded(tmp_path, poses_Hz=10.0))
    assert result.returncode == 0, result.stderr
    data = load_data(tmp_path / "out" / "data.json")
    assert len(data.poses) == pytest.approx(165, abs=6)
    seen = data.observations(load_robot(ROBOT), MODEL)
    expected = cable_lengths_m(seen.start[:, 0, :2])
    assert np.abs(seen.length_m - expected).max() < 1e-3


@pytest.mark.parametrize("late", ["poses", "lengths"])
def test_a_time_offset_of_the_columns_corrects_the_clock(tmp_path: Path, late: str) -> None:
    files = recorded(tmp_path)
    mapping = MAP.replace(", offset = -1.812", "")
    if late == "poses":
        for axis in "XYZ":
            mapping = mapping.replace(
                f'Position {axis}"', f'Position {axis}", time_offset_s = -1.812'
            )
    else:
        mapping = mapping.replace('", unit = "mm"', '", unit = "mm", time_offset_s = 1.812')
    files[2].write_text(mapping)
    result = run(tmp_path, files)
    assert result.returncode == 0, result.stderr
    seen = load_data(tmp_path / "out" / "data.json").observations(load_robot(ROBOT), MODEL)
    assert np.abs(seen.length_m - cable_lengths_m(seen.start[:, 0, :2])).max() < 1e-4


def test_a_recording_that_does_not_begin_at_home_names_the_home_to_write(tmp_path: Path) -> None:
    result = run(tmp_path, recorded(tmp_path, MODEL.home[:2] + np.array([0.25, 0.0])))
    assert result.returncode == 2
    assert "write home_m = [" in result.stderr


def test_a_wrong_order_of_the_cables_is_noted(tmp_path: Path) -> None:
    files = recorded(tmp_path)
    swapped = MAP.replace('"l1"', '"l"').replace('"l2"', '"l1"').replace('"l"', '"l2"')
    files[2].write_text(swapped)
    result = run(tmp_path, files)
    assert result.returncode == 0, result.stderr
    assert "check `axes`, the order" in " ".join(
        json.loads(result.stdout.splitlines()[-1])["notes"]
    )


def test_a_quaternion_of_zeros_counts_as_a_hidden_body(tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 0.01)
    lengths = cable_lengths_m(np.tile(MODEL.home[:2], (time.size, 1)))
    lines = ["t,l1,l2,l3,x,y,z,a,b,c,w"]
    for k, (t, row) in enumerate(zip(time, lengths, strict=True)):
        turn = "0,0,0,0" if k == 50 else "0,0,0,1"
        x, y = MODEL.home[:2]
        lines.append(f"{t},{row[0]},{row[1]},{row[2]},{x},{y},0,{turn}")
    (tmp_path / "a.csv").write_text("\n".join(lines))
    one = '{{ name = "{}" }}'.format
    (tmp_path / "map.toml").write_text(
        f"[cables]\ntime = {one('t')}\nlengths = [{', '.join(map(one, ('l1', 'l2', 'l3')))}]\n"
        f"[pose]\ntime = {one('t')}\nposition = [{', '.join(map(one, 'xyz'))}]\n"
        f"quaternion = [{', '.join(map(one, 'abcw'))}]\n"
    )
    files = tmp_path / "a.csv", tmp_path / "a.csv", tmp_path / "map.toml"
    result = run(tmp_path, files)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("-1.812", "100.0", "s to `offset`"),
        ("rate_Hz = 50", "from_s = 9.0", "0 rows lie within the time of the poses"),
        ('Position X"', 'Position X", time_offset_s = 0.01', "the same for all columns of a pose"),
        ('"z", "y", "-x"', '"z", "y", "x"', "a right-handed frame"),
        ('"z", "y", "-x"', '"z", "up", "x"', "pose.axes[1]: value 'up'; allowed: x, y, z"),
        (', { name = "l3", unit = "mm" }]', "]", "cables.lengths: 2 columns; allowed: 3"),
        (
            '"P Position X"',
            '"P Rotation X"',
            "no column 'P Rotation X'; its columns: Frame, time_s",
        ),
    ],
)
def test_a_wrong_mapping_is_named(tmp_path: Path, old: str, new: str, text: str) -> None:
    files = recorded(tmp_path)
    files[2].write_text(MAP.replace(old, new))
    result = run(tmp_path, files)
    assert result.returncode == 2
    assert text in result.stderr


def test_a_measured_rotation_is_data_and_not_where_the_search_begins(tmp_path: Path) -> None:
    robot = load_robot("planar-4")
    model = platform_model_of(robot)
    time = np.arange(0.0, 2.0, 0.01)
    lines = ["t,l1,l2,l3,l4,x,y,z,a,b,c,w"]
    for t in time:
        half = 0.02 * t  # turned by 0.08 rad in the end
        x, y = model.home[:2]
        lines.append(f"{t},1,1,1,1,{x},{y},0,0,0,{np.sin(half)},{np.cos(half)}")
    (tmp_path / "a.csv").write_text("\n".join(lines))
    one = '{{ name = "{}" }}'.format
    lengths = ", ".join(map(one, ("l1", "l2", "l3", "l4")))
    (tmp_path / "map.toml").write_text(
        f"[cables]\ntime = {one('t')}\nlengths = [{lengths}]\n"
        f"[pose]\ntime = {one('t')}\nposition = [{', '.join(map(one, 'xyz'))}]\n"
        f"quaternion = [{', '.join(map(one, 'abcw'))}]\n"
    )
    done = cdpr_here(
        *("import", "calibration", "planar-4", tmp_path / "a.csv"),
        *("--map", tmp_path / "map.toml", "--out", tmp_path / "out"),
    )
    assert done.returncode == 0, done.stderr
    last = load_data(tmp_path / "out" / "data.json").poses[-1]
    assert last.rotation is not None
    assert abs(last.rotation[1][0]) > 0.06
    assert last.target[2] == 0.0
