"""Platforms that pretension stabilises or destabilises: the loop's design, and models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.platform.loop_design import FOLLOWED_MARGIN, LEAST_MARGIN, LoopModel, UnstableError
from cdpr_rt.platform.loop_plant import geometric_stiffness, planned_tensions
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.cdpr_rt.platform.linear_cycle import loop_model, radius, rigidity, rotors, turned_wrench
from tests.cdpr_rt.platform.platform_physics import (
    PERIOD_S,
    Machine,
    Physics,
    crossed_rod,
    shipped,
    short_arms,
    spatial,
)


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "point-4", "suspended-6", "spatial-8"])
def test_geometric_stiffness_is_the_derivative_of_the_tensions_and_weights_wrench(
    name: str,
) -> None:
    machine = shipped(name)
    model = machine.model()
    for q in loop_model(machine).poses[[0, 2, -1]]:
        pose = model.pose(q)
        for tension_N in planned_tensions(model, pose):
            expected = turned_wrench(machine, q, tension_N)
            found = geometric_stiffness(model, pose, tension_N)
            np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_planned_tensions_carry_the_weight_within_the_planned_bounds() -> None:
    machine = spatial()
    model = machine.model()
    pose = model.pose(np.array([0.1, 0.0, 1.4, 0.05, 0.0, 0.1]))
    least, greatest = planned_tensions(model, pose)
    wrench = np.array([0.0, 0.0, -9.80665 * machine.platform.mass_kg, 0.0, 0.0, 0.0])
    for tension_N in (least, greatest):
        carried = model.kinematics.wrench_matrix(pose) @ tension_N + wrench
        np.testing.assert_allclose(carried, 0.0, atol=1e-8)
        assert tension_N.min() >= model.low_N[0] + model.reserve_N - 1e-9
        assert tension_N.max() <= model.high_N[0] - model.reserve_N + 1e-9
    assert greatest.sum() > 2.0 * least.sum()


@pytest.mark.parametrize("name", ["planar-3", "planar-4", "point-4", "suspended-6", "spatial-8"])
def test_tensions_follow_the_pose_if_cables_are_stiffer_than_tensions(name: str) -> None:
    machine = shipped(name)
    gains, poses = loop_model(machine).design(), loop_model(machine).poses[[1, -1]]
    assert gains.follows_pose
    assert max(radius(machine, gains, q, 0.7, PERIOD_S) for q in poses) < 1.0


def test_tensions_are_those_of_the_set_point_if_they_stabilise_the_platform() -> None:
    """If tensions followed the pose, they would cancel their stiffness with delay: unstable."""
    for machine in (short_arms(), replace(short_arms(), low_N=200.0, high_N=800.0)):
        gains, q = loop_model(machine).design(), loop_model(machine).poses[1]
        assert not gains.follows_pose
        follows = replace(gains, follows_pose=True)
        assert max(radius(machine, gains, q, share, PERIOD_S) for share in (0.7, 1.3)) < 1.0
        assert max(radius(machine, follows, q, share, PERIOD_S) for share in (0.7, 1.3)) > 1.0


def test_tensions_follow_the_pose_if_they_destabilise_the_platform() -> None:
    """Here no loop is stiff enough to hold it against tensions of the set-point."""
    model = loop_model(crossed_rod())
    gains = model.design()
    assert gains.follows_pose
    assert min(m.modulus for m in model.margins(gains)) >= FOLLOWED_MARGIN
    stays = replace(gains, follows_pose=False)
    assert min(m.modulus for m in model.margins(stays)) < 0.5 * LEAST_MARGIN


def test_a_platform_that_tensions_turn_away_too_fast_is_rejected() -> None:
    """Tensions of the set-point need a stiffer loop; tensions that follow the pose are too late."""
    with pytest.raises(UnstableError, match="turn the platform away"):
        loop_model(replace(crossed_rod(), low_N=200.0, high_N=800.0)).design()


def margin(machine: Machine) -> float:
    """Return the least margin at the middle of the box of the loop designed for short arms."""
    gains, model = loop_model(short_arms()).design(), machine.model()
    q = loop_model(machine).poses[1][None]
    there = LoopModel(model, rotors(machine), rigidity(machine), PERIOD_S, poses=q)
    return there.margins(gains)[0].modulus


def test_a_margin_depends_on_the_tensions() -> None:
    tight = replace(short_arms(), high_N=800.0, low_N=400.0)
    assert margin(tight) < margin(short_arms())


def test_a_plate_with_short_arms_stands_and_moves_within_its_tensions() -> None:
    machine = short_arms()
    physics = Physics(machine, RobotPlant())
    first = len(physics.tension_N)
    physics.go([0.1, 0.1, 0.95, 0.0, 0.0, 0.0])
    tension_N = np.array(physics.tension_N[first:])
    assert tension_N.min() > machine.low_N
    assert tension_N.max() < machine.high_N
    rotation_rad = np.array(physics.true[-500:])[:, 3:]
    assert np.ptp(rotation_rad, axis=0).max() < np.radians(0.2)


def test_a_platform_on_softer_cables_does_not_drift_away_below_the_lowest_mode() -> None:
    """Otherwise tensions would follow a wrong stretch, slower than 0.3 Hz."""
    heavy = replace(short_arms().platform, mass_kg=11.7, inertia_kg_m2=(0.245,))
    machine = replace(short_arms(), platform=heavy, low_N=6.0, high_N=32.0)
    gains, q = loop_model(machine).design(), loop_model(machine).poses[1]
    assert radius(machine, gains, q, 0.7, PERIOD_S) < 1.0
