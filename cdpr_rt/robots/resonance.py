"""The lowest frequency at which rotors and platform swing against each other over their cables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics.cable_kernel import ARC, CABLE_ROWS, FREE, run_poses
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import free_directions, in_space, inertia_kg_m2

_NEAREST_m = 1e-3


def lowest_resonance_Hz(
    model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray
) -> FloatArray:
    """Return it, (...), for positions (..., dimensions), m, in the orientation of home.

    Cable i has the stiffness k = EA / rho of its length, with what lies on its pulley, and at its
    end a rotor that counts as m = J / r^2 (J: its inertia, r: cable per radian). With D = diag(k),
    Jacobian A (n, d) and the platform's inertia M (d, d) about its centre of mass, the squares of
    all angular frequencies above zero are the eigenvalues of

        D^1/2 (A M^-1 A^T + diag(1 / m)) D^1/2

    Tensions, gear and drum count for nothing. Frequencies are in Hz.
    """
    squares = _squares(model, axes, position_m)[..., 0]
    return np.asarray(np.sqrt(squares) / (2.0 * np.pi)).reshape(np.shape(position_m)[:-1])


def highest_rad_s(model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray) -> float:
    """Return the highest angular frequency of the same at one position (dimensions,), rad/s."""
    return float(np.sqrt(_squares(model, axes, position_m)[0, -1]))


def _squares(model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray) -> FloatArray:
    """Return the eigenvalues, ascending, of m positions, (m, n)."""
    platform, geometry = model.platform, model.about_centre_of_mass.geometry
    Q, chosen = model.home_pose.Q, list(free_directions(platform))
    poses = model.poses(np.reshape(position_m, (-1, model.positions)))
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
    root = np.sqrt(np.array([w.cable.stiffness_N for w in winches]) / rho)
    inner = A @ mobility @ np.swapaxes(A, -1, -2) + np.diag(rotors_per_kg)
    return np.asarray(np.linalg.eigvalsh(root[..., :, None] * inner * root[..., None, :]))
