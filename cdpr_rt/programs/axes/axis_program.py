"""Base class of the programs that move the set-points of single axes."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.motion.approach import ramp_velocity
from cdpr_rt.programs.base import CommandedProgram
from cdpr_rt.programs.model import AxesModel


class BumplessController(Protocol):
    """Controls the axes, without a torque step at start: `PositionLoop`, `BumplessTransfer`."""

    @property
    def controller(self) -> Controller:
        """The controller whose effort and compensation are recorded."""

    def take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin with the torques (n,) of the last cycle."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""


class AxisProgram(CommandedProgram):
    """Moves the axes' set-points within the model's bounds.

    By itself it is the program `hold`, which brakes what moves and holds the axes where they come
    to stand. Subclasses override `_move`, and `check` and `_apply` for their commands.
    """

    name = "hold"
    needs_lease = False

    def __init__(self, model: AxesModel, loop: BumplessController) -> None:
        self._model = model
        self._loop = loop
        self.controller = loop.controller
        self._setpoint = Setpoint(model.n)
        self._zero_velocity = np.zeros(model.n)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""
        self._setpoint = setpoint
        self._stopping = self._at_rest = False
        self._loop.take_over(feedback, torque_Nm)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        if self._stopping:
            self._at_rest = self._brake(setpoint)
        else:
            self._at_rest = self._move(setpoint)
        self._loop.update(feedback, setpoint, torque_Nm)

    def _move(self, setpoint: Setpoint) -> bool:
        """Write the next set-point; return whether nothing is left to do."""
        return self._brake(setpoint)

    def _brake(self, setpoint: Setpoint) -> bool:
        return self._ramp(self._zero_velocity, setpoint)

    def _ramp(self, velocity_rad_s: FloatArray, setpoint: Setpoint) -> bool:
        """Ramp the set-point's velocity to this one, (n,); return whether all stand still."""
        model = self._model
        bounds = model.acceleration_rad_s2, model.period_s
        return ramp_velocity(velocity_rad_s, *bounds, *setpoint.arrays)
