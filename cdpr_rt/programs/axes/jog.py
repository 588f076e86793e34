"""Program `jog`: turn at a commanded speed while the command is renewed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.core.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.motion.approach import ramp_velocity
from cdpr_rt.programs.arguments import CommandArguments
from cdpr_rt.programs.axes.axis_program import AxisProgram, BumplessController
from cdpr_rt.programs.model import RobotModel

DEFAULT_TIMEOUT_S = 0.5
LONGEST_TIMEOUT_S = 2.0


class JogProgram(AxisProgram):
    """Turns the axes at commanded speeds; brakes when the command is not renewed in time.

    Time is counted in cycles: a period a call of `update`.
    """

    name = "jog"
    needs_lease = True

    def __init__(self, model: RobotModel, loop: BumplessController) -> None:
        super().__init__(model, loop)
        self._speed = np.zeros(model.n)
        self._cycles_left = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until speeds are commanded."""
        super().start(feedback, setpoint, torque_Nm)
        self._cycles_left = 0

    def progress(self) -> dict[str, Any]:
        """Return the commanded speeds, and how long they hold without being renewed."""
        left = self._cycles_left * self._model.period_s
        return {"velocity_rad_s": self._speed.tolist(), "left_s": left}

    def _parsed(self, arguments: Mapping[str, Any]) -> tuple[FloatArray, float]:
        keys = CommandArguments(
            self.name, arguments, ("velocity_rad_s", "cable_velocity_m_s", "timeout_s")
        )
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
        ramp_velocity(
            self._speed,
            self._model.acceleration_rad_s2,
            self._model.period_s,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            setpoint.acceleration_rad_s2,
        )
        return False
