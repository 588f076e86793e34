"""How a platform in space hangs and turns whose file leaves angles out of `controlled`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdpr_profiles.platform import DIRECTIONS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.feasibility.not_held import point_text
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, hanging_wrenches, run_poses
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.length_disagreement import LEAST_REDUNDANCY
from cdpr_rt.robots.platform.design.loop_plant import weight_at, whole_stiffness
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import LEAST_ARM_m, in_space, is_point
from cdpr_rt.robots.statics import PlatformStatics

_ENOUGH_CABLES = 6
_LEAST_deg, _LEAST_mm = 0.1, 0.1
_FAR_TURNED_deg = 30.0
"""Further than this a small motion is no guide."""


def uncontrolled_rotation(statics: PlatformStatics, disagree_m: float) -> Iterator[Finding]:
    """Look how a platform in space turns about axes u that `controlled` leaves out.

    Its control holds the pose that it computes from lengths as if nothing were turned about u:
    motions are x = N φ_u with N_u = 1, N_c = -J_c^+ J_u. With the wrench w that constant tensions,
    as planned there, and weight leave, and the stiffness K = -∂w/∂x (6, 6) that they give, it rests
    where N^T K N φ_u = N^T w, and turns over where N^T K N is not positive definite. The residuals
    of lengths are J x; `disagree_m` is allowed, of normalised ones.
    """
    platform, model = statics.platform, statics.model
    left = [i for i in (3, 4, 5) if i not in model.kinematics.directions]
    if platform.is_planar or not left or is_point(platform):
        return
    names = ", ".join(DIRECTIONS[3][i] for i in left)
    places, poses = _targets(statics)
    weight = np.tile(model.workspace(0.0, 0.0).wrenches[0], (len(poses), 1))
    t, carried = model.planned_tensions(poses, weight)
    if not carried.any():
        return  # said of the tensions
    places, poses, t = places[carried], poses[carried], t[carried]
    what, impossible = _hanging(model, places, poses, t, left, disagree_m)
    if what:
        yield Finding("platform.controlled", f"{names} left out: {what}", impossible)


def _hanging(
    model: PlatformModel,
    places: FloatArray,
    poses: FloatArray,
    t: FloatArray,
    left: list[int],
    disagree_m: float,
) -> tuple[str, bool]:
    """Return in words how it hangs where that is worst, and whether it is impossible."""
    wrench, K, J = _stiffness(model, poses, t)
    held = J[..., model.kinematics.directions]
    inverse = np.linalg.pinv(held)
    N = np.zeros((len(poses), 6, len(left)))
    N[:, left] = np.eye(len(left))
    N[:, model.kinematics.directions] = -inverse @ J[..., left]
    points = np.array([in_space(b) for b in model.platform.anchor_points_m])
    centre = in_space(model.platform.centre_of_mass_m)[None]
    _, size, turns = np.linalg.svd(_moved(poses[0], points, N[0]), full_matrices=False)
    axes = turns[size > LEAST_ARM_m].T
    if not axes.size:  # no anchor point moves: a rod about itself, or a knot
        hangs = np.linalg.norm(_moved(poses[0], centre, N[0])) > LEAST_ARM_m
        return "its weight swings about these axes, of which no cable tells" if hangs else "", False
    N = N @ axes
    stiffness = N.mT @ K @ N
    least = np.linalg.eigvalsh(stiffness)[:, 0]
    n = t.shape[1]
    mend = (
        "its cables can control them" if n >= _ENOUGH_CABLES else "to control them takes 6 cables"
    )
    mend = f"; {mend}; anchor points nearer together, far above the centre of mass, help"
    if least.min() <= 0.0:
        where = point_text(places[least.argmin()])
        return f"at {where} m cables and weight turn the platform over{mend}", True
    x = (N @ np.linalg.solve(stiffness, N.mT @ wrench[..., None]))[..., 0]
    redundancy = 1.0 - np.einsum("mnd,mdn->mn", held, inverse)
    apart_m = np.abs(J @ x[..., None])[..., 0] / np.sqrt(np.maximum(redundancy, LEAST_REDUNDANCY))
    apart_m = np.where(redundancy > LEAST_REDUNDANCY, apart_m, 0.0).max(axis=1)
    what, impossible = _in_words(places, x, apart_m, disagree_m)
    return what + mend, impossible


def _in_words(
    places: FloatArray, x: FloatArray, apart_m: FloatArray, disagree_m: float
) -> tuple[str, bool]:
    """Return the worst of the motions (m, 6) into rest, at places (m, 3), in words.

    `apart_m` (m,) is the largest normalised residual there.
    """
    angle_deg = np.degrees(np.linalg.norm(x[:, 3:], axis=1))
    off_mm = 1e3 * np.linalg.norm(x[:, :3], axis=1)
    if angle_deg.max() > _FAR_TURNED_deg:
        where = point_text(places[angle_deg.argmax()])
        return f"at {where} m the platform turns by more than {_FAR_TURNED_deg:g} deg", True
    contradicting = bool(apart_m.max() > disagree_m)
    if not contradicting and angle_deg.max() < _LEAST_deg and off_mm.max() < _LEAST_mm:
        return "the platform swings about these axes", False
    k = int((apart_m if contradicting else off_mm).argmax())
    text = (
        f"at {point_text(places[k])} m the platform hangs turned by {angle_deg[k]:.1f} deg, which "
        "is not computed with"
    )
    if contradicting:
        apart_mm, allowed_mm = 1e3 * apart_m[k], 1e3 * disagree_m
        text += f": its lengths disagree by {apart_mm:.1f} mm, {allowed_mm:.1f} mm allowed"
    else:
        text += f", {off_mm[k]:.1f} mm from where it seems to be, and swings"
    return text, contradicting


def _targets(statics: PlatformStatics) -> tuple[FloatArray, FloatArray]:
    """Return positions (m, 3) and poses (m, 4, 3): home, and targets at all orientations."""
    home, box = np.array(statics.platform.home_m)[None], statics.points().reshape(-1, 3)
    places, poses = [home], [statics.poses(home)]
    for turn in statics.orientations:
        held = box[statics.is_target(box, turn)]
        places.append(held)
        poses.append(statics.poses(held, turn))
    return np.concatenate(places), np.concatenate(poses)


def _stiffness(
    model: PlatformModel, poses: FloatArray, t: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the wrench (m, 6) of tensions and weight, K = -∂w/∂x (m, 6, 6), and J (m, n, 6)."""
    geometry = model.kinematics.geometry
    cables, wrench = np.empty((len(poses), CABLE_ROWS, t.shape[1])), np.empty((len(poses), 6))
    hanging_wrenches(geometry, poses, np.arange(6), cables[0], wrench)
    run_poses(geometry, poses, cables)
    wrench -= (cables[:, :6] @ t[..., None])[..., 0]
    K = np.empty((len(poses), 6, 6))
    for k, array in enumerate(poses):
        pose = Pose(array[0], array[1:])
        wrench[k] += weight_at(model, pose)[0]
        K[k] = whole_stiffness(model, pose, t[k])
    return wrench, K, cables[:, :6].mT


def _moved(pose: FloatArray, points_m: FloatArray, motions: FloatArray) -> FloatArray:
    """Return how points (j, 3) of the platform move with each of its motions (6, k), (3 j, k)."""
    arms = points_m @ pose[1:].T
    columns = [x[:3] + np.cross(x[3:], arms) for x in motions.T]
    return np.stack([column.ravel() for column in columns], axis=-1)
