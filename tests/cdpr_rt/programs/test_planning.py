"""Planning a path for a robot: unreachable places, wrong units, and limits of tensions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_profiles import load_robot
from cdpr_rt.model.path_wrenches import InertialWrenches, available_wrenches
from cdpr_rt.motion.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path_description import Move, PathDescription, PathError
from cdpr_rt.programs.path_planning import LONGEST_s, PathPlanner, path_tensions


@pytest.fixture(scope="module")
def planner() -> PathPlanner:
    return PathPlanner(load_robot("spatial-8"))


@pytest.fixture(scope="module")
def plane() -> PathPlanner:
    return PathPlanner(load_robot("planar-3"))


def gcode(planner: PathPlanner, *lines: str) -> PathDescription:
    platform = planner.platform
    origin = 0.5 * np.add(platform.workspace_min_m, platform.workspace_max_m)
    text = "\n".join([*lines, "M2", ""])
    return read_gcode(text, "part.nc", planner.coordinates, GcodeSettings(origin, 2e-3))


@pytest.mark.long
def test_tensions_along_a_planned_path_stay_within_their_bounds(planner):
    plan = planner.plan(gcode(planner, "G0 X0 Y0 Z0", "X200 Z50", "Y-200 A5", "G1 X0 F6000"))
    assert plan.obstacle is None and plan.timed is not None
    told = path_tensions(planner.model, plan.timed)
    assert told.carried.all()
    assert (told.tension_N >= told.low_N - 1e-6).all()
    assert (told.tension_N <= told.high_N + 1e-6).all()
    assert plan.constant_s > plan.timed.duration_s


@pytest.mark.parametrize(
    ("lines", "line", "told"),
    [
        (["G0 X0 Y0 Z0", "X100", "X900"], 3, "x .* is outside; allowed: -500 to 200 mm"),
        (["G0 X0 Y0 Z0", "A10", "A16"], 3, "turned by .* deg from .*; allowed: up to 15 deg"),
    ],
)
def test_the_first_place_outside_is_named(planner, lines, line, told):
    path = gcode(planner, *lines)
    if "X900" in lines:  # a size that no wrong unit explains
        path.moves[-1].end[0] = 0.21
    obstacle = planner.plan(path).obstacle
    assert obstacle is not None
    assert obstacle.line == line
    import re  # noqa: PLC0415

    assert re.search(told, obstacle.text)


def test_an_arc_that_leaves_the_box_between_two_nodes_is_named(planner):
    x, y = 100.0 * np.cos(0.195), 100.0 * np.sin(0.195)
    begin = f"G0 X{250.05 + x:.6f} Y{-y:.6f} Z0"  # its apex is 0.05 mm outside, its nodes are not
    plan = planner.plan(gcode(planner, begin, f"G3 Y{y:.6f} I{-x:.6f} J{y:.6f} F600"))
    assert plan.nodes.q[:, 0].max() < 0.2
    assert plan.obstacle is not None
    assert plan.obstacle.line == 2
    assert plan.obstacle.text.startswith("x 200.0")


@pytest.mark.parametrize(
    ("factor", "told"),
    [(25.4, "25.4 times too large"), (1000.0, "1000 times too large"),
     (1 / 25.4, "25.4 times too small"), (1e-3, "1000 times too small")],
)  # fmt: skip
def test_wrong_units_are_reported_with_their_factor(planner, factor, told):
    path = PathDescription("part.nc", planner.coordinates, np.array([0.0, 0.0, 1.45, 0, 0, 0]), 1)
    path.add(Move(2, np.array([0.1, 0.2, 1.7, 0, 0, 0]), np.inf))
    path.start[:3] *= factor
    path.moves[0].end[:3] *= factor
    with pytest.raises(PathError, match=told):
        planner.plan(path)


def test_room_coordinates_are_not_reported_as_wrong_units(planner):
    plan = planner.plan(gcode(planner, "G53 G0 Z0", "X0 Y9", "Z15"))
    assert plan.obstacle is not None
    assert plan.obstacle.text.startswith("z 0 mm is outside")


def test_a_place_that_no_tensions_hold_is_named(planner):
    from dataclasses import replace  # noqa: PLC0415

    weak = PathPlanner(load_robot("spatial-8"))
    weak.model = replace(weak.model, torque_limited_N=np.full(8, 70.0), reserve_N=12.0)
    path = gcode(weak, "G0 X0 Y0 Z0", "X300", "X300 Y450 Z170", "X-300 Y450")
    obstacle = weak.plan(path).obstacle
    assert obstacle is not None
    # searched every 5 mm by another method
    corners = np.zeros((len(path.moves) + 1, 6))
    corners[:] = [path.start, *(move.end for move in path.moves)]
    share = np.linspace(0.0, 1.0, 200)[:, None]
    places = np.concatenate([a + share * (b - a) for a, b in itertools.pairwise(corners)])
    margins = weak.model.workspace(0.0).margins(weak.model.poses(places))[0]
    first = int((margins < 0.0).argmax())
    assert obstacle.line == path.moves[first // 200].line
    assert np.linalg.norm(obstacle.position[:3] - places[first, :3]) < 0.025
    assert "N" in obstacle.text


def test_available_wrenches_equal_those_of_linear_programs(planner, plane):
    """Each facet is at the farthest wrench that tensions within bounds reach."""
    chance = np.random.default_rng(3)
    for one in (planner, plane):
        model = one.model
        low, high = np.array(one.platform.workspace_min_m), np.array(one.platform.workspace_max_m)
        place = np.zeros((3, model.size))
        place[:, : model.positions] = chance.uniform(low, high, (3, model.positions))
        found = available_wrenches(model, place)
        assert found.holds.all()
        still = model.workspace(0.0, 0.0)
        matrices, rest = still.wrench_matrices(model.poses(place)), still.wrenches[0]
        low_N, high_N = model.low_N + model.reserve_N, model.torque_limited_N - model.reserve_N
        bounds = list(zip(low_N, high_N, strict=True))
        for j, f in itertools.product(range(3), range(0, found.normals.shape[1], 9)):
            normal = found.normals[j, f]
            ends = [
                sign * linprog(sign * (normal @ matrices[j]), bounds=bounds).fun for sign in (1, -1)
            ]
            shift = float(normal @ rest)
            np.testing.assert_allclose(
                [found.lower[j, f], found.upper[j, f]], np.add(ends, shift), atol=1e-6
            )


def test_the_inertial_wrench_is_the_derivative_of_momentum(planner):
    """By finite differences of angular momenta and of the centre's motion."""
    from cdpr_rt.model.rigid_body import in_space, inertia_kg_m2  # noqa: PLC0415

    model = planner.model
    chance = np.random.default_rng(7)
    q, v, a = chance.uniform(-0.2, 0.2, (3, 1, 6))
    h = 1e-4
    inertia, mass = inertia_kg_m2(model.platform), model.platform.mass_kg
    centre_of = in_space(model.platform.centre_of_mass_m)
    poses = [model.poses(q + t * v + 0.5 * t * t * a)[0] for t in (-2 * h, -h, 0.0, h, 2 * h)]
    centres = [pose[0] + pose[1:] @ centre_of for pose in poses]

    def spin(i: int) -> np.ndarray:
        skew = (poses[i + 1][1:] - poses[i - 1][1:]) @ poses[i][1:].T / (2 * h)
        return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])

    momenta = [poses[i][1:] @ inertia @ poses[i][1:].T @ spin(i) for i in (1, 3)]
    wanted = np.concatenate(
        [
            mass * (centres[3] - 2 * centres[2] + centres[1]) / h**2,
            (momenta[1] - momenta[0]) / (2 * h),
        ]
    )
    found = InertialWrenches(model, q).of(v, a)[0]
    np.testing.assert_allclose(found, wanted, atol=2e-5 * max(1.0, np.abs(wanted).max()))


def test_contact_on_the_way_is_named():
    robot = load_robot("spatial-8")
    from dataclasses import replace  # noqa: PLC0415

    from cdpr_profiles.platform import BoxFile  # noqa: PLC0415

    assert robot.platform is not None
    box = BoxFile(min_m=(-0.1, 0.3, 1.3), max_m=(0.1, 0.5, 1.6))
    planner = PathPlanner(replace(robot, platform=replace(robot.platform, obstacles=(box,))))
    path = gcode(planner, "G0 X0 Y-200 Z150", "Y-100", "Z0", "Y250")
    obstacle = planner.plan(path).obstacle
    assert obstacle is not None
    assert "obstacle 1" in obstacle.text
    assert obstacle.line == 4


def test_a_path_of_a_planar_robot_is_planned_with_tensions(plane):
    plan = plane.plan(gcode(plane, "G0 X0 Y0", "X100", "F3000", "G3 X100 Y100 I0 J50"))
    assert plan.obstacle is None and plan.timed is not None
    assert path_tensions(plane.model, plan.timed).carried.all()


@pytest.mark.parametrize("lines", [["G1 X100 F0.05"], ["X50", "G4 P3600"]])
def test_a_move_longer_than_a_plan_is_rejected(planner, lines):
    with pytest.raises(
        PathError, match=r":[23]: takes .* min or more; divide it into parts of up to 16.7 min"
    ):
        planner.plan(gcode(planner, "G0 X0 Y0 Z0", *lines))


def test_a_long_path_is_split_into_plans_that_begin_and_end_at_rest(planner):
    lines = [f"G1 X{100 * (i % 2)} F600" for i in range(1, 200)]
    path = gcode(planner, "G0 X0 Y0 Z0", *lines, "X0 Z100")
    line, moves, rest = 0, 0, path.start
    while line is not None:
        plan = planner.plan(path, first_line=line)
        assert plan.timed is not None and plan.timed.duration_s <= LONGEST_s
        np.testing.assert_allclose(plan.timed.samples[0, 0], rest, atol=1e-9)
        assert not plan.timed.samples[[0, -1], 1:].any()
        rest, moves, line = plan.timed.samples[-1, 0], moves + len(plan.path.moves), plan.next_line
    assert moves == 200
    np.testing.assert_allclose(rest, path.moves[-1].end, atol=1e-9)


def test_later_plans_are_checked_before_the_first_one_runs(planner):
    lines = [f"G1 X{100 * (i % 2)} F600" for i in range(1, 150)]
    plan = planner.plan(gcode(planner, "G0 X0 Y0 Z0", *lines, "G0 Z190"))
    assert plan.timed is None and plan.obstacle is not None
    assert (plan.obstacle.line, plan.next_line) == (151, None)
    assert plan.obstacle.text.startswith("z 175")


def test_a_small_circle_is_checked_for_contact_from_node_to_node(planner, monkeypatch):
    ways = []
    monkeypatch.setattr(
        type(planner.model.interference), "first_contact", lambda _, way: ways.append(way)
    )
    planner.plan(gcode(planner, "G0 X0 Y0 Z0", "F600", "G2 X0 Y0 I4 J0"))
    (way,) = ways
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() < 0.5e-3
