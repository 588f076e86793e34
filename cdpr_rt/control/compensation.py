"""Feed-forward torque from the motor's profile: cogging by table, and friction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import bound, bound_to, jit

TWO_PI = 2.0 * math.pi

_FADE_IN_S = 0.2
# columns of the parameter array of one axis
_LOOK_AHEAD, _OBSERVER_POLE, _BLEND = 0, 1, 2
_COULOMB_FORWARD, _COULOMB_BACKWARD, _STRIBECK_FORWARD, _STRIBECK_BACKWARD = 3, 4, 5, 6
_STRIBECK_SPEED, _VISCOUS, _AVAILABLE, _BOUND = 7, 8, 9, 10
_COLUMNS = 11
# columns of the state of one axis
_FADE, _STARTED, _DEVIATION, _DRIFT = 0, 1, 2, 3
_STATES = 4


@dataclass(frozen=True)
class FrictionFeedforward:
    """Friction to compensate: (Coulomb + Stribeck·exp(-(v/v_s)²))·sign(v) + viscous·v."""

    coulomb_forward_Nm: float = 0.0
    coulomb_backward_Nm: float = 0.0
    """Coulomb friction while the angle decreases, as a magnitude."""
    stribeck_forward_Nm: float = 0.0
    stribeck_backward_Nm: float = 0.0
    stribeck_speed_rad_s: float = 1.0
    viscous_Nms_rad: float = 0.0


@dataclass(frozen=True)
class AxisCompensation:
    """Compensation of one axis: tables (2, m) in Nm over the turn from the index, and timing.

    `table_Nm[0]` is for increasing angles, `table_Nm[1]` for decreasing ones; sample j lies at
    2π·j/m from the index. `look_ahead_s` is the time from the sampling of an angle to the mean time
    at which the torque computed from it acts. Angle and velocity are those of the set-point, plus
    the deviation from it and the rate of that deviation. A tracking observer with a double pole of
    time constant `observer_s` estimates both. If `observer_s` is 0, they are the encoder's reading
    and the set-point's velocity. Friction is evaluated at that velocity, for the set-point's
    direction. If friction falls with speed, this removes the negative damping that makes a rotor
    stick and slip.
    """

    table_Nm: FloatArray
    most_Nm: float = field(kw_only=True)
    """Bound of the compensation's magnitude."""
    friction: FrictionFeedforward = FrictionFeedforward()
    look_ahead_s: float = 0.0
    observer_s: float = 0.0
    blend_speed_rad_s: float = 0.02
    """Set-point speed above which only the table of that direction is used."""


@jit
def _observe(
    state: FloatArray, pole: float, period: float, deviation: float
) -> tuple[float, float]:
    """Return the deviation from the set-point and its rate by one axis' tracking observer.

    `pole` is the observer's pole in the z-plane. If it is 0.0, the results are the measured
    deviation and 0.0.
    """
    if state[_STARTED] == 0.0:
        state[_STARTED] = 1.0
        state[_DEVIATION] = deviation
        state[_DRIFT] = 0.0
    if pole <= 0.0:
        return deviation, 0.0
    state[_DEVIATION] += period * state[_DRIFT]
    innovation = deviation - state[_DEVIATION]
    state[_DEVIATION] += (1.0 - pole * pole) * innovation
    state[_DRIFT] += (1.0 - pole) * (1.0 - pole) / period * innovation
    return state[_DEVIATION], state[_DRIFT]


@jit
def _interpolated(tables: FloatArray, i: int, angle: float) -> tuple[float, float]:
    """Return the torques in an axis' table at an angle from the index, for both directions."""
    size = tables.shape[2]
    place = (angle / TWO_PI - math.floor(angle / TWO_PI)) * size
    low = int(place)
    part = place - low
    low %= size
    high = (low + 1) % size
    forward = (1.0 - part) * tables[i, 0, low] + part * tables[i, 0, high]
    return forward, (1.0 - part) * tables[i, 1, low] + part * tables[i, 1, high]


@jit
def _torque(
    tables: FloatArray,
    means: FloatArray,
    parameters: FloatArray,
    state: FloatArray,
    period: float,
    fade_step: float,
    position: FloatArray,
    index: FloatArray,
    index_known: BoolArray,
    reference: FloatArray,
    speed: FloatArray,
    out: FloatArray,
    cogging: FloatArray,
) -> None:
    for i in range(out.size):
        if parameters[i, _AVAILABLE] == 0.0 or not index_known[i]:
            state[i, _FADE] = state[i, _STARTED] = 0.0
            out[i] = cogging[i] = 0.0
            continue
        state[i, _FADE] = min(1.0, state[i, _FADE] + fade_step)
        velocity = speed[i]
        deviation, drift = _observe(
            state[i], parameters[i, _OBSERVER_POLE], period, position[i] - reference[i]
        )
        moving = velocity + drift
        angle = reference[i] + deviation + moving * parameters[i, _LOOK_AHEAD] - index[i]
        moving = max(moving, 0.0) if velocity >= 0.0 else min(moving, 0.0)
        forward, backward = _interpolated(tables, i, angle)
        side = min(max(velocity / parameters[i, _BLEND], -1.0), 1.0)
        periodic = 0.5 * (1.0 + side) * (forward - means[i, 0])
        periodic += 0.5 * (1.0 - side) * (backward - means[i, 1])
        fall = moving / parameters[i, _STRIBECK_SPEED]
        stribeck = math.exp(-fall * fall)
        forward += parameters[i, _COULOMB_FORWARD] + parameters[i, _STRIBECK_FORWARD] * stribeck
        backward -= parameters[i, _COULOMB_BACKWARD] + parameters[i, _STRIBECK_BACKWARD] * stribeck
        total = 0.5 * (1.0 + side) * forward + 0.5 * (1.0 - side) * backward
        total += parameters[i, _VISCOUS] * moving
        bound = parameters[i, _BOUND]
        # written so that nan stays nan, which the supervisor checks
        if total > bound:
            total = bound
        elif total < -bound:
            total = -bound
        out[i] = state[i, _FADE] * total
        cogging[i] = state[i, _FADE] * min(max(periodic, -bound), bound)


def _row(axis: AxisCompensation, period_s: float) -> list[float]:
    f = axis.friction
    return [
        axis.look_ahead_s,
        math.exp(-period_s / axis.observer_s) if axis.observer_s > 0.0 else 0.0,
        axis.blend_speed_rad_s,
        f.coulomb_forward_Nm,
        f.coulomb_backward_Nm,
        f.stribeck_forward_Nm,
        f.stribeck_backward_Nm,
        f.stribeck_speed_rad_s,
        f.viscous_Nms_rad,
        1.0,
        axis.most_Nm,
    ]


class Compensation:
    """Cogging and friction torque of n axes from their profiles (Tremblay, figure 1.8).

    Linear interpolation in the tables; the direction comes from the set-point's velocity, with a
    linear transition around standstill. The torque fades in over 0.2 s once the axis' index is
    known; it is zero before, and if the axis has no profile (None).
    All tables must have the same length. Raises ValueError for tables of another shape.
    """

    def __init__(self, axes: list[AxisCompensation | None], period_s: float) -> None:
        sizes = {axis.table_Nm.shape for axis in axes if axis is not None}
        if len(sizes) > 1 or any(len(s) != 2 or s[0] != 2 or s[1] < 2 for s in sizes):
            raise ValueError(f"tables must all have one shape (2, m), got {sorted(sizes)}")
        shape = sizes.pop() if sizes else (2, 2)
        n = len(axes)
        self._tables = np.zeros((n, *shape))
        self._parameters = np.zeros((n, _COLUMNS))
        for i, axis in enumerate(axes):
            if axis is not None:
                self._tables[i] = axis.table_Nm
                self._parameters[i] = _row(axis, period_s)
        self._means = self._tables.mean(axis=2)
        self._state = np.zeros((n, _STATES))
        p = self._parameters
        forward = p[:, _COULOMB_FORWARD] + p[:, _STRIBECK_FORWARD]
        backward = p[:, _COULOMB_BACKWARD] + p[:, _STRIBECK_BACKWARD]
        self.friction_Nm = np.maximum(forward, backward)
        """Dry friction that is compensated at a low speed: the larger of both directions, (n,)."""
        self.faded_in: FloatArray = self._state[:, _FADE]
        """Share of the compensation that has faded in, (n,); kept up to date."""
        self.cogging_Nm = np.zeros(n)
        """Cogging: the part of the last torque whose mean over a motor turn is 0, (n,)."""
        self.available: BoolArray = self._parameters[:, _AVAILABLE] != 0.0
        """Whether an axis has a profile, (n,); it is used once the index is known."""
        self._period_s = period_s
        self._fade_step = min(1.0, period_s / _FADE_IN_S)
        self._kernel = bound_to(self._bind)

    def reset(self) -> None:
        """Fade in again and discard the deviation from the set-point."""
        self._state[:] = 0.0

    def standing_Nm(self, position_rad: FloatArray, feedback: AxisFeedback) -> FloatArray:
        """Return the torque lost in motors at rest at these angles, (n,), mean of both directions.

        It is cogging plus half of the difference in friction. It is 0 without a profile or a known
        index.
        """
        angle = np.where(feedback.index_known, position_rad - feedback.index_rad, 0.0)
        size = self._tables.shape[2]
        place = angle / TWO_PI % 1.0 * size
        low = place.astype(int) % size
        axes = np.arange(low.size)
        mean = self._tables.mean(axis=1)
        here, there = mean[axes, low], mean[axes, (low + 1) % size]
        cogging = here + (place - np.floor(place)) * (there - here)
        p = self._parameters
        forward = p[:, _COULOMB_FORWARD] + p[:, _STRIBECK_FORWARD]
        backward = p[:, _COULOMB_BACKWARD] + p[:, _STRIBECK_BACKWARD]
        known = self.available & feedback.index_known
        most = p[:, _BOUND]
        return np.where(known, np.clip(cogging + 0.5 * (forward - backward), -most, most), 0.0)

    def torque(self, feedback: AxisFeedback, setpoint: Setpoint, out: FloatArray) -> None:
        """Write the torque to add, (n,), Nm."""
        self._kernel(feedback, setpoint, out)()

    def _bind(
        self, feedback: AxisFeedback, setpoint: Setpoint, out: FloatArray
    ) -> Callable[[], None]:
        return bound(
            _torque, self._tables, self._means, self._parameters, self._state, self._period_s,
            self._fade_step, feedback.position_rad, feedback.index_rad, feedback.index_known,
            setpoint.position_rad, setpoint.velocity_rad_s, out, self.cogging_Nm,
        )  # fmt: skip
