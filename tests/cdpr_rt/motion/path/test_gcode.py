"""G-code: what it means, and what is refused with the line that it stands in."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.motion.path.arcs import arc_by_radius
from cdpr_rt.motion.path.description import Coordinates, PathDescription, PathError
from cdpr_rt.motion.path.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path.pieces import pieces_of

ROOM = Coordinates(("x", "y", "z", "rx", "ry", "rz"), np.array([0.0, 0.1, 1.4, 0.0, 0.0, 0.0]))
PLANE = Coordinates(("x", "y"), np.array([0.0, 1.4]))


def read(*lines: str, origin=(0.0, 0.0, 0.0), where=ROOM, ignored=()) -> PathDescription:
    wanted = GcodeSettings(np.array(origin[: where.positions]), 1e-3, frozenset(ignored))
    return read_gcode("\n".join([*lines, ""]), "part.nc", where, wanted)


def ends_mm(path: PathDescription) -> list[list[float]]:
    return [[round(1e3 * x, 6) for x in move.end[:3]] for move in path.moves]


def test_lines_units_and_modes():
    path = read(
        "%", "O1000 (a part)", "N10 G21 G90 ; mm", "G0 X10 Y20. Z-3", "g1 x30 f600", "G91", "Y5",
        "G90 G20", "X1.0 F60", "G4 P0.5", "M0", "M2",
    )  # fmt: skip
    np.testing.assert_allclose(path.start[:3], [0.01, 0.02, -0.003])
    assert ends_mm(path)[:3] == [[30, 20, -3], [30, 25, -3], [25.4, 25, -3]]
    assert path.start_line == 4
    assert path.lines[1:] == [5, 7, 9, 10, 11]
    np.testing.assert_allclose([move.speed for move in path.moves[:3]], [0.01, 0.01, 0.0254])
    assert (path.moves[3].dwell_s, path.moves[4].waits) == (0.5, True)


def test_the_path_begins_where_all_coordinates_have_been_named():
    path = read("G0 Z50", "G0 X1 Y2", "G1 X5 F100", "M30", origin=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(path.start[:3], [0.101, 0.202, 0.35])
    assert len(path.moves) == 1
    with pytest.raises(PathError, match=r"part.nc:3: Y never named"):
        read("G0 X1 Z2", "X5", "M2")


def test_room_coordinates_and_the_reference():
    path = read(
        "G0 X0 Y0 Z0", "G53 X300 Y0 Z1500", "X5", "G28 Z100", "G28", "M2", origin=(0.1, 0.1, 1.0)
    )
    assert ends_mm(path) == [[300, 0, 1500], [105, 0, 1500], [105, 0, 1100], [105, 0, 1400],
                             [0, 100, 1400]]  # fmt: skip


def test_turning_alone_takes_degrees_a_minute():
    path = read("G0 X0 Y0 Z0", "G1 A9 F600", "X10", "M2")
    np.testing.assert_allclose(path.moves[0].speed, math.radians(10.0))
    np.testing.assert_allclose(path.moves[0].end[3], math.radians(9.0))
    np.testing.assert_allclose(path.moves[1].speed, 0.01)


def test_corners_are_cut_as_the_file_says():
    path = read("G0 X0 Y0 Z0", "G1 X1 F60", "G64 P2.5", "X2", "G61", "X3", "G64", "X4", "M2")
    assert [move.blend_m for move in path.moves] == [1e-3, 2.5e-3, 0.0, 1e-3]


@settings(max_examples=60)
@given(
    st.floats(-math.pi, math.pi), st.floats(0.05, 2 * math.pi - 0.05), st.booleans(),
    st.floats(1.0, 400.0),
)  # fmt: skip
def test_an_arc_is_the_same_by_its_centre_and_by_its_radius(begin, turn, clockwise, radius):
    sign = -1.0 if clockwise else 1.0
    end = begin + sign * turn
    centre = np.array([7.0, -3.0])
    first, last = (centre + radius * np.array([math.cos(a), math.sin(a)]) for a in (begin, end))
    code = "G2" if clockwise else "G3"
    head = ["G0 Z0", f"G0 X{first[0]:.9f} Y{first[1]:.9f}", "F60"]
    to = f"{code} X{last[0]:.9f} Y{last[1]:.9f}"
    away = centre - first
    by_centre = read(*head, f"{to} I{away[0]:.9f} J{away[1]:.9f}", "M2").moves[0].arc
    assert by_centre is not None
    np.testing.assert_allclose(by_centre.centre_m, 1e-3 * centre, atol=2e-6)
    np.testing.assert_allclose(by_centre.angle_rad, sign * turn, atol=1e-5)
    if abs(turn - math.pi) > 0.1:
        r = radius if turn < math.pi else -radius
        by_radius = read(*head, f"{to} R{r:.9f}", "M2").moves[0].arc
        assert by_radius is not None
        np.testing.assert_allclose(by_radius.angle_rad, sign * turn, atol=1e-4)


def test_a_whole_circle_and_a_helix():
    path = read("G0 X10 Y0 Z0", "F600", "G2 X10 Y0 I-10 J0", "G3 X-10 Z5 I-10", "M2")
    pieces = pieces_of(path, np.array([1, 1, 1, 0.3, 0.3, 0.3]))
    np.testing.assert_allclose(pieces.angle_rad, [-2 * math.pi, math.pi])
    np.testing.assert_allclose(
        pieces.length, [0.02 * math.pi, math.hypot(0.01 * math.pi, 5e-3)], rtol=1e-6
    )


@pytest.mark.parametrize(
    ("lines", "where", "told"),
    [
        (["G0 X0 Y0 Z0", "G43 H1"], ROOM, r":2: G43: not known; allowed: G0 G1"),
        (["G0 X0 Y0 Z0", "T1 M6"], ROOM, r":2: M6: not known"),
        (["G0 X0 Y0 Z0", "G1 X5"], ROOM, r":2: G1 without a feed"),
        (["G0 X0 Y0 Z0", "G1 X#1"], ROOM, r":2: 'X#1'"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5 I1 J0"], ROOM, r":3: G2: its ends are 1.0000 mm"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5 R1"], ROOM, r":3: G2: R1 mm: its ends are 5 mm apart"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5"], ROOM, r":3: G2: allowed: either I and J, or R"),
        (["G0 X0 Y0 Z0", "G0 G1 X5"], ROOM, r":2: G0 G1: allowed: one"),
        (["G0 X0 Y0 Z0", "X1 X2"], ROOM, r":2: X stands twice"),
        (["G0 X0 Y0 Z0", "(open"], ROOM, r":2: a comment is not closed"),
        (["G91 X5"], ROOM, r":1: X: by how much, but from where"),
        (["G0 X0 Y0", "Z5"], PLANE, r":2: Z5: not known; allowed: X Y F"),
        (["G0 X0 Y0 Z0", "G4 P-1"], ROOM, r":2: G4: allowed"),
        (["G0 X0 Y0 Z0", "X5"], ROOM, r":2: ends without M2.*cut short"),
    ],
)
def test_what_is_refused(lines, where, told):
    end = [] if "cut short" in told else ["M2"]
    with pytest.raises(PathError, match=told):
        read(*lines, *end, where=where)


def test_words_may_be_skipped():
    path = read("G0 X0 Y0 Z0", "S5000 M3", "T1", "X5", "M5", "M2", ignored={"S", "T", "M3", "M5"})
    assert len(path.moves) == 1


@settings(max_examples=150)
@given(st.text(alphabet="GMXYZABCFIJR0123456789.-+ %();\n", max_size=120))
def test_any_text_is_read_or_refused(text):
    try:
        read(text)
    except PathError as error:
        assert str(error).startswith("part.nc:")


def test_an_arc_of_a_radius_beyond_reason_is_refused() -> None:
    with pytest.raises(ValueError, match=r"allowed: up to 1e\+06 mm"):
        arc_by_radius(np.zeros(2), np.ones(2), 1e200, True)
