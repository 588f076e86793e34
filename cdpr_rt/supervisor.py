"""The last word between controller and drives: limits that stop the motion, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.exchange import AxisFeedback, BoolArray, FloatArray, Setpoint
from cdpr_rt.jit import jit

_OK, _MISSED, _SPEED, _FOLLOWING, _NOT_FINITE = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class Limits:
    """What the supervisor tolerates: one figure for every axis, or (n,) for each its own."""

    torque_Nm: float | FloatArray
    """Torque is clamped to this."""
    speed_rad_s: float | FloatArray
    following_error_rad: float | FloatArray
    missed_cycles: int = 3
    """Consecutive cycles without an answer that are bridged."""


@jit
def _check(
    limits: FloatArray,
    state: FloatArray,
    period: float,
    position: FloatArray,
    reference: FloatArray,
    valid: BoolArray,
    torque: FloatArray,
) -> tuple[int, int, float]:
    # columns of limits: torque, speed, following error, misses
    # columns of state: last position, low-passed speed, consecutive misses, started
    for i in range(torque.size):
        if not np.isfinite(torque[i]):
            return _NOT_FINITE, i, torque[i]
        torque[i] = min(max(torque[i], -limits[i, 0]), limits[i, 0])
        if not valid[i]:
            state[i, 2] += 1.0
            if state[i, 2] > limits[i, 3]:
                return _MISSED, i, state[i, 2]
            continue
        if state[i, 3] == 0.0:
            state[i, 0] = position[i]
            state[i, 3] = 1.0
        elapsed = period * (1.0 + state[i, 2])
        state[i, 2] = 0.0
        # one encoder step a cycle is hundreds of counts a second: judge the speed over 10 ms
        weight = elapsed / (elapsed + 0.01)
        state[i, 1] += weight * ((position[i] - state[i, 0]) / elapsed - state[i, 1])
        state[i, 0] = position[i]
        if abs(state[i, 1]) > limits[i, 1]:
            return _SPEED, i, state[i, 1]
        error = reference[i] - position[i]
        if abs(error) > limits[i, 2]:
            return _FOLLOWING, i, error
    return _OK, 0, 0.0


class Supervisor:
    """Clamps torque and says when a motion must end; latches nothing, the executive stops."""

    def __init__(self, limits: Limits, n: int, period_s: float) -> None:
        self.limits = limits
        columns = (
            limits.torque_Nm,
            limits.speed_rad_s,
            limits.following_error_rad,
            float(limits.missed_cycles),
        )
        self._limits = np.stack([np.broadcast_to(c, (n,)) for c in columns], axis=1).astype(float)
        self._state = np.zeros((n, 4))
        self._period_s = period_s

    def reset(self) -> None:
        """Forget speeds and misses, before a motion starts."""
        self._state[:] = 0.0

    def check(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> str:
        """Clamp `torque_Nm` (n,) in place; return why the motion must end, or an empty text."""
        code, axis, value = _check(
            self._limits,
            self._state,
            self._period_s,
            feedback.position_rad,
            setpoint.position_rad,
            feedback.valid,
            torque_Nm,
        )
        return self._reason(code, axis, value) if code != _OK else ""

    def _reason(self, code: int, axis: int, value: float) -> str:
        _, speed, following, misses = self._limits[axis]
        if code == _MISSED:
            return f"axis {axis}: no feedback for {value:.0f} cycles, {misses:.0f} allowed"
        if code == _SPEED:
            return (
                f"axis {axis}: speed {np.degrees(value):.0f} deg/s, "
                f"{np.degrees(speed):.0f} deg/s allowed"
            )
        if code == _FOLLOWING:
            return (
                f"axis {axis}: following error {np.degrees(value):.1f} deg, "
                f"{np.degrees(following):.1f} deg allowed"
            )
        return f"axis {axis}: the controller's torque is {value}, a finite number is required"
