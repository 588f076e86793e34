"""G-code: its meaning, and rejected codes with their line numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdpr_rt.motion.gcode import GcodeSettings, arc_by_radius, read_gcode
from cdpr_rt.motion.path_description import Coordinates, PathDescription, PathError
from cdpr_rt.motion.path_nodes import nodes_of, pieces_of

ROOM = Coordinates(("x", "y", "z", "rx", "ry", "rz"), np.array([0.0, 0.1, 1.4, 0.0, 0.0, 0.0]))
PLANE = Coordinates(("x", "y"), np.array([0.0, 1.4]))


def read(*lines: str, origin=(0.0, 0.0, 0.0), where=ROOM, ignored=(), **others) -> PathDescription:
    wanted = GcodeSettings(np.array(origin[: where.positions]), 1e-3, frozenset(ignored), **others)
    return read_gcode("\n".join([*lines, ""]), "part.nc", where, wanted)


def ends_mm(path: PathDescription) -> list[list[float]]:
    return [[round(1e3 * x, 6) for x in move.end[:3]] for move in path.moves]


def test_units_and_distance_modes_apply_to_the_lines_after_them():
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


def test_a_file_that_begins_with_a_relative_move_starts_at_its_zero():
    path = read("G91", "G1 X10 F600", "X0 Y5", "M2", where=PLANE, origin=(0.1, 0.2))
    np.testing.assert_allclose(path.start[:2], [0.1, 0.2])
    np.testing.assert_allclose([move.end[:2] for move in path.moves], [[0.11, 0.2], [0.11, 0.205]])
    assert path.notices == ["line 2: a relative move comes first; the path begins at X0 Y0"]


def test_the_path_begins_after_all_coordinates_were_named():
    path = read("G0 Z50", "G0 X1 Y2", "G1 X5 F100", "M30", origin=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(path.start[:3], [0.101, 0.202, 0.35])
    assert len(path.moves) == 1
    with pytest.raises(PathError, match=r"part.nc:3: Y is never given; .* G0 Y0"):
        read("G0 X1 Z2", "X5", "M2")


def test_g53_moves_in_room_coordinates_and_g28_to_the_reference():
    path = read(
        "G0 X0 Y0 Z0", "G53 X300 Y0 Z1500", "X5", "G28 Z100", "G28", "M2", origin=(0.1, 0.1, 1.0)
    )
    assert ends_mm(path) == [[300, 0, 1500], [105, 0, 1500], [105, 0, 1100], [105, 0, 1400],
                             [0, 100, 1400]]  # fmt: skip


def test_the_feed_of_a_pure_rotation_is_in_degrees_per_minute():
    path = read("G0 X0 Y0 Z0", "G1 A9 F600", "X10", "M2")
    np.testing.assert_allclose(path.moves[0].speed, math.radians(10.0))
    np.testing.assert_allclose(path.moves[0].end[3], math.radians(9.0))
    np.testing.assert_allclose(path.moves[1].speed, 0.01)


def test_g61_and_g64_set_the_corner_radius():
    path = read("G0 X0 Y0 Z0", "G1 X1 F60", "G64 P2.5", "X2", "G61", "X3", "G64", "X4", "M2")
    assert [move.blend_m for move in path.moves] == [1e-3, 2.5e-3, 0.0, 1e-3]


@settings(max_examples=60)
@given(
    st.floats(-math.pi, math.pi), st.floats(0.05, 2 * math.pi - 0.05), st.booleans(),
    st.floats(1.0, 400.0),
)  # fmt: skip
def test_centre_and_radius_define_the_same_arc(begin, turn, clockwise, radius):
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
    np.testing.assert_allclose(by_centre.centre_m[:2], 1e-3 * centre, atol=2e-6)
    np.testing.assert_allclose(by_centre.angle_rad, sign * turn, atol=1e-5)
    if abs(turn - math.pi) > 0.1:
        r = radius if turn < math.pi else -radius
        by_radius = read(*head, f"{to} R{r:.9f}", "M2").moves[0].arc
        assert by_radius is not None
        np.testing.assert_allclose(by_radius.angle_rad, sign * turn, atol=1e-4)


def test_a_full_circle_and_a_helix_have_their_angle_and_length():
    path = read("G0 X10 Y0 Z0", "F600", "G2 X10 Y0 I-10 J0", "G3 X-10 Z5 I-10", "M2")
    pieces = pieces_of(path, np.array([1, 1, 1, 0.3, 0.3, 0.3]))
    np.testing.assert_allclose(pieces.angle_rad, [-2 * math.pi, math.pi])
    np.testing.assert_allclose(
        pieces.length, [0.02 * math.pi, math.hypot(0.01 * math.pi, 5e-3)], rtol=1e-6
    )


@pytest.mark.parametrize(
    ("lines", "where", "told"),
    [
        (["G0 X0 Y0 Z0", "G41 D1"], ROOM, r":2: G41: tool radius compensation .* not supported"),
        (["G0 X0 Y0 Z0", "M428"], ROOM, r":2: M428: is not supported; .* --ignore M428 skips"),
        (["G0 X0 Y0 Z0", "G38.2 Z-5"], ROOM, r":2: G38.2: is not supported$"),
        (["G0 X0 Y0 Z0", "G1 X5"], ROOM, r":2: G1 without a feed"),
        (["G0 X0 Y0 Z0", "G1 X#1"], ROOM, r":2: parameters and expressions"),
        (["G0 X0 Y0 Z0", "o<drill> sub"], ROOM, r":2: O-words"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5 I1 J0"], ROOM, r":3: G2: its ends are 1.0000 mm"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5 R1"], ROOM, r":3: G2: R1 mm: its ends are 5 mm apart"),
        (["G0 X0 Y0 Z0", "F60", "G2 X5"], ROOM, r":3: G2: allowed: either I and J, or R"),
        (["G0 X0 Y0 Z0", "F60", "G18 G2 X5 I2.5 J1"], ROOM, r":3: J: has no meaning in .* G18"),
        (["G0 X0 Y0 Z0", "G0 X1 I5"], ROOM, r":2: I: has no meaning with G0; remove it, or give"),
        (["G0 X0 Y0 Z0", "M97 P100"], ROOM, r":2: M97: subprograms are not supported$"),
        (["G0 X0 Y0 Z0", "M206 X5"], ROOM, r":2: M206: is not supported$"),
        (["G0 X0 Y0 Z0", "$J=G91 X5 F60"], ROOM, r":2: \$J=.*: a command to a controller.*remove"),
        (["G0 X0 Y0 Z0", "G29 X5"], ROOM, r":2: G29: allowed only for printers, without axes"),
        (["G0 X0 Y0 Z0", "START_PRINT T=1"], ROOM, r":2: START_PRINT: a macro.*--ignore START_PRI"),
        (["G0 X0 Y0 Z0", "G0 G1 X5"], ROOM, r":2: G0 G1: write only one"),
        (["G90 G91", "G0 X0 Y0 Z0"], ROOM, r":1: G90 G91: write only one"),
        (["G0 X0 Y0 Z0", "X1 X2"], ROOM, r":2: X occurs twice"),
        (["G0 X0 Y0 Z0", "X1 Yes"], ROOM, r":2: 'Yes': allowed: words"),
        (["G0 X0 Y0 Z0", "X1e2"], ROOM, r":2: X1e2: a number must have no exponent"),
        (["G0 X0 Y0 Z0", "G4 X2"], ROOM, r":2: G4: give P or S, and no axes without G0"),
        (["G0 X0 Y0 Z0", "G80", "X5"], ROOM, r":3: .* without a motion after G80"),
        (["G0 X0 Y0 Z0", "F60 G93", "G1 X5"], ROOM, r":3: G1 without a feed; .* in the same line"),
        (["G0 X0 Y0 Z0", "G55 X5"], ROOM, r":2: G55: its zero is unknown; give --origin"),
        (["G0 X0 Y0 Z0", "G10 L20 P1 X5"], ROOM, r":2: G10: moves the zero within the path"),
        (["G0 X0 Y0 Z0 F60", "G83 Z-1 R1 Q.00000000000001"], ROOM, r":2: .* Q of 0.01 or more"),
        (
            ["G0 X0 Y0 Z0 F60", "G83 Z-1 R1" + "0" * 30 + " Q1"],
            ROOM,
            r":2: R: the number is too large",
        ),
        (["G0 X0 Y0 Z0 F60", "G1 X1", "M48 X5 Y5"], ROOM, r":3: M48: X cannot be in its line"),
        (["G0 X0 Y0 Z0 F60", "G90.1 G2 X5 I2"], ROOM, r":2: G2: after G90.1 both I and J"),
        (["G0 X0 Y0 Z0", "M104 S200 G1 X5"], ROOM, r":2: M104 and G1 are on one line"),
        (["G0 X0 Y0 Z0", "M220 S50"], ROOM, r":2: M220: is not supported"),
        (["G0 X0 Y0 Z0", "(" * 5000], ROOM, r":2: the line is longer than 4096 characters"),
        (["G0 X0 Y0 Z0", "(open"], ROOM, r":2: a comment is not closed"),
        (["G91 X5"], ROOM, r":2: Z is never given"),
        (["G0 X0 Y0", "Z5"], PLANE, r":2: Z: the robot has no such axis; --ignore Z drops it"),
        (["G0 X0 Y0", "G18"], PLANE, r":2: G18: the robot moves in a plane; use G17"),
        (["G0 X0 Y0 Z0", "G4 P-1"], ROOM, r":2: G4: allowed"),
        (["G0 X0 Y0"], ROOM, r"Z is never given; .*: give the height with --z"),
    ],
)
def test_unsupported_codes_are_rejected(lines, where, told):
    with pytest.raises(PathError, match=told):
        read(*lines, "M2", where=where)


def test_a_dwell_may_precede_the_motion_of_its_line():
    path = read("G0 X0 Y0 Z0", "G4 P.5 G0 X1", "M2")
    assert [move.dwell_s for move in path.moves] == [0.5, 0.0]
    assert path.moves[1].end[0] - path.start[0] == pytest.approx(0.001)


def test_a_feed_of_zero_is_allowed_for_rapid_moves_only():
    path = read("G0 F0.000 X0 Y0 Z0", "G1 X5 F600", "G0 F0.000 X6", "M2")
    assert len(path.moves) == 2
    with pytest.raises(PathError, match=":2: G1 without a feed; allowed: F above 0 before it"):
        read("G0 F0 X0 Y0 Z0", "G1 X5", "M2")


def test_an_output_that_shares_its_line_with_a_motion_is_ignored_with_its_value():
    path = read("G0 X0 Y0 Z0 F600", "G1 X5 M67 E2 Q25", "G1 X6 M62 P1", "M2")
    assert len(path.moves) == 2
    assert path.notices == [
        "ignored: M67 (line 2), E (line 2), Q (line 2), M62 (line 3), P (line 3)"
    ]
    with pytest.raises(PathError, match=":2: Q: has no meaning with G1"):
        read("G0 X0 Y0 Z0 F600", "G1 X5 M67 E2 Q25 Q1", "M2")


ROTARY = ("G21 G90 G94", "G0 Z5 A0", "G0 X0", "G1 Z-1 F200", "G1 X10 A90", "X20 A180", "M5", "M2")


def test_a_file_for_a_rotary_axis_is_rejected_with_the_advice_to_make_it_flat():
    with pytest.raises(PathError) as caught:
        read(*ROTARY)
    assert "part.nc:8: Y is never given, and A turns the workpiece" in str(caught.value)
    assert "make a flat path" in str(caught.value)
    assert "if A turns the platform, begin with a position, such as G0 Y0" in str(caught.value)


def test_a_robot_without_rotation_rejects_a_rotary_file_with_all_reasons_but_not_to_ignore_it():
    with pytest.raises(PathError) as caught:
        read(*ROTARY, where=PLANE)
    text = str(caught.value)
    assert [line.split(":")[1] for line in text.split("\n")] == ["2", "8"]
    assert "2: Z: the robot has no such axis" in text
    assert "Y is never given" in text
    assert "--ignore A" not in text
    assert "turns the platform" not in text


def test_a_coordinate_that_only_a_rejected_line_contains_is_not_reported_as_missing():
    with pytest.raises(PathError) as caught:
        read("G0 X0 Z1", "G41 Y5 #1=3", "G1 X5 F60", "M2")
    assert "never given" not in str(caught.value)


def test_all_problems_are_reported_together_by_line():
    with pytest.raises(PathError) as caught:
        read(
            "G0 X0 Y0 Z0", "G41 G5 G21 X1 U3", "M98 P5", "#1=5", "G1 X5 F60", "#2=#1", "X1e3", "M2"
        )
    lines = str(caught.value).split("\n")
    assert [line.split(": ")[0] for line in lines] == [f"part.nc:{i}" for i in (2, 2, 2, 3, 4, 7)]
    assert [line.split(": ")[1] for line in lines[:3]] == ["G41", "G5", "U"]
    assert lines[4].endswith("(2 lines)")
    assert "leave" not in str(caught.value)


def test_the_report_of_many_problems_is_short():
    with pytest.raises(PathError) as caught:
        read("G0 X0 Y0 Z0", *(f"X1e{i}" for i in range(5000)), "M2")
    assert len(str(caught.value)) < 4000
    assert "and 4980 more problems" in str(caught.value)


def test_words_of_tools_and_printers_are_ignored_with_one_notice():
    path = read(
        "G21 G90 G94 G91.1", "M104 S200", "M201 X500 Y500 Z100 E5000", "M203 X150 Y60 Z10",
        "M84 X Y E", "M117 Printing G1 X99", "G10 L2 P1 X5 Y5 Z5", "N5 T1 M6*71", "G0 X0 Y0 Z0",
        "G92 E0", "G43 H1 Z20", "S5000 M3 M8", "G1 X5 F600 E1.5", "G2 X15 I5 J0 K0", "G98 M1",
        "/G1 X20", "M5 M9", "M30",
    )  # fmt: skip
    assert ends_mm(path) == [[0, 0, 20], [5, 0, 20], [15, 0, 20], [20, 0, 20]]
    (notice,) = path.notices
    for name in ("M201", "M203", "M117", "G10", "T (", "M6", "S (", "E (", "G43", "H", "/", "M1 "):
        assert name in notice


def test_heads_of_senders_and_slicers_are_ignored():
    path = read(
        "$H", "$32=1", "G29", "M862.3 P \"MK3S\"", "M555 X85 Y85 W85 H85", "G0 X0 Y0 Z0", "G11",
        "M62 P0", "M67 E0 Q20", "G1 X5 F600", "M63 P0", "M30",
    )  # fmt: skip
    assert ends_mm(path) == [[5, 0, 0]]
    (notice,) = path.notices
    for name in ("$H", "settings of grbl", "G29", "G11", "M862", "M555", "M62", "M67"):
        assert name in notice


def test_the_end_of_a_cycle_may_share_a_line_with_a_motion():
    path = read("G00 G71 G17 G90 G40 G49 G80", "X0 Y0 Z10", "F600 G81 X5 Z-1 R2", "G80 G1 X9", "M2")
    assert ends_mm(path)[-2:] == [[5, 0, 10], [9, 0, 10]]


def test_chips_are_broken_without_leaving_the_hole():
    path = read("G0 X0 Y0 Z5 F600", "G73 X0 Y0 Z-2 R1 Q2", "M2")
    heights = [end[2] for end in ends_mm(path)]
    assert heights == pytest.approx([1, -1, -0.746, -2, 5])


def test_ignoring_a_code_or_macro_skips_its_whole_line():
    path = read("G0 X0 Y0 Z0", "M777 X150 Y60 Z10", "G0 X5", "M2", ignored={"M777"})
    assert ends_mm(path) == [[5, 0, 0]]
    path = read("G0 X0 Y0 Z0", "Start_Print Z=10", "G0 X5", "M2", ignored={"START_PRINT"})
    assert ends_mm(path) == [[5, 0, 0]]
    with pytest.raises(PathError, match=r":2: M777 and G1 are on one line; split it"):
        read("G0 X0 Y0 Z0", "M777 G1 X5", "M2", ignored={"M777"})


@pytest.mark.parametrize("name", ["G92", "G90.1", "G18", "G93", "G1", "X", "F", "I", "M2", "M98"])
def test_modal_codes_cannot_be_ignored(name):
    with pytest.raises(PathError, match=f"--ignore {name}: .* depend"):
        read("G0 X0 Y0 Z0", "X5", "M2", ignored={name})


def test_an_axis_that_the_robot_lacks_may_be_ignored():
    path = read("G0 X0 Y0 Z5", "G1 X5 Z-1 F60", "M2", where=PLANE, ignored={"Z"})
    assert ends_mm(path) == [[5, 0]]


def test_a_feed_is_in_the_units_that_apply_in_its_line():
    path = read("G20 G90 F60", "G21", "G0 X0 Y0 Z0", "G1 X50", "G20 F30 X3", "M2")
    np.testing.assert_allclose([move.speed for move in path.moves], [0.0254, 0.0127])


def test_inverse_time_gives_the_duration_of_each_move():
    path = read("G0 X0 Y0 Z0", "G93 G1 X30 F6", "G3 X30 I-10 F2", "M2")
    np.testing.assert_allclose([move.speed for move in path.moves], [3e-3, 0.02 * math.pi / 30.0])


def test_waits_before_the_first_position_are_at_the_beginning_of_the_path():
    path = read("G0 Z50", "M0 (clamp it)", "G4 P2", "G0 X0 Y0", "G1 X50 F3000", "M2")
    nodes = nodes_of(path, np.ones(6))
    assert nodes.runs[0].tolist() == [0, 0]
    assert (nodes.dwell_s[0], bool(nodes.waits[0])) == (2.0, True)
    assert nodes.waits.sum() == 1


def test_dwells_are_in_s_or_ms_and_long_ones_give_a_notice():
    lines = ["G0 X0 Y0 Z0", "G4 P500", "X5", "G4 S2", "M2"]
    path = read(*lines)
    assert [move.dwell_s for move in path.moves] == [500.0, 0.0, 2.0]
    assert path.notices == ["line 2: a dwell of 500 s; --dwell ms reads P in ms"]
    path = read("G0 X0 Y0 Z0", "G4 S2", *["G4 P11"] * 2000, "X5", "M2")
    assert path.notices == ["line 3: a dwell of 11 s (first of 2000); --dwell ms reads P in ms"]
    path = read(*lines, dwell_unit_s=1e-3)
    assert [move.dwell_s for move in path.moves] == [0.5, 0.0, 2.0]
    assert not path.notices


def test_coordinate_systems_have_separate_zeros():
    zeros = {"G55": np.array([1.0, 0.0, 0.0])}
    path = read("G0 X0 Y0 Z0", "G55 X10", "G92 X0", "X5", "G92.1", "G54 X7", "M2", origins_m=zeros)
    assert ends_mm(path) == [[1010, 0, 0], [1015, 0, 0], [7, 0, 0]]


def test_an_offset_before_the_first_move_sets_where_the_path_begins():
    path = read("G92 X10 Y0 Z0", "G1 X20 F60", "M2", origin=(0.1, 0.0, 0.0))
    np.testing.assert_allclose(path.start[:3], [0.11, 0.0, 0.0])
    assert ends_mm(path) == [[120, 0, 0]]


def test_relative_reference_moves_in_a_programs_head_are_followed():
    path = read("G28 G91 Z0", "G90", "G28 X Y", "G0 X5 Y0", "Z10", "M30", origin=(0.1, 0.1, 1.0))
    np.testing.assert_allclose(path.start[:3], [0.0, 0.1, 1.4])
    assert ends_mm(path) == [[105, 100, 1400], [105, 100, 1010]]


def test_a_file_without_z_takes_its_height_from_the_settings():
    path = read("G0 X0 Y0", "X5", "M2", z_m=0.02, origin=(0.0, 0.0, 1.0))
    assert ends_mm(path) == [[5, 0, 1020]]
    with pytest.raises(PathError, match=r":1: Z: --z is only for files without Z \(2 lines\)"):
        read("G0 X0 Y0 Z5", "Z6", "M2", z_m=0.02)


def test_placement_rotates_and_mirrors_rotation_vectors():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    path = read("G0 X0 Y0 Z0", "X10 A5", "M2", placement=2.0 * turn)
    np.testing.assert_allclose(path.moves[0].end, [0, 0.02, 0, 0, math.radians(5), 0], atol=1e-12)
    angle = math.radians(5.0)
    for letter, rotation in (("A", [angle, 0, 0]), ("C", [0, 0, -angle])):
        path = read("G0 X0 Y0 Z0", f"X10 {letter}5", "M2", placement=np.diag([-1.0, 1.0, 1.0]))
        np.testing.assert_allclose(path.moves[0].end, [-0.01, 0, 0, *rotation], atol=1e-12)


def test_a_program_for_five_axes_is_rejected_and_one_rotary_axis_is_noted():
    with pytest.raises(PathError, match=r":2: A C: machines differ in the order .* \(3 lines\)"):
        read("G0 X0 Y0 Z0", "X10 A5 C5", "C6", "A0", "X20", "M2")
    with pytest.raises(PathError, match=r"part.nc:3: A B: "):
        read("G0 X0 Y0 Z0 A5", "X10", "A0 B5", "M2")
    path = read("G0 X0 Y0 Z0", "A5", "A0", "B5", "M2")
    assert path.notices == [
        "A B: turns the platform from home, about X, Y or Z of the file; it is not a rotary table"
    ]


def test_a_rotation_about_a_room_axis_keeps_its_axis_in_a_rotated_file():
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    path = read("G0 X0 Y0 Z0", "G53 G0 A5", "M2", placement=turn)
    np.testing.assert_allclose(path.moves[-1].end[3:], [math.radians(5.0), 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("to", "turn_deg"),
    [
        ("X10.0004 Y0", 360.0),  # rounded ends of a whole circle
        ("X10.0004 Y-0.0001", 359.999),
        ("X10.0005 Y-0.01", 359.885),
        ("X9.9995 Y0.01", 0.115),
    ],
)
def test_rounding_of_an_arcs_end_does_not_move_the_arc(to, turn_deg):
    path = read("G61", "G0 X10 Y0 Z0", f"G3 {to} I-5 J0 F600", "M2")
    assert path.moves[0].arc is not None
    np.testing.assert_allclose(np.degrees(path.moves[0].arc.angle_rad), turn_deg, atol=2e-3)
    nodes = nodes_of(path, np.ones(6))
    for share in (0.0, 0.3, 0.7):
        radius = np.linalg.norm(nodes.between(share)[:, :2] - [5e-3, 0.0], axis=1)
        np.testing.assert_allclose(radius, 5e-3, atol=1e-6)
    np.testing.assert_allclose(nodes.q[-1], path.moves[0].end, atol=1e-12)


def test_a_rejected_arc_names_the_other_kind_of_centre_if_that_fits():
    lines = ("G0 X-40 Y50 Z0", "{} G3 X-30 Y40 I{} J{} F60", "M2")
    for code, i, j, hint in (("G91.1", -40, 40, "G90.1"), ("G90.1", 0, -10, "G91.1")):
        with pytest.raises(PathError, match=rf"centre fits only as .*: add {hint}$"):
            read(*(line.format(code, i, j) for line in lines))
    with pytest.raises(PathError, match=r"equal distances$"):
        read(*(line.format("G91.1", 3, 3) for line in lines))


def test_a_number_of_an_output_belongs_to_its_code():
    assert ends_mm(read("G0 X0 Y0 Z0", "M11P1", "X5", "M10 P1", "M2")) == [[5, 0, 0]]
    assert read("G0 X0 Y0 Z0", "X5", "M11 G4 P2", "M2").moves[1].dwell_s == 2.0


def test_line_ends_spaces_comments_and_byte_order_mark_do_not_matter():
    lines = ["G21 G90", "G0X0Y0Z0", "G1X5F60", "X+0.5"]
    wanted = GcodeSettings(np.zeros(3))
    for text in (
        "\ufeff" + "\n".join(lines),
        "\r".join(lines),
        "(T1; D=6 (x))\r\n" + "\r\n".join(lines),
    ):
        path = read_gcode(text, "part.nc", ROOM, wanted)
        assert ends_mm(path) == [[5, 0, 0], [0.5, 0, 0]]
        assert path.notices == ["the file ends without M2 or M30: is it complete?"]


@settings(max_examples=150)
@example("*71")
@given(st.text(alphabet="GMXYZABCFIJKLPQRSE0123456789.-+ %/#*();\n", max_size=120))
def test_any_text_is_read_or_rejected_with_a_path_error(text):
    try:
        read(text)
    except PathError as error:
        assert str(error).startswith("part.nc:")


def test_an_arc_with_an_excessive_radius_is_rejected() -> None:
    with pytest.raises(ValueError, match=r"allowed: up to 1e\+06 mm"):
        arc_by_radius(np.zeros(2), np.ones(2), 1e200, True)
