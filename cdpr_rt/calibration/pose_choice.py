"""Choose poses that are spread out most, or that are most informative about the geometry.

Both methods take one pose after the other, each the best one in addition to those already taken.
"""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.parameters import CABLE_ROWS, CableGeometry, Knowledge, ParameterKind
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import encoder_lengths, linearise
from cdpr_rt.model.cable_kernel import CABLE_ROWS as KERNEL_ROWS
from cdpr_rt.model.cable_kernel import run_poses
from cdpr_rt.model.platform_model import PlatformModel

EXIT_m = OFFSET_m = 0.1
"""Prior standard deviation of exit points and initial lengths, measured by tape."""
LENGTH_m, POSITION_m, ROTATION_rad = 1e-3, 5e-3, 5e-3
"""Standard deviations at a pose: of lengths, and of position and rotation from a camera."""
HAND_EYE_m, HAND_EYE_rad = 0.1, 0.2
"""Prior standard deviations of the camera's pose on its platform."""
_AT_ONCE = 64


def spread(positions: FloatArray, arms: FloatArray, count: int) -> IntArray:
    """Return the indices of `count` positions (m, d) that are far from each other.

    The first is the furthest from the middle. Each further one has the largest distance to the
    nearest one already taken (Gonzalez, 1985: the least distance is more than half of that of the
    best choice). A distance is the norm of differences multiplied by `arms` (d,), which converts
    angles to lengths.
    """
    scaled = np.asarray(positions, float) * arms
    nearest = np.linalg.norm(scaled - scaled.mean(axis=0), axis=1)
    taken = [int(nearest.argmax())]
    nearest = np.linalg.norm(scaled - scaled[taken[0]], axis=1)
    while len(taken) < count:
        taken.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(scaled - scaled[taken[-1]], axis=1))
    return np.array(taken)


def informative(geometry: CableGeometry, poses: FloatArray, count: int) -> IntArray:
    """Return the indices of the `count` poses (m, 4, 3) that are most informative.

    The choice is greedily D-optimal: each pose increases log det of the information most, given
    those before. The information of a pose is R^T R, see `pose_rows`. The gain of a pose falls as
    others are taken, so only poses that may still be the best are computed again (Minoux, 1978).
    """
    rows = pose_rows(geometry, poses)
    covariance = np.eye(rows.shape[2])
    most, taken = np.full(len(rows), np.inf), []
    for _ in range(count):
        fresh = np.zeros(len(rows), bool)
        while not fresh[best := int(most.argmax())]:
            stale = np.flatnonzero(~fresh & (most > -np.inf))
            chosen = stale[np.argsort(-most[stale])[:_AT_ONCE]]
            most[chosen], fresh[chosen] = _gains(rows[chosen], covariance), True
        taken.append(best)
        most[best] = -np.inf
        gained = covariance @ rows[best].T
        inner = np.eye(rows.shape[1]) + rows[best] @ gained
        covariance = covariance - gained @ np.linalg.solve(inner, gained.T)
    return np.array(taken)


def _gains(rows: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the gains (m,) of log det from the rows (m, r, P) of each pose."""
    inner = np.eye(rows.shape[1]) + rows @ covariance @ np.swapaxes(rows, 1, 2)
    return np.asarray(np.linalg.slogdet(inner)[1])


def pose_rows(geometry: CableGeometry, poses: FloatArray) -> FloatArray:
    """Return the information of lengths and a camera at poses (m, 4, 3), R (m, n + 6, P).

    The parameters are those of `geometry`, then the camera's pose on the platform, in units of
    prior deviations. With the derivatives J_x by the unknown pose and J_p by the parameters, R = (1
    - J_x (J_x^T J_x)^-1 J_x^T) J_p. The camera measures its own pose.
    """
    m, n, size, free = len(poses), geometry.n, geometry.size, list(geometry.free)
    tension = np.tile(0.5 * (geometry.model.low_N + geometry.model.high_N), (m, 1))
    seen = Observations.of_lengths(encoder_lengths(geometry, poses, tension), tension, poses)
    at = linearise(geometry, seen, poses, np.zeros(0))
    sigma = np.repeat([POSITION_m, ROTATION_rad], 3)[:, None]
    by_pose = np.zeros((m, n + 6, len(free)))
    by_pose[:, :n] = at.by_pose[:, :n]
    by_pose[:, n:] = (np.eye(6) / sigma)[:, free]
    rows = np.zeros((m, n + 6, size + 6))
    rows[:, :n, :size] = at.by_parameter[:, :n] * geometry.known_std()
    rows[:, n : n + 3, size : size + 3] = poses[:, 1:] * (HAND_EYE_m / POSITION_m)
    rows[:, n + 3 :, size + 3 :] = poses[:, 1:] * (HAND_EYE_rad / ROTATION_rad)
    across = np.swapaxes(by_pose, 1, 2)
    return np.asarray(rows - by_pose @ np.linalg.solve(across @ by_pose, across @ rows))


def cable_geometry(model: PlatformModel) -> CableGeometry:
    """Return the geometry to identify: exit points, offsets and drums of rigid cables."""
    none = np.zeros(model.kinematics.n)
    start = np.zeros((none.size, CABLE_ROWS))
    kinds: tuple[ParameterKind, ...] = ("exit", "offset", "drum")
    return CableGeometry(model, none, none, kinds, Knowledge(EXIT_m, OFFSET_m), start)


def predicted_deviation_m(geometry: FloatArray, poses: FloatArray) -> float:
    """Return the rms standard deviation of exit point coordinates after poses (m, 4, 3).

    `geometry` (13, n) is that of `cable_kernel`.
    """
    rows = information_rows(geometry, poses)
    before = np.diag([EXIT_m**-2] * 3 + [OFFSET_m**-2])
    covariance = np.linalg.inv(before + np.einsum("mia,mib->iab", rows, rows))
    return float(np.sqrt(np.mean(np.einsum("iaa->ia", covariance)[:, :3])))


def information_rows(geometry: FloatArray, poses: FloatArray) -> FloatArray:
    """Return the rows of each pose and cable, (m, n, 4), divided by their standard deviation."""
    cables = np.empty((len(poses), KERNEL_ROWS, geometry.shape[1]))
    run_poses(geometry, poses, cables)
    turned = (cables[:, 3:6] ** 2).sum(axis=1)
    variance = LENGTH_m**2 + POSITION_m**2 + turned * ROTATION_rad**2
    u = np.swapaxes(cables[:, :3], 1, 2)
    rows = np.concatenate([u, np.ones((*u.shape[:2], 1))], axis=2)
    return np.asarray(rows / np.sqrt(variance)[..., None])
