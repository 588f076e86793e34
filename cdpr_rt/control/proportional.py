"""The high-gain proportional controller of the cogging sweep."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import bound, bound_to, jit


@jit
def _update(
    gain: FloatArray,
    limit: FloatArray,
    position: FloatArray,
    reference: FloatArray,
    effort: FloatArray,
    torque: FloatArray,
) -> None:
    for i in range(gain.size):
        u = gain[i] * (reference[i] - position[i])
        u = min(max(u, -limit[i]), limit[i])
        effort[i] = u
        torque[i] = u


class Proportional:
    """Torque in proportion to the position error, limited (Tremblay, section 1.3, figure 1.2).

    Without integral action the torque keeps the sign of the ramp's slope as long as friction
    prevails, so that what is recorded belongs to one direction of motion.
    Parameters, shapes (n,): `gain_Nm_rad`, `limit_Nm`.
    """

    def __init__(self, gain_Nm_rad: FloatArray, limit_Nm: FloatArray) -> None:
        self._gain = np.array(gain_Nm_rad, float)
        self._limit = np.array(limit_Nm, float)
        self.effort_Nm = np.zeros_like(self._gain)
        self.compensation_Nm = self.motor_loss_Nm = self.cogging_Nm = np.zeros_like(self._gain)
        self._kernel = bound_to(self._bind)

    def reset(self) -> None:
        """Nothing is remembered."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the limited proportional torque."""
        self._kernel(feedback, setpoint, torque_Nm)()

    def _bind(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> Callable[[], None]:
        return bound(
            _update, self._gain, self._limit, feedback.position_rad, setpoint.position_rad,
            self.effort_Nm, torque_Nm,
        )  # fmt: skip
