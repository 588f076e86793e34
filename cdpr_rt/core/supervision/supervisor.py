"""Supervisor between controller and drives: every limit, and the reaction to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervision.limit_kernel import (
    AXIS_HISTORY,
    AXIS_LIMITS,
    FIGURES,
    VERDICT,
    Signals,
    check_axes,
)
from cdpr_rt.core.supervision.limits import DEFAULT_REACTIONS, Limits
from cdpr_rt.jit import bound, bound_to


class Supervisor:
    """Clamps torque and returns the reaction to the most severe of the exceeded limits.

    It latches nothing: whoever runs the cycle acts. `names` are what messages call the axes.
    """

    def __init__(self, limits: Limits, n: int, period_s: float, names: Sequence[str] = ()) -> None:
        self.limits = limits
        self._names = tuple(names) or tuple(f"axis {i + 1}" for i in range(n))
        self._limits = np.zeros(n, AXIS_LIMITS)
        for name in FIGURES:
            self._limits[name] = getattr(limits, name)
        self._limits["period_s"] = period_s
        reactions = DEFAULT_REACTIONS | dict(limits.reactions)
        self._reactions = np.array([reactions.get(limit, 0) for limit in Limit], np.int64)
        self._history = np.zeros(n, AXIS_HISTORY)
        self._window = np.zeros((limits.window_cycles, n), np.int64)
        self._verdict = np.zeros(1, VERDICT)
        self._reported_reason = ""
        self._disagree_s = 0.0
        self._kernel = bound_to(self._bind)

    def reset(self, torque_Nm: FloatArray | float = 0.0) -> None:
        """Forget the past, before motors are driven; `torque_Nm` is what they are driven with."""
        self._history[:] = np.zeros(1, AXIS_HISTORY)
        self._history["torque"] = torque_Nm
        self._window[:] = 0
        self._verdict[:] = np.zeros(1, VERDICT)
        self._reported_reason = ""
        self._disagree_s = 0.0

    def check(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
    ) -> int:
        """Clamp `torque_Nm` (n,) in place; return the `Reaction` that this cycle calls for.

        The arrays of all four are those of the last call as long as the objects are.
        """
        self._reported_reason = ""
        check = self._kernel(feedback, estimate, setpoint, torque_Nm)
        return check(estimate.elapsed_s, estimate.slack_allowed)

    def _bind(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
    ) -> Callable[[float, bool], int]:
        return bound(
            check_axes, self._limits, self._history, self._window, self._reactions, self._verdict,
            Signals(
                feedback.position_rad, feedback.valid, feedback.alive, feedback.rate_ok,
                setpoint.position_rad, setpoint.velocity_rad_s, estimate.velocity_rad_s,
                estimate.cable_m_per_rad, estimate.cable_length_m, estimate.tension_N,
                estimate.sensor_ok,
            ),
            torque_Nm, then=(0.0, False),
        )  # fmt: skip

    def compare_lengths(self, elapsed_s: float, disagree_m: float, axis: int) -> int:
        """Judge by how much cable lengths contradict each other; return the `Reaction` so far.

        `elapsed_s` is the time since the last cycle; `axis` that of the cable which contradicts the
        others, -1 where it is not known. It counts once they have disagreed for `broken_within_s`
        longer than they agreed in between: that a cable has broken is told as such, and what
        swings about agreement is noticed.
        """
        allowed = self.limits.lengths_disagree_m
        agree = disagree_m <= allowed
        self._disagree_s = max(self._disagree_s + (-elapsed_s if agree else elapsed_s), 0.0)
        if self._disagree_s > self.limits.broken_within_s:
            return self._note(Limit.LENGTHS, axis, disagree_m, allowed)
        return int(self._verdict["reaction"][0])

    def report(self, limit: Limit, reason: str) -> int:
        """Take in what another found, such as a drive's alarm; return the `Reaction` to it.

        It counts until the next `check`, and beside what that one found only if it is worse.
        """
        return self._note(limit, -1, math.nan, math.nan, reason)

    def _note(self, limit: Limit, axis: int, value: float, allowed: float, reason: str = "") -> int:
        reaction, worst = int(self._reactions[limit]), int(self._verdict["reaction"][0])
        if reaction > worst:
            self._verdict[0] = (reaction, limit, axis, value, allowed)
            self._reported_reason = reason
        return max(reaction, worst)

    @property
    def reaction(self) -> Reaction:
        """Reaction of the last cycle."""
        return Reaction(int(self._verdict["reaction"][0]))

    @property
    def limit(self) -> Limit:
        """Exceeded limit, NONE where none was."""
        return Limit(int(self._verdict["limit"][0]))

    @property
    def axis(self) -> int:
        """Axis that exceeded it, -1 where it is of no single axis."""
        return int(self._verdict["axis"][0]) if self.limit else -1

    @property
    def value(self) -> float:
        """Value that exceeded it, in its SI unit; nan where it has none."""
        return float(self._verdict["value"][0])

    @property
    def allowed(self) -> float:
        """Allowed value."""
        return float(self._verdict["allowed"][0])

    def reason(self) -> str:
        """Return the exceeded limit, its axis, value and allowed value in words; "" for none."""
        limit = self.limit
        if self._reported_reason or not limit:
            return self._reported_reason
        text = limit.text.format(limit.factor * self.value, limit.factor * self.allowed)
        return text if self.axis < 0 else f"{self._names[self.axis]}: {text}"

    def details(self) -> dict[str, Any] | None:
        """Return the same for a program, None where nothing was exceeded."""
        limit = self.limit
        if not limit:
            return None
        figures = [x if math.isfinite(x) else None for x in (self.value, self.allowed)]
        return {
            "limit": limit.key,
            "axis": self.axis,
            "value": figures[0],
            "allowed": figures[1],
            "unit": limit.unit,
            "reaction": self.reaction.label,
        }
