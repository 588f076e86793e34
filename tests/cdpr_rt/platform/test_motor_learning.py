"""Learning friction and cogging in motion: its bounds, forgetting, and identified motors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles import load_robot
from cdpr_rt.control.compensation import AxisCompensation, Compensation
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.platform.cable_control import CableControl
from cdpr_rt.platform.motor_learning import MOST_SHARE, MotorLearning

ROBOT = load_robot("planar-3")
N, D = 3, 2
RATED_Nm = ROBOT.axes[0].winch.motor.rated_torque_Nm


class Bound:
    """Learning on the arrays of a test."""

    def __init__(self, known: tuple[bool, ...] = (False,) * N, reserve_N: float = 60.0) -> None:
        self.learning = MotorLearning(ROBOT.axes, np.array(known), np.ones(D), reserve_N, 1e-3)
        self.theta, self.omega = np.zeros((2, N))
        self.J = np.array([[0.8, 0.6], [-0.8, 0.6], [0.1, -1.0]])
        self.M = np.array([[3.0, 0.0], [0.2, 4.0]])
        self.v, self.force = np.zeros((2, D))
        added = self.learning.torque_Nm
        self.learning.bind(self.theta, self.omega, self.J, self.M, self.v, self.force, added)
        self.run(400, np.zeros(N))  # a change of programs is over

    def run(self, cycles: int, speed: np.ndarray, usable: bool = True) -> None:
        for _ in range(cycles):
            self.theta += 1e-3 * speed
            self.omega[:] = speed
            self.learning.learn(usable)
            self.learning.write(speed)


@given(
    st.lists(st.floats(-1e4, 1e4), min_size=2 * D, max_size=2 * D),
    st.lists(st.floats(-300.0, 300.0), min_size=N, max_size=N),
    st.booleans(),
)
@settings(max_examples=40)
def test_the_learnt_torque_is_always_bounded(
    seen: list[float], speed: list[float], again: bool
) -> None:
    bound = Bound()
    bound.force[:], bound.v[:] = seen[:D], seen[D:]
    bound.run(50, np.array(speed))
    if again:
        bound.force *= -1.0
        bound.run(50, -np.array(speed))
    most = 2.0 * MOST_SHARE * RATED_Nm
    assert (np.abs(bound.learning.torque_Nm) <= most).all()
    assert np.isfinite(bound.learning.friction_Nm).all()


def test_friction_is_found_from_the_loops_force() -> None:
    bound, true = Bound(), np.array([0.12, 0.05, 0.2])
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    for k in range(40):  # every combination of directions of turning, again and again
        signs = np.where(np.array([k, k // 2, k // 4]) % 2, 1.0, -1.0)
        for _ in range(400):
            missing = true * signs - bound.learning.torque_Nm
            bound.force[:] = bound.J.T @ (missing / cable)
            bound.run(1, 3.0 * signs)
    np.testing.assert_allclose(bound.learning.friction_Nm, true, atol=0.02)
    assert np.abs(bound.learning.cogging_Nm).max() < 0.02


def test_friction_is_found_within_six_short_motions_beside_a_constant_wrench() -> None:
    """A force that reverses with the motion is friction, also with rests in between."""
    bound, true_Nm, stays_N = Bound(), 0.1, np.array([0.0, 10.0])
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    for k in range(6):
        way = np.array([[0.1, 0.1], [-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1]][k % 4])
        speed = bound.J @ way / cable
        for _ in range(600):
            missing = true_Nm * np.sign(speed) - bound.learning.torque_Nm
            bound.force[:] = bound.J.T @ (missing / cable) + stays_N
            bound.run(1, speed)
        bound.force[:] = stays_N
        bound.run(2000, np.zeros(N))
    np.testing.assert_allclose(bound.learning.friction_Nm, true_Nm, atol=0.01)


@pytest.mark.parametrize(("true_Nm", "learnt_Nm"), [(0.15, 0.15), (0.3, 0.2)])
def test_friction_in_motion_may_exceed_that_found_at_rest_by_its_uncertainty(
    true_Nm: float, learnt_Nm: float
) -> None:
    """By twice its uncertainty: a motor that hardly turns does not show all of it."""
    bound = Bound(reserve_N=16.0)  # a third of it is 0.14 Nm
    found, covariance = np.array([0.1, 0.0, 0.0]), np.diag([0.05, 0.01, 0.01]) ** 2
    everyone = np.ones(N, np.bool_)
    bound.learning.begin_with(everyone, np.tile(found, (N, 1)), np.tile(covariance, (N, 1, 1)))
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    for k in range(60):  # every combination of directions of turning, again and again
        signs = np.where(np.array([k, k // 2, k // 4]) % 2, 1.0, -1.0)
        for _ in range(400):
            missing = true_Nm * signs - bound.learning.torque_Nm
            bound.force[:] = bound.J.T @ (missing / cable)
            bound.run(1, 3.0 * signs)
    np.testing.assert_allclose(bound.learning.friction_Nm, learnt_Nm, atol=0.02)


def test_friction_and_cogging_together_leave_the_tensions_a_third_of_their_reserve() -> None:
    bound, reserve_N = Bound(reserve_N=16.0), 16.0
    cable = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in ROBOT.axes])
    third_Nm = reserve_N / 3.0 * cable
    everyone, covariance = np.ones(N, np.bool_), np.tile(np.eye(3), (N, 1, 1))
    found = np.stack([1.5 * third_Nm, 0.9 * third_Nm, np.zeros(N)], axis=-1)
    bound.learning.begin_with(everyone, found, covariance)
    largest_Nm = np.zeros(N)
    for _ in range(800):  # over more than a period of the cogging
        bound.run(1, np.full(N, 3.0), usable=False)
        largest_Nm = np.maximum(largest_Nm, np.abs(bound.learning.torque_Nm))
    np.testing.assert_allclose(largest_Nm, 2.0 * third_Nm, rtol=1e-9)


def test_the_learnt_torque_leaves_the_tension_reserve() -> None:
    bound, reserve_N = Bound(reserve_N=9.0), 9.0
    cable = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in ROBOT.axes])
    bound.force[:] = [10.0, -10.0]
    for k in range(40):
        bound.force *= -1.0
        bound.run(100, np.full(N, 3.0 * (-1.0) ** k))
    added_N = bound.learning.torque_Nm / cable
    assert np.abs(added_N).max() > 0.1 * reserve_N
    assert np.abs(added_N).max() <= 2.0 / 3.0 * reserve_N


def test_a_constant_wrench_is_not_learnt_as_friction() -> None:
    """A payload that is not in the file, on a platform that moves in one direction for long."""
    bound = Bound()
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    speed = bound.J @ np.array([0.0, 0.1]) / cable
    added_N = np.zeros(D)
    bound.force[:] = [0.0, 30.0]
    bound.run(400, np.zeros(N))
    for _ in range(4000):
        bound.force[:] = [0.0, 30.0] - added_N  # the loop compensates the rest
        bound.run(1, speed)
        added_N = bound.J.T @ (bound.learning.torque_Nm / cable)
    assert np.abs(added_N).max() < 0.1 * 30.0


def test_nothing_is_learnt_at_rest_or_from_a_force_that_was_not_exerted() -> None:
    bound = Bound()
    bound.force[:] = [20.0, -5.0]
    bound.run(300, np.array([3.0, -3.0, 3.0]), usable=False)
    assert not bound.learning.friction_Nm.any()
    bound.run(300, np.zeros(N))  # nor is anything learnt at rest
    assert not bound.learning.friction_Nm.any() and not bound.learning.torque_Nm.any()
    bound.run(300, np.array([3.0, -3.0, 3.0]))
    assert bound.learning.torque_Nm.any()
    bound.learning.forget()
    assert not bound.learning.friction_Nm.any() and not bound.learning.torque_Nm.any()


def test_nothing_is_learnt_about_identified_motors() -> None:
    bound = Bound((True, False, True))
    bound.force[:] = [20.0, -5.0]
    bound.run(300, np.array([3.0, -3.0, 3.0]))
    assert bound.learning.torque_Nm[1] != 0.0
    assert not bound.learning.torque_Nm[[0, 2]].any()


def test_a_robot_with_identified_motors_does_not_learn() -> None:
    known = AxisCompensation(np.zeros((2, 8)), most_Nm=1.0)
    model, limits = platform_model_of(ROBOT), np.full(N, 4.5)
    axes = list(ROBOT.axes)
    compensation = Compensation([known] * N, 1e-3)
    assert CableControl(model, axes, limits, 1e-3, compensation).learning is None
    assert CableControl(model, axes, limits, 1e-3, learns=False).learning is None
    partly = Compensation([known, None, known], 1e-3)
    assert CableControl(model, axes, limits, 1e-3, partly).learning is not None
