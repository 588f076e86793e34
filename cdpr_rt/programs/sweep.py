"""Program `sweep`: slow turns back and forth, from which cogging is identified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import Proportional
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.axis_program import AxisProgram, PointToPoint
from cdpr_rt.programs.base import BumplessTransfer, CommandArguments
from cdpr_rt.programs.model import AxesModel

DEFAULT_SPEED_RAD_S = math.radians(3.0)
FURTHEST_RAD = 100.0 * math.tau
_SLOWEST_RAD_S, _FASTEST_RAD_S = math.radians(0.1), math.radians(60.0)
_MOST_LEGS = 1000

_Sweep = tuple[FloatArray, float, int]


class SweepProgram(AxisProgram):
    """Turns the axes by their distances and back, leg by leg (Tremblay, section 1.3).

    With the proportional controller, friction and load leave a steady error, so the program is
    meant for motors without cables or with slack cables.
    """

    name = "sweep"
    needs_lease = True

    def __init__(self, model: AxesModel) -> None:
        controller = Proportional(model.sweep_gain_Nm_rad, model.torque_Nm)
        super().__init__(model, BumplessTransfer(controller, model.torque_Nm, model.period_s))
        self._motion = PointToPoint(model)
        self._start = np.zeros(model.n)
        self._distance = np.zeros(model.n)
        self._speed = np.ones(model.n)
        self._legs = self._leg = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until a sweep is commanded."""
        super().start(feedback, setpoint, torque_Nm)
        self._legs = self._leg = 0

    def progress(self) -> dict[str, Any]:
        """Return the number of the leg, the total, and the share of the leg that is done."""
        if self._leg == self._legs:
            return {"leg": self._leg, "legs": self._legs, "done": 1.0}
        done = self._motion.part_done(self._setpoint)
        return {"leg": self._leg + 1, "legs": self._legs, "done": done}

    def check(self, arguments: Mapping[str, Any]) -> _Sweep:
        """Return checked arguments for `apply`; raises ProgramError."""
        keys = CommandArguments(self.name, arguments, ("distance_rad", "speed_rad_s", "legs"))
        distance = keys.axes("distance_rad", np.full(self._model.n, FURTHEST_RAD))
        fastest = min(_FASTEST_RAD_S, float(self._model.speed_rad_s.min()))
        speed = keys.number("speed_rad_s", _SLOWEST_RAD_S, fastest, DEFAULT_SPEED_RAD_S)
        return distance, speed, keys.whole("legs", 1, _MOST_LEGS, 2)

    def _apply(self, checked: _Sweep) -> None:
        self._distance[:], speed, self._legs = checked
        self._speed[:] = speed
        self._start[:] = self._setpoint.position_rad
        self._leg = 0
        self._set_out()

    def _set_out(self) -> None:
        forth = self._leg % 2 == 0
        target = self._start + self._distance if forth else self._start
        self._motion.set_out(target, self._setpoint, self._speed)

    def _move(self, setpoint: Setpoint) -> bool:
        if self._leg == self._legs:
            return self._brake(setpoint)
        if self._motion.move(setpoint):
            self._leg += 1
            if self._leg < self._legs:
                self._set_out()
        return self._leg == self._legs
