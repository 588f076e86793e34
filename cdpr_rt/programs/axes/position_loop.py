"""The position loop of all axes, which several programs share."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.control.pid import Pid
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.model import AxesModel


class PositionLoop:
    """One PID for all programs that follow a position; it keeps its state from one to the next."""

    def __init__(self, model: AxesModel) -> None:
        known = None
        if any(axis is not None for axis in model.compensation):
            known = Compensation(list(model.compensation), model.period_s)
        self.controller = Pid(list(model.gains), model.torque_Nm, model.period_s, known)
        self._cycle = -2
        self._torque_Nm = np.zeros(model.n)

    def take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Keep the state where the last cycle was this loop's, else begin with its torques (n,)."""
        next_cycle = feedback.cycle - self._cycle in (0, 1)
        if not (next_cycle and np.array_equal(torque_Nm, self._torque_Nm)):
            self.controller.take_over(torque_Nm)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""
        self._cycle = feedback.cycle
        self.controller.update(feedback, setpoint, torque_Nm)
        self._torque_Nm[:] = torque_Nm
