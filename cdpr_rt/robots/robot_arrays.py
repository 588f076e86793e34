"""A robot's file as the arrays of those of its axes that are run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.devices.tension_sensor import load_tension_sensors
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import WinchArrays
from cdpr_rt.core.supervision.limits import DEFAULT_REACTIONS, Limits, reactions_of
from cdpr_rt.robots.length_disagreement import allowed_disagreement_m

RATED_SPEED_SHARE: Final = 0.2
"""Default speed limit over the motors' rated speed."""
TORQUE_RISE_S: Final = 0.005
"""Default time in which the whole torque may be built up."""
CABLE_SAFETY: Final = 5.0
"""Default safety factor: breaking force over the highest tension."""
SLACK_SHARE: Final = 0.25
"""Default tension of a slack cable over the least tension allowed."""
FOLLOWING_m: Final = 0.15
"""Default following error of a platform's cables: three times the lag at which its set-point waits
for it."""
RUNAWAY_m_s: Final = 0.75
"""Speed beyond the set-point's at which a cable has broken, where no other's length tells: a
platform that is held would have to be thrown, a rotor alone reaches it within 10 to 50 ms."""
LOW_SHARE: Final = 0.5
"""Supervised over planned least tension, where tensions are estimated from torques."""


def can_lower(robot: Robot) -> bool:
    """Return whether there is a program that lets the robot's platform down."""
    return robot.platform is not None


def limits_of(robot: Robot, *, calibration_in_doubt: bool = False) -> Limits:
    """Return the limits of a robot's axes, those without a figure in its file filled in.

    Lengths agree better once the geometry has been calibrated, unless that is in doubt.
    """
    axes, file = robot.axes, robot.limits

    def each(values: tuple[float, ...] | None, otherwise: FloatArray | float) -> FloatArray:
        if values is None:
            return np.broadcast_to(otherwise, (len(axes),)).astype(float)
        return np.broadcast_to(np.array(values), (len(axes),)).astype(float)

    motors = [axis.winch.motor for axis in axes]
    torque_Nm = each(file.torque_Nm, np.array([motor.rated_torque_Nm for motor in motors]))
    speed = RATED_SPEED_SHARE * np.array([motor.rated_speed_rad_s for motor in motors])
    strength = np.array([axis.winch.cable.breaking_force_N for axis in axes])
    measured_N = math.inf
    if robot.tension_sensors is not None:
        measured_N = load_tension_sensors(robot.tension_sensors).stop_above_N
    least_N = each(file.tension_min_N, -math.inf)
    following = each(file.following_error_rad, math.inf)
    if robot.platform is not None and "following_error_rad" not in file.model_fields_set:
        cable_m = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        following = np.maximum(following, FOLLOWING_m / np.abs(cable_m))
    figures: dict[str, Any] = {key: one for key, one in file if isinstance(one, int | float)}
    if robot.platform is not None:
        known = None if calibration_in_doubt else robot.calibration
        if len(axes) == len(robot.platform.controlled):
            figures["runaway_m_s"] = RUNAWAY_m_s
        figures.setdefault("lengths_disagree_m", allowed_disagreement_m(robot.platform, known))
    return Limits(
        torque_Nm=torque_Nm,
        torque_rate_Nm_s=each(file.torque_rate_Nm_s, torque_Nm / TORQUE_RISE_S),
        speed_rad_s=each(file.speed_rad_s, speed),
        following_error_rad=following,
        cable_length_min_m=each(file.cable_length_min_m, -math.inf),
        cable_length_max_m=each(file.cable_length_max_m, math.inf),
        tension_min_N=least_N,
        tension_max_N=np.minimum(each(file.tension_max_N, strength / CABLE_SAFETY), measured_N),
        slack_N=each(file.slack_N, SLACK_SHARE * least_N),
        reactions=reactions_of(file.reactions, lowers=can_lower(robot)),
        **figures,
    )


def supervisor_limits(limits: Limits, robot: Robot) -> Limits:
    """Return the limits of a robot's supervisor from those that are planned with.

    A tension that is estimated from torques alone is uncertain by the motors' friction: a
    platform's cables count as low below half the planned least tension.
    """
    if not can_lower(robot) or robot.tension_sensors is not None:
        return limits
    return replace(limits, tension_min_N=LOW_SHARE * np.asarray(limits.tension_min_N))


def winches_of(axes: Sequence[RobotAxis]) -> WinchArrays:
    """Return the winches' arrays for the estimate.

    Without a calibration the tension follows from drum and gear, friction left out.
    """
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])

    def each(key: str, otherwise: FloatArray) -> FloatArray:
        pairs = zip((axis.calibration for axis in axes), otherwise, strict=True)
        return np.array([getattr(known, key) if known else value for known, value in pairs])

    none = np.zeros(len(axes))
    return WinchArrays(
        cable_m_per_rad=cable,
        gain_m=each("gain_m", np.abs(cable)),
        bias_Nm=each("bias_Nm", none),
        friction_Nm=each("friction_Nm", none),
        friction_per_N_m=each("friction_per_N_m", none),
        inertia_kg_m2=np.array([axis.winch.motor.rotor_inertia_kg_m2 for axis in axes]),
    )


def described(limits: Limits, n: int) -> dict[str, Any]:
    """Return limits for a robot's description: arrays over the axes, None where there is none."""
    table: dict[str, Any] = {}
    for name in limits.__dataclass_fields__:
        value = getattr(limits, name)
        if name != "reactions":
            each = np.broadcast_to(value, (n,)) if isinstance(value, np.ndarray) else value
            table[name] = _finite(each)
    wanted = DEFAULT_REACTIONS | dict(limits.reactions)
    table["reactions"] = {limit.key: reaction.label for limit, reaction in wanted.items()}
    return table


def _finite(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_finite(float(x)) for x in value]
    return value if math.isfinite(value) else None
