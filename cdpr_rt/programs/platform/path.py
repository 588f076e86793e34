"""Program `path`: follow a planned path; pause on it, step back, go on where it was left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdpr_rt.core.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.motion.approach import stopping_position
from cdpr_rt.programs.arguments import CommandArguments
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.platform import path_playback as playback
from cdpr_rt.programs.platform.path_store import StoredPlan
from cdpr_rt.programs.platform.platform_program import (
    PlatformParts,
    PlatformProgram,
    synchronise,
)
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.kinematics.pose_setpoint import place

_KEYS: Final = ("plan", "resume", "pause", "back_m", "feed")
_SLOWEST: Final = 0.01
_FARTHEST_BACK_m: Final = 1000.0
_CHECKED: Final = 1000
"""Samples that are looked at in one cycle."""
_HELD_EVERY: Final = 20
"""Of these samples one is looked at for whether the cables hold it, one in a cycle."""
_LAGS_m, _WAITS_m = 0.02, 0.05


@dataclass(frozen=True)
class _Command:
    what: str
    """Of `_KEYS`."""
    plan: StoredPlan | None
    time_s: float
    """Of the plan, where it is to begin, or to step back to."""
    feed: float


class PathProgram(PlatformProgram):
    """Plays a plan from where it begins, or where it was left; goes there in a straight line first.

    All of the plan is held against the robot's limits before it moves. The feed slows down the time
    along the plan: however it changes, the set-point stays on the path. So does every stop of this
    program, and `hold` after it.
    """

    name = "path"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self.store = parts.paths
        d, platform = parts.model.size, parts.platform
        self._low, self._high = (
            np.array(platform.workspace_min_m), np.array(platform.workspace_max_m),
        )  # fmt: skip
        self._workspace, self._there = parts.model.workspace(0.0), Pose(np.zeros(3))
        self._plan: StoredPlan | None = None
        self._samples, self._period_s = np.zeros((2, 3, d)), 1.0
        self._state, (self._derivatives, self._setpoint) = np.zeros(2), np.zeros((2, 3, d))
        self._stage = ""
        self._goal = self._feed = 0.0
        self._paused = ""
        self._checked = self._held = 0
        self._fault = ""
        self._last_cycle = -2
        # compiled here, not when a path begins
        self._samples[:, 0] = parts.model.home
        self._samples.flags.writeable = False
        self._play(0.0)
        self._look(0)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point; stays on the path where it is on it."""
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
        """Whether it has set the set-point up to a cycle, and that one is on the path."""
        return self._stage == "path" and cycle - self._last_cycle in (0, 1)

    def left(self) -> dict[str, Any] | None:
        """Return what there is to be taken up again, None for nothing."""
        if self._plan is None or self.store.left is None:
            return None
        return self._told(self._plan)

    def progress(self) -> dict[str, Any]:
        """Return the platform's state, and how far it has come."""
        state = super().progress()
        if self._plan is not None:
            state["path"] = self._told(self._plan)
        if self._fault:
            state |= {"trouble": self._fault, "done": 0.0}
        return state

    def _told(self, plan: StoredPlan) -> dict[str, Any]:
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

    def _parsed(self, arguments: Mapping[str, Any]) -> _Command:
        keys = CommandArguments(self.name, arguments, _KEYS)
        feed = keys.number("feed", _SLOWEST, 1.0, self._feed or 1.0)
        self._require_believed()
        if not self._parts.tight:
            raise ProgramError("path: the cables are not tight; run tighten first")
        if set(arguments) == {"feed"}:
            return _Command("feed", None, 0.0, feed)
        what = keys.one_of("plan", "resume", "pause", "back_m")
        if what in ("resume", "pause") and arguments[what] is not True:
            raise ProgramError(f"path: {what}: value {arguments[what]!r}; allowed: true")
        if what == "pause":
            return _Command(what, None, 0.0, feed)
        if what == "plan":
            plan, time_s = self.store.plan(str(arguments["plan"]), self._parts.model), 0.0
            feed = keys.number("feed", _SLOWEST, 1.0, 1.0)
        else:
            plan, time_s = self._taken_up()
        if self._stage != "path" or plan.name != getattr(self._plan, "name", ""):
            self._require_way(plan, time_s)
        if what == "back_m":
            back_m = keys.number("back_m", 0.0, _FARTHEST_BACK_m, 0.0)
            wanted = plan.along_m[plan.row(time_s)] - back_m
            time_s = plan.period_s * int(np.searchsorted(plan.along_m, wanted))
        return _Command(what, plan, time_s, feed)

    def _taken_up(self) -> tuple[StoredPlan, float]:
        """Return the plan that was left, and the time up to which it has come."""
        left = self.store.left
        if left is None:
            raise ProgramError("path: resume: no path has been left; allowed: plan")
        name, time_s = left
        plan = self._plan
        if plan is None or plan.name != name:
            plan = self.store.plan(name, self._parts.model)
        return plan, min(max(time_s, 0.0), plan.duration_s)

    def _require_way(self, plan: StoredPlan, time_s: float) -> None:
        """Raise ProgramError where the straight way to a place of the plan is not feasible."""
        control, there = self._control, np.array(plan.samples[plan.row(time_s), 0])
        here = np.zeros(there.size)
        stopping_position(control.position, control.velocity, self._parts.acceleration, here)
        missing = control.feasible(there) or control.feasible_path(there)
        if missing:
            raise ProgramError(f"path: on the way to where it begins: {missing}")

    def _take(self, command: _Command) -> None:
        self._feed = command.feed
        if command.what == "feed":
            return
        if command.what == "pause":
            self._paused = "paused"
            return
        plan = command.plan
        assert plan is not None  # all other commands have one
        self._paused = "stepping back" if command.what == "back_m" else ""
        if self._stage == "path" and command.what != "plan":
            self._goal = command.time_s if command.what == "back_m" else self._next_stop(plan)
            return
        left = self.store.left
        begins_s = 0.0 if command.what == "plan" or left is None else left[1]
        self._plan, self._samples, self._period_s = plan, plan.samples, plan.period_s
        self._state[playback.TIME], self._state[playback.RATE] = begins_s, 0.0
        self._checked = self._held = 0
        self._fault, self._stage = "", "checking"
        self._brake()
        self.store.begin(plan.name, begins_s)
        self._goal = command.time_s if command.what == "back_m" else self._next_stop(plan)

    def _next_stop(self, plan: StoredPlan) -> float:
        """Return when the plan waits next, or ends."""
        here = self._state[playback.TIME]
        waits = plan.waits_s[plan.waits_s > here + 0.5 * plan.period_s]
        return float(waits[0]) if waits.size else plan.duration_s

    # -- cycle by cycle

    def _move(self) -> bool:
        if self._stage == "path":
            return self._follow()
        at_rest = self._go_towards(self._target)
        if self._stage == "checking":
            self._check()
        elif self._stage == "set out" and at_rest:
            self._set_out()
        elif self._stage == "to the path" and at_rest:
            self._stage = "path"
            self._setpoint[0] = self._target
        return at_rest and not self._stage

    def _check(self) -> None:
        """Hold some more samples against the limits; the platform stays where it is meanwhile."""
        bad = self._look(self._checked)
        if bad < 0 and self._held < len(self._samples):
            if not self._stands(self._samples[self._held, 0]):
                bad = self._held
            self._held += _HELD_EVERY
        if bad >= 0:
            plan = self._plan
            line = 0 if plan is None else int(plan.line[bad])
            self._fault = f"the plan breaks the robot's limits at line {line}: plan it anew"
            self._stage = ""
            self.store.end()
            return
        self._checked += _CHECKED
        if self._checked >= len(self._samples) and self._held >= len(self._samples):
            self._stage = "set out"

    def _stands(self, position: FloatArray) -> bool:
        """Return whether the cables hold the platform at rest at a position (d,)."""
        home = self._parts.model.home_pose.array
        place(position, self._directions, home, self._room, self._there.array)
        return self._workspace.stands(self._there)

    def _look(self, begin: int) -> int:
        parts = self._parts
        return playback.first_fault(
            self._samples, begin, begin + _CHECKED, self._period_s, parts.speed,
            parts.acceleration, self._low, self._high, parts.model.angle_rad,
        )  # fmt: skip

    def _set_out(self) -> None:
        """Go in a straight line to where the path is to be taken up."""
        control = self._control
        self._play(0.0)
        self._target[:] = self._setpoint[0]
        self._speed[:] = self._parts.speed
        self._acceleration[:] = self._parts.acceleration
        synchronise(control.position, self._target, self._speed)
        synchronise(control.position, self._target, self._acceleration)
        self._stage = "to the path"

    def _follow(self) -> bool:
        """Go a cycle along the path; return whether nothing is left to do."""
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
        self.store.end()
        return True

    def _share(self) -> float:
        """Return how much of the feed is left to a platform that lags behind its set-point."""
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
        self.store.note(self._state[playback.TIME])

    def _approach(self) -> bool:
        """Come to rest: on the path, where it is on it."""
        if self._stage != "path":
            return super()._approach()
        at_rest = self._play(0.0)
        self._write()
        return at_rest

    def _brake(self) -> None:
        if self._stage != "path":
            super()._brake()
