"""Program `lower`: let a platform down until it rests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.winch_speed_loop import (
    DRUM_TENSION_SHARE,
    FASTEST_IN_m_s,
    FIXED_END_1_s,
    HANGING_LOAD_1_s,
    UNKNOWN_POSE_m_s,
    WinchSpeedLoop,
)
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.arguments import CommandArguments, ProgramError
from cdpr_rt.programs.platform.arrival import Arrival
from cdpr_rt.programs.platform.platform_program import PlatformParts, PlatformProgram

HOME_SPEED_m_s = 0.25
"""Speed at which the platform goes home, to its stand; it turns back no faster, in proportion."""
SET_DOWN_m_s = 0.02
"""Speed at which the cables set it down there."""
_ARRIVED_m, _ARRIVED_S, _ARRIVING_S = 0.01, 0.25, 2.0
_LATE = 1.5
"""Time allowed for the way home, over the time that it should take."""
_FASTEST = 1.5
_LIGHT = 1.2
_STILL_m = 0.001
_RUNNING_IN_m_s = 0.02
_STILL_S = 1.0
_FADE_S = 0.2
_MOST_S = 30.0
"""Time to be set down, besides that for the distance at `UNKNOWN_POSE_m_s`."""


def lowering_s(platform: Platform) -> float:
    """Return the longest that `lower` may take, from anywhere in the box of targets."""
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
    """Return how far from home a target may be, at the most."""
    box = platform.workspace_min_m, platform.home_m, platform.workspace_max_m
    sides = [max(home - low, high - home) for low, home, high in zip(*box, strict=True)]
    return math.hypot(*sides)


class LowerProgram(PlatformProgram):
    """Takes the platform home, to its stand, and slackens the cables there.

    With slack cables or the argument `blind`, for a pose that may be wrong, no pose is used: every
    winch pays out at a limited speed and limited tension, and the platform sinks. It has ended when
    no cable carries load; the torque has faded out then.
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
        self._home_s, self._down_s = _home_s(parts.platform), _down_s(parts.platform)
        self._drum_tension_N = np.zeros(cable_m.size)
        self._cable = np.array(cable_m)
        self._here = np.zeros(cable_m.size)
        self._stage = ""
        self._cycles = self._still = 0
        self._without_pose = self._was_tight = False
        self._velocity = parts.estimator.estimate.velocity_rad_s

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each."""
        self._cycles = self._still = 0
        self._was_tight = self._parts.tight
        self._without_pose = not self._was_tight
        # slack cables are left as loose as they are
        self._drum_tension_N[:] = 0.0 if self._without_pose else DRUM_TENSION_SHARE * self._least
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
        if self._stage == "home" and not self._without_pose:
            super().update(feedback, setpoint, torque_Nm)
            self._at_rest = False
            if self._arrival.over:
                self._pay_out(feedback, torque_Nm, SET_DOWN_m_s, FIXED_END_1_s)
            elif self._cycles * self._parts.period_s > self._home_s:
                self._without_pose = True  # obstructed
            return
        if self._stage == "home":
            if self._parts.tight:
                self._parts.last_stop.displaced = True
                self._carry_weight(torque_Nm)
            self._pay_out(feedback, torque_Nm, UNKNOWN_POSE_m_s, HANGING_LOAD_1_s)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._winches.update(feedback, torque_Nm)
        self._watch_rest(feedback)

    def stop(self) -> None:
        """Go on: lowering is the quickest stop; it is at rest when the platform stands."""

    def progress(self) -> dict[str, Any]:
        """Return the stage, the cables' tensions, whether they held it, whether it has ended."""
        state = {
            "stage": self._stage,
            "blind": self._without_pose,
            "was_tight": self._was_tight,
            "done": float(self._at_rest),
        }
        if self._stage == "home":
            return {**super().progress(), **state}
        return {"tension_N": self._winches.tension_N.tolist(), **state}

    def check(self, arguments: Mapping[str, Any]) -> bool:
        """Return checked arguments for `apply`; raises ProgramError."""
        CommandArguments(self.name, arguments, ("blind",))
        blind = arguments.get("blind", False)
        if not isinstance(blind, bool):
            raise ProgramError(f"lower: blind: value {blind!r}; allowed: true or false")
        return blind

    def _apply(self, blind: bool) -> None:
        self._without_pose = self._without_pose or blind

    def _carry_weight(self, torque_Nm: FloatArray) -> None:
        """Begin with the tensions that carry the weight at the set-point, without pretension.

        Pretension would fling the platform where one of the cables has broken; so would tensions
        for the estimated pose, which follows a cable that runs in or an encoder that jumps.
        """
        self._there.array[:] = self._parts.model.poses(self._control.shaped[None])[0]
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
        self._stage = "down"
        self._still = self._cycles = 0
        winches = self._winches
        winches.low_N[:], winches.high_N[:] = self._drum_tension_N, self._high
        winches.paying_out_m_s[:] = speed_m_s
        winches.fastest_in_m_s = FASTEST_IN_m_s
        winches.integral_rate_1_s = rate_1_s
        # faster than the platform can be is a jump of the encoder
        parts = self._parts
        fastest = _FASTEST * np.linalg.norm(parts.scale_m * parts.speed) / np.abs(self._cable)
        plausible = np.abs(self._velocity) < fastest
        winches.begin(feedback, np.where(plausible, self._velocity, 0.0), torque_Nm)
        self._control.clear_compensation()

    def _watch_rest(self, feedback: AxisFeedback) -> None:
        winches, period_s = self._winches, self._parts.period_s
        if self._stage == "fade":
            winches.low_N -= self._drum_tension_N * (period_s / _FADE_S)
            np.maximum(winches.low_N, 0.0, out=winches.low_N)
            winches.high_N[:] = winches.low_N
            self._at_rest = not winches.low_N.any()
            return
        # a cable that runs in carries nothing, however its winch trembles: it may be a broken one
        running_in = self._cable * winches.speed_rad_s < -_RUNNING_IN_m_s
        unloaded = winches.tension_N <= _LIGHT * DRUM_TENSION_SHARE * self._least
        light = bool((unloaded | running_in).all())
        paid_out_m = float((self._cable * (feedback.position_rad - self._here)).max())
        if not light or paid_out_m > _STILL_m:
            self._here[:] = feedback.position_rad
            self._still = 0
        self._still += 1
        if self._still * period_s > _STILL_S or self._cycles * period_s > self._down_s:
            self._stage = "fade"
