"""Moving a platform: to positions, or as a hand leads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.runtime.pose_stream import PoseStream, StreamState
from cdpr_rt.runtime.programs.base import ProgramError
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.runtime.programs.wanted import Wanted
from cdpr_rt.runtime.stream_buttons import CLUTCH

_SLOWEST_m_s = 1e-4


class PoseProgram(PlatformProgram):
    """Takes the platform to a position, or along with the set-point stream.

    The trapezoidal profile of Tremblay (thesis), eq. (2.10) to (2.12), in each direction, planned
    anew every cycle. A hand that leads moves the target by what it moves, times the stream's scale,
    as long as the clutch (button 0) is not pressed; no target leaves the workspace.
    """

    name = "pose"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, stream: PoseStream) -> None:
        super().__init__(parts, torque_Nm)
        platform = parts.platform
        self._low = np.array(platform.workspace_min_m)
        self._high = np.array(platform.workspace_max_m)
        self.stream = stream
        self._following = False
        self._epoch = -1
        self._hand = np.zeros(2)
        self._goal = np.zeros(2)
        self._refused = ""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until a position is wanted."""
        super().start(feedback, setpoint, torque_Nm)
        self._following = False
        self._refused = ""

    @property
    def stream_age_s(self) -> float:
        """Age of the newest sample, nan where no hand leads."""
        return self.stream.age_s if self._following else math.nan

    @property
    def stream_buttons(self) -> int:
        """The buttons of the sample that is played, 0 where no hand leads."""
        return self.stream.buttons if self._following else 0

    def progress(self) -> dict[str, Any]:
        """Return where the platform is, where it goes, and what the stream is worth."""
        told = {**super().progress(), "refused": self._refused}
        if self._following:
            told |= {"stream": self.stream.state.name.lower(), **self.stream.counts()}
        return told

    def _parsed(self, wanted: Mapping[str, Any]) -> tuple[FloatArray | None, float]:
        keys = Wanted(self.name, wanted, ("position_m", "stream", "speed_m_s"))
        most = float(self._parts.speed_m_s[0])
        speed = keys.number("speed_m_s", _SLOWEST_m_s, most, most)
        if not self._parts.tight:
            raise ProgramError("pose: the cables are not tight; run tighten first")
        if not wanted:
            return self._resting_place(), speed
        if keys.one_of("position_m", "stream") == "stream":
            if wanted["stream"] is not True:
                raise ProgramError(f"pose: stream: value {wanted['stream']!r}; allowed: true")
            return None, speed
        return self._position(keys), speed

    def _position(self, keys: Wanted) -> FloatArray:
        position = keys.axes("position_m", np.full(2, 1e3))
        for i, (low, high) in enumerate(zip(self._low, self._high, strict=True)):
            if not low <= position[i] <= high:
                raise ProgramError(
                    f"pose: position_m[{i}]: value {position[i]:g}; allowed: {low:g} to {high:g}, "
                    "the workspace"
                )
        missing = self._control.feasible(position)
        if missing:
            raise ProgramError(f"pose: position_m: value {position.tolist()}: {missing}")
        return position

    def _take(self, parsed: tuple[FloatArray | None, float]) -> None:
        position, speed = parsed
        self._speed[:] = speed
        self._following = position is None
        if position is None:
            self.stream.reset()
            self._target[:] = self._resting_place()
        else:
            self._target[:] = position

    def _move(self) -> bool:
        if self._following:
            self._follow()
            self._approach()
            return False
        return self._approach()

    def _follow(self) -> None:
        stream = self.stream
        if stream.update() is StreamState.STOPPED:
            self._target[:] = self._resting_place()
            return
        if stream.epoch != self._epoch or stream.buttons & CLUTCH:
            self._epoch = stream.epoch
            self._hand[:] = stream.pose[:2]
            return
        np.subtract(stream.pose[:2], self._hand, out=self._goal)
        self._goal *= stream.scale
        self._goal += self._target
        self._hand[:] = stream.pose[:2]
        np.clip(self._goal, self._low, self._high, out=self._goal)
        self._refused = self._control.feasible(self._goal)
        if not self._refused:
            self._target[:] = self._goal
