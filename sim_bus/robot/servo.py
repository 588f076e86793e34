"""Inner loops of a drive: observer, profile generators, position, velocity and torque loop.

Compiled; run at every control step. Positions are encoder counts from power-up.
"""

from __future__ import annotations

import math
from typing import Any

from cdpr_profiles.jit import jit

OFF = 0
"""Power stage off: the motor coasts."""
TORQUE = 1
"""Target in torque units, approached along the torque slope."""
VELOCITY = 2
"""Target in counts/s, approached with the acceleration or the deceleration."""
PROFILE_POSITION = 3
"""Target in counts, reached along a trapezoidal velocity profile."""
FOLLOW_POSITION = 4
"""Target in counts, reached along a straight line at the end of the interpolation time."""

LIMITED = 1 << 2
STANDSTILL = 1 << 3
ON_TARGET = 1 << 4
FOLLOWING_ERROR = 1 << 5
OVERSPEED = 1 << 6
OVERCURRENT = 1 << 7
I2T_TRIP = 1 << 8
I2T_WARNING = 1 << 9
REFERENCE_DONE = 1 << 10
SWITCH_NEGATIVE = 1 << 11
SWITCH_POSITIVE = 1 << 12
SWITCH_HOME = 1 << 13


@jit
def observe(m: Any, counter: int, h: float) -> None:
    """Update the tracking observer (both poles at `observer_rate`) with a counter reading."""
    error = counter - m.observed_position
    rate = m.observer_rate
    m.observed_position += h * (m.observed_velocity + 2.0 * rate * error)
    m.observed_velocity += h * rate * rate * error
    share = 1.0 - math.exp(-m.display_rate * h)
    m.displayed_velocity += share * (m.observed_velocity - m.displayed_velocity)


@jit
def engage(m: Any, kind: int) -> None:
    """Start another control mode from the present motion, without a step in torque."""
    if m.kind == OFF:
        m.torque_demand = 0.0
    m.reference_position = m.observed_position
    m.reference_velocity = m.observed_velocity
    if abs(m.displayed_velocity) < m.standstill_velocity:
        m.reference_velocity = 0.0
    m.reference_acceleration = 0.0
    m.integral = m.torque_demand / m.velocity_gain
    m.in_target_since = math.inf
    m.following_since = math.inf
    m.kind = kind


@jit
def _approach(value: float, goal: float, step: float) -> float:
    return min(goal, value + step) if goal > value else max(goal, value - step)


@jit
def ramp_velocity(m: Any, goal: float, h: float) -> None:
    """Move the reference velocity toward `goal`, braking when its magnitude falls.

    On the way to rest, the reference is never faster than the motor. Otherwise a wrong speed,
    measured at the start of the ramp, would accelerate the motor.
    """
    v = m.reference_velocity
    if goal == 0.0:
        excess = m.standstill_velocity
        v = max(
            min(v, max(m.observed_velocity + excess, 0.0)), min(m.observed_velocity - excess, 0.0)
        )
    braking = v * (goal - v) < 0.0
    step = (m.deceleration if braking else m.acceleration) * h
    if braking and v * goal < 0.0:
        goal = 0.0  # a reversal passes through zero speed, where the acceleration may change
    new = _approach(v, goal, step)
    m.reference_acceleration = 0.0 if math.isinf(step) else (new - v) / h
    m.reference_velocity = new
    m.reference_position += h * new


@jit
def profile_position(m: Any, target: float, h: float) -> None:
    """Advance the trapezoidal profile at the highest speed from which it can stop at the target."""
    distance = target - m.reference_position
    d = m.deceleration
    half = 0.5 * d * h
    brakable = math.sqrt(half * half + 2.0 * d * abs(distance)) - half
    goal = math.copysign(min(m.profile_velocity, brakable), distance)
    ramp_velocity(m, goal, h)
    remaining = abs(target - m.reference_position)
    if abs(m.reference_velocity) <= 2.0 * d * h and remaining <= 2.0 * d * h * h:
        m.reference_position = target
        m.reference_velocity = 0.0
        m.reference_acceleration = 0.0


@jit
def follow_position(m: Any, target: float, h: float) -> None:
    """Move the reference on a straight line that reaches the target in time."""
    if m.interpolation_left > h * 1.000001:
        m.reference_velocity = (target - m.reference_position) / m.interpolation_left
        m.reference_position += h * m.reference_velocity
        m.interpolation_left -= h
    elif m.interpolation_left > 0.0:
        m.reference_position = target
        m.interpolation_left = 0.0
    else:
        m.reference_position = target
        m.reference_velocity = 0.0


@jit
def motion_torque(m: Any, kind: int, h: float) -> float:
    """Return the unlimited torque demand of the position and velocity loops, Nm."""
    rad = 1.0 / m.counts_per_rad
    velocity = m.reference_velocity
    if kind != VELOCITY:
        lag = m.reference_position - m.observed_position
        velocity += m.position_gain * lag
        # Within one count of rest, stiction would make the integrator hunt.
        frozen = abs(lag) <= 1.0 and m.reference_velocity == 0.0
    else:
        frozen = False
    error = (velocity - m.observed_velocity) * rad
    if not frozen:
        m.integral += h * m.integral_rate * error
    ahead = m.inertia * m.reference_acceleration * rad
    return float(m.velocity_gain * (error + m.integral) + ahead + m.torque_offset)


@jit
def torque_mode_torque(m: Any, target: float, h: float) -> float:
    """Return the torque demand along the slope, reduced at the speed limit, Nm."""
    goal = target * m.torque_unit
    m.torque_demand = _approach(m.torque_demand, goal, m.torque_slope * h)
    gain = m.velocity_gain / m.counts_per_rad
    upper = gain * (m.speed_limit - m.observed_velocity)
    lower = -gain * (m.speed_limit + m.observed_velocity)
    return float(max(lower, min(upper, m.torque_demand)))


@jit
def control(m: Any, kind: int, target: float, h: float) -> int:
    """Run one control step; leaves `torque_demand` (Nm), returns the LIMITED flag or 0."""
    if kind != m.kind:
        engage(m, kind)
    if kind == OFF:
        m.torque_demand = 0.0
        return 0
    if kind == TORQUE:
        unlimited = torque_mode_torque(m, target, h)
        free = m.torque_demand
    else:
        if kind == VELOCITY:
            ramp_velocity(m, target, h)
        elif kind == PROFILE_POSITION:
            profile_position(m, target, h)
        else:
            follow_position(m, target, h)
        unlimited = motion_torque(m, kind, h)
        free = unlimited
    demand = max(-m.limit_negative, min(m.limit_positive, unlimited))
    m.torque_demand = demand
    if demand == free:
        return 0
    if kind != TORQUE:
        # Anti-windup: remove the amount that the integrator added beyond the limit.
        m.integral += (demand - unlimited) / m.velocity_gain * min(1.0, h * m.integral_rate * 4.0)
    return LIMITED


@jit
def _lasting(now: float, since: float, holds: bool) -> float:
    return min(since, now) if holds else math.inf


@jit
def watch(m: Any, kind: int, target: float, h: float) -> int:
    """Update windows, load model and thresholds after `h` seconds; return the resulting flags."""
    flags = 0
    now = m.time
    m.standing_since = _lasting(
        now, m.standing_since, abs(m.displayed_velocity) <= m.standstill_velocity
    )
    if now - m.standing_since >= m.standstill_time:
        flags |= STANDSTILL
    load = m.sensed / m.rated_current
    m.i2t += h * m.i2t_rate * (load * load - m.i2t)
    if m.i2t > 0.9:
        flags |= I2T_WARNING
    if m.i2t > 1.05:
        flags |= I2T_TRIP
    if abs(m.current) > m.overcurrent:
        flags |= OVERCURRENT
    if abs(m.observed_velocity) > m.overspeed:
        flags |= OVERSPEED
    if kind == TORQUE:
        done = near = m.torque_demand == target * m.torque_unit
    elif kind == VELOCITY:
        done = m.reference_velocity == target
        near = done and abs(m.displayed_velocity - target) <= m.target_window
    else:
        done = m.reference_position == target
        near = done and abs(m.observed_position - target) <= m.target_window
    m.in_target_since = _lasting(now, m.in_target_since, near)
    if done:
        flags |= REFERENCE_DONE
    if near and (kind == TORQUE or now - m.in_target_since >= m.target_window_time):
        flags |= ON_TARGET
    if kind >= PROFILE_POSITION:
        lag = abs(m.reference_position - m.observed_position)
        m.following_since = _lasting(now, m.following_since, lag > m.following_window)
        if now - m.following_since >= m.following_time:
            flags |= FOLLOWING_ERROR
    return flags


@jit
def switches(m: Any) -> int:
    """Return the flags of the limit and home switches at the rotor's angle."""
    flags = 0
    if m.angle < m.switch_negative:
        flags |= SWITCH_NEGATIVE
    if m.angle > m.switch_positive:
        flags |= SWITCH_POSITIVE
    if m.home_from <= m.angle <= m.home_to:
        flags |= SWITCH_HOME
    return flags
