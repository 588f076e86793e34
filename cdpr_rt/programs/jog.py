"""Program `jog`: turn at a commanded speed while the command is renewed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.axis_program import AxisProgram, BumplessController
from cdpr_rt.programs.base import CommandArguments
from cdpr_rt.programs.model import AxesModel

DEFAULT_TIMEOUT_S = 0.5
LONGEST_TIMEOUT_S = 2.0
LONGEST_S = 3600.0
"""Longest duration of one jog."""


_DURATION: Final = "duration_s"
_Jog = tuple[FloatArray, float, float]
"""Speeds (n,), time-out, duration."""


class JogProgram(AxisProgram):
    """Turns the axes at commanded speeds; brakes if the command is not renewed in time.

    With `duration_s` it also brakes after that total time. From standstill, an axis then turns by
    speed times duration in total, because braking takes as long as accelerating. Time is counted in
    cycles: one period per call of `update`.
    """

    name = "jog"
    needs_lease = True

    def __init__(self, model: AxesModel, loop: BumplessController) -> None:
        super().__init__(model, loop)
        self._speed = np.zeros(model.n)
        self._cycles_left = self._cycles = 0
        self._duration: float = math.inf

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until speeds are commanded."""
        super().start(feedback, setpoint, torque_Nm)
        self._cycles_left = self._cycles = 0
        self._duration = math.inf

    def progress(self) -> dict[str, Any]:
        """Return the commanded speeds, the time for which they last without renewal, and `done`.

        `done` is the elapsed share of the duration, if one was given.
        """
        left = self._cycles_left * self._model.period_s
        done = min(1.0, self._cycles / self._duration)
        return {"velocity_rad_s": self._speed.tolist(), "left_s": left, "done": done}

    def check(self, arguments: Mapping[str, Any]) -> _Jog:
        """Return checked arguments for `apply`; raises ProgramError."""
        keys = CommandArguments(
            self.name, arguments, ("velocity_rad_s", "cable_velocity_m_s", "timeout_s", _DURATION)
        )
        limit, cable = self._model.speed_rad_s, self._model.cable_m_per_rad
        if keys.one_of("velocity_rad_s", "cable_velocity_m_s") == "velocity_rad_s":
            speed = keys.axes("velocity_rad_s", limit)
        else:
            speed = keys.axes("cable_velocity_m_s", limit * np.abs(cable)) / cable
        shortest = self._model.period_s
        timeout = keys.number("timeout_s", shortest, LONGEST_TIMEOUT_S, DEFAULT_TIMEOUT_S)
        duration = math.inf
        if _DURATION in keys:
            duration = keys.number(_DURATION, shortest, LONGEST_S, LONGEST_S)
        return speed, timeout, duration

    def _apply(self, checked: _Jog) -> None:
        self._speed[:], timeout, duration = checked
        self._cycles_left = max(1, round(timeout / self._model.period_s))
        self._duration = (
            duration if duration == math.inf else round(duration / self._model.period_s)
        )

    def _move(self, setpoint: Setpoint) -> bool:
        if self._cycles_left == 0 or self._cycles >= self._duration:
            self._speed[:] = 0.0
            return self._brake(setpoint)
        self._cycles_left -= 1
        self._cycles += 1
        self._ramp(self._speed, setpoint)
        return False
