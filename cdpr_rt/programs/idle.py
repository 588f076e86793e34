"""Program `idle`: no torque."""

from __future__ import annotations

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller, Idle
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.programs.base import BumplessTransfer, Program
from cdpr_rt.programs.model import AxesModel

_FILTER_S = 0.01


@jit
def _track_axes(
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


class IdleProgram(Program):
    """Fades the torque out; the set-point tracks the axes' angles and filtered speeds.

    So the next program begins at the present speed of each axis.
    """

    name = "idle"
    needs_lease = False

    def __init__(self, model: AxesModel) -> None:
        self._loop = BumplessTransfer(Idle(model.n), model.torque_Nm, model.period_s)
        self.controller = self._loop.controller
        self._period_s = model.period_s
        self._weight = model.period_s / (model.period_s + _FILTER_S)
        self._first = True

    def start(self, feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last cycle's set-point and torque, (n,) each."""
        self._first = True
        self._loop.take_over(feedback, torque_Nm)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        _track_axes(
            self._weight,
            self._period_s,
            self._first,
            feedback.position_rad,
            *setpoint.arrays,
        )
        self._first = False
        self._loop.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Do nothing: there is nothing to brake."""

    @property
    def at_rest(self) -> bool:
        """Whether no torque is left."""
        return self._loop.done


# Zero torque immediately, without a fade.


class ZeroTorqueProgram(Program):
    """Commands zero torque from its first cycle on; for rotors without load, and cables made fast.

    It is used as `idle`, and as `hold` if there is nothing to hold.
    """

    name = "idle"
    needs_lease = False

    def __init__(self, n: int) -> None:
        self.controller: Controller = Idle(n)

    def start(self, _feedback: AxisFeedback, _setpoint: Setpoint, _torque_Nm: FloatArray) -> None:
        """Do nothing: the program continues neither set-point nor torque."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write zero torques (n,), and the angles of the axes as the set-point."""
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self.controller.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Do nothing: there is nothing to brake."""

    @property
    def at_rest(self) -> bool:
        """Always true: nothing is left to do."""
        return True
