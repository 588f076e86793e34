"""Program `path`: follow a planned path; pause on it, step back, resume it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.motion.trajectory import stopping_position
from cdpr_rt.programs import path_store as playback
from cdpr_rt.programs.base import CommandArguments, ProgramError
from cdpr_rt.programs.path_store import StoredPlan
from cdpr_rt.programs.platform_program import (
    PlatformParts,
    PlatformProgram,
    along_velocity,
    synchronise,
)
from cdpr_rt.refusal import CommandRefusal, RefusalCode

_KEYS: Final = ("plan", "resume", "pause", "back_m", "feed")
_SLOWEST: Final = 0.01
_FARTHEST_BACK_m: Final = 1000.0
_LAGS_m, _WAITS_m = 0.02, 0.05


@dataclass(frozen=True)
class _Command:
    what: str
    """One of `_KEYS`."""
    plan: StoredPlan | None
    begins_s: float
    """Time in the plan at which the path begins."""
    back_s: float
    """Time in the plan to step back to."""
    feed: float
    on_way: bool = False
    """Whether the straight line to the place where the path begins has been checked."""


class PathProgram(PlatformProgram):
    """Plays a plan from its beginning or from where it was left, after a straight line to there.

    A plan is read and checked against the robot's limits before the command is accepted. The feed
    scales the time along the plan, so the set-point stays on the path whatever the feed.
    It also stays on the path in every stop of this program, and in the program `hold` afterwards.
    """

    name = "path"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self.store = parts.paths
        d = parts.model.size
        self._plan: StoredPlan | None = None
        self._samples, self._period_s = np.zeros((2, 3, d)), 1.0
        self._state, (self._derivatives, self._setpoint) = np.zeros(2), np.zeros((2, 3, d))
        self._stage = ""
        self._goal = self._feed = 0.0
        self._paused = ""
        self._last_cycle = -2
        # this call compiles the kernel before a path begins
        self._samples[:, 0] = parts.model.home
        self._samples.flags.writeable = False
        self._play(0.0)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point; if this is on the path, it stays on the path."""
        if self.is_on_path(feedback.cycle):
            self._stopping = self._at_rest = False
            self._arrival.restart()
            self._paused = self._paused or "paused"
            return
        super().start(feedback, setpoint, torque_Nm)
        self._stage = ""
        self._state[playback.RATE] = 0.0

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        self._last_cycle = feedback.cycle
        super().update(feedback, setpoint, torque_Nm)

    def is_on_path(self, cycle: int) -> bool:
        """Whether this program moved the set-point up to this cycle, and it is on the path."""
        return self._stage == "path" and cycle - self._last_cycle in (0, 1)

    def left(self) -> dict[str, Any] | None:
        """Return the path that can be resumed, or None."""
        if self._plan is None or self.store.unfinished is None:
            return None
        return self._as_status(self._plan)

    def progress(self) -> dict[str, Any]:
        """Return the platform's state and the progress along the path."""
        state = super().progress()
        if self._plan is not None:
            state["path"] = self._as_status(self._plan)
        return state

    def _as_status(self, plan: StoredPlan) -> dict[str, Any]:
        time_s = float(self._state[playback.TIME])
        row = plan.row(time_s)
        return {
            "name": plan.title,
            "plan": plan.name,
            "stage": self._stage,
            "waiting": self._paused,
            "time_s": time_s,
            "duration_s": plan.duration_s,
            "feed": self._feed,
            "line": int(plan.line[row]),
            "along_m": float(plan.along_m[row] - plan.along_m[0]),
            "length_m": float(plan.along_m[-1] - plan.along_m[0]),
        }

    # -- commands

    def preparation(self, arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        """Return a function that loads the commanded plan, None if it is in memory."""
        name, left = arguments.get("plan"), self.store.unfinished
        if name is None and left is not None and ("resume" in arguments or "back_m" in arguments):
            name = left[0]
        if not isinstance(name, str) or self.store.is_loaded(name):
            return None
        return partial(self.store.load, name)

    def check(self, arguments: Mapping[str, Any]) -> _Command:
        """Return checked arguments for `apply`; raises ProgramError."""
        keys = CommandArguments(self.name, arguments, _KEYS)
        feed = keys.number("feed", _SLOWEST, 1.0, self._feed or 1.0)
        self._require_pose()
        if set(arguments) == {"feed"}:
            return _Command("feed", None, 0.0, 0.0, feed)
        key = keys.one_of("plan", "resume", "pause", "back_m")
        if key in ("resume", "pause") and arguments[key] is not True:
            raise ProgramError(f"path: {key}: value {arguments[key]!r}; allowed: true")
        if key == "pause":
            return _Command(key, None, 0.0, 0.0, feed)
        if key == "plan":
            plan, time_s = self.store.plan(str(arguments["plan"])), 0.0
            feed = keys.number("feed", _SLOWEST, 1.0, 1.0)
        else:
            plan, time_s = self._taken_up(key)
        on_way = key == "plan" or not self._follows(plan)
        if on_way:
            self._require_way(plan, time_s)
        back_s = time_s
        if key == "back_m":
            back_m = keys.number("back_m", 0.0, _FARTHEST_BACK_m, 0.0)
            along_m = plan.along_m[plan.row(time_s)] - back_m
            back_s = plan.period_s * plan.row_along(along_m)
        return _Command(key, plan, time_s, back_s, feed, on_way)

    def _follows(self, plan: StoredPlan) -> bool:
        """Return whether the set-point is on this plan and no other program has moved it."""
        known = self._plan is not None and self._plan.name == plan.name
        return known and self._stage == "path" and self._last_cycle == self._parts.cycle

    def _taken_up(self, key: str) -> tuple[StoredPlan, float]:
        """Return the interrupted plan and the time up to which it was followed."""
        left = self.store.unfinished
        if left is None:
            nothing = {"left": "path", "instead": "plan"}
            asked = {key: True}
            raise ProgramError(CommandRefusal(RefusalCode.NOTHING_LEFT, self.name, asked, nothing))
        name, time_s = left
        plan = self._plan
        if plan is None or plan.name != name:
            plan = self.store.plan(name)
        elif self._follows(plan):
            time_s = float(self._state[playback.TIME])
        return plan, min(max(time_s, 0.0), plan.duration_s)

    def _require_way(self, plan: StoredPlan, time_s: float) -> None:
        """Raise ProgramError if the straight line to the position at a time is not feasible."""
        control, begin = self._control, np.array(plan.samples[plan.row(time_s), 0])
        acceleration, stop = np.zeros((2, begin.size))
        along_velocity(control.velocity, self._parts.acceleration, acceleration)
        stopping_position(control.position, control.velocity, acceleration, stop)
        obstacle = control.infeasibility(begin) or control.way_infeasibility(begin, stop)
        if obstacle:
            why = {"why": f"on the way to the start of the path: {obstacle}"}
            raise ProgramError(CommandRefusal(RefusalCode.NOT_FEASIBLE, self.name, arguments=why))

    def _apply(self, command: _Command) -> None:
        self._feed = command.feed
        if command.what == "feed":
            return
        if command.what == "pause":
            self._paused = "paused"
            if self._stage == "to the path":
                self._brake()
                self._stage = "set out"
            return
        plan = command.plan
        assert plan is not None  # all other commands have a plan
        self._paused = "stepping back" if command.what == "back_m" else ""
        if self._stage == "path" and command.what != "plan":
            self._goal = command.back_s if command.what == "back_m" else self._next_stop(plan)
            return
        if not command.on_way:  # another program has moved the platform off the path
            self._require_way(plan, command.begins_s)
        self._plan, self._samples, self._period_s = plan, plan.samples, plan.period_s
        self._state[playback.TIME], self._state[playback.RATE] = command.begins_s, 0.0
        self._stage = "set out"
        self._brake()
        self.store.mark_begun(plan.name, command.begins_s)
        self._goal = command.back_s if command.what == "back_m" else self._next_stop(plan)

    def _next_stop(self, plan: StoredPlan) -> float:
        """Return the time of the next wait of the plan, or of its end."""
        time_s = self._state[playback.TIME]
        waits = plan.waits_s[plan.waits_s > time_s + 0.5 * plan.period_s]
        return float(waits[0]) if waits.size else plan.duration_s

    # -- cycle by cycle

    def _move(self) -> bool:
        if self._stage == "path":
            return self._follow()
        at_rest = self._go_towards(self._target)
        if self._stage == "set out" and at_rest and self._paused != "paused":
            self._set_out()
        elif self._stage == "to the path" and at_rest:
            self._stage = "path"
            self._setpoint[0] = self._target
        return at_rest and not self._stage

    def _set_out(self) -> None:
        """Begin the straight line to the position at which the path begins or resumes."""
        control = self._control
        self._play(0.0)
        self._target[:] = self._setpoint[0]
        self._speed[:] = self._parts.speed
        self._acceleration[:] = self._parts.acceleration
        synchronise(control.position, self._target, self._speed)
        synchronise(control.position, self._target, self._acceleration)
        self._stage = "to the path"

    def _follow(self) -> bool:
        """Move one cycle along the path; return whether it is finished."""
        stepping = self._paused == "stepping back"
        waits = bool(self._paused) and not stepping
        rests = self._play(0.0 if waits else self._feed * self._share())
        self._write()
        if not rests or waits:
            return False
        if stepping:
            self._paused = "stepped back"
            return False
        plan = self._plan
        if plan is not None and self._goal < plan.duration_s:
            self._paused = "the path waits here"
            return False
        self.store.mark_finished()
        return True

    def _share(self) -> float:
        """Return the factor that reduces the feed while the platform lags behind its set-point."""
        share = (_WAITS_m - self._lag_m()) / (_WAITS_m - _LAGS_m)
        return min(max(share, 1e-3), 1.0)

    def _play(self, rate: float) -> bool:
        return playback.play(
            self._samples, self._period_s, self._parts.period_s, self._goal, rate,
            self._parts.acceleration, self._state, self._derivatives, self._setpoint,
        )  # fmt: skip

    def _write(self) -> None:
        control = self._control
        control.position[:], control.velocity[:] = self._setpoint[0], self._setpoint[1]
        control.acceleration[:] = self._setpoint[2]
        self._target[:] = self._setpoint[0]
        self.store.mark_progress(self._state[playback.TIME])

    def _approach(self) -> bool:
        """Bring the set-point to rest, on the path if it is on it."""
        if self._stage != "path":
            return super()._approach()
        at_rest = self._play(0.0)
        self._write()
        return at_rest

    def _brake(self) -> None:
        if self._stage != "path":
            super()._brake()
