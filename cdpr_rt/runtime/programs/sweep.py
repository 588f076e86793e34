"""Slow turns back and forth under a proportional controller, from which cogging is identified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.controllers.proportional import Proportional
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime.programs.axis_program import AxisProgram
from cdpr_rt.runtime.programs.handover import Handover
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.travel import Travel
from cdpr_rt.runtime.programs.wanted import Wanted

DEFAULT_SPEED_RAD_S = math.radians(3.0)
FURTHEST_RAD = 100.0 * math.tau
_SLOWEST_RAD_S, _FASTEST_RAD_S = math.radians(0.1), math.radians(60.0)
_MOST_LEGS = 1000

_Sweep = tuple[FloatArray, float, int]


class SweepProgram(AxisProgram):
    """Turns the axes by their distances and back, leg by leg (Tremblay, section 1.3).

    What an axis settles at under the proportional gain differs from its set-point by friction and
    load: it is for motors whose cables are off or slack.
    """

    name = "sweep"
    needs_lease = True

    def __init__(self, model: RobotModel) -> None:
        controller = Proportional(model.sweep_gain_Nm_rad, model.torque_Nm)
        super().__init__(model, Handover(controller, model.torque_Nm, model.period_s))
        self._travel = Travel(model)
        self._start = np.zeros(model.n)
        self._distance = np.zeros(model.n)
        self._speed = np.ones(model.n)
        self._legs = self._leg = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until a sweep is wanted."""
        super().start(feedback, setpoint, torque_Nm)
        self._legs = self._leg = 0

    def progress(self) -> dict[str, Any]:
        """Return which leg of how many is run and how much of it has been."""
        if self._leg == self._legs:
            return {"leg": self._leg, "legs": self._legs, "done": 1.0}
        done = self._travel.part_done(self._setpoint)
        return {"leg": self._leg + 1, "legs": self._legs, "done": done}

    def _parsed(self, wanted: Mapping[str, Any]) -> _Sweep:
        keys = Wanted(self.name, wanted, ("distance_rad", "speed_rad_s", "legs"))
        distance = keys.axes("distance_rad", np.full(self._model.n, FURTHEST_RAD))
        fastest = min(_FASTEST_RAD_S, float(self._model.speed_rad_s.min()))
        speed = keys.number("speed_rad_s", _SLOWEST_RAD_S, fastest, DEFAULT_SPEED_RAD_S)
        return distance, speed, keys.whole("legs", 1, _MOST_LEGS, 2)

    def _take(self, parsed: _Sweep) -> None:
        self._distance[:], speed, self._legs = parsed
        self._speed[:] = speed
        self._start[:] = self._setpoint.position_rad
        self._leg = 0
        self._set_out()

    def _set_out(self) -> None:
        forth = self._leg % 2 == 0
        target = self._start + self._distance if forth else self._start
        self._travel.set_out(target, self._setpoint, self._speed)

    def _move(self, setpoint: Setpoint) -> bool:
        if self._leg == self._legs:
            return self._brake(setpoint)
        if self._travel.move(setpoint):
            self._leg += 1
            if self._leg < self._legs:
                self._set_out()
        return self._leg == self._legs
