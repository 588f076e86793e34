"""Exports of motion capture and CSV dialects are read as named columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles.errors import ProfileError
from cdpr_tools.imports.tables import read_table

OPTITRACK = """\
Format Version,1.23,Take Name,Take 1,Capture Frame Rate,120.000000,Rotation Type,Quaternion,\
Length Units,Millimeters,Coordinate Space,Global

,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body
,Name,Platform,Platform,Platform,Platform,Platform,Platform,Platform
,,"1","1","1","1","1","1","1"
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z
0,0.000000,0.1,0.0,0.0,0.995,1.5,2.5,3.5
1,0.008333,,,,,,,
2,0.016667,0.1,0.0,0.0,0.995,1.6,2.5,3.5
"""
VICON = """\
Segments
100
,,robot:Platform,,,,,
Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ
,,rad,rad,rad,mm,mm,mm
11,0,0.1,0.2,0.3,100.0,200.0,300.0
12,0,0.1,0.2,0.3,101.0,,300.0

Trajectories
100
,,m1,,
Frame,Sub Frame,X,Y,Z
,,mm,mm,mm
11,0,1,2,3
"""


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "export.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_an_optitrack_export_has_columns_by_body_and_axis(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, OPTITRACK))
    assert table.column("time_s") == pytest.approx([0.0, 0.008333, 0.016667])
    x = table.column("Platform Position X")
    assert (x[0], x[2]) == (1.5, 1.6) and np.isnan(x[1])
    assert table.column("Platform Rotation W")[0] == 0.995
    assert table.units["Platform Position X"] == "mm"


def test_an_optitrack_export_of_an_old_version_is_read_without_guessing(tmp_path: Path) -> None:
    facts = OPTITRACK.splitlines()[0]
    text = OPTITRACK.replace(",Name,", ",,").replace("Time (Seconds)", "Time")
    table = read_table(written(tmp_path, text))
    assert table.column("Platform Position X")[0] == 1.5
    assert table.units["Platform Position X"] == "mm"
    old = text.replace(facts, "Format Version,1.22,Take Name,Take 1").replace(",W,", ",,")
    table = read_table(written(tmp_path, old))
    assert table.units["Platform Position X"] == "not stated"
    with pytest.raises(ProfileError, match=r"has Euler angles \(order not stated\)"):
        table.column("Platform Rotation X")


def test_markers_of_an_optitrack_export_may_occur_twice(tmp_path: Path) -> None:
    lines = OPTITRACK.splitlines()
    more = ("", "", ",Marker", ",Platform", ",2", ",Position", ",X", ",7", ",7", ",7")
    text = "\n".join(line + end for line, end in zip(lines, more, strict=True)) + "\n"
    table = read_table(written(tmp_path, text))
    assert table.column("Platform Position X")[0] == 1.5
    assert table.column("Platform Position X (Marker)")[0] == 7.0


def test_other_units_and_euler_angles_of_an_optitrack_export_are_not_misread(
    tmp_path: Path,
) -> None:
    text = OPTITRACK.replace("Millimeters", "Inches").replace("Type,Quaternion", "Type,XYZ")
    table = read_table(written(tmp_path, text))
    assert table.units["Platform Position X"] == "Inches"
    with pytest.raises(ProfileError, match=r"Platform Rotation W: has Euler angles \(XYZ\)"):
        table.column("Platform Rotation W")


def test_a_vicon_export_has_columns_by_body_and_time_from_frames(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, VICON))
    assert table.column("time_s") == pytest.approx([0.10, 0.11])
    assert list(table.column("Platform TX")) == [100.0, 101.0]
    assert np.isnan(table.column("Platform TY")[1])
    assert (table.units["Platform RX"], table.units["Platform TZ"]) == ("rad", "mm")


QUALISYS = (
    "NO_OF_FRAMES\t2\nFREQUENCY\t100\nTIME_STAMP\t2023-05-04, 10:11:12.345\t1234.5\n"
    "BODY_NAMES\tPlatform\tWand\nFrame\tTime\tPlatform X\tY\tZ\tRoll\tWand X\tY\tZ\tRoll\t\n"
    "1\t0.00\t1\t2\t3\t0.5\t7\t8\t9\t0.1\n2\t0.01\t1.5\t2\t3\t0.5\t0.000\t0.000\t0.000\t0\n"
)


def test_a_qualisys_export_has_columns_by_body_in_mm(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, QUALISYS))
    assert table.column("time_s") == pytest.approx([0.0, 0.01])
    assert table.column("Platform X") == pytest.approx([1.0, 1.5])
    assert table.column("Wand Z") == pytest.approx([9.0, np.nan], nan_ok=True)  # then hidden
    with pytest.raises(ProfileError, match="Platform Roll: is an Euler angle"):
        table.column("Platform Roll")
    assert table.units["Platform X"] == "mm"
    without_time = read_table(written(tmp_path, QUALISYS.replace("Frame\tTime", "Frame\tt")))
    assert without_time.column("time_s") == pytest.approx([0.0, 0.01])
    with pytest.raises(ProfileError, match="FREQUENCY: value ''; allowed: the rate in Hz"):
        read_table(written(tmp_path, "NO_OF_FRAMES\t1\nMARKER_NAMES\tA\n1\t2\t3\n"))
    with pytest.raises(ProfileError, match="line 2: no names of markers or bodies"):
        read_table(written(tmp_path, "NO_OF_FRAMES\t1\n1\t2\t3\n"))


def test_a_qualisys_export_without_column_headers_has_the_names_of_its_markers(
    tmp_path: Path,
) -> None:
    text = (
        "NO_OF_FRAMES\t2\nFREQUENCY\t250\nDATA_INCLUDED\t3D\nMARKER_NAMES\tHip\tArm - 1\n"
        "1\t2\t3\t4\t5\t6\n1.5\t2\t3\t0.000\t0.000\t0.000\n"
    )
    table = read_table(written(tmp_path, text))
    assert table.column("time_s") == pytest.approx([0.0, 0.004])
    assert table.column("Hip X") == pytest.approx([1.0, 1.5])
    assert table.column("Arm - 1 Z") == pytest.approx([6.0, np.nan], nan_ok=True)


def test_a_qualisys_rotation_matrix_becomes_a_rotation_vector(tmp_path: Path) -> None:
    # turned by +90 deg about z: Rot[1] is sin(angle); then hidden
    axes = "\t".join([" X", " Y", " Z", " Yaw", " Residual", *(f" Rot[{i}]" for i in range(9))])
    turned, hidden = "1\t2\t3\t90\t0.1\t0\t1\t0\t-1\t0\t0\t0\t0\t1", "\t".join(["0.000"] * 14)
    text = (
        f"NO_OF_FRAMES\t2\nFREQUENCY\t100\nBODY_NAMES\tWand\tPlatform\n{axes}\n"
        f"{turned}\t\t{turned}\n{turned}\t\t{hidden}\n"
    )
    table = read_table(written(tmp_path, text))
    assert table.column("Wand RZ") == pytest.approx([np.pi / 2] * 2)
    assert table.column("Platform RZ") == pytest.approx([np.pi / 2, np.nan], nan_ok=True)
    assert table.column("Platform RX")[0] == pytest.approx(0.0)
    assert table.units["Platform RX"] == "rad"


@pytest.mark.parametrize(
    "text",
    [
        "t,a\n0,1\n1,2\n",
        "t;a\r\n0;1\r\n1;2\r\n",
        "\ufefft\ta\n# note\n0\t1\n\n1\t2\n",
        'time,note\n"t","a"\n'.replace("time,note\n", "") + '"0","1"\n"1","2"\n',
        "t;a;µ\n0;1;\n1;2;\n".encode("latin-1"),
        "t\ta\r\n0,0\t1,0\r\n1\t2\r\n".encode("utf-16"),
        "t;a\r0;1,0\r1;2,0\r",
        "# t a\n0.0 1.0\n1.0 2.0\n",
        "% t,a\n0,1\n1,2\n",
        "Recording of 3 May, 2026\nRate;100 Hz\n\nt;a\n0;1,0\n1;2,0\n",
        "t,a\n[s],[Nm]\n0,1\n1,2\n",
        "t,a,state\n0,1,RUN\n1,2,STOP\n",
        "Operator,Ada\nRate,1000\nGain,2\nt,a\n0,1\n1,2\n",
        "t|a\n0|1.0\n1|2.0\n",
    ],
)
def test_csv_dialects_give_the_same_columns(tmp_path: Path, text: str | bytes) -> None:
    table = read_table(written(tmp_path, text))
    assert list(table.column("t")) == [0.0, 1.0]
    assert list(table.column("a")) == [1.0, 2.0]


def test_a_line_of_units_states_the_units(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, "time,pos,iq\ns,deg,A_rms\n0,1,2\n"))
    assert table.units == {"time": "s", "pos": "deg", "iq": "A_rms"}


def test_units_in_brackets_after_the_names_are_used(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, "time [ms],pos (deg),x (left),iq\n0,1,2,3\n"))
    assert table.units == {"time [ms]": "ms", "pos (deg)": "deg"}


def test_texts_for_missing_numbers_are_empty_cells(tmp_path: Path) -> None:
    text = "t,a\n0,1\n1,NA\n2,null\n3,--\n4,nan\n5,\n"
    assert np.isnan(read_table(written(tmp_path, text)).column("a")[1:]).all()


def test_dates_become_seconds(tmp_path: Path) -> None:
    text = "t,a\n2026-01-31T12:00:00.5Z,1\n2026-01-31 12:00:01.75,2\n"
    assert np.diff(read_table(written(tmp_path, text)).column("t")) == pytest.approx([1.25])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "contains no lines"),
        ("a,b\n", "contains no rows"),
        ("t;a\n0,1;1,5\n0,2;2.5\n", "line 3: a: value '2.5': earlier numbers have ','"),
        ("t;a\n0;1,234.5\n", "line 2: a: value '1,234.5'; allowed: a number"),
        ("0,1\n1,2\n", "line 1: no line of names above the numbers; write one"),
        ("t,a\n0,1\n1,RUN\n", "line 3: a: value 'RUN'; allowed: a number"),
        ("a,a\n1,2\n", "a different name for each column"),
        ("Format Version,1.2\nFrame,Time\n0,0\n", "export from Motive with all header rows"),
        ("Segments\nfast\n,,a\nFrame,Sub Frame,RX\n,,rad\n1,0,1\n", "the rate in Hz"),
    ],
)
def test_a_broken_export_is_rejected(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ProfileError, match=message):
        read_table(written(tmp_path, text)).column("a")
