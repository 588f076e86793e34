"""Turning at a speed for as long as somebody keeps asking for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.approach import change_pace
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime.programs.axis_program import AxisProgram, Loop
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.wanted import Wanted

DEFAULT_TIMEOUT_S = 0.5
LONGEST_TIMEOUT_S = 2.0


class JogProgram(AxisProgram):
    """Turns the axes at the speeds wanted; brakes when they are not asked for again in time.

    Time is that of the cycles: a period a call of `update`.
    """

    name = "jog"
    needs_lease = True

    def __init__(self, model: RobotModel, loop: Loop) -> None:
        super().__init__(model, loop)
        self._speed = np.zeros(model.n)
        self._cycles_left = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until speeds are wanted."""
        super().start(feedback, setpoint, torque_Nm)
        self._cycles_left = 0

    def progress(self) -> dict[str, Any]:
        """Return the speeds that are wanted, and for how long they are without being renewed."""
        left = self._cycles_left * self._model.period_s
        return {"velocity_rad_s": self._speed.tolist(), "left_s": left}

    def _parsed(self, wanted: Mapping[str, Any]) -> tuple[FloatArray, float]:
        keys = Wanted(self.name, wanted, ("velocity_rad_s", "cable_velocity_m_s", "timeout_s"))
        limit, cable = self._model.speed_rad_s, self._model.cable_m_per_rad
        if keys.one_of("velocity_rad_s", "cable_velocity_m_s") == "velocity_rad_s":
            speed = keys.axes("velocity_rad_s", limit)
        else:
            speed = keys.axes("cable_velocity_m_s", limit * np.abs(cable)) / cable
        shortest = self._model.period_s
        return speed, keys.number("timeout_s", shortest, LONGEST_TIMEOUT_S, DEFAULT_TIMEOUT_S)

    def _take(self, parsed: tuple[FloatArray, float]) -> None:
        self._speed[:], timeout = parsed
        self._cycles_left = max(1, round(timeout / self._model.period_s))

    def _move(self, setpoint: Setpoint) -> bool:
        if self._cycles_left == 0:
            self._speed[:] = 0.0
            return self._brake(setpoint)
        self._cycles_left -= 1
        change_pace(
            self._speed,
            self._model.acceleration_rad_s2,
            self._model.period_s,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            setpoint.acceleration_rad_s2,
        )
        return False
