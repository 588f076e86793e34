"""What programs that move the axes' set-points have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from cdpr_rt.approach import change_pace
from cdpr_rt.controllers.base import Controller
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime.programs.base import ProgramError, WithoutPlatform
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.wanted import Wanted


class Loop(Protocol):
    """A controller that goes on from the last one's torque: `PositionLoop`, `Handover`."""

    @property
    def controller(self) -> Controller:
        """Whose effort and compensation are recorded."""

    def take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin with the torques (n,) of the last cycle."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""


class AxisProgram(WithoutPlatform):
    """Moves the axes' set-point within the model's bounds; by itself it brakes and stays.

    Those that do more have their own `_move`, and `_parsed` and `_take` for their commands.
    """

    name = "hold"
    needs_lease = False

    def __init__(self, model: RobotModel, loop: Loop) -> None:
        self._model = model
        self._loop = loop
        self.controller = loop.controller
        self._setpoint = Setpoint(model.n)
        self._still = np.zeros(model.n)
        self._stopping = False
        self._at_rest = True

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""
        self._setpoint = setpoint
        self._stopping = self._at_rest = False
        self._loop.take_over(feedback, torque_Nm)

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, of a program that need not run."""
        self._parsed(wanted)

    def command(self, wanted: Mapping[str, Any]) -> None:
        """Take over what an operator wants; raises ProgramError and changes nothing then."""
        parsed = self._parsed(wanted)
        if self._stopping:
            raise ProgramError(f"{self.name}: it is being stopped; start it anew")
        self._at_rest = False
        self._take(parsed)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        if self._stopping:
            self._at_rest = self._brake(setpoint)
        else:
            self._at_rest = self._move(setpoint)
        self._loop.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._stopping = True
        self._at_rest = False

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""
        return self._at_rest

    def _parsed(self, wanted: Mapping[str, Any]) -> Any:
        """Return what `_take` takes; raises ProgramError."""
        return Wanted(self.name, wanted, ())

    def _take(self, _parsed: Any) -> None:
        """Do from now on what was wanted."""

    def _move(self, setpoint: Setpoint) -> bool:
        """Write the next set-point; return whether nothing is left to do."""
        return self._brake(setpoint)

    def _brake(self, setpoint: Setpoint) -> bool:
        return change_pace(
            self._still,
            self._model.acceleration_rad_s2,
            self._model.period_s,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            setpoint.acceleration_rad_s2,
        )
