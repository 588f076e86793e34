"""Position controllers of axes: PID with anti-windup, and proportional for cogging sweeps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import bound, bound_to, jit

# the last state of an axis: whether its controller runs, or starts with a given integral
_RUNNING, _BUMPLESS_START = 1.0, 2.0
# filter time of speed and share followed, and how long the share is kept after the motion:
# friction continues to creep while the rotor comes to rest
_SPEED_S, _FOLLOWS_S, _KEPT_S = 0.05, 0.05, 1.0
# slower set-points count as standing; they might only follow a reading that flickers by a count
_STANDS_RAD_S = 0.05
# a larger error has no more effect: it comes from a swinging load, not friction and cogging
_MOST_FOLLOWING_RAD = math.radians(1.0)


@dataclass(frozen=True)
class PidGains:
    """Gains of one axis: torque per angle error, its integral and its filtered derivative."""

    proportional_Nm_rad: float
    integral_Nm_rad_s: float
    derivative_Nms_rad: float
    derivative_filter_s: float
    following_Nm_rad_s: float = 0.0
    """Addition to the integral gain, multiplied by the share of the set-point's motion that is
    followed."""


@jit
def _follow(state: FloatArray, period: float, position: float, speed: float) -> float:
    """Return the share of the set-point's speed that an axis follows, 0 to 1; `state` is (3,).

    It is 0 for a blocked axis, even if the set-point moves.
    """
    state[1] += ((position - state[0]) / period - state[1]) * period / (_SPEED_S + period)
    state[0] = position
    if abs(speed) > _STANDS_RAD_S:
        share = min(max(state[1] / speed, 0.0), 1.0)
        state[2] += (share - state[2]) * period / (_FOLLOWS_S + period)
    else:
        state[2] -= state[2] * period / (_KEPT_S + period)
    return float(state[2])


@jit
def _update(
    gains: FloatArray,
    limit: FloatArray,
    period: float,
    state: FloatArray,
    position: FloatArray,
    reference: FloatArray,
    speed: FloatArray,
    feedforward: FloatArray,
    effort: FloatArray,
    torque: FloatArray,
) -> None:
    for i in range(limit.size):
        kp, ki, kd, filter_s = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3]
        error = reference[i] - position[i]
        if state[i, 3] != _RUNNING:  # no earlier error to differentiate
            state[i, 1] = error
            state[i, 4] = position[i]
            state[i, 5] = state[i, 6] = 0.0
            if state[i, 3] == _BUMPLESS_START:
                # the integral provides the torque that the error and the feed-forward torque do not
                state[i, 0] -= (kp + ki * period) * error + feedforward[i]
            state[i, 3] = _RUNNING
        slope = (filter_s * state[i, 2] + error - state[i, 1]) / (filter_s + period)
        integral = state[i, 0] + ki * period * error
        if gains[i, 4] > 0.0:
            share = _follow(state[i, 4:], period, position[i], speed[i])
            near = min(max(error, -_MOST_FOLLOWING_RAD), _MOST_FOLLOWING_RAD)
            integral += share * gains[i, 4] * period * near
        u = kp * error + integral + kd * slope
        total = u + feedforward[i]
        limited = min(max(total, -limit[i]), limit[i])
        if limited != total and (total - limited) * error > 0.0:
            # the integrator would only push further into the limit, so keep its value
            integral = state[i, 0]
            u = kp * error + integral + kd * slope
            limited = min(max(u + feedforward[i], -limit[i]), limit[i])
        state[i, 0] = integral
        state[i, 1] = error
        state[i, 2] = slope
        effort[i] = u
        torque[i] = limited


class Pid:
    """PID on position plus an optional compensation, saturated (Tremblay, figure 1.8).

    The derivative is filtered by a first-order lag (backward difference); integration stops while
    it would drive the torque further beyond its limit. While an axis follows a moving set-point,
    and shortly after, the integral may be faster, to keep up with cogging and friction. A blocked
    axis does not count as following. Shapes: `gains` one per axis, `limit_Nm` (n,).
    """

    def __init__(
        self,
        gains: list[PidGains],
        limit_Nm: FloatArray,
        period_s: float,
        compensation: Compensation | None = None,
    ) -> None:
        self._gains = np.array(
            [
                (
                    g.proportional_Nm_rad,
                    g.integral_Nm_rad_s,
                    g.derivative_Nms_rad,
                    g.derivative_filter_s,
                    g.following_Nm_rad_s,
                )
                for g in gains
            ]
        )
        self._limit = np.array(limit_Nm, float)
        self._period_s = period_s
        self._compensation = compensation
        # integral, last error, filtered slope, whether it runs; position, speed, share followed
        self._state = np.zeros((len(gains), 7))
        self.effort_Nm = np.zeros(len(gains))
        self.compensation_Nm = self.motor_loss_Nm = np.zeros(len(gains))
        self.cogging_Nm = np.zeros(len(gains)) if compensation is None else compensation.cogging_Nm
        self._kernel = bound_to(self._bind)

    def reset(self) -> None:
        """Restart with integral and slope zero."""
        self._state[:] = 0.0
        if self._compensation is not None:
            self._compensation.reset()

    def take_over(self, torque_Nm: FloatArray) -> None:
        """Restart so that the first `update` writes the torques (n,), within the limits.

        The integral compensates for any error at that time, so the new controller holds the load
        that the previous one held.
        """
        self.reset()
        self._state[:, 0] = torque_Nm
        self._state[:, 3] = _BUMPLESS_START

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the limited sum of PID and compensation."""
        if self._compensation is not None:
            self._compensation.torque(feedback, setpoint, self.compensation_Nm)
        self._kernel(feedback, setpoint, torque_Nm)()

    def _bind(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> Callable[[], None]:
        return bound(
            _update, self._gains, self._limit, self._period_s, self._state,
            feedback.position_rad, setpoint.position_rad, setpoint.velocity_rad_s,
            self.compensation_Nm, self.effort_Nm, torque_Nm,
        )  # fmt: skip


# The high-gain proportional controller of the cogging sweep.


@jit
def _act(
    gain: FloatArray,
    limit: FloatArray,
    position: FloatArray,
    reference: FloatArray,
    effort: FloatArray,
    torque: FloatArray,
) -> None:
    for i in range(gain.size):
        u = gain[i] * (reference[i] - position[i])
        u = min(max(u, -limit[i]), limit[i])
        effort[i] = u
        torque[i] = u


class Proportional:
    """Torque in proportion to the position error, limited (Tremblay, section 1.3, figure 1.2).

    Without integral action the torque keeps the sign of the ramp's slope as long as friction
    prevails, so that each recording belongs to one direction of motion.
    Parameters, shapes (n,): `gain_Nm_rad`, `limit_Nm`.
    """

    def __init__(self, gain_Nm_rad: FloatArray, limit_Nm: FloatArray) -> None:
        self._gain = np.array(gain_Nm_rad, float)
        self._limit = np.array(limit_Nm, float)
        self.effort_Nm = np.zeros_like(self._gain)
        self.compensation_Nm = self.motor_loss_Nm = self.cogging_Nm = np.zeros_like(self._gain)
        self._kernel = bound_to(self._bind)

    def reset(self) -> None:
        """Do nothing: there is no state."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the limited proportional torque."""
        self._kernel(feedback, setpoint, torque_Nm)()

    def _bind(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> Callable[[], None]:
        return bound(
            _act, self._gain, self._limit, feedback.position_rad, setpoint.position_rad,
            self.effort_Nm, torque_Nm,
        )  # fmt: skip
