"""PID position controller with derivative filter, anti-windup and a term known beforehand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdpr_rt.control import stiction
from cdpr_rt.core.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.jit import jit

# what an axis' last state says: how it goes on
_RUNNING, _PRESET = 1.0, 2.0


@dataclass(frozen=True)
class PidGains:
    """Gains of one axis: torque per angle error, its integral and its filtered derivative."""

    proportional_Nm_rad: float
    integral_Nm_rad_s: float
    derivative_Nms_rad: float
    derivative_filter_s: float


class Compensation(Protocol):
    """A torque known before the error appears: cogging and friction of each motor."""

    def reset(self) -> None:
        """Forget the past."""

    def torque(self, feedback: AxisFeedback, setpoint: Setpoint, out: FloatArray) -> None:
        """Write the torque to add, (n,), Nm."""


@jit
def _update(
    gains: FloatArray,
    limit: FloatArray,
    period: float,
    state: FloatArray,
    most_push: FloatArray,
    standing: FloatArray,
    position: FloatArray,
    reference: FloatArray,
    known: FloatArray,
    effort: FloatArray,
    torque: FloatArray,
) -> None:
    for i in range(limit.size):
        kp, ki, kd, filter_s = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3]
        error = reference[i] - position[i]
        begins = state[i, 3] != _RUNNING
        if begins:  # no error before this one to differentiate
            state[i, 1] = error
            if state[i, 3] == _PRESET:
                # what the error and the known torque do not account for is the integral's
                state[i, 0] -= (kp + ki * period) * error + known[i]
            state[i, 3] = _RUNNING
            stiction.start(standing[i], position[i], reference[i])
        slope = (filter_s * state[i, 2] + error - state[i, 1]) / (filter_s + period)
        integral = state[i, 0] + ki * period * error
        if most_push[i] > 0.0 and not begins:
            integral = stiction.step_integral(
                standing[i],
                period,
                kp,
                ki,
                state[i, 0],
                position[i],
                reference[i],
                limit[i],
                most_push[i],
            )
        u = kp * error + integral + kd * slope
        total = u + known[i]
        limited = min(max(total, -limit[i]), limit[i])
        if limited != total and (total - limited) * error > 0.0:
            # the integrator would only push further into the limit: keep it where it was
            integral = state[i, 0]
            u = kp * error + integral + kd * slope
            limited = min(max(u + known[i], -limit[i]), limit[i])
        state[i, 0] = integral
        state[i, 1] = error
        state[i, 2] = slope
        effort[i] = u
        torque[i] = limited


class Pid:
    """PID on position plus an optional compensation, saturated (Tremblay, figure 1.8).

    The derivative is filtered by a first-order lag (backward difference); integration stops
    while it would drive the torque further beyond its limit. Shapes: `gains` one per axis,
    `limit_Nm` (n,). With `most_push_Nm` (n,) an axis that friction holds off a set-point which
    stands is brought there, with so much more torque at most; see `stiction`.
    """

    def __init__(
        self,
        gains: list[PidGains],
        limit_Nm: FloatArray,
        period_s: float,
        compensation: Compensation | None = None,
        most_push_Nm: FloatArray | None = None,
    ) -> None:
        self._gains = np.array(
            [
                (
                    g.proportional_Nm_rad,
                    g.integral_Nm_rad_s,
                    g.derivative_Nms_rad,
                    g.derivative_filter_s,
                )
                for g in gains
            ]
        )
        self._limit = np.array(limit_Nm, float)
        self._period_s = period_s
        self._compensation = compensation
        # integral, last error, filtered slope, how to go on
        self._state = np.zeros((len(gains), 4))
        self._most_push = np.zeros(len(gains)) if most_push_Nm is None else np.array(most_push_Nm)
        self._standing = np.zeros((len(gains), stiction.COLUMNS))
        self.effort_Nm = np.zeros(len(gains))
        self.compensation_Nm = np.zeros(len(gains))

    def reset(self) -> None:
        """Start anew: integral and slope zero."""
        self._state[:] = 0.0
        if self._compensation is not None:
            self._compensation.reset()

    def take_over(self, torque_Nm: FloatArray) -> None:
        """Start anew with the torques (n,) that the first `update` is to write, within the limits.

        Whatever the error is then, the integral makes up for it: a controller that held a load is
        followed by one that holds it.
        """
        self.reset()
        self._state[:, 0] = torque_Nm
        self._state[:, 3] = _PRESET

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the limited sum of PID and compensation."""
        if self._compensation is not None:
            self._compensation.torque(feedback, setpoint, self.compensation_Nm)
        _update(
            self._gains,
            self._limit,
            self._period_s,
            self._state,
            self._most_push,
            self._standing,
            feedback.position_rad,
            setpoint.position_rad,
            self.compensation_Nm,
            self.effort_Nm,
            torque_Nm,
        )
