"""How far friction of the winches turns a platform beside how far its cables can hold it turned."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_profiles.platform import DIRECTIONS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.feasibility.not_held import point_text
from cdpr_rt.robots.platform.body_kernel import body_of, write_mass_matrix
from cdpr_rt.robots.platform.design.loop_design import design_poses
from cdpr_rt.robots.platform.design.loop_gains import DAMPING_RATIO, LoopGains
from cdpr_rt.robots.platform.learning.motor_learning import FRICTION_SHARE
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.statics import PlatformStatics

_SHARES = np.linspace(1.0, 0.0, 51)


def loop_stiffness(model: PlatformModel, gains: LoopGains, q: FloatArray) -> FloatArray:
    """Return K = D M^-1 D/(4 ζ²) (d, d) of a loop at a set-point (d,), N/m and Nm/rad.

    As `loop_kernel` has D and M.
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


def moved_by_friction_m(model: PlatformModel, axes: Sequence[RobotAxis], gains: LoopGains) -> float:
    """Return how far usual friction moves the platform along a direction, as `turned_by_friction`.

    One standard deviation, along the direction and at the place where it is most.
    """
    friction_N = _usual_friction_N(axes)
    poses = design_poses(model)
    return max(float(_moved(model, friction_N, gains, q)[: model.positions].max()) for q in poses)


def stretched_by_acceleration_m(model: PlatformModel, axes: Sequence[RobotAxis]) -> float:
    """Return how far cables yield along a direction while the platform is accelerated along all.

    The most of K^-1 m a, with K = J^T diag(EA / l) J, over where the loop was designed.
    """
    k, kinematics = model.positions, model.kinematics
    stiffness_N = np.array([axis.winch.cable.stiffness_N for axis in axes])
    force = np.zeros(model.size)
    force[:k] = model.platform.mass_kg * model.acceleration[:k]
    most_m = 0.0
    for q in design_poses(model):
        pose = model.pose(q)
        J = kinematics.jacobian(pose)
        K = J.T * (stiffness_N / kinematics.lengths(pose)) @ J
        most_m = max(most_m, float(np.abs(np.linalg.solve(K, force)[:k]).max()))
    return most_m


def _usual_friction_N(axes: Sequence[RobotAxis]) -> FloatArray:
    """Return the standard deviation of the winches' friction in their cables, (n,)."""
    winches = [axis.winch for axis in axes]
    rated_N = [w.motor.rated_torque_Nm / abs(w.cable_m_per_motor_rad) for w in winches]
    return np.asarray(FRICTION_SHARE * np.array(rated_N))


def _moved(
    model: PlatformModel, friction_N: FloatArray, gains: LoopGains, q: FloatArray
) -> FloatArray:
    """Return the standard deviation of K^-1 J^T f (d,) at a set-point (d,)."""
    J = model.kinematics.jacobian(model.pose(q))
    moved = np.linalg.solve(loop_stiffness(model, gains, q), J.T * friction_N)
    return np.asarray(np.linalg.norm(moved, axis=1))


def turned_by_friction(
    statics: PlatformStatics, axes: Sequence[RobotAxis], gains: LoopGains
) -> str:
    """Return about which axis friction turns the platform to where nothing holds it, "" for none.

    Friction that is usual, of standard deviation f (n,) in each winch, moves it by that of K^-1 J^T
    f, until the integral part has overcome it: looked at where the loop was designed, turned as at
    home.
    """
    model = statics.model
    friction_N, k = _usual_friction_N(axes), model.positions
    worst, text = 1.0, ""
    for q in design_poses(model):
        if q[k:].any():
            continue
        J = model.kinematics.jacobian(model.pose(q))
        turned = _moved(model, friction_N, gains, q)
        for i in range(k, model.size):
            share = _held_share(statics, q[:k], model.kinematics.directions[i] - 3, turned[i])
            if share < worst:
                worst = share
                told = float(np.sqrt(np.linalg.inv(J.T @ J)[i, i])) * 1e-3
                text = (
                    f"friction of {friction_N.max():.2g} N, usual in such winches, turns the "
                    f"platform by {math.degrees(turned[i]):.2g} deg{_about(model, i)} until "
                    f"the control overcomes it (1 mm in each cable is {math.degrees(told):.2g} "
                    f"deg); at {point_text(q[:k])} m the cables hold it turned by up to "
                    f"{math.degrees(share * turned[i]):.2g} deg: anchor points that turn it with "
                    "longer arms help, or more cables, or winches with less gear"
                )
    return text


def _about(model: PlatformModel, i: int) -> str:
    names = [name for name in DIRECTIONS[model.positions] if name in model.platform.controlled]
    return "" if model.platform.is_planar else f" about {names[i]}"


def _held_share(
    statics: PlatformStatics, position_m: FloatArray, axis: int, angle_rad: float
) -> float:
    """Return up to what share of an angle about an axis, to and fro, tensions hold the platform."""
    turn = angle_rad * np.eye(3)[axis]
    for share in _SHARES:
        turns = np.array([share * turn, -share * turn])
        if float(statics.margin_N(position_m, 0.0, turns)) >= 0.0:
            return float(share)
    return 0.0
