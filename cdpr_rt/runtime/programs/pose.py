"""Moving a platform: to positions, or as a hand leads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.approach import approach, attend
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.runtime.pose_stream import PoseStream, StreamState
from cdpr_rt.runtime.programs.base import ProgramError
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.runtime.programs.wanted import Wanted
from cdpr_rt.runtime.stream_buttons import CLUTCH

_SLOWEST_m_s = 1e-4
_LEAD_S = 0.3
_ASLEEP_m = 5e-5
_LEAST_SHARE = 1e-6
_ANYWHERE_m = 1e3
# what keeps a hand's target from following it
_FREE, _EDGE, _STANDS = 0, 1, 2
_HELD = ("", "at the edge of the workspace", "below the workspace, as on its stand: up first")
_BELOW_m = 1e-3


@jit
def _lead(
    scale: float,
    pose: FloatArray,
    last: FloatArray,
    low: FloatArray,
    high: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    position: FloatArray,
    target: FloatArray,
    goal: FloatArray,
) -> int:
    """Write where the target is to go when the hand has moved, within the box and within reach."""
    edge, up = _FREE, goal.size - 1
    stands = position[up] < low[up] - _BELOW_m
    for i in range(goal.size):
        moved = scale * (pose[i] - last[i])
        last[i] = pose[i]
        # what may touch its stand is not dragged along it
        if stands and i != up:
            edge = _STANDS if moved != 0.0 else edge
            moved = 0.0
        goal[i] = target[i] + (moved if math.isfinite(moved) else 0.0)
        # a platform that is slower than the hand is not to run on after the hand has stopped
        reach = speed[i] * (0.5 * speed[i] / acceleration[i] + _LEAD_S)
        goal[i] = min(max(goal[i], position[i] - reach), position[i] + reach)
        # what stands outside the box, as the stand may, is not pulled into it
        least, most = min(low[i], target[i]), max(high[i], target[i])
        if goal[i] < least or goal[i] > most:
            edge = max(edge, _EDGE)
            goal[i] = min(max(goal[i], least), most)
    return edge


class PoseProgram(PlatformProgram):
    """Takes the platform to a position, or along with the set-point stream.

    The trapezoidal profile of Tremblay (thesis), eq. (2.10) to (2.12), in each direction, planned
    anew every cycle; from rest to a position both directions share their time, so that the way is
    straight. A hand that leads moves the target by what it moves, times the stream's scale, as long
    as the clutch is not pressed; while it is, the platform comes to rest and stays. No target
    leaves the workspace, and nothing moves where it could not be stopped within it.
    """

    name = "pose"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, stream: PoseStream) -> None:
        super().__init__(parts, torque_Nm)
        platform = parts.platform
        self._low = np.array(platform.workspace_min_m)
        self._high = np.array(platform.workspace_max_m)
        self._acceleration = np.array(parts.acceleration_m_s2)
        self.stream = stream
        self._following = False
        self._epoch = -1
        self._hand, self._goal, self._seen_goal = np.zeros(2), np.zeros(2), np.zeros(2)
        self._awake = 0.0
        self._held = _FREE
        self._clutched = False
        self._aim: FloatArray | None = None
        self._aiming = False
        self._inside = False
        self._before = np.zeros((3, 2))
        # compiled here, not when a hand begins to lead
        self._led()
        attend(self._target, self._control.position_m, self._awake, _ASLEEP_m, self._goal)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until a position is wanted."""
        super().start(feedback, setpoint, torque_Nm)
        self._acceleration[:] = self._parts.acceleration_m_s2
        self._following = self._aiming = False
        self._held = _FREE

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._acceleration[:] = self._parts.acceleration_m_s2
        super().stop()

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
        told = super().progress()
        told["left_m"] = None if self._aim is None else self._aim.tolist()
        if self._following:
            told |= {"stream": self.stream.state.name.lower(), **self.stream.counts()}
        return told

    def _held_back(self) -> str:
        """Return why set-point or target do not go on, an empty text where they do."""
        lags = super()._held_back()
        if lags or not self._following:
            return lags
        missing = self._control.feasible(self._seen_goal)
        if missing:
            return f"{self._seen_goal[0]:.3f}, {self._seen_goal[1]:.3f} m: {missing}"
        return _HELD[self._held]

    # -- what is wanted

    def _parsed(self, wanted: Mapping[str, Any]) -> tuple[str, FloatArray | None, float]:
        keys = Wanted(self.name, wanted, ("position_m", "stream", "resume", "speed_m_s"))
        most = float(self._parts.speed_m_s[0])
        speed = keys.number("speed_m_s", _SLOWEST_m_s, most, most)
        if not self._parts.tight:
            raise ProgramError("pose: the cables are not tight; run tighten first")
        if not wanted:
            return "stay", None, speed
        what = keys.one_of("position_m", "stream", "resume")
        if what == "position_m":
            return what, self._position(keys), speed
        if wanted[what] is not True:
            raise ProgramError(f"pose: {what}: value {wanted[what]!r}; allowed: true")
        if what == "resume" and self._aim is None:
            raise ProgramError("pose: resume: no target has been left; allowed: position_m")
        return what, self._aim, speed

    def _position(self, keys: Wanted) -> FloatArray:
        position = keys.axes("position_m", np.full(2, _ANYWHERE_m))
        for i, (low, high) in enumerate(zip(self._low, self._high, strict=True)):
            if not low <= position[i] <= high:
                raise ProgramError(
                    f"pose: position_m[{i}]: value {position[i]:g} m; allowed: {low:g} to "
                    f"{high:g} m, the workspace"
                )
        missing = self._control.feasible(position)
        if missing:
            raise ProgramError(f"pose: position_m: value {position.tolist()}: {missing}")
        missing = self._control.feasible_way(position)
        if missing:
            raise ProgramError(
                f"pose: position_m: value {position.tolist()}: on the way, {missing}"
            )
        return position

    def _take(self, parsed: tuple[str, FloatArray | None, float]) -> None:
        what, position, speed = parsed
        self._speed[:] = speed
        self._acceleration[:] = self._parts.acceleration_m_s2
        self._following = what == "stream"
        self._aiming = what in ("position_m", "resume")
        if self._following:
            self.stream.reset()
            self._aim = None
            self._awake = 0.0
        if not self._aiming or position is None:
            self._target[:] = self._resting_place()
            return
        self._target[:] = position
        self._aim = np.array(position)
        if not self._control.velocity_m_s.any():
            self._go_straight()

    def _go_straight(self) -> None:
        """Have both directions take the same time."""
        way = np.abs(self._target - self._control.position_m)
        longest = float(way.max())
        if longest > 0.0:
            share = np.maximum(way / longest, _LEAST_SHARE)
            self._speed *= share
            self._acceleration *= share

    # -- cycle by cycle

    def _move(self) -> bool:
        if self._following:
            self._follow()
            return False
        at_rest = self._advance(self._target)
        if at_rest and self._aiming:
            self._aim = None
        return at_rest

    def _approach(self) -> bool:
        return self._go_towards(self._target)

    def _follow(self) -> None:
        stream, control = self.stream, self._control
        state = stream.update()
        if state is StreamState.STOPPED:
            self._target[:] = self._resting_place()
        elif stream.epoch != self._epoch or stream.buttons & CLUTCH or self._clutched:
            # in the cycle in which the clutch closes part of the way was still made without leading
            if stream.epoch != self._epoch or not self._clutched:
                self._target[:] = self._resting_place()
            self._epoch = stream.epoch
            self._hand[:] = stream.pose[:2]
        else:
            self._led()
        self._clutched = bool(stream.buttons & CLUTCH)
        self._awake = attend(self._target, control.position_m, self._awake, _ASLEEP_m, self._goal)
        self._advance(self._goal)

    def _led(self) -> None:
        """Move the target as the hand has moved, or as far as it may go."""
        control, goal, target = self._control, self._goal, self._target
        self._held = _lead(
            self.stream.scale, self.stream.pose, self._hand, self._low, self._high,
            self._speed, self._acceleration, control.position_m, target, goal,
        )  # fmt: skip
        self._seen_goal[:] = goal
        if control.stands(goal) or not control.stands(target):
            target[:] = goal
            return
        # along the edge in one direction, where not in both
        for i in range(2):
            kept, target[i] = target[i], goal[i]
            if control.stands(target):
                return
            target[i] = kept

    def _advance(self, goal: FloatArray) -> bool:
        """Go one cycle towards a goal, or brake where the next place to stop would not do."""
        control, before = self._control, self._before
        before[0], before[1] = control.position_m, control.velocity_m_s
        before[2] = control.acceleration_m_s2
        arrived = self._go_towards(goal)
        stops = control.stands(self._resting_place())
        if self._inside and not stops:
            control.position_m[:], control.velocity_m_s[:] = before[0], before[1]
            control.acceleration_m_s2[:] = before[2]
            self._acceleration[:] = self._parts.acceleration_m_s2
            self._go_towards(self._resting_place())
            return False
        self._inside = stops
        return arrived

    def _go_towards(self, goal: FloatArray) -> bool:
        control = self._control
        return approach(
            goal,
            self._pace(),
            self._acceleration,
            self._parts.period_s,
            control.position_m,
            control.velocity_m_s,
            control.acceleration_m_s2,
        )
