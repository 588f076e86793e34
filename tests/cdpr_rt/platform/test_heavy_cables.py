"""Cables that weigh a sixth of their platform: planned, requested and true tensions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.diagnosis.predictions import lowest_resonance_Hz
from cdpr_rt.model.reachable import Reach
from cdpr_rt.model.statics import PlatformStatics
from cdpr_rt.platform.loop_design import LEAST_MARGIN
from cdpr_rt.platform.loop_plant import (
    GREATEST,
    LEAST,
    CABLE_DAMPING_s,
    cable_stiffness,
    planned_tensions,
)
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.cdpr_rt.platform.linear_cycle import loop_model, rigidity, rotors
from tests.cdpr_rt.platform.platform_physics import Machine, Physics
from tests.heavy_cables import cable_with, standing

MASS_kg, WEIGHT_N_m, EXIT_HEIGHT_m = 20.0, 0.8, 10.0
EXITS_m = ((0.0, 9.0, EXIT_HEIGHT_m), (-7.794, -4.5, EXIT_HEIGHT_m), (7.794, -4.5, EXIT_HEIGHT_m))
PLACE_m = (0.4, -0.3, 1.5)
SMOOTH = {
    "cables": {"friction_share": 0.0},
    "variation": {"torque_constant": 0.0},
    "motor": {
        "motor": {"torque_constant_error": 0.0},
        "cogging": (),
        "friction": {"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.002},
    },
}


def heavy() -> Machine:
    axis = load_robot("planar-3").axes[0]
    platform = Platform(
        mass_kg=MASS_kg,
        home_m=(0.0, 0.0, 1.0),
        home_tolerance_m=0.05,
        workspace_min_m=(-1.0, -1.0, 1.2),
        workspace_max_m=(1.0, 1.0, 2.5),
        speed_m_s=0.4,
        acceleration_m_s2=0.3,
        exit_points_m=EXITS_m,
        anchor_points_m=((0.0, 0.0, 0.0),) * 3,
        inertia_kg_m2=(0.2, 0.2, 0.2, 0.0, 0.0, 0.0),
        cable_model="catenary",
        cable_weights_N_m=(WEIGHT_N_m,) * 3,
    )
    return Machine(platform, (axis,) * 3, 20.0, 200.0, 6.0, learns=False)


def rise_N(height_m: float) -> float:
    return 0.5 * WEIGHT_N_m * (EXIT_HEIGHT_m - height_m)


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 1.0), PLACE_m, (-1.0, 1.0, 2.5)])
def test_planned_tensions_equal_those_of_catenaries(place_m: tuple[float, ...]) -> None:
    machine = heavy()
    statics = PlatformStatics(machine.model())
    true = standing(
        EXITS_m, MASS_kg, WEIGHT_N_m, machine.axes[0].winch.cable.stiffness_N, position_m=place_m
    )
    for planned_N in (
        statics.tensions_N(np.array(place_m)), statics.least_tensions_N(np.array(place_m))
    ):  # fmt: skip
        np.testing.assert_allclose(planned_N + rise_N(place_m[2]), true.winch_N, rtol=5e-3)
        np.testing.assert_allclose(planned_N - rise_N(place_m[2]), true.platform_N, rtol=5e-3)


def test_ways_end_where_no_tensions_with_cable_weight_exist() -> None:
    model = heavy().model()
    start, rng = np.array([0.0, 0.0, 2.0]), np.random.default_rng(3)
    ways = rng.normal(size=(40, 3))
    ends = start + 8.0 * ways / np.linalg.norm(ways, axis=1)[:, None]
    shares, _ = Reach(model, start).shares(ends)
    assert (shares < 1.0).all() and shares.min() > 0.0
    workspace = model.workspace()
    for share in np.linspace(0.0, 1.0, 9):
        inside = start + (share * shares)[:, None] * (ends - start)
        assert workspace.margins(model.poses(inside))[0].min() >= 0.0
    beyond = start + (shares + 2e-3)[:, None] * (ends - start)
    assert workspace.margins(model.poses(beyond))[0].max() < 0.0
    np.testing.assert_allclose(
        workspace.capacity_margins(model.poses(beyond)),
        workspace.margins(model.poses(beyond))[0], rtol=1e-6, atol=1e-6,
    )  # fmt: skip


def test_a_platform_at_rest_has_the_planned_tensions_without_the_loops_force() -> None:
    machine = heavy()
    physics = Physics(machine, RobotPlant.model_validate(SMOOTH))
    physics.go(PLACE_m)
    physics.run(8.0)  # the integral part compensates the remaining friction
    statics = PlatformStatics(machine.model())
    winch_N = np.mean(physics.tension_N[-1000:], axis=0)
    planned_N = statics.tensions_N(np.array(PLACE_m)) + rise_N(PLACE_m[2])
    np.testing.assert_allclose(winch_N, planned_N, rtol=0.01)
    np.testing.assert_allclose(physics.robot.position_m, PLACE_m, atol=0.01)
    true = standing(
        EXITS_m, MASS_kg, WEIGHT_N_m, machine.axes[0].winch.cable.stiffness_N,
        position_m=physics.robot.position_m,
    )  # fmt: skip
    np.testing.assert_allclose(winch_N, true.winch_N, rtol=0.01)
    # the feedforward includes the cables' whole weight, 15 N on the platform
    control, planned_N = physics.control, planned_N - rise_N(PLACE_m[2])
    np.testing.assert_allclose(control._feedforward_N, planned_N, rtol=2e-3)
    # and the difference at the winches, 7 N upward, is not left to the loop
    upward = control.model.kinematics.wrench_matrix(control.model.pose(np.array(PLACE_m)))[2]
    assert abs(upward @ (control.tension_N - planned_N)) < 1.0
    cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in machine.axes])
    np.testing.assert_allclose(-physics.torque / cable_m, true.winch_N, rtol=0.02)


def heaviest() -> Machine:
    """A point of 110 kg on ropes of 4 N/m, which sag by more than they stretch."""
    (axis, *_) = load_robot("suspended-8").axes
    platform = replace(
        heavy().platform,
        mass_kg=110.0,
        workspace_min_m=(-1.5, -1.5, 1.2),
        workspace_max_m=(1.5, 1.5, 3.5),
        cable_weights_N_m=(4.0,) * 3,
    )
    return Machine(platform, (axis,) * 3, 150.0, 1000.0, 4.0)


def test_the_stiffness_of_sagging_ropes_equals_that_of_catenaries() -> None:
    machine = heaviest()
    model, EA = machine.model(), rigidity(machine)
    pose = model.pose(np.array([1.5, 1.5, 1.2]))
    found = cable_stiffness(model, pose, EA)
    for level, at in ((LEAST, 0), (GREATEST, 1)):
        t = planned_tensions(model, pose)[at]
        for i, exit_m in enumerate(machine.platform.exit_points_m):
            winch_N = t[i] + 0.5 * 4.0 * (exit_m[2] - 1.2)
            shorter_m = [
                cable_with(exit_m, pose.p, 4.0, EA[i], winch_N + more_N).length_m
                for more_N in (-0.5, 0.5)
            ]
            assert found[level, i] == pytest.approx(1.0 / -np.diff(shorter_m)[0], rel=0.03)
    assert (found < 0.5 * EA / model.kinematics.lengths(pose)).any()


def test_a_loop_keeps_its_margin_with_sagging_and_with_straight_ropes() -> None:
    """In a fast motion, the ropes' inertia keeps them from sagging."""
    machine = heaviest()
    light = replace(
        machine, platform=replace(machine.platform, cable_weights_N_m=(0.0,) * machine.n)
    )
    sagging, elastic = loop_model(machine), loop_model(light)
    of_light = elastic.design()
    assert min(there.modulus for there in sagging.margins(of_light)) < 0.9 * LEAST_MARGIN
    gains = sagging.design()
    for model in (sagging, elastic):
        assert min(there.modulus for there in model.margins(gains)) > 0.95 * LEAST_MARGIN
        assert min(mode.damping_ratio for mode in model.least_damped(gains, CABLE_DAMPING_s)) > 0.05


def test_the_lowest_resonance_includes_the_sag_of_ropes() -> None:
    machine, place_m = heaviest(), np.array([1.2, -0.6, 1.5])
    model, EA = machine.model(), rigidity(machine)
    pose = model.pose(place_m)
    t = planned_tensions(model, pose)[0]
    k = []
    for i, exit_m in enumerate(machine.platform.exit_points_m):
        winch_N = t[i] + 0.5 * 4.0 * (exit_m[2] - place_m[2])
        longer, shorter = (
            cable_with(exit_m, place_m, 4.0, EA[i], winch_N + more_N).length_m
            for more_N in (-0.5, 0.5)
        )
        k.append(1.0 / (longer - shorter))
    J = model.kinematics.jacobian(pose)
    stretch = np.hstack([J, -np.eye(3)])
    masses = np.concatenate([[110.0] * 3, rotors(machine)])
    squares = np.linalg.eigvals((stretch.T * k @ stretch) / masses[:, None]).real
    lowest = np.sqrt(np.sort(squares)[3]) / (
        2.0 * np.pi
    )  # three modes move rotors and platform together
    assert lowest_resonance_Hz(model, machine.axes, place_m) == pytest.approx(lowest, rel=0.02)
