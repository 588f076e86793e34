"""User-written programs: a platform's target as a function of time."""

from __future__ import annotations

import copy
import inspect
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdpr_rt.arrays import FloatArray, real_array
from cdpr_rt.code_loader import CodeError
from cdpr_rt.errors import error_text
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.motion.trajectory import stopping_position
from cdpr_rt.programs.base import CommandArguments, ProgramError
from cdpr_rt.programs.platform_program import PlatformParts, distance_m
from cdpr_rt.programs.pose import PoseProgram

PROGRAMS: Final = "cdpr_rt.programs"
"""Group of entry points under which installed packages register programs."""
_NAME: Final = re.compile(r"[a-z][a-z0-9_-]{0,31}")
_KEY: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_BEHIND_m: Final = 0.02


class Program(ABC):
    """Base class of user-written motions of the platform: subclasses set `name` and write `target`.

    A position (d,) has one entry for each controlled direction: the coordinates of the platform's
    origin, m, then the rotation vector from the orientation at home, rad. k is the number of
    coordinates.
    """

    name: str
    """Name in commands: small letters, digits, - and _."""
    arguments: Mapping[str, tuple[float, float, float]] = {}
    """Arguments of commands: the least and the largest allowed value, and the default."""

    def begin(  # noqa: B027  # optional
        self, position: FloatArray, *_: Any, **arguments: Any
    ) -> None:
        """Begin a run with the platform at a position (d,); all arguments are given by name.

        Each run has its own copy of the program. If this raises, the command is rejected.
        """

    @abstractmethod
    def target(self, time_s: float) -> ArrayLike | None:
        """Return the target at a time from 0, (k,) or (d,); None if the run is over.

        The platform first moves to the target of time 0. Its set-point then follows the target
        within the limits of speed and acceleration. If the target is too fast, time stops until the
        set-point has caught up. A call has to take less than a cycle.
        """


@dataclass(frozen=True)
class _Command:
    run: Program
    start: FloatArray


class OwnProgram(PoseProgram):
    """Moves the platform along the target of a user's `Program`.

    If `target` raises or leaves the workspace, the platform brakes and holds.
    """

    def __init__(
        self, own: Program, parts: PlatformParts, torque_Nm: FloatArray, stream: PoseStream
    ) -> None:
        super().__init__(parts, torque_Nm, stream)
        self.name = own.name
        self._own = self._run = own
        self._time_s, self._runs, self._failure = -1.0, False, ""
        self._most_behind_m = _BEHIND_m + float(parts.speed[0] ** 2 / parts.acceleration[0])

    def start(self, *given: Any) -> None:
        """Continue from the present set-point and torque; brake until a run begins."""
        super().start(*given)
        self._runs, self._time_s, self._failure = False, -1.0, ""

    def described(self) -> dict[str, Any]:
        """Return the purpose of the program and the bounds of its arguments, for clients."""
        text = (inspect.getdoc(self._own) or "").partition("\n")[0]
        bounds = {
            key: {"low": float(low), "high": float(high), "default": float(default)}
            for key, (low, high, default) in self._own.arguments.items()
        }
        return {"text": text, "arguments": bounds}

    @property
    def _goal_moves(self) -> bool:
        return self._runs and self._time_s >= 0.0

    def progress(self) -> dict[str, Any]:
        """Return the platform's state, the time of the run, and the reason why it was ended."""
        state = {**super().progress(), "time_s": max(self._time_s, 0.0)}
        if self._failure:
            state |= {"trouble": self._failure, "done": 0.0}
        elif self._runs:
            state["done"] = 0.0
        return state

    def check(self, arguments: Mapping[str, Any]) -> _Command:
        """Return a new run for `apply`; raises ProgramError."""
        own, control = self._own, self._control
        keys = CommandArguments(self.name, arguments, list(own.arguments))
        values = {key: keys.number(key, *bounds) for key, bounds in own.arguments.items()}
        self._require_pose()
        start, run = np.zeros(self._target.size), copy.copy(own)
        stopping_position(control.position, control.velocity, self._parts.acceleration, start)
        try:
            run.begin(start.copy(), **values)
            first = self._position_of(run.target(0.0), start)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise ProgramError(f"{self.name}: {error_text(error)}") from error
        if first is None:
            raise ProgramError(f"{self.name}: it has no target at time 0")
        if why_not := self._why_not(first):
            raise ProgramError(self._not_feasible(arguments, f"its first target: {why_not}"))
        self._require_way(first, arguments)
        return _Command(run, first)

    def _apply(self, checked: _Command) -> None:
        self._run, self._runs, self._time_s, self._failure = checked.run, True, -1.0, ""
        self._has_command, self._commanded = True, checked.start
        self._braking = self._blocked = False
        self._blocked_at[:] = np.nan
        self._commanded_speed[:] = self._parts.speed
        self._set_out(checked.start)

    def _move(self) -> bool:
        if not self._runs:
            return self._approach()
        if self._time_s < 0.0:
            arrived = super()._move()
            if self._blocked:
                self._end(f"the way is blocked, {self._infeasibility_at(self._examined_goal)}")
            elif arrived:
                self._time_s = 0.0
                self._speed[:], self._acceleration[:] = self._parts.speed, self._parts.acceleration
                self._goal[:] = self._target
            return False
        if distance_m(self._goal, self._control.position, self._parts.scale_m) < (
            self._most_behind_m
        ):
            self._time_s += self._parts.period_s
            self._take_target()
        if not self._runs:
            return self._approach()
        self._target[:] = self._goal
        self._advance(self._goal)
        return False

    def _take_target(self) -> None:
        """Use the target of this cycle as the goal, or end the run."""
        try:
            goal = self._position_of(self._run.target(self._time_s), self._goal)
        except (Exception, SystemExit) as error:  # user code must not end the loop's process
            self._end(f"at {self._time_s:.3f} s: {error_text(error)}")
            return
        if goal is None:
            self._runs = False
            self._target[:] = self._goal
        elif why_not := self._why_not(goal):
            self._end(f"at {self._time_s:.3f} s, its target: {why_not}")
        else:
            self._goal[:] = self._examined_goal[:] = goal

    def _why_not(self, goal: FloatArray) -> str:
        """Return the reason why the platform cannot be at a target (d,), or ""."""
        control = self._control
        if beyond := self._beyond_box(goal) or self._beyond_angle(goal):
            return beyond
        if not control.is_feasible(goal):
            return self._infeasibility_at(goal)
        pair = control.contact_at(goal)
        return control.contact(pair) if pair >= 0 else ""

    def _end(self, why: str) -> None:
        """Abort the run; the platform brakes."""
        self._runs, self._failure = False, why
        self._stop_straight()
        self._target[:] = self._rest
        self._acceleration[:] = self._stopping_acceleration

    def _position_of(self, target: Any, before: FloatArray) -> FloatArray | None:
        """Return a target as a position (d,); if it has no rotation, it gets that of `before`."""
        if target is None:
            return None
        given = real_array(target)
        if given.shape not in ((self._k,), before.shape) or not np.isfinite(given.sum()):
            wanted = f"({self._k},)" + f" or {before.shape}" * (before.size > self._k)
            shown = np.array2string(given, threshold=10)
            raise ValueError(f"target returned {shown}; return finite numbers, {wanted}")
        position = before.copy()
        position[: given.size] = given
        return position


def checked_programs(found: Iterable[tuple[str, Any]], taken: Iterable[str]) -> list[Program]:
    """Check the names and arguments of loaded programs; return the programs by name.

    `found` are pairs of a reference and the loaded object, `taken` the names of built-in programs.
    Raises CodeError that begins with the reference.
    """
    names, programs = set(taken), list[Program]()
    for reference, program in found:
        if not isinstance(program, Program):
            raise CodeError(f"{reference}: is not a program; derive it from cdpr_rt.Program")
        name = getattr(program, "name", None)
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise CodeError(f"{reference}: name: {name!r}; allowed: small letters, digits, -, _")
        if name in names:
            raise CodeError(f"{reference}: name: {name!r} is taken; allowed: another name")
        arguments: Any = program.arguments
        if not isinstance(arguments, Mapping):
            raise CodeError(f"{reference}: arguments: {arguments!r}; give a dictionary")
        for key, bounds in arguments.items():
            if not (isinstance(key, str) and _KEY.fullmatch(key) and _are_bounds(bounds)):
                raise CodeError(
                    f"{reference}: arguments: {key!r}: {bounds!r}; use letters, digits and _ for "
                    "the name, and give three finite numbers: lowest, highest, default"
                )
        names.add(name)
        programs.append(program)
    return programs


def _are_bounds(given: Any) -> bool:
    """Whether these are three finite numbers: lowest, highest, default."""
    try:
        low, high, default = map(float, given)
    except (TypeError, ValueError):
        return False
    return -math.inf < low <= default <= high < math.inf
