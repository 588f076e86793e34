"""Impossible or doubtful rotations of a platform, and tipping over."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cdpr_profiles.platform import DIRECTIONS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.subject import Finding, point_text
from cdpr_rt.model.cable_kernel import CABLE_ROWS, hanging_wrenches, run_poses
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.rigid_body import LEAST_ARM_m, in_space, is_point
from cdpr_rt.model.robot_arrays import LEAST_REDUNDANCY
from cdpr_rt.model.statics import NONE_rad, PlatformStatics
from cdpr_rt.platform.loop_plant import swing_periods_s, weight_at, whole_stiffness

_TURNED_rad = np.concatenate([[0.01, 0.02, 0.03], 0.04 * np.arange(1, 80)])
"""Angles of a platform that are tried; some cables touch only at small angles."""
_TIPS_AT = 0.05
"""Pull of a cable that becomes tight, as a share of the platform's weight."""
_FAR_TURNED_deg, _TIPPED_deg = 10.0, 4.0


def free_rotation(statics: PlatformStatics) -> Iterator[Finding]:
    """Check how far a platform turns about an axis that no cable controls."""
    home = np.array(statics.platform.home_m)
    places = np.concatenate([home[None], statics.points().reshape(-1, 2)])
    angle = np.where(statics.is_target(places), statics.angle_rad(places), 0.0)
    if np.isnan(angle).any():
        where = point_text(places[int(np.isnan(angle).argmax())])
        text = (
            f"at {where} m the cables would turn the platform over; fasten each cable on "
            "the side of the platform that faces its exit point"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return
    degrees = np.abs(np.degrees(angle))
    if degrees[0] > _TIPPED_deg:
        text = (
            f"there the cables would turn the platform by {degrees[0]:.0f} deg, and may tip "
            "it on its stand; choose a home where it turns less, because cable lengths are "
            "measured there"
        )
        yield Finding("platform.home_m", text, impossible=False)
    if degrees.max() > _FAR_TURNED_deg:
        where = point_text(places[int(degrees.argmax())])
        text = (
            f"at {where} m the platform turns by {degrees.max():.0f} deg, which no cable can "
            "prevent; anchor points that lie towards their exit points let it turn less"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=False)


def angles(statics: PlatformStatics) -> Iterator[Finding]:
    """Check for angles at which the box contains no feasible target, in either direction.

    Either the cables cannot hold the platform there, or there is a contact; crossed cables may
    touch only at small angles.
    """
    platform, interference = statics.platform, statics.model.interference
    points, angle_rad = statics.points(), platform.workspace_angle_rad

    def taken(turn_rad: FloatArray) -> bool:
        held = statics.is_target(points, turn_rad).ravel()
        clearances_m, _ = interference.clearances(statics.poses(points, turn_rad))
        return bool((held & (clearances_m >= interference.clearance_m)).any())

    if angle_rad == 0.0 or not taken(NONE_rad):
        return  # the findings about the box or contact report it
    names = platform.controlled[len(platform.home_m) :]
    axes = dict(zip(names, statics.orientations[1::2], strict=False))  # diagonals follow

    def refused(share: float) -> str | None:
        for name, turn in axes.items():
            if not taken(share * turn) and not taken(-share * turn):
                return "" if platform.is_planar else f" about {name[-1]}"
        return None

    allowed_rad = 0.0
    for at_rad in (*_TURNED_rad[_TURNED_rad < angle_rad], angle_rad):
        about = refused(at_rad / angle_rad)
        if about is not None:
            text = (
                f"value {angle_rad:g}; if the platform is turned by {math.degrees(at_rad):.3g} "
                f"deg{about}, the cables can hold it nowhere in the box without contact, so no "
                f"target is accepted; allowed: up to {allowed_rad:.3g}"
            )
            yield Finding("platform.workspace_angle_rad", text, impossible=True)
            return
        allowed_rad = at_rad


def lower_when_turned_m(statics: PlatformStatics) -> float:
    """Return how much lower a turned platform's lowest anchor point may be than at home, m."""
    platform, up = statics.platform, statics.model.positions - 1
    angle = platform.workspace_angle_rad
    b = np.array([in_space(point) for point in platform.anchor_points_m])
    b = b @ statics.model.home_pose.Q.T
    height, aside = b[:, up], np.linalg.norm(b[:, :up], axis=1)
    return float(height.min() - (math.cos(angle) * height - math.sin(angle) * aside).min())


def stand_clearance(statics: PlatformStatics) -> Iterator[Finding]:
    """Check whether a turned platform, at the bottom of its box, may hit its stand."""
    platform, up = statics.platform, statics.model.positions - 1
    angle, lower_m = platform.workspace_angle_rad, lower_when_turned_m(statics)
    above_m = platform.workspace_min_m[up] - platform.home_m[up]
    if angle > 0.0 and lower_m > above_m:
        text = (
            f"in this orientation the lowest anchor point is {lower_m:.2f} m lower, and the "
            f"box begins {above_m:.2f} m above home: the platform may touch its stand; a "
            "box from "
            f"{platform.home_m[up] + lower_m:.2f} m upward helps"
        )
        yield Finding("platform.workspace_angle_rad", text, impossible=False)


def upright(statics: PlatformStatics) -> Iterator[Finding]:
    """Check whether a small force can tip over a platform that stands upright at home, like a
    rod.
    """
    tips_at = statics.model.tips_at
    if tips_at < _TIPS_AT:
        text = (
            f"a force of {100.0 * tips_at:.2g} % of its weight tips the platform over on its "
            "stand, and cables that become tight one after the other pull harder: hold the "
            "platform until all are tight, or give it a wider foot and describe the foot in "
            "platform.body"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=False)


# How a platform in space hangs and turns if its file omits angles in `controlled`.

_ENOUGH_CABLES = 6
_LEAST_deg, _LEAST_mm = 0.1, 0.1
_FAR_HUNG_deg = 30.0
"""Angle above which the linearised motion is not valid."""


def uncontrolled_rotation(statics: PlatformStatics, disagree_m: float) -> Iterator[Finding]:
    """Check how a platform in space turns about axes u that `controlled` leaves out.

    The control holds the pose that it computes from lengths as if the platform were not turned
    about u: motions are x = N φ_u with N_u = 1, N_c = -J_c^+ J_u. Constant tensions, as planned
    there, and weight leave a wrench w and give the stiffness K = -∂w/∂x (6, 6). The platform rests
    at N^T K N φ_u = N^T w, and turns over if N^T K N is not positive definite. The residuals of
    lengths are J x; normalised ones may be up to `disagree_m`. With fewer than 6 cables the control
    computes this equilibrium itself, and lengths do not disagree.
    """
    platform, model = statics.platform, statics.model
    left = [i for i in (3, 4, 5) if i not in model.kinematics.directions]
    if platform.is_planar or not left or is_point(platform):
        return
    below_m = platform.home_m[2] - platform.workspace_min_m[2]
    if model.kinematics.hangs_freely and below_m > 0.0:
        text = (
            f"the box reaches {below_m:.3g} m below home, where the control assumes that the "
            "platform stands, and ignores its tilt; allowed: z from "
            f"{platform.home_m[2]:.3g} upward, or a lower home"
        )
        yield Finding("platform.workspace_min_m", text, impossible=True)
        return
    names = ", ".join(DIRECTIONS[3][i] for i in left)
    places, poses = _targets(statics)
    weight = np.tile(model.workspace(0.0, 0.0).wrenches[0], (len(poses), 1))
    t, carried = model.planned_tensions(poses, weight)
    if not carried.any():
        return  # the findings about tensions report it
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
    """Return as text how the platform hangs at the worst position, and whether that is
    impossible.
    """
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
    if (
        not axes.size
    ):  # no anchor point moves, because it is a rod that turns about itself, or a knot
        hangs = np.linalg.norm(_moved(poses[0], centre, N[0])) > LEAST_ARM_m
        return (
            "the platform swings about these axes, and no cable measures that" if hangs else "",
            False,
        )
    N = N @ axes
    stiffness = N.mT @ K @ N
    least = np.linalg.eigvalsh(stiffness)[:, 0]
    n = t.shape[1]
    mend = (
        "its cables can control these directions"
        if n >= _ENOUGH_CABLES
        else "to control these directions, the robot needs 6 cables"
    )
    mend = f"; {mend}; anchor points close together, far above the centre of mass, help"
    if least.min() <= 0.0:
        where = point_text(places[least.argmin()])
        return f"at {where} m cables and weight turn the platform over{mend}", True
    x = (N @ np.linalg.solve(stiffness, N.mT @ wrench[..., None]))[..., 0]
    redundancy = 1.0 - np.einsum("mnd,mdn->mn", held, inverse)
    apart_m = np.abs(J @ x[..., None])[..., 0] / np.sqrt(np.maximum(redundancy, LEAST_REDUNDANCY))
    apart_m = np.where(redundancy > LEAST_REDUNDANCY, apart_m, 0.0).max(axis=1)
    computed = model.kinematics.hangs_freely
    apart_m *= not computed
    what, impossible = _in_words(places, x, apart_m, disagree_m, computed)
    if computed and not impossible:
        box = np.array([model.platform.workspace_min_m, model.platform.workspace_max_m])
        k = int(np.linalg.norm(places - box.mean(axis=0), axis=1).argmin())
        periods = swing_periods_s(model, Pose(poses[k, 0], poses[k, 1:]), J[k], t[k])
        shown = " and ".join(f"{period:.2f}" for period in periods)
        what += f"; with still motors the platform swings at {point_text(places[k])} m in {shown} s"
    return what + mend, impossible


def _in_words(
    places: FloatArray, x: FloatArray, apart_m: FloatArray, disagree_m: float, computed: bool
) -> tuple[str, bool]:
    """Return as text the worst of the motions (m, 6) to the rest pose, at positions (m, 3).

    `apart_m` (m,) is the largest normalised residual at each place. `computed` is whether the
    control computes the equilibrium.
    """
    angle_deg = np.degrees(np.linalg.norm(x[:, 3:], axis=1))
    off_mm = 1e3 * np.linalg.norm(x[:, :3], axis=1)
    if angle_deg.max() > _FAR_HUNG_deg:
        where = point_text(places[angle_deg.argmax()])
        return f"at {where} m the platform turns by more than {_FAR_HUNG_deg:g} deg", True
    contradicting = bool(apart_m.max() > disagree_m)
    if not contradicting and angle_deg.max() < _LEAST_deg and off_mm.max() < _LEAST_mm:
        return "the platform swings about these axes", False
    k = int((apart_m if contradicting else off_mm).argmax())
    text = f"at {point_text(places[k])} m the platform hangs turned by {angle_deg[k]:.1f} deg, "
    if computed:
        return (
            f"{text}{off_mm[k]:.1f} mm from where it would be without that rotation, and swings; "
            "the control computes the rotation from equilibrium, and an inclinometer measures it",
            False,
        )
    text += "which the control does not compute"
    if contradicting:
        apart_mm, allowed_mm = 1e3 * apart_m[k], 1e3 * disagree_m
        text += f": its lengths disagree by {apart_mm:.1f} mm, {allowed_mm:.1f} mm allowed"
    else:
        text += f", {off_mm[k]:.1f} mm from its estimated place, and swings"
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
    """Return the displacements of points (j, 3) of the platform by each motion (6, k), (3 j, k)."""
    arms = points_m @ pose[1:].T
    columns = [x[:3] + np.cross(x[3:], arms) for x in motions.T]
    return np.stack([column.ravel() for column in columns], axis=-1)
