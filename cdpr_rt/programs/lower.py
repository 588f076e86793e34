"""Program `lower`: lower a platform until it stands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.winch_speed_loop import (
    DRUM_TENSION_SHARE,
    PUSH_SHARE,
    FASTEST_IN_m_s,
    FIXED_END_1_s,
    HANGING_LOAD_1_s,
    SPARE_m,
    UNKNOWN_POSE_m_s,
    WinchSpeedLoop,
)
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.base import CommandArguments, ProgramError
from cdpr_rt.programs.platform_program import Arrival, PlatformParts, PlatformProgram

HOME_SPEED_m_s = 0.25
"""Speed at which the platform returns to its stand; its rotation is limited in proportion."""
SET_DOWN_m_s = 0.02
"""Speed at which the cables set the platform down on its stand."""
_ARRIVED_m, _ARRIVED_S, _ARRIVING_S = 0.01, 0.25, 2.0
_LATE = 1.5
"""Time allowed for the way home, as a multiple of the expected time."""
_FASTEST = 1.5
_LIGHT = 0.2
_SPARE_HOME_m = 0.01
"""Cable paid out at home in addition to the length that reaches the stand."""
_DISOBEYS_m = 0.03
"""Cable that a winch may wind in while all of them pay out."""
_STILL_m = 0.001
_RUNNING_IN_m_s = 0.02
_STILL_S = 1.0
_FADE_S = 0.2
_MOST_S = 30.0
"""Time for setting down, in addition to the time for the distance at `UNKNOWN_POSE_m_s`."""


def lowering_s(platform: Platform) -> float:
    """Return the longest duration of `lower`, from anywhere in the box of targets."""
    return _home_s(platform) + _down_s(platform) + _STILL_S + _FADE_S


def _home_s(platform: Platform) -> float:
    share = min(HOME_SPEED_m_s / platform.speed_m_s, 1.0)
    way_s = _reach_m(platform) / platform.speed_m_s
    turn_s = platform.workspace_angle_rad / platform.angular_speed_rad_s
    braking_s = max(
        platform.speed_m_s / platform.acceleration_m_s2,
        platform.angular_speed_rad_s / platform.angular_acceleration_rad_s2,
    )
    return _LATE * (max(way_s, turn_s) / share + 2.0 * braking_s) + _ARRIVING_S


def _down_s(platform: Platform) -> float:
    return _MOST_S + _reach_m(platform) / UNKNOWN_POSE_m_s


def _reach_m(platform: Platform) -> float:
    """Return the largest distance of a target from home."""
    box = platform.workspace_min_m, platform.home_m, platform.workspace_max_m
    sides = [max(home - low, high - home) for low, home, high in zip(*box, strict=True)]
    return math.hypot(*sides)


class LowerProgram(PlatformProgram):
    """Returns the platform to its stand and slackens the cables there.

    With slack cables, or with the argument `blind` if the pose may be wrong, the program uses no
    measured pose: every winch pays out at a limited speed and limited tension, and the platform
    sinks.

    A small tension does not prove that a platform stands: friction of the winches may hold it. So
    each winch pays out the length that its cable needs to reach the stand from the last set-point,
    against friction if necessary. If a push greater than the friction does not turn a winch, the
    winch ignores commands, or its cable also holds without power. A winch that has wound in cable
    instead may also hold the platform. The program ends when the torque has faded out and no cable
    has then run out for a second. If a winch winds in cable while the platform is set down at home,
    the program ends immediately.
    """

    name = "lower"
    needs_lease = False

    def __init__(
        self,
        parts: PlatformParts,
        torque_Nm: FloatArray,
        cable_m: FloatArray,
    ) -> None:
        super().__init__(parts, torque_Nm)
        self._arrival = Arrival(parts.period_s, _ARRIVED_m, _ARRIVED_S, _ARRIVING_S)
        control = parts.control
        inertia = np.full(cable_m.size, control.inertia_kg_m2)
        self._winches = WinchSpeedLoop(inertia, cable_m, parts.period_s)
        self._weight_only = parts.model.least_tensions(np.zeros(cable_m.size), parts.model.high_N)
        self._weight = parts.model.weight()
        self._W = np.zeros((self._weight.size, cable_m.size))
        self._there = parts.model.pose(parts.model.home)
        self._weight_tension_N = np.zeros(cable_m.size)
        self._high = np.minimum(parts.model.high_N, torque_Nm / np.abs(cable_m))
        self._least = np.array(control.least_N)
        self._push_N = PUSH_SHARE * self._rubs_N(cable_m)
        self._at_home_m = parts.model.kinematics.lengths(parts.model.home_pose)
        self._stretch_m = self._largest_stretch_m()
        self._home_s, self._down_s = _home_s(parts.platform), _down_s(parts.platform)
        self._drum_tension_N = np.zeros(cable_m.size)
        self._cable = np.array(cable_m)
        self._here, self._down_rad = np.zeros((2, cable_m.size))
        self._stage = self._trouble = ""
        self._cycles = self._still = self._cycle = 0
        self._without_pose = self._was_tight = False
        self._velocity = parts.estimator.estimate.velocity_rad_s

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the present set-point and torque, (n,) each."""
        self._cycles = self._still = 0
        # a fault while the cables set the platform down: they still pull
        continues = self._stage == "down" and 0 <= feedback.cycle - self._cycle <= 1
        self._was_tight = self._parts.tight or continues
        self._without_pose = not self._parts.tight
        self._trouble = ""
        self._winches.left_m[:] = 0.0  # may remain from a lowering that was interrupted
        # slack cables keep their slack
        self._drum_tension_N[:] = 0.0 if not self._was_tight else DRUM_TENSION_SHARE * self._least
        self._stage = "home"
        if self._parts.tight:
            super().start(feedback, setpoint, torque_Nm)
            self._target[:] = self._parts.model.home
            self._acceleration[:] = self._parts.acceleration
            self._speed[:] = self._parts.speeds(HOME_SPEED_m_s)
        self._at_rest = self._stopping = False

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        self._cycles += 1
        self._cycle = feedback.cycle
        if self._stage == "home" and not self._without_pose:
            super().update(feedback, setpoint, torque_Nm)
            self._at_rest = False
            if self._arrival.over:
                self._need(_SPARE_HOME_m + self._lag_m())
                self._pay_out(feedback, torque_Nm, SET_DOWN_m_s, FIXED_END_1_s)
            elif self._cycles * self._parts.period_s > self._home_s:
                self._without_pose = True  # obstructed
            return
        if self._stage == "home":
            if self._was_tight:
                self._parts.last_stop.displaced = True
                self._need(SPARE_m + self._parts.platform.home_tolerance_m)
                self._carry_weight(torque_Nm)
            self._pay_out(feedback, torque_Nm, UNKNOWN_POSE_m_s, HANGING_LOAD_1_s)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._winches.update(feedback, torque_Nm)
        if self._without_pose or not self._is_dragged(feedback):
            self._watch_rest(feedback)
        if self._at_rest:
            torque_Nm[:] = 0.0

    def stop(self) -> None:
        """Continue, because lowering is the quickest stop; it ends when the platform stands."""
        self._control.stand_in()

    def progress(self) -> dict[str, Any]:
        """Return the stage, tensions, whether the cables were tight, the outcome, and problems."""
        state = {
            "stage": self._stage,
            "blind": self._without_pose,
            "was_tight": self._was_tight,
            "done": float(self._at_rest),
        }
        if self._stage == "home":
            return {**super().progress(), **state}
        tension_N = np.maximum(self._winches.tension_N, 0.0).tolist()
        return {"tension_N": tension_N, "trouble": self._trouble, **state}

    def check(self, arguments: Mapping[str, Any]) -> bool:
        """Return checked arguments for `apply`; raises ProgramError."""
        CommandArguments(self.name, arguments, ("blind",))
        blind = arguments.get("blind", False)
        if not isinstance(blind, bool):
            raise ProgramError(f"lower: blind: value {blind!r}; allowed: true or false")
        return blind

    def _apply(self, blind: bool) -> None:
        self._without_pose = self._without_pose or blind

    def _rubs_N(self, cable_m: FloatArray) -> FloatArray:
        """Return the largest friction of each winch, as a tension of its cable, (n,)."""
        known = self._parts.compensation
        known_N = 0.0 if known is None else known.friction_Nm / np.abs(cable_m)
        return np.asarray(np.maximum(known_N, self._control.pull_fit.taken_up_N))

    def _largest_stretch_m(self) -> FloatArray:
        """Return the stretch (n,) of the cables at home under the highest tensions."""
        high_N, at_home_m = self._parts.model.high_N, self._control.lengths_at_home
        stretch_m = at_home_m(self._least) - at_home_m(high_N)
        return np.asarray(stretch_m * high_N / (high_N - self._least))

    def _need(self, spare_m: float) -> None:
        """Set the length to pay out for each cable from the set-point to the stand, plus `spare_m`.

        The set-point is used because a jump of an encoder does not change it, and the platform was
        not farther from the stand.
        """
        self._there.array[:] = self._parts.model.poses(self._control.shaped[None])[0]
        here_m = self._parts.model.kinematics.lengths(self._there)
        self._winches.left_m[:] = self._at_home_m - here_m + self._stretch_m + spare_m

    def _carry_weight(self, torque_Nm: FloatArray) -> None:
        """Begin with the tensions that carry the weight at `_there`, without pretension.

        Pretension would fling the platform if a cable has broken. Tensions for the estimated pose
        could do the same, because this pose follows a cable that is wound in fast, or an encoder
        that jumps.
        """
        kinematics = self._parts.model.kinematics
        kinematics.wrench_matrix(self._there, self._W)
        hanging, rise_N = kinematics.hanging(self._there)
        self._weight_only.solve(self._W, self._weight + hanging, self._weight_tension_N)
        self._weight_tension_N += rise_N
        torque_Nm[:] = -self._cable * np.maximum(self._weight_tension_N, self._drum_tension_N)

    def _pay_out(
        self, feedback: AxisFeedback, torque_Nm: FloatArray, speed_m_s: float, rate_1_s: float
    ) -> None:
        self._parts.tight = False
        self._down_rad[:] = feedback.position_rad
        self._stage = "down"
        self._still = self._cycles = 0
        winches = self._winches
        winches.low_N[:], winches.high_N[:] = self._drum_tension_N, self._high
        winches.push_N[:] = self._push_N
        winches.paying_out_m_s[:] = speed_m_s
        winches.fastest_in_m_s = FASTEST_IN_m_s
        winches.integral_rate_1_s = rate_1_s
        # faster than the platform can move: a jump of the encoder
        parts = self._parts
        fastest = _FASTEST * np.linalg.norm(parts.scale_m * parts.speed) / np.abs(self._cable)
        plausible = np.abs(self._velocity) < fastest
        winches.begin(feedback, np.where(plausible, self._velocity, 0.0), torque_Nm)
        self._control.clear_compensation()

    def _is_dragged(self, feedback: AxisFeedback) -> bool:
        """Return whether a winch winds in cable; end then, while the platform stands."""
        in_m = self._wound_in_m(feedback)
        i = int(in_m.argmax())
        if in_m[i] <= _DISOBEYS_m:
            return False
        self._trouble = (
            f"{self._parts.names[i]} wound in {1e3 * in_m[i]:.0f} mm while the cables set the "
            "platform down: its drive does not obey, or its cable is broken"
        )
        self._parts.last_stop.displaced = self._at_rest = True
        return True

    def _wound_in_m(self, feedback: AxisFeedback) -> FloatArray:
        """Return the cable that each winch has wound in since it was to pay out, (n,)."""
        return self._cable * (self._down_rad - feedback.position_rad)

    def _watch_rest(self, feedback: AxisFeedback) -> None:
        winches, period_s = self._winches, self._parts.period_s
        low_N = winches.low_N
        # a cable that is wound in fast carries nothing, even if its winch oscillates: it may be
        # broken
        running_in = self._cable * winches.speed_rad_s < -_RUNNING_IN_m_s
        bottom_N = np.where(winches.left_m > 0.0, -winches.push_N, low_N)
        unloaded = winches.tension_N <= bottom_N + _LIGHT * np.abs(bottom_N)
        light = not low_N.any() or bool((unloaded | running_in).all())
        paid_out_m = self._cable * (feedback.position_rad - self._here)
        if not light or (paid_out_m[~winches.noisy] > _STILL_m).any():
            self._here[:] = feedback.position_rad
            self._still = 0
        self._still += 1
        if self._stage == "fade" and low_N.any():
            low_N -= self._drum_tension_N * (period_s / _FADE_S)
            np.maximum(low_N, 0.0, out=low_N)
            self._still = 0
        elif self._still * period_s > _STILL_S or self._cycles * period_s > self._down_s:
            self._at_rest = not low_N.any()
            if self._stage == "down":
                unfinished = winches.stuck | (winches.left_m > 0.0)
                in_m = self._wound_in_m(feedback) * unfinished
                i = int(in_m.argmax())
                if self._still * period_s <= _STILL_S:
                    self._trouble = f"the platform did not come to rest within {self._down_s:.0f} s"
                elif winches.stuck.any() and not self._parts.last_stop.fallen:
                    name = self._parts.names[int(winches.stuck.argmax())]
                    self._trouble = f"{name} was driven to pay out cable but did not turn"
                elif in_m[i] > _DISOBEYS_m:
                    self._trouble = (
                        f"{self._parts.names[i]} wound in {1e3 * in_m[i]:.0f} mm instead of paying "
                        "out: its drive does not obey"
                    )
                if self._trouble:
                    self._parts.last_stop.fallen = True
                    self._trouble += "; if the platform hangs, it may fall when the power goes off"
                self._stage = "fade"
                low_N[winches.left_m > 0.0] = 0.0
                winches.left_m[:] = 0.0
