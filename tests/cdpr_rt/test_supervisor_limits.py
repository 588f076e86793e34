"""Limits of each axis its own: the one that is exceeded ends the motion, with its own figure."""

import numpy as np
import pytest

from cdpr_rt.exchange import AxisFeedback, Setpoint
from cdpr_rt.supervisor import Limits, Supervisor

PERIOD_S = 1e-3
EACH = Limits(
    torque_Nm=np.array([1.0, 2.0]),
    speed_rad_s=np.array([10.0, 20.0]),
    following_error_rad=np.array([0.1, 0.2]),
)


def feedback(*position: float) -> AxisFeedback:
    seen = AxisFeedback(2)
    seen.valid[:] = True
    seen.position_rad[:] = position
    return seen


def test_torque_is_clamped_to_each_axis_own_limit():
    torque = np.array([-5.0, 5.0])
    assert Supervisor(EACH, 2, PERIOD_S).check(feedback(0, 0), Setpoint(2), torque) == ""
    np.testing.assert_array_equal(torque, [-1.0, 2.0])


@pytest.mark.parametrize(("axis", "allowed"), [(0, 5.7), (1, 11.5)])
def test_each_axis_has_its_own_following_error(axis: int, allowed: float):
    supervisor, wanted = Supervisor(EACH, 2, PERIOD_S), Setpoint(2)
    wanted.position_rad[axis] = 0.99 * EACH.following_error_rad[axis]  # type: ignore[index]
    assert supervisor.check(feedback(0, 0), wanted, np.zeros(2)) == ""
    wanted.position_rad[axis] *= 1.03
    reason = supervisor.check(feedback(0, 0), wanted, np.zeros(2))
    assert reason.startswith(f"axis {axis}: following error")
    assert f"{allowed} deg allowed" in reason


@pytest.mark.parametrize(("axis", "allowed"), [(0, 573), (1, 1146)])
def test_each_axis_has_its_own_speed(axis: int, allowed: float):
    def run(speed_rad_s: float) -> str:
        supervisor, wanted = Supervisor(EACH, 2, PERIOD_S), Setpoint(2)
        for k in range(200):
            wanted.position_rad[axis] = k * PERIOD_S * speed_rad_s
            seen = feedback(*wanted.position_rad)
            if reason := supervisor.check(seen, wanted, np.zeros(2)):
                return reason
        return ""

    assert run(0.99 * EACH.speed_rad_s[axis]) == ""  # type: ignore[index]
    assert f"{allowed} deg/s allowed" in run(1.05 * EACH.speed_rad_s[axis])  # type: ignore[index]


def test_one_figure_serves_all_axes():
    torque = np.array([-5.0, 5.0])
    Supervisor(Limits(1.5, 1.0, 1.0), 2, PERIOD_S).check(feedback(0, 0), Setpoint(2), torque)
    np.testing.assert_array_equal(torque, [-1.5, 1.5])
