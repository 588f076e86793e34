"""Program `pid`: move axes to positions with the position loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.axis_program import AxisProgram, BumplessController, PointToPoint
from cdpr_rt.programs.base import CommandArguments
from cdpr_rt.programs.model import AxesModel

FURTHEST_RAD = 1e4
"""Largest distance of one command."""
_SLOWEST_RAD_S = 1e-4

_Target = tuple[str, FloatArray, FloatArray]


class PidProgram(AxisProgram):
    """Moves the axes to positions with a trapezoidal profile that is computed again every cycle."""

    name = "pid"
    needs_lease = True

    def __init__(self, model: AxesModel, loop: BumplessController) -> None:
        super().__init__(model, loop)
        self._motion = PointToPoint(model)
        self._has_target = False

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until a position is commanded."""
        super().start(feedback, setpoint, torque_Nm)
        self._motion.stay(setpoint)
        self._has_target = False

    def progress(self) -> dict[str, Any]:
        """Return the target and the share of the distance covered."""
        done = self._motion.part_done(self._setpoint)
        return {"target_rad": self._motion.target_rad.tolist(), "done": done}

    def check(self, arguments: Mapping[str, Any]) -> _Target:
        """Return checked arguments for `apply`; raises ProgramError."""
        keys = CommandArguments(
            self.name, arguments, ("position_rad", "distance_rad", "cable_m", "speed_rad_s")
        )
        key = keys.one_of("position_rad", "distance_rad", "cable_m")
        limit = np.full(self._model.n, FURTHEST_RAD)
        cable = self._model.cable_m_per_rad
        if key == "cable_m":
            distance = keys.axes(key, limit * np.abs(cable), optional=True) / cable
        else:
            distance = keys.axes(key, limit, optional=True)
        limits = self._model.speed_rad_s
        fastest = float(limits.max())
        speed = keys.number("speed_rad_s", _SLOWEST_RAD_S, fastest, fastest)
        return key, distance, np.minimum(limits, speed)

    def _apply(self, checked: _Target) -> None:
        key, distance, speed = checked
        setpoint = self._setpoint
        position, velocity = setpoint.position_rad, setpoint.velocity_rad_s
        target = distance if key == "position_rad" else position + distance
        stop = position + 0.5 * velocity * np.abs(velocity) / self._model.acceleration_rad_s2
        self._motion.set_out(np.where(np.isnan(distance), stop, target), setpoint, speed)
        self._has_target = True

    def _move(self, setpoint: Setpoint) -> bool:
        if not self._has_target:
            at_rest = self._brake(setpoint)
            self._motion.stay(setpoint)
            return at_rest
        return self._motion.move(setpoint)
