"""Cables that weigh a sixth of their platform: planned, asked for and true tensions."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.robots.reach.reachable import Reach
from cdpr_rt.robots.statics import PlatformStatics
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.cdpr_rt.robots.platform.platform_physics import Machine, Physics
from tests.heavy_cables import standing

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
def test_planned_tensions_are_those_of_catenaries(place_m: tuple[float, ...]) -> None:
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


def test_ways_end_where_tensions_with_the_cables_weight_do() -> None:
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


def test_a_platform_that_is_held_has_the_planned_tensions_and_the_loop_adds_nothing() -> None:
    machine = heavy()
    physics = Physics(machine, RobotPlant.model_validate(SMOOTH))
    physics.go(PLACE_m)
    physics.run(8.0)  # friction that is left is made up for by the integral part
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
    # all of the cables' weight, which is 15 N on the platform, is known beforehand
    control, planned_N = physics.control, planned_N - rise_N(PLACE_m[2])
    np.testing.assert_allclose(control._feedforward_N, planned_N, rtol=2e-3)
    # and what winches pull more, 7 N upward, is not left to the loop
    upward = control.model.kinematics.wrench_matrix(control.model.pose(np.array(PLACE_m)))[2]
    assert abs(upward @ (control.tension_N - planned_N)) < 1.0
    cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in machine.axes])
    np.testing.assert_allclose(-physics.torque / cable_m, true.winch_N, rtol=0.02)
