"""What programs that move a planar platform have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.approach import approach, place_to_rest
from cdpr_rt.compensation import Compensation
from cdpr_rt.controllers.base import Controller
from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_control import PlanarControl
from cdpr_rt.robots.planar_kinematics import PlanarGeometry
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.last_lengths import LastLengths
from cdpr_rt.runtime.programs.base import REST_S, ProgramError
from cdpr_rt.runtime.programs.handover import Handover
from cdpr_rt.runtime.programs.wanted import Wanted
from profiles.platform import Platform

_LAGS_m, _WAITS_m = 0.02, 0.05
_LEAST_PACE = 1e-3


class PlatformParts:
    """What the programs of one platform share."""

    def __init__(
        self,
        platform: Platform,
        control: PlanarControl,
        estimator: Estimator,
        period_s: float,
        most_N: FloatArray,
        compensation: Compensation | None = None,
        lengths_disagree_m: float = math.inf,
    ) -> None:
        self.platform = platform
        self.lengths_allowed_m = min(platform.home_tolerance_m, lengths_disagree_m)
        """By how much its cables' lengths may contradict each other."""
        self.most_N = most_N
        """What each cable may be pulled with."""
        self.geometry = PlanarGeometry(
            np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
        )
        self.compensation = compensation
        self.last = LastLengths()
        """The lengths at which it was stopped."""
        self.control = control
        self.estimator = estimator
        self.period_s = period_s
        self.speed_m_s = np.full(2, platform.speed_m_s)
        self.acceleration_m_s2 = np.full(2, platform.acceleration_m_s2)
        self.cycle = -2
        """The last cycle in which one of the programs moved the platform."""
        self.tight = False
        self.loop = Handover(control, control.torque_Nm, period_s)
        """The platform's control, which the programs hand on to each other as it runs."""

    @property
    def tight(self) -> bool:
        """Whether all cables are tight and carry the platform, where it is known to be."""
        return not self.estimator.estimate.may_be_slack

    @tight.setter
    def tight(self, tight: bool) -> None:
        self.estimator.estimate.may_be_slack = not tight

    @property
    def known(self) -> bool:
        """Whether it is known where the platform is."""
        return bool(self.estimator.estimate.length_known.all())

    def wants_index(self, feedback: AxisFeedback) -> bool:
        """Whether a motor's cogging is known, but not yet its index."""
        known = self.compensation
        return known is not None and bool((known.available & ~feedback.index_known).any())

    def lengths_disagree_m(self) -> float:
        """Return by how much the cables' lengths contradict each other, while they are tight."""
        return self.control.residual_m if self.tight else 0.0

    def pretend(self, feedback: AxisFeedback) -> None:
        """Take the platform to be at home on tight cables, for a rehearsal."""
        lengths_m = self.control.lengths_at_home(self.control.least_N)
        self.control.take_lengths(lengths_m, feedback)
        self.control.begin(feedback)
        self.estimator.set_lengths(feedback.position_rad, self.control.free_lengths_m)
        self.tight = True

    def slacken(self) -> None:
        """Take the cables to be tight no more, wherever the platform is."""
        self.last.displaced = self.last.displaced or self.tight
        self.tight = False

    def forget(self) -> None:
        """Forget where the platform is, as if it stood at home."""
        self.tight = self.last.displaced = False
        self.estimator.forget_lengths()
        self.control.reset()


class PlatformProgram:
    """Keeps the platform where it is, its cables tight; others have their own `_move`.

    Where it is has to be known: `tighten` finds it.
    """

    name = "platform"
    needs_lease = False
    rest_s = REST_S

    def __init__(self, parts: PlatformParts, _torque_Nm: FloatArray) -> None:
        self._parts = parts
        self.controller: Controller = parts.control
        self._control = parts.control
        self._loop = parts.loop
        self._target = np.zeros(2)
        self._speed = np.array(parts.speed_m_s)
        self._stopping = False
        self._at_rest = True
        self._seen = np.zeros(7)
        self._rest, self._paced = np.zeros(2), np.zeros(2)

    def start(self, feedback: AxisFeedback, _setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; the platform brakes and stays."""
        parts, control = self._parts, self._control
        self._stopping = False
        self._at_rest = False
        if feedback.cycle - parts.cycle not in (0, 1):
            if parts.known:
                control.take_lengths(parts.estimator.estimate.cable_length_m, feedback)
            control.begin(feedback)
            control.stand_still()
            self._loop.take_over(feedback, torque_Nm)
        self._target[:] = self._resting_place()
        self._speed[:] = parts.speed_m_s

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, of a program that need not run."""
        self._parsed(wanted)

    def command(self, wanted: Mapping[str, Any]) -> None:
        """Take over what an operator wants; raises ProgramError and changes nothing then."""
        parsed = self._parsed(wanted)
        if self._stopping:
            raise ProgramError(f"{self.name}: it is being stopped; start it anew")
        self._at_rest = False
        self._take(parsed)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (3,) each, in place."""
        self._parts.cycle = feedback.cycle
        if self._stopping:
            self._at_rest = self._approach()
        else:
            self._at_rest = self._move()
        self._loop.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._stopping = True
        self._at_rest = False
        self._target[:] = self._resting_place()

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""
        return self._at_rest

    @property
    def stream_age_s(self) -> float:
        """There is no stream."""
        return float("nan")

    @property
    def stream_buttons(self) -> int:
        """There is no stream."""
        return 0

    @property
    def pose(self) -> FloatArray | None:
        """Return where the platform is, (7,)."""
        return self._control.pose if self._parts.known else None

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return where the platform is to be, (7,)."""
        if not self._parts.known:
            return None
        self._seen[:2] = self._control.shaped_m
        self._seen[3] = 1.0
        return self._seen

    def progress(self) -> dict[str, Any]:
        """Return where the platform is, and what of its tensions is missing."""
        control = self._control
        return {
            "position_m": control.estimated_m.tolist(),
            "target_m": self._target.tolist(),
            "tension_N": control.tension_N.tolist(),
            "missing": control.missing(),
            "held_back": self._held_back(),
            "done": float(self._at_rest),
        }

    def _held_back(self) -> str:
        """Return why the set-point does not go on, an empty text where it does."""
        lag_m = self._lag_m()
        if lag_m < _WAITS_m or not self._parts.known:
            return ""
        return f"the platform is {1e3 * lag_m:.0f} mm behind: friction, or something in its way"

    def _parsed(self, wanted: Mapping[str, Any]) -> Any:
        """Return what `_take` takes; raises ProgramError."""
        return Wanted(self.name, wanted, ())

    def _take(self, _parsed: Any) -> None:
        """Do from now on what was wanted."""

    def _move(self) -> bool:
        """Move the platform's set-point; return whether nothing is left to do."""
        return self._approach()

    def _lag_m(self) -> float:
        """Return how far the platform is from its set-point."""
        control = self._control
        wanted, there = control.shaped_m, control.estimated_m
        return math.hypot(wanted[0] - there[0], wanted[1] - there[1])

    def _pace(self) -> FloatArray:
        """Return the speed, (2,), less of it the further the platform lags; overwritten.

        A set-point that ran on from a platform which sticks would end in a following error.
        """
        share = 1.0
        if not self._stopping:
            share = (_WAITS_m - self._lag_m()) / (_WAITS_m - _LAGS_m)
        np.multiply(self._speed, min(max(share, _LEAST_PACE), 1.0), out=self._paced)
        return self._paced

    def _approach(self) -> bool:
        control, parts = self._control, self._parts
        return approach(
            self._target,
            self._pace(),
            parts.acceleration_m_s2,
            parts.period_s,
            control.position_m,
            control.velocity_m_s,
            control.acceleration_m_s2,
        )

    def _resting_place(self) -> FloatArray:
        """Return where the platform comes to rest when it is braked from now on; overwritten."""
        control = self._control
        acceleration = self._parts.acceleration_m_s2
        place_to_rest(control.position_m, control.velocity_m_s, acceleration, self._rest)
        return self._rest
