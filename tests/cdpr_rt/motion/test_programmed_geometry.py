"""The motion follows the programmed geometry, also between nodes and samples.

The reference is the separate interpreter `rs274`.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from cdpr_rt.motion.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path_description import Coordinates
from cdpr_rt.motion.path_nodes import nodes_of
from cdpr_rt.motion.time_scaling import PathLimits, TimedPath, WrenchBounds, time_path
from tests.cdpr_rt.motion.rs274 import distances_mm, programmed_mm

ROOM = Coordinates(("x", "y", "z"), np.zeros(3))
EXACT_mm = 0.01
ORDINARY = PathLimits(np.full(3, 0.5), np.full(3, 1.0), np.full(3, 10.0))
FAST = PathLimits(np.full(3, 2.0), np.full(3, 20.0), np.full(3, 2000.0))


def commanded_mm(timed: TimedPath) -> np.ndarray:
    """Return set-points, also between the samples, (m, 3): quintic polynomials in time."""
    times = timed.period_s * np.arange(len(timed.samples))
    curve = BPoly.from_derivatives(times, timed.samples)
    return 1e3 * curve(np.linspace(0.0, times[-1], 8 * len(times)))


def off_mm(
    lines: list[str], limits: PathLimits = ORDINARY, blend_mm: float = 0.0
) -> tuple[float, float]:
    """Return the largest distance of set-points from the program, and of the program from them."""
    wanted = GcodeSettings(np.zeros(3), 1e-3 * blend_mm)
    path = read_gcode("\n".join([*lines, "M2", ""]), "part.nc", ROOM, wanted)
    nodes = nodes_of(path, np.ones(3))
    timed = time_path(nodes, limits, WrenchBounds.none(len(nodes.s), 3))
    places, points = commanded_mm(timed), programmed_mm(lines)
    off = distances_mm(places, points).max()
    # the planner's figure, which it computes at fewer places
    assert off <= 1.02e3 * (nodes.deviation_m + timed.departure_m) + 1e-3
    return off, distances_mm(points, places).max()


def tight_then(radius: float, wide: str) -> list[str]:
    return [
        "G21 G90 G17", "G0 X0 Y-5 Z0", "G1 Y0 F600", f"G2 X{radius} Y{radius} I{radius} J0", wide,
    ]  # fmt: skip


@pytest.mark.parametrize("limits", [ORDINARY, FAST], ids=["ordinary", "fast"])
@pytest.mark.parametrize("radius", [1.0, 0.2, 0.05])
@pytest.mark.parametrize("wide", ["arc", "line"])
@pytest.mark.parametrize("blend_mm", [0.0, 1.0])
def test_a_tight_arc_does_not_distort_what_follows_it(limits, radius, wide, blend_mm):
    end = "G2 X50 Y{:.6f} I0 J-10000" if wide == "arc" else "G1 X50"
    if wide == "arc":
        drop = 10000.0 - math.sqrt(10000.0**2 - (50.0 - radius) ** 2)
        end = end.format(radius - drop)
    off, back = off_mm(tight_then(radius, end), limits, blend_mm)
    assert max(off, back) < EXACT_mm


@settings(max_examples=20, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-2.0, 2.0), st.floats(0.3, 2.5), st.booleans()), min_size=2, max_size=5
    ),
    st.sampled_from([ORDINARY, FAST]),
)
def test_exact_mode_follows_tangent_arcs_of_any_radii(arcs, limits):
    """Radii from 0.01 to 100 mm, each arc tangent to the one before."""
    x, y, heading = 0.0, 0.0, 0.0
    lines = ["G21 G90 G17", "G0 X0 Y0 Z0", "G61", "F6000"]
    for decades, turn, clockwise in arcs:
        radius, sign = 10.0**decades, -1.0 if clockwise else 1.0
        i, j = -sign * radius * math.sin(heading), sign * radius * math.cos(heading)
        end = heading + sign * turn
        x, y = x + i + sign * radius * math.sin(end), y + j - sign * radius * math.cos(end)
        lines.append(f"G{2 if clockwise else 3} X{x:.9f} Y{y:.9f} I{i:.9f} J{j:.9f}")
        heading = end
    assert max(off_mm(lines, limits)) < EXACT_mm


@pytest.mark.parametrize("blend_mm", [0.5, 5.0])
def test_cut_corners_keep_their_tolerance_between_nodes(blend_mm):
    lines = ["G21 G90", "G0 X0 Y0 Z0", "F6000", "G1 X30", "Y30", "G3 X0 Y0 R40", "G1 X-0.3 Y20",
             "G2 X-0.7 R0.2", "G1 Y-10"]  # fmt: skip
    for limits in (ORDINARY, FAST):
        off, _ = off_mm(lines, limits, blend_mm)
        assert 0.02 < off <= blend_mm + EXACT_mm


PARTS = {
    "planes": ["G21 G90 F3000", "G0 X0 Y0 Z0", "G18 G2 X20 Z10 I10 K5", "G19 G3 Y30 Z-10 J15 K-10",
               "G17 G3 X0 Y0 R25", "G18 G3 X-10 Z-10 R-8", "G19 G2 Y20 R10"],
    "turns": ["G21 G90 F3000", "G0 X0 Y0 Z0", "G3 X0 Y0 I30 J0 Z20", "G2 X10 Y10 I0 J10 Z0 P3"],
    "offsets": ["G21 G90 F3000", "G0 X50 Y20 Z0", "G92 X0 Y0", "G1 X10", "G2 X20 Y0 I5 J0",
                "G91 G1 X5 Y5", "G90 G92 Z10", "X0 Y0 Z0"],
    "inch": ["G20 G91 F60", "G90 G0 X0 Y0 Z0", "G91 G1 X1 Y.5", "G3 X-1 Y0 I-.5 J0", "G90 G1 X0"],
    "drilling": ["G21 G90 F3000", "G0 X0 Y0 Z20", "G81 X10 Y0 Z-5 R2", "X20", "Y10",
                 "G83 X0 Y0 Z-10 R2 Q3", "G80", "G0 X5", "G91 G81 X5 Z-8 R-10 L3"],
}  # fmt: skip


@pytest.mark.parametrize("name", PARTS)
def test_the_motion_follows_the_path_of_the_other_interpreter(name):
    assert max(off_mm(PARTS[name])) < EXACT_mm


def test_a_placed_file_follows_the_transformed_path_of_the_other_interpreter():
    c, s = math.cos(0.5), math.sin(0.5)
    placement = 1.5 * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag([-1.0, 1.0, 1.0])
    lines = PARTS["planes"]
    wanted = GcodeSettings(np.array([0.1, 0.0, 0.2]), 0.0, placement=placement)
    path = read_gcode("\n".join([*lines, "M2", ""]), "part.nc", ROOM, wanted)
    nodes = nodes_of(path, np.ones(3))
    points = programmed_mm(lines) @ placement.T + [100.0, 0.0, 200.0]
    assert distances_mm(1e3 * nodes.q, points).max() < EXACT_mm
    assert distances_mm(points, 1e3 * nodes.q).max() < 0.1  # chords from node to node
