"""The lowest frequency at which rotors and platform swing against each other over their cables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics.cable_kernel import ARC, CABLE_ROWS, FREE, run_poses
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform.design.loop_plant import LEAST, cable_stiffness
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import free_directions, in_space, inertia_kg_m2

_NEAREST_m = 1e-3


def lowest_resonance_Hz(
    model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray
) -> FloatArray:
    """Return it, (...), for positions (..., dimensions), m, in the orientation of home.

    Cable i has the stiffness k = EA / rho of its length, with what lies on its pulley, less by its
    sag where its weight counts, at the least tensions that are planned there, and at its end a
    rotor that counts as m = J / r^2 (J: its inertia, r: cable per radian). With D = diag(k),
    Jacobian A (n, d) and the platform's inertia M (d, d) about its centre of mass, the squares of
    all angular frequencies above zero are the eigenvalues of

        D^1/2 (A M^-1 A^T + diag(1 / m)) D^1/2

    Other effects of tensions, gear and drum count for nothing. Frequencies are in Hz.
    """
    poses, k = model.poses(np.reshape(position_m, (-1, model.positions))), None
    if any(model.platform.cable_weights_N_m):
        at, EA = (Pose(array[0], array[1:]) for array in poses), _rigidities_N(axes)
        k = np.array([cable_stiffness(model, pose, EA)[LEAST] for pose in at])
    squares = _squares(model, axes, poses, k)[..., 0]
    return np.asarray(np.sqrt(squares) / (2.0 * np.pi)).reshape(np.shape(position_m)[:-1])


def highest_rad_s(model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray) -> float:
    """Return the highest angular frequency at one position (dimensions,), without sag, rad/s."""
    poses = model.poses(np.reshape(position_m, (-1, model.positions)))
    return float(np.sqrt(_squares(model, axes, poses)[0, -1]))


def _rigidities_N(axes: Sequence[RobotAxis]) -> FloatArray:
    return np.array([axis.winch.cable.stiffness_N for axis in axes])


def _squares(
    model: PlatformModel,
    axes: Sequence[RobotAxis],
    poses: FloatArray,
    stiffness_N_m: FloatArray | None = None,
) -> FloatArray:
    """Return the eigenvalues, ascending, of poses (m, 4, 3), (m, n); k is EA / rho if left out."""
    platform, geometry = model.platform, model.about_centre_of_mass.geometry
    Q, chosen = model.home_pose.Q, list(free_directions(platform))
    poses = poses.copy()
    poses[:, 0] += Q @ in_space(platform.centre_of_mass_m)
    cables = np.empty((len(poses), CABLE_ROWS, geometry.shape[1]))
    run_poses(geometry, poses, cables)
    rho = np.maximum(cables[:, FREE] + cables[:, ARC], _NEAREST_m)
    A = np.swapaxes(cables[:, chosen], -1, -2)
    M = np.zeros((6, 6))
    M[:3, :3] = platform.mass_kg * np.eye(3)
    M[3:, 3:] = Q @ inertia_kg_m2(platform) @ Q.T
    mobility = np.linalg.inv(M[np.ix_(chosen, chosen)])
    winches = [axis.winch for axis in axes]
    rotors_per_kg = np.array(
        [w.cable_m_per_motor_rad**2 / w.motor.rotor_inertia_kg_m2 for w in winches]
    )
    root = np.sqrt(_rigidities_N(axes) / rho if stiffness_N_m is None else stiffness_N_m)
    inner = A @ mobility @ np.swapaxes(A, -1, -2) + np.diag(rotors_per_kg)
    return np.asarray(np.linalg.eigvalsh(root[..., :, None] * inner * root[..., None, :]))
