"""The interface that every controller has."""

from typing import Protocol

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint


class Controller(Protocol):
    """Computes torques from feedback and set-point, once per cycle."""

    effort_Nm: FloatArray
    """Torque of the feedback loop in this cycle, (n,)."""
    compensation_Nm: FloatArray
    """Feed-forward torque from the model of the motor, or its cable's tension, (n,)."""
    motor_loss_Nm: FloatArray
    """Part of the compensation for the motor's cogging and friction, (n,)."""
    cogging_Nm: FloatArray
    """Cogging: the part of `motor_loss_Nm` whose mean over a motor turn is 0, (n,)."""

    def reset(self) -> None:
        """Discard the internal state before a motion starts."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torque to command for each axis, (n,), Nm."""


class Idle:
    """Commands no torque; used while drives are enabled or disabled."""

    def __init__(self, n: int) -> None:
        self.effort_Nm = np.zeros(n)
        self.compensation_Nm = self.motor_loss_Nm = self.cogging_Nm = np.zeros(n)

    def reset(self) -> None:
        """Do nothing: there is no state."""

    def update(self, _feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write zeros."""
        torque_Nm[:] = 0.0
