"""Predicted motion after a cable loss, and resonance of rotors, agree with known values."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_rt.diagnosis.predictions import (
    FRICTIONS,
    SWING_S,
    CableLoss,
    Loss,
    corner_swings,
    lowest_resonance_Hz,
)
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.model.platform_model import platform_model, platform_model_of
from cdpr_rt.model.statics import statics_of
from tests.cdpr_rt.diagnosis.robots import hung, with_cables
from tests.cdpr_rt.model.pulley import over_a_pulley
from tests.heavy_cables import G_m_s2, cables_on


def resonance_Hz(robot: Robot, position_m: tuple[float, ...]) -> float:
    platform = robot.platform
    assert platform is not None
    n = len(robot.axes)
    model = platform_model(platform, np.full(n, 20.0), np.full(n, 150.0))
    return float(lowest_resonance_Hz(model, robot.axes, np.array(position_m)))


@pytest.mark.parametrize("name", ["planar-3", "point-4", "suspended-6"])
def test_swings_are_predicted_for_all_corners_and_reach_the_ground(name: str) -> None:
    robot = load_robot(name)
    platform = robot.platform
    assert platform is not None
    size = len(platform.home_m)
    of_all = corner_swings(Subject(robot))
    assert [[swing.cable for swing in swings] for swings in of_all] == [
        [i] * 2**size for i in range(len(robot.axes))
    ]
    for swings in of_all:
        assert len({swing.position_m for swing in swings}) == 2**size
        for swing in swings:
            assert swing.swing_m <= swing.away_m and swing.aside_m <= swing.away_m
            assert swing.away_m > 0.9 * (swing.position_m[-1] - platform.home_m[-1])


def test_corners_that_are_not_targets_are_replaced_or_omitted() -> None:
    robot = load_robot("planar-3")
    assert robot.platform is not None
    high_m = (robot.platform.workspace_max_m[0], robot.platform.exit_points_m[0][1] - 0.1)
    larger = dataclasses.replace(
        robot, platform=dataclasses.replace(robot.platform, workspace_max_m=high_m)
    )
    statics = statics_of(larger)
    assert not statics.is_target(np.array(high_m))
    for swings in corner_swings(Subject(larger)):
        places = np.array([swing.position_m for swing in swings])
        assert len(places) == 4 and statics.is_target(places).all()
        assert robot.platform.workspace_min_m in map(tuple, places.tolist())
    heavy = dataclasses.replace(robot, platform=dataclasses.replace(robot.platform, mass_kg=1000.0))
    assert corner_swings(Subject(heavy)) == [[], [], []]


def test_a_place_below_the_stand_is_not_treated_as_in_the_ground() -> None:
    robot = load_robot("point-4")
    assert robot.platform is not None
    x, y, low = robot.platform.workspace_min_m
    lying = [
        CableLoss(Subject(dataclasses.replace(robot, platform=platform))).swing(0, (x, y, low))
        for stand in (low, low + 0.2)
        for platform in [dataclasses.replace(robot.platform, home_m=(0.0, 0.0, stand))]
    ]
    assert lying[1].away_m == pytest.approx(lying[0].away_m, rel=1e-3)


def test_the_prediction_is_the_worst_of_winches_with_and_without_friction() -> None:
    robot, place = load_robot("planar-4"), (0.8, 2.0)
    loss = CableLoss(Subject(robot))
    start = platform_model_of(robot).pose(np.array(place))
    within = math.ceil(SWING_S / robot.sync_period_s)
    told, found = loss.swing(0, place), []
    for friction in FRICTIONS:
        moved = loss.path(0, start, friction)[:, 0] - start.p
        found.append(np.linalg.norm(moved[:within], axis=1).max())
    assert told.swing_m == max(found)
    assert max(found) > 1.1 * min(found)


def test_only_the_friction_of_a_failed_drive_can_hold_a_light_platform() -> None:
    """Working winches pay out against their friction."""
    robot, place = load_robot("planar-3"), (0.0, 2.2)
    assert robot.platform is not None
    light = dataclasses.replace(robot, platform=dataclasses.replace(robot.platform, mass_kg=0.5))
    losses = CableLoss(Subject(light))
    assert losses.swing(0, place, Loss.DRIVE).hangs_m > 0.1
    assert losses.swing(0, place, Loss.LENGTHS).hangs_m == 0.0
    assert CableLoss(Subject(robot)).swing(0, place, Loss.DRIVE).hangs_m == 0.0


def test_late_detection_of_a_loss_moves_the_platform_further() -> None:
    robot, cable = load_robot("planar-3"), 2
    limits = robot.limits.model_copy(update={"speed_rad_s": (150.0,)})
    start = platform_model_of(robot).pose(np.array([0.0, 1.8]))
    moved_m = []
    for one in (robot, dataclasses.replace(robot, limits=limits)):
        path = CableLoss(Subject(one)).path(cable, start)
        moved_m.append(np.linalg.norm(path[: round(0.1 / one.sync_period_s), 0] - start.p, axis=1))
    early_m, late_m = (moved.max() for moved in moved_m)
    assert late_m > 1.2 * early_m


def test_tensions_before_the_fall_include_the_weight_of_cables() -> None:
    robot, place_m = load_robot("suspended-8"), (0.4, -0.3, 1.2)
    assert robot.platform is not None
    platform = dataclasses.replace(robot.platform, cable_weights_N_m=(4.0,) * 8)
    loss = CableLoss(Subject(dataclasses.replace(robot, platform=platform)))
    loss.path(0, loss._model.pose(np.array(place_m)))
    stiffness_N = [axis.winch.cable.stiffness_N for axis in robot.axes]
    weight_N = platform.mass_kg * G_m_s2
    for pulled, within in (("held_N", 2e-3), ("weight_N", 0.02)):
        wrench = cables_on(platform, place_m, stiffness_N, loss._winches[pulled])[1]
        assert wrench[2] == pytest.approx(weight_N, rel=within)


def test_cable_damping_affects_the_fall_up_to_the_bound_of_the_time_step() -> None:
    robot, place_m = load_robot("planar-3"), np.array([0.0, 1.8])
    start = platform_model_of(robot).pose(place_m)
    paths = []
    for damping_s in (2e-3, 2e-4, 0.05):
        loss = CableLoss(Subject(with_cables(robot, damping_s=damping_s)))
        paths.append(loss.path(2, start)[:100])
    assumed, little, much = paths
    assert np.abs(little[:, 0] - assumed[:, 0]).max() > 1e-5
    np.testing.assert_array_equal(much, assumed)


def test_resonance_of_rotors_and_a_mass_has_the_textbook_frequency() -> None:
    robot = load_robot("point-4")
    assert robot.platform is not None
    platform = dataclasses.replace(
        hung(((-2.0, 1e-9), (2.0, 1e-9)), ((0.0, 0.0),) * 2), mass_kg=0.1
    )
    pair = dataclasses.replace(robot, platform=platform, axes=robot.axes[:2])
    winch = robot.axes[0].winch
    k = winch.cable.stiffness_N / 2.0
    m = winch.motor.rotor_inertia_kg_m2 / winch.cable_m_per_motor_rad**2
    # on a line between two cables: rotors move against each other, or both against the mass
    between = math.sqrt(k / m), math.sqrt(k / m + 2.0 * k / platform.mass_kg)
    found = 2.0 * math.pi * resonance_Hz(pair, (0.0, 0.0))
    assert found == pytest.approx(min(between), rel=1e-6)
    heavy = dataclasses.replace(platform, exit_points_m=((0.0, 2.0), (1.0, 1e-9)))
    apart = dataclasses.replace(pair, platform=heavy)
    found = 2.0 * math.pi * resonance_Hz(apart, (0.0, 0.0))
    assert found == pytest.approx(math.sqrt(k * (1.0 / m + 1.0 / platform.mass_kg)), rel=1e-6)


def test_resonance_includes_length_and_direction_of_cables_over_pulleys() -> None:
    robot, radius_m, at = load_robot("point-4"), 0.5, (0.0, -0.5)
    straight = dataclasses.replace(hung(((-2.0, 0.0), (2.0, 0.0)), ((0.0, 0.0),) * 2), mass_kg=0.1)
    platform = dataclasses.replace(straight, pulley_radius_m=(radius_m,) * 2)
    pair = dataclasses.replace(robot, platform=platform, axes=robot.axes[:2])
    winch = robot.axes[0].winch
    rho, slope = over_a_pulley(np.array([2.0, 0.0]), radius_m, np.array(at))
    k = winch.cable.stiffness_N / rho
    m = winch.motor.rotor_inertia_kg_m2 / winch.cable_m_per_motor_rad**2
    # the cables are symmetric, so that vertical and horizontal motion are separate modes
    share = min(math.sin(slope) ** 2, math.cos(slope) ** 2)
    expected = math.sqrt(k * (1.0 / m + 2.0 * share / platform.mass_kg))
    assert 2.0 * math.pi * resonance_Hz(pair, at) == pytest.approx(expected, rel=1e-4)
    without = dataclasses.replace(pair, platform=straight)
    assert abs(2.0 * math.pi * resonance_Hz(without, at) / expected - 1.0) > 0.01
