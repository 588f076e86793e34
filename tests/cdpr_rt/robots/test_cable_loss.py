"""A broken cable and the rotors' resonance: against places and frequencies known by hand."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy.optimize import nnls

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.robots.cable_loss import swing_of, worst_swings
from cdpr_rt.robots.platform_model import platform_model
from cdpr_rt.robots.resonance import lowest_resonance_Hz
from tests.cdpr_rt.robots.pulley import over_a_pulley


def hung(exits: tuple[tuple[float, ...], ...], anchors: tuple[tuple[float, ...], ...]) -> Platform:
    size = len(exits[0])
    return Platform(
        mass_kg=2.0,
        home_m=(0.0,) * size,
        home_tolerance_m=0.05,
        workspace_min_m=(-0.5,) * size,
        workspace_max_m=(0.5,) * size,
        speed_m_s=0.5,
        acceleration_m_s2=1.0,
        exit_points_m=exits,
        anchor_points_m=anchors,
    )


def resonance_Hz(robot: Robot, position_m: tuple[float, ...]) -> float:
    platform = robot.platform
    assert platform is not None
    n = len(robot.axes)
    model = platform_model(platform, np.full(n, 20.0), np.full(n, 150.0))
    return float(lowest_resonance_Hz(model, robot.axes, np.array(position_m)))


def test_a_point_on_one_cable_hangs_plumb_below_its_exit_point() -> None:
    platform = hung(((-2.0, 2.0), (2.0, 2.0)), ((0.0, 0.0),) * 2)
    swing = swing_of(platform, 0, (-0.5, 0.5))
    rho = math.hypot(2.5, 1.5)
    assert swing.to_m == pytest.approx((2.0, 2.0 - rho), abs=1e-3)
    assert swing.swing_m == pytest.approx(math.dist((-0.5, 0.5), (2.0, 2.0 - rho)), abs=1e-3)
    assert swing.turn_rad == 0.0


def test_a_plate_on_one_cable_hangs_with_its_mass_under_the_anchor() -> None:
    platform = hung(((-2.0, 2.0), (2.0, 2.0)), ((-0.2, 0.0), (0.2, 0.0)))
    swing = swing_of(platform, 0, (0.0, 0.0))
    rho = math.dist((2.0, 2.0), (0.2, 0.0))
    assert swing.to_m == pytest.approx((2.0, 2.0 - rho - 0.2), abs=1e-4)
    assert swing.turn_rad == pytest.approx(math.pi / 2, abs=1e-3)


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "point-4", "suspended-6", "suspended-8"])
def test_where_it_comes_to_rest_it_is_lower_and_no_cable_is_longer(name: str) -> None:
    platform = load_robot(name).platform
    assert platform is not None
    worst = worst_swings(platform)
    assert [swing.cable for swing in worst] == list(range(len(platform.exit_points_m)))
    reach = 2.0 * max(math.hypot(*b) for b in platform.anchor_points_m) + 1e-5
    for swing in worst:
        assert swing.to_m[-1] < swing.position_m[-1] + reach
        for i, (a, b) in enumerate(
            zip(platform.exit_points_m, platform.anchor_points_m, strict=True)
        ):
            if i != swing.cable:
                start = math.dist(a, [p + q for p, q in zip(swing.position_m, b, strict=True)])
                assert math.dist(a, swing.to_m) < start + reach


def test_a_point_is_in_equilibrium_on_the_cables_that_are_left() -> None:
    platform = load_robot("point-4").platform
    assert platform is not None
    corners = itertools.product(
        *zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    )
    exits = np.array(platform.exit_points_m)
    for corner, cable in itertools.product(corners, range(4)):
        end = np.array(swing_of(platform, cable, corner).to_m)
        rho = np.linalg.norm(exits - corner, axis=1)
        ways = exits - end
        lengths = np.linalg.norm(ways, axis=1)
        kept = np.arange(4) != cable
        assert (lengths[kept] < rho[kept] + 1e-6).all()
        taut = kept & (lengths > rho - 1e-4)
        _, missing = nnls((ways / lengths[:, None])[taut].T, np.array([0.0, 0.0, 1.0]))
        assert missing < 1e-3


def test_one_rotor_and_a_mass_swing_at_the_textbook_frequency() -> None:
    robot = load_robot("point-4")
    assert robot.platform is not None
    platform = dataclasses.replace(
        hung(((-2.0, 1e-9), (2.0, 1e-9)), ((0.0, 0.0),) * 2), mass_kg=0.1
    )
    pair = dataclasses.replace(robot, platform=platform, axes=robot.axes[:2])
    winch = robot.axes[0].winch
    k = winch.cable.stiffness_N / 2.0
    m = winch.motor.rotor_inertia_kg_m2 / winch.cable_m_per_motor_rad**2
    # on a line between two cables: rotors together against each other, or both against the mass
    between = math.sqrt(k / m), math.sqrt(k / m + 2.0 * k / platform.mass_kg)
    found = 2.0 * math.pi * resonance_Hz(pair, (0.0, 0.0))
    assert found == pytest.approx(min(between), rel=1e-6)
    heavy = dataclasses.replace(platform, exit_points_m=((0.0, 2.0), (1.0, 1e-9)))
    apart = dataclasses.replace(pair, platform=heavy)
    found = 2.0 * math.pi * resonance_Hz(apart, (0.0, 0.0))
    assert found == pytest.approx(math.sqrt(k * (1.0 / m + 1.0 / platform.mass_kg)), rel=1e-6)


def test_a_cable_that_is_left_hangs_from_the_far_side_of_its_pulley() -> None:
    radius_m, start = 0.1, (-0.5, 0.5)
    straight = hung(((-2.0, 2.0), (2.0, 2.0)), ((0.0, 0.0),) * 2)
    swing = swing_of(dataclasses.replace(straight, pulley_radius_m=(radius_m,) * 2), 0, start)
    rho, _ = over_a_pulley(np.array([2.0, 2.0]), radius_m, np.array(start))
    drop_m = rho - math.pi * radius_m
    assert swing.to_m == pytest.approx((2.0 - 2.0 * radius_m, 2.0 - drop_m), abs=1e-3)
    assert math.dist(swing.to_m, swing_of(straight, 0, start).to_m) > 0.5 * radius_m


def test_pulleys_lengthen_and_turn_the_cables_that_platform_and_rotors_swing_over() -> None:
    robot, radius_m, at = load_robot("point-4"), 0.5, (0.0, -0.5)
    straight = dataclasses.replace(hung(((-2.0, 0.0), (2.0, 0.0)), ((0.0, 0.0),) * 2), mass_kg=0.1)
    platform = dataclasses.replace(straight, pulley_radius_m=(radius_m,) * 2)
    pair = dataclasses.replace(robot, platform=platform, axes=robot.axes[:2])
    winch = robot.axes[0].winch
    rho, slope = over_a_pulley(np.array([2.0, 0.0]), radius_m, np.array(at))
    k = winch.cable.stiffness_N / rho
    m = winch.motor.rotor_inertia_kg_m2 / winch.cable_m_per_motor_rad**2
    # two cables mirror each other: up and down and to the sides are modes of their own
    share = min(math.sin(slope) ** 2, math.cos(slope) ** 2)
    expected = math.sqrt(k * (1.0 / m + 2.0 * share / platform.mass_kg))
    assert 2.0 * math.pi * resonance_Hz(pair, at) == pytest.approx(expected, rel=1e-4)
    without = dataclasses.replace(pair, platform=straight)
    assert abs(2.0 * math.pi * resonance_Hz(without, at) / expected - 1.0) > 0.01
