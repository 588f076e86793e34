"""A platform in space: values of its file, errors of the plant, and cables over pulleys."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.sim_bus.robot.body_lab import body, energy_J, run

EXITS_m = [(x, y, z) for z in (0.0, 3.0) for x in (-2.5, 2.5) for y in (-2.0, 2.0)]
ANCHORS_m = [(x, y, z) for z in (0.3, -0.3) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
INERTIA = (0.30, 0.35, 0.09, 0.01, -0.02, 0.005)


def robot_in_space(**changes: Any) -> CableRobot:
    given: dict[str, Any] = {"mass_kg": 10.0, "home": (0.1, -0.2, 1.4), **changes}
    return body(exits=EXITS_m, anchors=ANCHORS_m, **given)


def test_the_simulated_body_has_the_values_of_the_robots_file() -> None:
    vector, com = (0.1, -0.3, 0.4), (0.01, -0.02, 0.05)
    shape = {"inertia_kg_m2": INERTIA, "centre_of_mass_m": com, "home_rotation_rad": vector}
    robot = robot_in_space(shape=shape)
    p = robot.platform[0]
    turned = Rotation.from_rotvec(vector)
    assert np.allclose(robot.rotation, turned.as_matrix(), atol=1e-12)
    assert np.allclose(robot.position_m, (0.1, -0.2, 1.4), atol=1e-12)
    assert np.allclose(p["position"], robot.position_m + turned.apply(com), atol=1e-12)
    assert np.allclose(np.diag(p["inertia"]), INERTIA[:3])
    assert (p["inertia"][0, 1], p["inertia"][0, 2], p["inertia"][1, 2]) == INERTIA[3:]
    for i in range(robot.n):
        anchor = robot.position_m + turned.apply(ANCHORS_m[i])
        assert robot.distance_m(i) == pytest.approx(float(np.linalg.norm(anchor - EXITS_m[i])))


def test_errors_of_the_plant_are_added_to_the_values_of_the_file() -> None:
    shape = {"inertia_kg_m2": INERTIA, "home_rotation_rad": (0.0, 0.0, 0.5)}
    other = {"mass_error": 0.1, "centre_of_mass_m": (0.0, 0.0, 0.02)}
    start = {"position_m": (0.0, 0.0, 1.5), "rotation_deg": (0.0, 20.0, 0.0)}
    robot = robot_in_space(shape=shape, platform=other, start=start)
    p = robot.platform[0]
    turned = Rotation.from_euler("y", 20.0, degrees=True)
    assert np.allclose(robot.rotation, turned.as_matrix(), atol=1e-12)
    assert np.allclose(robot.position_m, (0.0, 0.0, 1.5), atol=1e-12)
    assert np.allclose(p["position"] - robot.position_m, turned.apply((0.0, 0.0, 0.02)))
    assert p["mass"] == pytest.approx(11.0)
    assert np.allclose(np.diag(p["inertia"]), 1.1 * np.array(INERTIA[:3]))
    rod = robot_in_space(shape=shape, platform={"radius_of_gyration_m": 0.2}).platform[0]
    assert np.allclose(rod["inertia"], 10.0 * 0.2**2 * np.eye(3))


def test_a_planar_body_has_one_angle_and_one_inertia() -> None:
    robot = body(shape={"home_rotation_rad": (0.3,), "inertia_kg_m2": (0.02,)})
    assert np.allclose(robot.rotation, Rotation.from_euler("z", 0.3).as_matrix())
    assert robot.platform[0]["inertia"][2, 2] == 0.02
    robot = body(shape={"home_rotation_rad": (0.3,)}, start={"angle_deg": 0.0})
    assert np.allclose(robot.rotation, np.eye(3))


@pytest.mark.parametrize(
    ("start", "size", "reason"),
    [
        ({"angle_deg": 3.0}, 3, "start.angle_deg: allowed only in a plane"),
        ({"rotation_deg": (0.0, 0.0, 3.0)}, 2, "start.rotation_deg: allowed only in space"),
    ],
)
def test_a_spatial_angle_in_a_plane_or_vice_versa_is_rejected(
    start: dict[str, Any], size: int, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        RobotPlant.model_validate({"start": start}).require_fit(8, size)


def over_a_pulley(
    exit_m: np.ndarray, axis: np.ndarray, radius_m: float, anchor_m: np.ndarray
) -> float:
    """Return the cable length from its entry at the pulley to the anchor, by the tangent point."""
    way = anchor_m - exit_m
    along = float(way @ axis)
    aside = way - along * axis
    out = aside / np.linalg.norm(aside)
    middle = exit_m + radius_m * out

    def leaves_at(angle: float) -> np.ndarray:
        rim = -math.cos(angle) * out + math.sin(angle) * axis
        return np.asarray(middle + radius_m * rim)

    def misses(angle: float) -> float:
        ahead = math.sin(angle) * out + math.cos(angle) * axis
        rest = anchor_m - leaves_at(angle)
        across = rest - (rest @ ahead) * ahead
        side = -math.cos(angle) * out + math.sin(angle) * axis
        return float(across @ side)

    angles = np.linspace(-0.5 * math.pi, 1.5 * math.pi, 400)
    found = []
    for low, high in itertools.pairwise(angles):
        if misses(low) * misses(high) <= 0.0:
            angle = brentq(misses, low, high, xtol=1e-14)
            ahead = math.sin(angle) * out + math.cos(angle) * axis
            rest = anchor_m - leaves_at(angle)
            if rest @ ahead >= 0.0:  # towards the anchor, not away from it
                found.append(radius_m * angle + float(np.linalg.norm(rest)))
    return found[0]


PULLEYS = {
    "pulley_radii_m": [0.05] * 8,
    "pulley_axes": [(0.0, 0.0, 1.0)] * 4 + [(0.6, 0.0, 0.8)] * 4,
}


def moved(robot: CableRobot, position_m: tuple[float, ...], vector: tuple[float, ...]) -> None:
    p = robot.platform[0]
    p["rotation"] = Rotation.from_rotvec(vector).as_matrix()
    p["position"] = np.array(position_m) + p["rotation"] @ p["com"]


_coordinate = st.floats(-0.8, 0.8)


@settings(max_examples=40)
@given(
    st.tuples(_coordinate, _coordinate, st.floats(0.8, 2.0)),
    st.tuples(_coordinate, _coordinate, _coordinate),
)
def test_length_over_a_pulley_is_arc_plus_free_cable(
    position_m: tuple[float, ...], vector: tuple[float, ...]
) -> None:
    robot = robot_in_space(shape=PULLEYS)
    moved(robot, position_m, vector)
    for i in range(8):
        anchor = robot.position_m + robot.rotation @ ANCHORS_m[i]
        axis = np.array(PULLEYS["pulley_axes"][i])
        expected = over_a_pulley(np.array(EXITS_m[i]), axis, 0.05, anchor)
        assert robot.distance_m(i) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=25)
@given(
    st.tuples(_coordinate, _coordinate, st.floats(0.8, 2.0)),
    st.tuples(_coordinate, _coordinate, _coordinate),
)
def test_a_cable_pulls_along_the_gradient_of_its_length(
    position_m: tuple[float, ...], vector: tuple[float, ...]
) -> None:
    robot = robot_in_space(shape=PULLEYS)
    moved(robot, position_m, vector)
    robot.distance_m(0)
    ways = robot.platform[0]["way"][:8].copy()
    for k in range(3):
        lengths = []
        for step in (-1e-6, 1e-6):
            there = np.array(position_m)
            there[k] += step
            moved(robot, tuple(there), vector)
            lengths.append([robot.distance_m(i) for i in range(8)])
        slope = (np.array(lengths[1]) - lengths[0]) / 2e-6
        assert np.allclose(slope, -ways[:, k], atol=1e-6)


def test_pulleys_create_no_energy() -> None:
    robot = robot_in_space(shape={**PULLEYS, "inertia_kg_m2": INERTIA}, locked=True)
    p = robot.platform[0]
    p["velocity"], p["spin"] = (0.3, -0.2, 0.1), (0.3, 0.5, -1.0)
    spin = p["rotation"].T @ p["spin"]
    moving = 5.0 * float(p["velocity"] @ p["velocity"]) + 0.5 * float(spin @ p["inertia"] @ spin)
    begin = energy_J(robot)
    for k in range(300):
        run(robot, 1e-3, begin_s=k * 1e-3)
        assert abs(energy_J(robot) - begin) < 0.05 * moving
    assert float(np.linalg.norm(robot.position_m - (0.1, -0.2, 1.4))) > 1e-3


def test_a_planar_cable_leaves_its_pulley_on_the_side_of_the_platform() -> None:
    radii = {"pulley_radii_m": [0.1, 0.1, 0.0]}
    points, pulleys = body(), body(shape=radii)
    for i, x in enumerate((-2.0, 2.0)):
        exit_m = np.array((x, 3.0, 0.0))
        anchor = points.position_m + np.pad(np.array(points.platform[0]["anchor"][i][:2]), (0, 1))
        expected = over_a_pulley(exit_m, np.array((0.0, 1.0, 0.0)), 0.1, anchor)
        assert pulleys.distance_m(i) == pytest.approx(expected, abs=1e-9)
        assert pulleys.distance_m(i) > points.distance_m(i)
    assert pulleys.distance_m(2) == points.distance_m(2)
