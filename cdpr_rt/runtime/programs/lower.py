"""Letting a platform down until it rests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_kernel import G_m_s2
from cdpr_rt.robots.planar_tensions import PlanarTensions
from cdpr_rt.runtime.programs.base import ProgramError
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.runtime.programs.reel import HANGING_1_s, Reel, STANDING_1_s
from cdpr_rt.runtime.programs.wanted import Wanted
from profiles.platform import Platform

HOME_SPEED_m_s = 0.25
"""At which the platform goes to where it can stand."""
SETTLING_m_s = 0.02
"""At which its cables let it down the last bit."""
BLIND_m_s = 0.15
"""At which cables let it down where nobody knows how it stands."""
_MOST_IN_m_s = 0.5
_KEEPING_SHARE = 0.25
"""Of the least tension: what keeps cables on their drums."""
_ARRIVED_m = 0.01
_ARRIVING_S = 2.0
_LATE = 1.5
"""A platform that takes so many times longer to come home than it should does not."""
_FASTEST = 1.5
_LIGHT = 1.2
_STILL_m = 0.001
_STILL_S = 1.0
_FADE_S = 0.2
_MOST_S = 30.0
"""For the last bit, besides the time for a way down at the speed of `BLIND_m_s`."""


def lowering_s(platform: Platform) -> float:
    """Return the longest that `lower` may take, from anywhere in the box of targets."""
    return _home_s(platform) + _down_s(platform) + _STILL_S + _FADE_S


def _home_s(platform: Platform) -> float:
    speed_m_s = min(platform.speed_m_s, HOME_SPEED_m_s)
    braking_s = platform.speed_m_s / platform.acceleration_m_s2
    return _LATE * (_reach_m(platform) / speed_m_s + 2.0 * braking_s) + _ARRIVING_S


def _down_s(platform: Platform) -> float:
    return _MOST_S + _reach_m(platform) / BLIND_m_s


def _reach_m(platform: Platform) -> float:
    """Return how far from home a target may be, at the most."""
    box = platform.workspace_min_m, platform.home_m, platform.workspace_max_m
    sides = [max(home - low, high - home) for low, home, high in zip(*box, strict=True)]
    return math.hypot(*sides)


class LowerProgram(PlatformProgram):
    """Takes the platform home, where it stands at power-up, and lets go of it there.

    Where cables are not tight, or somebody wants it `blind`, because what is known of the platform
    may be wrong, every winch just lets its cable out at a limited speed, pulling no more than it
    may: the platform sinks as the cables that are left allow. It has ended when no cable carries
    anything any more; the torque has faded away then.
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
        control = parts.control
        inertia = np.full(3, control.inertia_kg_m2)
        self._reel = Reel(inertia, cable_m, parts.period_s)
        self._bare = PlanarTensions(np.zeros(3), parts.most_N)
        self._weight = np.array([0.0, -parts.platform.mass_kg * G_m_s2])
        self._high = np.minimum(parts.most_N, torque_Nm / np.abs(cable_m))
        self._least = np.array(control.least_N)
        self._home_s, self._down_s = _home_s(parts.platform), _down_s(parts.platform)
        self._keeping = np.zeros(3)
        self._cable = np.array(cable_m)
        self._here = np.zeros(3)
        self._stage = ""
        self._cycles = self._still = 0
        self._blind = False
        self._velocity = parts.estimator.estimate.velocity_rad_s

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (3,) each."""
        self._cycles = self._still = 0
        self._blind = not self._parts.tight
        # cables that were not tight are left as loose as they are
        self._keeping[:] = 0.0 if self._blind else _KEEPING_SHARE * self._least
        self._stage = "home"
        if self._parts.tight:
            super().start(feedback, setpoint, torque_Nm)
            self._target[:] = self._parts.platform.home_m
            np.minimum(self._parts.speed_m_s, HOME_SPEED_m_s, out=self._speed)
        self._at_rest = self._stopping = False

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (3,) each, in place."""
        self._cycles += 1
        if self._stage == "home" and not self._blind:
            super().update(feedback, setpoint, torque_Nm)
            self._at_rest = False
            if self._is_home():
                self._let_go(feedback, torque_Nm, SETTLING_m_s, STANDING_1_s)
            elif self._cycles * self._parts.period_s > self._home_s:
                self._blind = True  # something keeps it from coming home
            return
        if self._stage == "home":
            if self._parts.tight:
                self._parts.last.displaced = True
                self._carry_weight(torque_Nm)
            self._let_go(feedback, torque_Nm, BLIND_m_s, HANGING_1_s)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._reel.update(feedback, torque_Nm)
        self._watch_rest(feedback)

    def stop(self) -> None:
        """Nothing is quicker than to go on: it is at rest when the platform stands."""

    def progress(self) -> dict[str, Any]:
        """Return which stage it is in, how hard the cables are pulled, and whether it has ended."""
        told = {"stage": self._stage, "blind": self._blind, "done": float(self._at_rest)}
        if self._stage == "home":
            return {**super().progress(), **told}
        return {"tension_N": self._reel.tension_N.tolist(), **told}

    def _parsed(self, wanted: Mapping[str, Any]) -> bool:
        Wanted(self.name, wanted, ("blind",))
        blind = wanted.get("blind", False)
        if not isinstance(blind, bool):
            raise ProgramError(f"lower: blind: value {blind!r}; allowed: true or false")
        return blind

    def _take(self, blind: bool) -> None:
        self._blind = self._blind or blind

    def _is_home(self) -> bool:
        """Whether the platform has arrived, or its set-point has and it does not come after."""
        if not self._approach_ended:
            self._still = 0
            return False
        self._still += 1
        control = self._control
        away = control.estimated_m - control.position_m
        arrived = bool(np.abs(away).max() < _ARRIVED_m)
        waited_s = self._still * self._parts.period_s
        return waited_s > (0.25 if arrived else _ARRIVING_S)

    @property
    def _approach_ended(self) -> bool:
        control = self._control
        return bool((control.position_m == self._target).all() and not control.velocity_m_s.any())

    def _carry_weight(self, torque_Nm: FloatArray) -> None:
        """Have the cables carry the weight and nothing else, as far as anybody knows.

        What they pulled against each other would fling the platform where one of them has gone.
        """
        J = self._parts.geometry.jacobian(self._control.estimated_m)
        tension, _ = self._bare.distribute(J, self._weight)
        torque_Nm[:] = -self._cable * np.maximum(tension, self._keeping)

    def _let_go(
        self, feedback: AxisFeedback, torque_Nm: FloatArray, speed_m_s: float, rate_1_s: float
    ) -> None:
        self._parts.tight = False
        self._stage = "down"
        self._still = self._cycles = 0
        reel = self._reel
        reel.low_N[:], reel.high_N[:] = self._keeping, self._high
        reel.paying_out_m_s[:] = speed_m_s
        reel.most_in_m_s = _MOST_IN_m_s
        reel.integral_rate_1_s = rate_1_s
        # what no platform of its has at its limits is an encoder's jump
        fastest = _FASTEST * np.linalg.norm(self._parts.speed_m_s) / np.abs(self._cable)
        plausible = np.abs(self._velocity) < fastest
        reel.begin(feedback, np.where(plausible, self._velocity, 0.0), torque_Nm)
        self._control.compensation_Nm[:] = 0.0

    def _watch_rest(self, feedback: AxisFeedback) -> None:
        reel, period_s = self._reel, self._parts.period_s
        if self._stage == "fade":
            reel.low_N -= self._keeping * (period_s / _FADE_S)
            np.maximum(reel.low_N, 0.0, out=reel.low_N)
            reel.high_N[:] = reel.low_N
            self._at_rest = not reel.low_N.any()
            return
        light = bool((reel.tension_N <= _LIGHT * _KEEPING_SHARE * self._least).all())
        paid_out_m = float((self._cable * (feedback.position_rad - self._here)).max())
        if not light or paid_out_m > _STILL_m:
            self._here[:] = feedback.position_rad
            self._still = 0
        self._still += 1
        if self._still * period_s > _STILL_S or self._cycles * period_s > self._down_s:
            self._stage = "fade"
