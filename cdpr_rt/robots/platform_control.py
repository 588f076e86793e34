"""Which control moves a platform."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_profiles import RobotAxis
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.robots.interface import PlatformControl
from cdpr_rt.robots.platform.cable_control import CableControl
from cdpr_rt.robots.platform_model import PlatformModel


def platform_control(
    model: PlatformModel,
    axes: Sequence[RobotAxis],
    torque_Nm: FloatArray,
    period_s: float,
    compensation: Compensation | None = None,
    *,
    learns: bool = True,
) -> PlatformControl:
    """Return the control of a platform; raises GeometryError where there is none.

    `torque_Nm` (n,) is what the motors may be asked for; of motors that `compensation` does not
    know, what they take up is learnt in motion where it `learns`.
    """
    return CableControl(model, axes, torque_Nm, period_s, compensation, learns=learns)
