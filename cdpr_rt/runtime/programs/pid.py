"""Going to positions under the position loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime.programs.axis_program import AxisProgram, Loop
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.travel import Travel
from cdpr_rt.runtime.programs.wanted import Wanted

FURTHEST_RAD = 1e4
"""How far one command may send an axis."""
_SLOWEST_RAD_S = 1e-4

_Target = tuple[str, FloatArray, FloatArray]


class PidProgram(AxisProgram):
    """Takes the axes to positions, on a trapezoidal profile that is planned anew every cycle."""

    name = "pid"
    needs_lease = True

    def __init__(self, model: RobotModel, loop: Loop) -> None:
        super().__init__(model, loop)
        self._travel = Travel(model)
        self._ordered = False

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until a position is wanted."""
        super().start(feedback, setpoint, torque_Nm)
        self._travel.stay(setpoint)
        self._ordered = False

    def progress(self) -> dict[str, Any]:
        """Return the target and how much of the way has been run."""
        done = self._travel.part_done(self._setpoint)
        return {"target_rad": self._travel.target_rad.tolist(), "done": done}

    def _parsed(self, wanted: Mapping[str, Any]) -> _Target:
        keys = Wanted(self.name, wanted, ("position_rad", "distance_rad", "cable_m", "speed_rad_s"))
        key = keys.one_of("position_rad", "distance_rad", "cable_m")
        limit = np.full(self._model.n, FURTHEST_RAD)
        cable = self._model.cable_m_per_rad
        if key == "cable_m":
            way = keys.axes(key, limit * np.abs(cable), may_stay=True) / cable
        else:
            way = keys.axes(key, limit, may_stay=True)
        speed = self._model.speed_rad_s
        most = keys.number("speed_rad_s", _SLOWEST_RAD_S, float(speed.max()), float(speed.max()))
        return key, way, np.minimum(speed, most)

    def _take(self, parsed: _Target) -> None:
        key, way, speed = parsed
        setpoint = self._setpoint
        here, pace = setpoint.position_rad, setpoint.velocity_rad_s
        there = way if key == "position_rad" else here + way
        stop = here + 0.5 * pace * np.abs(pace) / self._model.acceleration_rad_s2
        self._travel.set_out(np.where(np.isnan(way), stop, there), setpoint, speed)
        self._ordered = True

    def _move(self, setpoint: Setpoint) -> bool:
        if not self._ordered:
            at_rest = self._brake(setpoint)
            self._travel.stay(setpoint)
            return at_rest
        return self._travel.move(setpoint)
