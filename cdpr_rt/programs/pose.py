"""Program `pose`: move a platform to poses, or follow the set-point stream."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.model.pose import exponential, logarithm, place_text
from cdpr_rt.motion import hand_target
from cdpr_rt.motion.pose_stream import CLUTCH, PoseStream, StreamState
from cdpr_rt.motion.trajectory import soft_deadband, stopping_position
from cdpr_rt.programs.base import CommandArguments, ProgramError
from cdpr_rt.programs.platform_program import (
    PlatformParts,
    PlatformProgram,
    along_velocity,
    distance_m,
    synchronise,
)
from cdpr_rt.refusal import CommandRefusal, RefusalCode

_SLOWEST_m_s = 1e-4
_DEADBAND_m = 5e-5
_ANYWHERE_m = 1e3
_HALF_TURN_rad = math.pi
_BLOCKED_m = 1e-3
"""A way is blocked if the set-point moves at most this far on it."""
_HELD_BACK = {
    hand_target.FREE: "",
    hand_target.AT_EDGE: "at the edge of the workspace",
    hand_target.ON_STAND: "below the workspace, for example on its stand: move up first",
}
_ROUNDING = 1e-9
_AT_BOUND_m = 1e-4
_ABSOLUTE, _RELATIVE = ("position_m", "rotation_rad"), ("distance_m", "turn_rad")
_FRAMES = ("room", "platform")
_KEYS = (*_ABSOLUTE, *_RELATIVE, "frame", "stream", "resume", "speed_m_s")


class PoseProgram(PlatformProgram):
    """Moves the platform to a position and rotation, or follows the set-point stream.

    The trapezoidal profile of Tremblay (thesis), eq. (2.10) to (2.12), is computed every cycle for
    each direction. From rest to a target all directions take the same time, on a straight line. The
    stream moves the target by its displacement times its scale, and turns it by its rotation. While
    the clutch is open, the platform comes to rest and holds instead. Targets stay in the workspace,
    and the set-point only moves if it can still stop within it.
    """

    name = "pose"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, stream: PoseStream) -> None:
        super().__init__(parts, torque_Nm)
        platform, d = parts.platform, parts.model.size
        self._low = np.array(platform.workspace_min_m)
        self._high = np.array(platform.workspace_max_m)
        self.stream = stream
        self._following = False
        self._epoch = -1
        self._last_sample, self._hand = np.zeros(7), np.zeros((4, 4))
        self._last_sample[3] = 1.0
        self._goal, self._examined_goal, self._previous_target = np.zeros((3, d))
        self._stopping_acceleration = np.array(parts.acceleration)
        self._deadband_weight = 0.0
        self._hindrance, self._contact_pair = hand_target.FREE, -1
        self._clutched = False
        self._commanded: FloatArray | None = None
        """The last commanded position that was not reached, to which `resume` moves."""
        self._asked_m_s = float(parts.speed[0])
        """The speed of that command, which `resume` uses unless another speed is given."""
        self._has_command = False
        self._cycle = -2
        """The last cycle in which this program moved the platform."""
        self._stops_feasibly = False
        self._commanded_speed = np.array(parts.speed)
        self._braking = False
        self._blocked_at, self._blocked = np.full(d, np.nan), False
        self._saved_setpoint = np.zeros((3, d))
        k = self._k
        self._parts_of_target = [*(slice(i, i + 1) for i in range(k)), *[slice(k, d)] * (d > k)]
        # this call compiles the kernels before a motion or the stream begins
        self._follow_sample()
        self._apply_deadband()
        exponential(np.zeros(3), np.eye(3))
        logarithm(np.eye(3), np.zeros(3))
        synchronise(self._target, self._target, self._commanded_speed)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until a position is commanded."""
        super().start(feedback, setpoint, torque_Nm)
        self._following = self._has_command = self._stops_feasibly = False
        self._braking = self._blocked = False
        self._hindrance, self._contact_pair = hand_target.FREE, -1

    @property
    def stream_age_s(self) -> float:
        """Age of the newest sample; nan if the program follows no stream."""
        return self.stream.age_s if self._following else math.nan

    @property
    def stream_buttons(self) -> int:
        """Buttons of the present sample; 0 if the program follows no stream."""
        return self.stream.buttons if self._following else 0

    def progress(self) -> dict[str, Any]:
        """Return the platform's state, the target, and the state of the stream."""
        state, commanded, k = super().progress(), self._commanded, self._k
        state["interrupted_target_m"] = None if commanded is None else commanded[:k].tolist()
        if self._about.size:
            state["interrupted_target_rotation_rad"] = (
                None if commanded is None else commanded[k:].tolist()
            )
        if self._blocked:
            state["trouble"] = f"the way is blocked, {self._infeasibility_at(self._examined_goal)}"
        if self._following:
            state |= {"stream": self.stream.state.name.lower(), **self.stream.counts()}
        return state

    def _held_back(self) -> str:
        """Return the reason why set-point or target are held back, or ""."""
        lags = super()._held_back()
        if lags or not self._goal_moves:
            return lags
        if self._contact_pair >= 0:
            return self._control.contact(self._contact_pair)
        why = self._infeasibility_at(self._examined_goal) or _HELD_BACK[self._hindrance]
        if self._hindrance != hand_target.AT_EDGE or why != _HELD_BACK[self._hindrance]:
            return why
        here, names = self._target[: self._k], self._directions
        at = [
            f"{'xyz'[names[i]]} {1e3 * here[i]:.5g} mm"
            for i in range(self._k)
            if min(here[i] - self._low[i], self._high[i] - here[i]) < _AT_BOUND_m
        ]
        return ", ".join([why, *at])

    def _infeasibility_at(self, position: FloatArray) -> str:
        """Return a text that says where and why a position is infeasible, or ""."""
        why_not = self._control.infeasibility(position)
        if not why_not:
            return ""
        return f"{place_text(position, self._k)}: {why_not}"

    @property
    def _goal_moves(self) -> bool:
        """Whether the goal may move freely in each cycle, so that its way has not been checked."""
        return self._following

    # -- commands

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return checked arguments for `apply`; raises ProgramError."""
        angles = () if self._about.size else ("rotation_rad", "turn_rad")
        allowed = [key for key in _KEYS if key not in angles]
        keys = CommandArguments(self.name, arguments, allowed)
        fastest = float(self._parts.speed[0])
        default = self._asked_m_s if "resume" in keys else fastest
        speed = keys.number("speed_m_s", _SLOWEST_m_s, fastest, default)
        self._require_pose()
        if not arguments:
            return "stay", None, speed
        relative = "distance_m" in keys or "turn_rad" in keys
        place, turn = _RELATIVE if relative else _ABSOLUTE
        key = keys.one_of(turn if turn in keys and place not in keys else place, "stream", "resume")
        self._require_fit(arguments, relative)
        if relative:
            return "go", self._from_here(keys, arguments), speed
        if key not in ("stream", "resume"):
            return "go", self._position(keys), speed
        if arguments[key] is not True:
            raise ProgramError(f"pose: {key}: value {arguments[key]!r}; allowed: true")
        commanded = self._commanded
        if key == "resume":
            if commanded is None:
                left = {"left": "target", "instead": "position_m"}
                code = RefusalCode.NOTHING_LEFT
                raise ProgramError(CommandRefusal(code, self.name, {"resume": True}, left))
            self._require_way(commanded, {"resume": True})
        return key, commanded, speed

    def _position(self, keys: CommandArguments) -> FloatArray:
        """Return the commanded position (d,); omitted coordinates do not change."""
        k, control, position = self._k, self._control, np.zeros(self._target.size)
        acceleration = self._parts.acceleration
        stopping_position(control.position, control.velocity, acceleration, position)
        asked = {}
        if "position_m" in keys:
            position[:k] = keys.axes("position_m", np.full(k, _ANYWHERE_m), each="a coordinate")
            asked["position_m"] = position[:k].tolist()
        if "rotation_rad" in keys:
            most = np.full(self._about.size, _HALF_TURN_rad)
            position[k:] = keys.axes("rotation_rad", most, each="an angle that is controlled")
            asked["rotation_rad"] = position[k:].tolist()
        self._keep_inside(position, asked)
        return position

    @staticmethod
    def _require_fit(arguments: Mapping[str, Any], relative: bool) -> None:
        """Raise ProgramError if keys of absolute and relative motions are combined."""
        frame = arguments.get("frame", _FRAMES[0])
        if frame not in _FRAMES:
            raise ProgramError(f"pose: frame: value {frame!r}; allowed: {', '.join(_FRAMES)}")
        others = _ABSOLUTE if relative else ("frame",)
        for key in others:
            if key in arguments:
                fit = "without" if relative else "with"
                raise ProgramError(f"pose: {key}: allowed: {fit} {' or '.join(_RELATIVE)}")

    def _from_here(self, keys: CommandArguments, arguments: Mapping[str, Any]) -> FloatArray:
        """Return the position (d,) that is `distance_m` and `turn_rad` away.

        Distances are relative to the target while the platform moves there. Otherwise they are
        relative to the position at which the set-point rests or comes to rest.
        """
        k, about, along = self._k, self._about, self._directions[: self._k]
        start, Q, step = np.zeros(self._target.size), np.empty((3, 3)), np.empty((3, 3))
        stopping_position(
            self._control.position, self._control.velocity, self._parts.acceleration, start
        )
        if self._cycle == self._parts.cycle and self._has_command and self._commanded is not None:
            start[:] = self._commanded
        turned, way, turn = np.zeros((3, 3))
        turned[about] = start[k:]
        exponential(turned, Q)
        of_platform = arguments.get("frame") == "platform"
        axes = Q @ self._parts.model.home_pose.Q if of_platform else np.eye(3)
        asked = {key: arguments[key] for key in _RELATIVE if key in keys}
        position = start.copy()
        if "distance_m" in keys:
            most = np.full(k, _ANYWHERE_m)
            way[along] = keys.axes("distance_m", most, each="a coordinate")
            position[:k] += (axes @ way)[along]
        if "turn_rad" in keys:
            most = np.full(about.size, _HALF_TURN_rad)
            turn[about] = keys.axes("turn_rad", most, each="an angle that is controlled")
            exponential(axes @ turn, step)
            logarithm(step @ Q, turned)
            position[k:] = turned[about]
        self._keep_inside(position, asked, start)
        return position

    def _keep_inside(
        self, position: FloatArray, asked: Mapping[str, Any], start: FloatArray | None = None
    ) -> None:
        """Raise ProgramError if a target (d,) cannot be reached; round it into its bounds.

        A relative motion begins at `start`. If an absolute motion does not change the position, the
        position is not checked.
        """
        k, most_rad = self._k, self._parts.model.angle_rad
        leads = "" if asked.keys() & {*_ABSOLUTE} else "leads to "
        if asked.keys() & {"position_m", *_RELATIVE}:
            if beyond := self._beyond_box(position):
                more: dict[str, Any] = {"why_si": leads + self._beyond_box(position, 1.0, "m")}
                if start is not None and self._beyond_box(start):
                    more["enter_m"] = np.clip(
                        start[:k].round(3) + 0.0, self._low, self._high
                    ).tolist()
                raise ProgramError(self._not_feasible(asked, leads + beyond, outside=True, **more))
            position[:k] = np.clip(position[:k], self._low, self._high)
        if asked.keys() & {"turn_rad", "rotation_rad"} and (beyond := self._beyond_angle(position)):
            more = {"why_si": leads + self._beyond_angle(position, 1.0, "rad")}
            raise ProgramError(self._not_feasible(asked, leads + beyond, outside=True, **more))
        angle = float(np.linalg.norm(position[k:]))
        if angle > most_rad:
            position[k:] *= most_rad / angle
        if why_not := self._control.infeasibility(position):
            raise ProgramError(self._not_feasible(asked, why_not))
        self._require_way(position, asked)

    def _beyond_box(self, position: FloatArray, unit: float = 1e3, name: str = "mm") -> str:
        """Return a text that says which coordinate is outside the box of targets, or ""."""
        off = np.abs(position[: self._k] - np.clip(position[: self._k], self._low, self._high))
        i = int(off.argmax())
        if off[i] <= _ROUNDING:
            return ""
        return (
            f"{'xyz'[self._directions[i]]} {unit * position[i]:.6g} {name}; allowed: "
            f"{unit * self._low[i]:g} to {unit * self._high[i]:g} {name}, the workspace"
        )

    def _beyond_angle(
        self, position: FloatArray, unit: float = math.degrees(1.0), name: str = "deg"
    ) -> str:
        """Return a text if a rotation exceeds the workspace angle, else ""."""
        angle, most_rad = float(np.linalg.norm(position[self._k :])), self._parts.model.angle_rad
        if angle <= most_rad + _ROUNDING:
            return ""
        return (
            f"{unit * angle:.4g} {name} from the orientation at home; "
            f"allowed: up to {unit * most_rad:.4g} {name}"
        )

    def _require_way(self, position: FloatArray, asked: Mapping[str, Any]) -> None:
        """Raise ProgramError if the straight line to a position (d,) is not feasible."""
        why_not = self._control.way_infeasibility(position)
        if why_not:
            raise ProgramError(self._not_feasible(asked, f"on the way, {why_not}"))

    def _not_feasible(
        self, asked: Mapping[str, Any], why: str, *, outside: bool = False, **more: Any
    ) -> CommandRefusal:
        arguments = {"why": why, "outside": outside, **more}
        return CommandRefusal(RefusalCode.NOT_FEASIBLE, self.name, asked, arguments)

    def _apply(self, checked: Any) -> None:
        action: str
        position: FloatArray | None
        speed: float
        action, position, speed = checked
        self._commanded_speed[:] = self._parts.speeds(speed)
        self._following = action == "stream"
        self._has_command = action in ("go", "resume")
        self._braking = self._blocked = False
        self._blocked_at[:] = np.nan
        if self._following:
            self.stream.reset()
            self._commanded = None
            self._deadband_weight = 0.0
        if self._has_command and position is not None:
            self._commanded, self._asked_m_s = np.array(position), speed
            self._set_out(self._commanded)
            return
        self._brake()
        if self._following:
            self._speed[:] = self._commanded_speed
            self._acceleration[:] = self._parts.acceleration
            self._target[:] = self._stopping_position()

    def _set_out(self, commanded: FloatArray) -> None:
        """Start towards a target; from rest, all directions take the same time."""
        control = self._control
        self._target[:] = commanded
        self._speed[:] = self._commanded_speed
        self._acceleration[:] = self._parts.acceleration
        if not control.velocity.any():
            synchronise(control.position, commanded, self._speed)
            synchronise(control.position, commanded, self._acceleration)

    # -- cycle by cycle

    def _move(self) -> bool:
        self._cycle = self._parts.cycle
        if self._following:
            self._follow()
            return False
        if self._braking:
            if self._approach():
                self._set_out_again()
            return False
        at_rest = self._advance(self._target)
        if at_rest and self._has_command:
            self._commanded = None
        return at_rest

    def _set_out_again(self) -> None:
        """Try a straight line to the target after an infeasible way, or give up the target."""
        here, commanded, scale_m = self._control.position, self._commanded, self._parts.scale_m
        if self._blocked or commanded is None:
            return
        if distance_m(here, self._blocked_at, scale_m) < _BLOCKED_m:
            self._blocked = True
            return
        self._braking = False
        self._blocked_at[:] = here
        self._set_out(commanded)

    def _follow(self) -> None:
        stream = self.stream
        state = stream.update()
        if state is StreamState.STOPPED:
            self._target[:] = self._stopping_position()
        elif stream.epoch != self._epoch or stream.buttons & CLUTCH or self._clutched:
            # in the cycle in which the clutch closes, part of the motion happened with the clutch
            # open
            if stream.epoch != self._epoch or not self._clutched:
                self._target[:] = self._stopping_position()
            self._epoch = stream.epoch
            self._last_sample[:] = stream.pose
        else:
            self._follow_sample()
        self._clutched = bool(stream.buttons & CLUTCH)
        self._apply_deadband()
        self._advance(self._goal)

    def _apply_deadband(self) -> None:
        """Write the goal: the target after a soft dead band, which suppresses tremor of hands."""
        self._deadband_weight = soft_deadband(
            self._target, self._control.position, self._parts.scale_m, self._deadband_weight,
            _DEADBAND_m, self._goal,
        )  # fmt: skip

    def _follow_sample(self) -> None:
        """Move the target by the stream's motion, as far as that is feasible."""
        control, goal, target = self._control, self._goal, self._target
        self._hindrance = hand_target.lead(
            self.stream.scale, self.stream.pose, self._last_sample, self._about,
            self._low, self._high, self._parts.model.angle_rad, self._speed, self._acceleration,
            control.position, target, self._hand, goal,
        )  # fmt: skip
        self._examined_goal[:] = goal
        near = control.contact_at(goal)
        if near >= 0 or distance_m(goal, target, self._parts.scale_m) > 0.0:
            self._contact_pair = near
        if near < 0 and (control.is_feasible(goal) or not control.is_feasible(target)):
            target[:] = goal
            return
        # if it is infeasible in all directions together, try each alone, along the edge of the
        # workspace; rotation counts as one direction
        for part in self._parts_of_target:
            self._previous_target[part], target[part] = target[part], goal[part]
            if control.is_feasible(target) and control.contact_at(target) < 0:
                return
            target[part] = self._previous_target[part]

    def _advance(self, goal: FloatArray) -> bool:
        """Move one cycle towards a goal, or brake if the stopping position would be infeasible."""
        control, saved = self._control, self._saved_setpoint
        saved[0], saved[1], saved[2] = control.position, control.velocity, control.acceleration
        arrived = self._go_towards(goal)
        self._stopping_position()
        if self._goal_moves:
            self._stop_straight()
        stops = control.is_feasible(self._rest)
        # the whole way to a pose has been checked before
        near = control.contact_ahead(self._rest) if self._goal_moves else -1
        if near >= 0:
            self._contact_pair = near
        if near >= 0 or (self._stops_feasibly and not stops):
            control.position[:], control.velocity[:], control.acceleration[:] = saved
            if self._goal_moves:
                self._stop_straight()
                usual, self._acceleration = self._acceleration, self._stopping_acceleration
                self._go_towards(self._rest)
                self._acceleration = usual
                return False
            self._braking = True
            self._examined_goal[:] = self._rest
            self._target[:] = self._stopping_position()
            self._go_towards(self._target)
            return False
        self._stops_feasibly = stops
        return arrived

    def _stop_straight(self) -> None:
        """Write the position of rest after braking on a straight line, and the braking motion."""
        control = self._control
        along_velocity(control.velocity, self._parts.acceleration, self._stopping_acceleration)
        stopping_position(
            control.position, control.velocity, self._stopping_acceleration, self._rest
        )
