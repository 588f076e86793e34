"""Way points from TOML and CSV files."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdpr_profiles.errors import ProfileError
from cdpr_rt.motion.gcode import GcodeSettings
from cdpr_rt.motion.path_description import Coordinates, PathError
from cdpr_rt.motion.path_nodes import nodes_of
from cdpr_rt.motion.way_points import read_path

PLANE = Coordinates(("x", "y", "angle"), np.zeros(3))
SETTINGS = GcodeSettings(np.zeros(2))
TOML = """speed_m_s = 0.2
blend_m = 0.01
[[points]]
position_m = [0.0, 1.4]
[[points]]
position_m = [0.1, 1.4]
rotation_rad = [0.1]
speed_m_s = 0.05
dwell_s = 0.5
[[points]]
position_m = [0.1, 1.6]
blend_m = 0.0
wait = true
"""
CSV = "x_mm,y_m,angle_deg,speed_mm_s,blend_m,dwell_s,wait\n0,1.4,,200,0.01,,\n100,1.4,5,50,,0.5,\n"


def test_toml_and_csv_give_the_same_path(tmp_path):
    (tmp_path / "a.toml").write_text(TOML)
    (tmp_path / "a.csv").write_text(CSV + "# a comment\n100,1.6,,200,0,,1\n")
    one, other = (read_path(tmp_path / f"a.{kind}", PLANE, SETTINGS) for kind in ("toml", "csv"))
    np.testing.assert_allclose(one.points[1], [0.1, 1.4, 0.1])
    np.testing.assert_allclose(other.points[1], [0.1, 1.4, math.radians(5.0)])
    for path in (one, other):
        assert [move.speed for move in path.moves] == [0.05, 0.2]
        assert [move.blend_m for move in path.moves] == [0.01, 0.0]
        assert [move.dwell_s for move in path.moves] == [0.5, 0.0]
        assert [move.waits for move in path.moves] == [False, True]
    assert one.lines == [3, 5, 10]
    assert other.lines == [2, 3, 5]


def test_a_stop_at_the_first_point_is_at_the_beginning_of_the_path(tmp_path):
    text = TOML.replace("position_m = [0.0, 1.4]", "position_m = [0.0, 1.4]\nwait = true")
    (tmp_path / "a.toml").write_text(text)
    (tmp_path / "a.csv").write_text(CSV.replace(",200,0.01,,", ",200,0.01,1.5,1"))
    for kind in ("toml", "csv"):
        nodes = nodes_of(read_path(tmp_path / f"a.{kind}", PLANE, SETTINGS), np.ones(3))
        assert nodes.runs[0].tolist() == [0, 0]
        assert nodes.waits[0]
    assert nodes.dwell_s[0] == 1.5


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (CSV + "100,1.6,5", r":4: does not end with a newline: is it truncated"),
        (CSV + "100,1.6\n", r":4: 2 cells; allowed: 7"),
        (CSV + "a,1.6,,,,,\n", r":4: x: value 'a'"),
        (CSV + "nan,1.6,,,,,\n", r":4: x: value nan"),
        (CSV + "1,1.6,,-5,,,\n", r":4: speed: value -5"),
        ("x_m,y_m,z_m\n", r":1: column 'z_m'; allowed: x_m, y_m, angle_rad"),
        ("x_deg,y_m\n", r":1: column 'x_deg'"),
        ("x_m,y_m\n0,1\n", r"fewer than two"),
    ],
)
def test_invalid_csv_is_rejected(tmp_path, text, told):
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(PathError, match=told):
        read_path(file, PLANE, SETTINGS)


def test_invalid_toml_is_rejected(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text(TOML.replace("[0.1, 1.6]", "[0.1]"))
    with pytest.raises(ProfileError, match=r"points\[2\].position_m: value \[0.1\]; allowed: 2 n"):
        read_path(file, PLANE, SETTINGS)
    file.write_text(TOML.replace("speed_m_s = 0.05", "sped_m_s = 0.05"))
    with pytest.raises(ProfileError, match="did you mean 'speed_m_s'"):
        read_path(file, PLANE, SETTINGS)
    file.write_text(TOML.rstrip()[:-3])
    with pytest.raises((ProfileError, PathError)):
        read_path(file, PLANE, SETTINGS)
    with pytest.raises(PathError, match=r"allowed: way points .toml .csv, G-code .nc"):
        read_path(tmp_path / "a.dxf", PLANE, SETTINGS)
