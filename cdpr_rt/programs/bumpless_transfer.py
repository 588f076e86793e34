"""Bumpless transfer to a controller without an integral part."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import jit

_FADE_S = 0.2


@jit
def _fade(
    difference: FloatArray, share: float, first: bool, limit: FloatArray, torque: FloatArray
) -> None:
    for i in range(torque.size):
        if first:
            difference[i] -= torque[i]
        torque[i] = min(max(torque[i] + share * difference[i], -limit[i]), limit[i])


class BumplessTransfer:
    """Adds to a controller's torque the difference to the last one's, faded out over 0.2 s.

    torque = u + s·(torque_0 - u_0), s from 1 to 0; `limit_Nm` (n,) bounds the sum.
    """

    def __init__(self, controller: Controller, limit_Nm: FloatArray, period_s: float) -> None:
        self.controller = controller
        self._limit = np.array(limit_Nm, float)
        self._difference = np.zeros_like(self._limit)
        self._cycles = max(1, round(_FADE_S / period_s))
        self._cycle = 0

    def take_over(self, _feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin with the torques (n,) of the last cycle."""
        self.controller.reset()
        self._difference[:] = torque_Nm
        self._cycle = 0

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""
        self.controller.update(feedback, setpoint, torque_Nm)
        share = 1.0 - self._cycle / self._cycles
        _fade(self._difference, share, self._cycle == 0, self._limit, torque_Nm)
        self._cycle = min(self._cycle + 1, self._cycles)

    @property
    def done(self) -> bool:
        """Whether nothing of the difference is left."""
        return self._cycle >= self._cycles
