"""Heavy cables at a platform on its stand, compared with elastic catenaries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.model.robot_arrays import winches_of
from cdpr_rt.model.standing_tensions import StandingTensions
from cdpr_rt.programs.lower import LowerProgram
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.standing import rests_at_home
from tests.cdpr_rt.platform.platform_physics import PERIOD_S, Machine, shipped, spatial
from tests.heavy_cables import cables_on

G_m_s2 = 9.80665


def heavy(machine: Machine, weight_N_m: float) -> Machine:
    """Return a robot whose cables have this weight."""
    weights = (weight_N_m,) * machine.n
    platform = replace(machine.platform, cable_model="catenary", cable_weights_N_m=weights)
    return replace(machine, platform=platform)


def truth(machine: Machine, winch_N: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the true lengths (n,) at home, and the wrench (6,) of all cables on the platform."""
    stiffness_N = [axis.winch.cable.stiffness_N for axis in machine.axes]
    return cables_on(machine.platform, machine.platform.home_m, stiffness_N, winch_N)


def parts_of(machine: Machine) -> PlatformParts:
    control = machine.control()
    estimator = Estimator(machine.n, PERIOD_S, winches_of(machine.axes))
    return PlatformParts(control.model, control, estimator, PERIOD_S)


@pytest.mark.parametrize(
    ("machine", "weight_N_m"), [(spatial(), 1.5), (shipped("suspended-8"), 0.64)]
)
def test_force_on_the_stand_and_lengths_equal_those_of_catenaries(
    machine: Machine, weight_N_m: float
) -> None:
    robot = heavy(machine, weight_N_m)
    model, control = robot.model(), robot.control()
    standing = StandingTensions(model, control.low_N, np.full(robot.n, 1e3), np.zeros(robot.n))
    winch_N, stays = standing.at(model.home_pose)
    lengths_m, wrench = truth(robot, winch_N)
    assert stays
    weight_N, hang_N = robot.platform.mass_kg * G_m_s2, model.kinematics.hanging(model.home_pose)[0]
    assert abs(hang_N[2]) > 0.02 * weight_N
    from_below = robot.platform.exit_points_m[0][2] < robot.platform.home_m[2]
    # cables carry 0.57 of platform and cable weight; the stand carries the rest
    wanted_N = -weight_N if from_below else 0.85 / 1.5 * (weight_N - hang_N[2]) + hang_N[2]
    assert wrench[2] == pytest.approx(wanted_N, abs=0.004 * weight_N)
    assert np.abs(np.delete(wrench, 2)).max() < 0.004 * weight_N
    np.testing.assert_allclose(control.lengths_at_home(winch_N), lengths_m, atol=2e-5)


def test_the_pose_is_estimated_from_the_winch_tensions_of_heavy_cables() -> None:
    robot = heavy(spatial(), 1.5)
    control = robot.control()
    winch_N = np.where(np.arange(robot.n) < 4, 90.0, 60.0)
    feedback = AxisFeedback(robot.n)
    control.take_lengths(truth(robot, winch_N)[0], feedback)
    control.begin(feedback, winch_N)
    np.testing.assert_allclose(control.estimated, control.model.home, atol=2e-5)


def test_lowering_begins_with_the_loads_the_winches_carry() -> None:
    robot = heavy(shipped("suspended-8"), 4.0)
    parts, torque_Nm = parts_of(robot), np.zeros(robot.n)
    cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])
    program = LowerProgram(parts, np.full(robot.n, robot.torque_Nm), cable_m)
    program._drum_tension_N[:] = 0.0
    parts.control.setpoint.stand_at(np.array(parts.model.home))
    program._carry_weight(torque_Nm)
    # cables of 4 N/m weigh a fifth of their tension: the parabola's error is the square of that
    _, wrench = truth(robot, -torque_Nm / cable_m)
    weight_N = robot.platform.mass_kg * G_m_s2
    assert wrench[2] == pytest.approx(weight_N, rel=0.02)


def test_the_weight_of_cables_is_not_counted_as_carrying_the_platform() -> None:
    robot = heavy(shipped("suspended-8"), 4.0)
    parts, feedback = parts_of(robot), AxisFeedback(robot.n)
    model, kinematics = parts.model, parts.model.kinematics
    hanging, rise_N = kinematics.hanging(model.home_pose)
    t, W = np.zeros(robot.n), kinematics.wrench_matrix(model.home_pose)
    carrying = model.least_tensions(np.zeros(robot.n), model.high_N)
    for share, rests in ((0.78, True), (0.82, False)):
        carrying.solve(W, share * model.weight() + hanging, t)
        parts.estimator.estimate.tension_N[:] = t + rise_N
        lengths_m = parts.control.lengths_at_home(parts.control.low_N + rise_N)
        assert rests_at_home(parts, lengths_m, feedback) is rests
