"""Zero torque at once, without a fade."""

from __future__ import annotations

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller, Idle
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.base import Program


class ZeroTorqueProgram(Program):
    """Commands zero torque from its first cycle on; for bare rotors, and cables made fast.

    It serves as `idle` and as `hold` where there is nothing to be held.
    """

    name = "idle"
    needs_lease = False

    def __init__(self, n: int) -> None:
        self.controller: Controller = Idle(n)

    def start(self, _feedback: AxisFeedback, _setpoint: Setpoint, _torque_Nm: FloatArray) -> None:
        """Nothing is taken over."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write no torques (n,), and the axes' own angles as the set-point."""
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self.controller.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Nothing is to be braked."""

    @property
    def at_rest(self) -> bool:
        """Nothing is left to do, ever."""
        return True
