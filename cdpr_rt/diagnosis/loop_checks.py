"""Impossible or doubtful properties of a robot's loop."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import DIRECTIONS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.subject import Finding, Subject, point_text
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.statics import PlatformStatics
from cdpr_rt.platform.body_kernel import body_of, write_mass_matrix
from cdpr_rt.platform.loop_design import (
    DesignedLoop,
    SwingsError,
    UnstableError,
    design_poses,
)
from cdpr_rt.platform.loop_plant import DAMPING_RATIO, CABLE_DAMPING_s, LITTLE_DAMPING_s, LoopGains
from cdpr_rt.platform.motor_learning import FRICTION_SHARE

# How far friction of the winches turns a platform, and how far its cables can hold it turned.

_SHARES = np.linspace(1.0, 0.0, 51)


def loop_stiffness(model: PlatformModel, gains: LoopGains, q: FloatArray) -> FloatArray:
    """Return K = D M^-1 D/(4 ζ²) (d, d) of a loop at a set-point (d,), N/m and Nm/rad.

    D and M are those of `loop_kernel`.
    """
    pose, directions = model.pose(q), model.kinematics.directions
    M, scratch = np.zeros((6, 6)), np.zeros((4, 3))
    write_mass_matrix(body_of(model.platform), pose.array, scratch, M)
    J = model.kinematics.jacobian(pose)
    A = J.T @ J
    mass = M[np.ix_(directions, directions)] + gains.rotor_kg * A
    inertial = 2.0 * DAMPING_RATIO * gains.bandwidth_rad_s * mass
    D = np.linalg.inv(np.linalg.inv(inertial) + np.linalg.inv(gains.damping_N_s_m * A))
    return np.asarray(D @ np.linalg.solve(mass, D) / (4.0 * DAMPING_RATIO**2))


def moved_by_friction_m(s: Subject) -> float:
    """Return how far usual friction moves the platform, as in `turned_by_friction`.

    It is one standard deviation, in the worst direction and at the worst position.
    """
    poses = design_poses(s.model)
    return max(float(_moved(s, q)[: s.model.positions].max()) for q in poses)


def stretched_by_acceleration_m(s: Subject) -> float:
    """Return the largest displacement by cable stretch during acceleration in all directions.

    It is the largest K^-1 m a, with K = J^T diag(EA / l) J, over the poses of the loop's design.
    """
    model, k, kinematics = s.model, s.model.positions, s.model.kinematics
    force = np.zeros(model.size)
    force[:k] = model.platform.mass_kg * model.acceleration[:k]
    most_m = 0.0
    for q in design_poses(model):
        pose = model.pose(q)
        J = kinematics.jacobian(pose)
        K = J.T * (s.stiffness_N / kinematics.lengths(pose)) @ J
        most_m = max(most_m, float(np.abs(np.linalg.solve(K, force)[:k]).max()))
    return most_m


def _usual_friction_N(s: Subject) -> FloatArray:
    """Return the standard deviation of the winches' friction as tensions of their cables, (n,)."""
    return np.asarray(FRICTION_SHARE * s.rated_N)


def _moved(s: Subject, q: FloatArray) -> FloatArray:
    """Return the standard deviation of K^-1 J^T f (d,) at a set-point (d,)."""
    J = s.model.kinematics.jacobian(s.model.pose(q))
    moved = np.linalg.solve(loop_stiffness(s.model, s.loop.gains, q), J.T * _usual_friction_N(s))
    return np.asarray(np.linalg.norm(moved, axis=1))


def turned_by_friction(s: Subject) -> str:
    """Return about which axis friction turns the platform too far, as text, or "".

    Let f (n,) be the friction of the winches, with its usual standard deviation. It turns the
    platform by K^-1 J^T f until the integral part has overcome it. The result is "" if the cables
    can hold the platform with this rotation at all poses of the loop's design with home's
    orientation.
    """
    model, k, worst, text = s.model, s.model.positions, 1.0, ""
    friction_N = float(_usual_friction_N(s).max())
    for q in design_poses(model):
        if q[k:].any():
            continue
        J = model.kinematics.jacobian(model.pose(q))
        turned = _moved(s, q)
        for i in range(k, model.size):
            share = _held_share(s.statics, q[:k], model.kinematics.directions[i] - 3, turned[i])
            if share < worst:
                worst = share
                per_mm_rad = float(np.sqrt(np.linalg.inv(J.T @ J)[i, i])) * 1e-3
                text = (
                    f"friction of {friction_N:.2g} N, usual for such winches, turns the platform "
                    f"by {math.degrees(turned[i]):.2g} deg{_about(model, i)} until the control "
                    f"overcomes it (1 mm of each cable is {math.degrees(per_mm_rad):.2g} deg); at "
                    f"{point_text(q[:k])} m the cables can hold a rotation of at most "
                    f"{math.degrees(share * turned[i]):.2g} deg: longer arms to the anchor points, "
                    "more cables, or winches with a smaller gear ratio help"
                )
    return text


def _about(model: PlatformModel, i: int) -> str:
    names = [name for name in DIRECTIONS[model.positions] if name in model.platform.controlled]
    return "" if model.platform.is_planar else f" about {names[i]}"


def _held_share(
    statics: PlatformStatics, position_m: FloatArray, axis: int, angle_rad: float
) -> float:
    """Return the share of an angle about an axis, in both directions, up to which cables hold the
    platform.
    """
    turn = angle_rad * np.eye(3)[axis]
    for share in _SHARES:
        turns = np.array([share * turn, -share * turn])
        if float(statics.margin_N(position_m, 0.0, turns)) >= 0.0:
            return float(share)
    return 0.0


_SLOW_Hz = 0.5
"""Slowest mode of a loop: it settles within 2 % in 2.3 s."""
_SWINGS_s = 5.0
"""Longest time for a mode to decay to 2 %."""


def loop_findings(s: Subject) -> Iterator[Finding]:
    """Yield impossible or doubtful properties of the loop that is designed for a robot."""
    robot = s.robot
    try:
        loop = s.loop
    except GeometryError as error:
        if isinstance(error, SwingsError):
            text = f"value {robot.sync_period_s:g}; {error}: a shorter cycle, longer arms or less "
            text += f"tension_max_N help{_known_damping(robot)}"
            yield Finding("sync_period_s", text, impossible=True, helps="limits.tension_max_N")
        elif isinstance(error, UnstableError):
            text = (
                f"{error}: anchor points that lie towards their exit points, with longer arms, help"
            )
            yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return  # the findings about tensions report it
    slowest_Hz = loop.slowest_rad_s / math.tau
    if slowest_Hz < _SLOW_Hz:
        off_mm = 1e3 * moved_by_friction_m(s)
        yield_mm = 1e3 * stretched_by_acceleration_m(s)
        text = (
            f"the slowest mode of a stable loop is at {slowest_Hz:.2g} Hz, so the platform "
            "settles slowly and overshoots its targets: its cables stretch by "
            f"{yield_mm:.2g} mm when it accelerates, and the usual friction of such winches "
            f"moves it by {off_mm:.2g} mm until the control overcomes it; the goal is "
            f"{_SLOW_Hz:g} Hz or more: stiffer cables, less acceleration, a lighter "
            "platform or a shorter sync_period_s help"
        )
        yield Finding("platform.mass_kg", text, impossible=False)
    if loop.gains.follows_pose and (text := turned_by_friction(s)):
        yield Finding("axes[0].anchor_point_m", text, impossible=False)
    yield from _swinging(loop, s.model)
    assumed = any("damping_s" not in axis.winch.cable.model_fields_set for axis in robot.axes)
    if assumed:
        yield from _growing(loop, robot.sync_period_s, s.model)


def _known_damping(robot: Robot) -> str:
    """Return a text if the cables' profile has less damping than usual, else ""."""
    least_s = min(axis.winch.cable.damping_s for axis in robot.axes)
    if least_s >= CABLE_DAMPING_s:
        return ""
    return f"; damping_s of the cables' profile is {1e3 * least_s:g} ms"


def _swinging(loop: DesignedLoop, model: PlatformModel) -> Iterator[Finding]:
    """Check whether a platform swings for long at some pose."""
    at_poses = zip(loop.modes, design_poses(model), strict=True)
    mode, place = max(at_poses, key=lambda at: at[0].dies_down_s)
    if mode.dies_down_s <= _SWINGS_s:
        return
    if loop.gains.follows_pose:
        key, held, helps = "platform.mass_kg", "", "stiffer cables, a lighter platform"
    else:  # the platform may be turned anywhere by friction
        key, held = "axes[0].anchor_point_m", "its tensions act like springs, and "
        helps = "longer arms, less tension_max_N"
    text = (
        f"{held}with the platform at {point_text(place[: model.positions])} m it may "
        f"swing at {mode.frequency_Hz:.2g} Hz, with {100.0 * mode.damping_ratio:.1g} % "
        f"of critical damping, for {mode.dies_down_s:.2g} s after a motion, without the "
        f"friction of the winches; the goal is up to {_SWINGS_s:g} s: {helps} or a "
        "shorter sync_period_s help"
    )
    yield Finding(key, text, impossible=False)


def _growing(loop: DesignedLoop, period_s: float, model: PlatformModel) -> Iterator[Finding]:
    """Check whether a mode grows at some pose if cables have little damping."""
    if not loop.growing_modes:
        return
    at_poses = zip(loop.growing_modes, design_poses(model), strict=True)
    mode, place = min(at_poses, key=lambda at: at[0].damping_ratio)
    text = (
        f"value {period_s:g}; the loop relies on the assumed damping of the cables "
        f"(damping_s of their profile): with {1e3 * LITTLE_DAMPING_s:g} ms a mode at "
        f"{mode.frequency_Hz:.2g} Hz grows with the platform at "
        f"{point_text(place[: model.positions])} m; a shorter cycle helps, or a "
        "measured damping_s, for which the loop is then designed"
    )
    yield Finding("sync_period_s", text, impossible=False)
