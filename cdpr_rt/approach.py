"""Set-points that are planned anew in every cycle, from where they are and how fast they move.

Speed and acceleration keep their bounds whatever becomes of the target in between. The velocity
changes linearly within a cycle, so that the position is its integral without an error.
"""

from __future__ import annotations

import math

from cdpr_rt.exchange import FloatArray
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
        # what is left when this cycle's share of the present velocity has been run
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
def change_pace(
    wanted: FloatArray,
    acceleration: FloatArray,
    period: float,
    position: FloatArray,
    velocity: FloatArray,
    slope: FloatArray,
) -> bool:
    """Go one cycle further while the velocity turns to `wanted`; return whether all stand still.

    All arrays are (n,), as for `approach`.
    """
    at_rest = True
    for i in range(wanted.size):
        v = velocity[i]
        step = acceleration[i] * period
        new = min(max(wanted[i], v - step), v + step)
        position[i] += 0.5 * (v + new) * period
        velocity[i] = new
        slope[i] = (new - v) / period
        at_rest = at_rest and new == 0.0 and v == 0.0
    return at_rest


@jit
def attend(
    target: FloatArray, position: FloatArray, awake: float, asleep_m: float, goal: FloatArray
) -> float:
    """Write a goal that is the target, or nearer the less the distance to it deserves a motion.

    The two sigmoids of Tremblay (thesis), fig. 2.3: the remaining distance counts by a share that
    rises around `asleep_m`, and around a tenth of it once awake, so that what trembles around a
    point does not move it. Arrays are (n,); returns the share, to be given back as `awake`.
    """
    size = 0.0
    for i in range(target.size):
        size += (target[i] - position[i]) ** 2
    size = math.sqrt(size)
    threshold = asleep_m * (1.0 - 0.9 * awake)
    share = 1.0 / (1.0 + math.exp(max(-_STEEPNESS * (size / threshold - 1.0), -_MOST_STEEP)))
    for i in range(target.size):
        goal[i] = position[i] + share * (target[i] - position[i])
    return share


@jit
def place_to_rest(
    position: FloatArray, velocity: FloatArray, acceleration: FloatArray, rest: FloatArray
) -> None:
    """Write where what moves comes to rest when it is braked from now on; all are (n,)."""
    for i in range(rest.size):
        rest[i] = position[i] + 0.5 * velocity[i] * abs(velocity[i]) / acceleration[i]
