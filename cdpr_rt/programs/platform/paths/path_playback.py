"""Kernels of one cycle: a planned path played at any rate, forward and back, without leaving it."""

from __future__ import annotations

import math
from typing import Final

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.motion.path.quintic import quintic

TIME, RATE = 0, 1
"""Places in the state: time along the plan, s, and how fast it passes."""
_QUICKEST_1_S: Final = 1e3
_LEAST_SHARE: Final = 0.25
_SETTLE_S: Final = 0.5
_THERE_S: Final = 1e-3
_STEP_m: Final = 1e-4
_MORE: Final = 1.002
_NOTHING: Final = 1e-12


@jit
def _between(
    samples: FloatArray, period: float, i: int, k: int, u: float
) -> tuple[float, float, float, float]:
    """Return a coordinate and its derivatives at a share u between two samples."""
    return quintic(
        samples[i, 0, k], samples[i, 1, k], samples[i, 2, k],
        samples[i + 1, 0, k], samples[i + 1, 1, k], samples[i + 1, 2, k], period, u,
    )  # fmt: skip


@jit
def _place(samples: FloatArray, period: float, time: float, out: FloatArray) -> None:
    """Write position and two derivatives (3, d) at a time of the plan."""
    i = min(max(int(time / period), 0), samples.shape[0] - 2)
    u = min(max(time / period - i, 0.0), 1.0)
    for k in range(samples.shape[2]):
        out[0, k], out[1, k], out[2, k], _ = _between(samples, period, i, k, u)


@jit
def play(
    samples: FloatArray,
    period: float,
    cycle: float,
    goal: float,
    wanted: float,
    acceleration: FloatArray,
    state: FloatArray,
    scratch: FloatArray,
    setpoint: FloatArray,
) -> bool:
    """Go one cycle further along the plan towards the time `goal`; return whether it rests there.

    `wanted` is the rate, at least 0; at 0 it comes to rest wherever it is. The rate changes as fast
    as `acceleration` (d,) allows beside what the path itself takes, or a quarter of that where it
    takes all. Forward goals are rests of the plan. `setpoint` (3, d) is written.
    """
    time, rate = state[TIME], state[RATE]
    _place(samples, period, time, scratch)
    left = goal - time
    aim = wanted
    if left < 0.0:
        aim = -min(wanted, max(-left, _THERE_S) / _SETTLE_S)
    low, high, least = -_QUICKEST_1_S, _QUICKEST_1_S, _QUICKEST_1_S
    for k in range(acceleration.size):
        v, a = scratch[1, k], scratch[2, k] * rate * rate
        if abs(v) > _NOTHING:
            least = min(least, _LEAST_SHARE * acceleration[k] / abs(v))
            one, other = (-acceleration[k] - a) / v, (acceleration[k] - a) / v
            low, high = max(low, min(one, other)), min(high, max(one, other))
    low, high = min(low, -least), max(high, least)
    slope = min(max((aim - rate) / cycle, low), high)
    new = rate + slope * cycle
    time += 0.5 * (rate + new) * cycle
    if left >= 0.0 and time >= goal:
        time, new = goal, 0.0
    elif left < 0.0 and time <= goal + _THERE_S:
        time, new = max(time, goal), 0.0
    time = min(max(time, 0.0), period * (samples.shape[0] - 1))
    state[TIME], state[RATE] = time, new
    _place(samples, period, time, scratch)
    for k in range(acceleration.size):
        setpoint[0, k] = scratch[0, k]
        setpoint[1, k] = scratch[1, k] * new
        setpoint[2, k] = scratch[2, k] * new * new + scratch[1, k] * slope
    if new == 0.0:
        for k in range(acceleration.size):
            setpoint[1, k] = setpoint[2, k] = 0.0
    return bool(new == 0.0 and (wanted == 0.0 or abs(goal - time) <= _THERE_S))


@jit
def _keeps_between(
    samples: FloatArray,
    period: float,
    i: int,
    k: int,
    speed: float,
    acceleration: float,
    jerk: float,
) -> bool:
    """Return whether a coordinate keeps speed and acceleration at places between two samples."""
    more = min(0.5 * period * jerk, acceleration)
    for j in range(1, 4):
        _, v, a, _ = _between(samples, period, i, k, 0.25 * j)
        if not abs(a) <= _MORE * acceleration + more:
            return False
        if not abs(v) <= _MORE * speed + 0.25 * period * acceleration:
            return False
    return True


@jit
def first_fault(
    samples: FloatArray,
    begin: int,
    end: int,
    period: float,
    speed: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
    low: FloatArray,
    high: FloatArray,
    angle: float,
) -> int:
    """Return the first sample from `begin` to `end` that is out of limits, or jumps; -1 for none.

    `low` and `high` (k,) bound the positions, `angle` the length of what follows. Between samples
    the acceleration may be larger by what the jerk changes it in half a period, up to double.
    """
    last = samples.shape[0] - 1
    for i in range(begin, min(end, last + 1)):
        turned = 0.0
        for k in range(samples.shape[2]):
            q, v, a = samples[i, 0, k], samples[i, 1, k], samples[i, 2, k]
            # what is not a number fails all of these
            if not (abs(v) <= _MORE * speed[k] and abs(a) <= _MORE * acceleration[k]):
                return i
            if k < low.size:
                if not (low[k] - _STEP_m <= q <= high[k] + _STEP_m):
                    return i
            else:
                turned += q * q
            if (i in (0, last)) and not (v == 0.0 and a == 0.0):
                return i
            if i < last:
                step = samples[i + 1, 0, k] - q - 0.5 * period * (v + samples[i + 1, 1, k])
                step += period * period * (samples[i + 1, 2, k] - a) / 12.0
                keeps = _keeps_between(samples, period, i, k, speed[k], acceleration[k], jerk[k])
                if not (abs(step) <= _STEP_m and keeps):
                    return i
        if not math.sqrt(turned) <= angle + _STEP_m:
            return i
    return -1
