"""Selection of model and control for the platform of a robot's file."""

from __future__ import annotations

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.robots.interface import PlatformControl, RobotModel
from cdpr_rt.robots.platform.cable_control import CableControl
from cdpr_rt.robots.platform_model import platform_model_of


def platform_of(
    robot: Robot,
    limits: Limits,
    torque_Nm: FloatArray,
    compensation: Compensation | None = None,
    *,
    learns: bool = True,
) -> tuple[RobotModel, PlatformControl]:
    """Return the model and the control of a robot's platform; the robot has to have one.

    Motors may be asked for `torque_Nm` (n,). The control has the tension distribution and the cable
    model that the robot's file names; where it `learns`, it learns in motion of motors that
    `compensation` does not know. Raises GeometryError where tensions have no bounds to hold it by.
    """
    model = platform_model_of(robot, limits)
    control = CableControl(
        model, robot.axes, torque_Nm, robot.sync_period_s, compensation, learns=learns
    )
    return model, control
