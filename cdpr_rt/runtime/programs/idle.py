"""No torque."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cdpr_rt.controllers.base import Idle
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.runtime.programs.base import WithoutPlatform
from cdpr_rt.runtime.programs.handover import Handover
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.wanted import Wanted

_FILTER_S = 0.01


@jit
def _go_along(
    weight: float,
    period: float,
    first: bool,
    angle: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    slope: FloatArray,
) -> None:
    for i in range(angle.size):
        if not first:
            velocity[i] += weight * ((angle[i] - position[i]) / period - velocity[i])
        position[i] = angle[i]
        slope[i] = 0.0


class IdleProgram(WithoutPlatform):
    """Lets the torque fade away; the set-point goes along with the axes, at their mean speed.

    What follows on it catches an axis that turns at the speed it has.
    """

    name = "idle"
    needs_lease = False

    def __init__(self, model: RobotModel) -> None:
        self._loop = Handover(Idle(model.n), model.torque_Nm, model.period_s)
        self.controller = self._loop.controller
        self._period_s = model.period_s
        self._weight = model.period_s / (model.period_s + _FILTER_S)
        self._first = True

    def start(self, feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""
        self._first = True
        self._loop.take_over(feedback, torque_Nm)

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, of a program that need not run."""
        Wanted(self.name, wanted, ())

    def command(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where anything is wanted."""
        self.check(wanted)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        _go_along(
            self._weight,
            self._period_s,
            self._first,
            feedback.position_rad,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            setpoint.acceleration_rad_s2,
        )
        self._first = False
        self._loop.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Nothing is to be braked."""

    @property
    def at_rest(self) -> bool:
        """Whether no torque is left."""
        return self._loop.done
