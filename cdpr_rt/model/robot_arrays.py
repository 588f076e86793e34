"""A robot's file as arrays over its axes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.geometry_calibration import GeometryCalibration
from cdpr_profiles.platform import Platform
from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import WinchArrays
from cdpr_rt.core.supervisor import DEFAULT_REACTIONS, Limits, reactions_of
from cdpr_rt.model.rigid_body import directions_of, home_rotation, in_space

RATED_SPEED_SHARE: Final = 0.2
"""Default speed limit, as a share of the motors' rated speed."""
TORQUE_RISE_S: Final = 0.005
"""Default time in which the torque may rise from zero to its limit."""
CABLE_SAFETY: Final = 5.0
"""Default safety factor: breaking force over the highest tension."""
SLACK_SHARE: Final = 0.25
"""Default tension below which a cable is slack, as a share of the least tension allowed."""
FOLLOWING_m: Final = 0.15
"""Default limit of the following error of a platform's cables: three times the lag at which the
set-point waits for the platform."""
RUNAWAY_m_s: Final = 0.75
"""Excess over the set-point's speed at which a cable counts as broken, if the lengths of the other
cables do not show it. A rotor with its platform does not reach this; a free rotor does within 10 to
50 ms.
"""
LOW_SHARE: Final = 0.5
"""Ratio of the monitored to the planned least tension, if tensions are estimated from torques."""


def can_lower(robot: Robot) -> bool:
    """Return whether there is a program that lowers the robot's platform."""
    return robot.platform is not None


def limits_of(robot: Robot, *, calibration_in_doubt: bool = False) -> Limits:
    """Return the limits of a robot's axes, with defaults for those that its file omits.

    With a calibrated geometry, unless it is in doubt, the limit of disagreeing lengths is tighter.
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
    most_N = np.minimum(each(file.tension_max_N, strength / CABLE_SAFETY), measured_N)
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
        stiffness_N = np.array([axis.winch.cable.stiffness_N for axis in axes])
        figures["lengths_jump_m"] = allowed_jump_m(
            robot.platform,
            figures["lengths_disagree_m"],
            (most_N - np.maximum(least_N, 0.0)) / stiffness_N,
        )
    return Limits(
        torque_Nm=torque_Nm,
        torque_rate_Nm_s=each(file.torque_rate_Nm_s, torque_Nm / TORQUE_RISE_S),
        speed_rad_s=each(file.speed_rad_s, speed),
        following_error_rad=following,
        cable_length_min_m=each(file.cable_length_min_m, -math.inf),
        cable_length_max_m=each(file.cable_length_max_m, math.inf),
        tension_min_N=least_N,
        tension_max_N=most_N,
        slack_N=each(file.slack_N, SLACK_SHARE * least_N),
        reactions=reactions_of(file.reactions, lowers=can_lower(robot)),
        **figures,
    )


def supervisor_limits(limits: Limits, robot: Robot) -> Limits:
    """Return the limits of a robot's supervisor from those used for planning.

    The friction of the motors makes a tension estimated from torques alone uncertain. So the lower
    limit of a platform's cables is then half the planned least tension.
    """
    if not can_lower(robot) or robot.tension_sensors is not None:
        return limits
    return replace(limits, tension_min_N=LOW_SHARE * np.asarray(limits.tension_min_N))


def winches_of(axes: Sequence[RobotAxis]) -> WinchArrays:
    """Return the winches' arrays for the estimate.

    Without a calibration, the tension is computed from drum and gear, without friction.
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
    """Return the limits for a robot's description; each is a list over the axes, or None."""
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


# Limits of the disagreement of a platform's cable lengths. Beyond them something has failed.

TAPE_SHARE: Final = 0.01
TAPE_m: Final = 0.022
"""Normalised residual due to exit points measured by tape: as a share of the diagonal of the box
around them, and its maximum in m."""
DRUM_SHARE: Final = 0.003
"""Standard deviation of a drum's radius, as a share of it."""
SIGMAS: Final = 3.0
"""Allowed number of standard deviations of the error that drums cause."""
CALIBRATED_SHARE: Final = 1.0 / 3.0
CALIBRATED_m: Final = 0.005
"""With a calibrated geometry: factor of the limit, and its least value."""
JUMP_SHARE: Final = 0.25
"""Largest sudden change: share of the limit, and share of the cables' elastic stretch between their
lowest and highest tension."""
_LEAST_LENGTH_m = 1e-6
LEAST_REDUNDANCY = 1e-4
"""A cable with a smaller redundancy number contradicts no other."""


def exit_point_diagonal_m(platform: Platform) -> float:
    """Return the diagonal of the box around a platform's exit points."""
    return float(np.linalg.norm(np.ptp(np.array(platform.exit_points_m), axis=0)))


def allowed_disagreement_m(platform: Platform, calibration: GeometryCalibration | None) -> float:
    """Return the largest allowed normalised residual of the lengths.

    min(1 % of the diagonal of the box around the exit points, 22 mm) + 3 s. s is the standard
    deviation of that residual at the worst position in the box of targets, if drum radii have a
    standard deviation of 0.3 %. With a calibration, the limit is a third of this, but at least 5 mm
    and at least the predicted error.
    """
    tape_m = min(TAPE_m, TAPE_SHARE * exit_point_diagonal_m(platform))
    most_m = tape_m + SIGMAS * _of_drums_m(platform)
    if calibration is None:
        return most_m
    expected_m = 1e-3 * calibration.predicted_3_sigma_mm
    return min(most_m, max(CALIBRATED_SHARE * most_m, CALIBRATED_m, expected_m))


def allowed_jump_m(platform: Platform, disagreement_m: float, strain: FloatArray) -> float:
    """Return the largest allowed sudden change of a residual, if `disagreement_m` is its limit.

    It is a quarter of that limit, but at least a quarter of the longest stretch at home. `strain`
    (n,) is the stretch of a cable between its lowest and highest tension, over its length. Errors
    of the geometry change residuals only as the platform moves. Forces change them by the stretch.
    """
    lengths_m, _ = _cables(platform, platform.home_m)
    return JUMP_SHARE * max(disagreement_m, float((strain * lengths_m).max()))


def _of_drums_m(platform: Platform) -> float:
    """Return the largest standard deviation of a normalised residual due to errors of drum radii.

    Lengths are exact at home. The length paid out since then has the relative error of its drum,
    which causes length errors e. With the projection P = I - J J^+ the residuals are P e and the
    normalised ones P e / sqrt(p_ii). They are computed at the corners of the box of targets, at
    home's orientation, without pulleys.
    """
    home_m, _ = _cables(platform, platform.home_m)
    box = zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    worst = 0.0
    for corner in itertools.product(*box):
        lengths_m, J = _cables(platform, corner)
        P = np.eye(len(J)) - J @ np.linalg.pinv(J)
        redundancy = np.diag(P)
        seen = redundancy > LEAST_REDUNDANCY
        variance = P[seen] ** 2 @ (DRUM_SHARE * (lengths_m - home_m)) ** 2 / redundancy[seen]
        worst = max(worst, float(variance.max(initial=0.0)))
    return float(np.sqrt(worst))


def _cables(platform: Platform, place_m: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return lengths (n,) from exit to anchor point, and their Jacobian (n, d), at a position."""
    exits_m = np.array([in_space(point) for point in platform.exit_points_m])
    arms_m = np.array([in_space(point) for point in platform.anchor_points_m])
    arms_m = arms_m @ home_rotation(platform).T
    along_m = in_space(place_m) + arms_m - exits_m
    lengths_m = np.maximum(np.linalg.norm(along_m, axis=1), _LEAST_LENGTH_m)
    units = along_m / lengths_m[:, None]
    J = np.hstack([units, np.cross(arms_m, units)])
    return lengths_m, J[:, list(directions_of(platform))]
