"""Estimate of each axis from its feedback: velocity, cable length, tension."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.exchange import AxisFeedback, TensionFeedback
from cdpr_rt.jit import bound, bound_to, jit

FILTER_S = 0.01
"""Filter time of speed and torque; without it, one encoder step per cycle would look like a high
speed."""
_AT_ONCE_S = 0.001
"""Filter time for detecting a tension that rises within some ms."""
_FRICTION_FULL_rad_s = 0.1
_M_PER_RAD, _GAIN, _BIAS, _FRICTION, _FRICTION_PER_N, _INERTIA = range(6)
"""The rows of `WinchArrays.table`."""

_STATE = np.dtype(
    [
        ("position", "<f8"),
        ("torque", "<f8"),  # low-passed, without the torque for the motor itself
        ("elapsed", "<f8"),  # time since the last valid position
        ("started", "<f8"),
        ("fast_velocity", "<f8"),  # velocity of the motor, low-passed lightly
        ("length_at_zero", "<f8"),  # cable length at motor angle 0; nan if unknown
    ]
)


@dataclass(frozen=True)
class WinchArrays:
    """Parameters of n winches for the estimate; shapes are (n,).

    Winding torque = gain·tension + bias ± (friction + friction_per_N·tension), as in a winch's
    calibration. The sign is + while the cable is wound in.
    """

    cable_m_per_rad: FloatArray
    """Cable paid out per radian of the motor, with its sign; 0 without a cable."""
    gain_m: FloatArray
    """Nm at the motor per N of tension (K_t of Tremblay, section 3.6.2)."""
    bias_Nm: FloatArray
    friction_Nm: FloatArray
    friction_per_N_m: FloatArray
    inertia_kg_m2: FloatArray
    """Inertia that the motor accelerates, without the load of the cable."""

    @classmethod
    def bare(cls, n: int) -> WinchArrays:
        """Return the parameters of n motors without cables."""
        return cls(*(np.zeros(n) for _ in range(6)))

    def table(self) -> FloatArray:
        """Return all parameters as (6, n), one row for each attribute in their order."""
        return np.array(
            [
                self.cable_m_per_rad,
                self.gain_m,
                self.bias_Nm,
                self.friction_Nm,
                self.friction_per_N_m,
                self.inertia_kg_m2,
            ],
            float,
        )


class AxisEstimate:
    """Estimates of n axes; shapes are (n,); overwritten in place every cycle."""

    def __init__(self, n: int) -> None:
        self.elapsed_s = 0.0
        """Time from the last SYNC to this one."""
        self.velocity_rad_s: FloatArray = np.zeros(n)
        self.cable_m_per_rad: FloatArray = np.zeros(n)
        self.cable_length_m: FloatArray = np.full(n, np.nan)
        """Length of cable off the drum; nan if it is not known."""
        self.length_known: BoolArray = np.zeros(n, np.bool_)
        self.tension_N: FloatArray = np.full(n, np.nan)
        """Tension, measured or estimated from the torque; nan if neither is possible."""
        self.tension_at_once_N: FloatArray = np.full(n, np.nan)
        """Tension from the torque, filtered over only 1 ms: noisy, but it shows a snatch load."""
        self.slack_allowed = False
        """Whether cables are being tightened or slackened, so that a slack cable is not a fault."""
        self.tension_measured: BoolArray = np.zeros(n, np.bool_)
        self.sensor_ok: BoolArray = np.ones(n, np.bool_)
        """Whether tension sensors are valid: False if the reading of an existing sensor is
        invalid."""
        self.upward: FloatArray = np.zeros(4)
        """Reading of the inclinometer, as in `TensionFeedback`."""


@jit
def _update(
    winch: FloatArray,
    states: Any,
    velocity: FloatArray,
    length: FloatArray,
    tension: FloatArray,
    at_once: FloatArray,
    position: FloatArray,
    torque: FloatArray,
    valid: BoolArray,
    loss: FloatArray,
    cogging: FloatArray,
    elapsed: float,
) -> None:
    for i in range(position.size):
        state = states[i]
        state["elapsed"] += elapsed
        if not valid[i]:
            continue
        # the measured friction of a winch includes the friction of the motor, but not its cogging
        net_torque = torque[i] - (loss[i] if winch[_FRICTION, i] == 0.0 else cogging[i])
        if state["started"] == 0.0:
            state["position"], state["torque"] = position[i], net_torque
            state["started"], velocity[i], state["fast_velocity"] = 1.0, 0.0, 0.0
        dt = state["elapsed"]
        fast = dt / (dt + _AT_ONCE_S)
        fast *= (position[i] - state["position"]) / dt - state["fast_velocity"]
        state["fast_velocity"] += fast
        weight = dt / (dt + FILTER_S)
        change = weight * ((position[i] - state["position"]) / dt - velocity[i])
        velocity[i] += change
        state["torque"] += weight * (net_torque - state["torque"])
        state["position"], state["elapsed"] = position[i], 0.0
        length[i] = state["length_at_zero"] + winch[_M_PER_RAD, i] * position[i]
        tension[i] = at_once[i] = np.nan
        if winch[_GAIN, i] > 0.0:
            # torque that does not accelerate the motor acts on the cable
            cable_torque = state["torque"] - winch[_INERTIA, i] * change / dt
            tension[i] = _tension(winch[:, i], cable_torque, velocity[i])
            cable_torque = net_torque - winch[_INERTIA, i] * fast / dt
            at_once[i] = _tension(winch[:, i], cable_torque, state["fast_velocity"])


@jit
def _tension(winch: FloatArray, torque: float, velocity: float) -> float:
    sign = 1.0 if winch[_M_PER_RAD] >= 0.0 else -1.0
    winding = -sign * velocity / _FRICTION_FULL_rad_s
    direction = min(max(winding, -1.0), 1.0)
    balanced = -sign * torque - winch[_BIAS] - direction * winch[_FRICTION]
    return max(0.0, float(balanced / (winch[_GAIN] + direction * winch[_FRICTION_PER_N])))


@jit
def _take_sensors(
    read_N: FloatArray,
    read_valid: BoolArray,
    tension: FloatArray,
    measured: BoolArray,
    sensor_ok: BoolArray,
) -> None:
    for i in range(min(tension.size, read_N.size)):
        sensor_ok[i] = measured[i] = read_valid[i]
        if read_valid[i]:
            tension[i] = read_N[i]


class Estimator:
    """Updates an `AxisEstimate` once per cycle; allocates nothing.

    The tension readings belong to the first axes.
    """

    def __init__(self, n: int, period_s: float, winches: WinchArrays | None = None) -> None:
        self.estimate = AxisEstimate(n)
        self.origins_lost = 0
        """Number of times that lengths were discarded because the origins of the angles were
        lost."""
        self._period_s = period_s
        self._winch = (winches or WinchArrays.bare(n)).table()
        self.estimate.cable_m_per_rad[:] = self._winch[_M_PER_RAD]
        self._state = np.zeros(n, _STATE)
        self._state["length_at_zero"] = np.nan
        self._no_torque = np.zeros(n)
        self._kernel = bound_to(self._bind)

    def reset(self) -> None:
        """Discard speeds, torques and tensions after a pause of the cycles; lengths stay known."""
        for field in ("position", "torque", "elapsed", "started"):
            self._state[field] = 0.0
        self.estimate.velocity_rad_s[:] = 0.0
        self.estimate.tension_N[:] = self.estimate.tension_at_once_N[:] = np.nan
        self.estimate.tension_measured[:] = False
        self.estimate.sensor_ok[:] = True

    @property
    def position_rad(self) -> FloatArray:
        """The motors' angles as last received, (n,)."""
        return np.asarray(self._state["position"])

    def set_lengths(self, position_rad: FloatArray, length_m: FloatArray) -> None:
        """Set the cable lengths (n,) at these motor angles; a length with nan does not change."""
        for i, length in enumerate(length_m):
            if math.isfinite(length) and self._winch[_M_PER_RAD, i] != 0.0:
                self._state["length_at_zero"][i] = (
                    length - self._winch[_M_PER_RAD, i] * position_rad[i]
                )
                self.estimate.cable_length_m[i] = length
        np.isfinite(self._state["length_at_zero"], out=self.estimate.length_known)

    def forget_lengths(self) -> None:
        """Mark all lengths as unknown, for example after the drives have lost their origins."""
        self.origins_lost += 1
        self._state["length_at_zero"] = np.nan
        self.estimate.length_known[:] = False

    def update(
        self,
        feedback: AxisFeedback,
        tension: TensionFeedback | None = None,
        elapsed_s: float = 0.0,
        motor_loss_Nm: FloatArray | None = None,
        cogging_Nm: FloatArray | None = None,
    ) -> None:
        """Process this cycle's feedback and the last tension readings.

        `elapsed_s` is the time from the last SYNC to this one, one period by default.
        `motor_loss_Nm` (n,) is the part of the torque that compensates the motors' own cogging and
        friction, `cogging_Nm` (n,) the part for cogging alone.
        """
        estimate = self.estimate
        estimate.elapsed_s = elapsed_s or self._period_s
        loss = self._no_torque if motor_loss_Nm is None else motor_loss_Nm
        cogging = self._no_torque if cogging_Nm is None else cogging_Nm
        self._kernel(feedback, loss, cogging)(estimate.elapsed_s)
        if tension is not None:
            _take_sensors(
                tension.tension_N, tension.valid, estimate.tension_N, estimate.tension_measured,
                estimate.sensor_ok,
            )  # fmt: skip
            np.copyto(estimate.upward, tension.upward)

    def _bind(
        self, feedback: AxisFeedback, loss: FloatArray, cogging: FloatArray
    ) -> Callable[[float], None]:
        estimate = self.estimate
        return bound(
            _update, self._winch, self._state, estimate.velocity_rad_s, estimate.cable_length_m,
            estimate.tension_N, estimate.tension_at_once_N, feedback.position_rad,
            feedback.torque_Nm, feedback.valid, loss, cogging, then=(0.0,),
        )  # fmt: skip
