"""Trapezoidal set-points that are planned anew in every cycle.

Speed and acceleration keep their bounds whatever becomes of the target in between. The velocity
changes linearly within a cycle, so that the position is its integral without an error.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

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
    """Go one cycle further towards `target`, to stand still there; return whether all do.

    The trapezoidal profile of Tremblay (thesis), eq. (2.10) to (2.12), each axis by itself, with
    the stopping distance that whole cycles take: nothing overshoots, unless the target came nearer
    than that. All arrays are (n,): bounds `speed` and `acceleration` are positive, `position` and
    `velocity` are carried on in place, `slope` is the acceleration of this cycle.
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
        # the distance left after this cycle's part of the present velocity
        rest = left - 0.5 * v * period
        goal = 0.0
        if math.isfinite(rest):
            # in k cycles of full deceleration from k·step, k·(k + 1)/2 of step·period are run
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

    goal = position + w·(target - position), with the two sigmoids of Tremblay (thesis), fig. 2.3:
    w rises around the distance `threshold_m` while at rest, and around a tenth of it while moving.
    Arrays are (n,), `scale` how many metres each entry counts for; returns w, which is the next
    cycle's `weight`.
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
    """Write the positions at which a full deceleration from now on ends; all are (n,).

    rest = position + velocity·|velocity| / (2·acceleration)
    """
    for i in range(rest.size):
        rest[i] = position[i] + 0.5 * velocity[i] * abs(velocity[i]) / acceleration[i]
