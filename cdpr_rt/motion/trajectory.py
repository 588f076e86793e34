"""Set-points over time: a move with a trapezoidal velocity profile."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.jit import bound, bound_to, jit


@jit
def _fill(
    start: FloatArray,
    velocity: FloatArray,
    ramp_s: float,
    cruise_s: float,
    position: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    t: float,
) -> None:
    end = cruise_s + 2.0 * ramp_s
    # `travelled` and `shape` are in units of the cruising velocity, so one profile serves all axes
    if t <= 0.0:
        travelled, shape, slope = 0.0, 0.0, 0.0
    elif t < ramp_s:
        travelled, shape, slope = 0.5 * t * t / ramp_s, t / ramp_s, 1.0 / ramp_s
    elif t <= ramp_s + cruise_s:
        travelled, shape, slope = t - 0.5 * ramp_s, 1.0, 0.0
    elif t < end:
        left = end - t
        travelled = cruise_s + ramp_s - 0.5 * left * left / ramp_s
        shape, slope = left / ramp_s, -1.0 / ramp_s
    else:
        travelled, shape, slope = cruise_s + ramp_s, 0.0, 0.0
    for i in range(start.size):
        position[i] = start[i] + velocity[i] * travelled
        speed[i] = velocity[i] * shape
        acceleration[i] = velocity[i] * slope


class Motion(Protocol):
    """A set-point over time, such as a `TrapezoidalMove`."""

    duration_s: float

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s` after the start."""

    def brake(self, time_s: float) -> Motion:
        """Return a motion whose second half brakes from the state at `time_s`; callers skip the
        first half.
        """


class TrapezoidalMove:
    """A move of n axes at constant velocity, with a linear velocity ramp before and after.

    Parameters: `start_rad` (n,) and `velocity_rad_s` (n,), signed; `cruise_s` seconds at full
    velocity; `ramp_s` seconds for each ramp, positive; `settle_s` seconds of rest at the end.
    """

    def __init__(
        self,
        start_rad: FloatArray,
        velocity_rad_s: FloatArray,
        cruise_s: float,
        ramp_s: float,
        settle_s: float = 0.0,
    ) -> None:
        if ramp_s <= 0.0 or cruise_s < 0.0:
            raise ValueError(f"ramp_s {ramp_s} must be positive, cruise_s {cruise_s} not negative")
        self.start_rad = np.array(start_rad, float)
        self.velocity_rad_s = np.array(velocity_rad_s, float)
        self.cruise_s = float(cruise_s)
        self.ramp_s = float(ramp_s)
        self.duration_s = self.cruise_s + 2.0 * self.ramp_s + settle_s
        self._kernel = bound_to(self._bind)

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s` after the move's start."""
        self._kernel(setpoint)(time_s)

    def _bind(self, setpoint: Setpoint) -> Callable[[float], None]:
        own = self.start_rad, self.velocity_rad_s, self.ramp_s, self.cruise_s
        return bound(_fill, *own, *setpoint.arrays, then=(0.0,))

    def end_rad(self) -> FloatArray:
        """Return the final position, (n,)."""
        return self.start_rad + self.velocity_rad_s * (self.cruise_s + self.ramp_s)

    def brake(self, time_s: float) -> TrapezoidalMove:
        """Return a move whose second ramp, from `ramp_s` on, stops the motion at `time_s`."""
        now = Setpoint(self.start_rad.size)
        self.fill(time_s, now)
        start = now.position_rad - 0.5 * self.ramp_s * now.velocity_rad_s
        return TrapezoidalMove(start, now.velocity_rad_s, 0.0, self.ramp_s)


class Hold(TrapezoidalMove):
    """Standing still at `position_rad` (n,) for `duration_s`."""

    def __init__(self, position_rad: FloatArray, duration_s: float) -> None:
        half = 0.5 * duration_s
        super().__init__(position_rad, np.zeros_like(np.asarray(position_rad, float)), 0.0, half)


# Trapezoidal set-points that are planned again in every cycle. Speed and acceleration keep their
# bounds even if the target changes at any time. The velocity changes linearly within a
# cycle, so that the position is its exact integral.

_EXACT = 1e-11
_STEEPNESS, _MOST_STEEP = 8.0, 50.0


@jit
def approach(
    target: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    period: float,
    position: FloatArray,
    velocity: FloatArray,
    slope: FloatArray,
) -> bool:
    """Advance one cycle towards `target`; return whether all axes have stopped there.

    Each axis follows the trapezoidal profile of Tremblay (thesis), eq. (2.10) to (2.12), with the
    stopping distance of whole cycles. No axis overshoots, unless the target moves nearer than the
    stopping distance. All arrays are (n,): bounds `speed` and `acceleration` are positive,
    `position` and `velocity` are updated in place, `slope` is the acceleration of this cycle.
    """
    arrived = True
    for i in range(target.size):
        v = velocity[i]
        step = acceleration[i] * period
        left = target[i] - position[i]
        close = _EXACT * (1.0 + abs(target[i]))
        if abs(left) < close and abs(v) * period < close:
            position[i] = target[i]
            velocity[i] = 0.0
            slope[i] = 0.0
            continue
        arrived = False
        # the distance that remains after this cycle's share of the present velocity
        rest = left - 0.5 * v * period
        goal = 0.0
        if math.isfinite(rest):
            # k cycles of full deceleration from k·step cover k·(k + 1)/2 times step·period
            share = abs(rest) / (step * period)
            k = max(1.0, math.ceil(0.5 * (math.sqrt(1.0 + 8.0 * share) - 1.0)))
            goal = min(abs(rest) / (k * period) + 0.5 * step * (k - 1.0), speed[i])
            if rest < 0.0:
                goal = -goal
        new = min(max(goal, v - step), v + step)
        position[i] += 0.5 * (v + new) * period
        velocity[i] = new
        slope[i] = (new - v) / period
    return arrived


@jit
def ramp_velocity(
    target_velocity: FloatArray,
    acceleration: FloatArray,
    period: float,
    position: FloatArray,
    velocity: FloatArray,
    slope: FloatArray,
) -> bool:
    """Ramp the velocity to `target_velocity` for one cycle; return whether all stand still.

    All arrays are (n,), as for `approach`.
    """
    at_rest = True
    for i in range(target_velocity.size):
        v = velocity[i]
        step = acceleration[i] * period
        new = min(max(target_velocity[i], v - step), v + step)
        position[i] += 0.5 * (v + new) * period
        velocity[i] = new
        slope[i] = (new - v) / period
        at_rest = at_rest and new == 0.0 and v == 0.0
    return at_rest


@jit
def soft_deadband(
    target: FloatArray,
    position: FloatArray,
    scale: FloatArray,
    weight: float,
    threshold_m: float,
    goal: FloatArray,
) -> float:
    """Write a goal between position and target: a dead band with soft edges and hysteresis.

    goal = position + w·(target - position), with the two sigmoids of Tremblay (thesis), fig. 2.3: w
    rises around the distance `threshold_m` while at rest, and around a tenth of it while moving.
    Arrays are (n,); `scale` is the length in m for a unit of each entry. Returns w, the `weight`
    for the next cycle.
    """
    size = 0.0
    for i in range(target.size):
        size += (scale[i] * (target[i] - position[i])) ** 2
    size = math.sqrt(size)
    threshold = threshold_m * (1.0 - 0.9 * weight)
    weight = 1.0 / (1.0 + math.exp(max(-_STEEPNESS * (size / threshold - 1.0), -_MOST_STEEP)))
    for i in range(target.size):
        goal[i] = position[i] + weight * (target[i] - position[i])
    return weight


@jit
def stopping_position(
    position: FloatArray, velocity: FloatArray, acceleration: FloatArray, rest: FloatArray
) -> None:
    """Write the positions at which full deceleration from now on ends; all are (n,).

    rest = position + velocity·|velocity| / (2·acceleration)
    """
    for i in range(rest.size):
        rest[i] = position[i] + 0.5 * velocity[i] * abs(velocity[i]) / acceleration[i]
