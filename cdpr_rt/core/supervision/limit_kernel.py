"""The check of every limit in a cycle, as a kernel over the axes."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.jit import jit

# kernels take plain numbers
_TORQUE, _TORQUE_RATE = int(Limit.TORQUE), int(Limit.TORQUE_RATE)
_SPEED, _FOLLOWING_ERROR = int(Limit.SPEED), int(Limit.FOLLOWING_ERROR)
_CABLE_LENGTH, _TENSION_SENSOR = int(Limit.CABLE_LENGTH), int(Limit.TENSION_SENSOR)
_TENSION_LOW, _TENSION_HIGH = int(Limit.TENSION_LOW), int(Limit.TENSION_HIGH)
_SLACK, _BROKEN_CABLE = int(Limit.SLACK), int(Limit.BROKEN_CABLE)
_STALE, _LATE, _NOT_FINITE = int(Limit.STALE), int(Limit.LATE), int(Limit.NOT_FINITE)
_MISSED, _MISSED_IN_WINDOW = int(Limit.MISSED), int(Limit.MISSED_IN_WINDOW)
_ENCODER_JUMP = int(Limit.ENCODER_JUMP)

FIGURES: Final = tuple(name for name in Limits.__dataclass_fields__ if name != "reactions")
"""The attributes of `Limits` that are numbers."""
AXIS_LIMITS: Final = np.dtype([(name, "<f8") for name in (*FIGURES, "period_s")])
AXIS_HISTORY: Final = np.dtype(
    [
        ("torque", "<f8"),  # as passed on in the last cycle
        ("missed", "<f8"),  # consecutive
        ("in_window", "<f8"),
        ("window_index", "<i8"),  # where in the window the last cycle is
        ("stale", "<f8"),
        ("low_s", "<f8"),  # since the tension was last sufficient
        ("slack_s", "<f8"),
        ("tight_rad", "<f8"),  # motor angle when it was
        ("low_armed", "<f8"),  # whether it was since enabling, or since this was noted last
        ("slack_armed", "<f8"),
        ("mean_N", "<f8"),  # its tension, low-passed while it does not run in
        ("valid_count", "<f8"),  # valid angles since enabling, up to 2
        ("valid_rad", "<f8"),  # the last valid angle
        ("velocity_rad_s", "<f8"),  # then
        ("invalid_s", "<f8"),  # since the last valid angle
    ]
)
VERDICT: Final = np.dtype(
    [("reaction", "<i8"), ("limit", "<i8"), ("axis", "<i8"), ("value", "<f8"), ("allowed", "<f8")]
)


class Signals(NamedTuple):
    """Signals of one cycle that limits are checked against, as in the objects they are of, (n,)."""

    position: FloatArray
    """`AxisFeedback`, to `rate_ok`."""
    valid: BoolArray
    alive: BoolArray
    rate_ok: BoolArray
    setpoint: FloatArray
    """`Setpoint`."""
    setpoint_velocity: FloatArray
    velocity: FloatArray
    """`AxisEstimate`, to `sensor_ok`."""
    cable_m_per_rad: FloatArray
    length: FloatArray
    tension: FloatArray
    sensor_ok: BoolArray


_JUMP_rad: Final = 0.05
"""Distance of an angle from its extrapolation allowed beyond that of the speed limit."""
_SNAPPED_SHARE, _MEAN_S = 0.6, 0.1
"""A cable that runs in has snapped below this share of its tension's mean over such a time."""
_PAID_OUT_m: Final = 5e-4
"""A cable is not broken where this much was paid out while its tension fell."""


@jit
def _exceeded(worst: Any, limit: int, axis: int, value: float, allowed: float) -> None:
    """Keep the most severe of what was exceeded in this cycle, the first of equals."""
    verdict, reactions = worst
    if reactions[limit] > verdict["reaction"]:
        verdict["reaction"], verdict["limit"] = reactions[limit], limit
        verdict["axis"], verdict["value"], verdict["allowed"] = axis, value, allowed


@jit
def _bound_torque(
    i: int, limits: Any, history: Any, worst: Any, period: float, torque: FloatArray
) -> None:
    asked = torque[i]
    if not np.isfinite(asked):
        _exceeded(worst, _NOT_FINITE, i, asked, 0.0)
        asked = 0.0
    bound, rate = limits["torque_Nm"], limits["torque_rate_Nm_s"]
    if abs(asked) > bound:
        _exceeded(worst, _TORQUE, i, asked, bound)
        asked = min(max(asked, -bound), bound)
    step = asked - history["torque"]
    if abs(step) > rate * period:
        _exceeded(worst, _TORQUE_RATE, i, step / period, rate)
        asked = history["torque"] + min(max(step, -rate * period), rate * period)
    history["torque"] = torque[i] = asked


@jit
def _watch_answers(
    i: int, limits: Any, history: Any, worst: Any, valid: bool, regular: bool, window: Any
) -> None:
    missed = 0 if valid else 1
    # where this cycle's flag goes, that of one window ago still is
    history["window_index"] = index = (history["window_index"] + 1) % window.shape[0]
    history["missed"] = 0.0 if valid else history["missed"] + 1.0
    history["in_window"] += missed - window[index, i]
    window[index, i] = missed
    history["stale"] = 0.0 if regular else history["stale"] + 1.0
    if history["missed"] > limits["missed_cycles"]:
        _exceeded(worst, _MISSED, i, history["missed"], limits["missed_cycles"])
    if history["in_window"] > limits["missed_in_window"]:
        _exceeded(worst, _MISSED_IN_WINDOW, i, history["in_window"], limits["missed_in_window"])
    if history["stale"] > limits["stale_cycles"]:
        _exceeded(worst, _STALE, i, history["stale"], limits["stale_cycles"])


@jit
def _watch_jumps(
    i: int, limits: Any, history: Any, worst: Any, elapsed: float, position: float
) -> None:
    history["invalid_s"] += elapsed
    step = position - history["valid_rad"]
    jump = step - history["velocity_rad_s"] * history["invalid_s"]
    possible = limits["speed_rad_s"] * history["invalid_s"] + _JUMP_rad
    if history["valid_count"] == 2.0 and abs(jump) > possible:
        _exceeded(worst, _ENCODER_JUMP, i, jump, possible)
    history["velocity_rad_s"] = step / history["invalid_s"] if history["valid_count"] else 0.0
    history["valid_count"] = min(history["valid_count"] + 1.0, 2.0)
    history["valid_rad"], history["invalid_s"] = position, 0.0


@jit
def _watch_motion(
    i: int, limits: Any, worst: Any, error: float, velocity: float, length: float, paying_out: float
) -> None:
    # a value that is not a number is not within its limit either
    if not abs(velocity) <= limits["speed_rad_s"]:
        _exceeded(worst, _SPEED, i, velocity, limits["speed_rad_s"])
    if not abs(error) <= limits["following_error_rad"]:
        _exceeded(worst, _FOLLOWING_ERROR, i, error, limits["following_error_rad"])
    # beyond a length only the way back is open
    if length > limits["cable_length_max_m"] and paying_out > 0.0:
        _exceeded(worst, _CABLE_LENGTH, i, length, limits["cable_length_max_m"])
    if length < limits["cable_length_min_m"] and paying_out < 0.0:
        _exceeded(worst, _CABLE_LENGTH, i, length, limits["cable_length_min_m"])


@jit
def _has_snapped(
    limits: Any, history: Any, elapsed: float, tension: float, runaway_m_s: float, too_fast: bool
) -> bool:
    """Whether a cable that was tight has lost its tension, and its winch runs away by that.

    The winch's friction may be more than `slack_N`, and is what is left of a tension by torque.
    """
    before = history["mean_N"]
    # what it was before: friction alone, for as long as a weak winch takes, is no tension
    if np.isfinite(tension) and not runaway_m_s > 0.25 * limits["runaway_m_s"]:
        history["mean_N"] += elapsed / (elapsed + _MEAN_S) * (tension - before)
    runs_away = history["slack_armed"] != 0.0 and (too_fast or runaway_m_s > limits["runaway_m_s"])
    return bool(runs_away and tension < _SNAPPED_SHARE * before)


@jit
def _watch_tension(
    i: int,
    limits: Any,
    history: Any,
    worst: Any,
    elapsed: float,
    tension: float,
    slack_allowed: bool,
    position: float,
    cable_m_per_rad: float,
) -> None:
    if tension > limits["tension_max_N"]:
        _exceeded(worst, _TENSION_HIGH, i, tension, limits["tension_max_N"])
    if slack_allowed:
        history["low_armed"] = history["slack_armed"] = 0.0
        return
    if not tension < limits["tension_min_N"]:
        history["low_s"] = history["slack_s"] = 0.0
        history["tight_rad"] = position
        if tension >= limits["tension_min_N"]:
            history["low_armed"] = history["slack_armed"] = 1.0
        return
    history["low_s"] += elapsed
    history["slack_s"] = history["slack_s"] + elapsed if tension < limits["slack_N"] else 0.0
    paid_out = (position - history["tight_rad"]) * cable_m_per_rad
    at_once = history["low_s"] <= limits["broken_within_s"] and paid_out < _PAID_OUT_m
    # each is noted once, so that the cable can be tightened, and again when it was tight
    if history["slack_armed"] and history["slack_s"] > 0.0 and at_once:
        history["low_armed"] = history["slack_armed"] = 0.0
        _exceeded(worst, _BROKEN_CABLE, i, tension, limits["tension_min_N"])
    elif history["slack_armed"] and history["slack_s"] > limits["slack_s"]:
        history["low_armed"] = history["slack_armed"] = 0.0
        _exceeded(worst, _SLACK, i, tension, limits["slack_N"])
    elif history["low_armed"] and history["low_s"] > limits["slack_s"]:
        history["low_armed"] = 0.0
        _exceeded(worst, _TENSION_LOW, i, tension, limits["tension_min_N"])


@jit
def check_axes(
    all_limits: Any,
    histories: Any,
    window: Any,
    reactions: Any,
    verdict: Any,
    signals: Signals,
    torque: FloatArray,
    elapsed: float,
    slack_allowed: bool,
) -> int:
    """Check one cycle of n axes and clamp `torque` (n,) in place; return the reaction.

    `all_limits`, `histories` (n,) and `verdict` (1,) are records of `AXIS_LIMITS`, `AXIS_HISTORY`
    and `VERDICT`; `window` (m, n) says which answers of the last m cycles were missed, `reactions`
    what is done about each `Limit`; `elapsed` is from the last SYNC to this one, s.
    """
    verdict[0]["reaction"] = verdict[0]["limit"] = 0
    worst = verdict[0], reactions
    period = all_limits[0]["period_s"]
    if elapsed - period > all_limits[0]["late_s"]:
        _exceeded(worst, _LATE, -1, elapsed - period, all_limits[0]["late_s"])
    for i in range(torque.size):
        limits, history = all_limits[i], histories[i]
        _bound_torque(i, limits, history, worst, period, torque)
        regular = signals.alive[i] and signals.rate_ok[i]
        _watch_answers(i, limits, history, worst, signals.valid[i], regular, window)
        if not signals.valid[i]:
            history["invalid_s"] += elapsed
            continue
        position, velocity = signals.position[i], signals.velocity[i]
        tension, cable_m_per_rad = signals.tension[i], signals.cable_m_per_rad[i]
        _watch_jumps(i, limits, history, worst, elapsed, position)
        paying_out = signals.setpoint_velocity[i] * cable_m_per_rad
        mean_N, runaway_m_s = history["mean_N"], paying_out - velocity * cable_m_per_rad
        too_fast = -velocity * np.sign(cable_m_per_rad) > limits["speed_rad_s"]
        if _has_snapped(limits, history, elapsed, tension, runaway_m_s, too_fast):
            _exceeded(worst, _BROKEN_CABLE, i, tension, mean_N)
        error = signals.setpoint[i] - position
        _watch_motion(i, limits, worst, error, velocity, signals.length[i], paying_out)
        if not signals.sensor_ok[i]:
            # what takes its place is an estimate, whose step would look like a broken cable
            _exceeded(worst, _TENSION_SENSOR, i, np.nan, np.nan)
            continue
        _watch_tension(
            i, limits, history, worst, elapsed, tension, slack_allowed, position, cable_m_per_rad
        )
    return int(verdict[0]["reaction"])
