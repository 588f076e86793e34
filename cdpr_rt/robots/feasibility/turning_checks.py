"""What is impossible or doubtful about how a platform turns, or tips over."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cdpr_profiles.platform import DIRECTIONS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.feasibility.not_held import point_text
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, hanging_wrenches, run_poses
from cdpr_rt.robots.rigid_body import G_m_s2, LEAST_ARM_m, in_space, is_point, rotation
from cdpr_rt.robots.statics import NONE_rad, PlatformStatics

_TURNED_rad = np.concatenate([[0.01, 0.02, 0.03], 0.04 * np.arange(1, 80)])
"""Angles by which a platform is looked at turned: its cables may touch at small ones alone."""
_TIPS_AT = 0.05
"""Share of its weight that any cable which becomes tight pulls with."""
_FAR_TURNED_deg, _TIPPED_deg = 10.0, 4.0
_STEP_rad, _SIX = 1e-5, 6


def free_rotation(statics: PlatformStatics) -> Iterator[Finding]:
    """Look how far a platform turns that no cable keeps from it."""
    home = np.array(statics.platform.home_m)
    places = np.concatenate([home[None], statics.points().reshape(-1, 2)])
    angle = np.where(statics.is_target(places), statics.angle_rad(places), 0.0)
    if np.isnan(angle).any():
        where = point_text(places[int(np.isnan(angle).argmax())])
        text = (
            f"at {where} m the cables would turn the platform over; each cable should be made fast "
            "on the side of the platform that faces its exit point"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return
    degrees = np.abs(np.degrees(angle))
    if degrees[0] > _TIPPED_deg:
        text = (
            f"there the cables would turn the platform by {degrees[0]:.0f} deg, and may tip it on "
            "its stand; where it turns less, lengths learnt from there are better"
        )
        yield Finding("platform.home_m", text, impossible=False)
    if degrees.max() > _FAR_TURNED_deg:
        where = point_text(places[int(degrees.argmax())])
        text = (
            f"at {where} m the platform turns by {degrees.max():.0f} deg, which no cable can "
            "prevent; anchor points that lie towards their exit points let it turn less"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=False)


def uncontrolled_rotation(statics: PlatformStatics, disagree_m: float) -> Iterator[Finding]:
    """Look how a platform in space turns about axes that `controlled` leaves out.

    Under the tensions that are planned where it is not turned, cables and weight have a moment m
    about these axes and a stiffness K = -∂m/∂φ: it rests turned by φ = K^-1 m, and turns over where
    K is not positive definite. Taken for not turned, it seems to be J_c^+ J_u φ away, by lengths
    that disagree by the rest of J_u φ; `disagree_m` is allowed.
    """
    platform, directions = statics.platform, statics.model.kinematics.directions
    left = [i for i in (3, 4, 5) if i not in directions]
    if platform.is_planar or not left or is_point(platform):
        return
    axes = _axes_that_move(statics, left)
    if not axes.size:
        return  # those of a rod
    home = np.array(platform.home_m)
    places = np.concatenate([home[None], statics.points().reshape(-1, 3)])
    t = statics.least_tensions_N(places, statics.model.reserve_N)
    held = np.isfinite(t).all(axis=1) & statics.is_target(places)
    if not held.any():
        return  # said of the tensions
    places, t = places[held], t[held]
    moments, K, W = _moments(statics, statics.poses(places), t, axes)
    least = np.linalg.eigvalsh(0.5 * (K + K.mT))[:, 0]
    n, names = t.shape[1], ", ".join(DIRECTIONS[3][i] for i in left)
    mend = f"its {n} cables can control them" if n >= _SIX else "to control them takes six cables"
    mend += "; anchor points nearer together, far above the centre of mass, help"
    if least.min() <= 0.0:
        where = point_text(places[least.argmin()])
        what, impossible = f"at {where} m cables and weight turn the platform over", True
    else:
        turns = (axes @ np.linalg.solve(K, moments[..., None]))[..., 0]
        what, impossible = _hanging(places, turns, -W.mT, directions, disagree_m)
    yield Finding("platform.controlled", f"{names} left out: {what}; {mend}", impossible)


def _hanging(
    places: FloatArray,
    turns: FloatArray,
    J: FloatArray,
    directions: tuple[int, ...],
    disagree_m: float,
) -> tuple[str, bool]:
    """Return in words how it hangs where that is worst, and whether it is impossible.

    At places (m, 3) it is turned by rotation vectors (m, 3); `J` (m, n, 6) is of all directions.
    """
    longer_m, Jc = J[..., 3:] @ turns[..., None], J[..., directions]
    off_m = np.linalg.pinv(Jc) @ longer_m
    rest_m = np.abs(longer_m - Jc @ off_m).max(axis=(1, 2))
    impossible, angle = bool(rest_m.max() > disagree_m), np.linalg.norm(turns, axis=1)
    k = int((rest_m if impossible else angle).argmax())
    text = (
        f"at {point_text(places[k])} m the platform hangs turned by {math.degrees(angle[k]):.2g} "
        "deg about these axes, and is taken to be turned as at home: "
    )
    if impossible:
        wrong = f"lengths disagree by {1e3 * rest_m[k]:.3g} mm, {1e3 * disagree_m:.3g} mm allowed"
        return text + wrong, True
    return f"{text}{1e3 * np.linalg.norm(off_m[k, :3]):.3g} mm off, besides what it swings", False


def _axes_that_move(statics: PlatformStatics, left: list[int]) -> FloatArray:
    """Return the axes (3, k) about which turning moves anchors or centre of mass, of those left."""
    platform = statics.platform
    points = [*platform.anchor_points_m, platform.centre_of_mass_m]
    arms = np.array([in_space(point) for point in points]) @ statics.model.home_pose.Q.T
    about = np.eye(3)[[i - 3 for i in left]]
    moved = np.cross(about[:, None], arms[None]).reshape(len(left), -1).T
    _, size, turns = np.linalg.svd(moved, full_matrices=False)
    return np.asarray(about.T @ turns[size > LEAST_ARM_m].T)


def _moments(
    statics: PlatformStatics, poses: FloatArray, t: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return moments (m, k) about `axes` (3, k), their stiffness (m, k, k), and W (m, 6, n)."""
    platform, geometry = statics.platform, statics.model.kinematics.geometry
    cables, hanging = np.empty((len(poses), CABLE_ROWS, t.shape[1])), np.empty((len(poses), 6))
    centre = in_space(platform.centre_of_mass_m)
    weight = np.array([0.0, 0.0, -platform.mass_kg * G_m_s2])

    def moment(turn: FloatArray) -> tuple[FloatArray, FloatArray]:
        turned = poses.copy()
        turned[:, 1:] = rotation(turn) @ poses[:, 1:]
        hanging_wrenches(geometry, turned, np.arange(6), cables[0], hanging)
        run_poses(geometry, turned, cables)
        W = -cables[:, :6]
        pulled = (W @ t[..., None])[:, 3:, 0] + hanging[:, 3:]
        return (pulled + np.cross(turned[:, 1:] @ centre, weight)) @ axes, W

    m, W = moment(NONE_rad)
    slopes = [moment(_STEP_rad * a)[0] - moment(-_STEP_rad * a)[0] for a in axes.T]
    return m, -np.stack(slopes, axis=-1) / (2.0 * _STEP_rad), W


def angles(statics: PlatformStatics) -> Iterator[Finding]:
    """Look for angles at which no place in the box takes a target, whichever way it is turned.

    Either tensions do not hold it there, or something touches; crossed cables may do so at small
    angles alone.
    """
    platform, interference = statics.platform, statics.model.interference
    points, angle_rad = statics.points(), platform.workspace_angle_rad

    def taken(turn_rad: FloatArray) -> bool:
        held = statics.is_target(points, turn_rad).ravel()
        clearances_m, _ = interference.clearances(statics.poses(points, turn_rad))
        return bool((held & (clearances_m >= interference.clearance_m)).any())

    if angle_rad == 0.0 or not taken(NONE_rad):
        return  # said of the box, or of contact
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
                f"value {angle_rad:g}; turned by {math.degrees(at_rad):.3g} deg{about}, it is held "
                "nowhere in the box, or something touches, so that no target is taken; allowed: "
                f"up to {allowed_rad:.3g}"
            )
            yield Finding("platform.workspace_angle_rad", text, impossible=True)
            return
        allowed_rad = at_rad


def lower_when_turned_m(statics: PlatformStatics) -> float:
    """Return how much lower than at home the lowest anchor point of a turned platform may be, m."""
    platform, up = statics.platform, statics.model.positions - 1
    angle = platform.workspace_angle_rad
    b = np.array([in_space(point) for point in platform.anchor_points_m])
    b = b @ statics.model.home_pose.Q.T
    height, aside = b[:, up], np.linalg.norm(b[:, :up], axis=1)
    return float(height.min() - (math.cos(angle) * height - math.sin(angle) * aside).min())


def stand_clearance(statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether a turned platform meets, at the bottom of its box, what it stands on at home."""
    platform, up = statics.platform, statics.model.positions - 1
    angle, lower_m = platform.workspace_angle_rad, lower_when_turned_m(statics)
    above_m = platform.workspace_min_m[up] - platform.home_m[up]
    if angle > 0.0 and lower_m > above_m:
        text = (
            f"turned so, the lowest anchor point is {lower_m:.2f} m lower, and the box begins "
            f"{above_m:.2f} m above home: the platform may meet what it stands on; a box from "
            f"{platform.home_m[up] + lower_m:.2f} m upward helps"
        )
        yield Finding("platform.workspace_angle_rad", text, impossible=False)


def upright(statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether it stands upright at home on next to nothing, as a rod does."""
    tips_at = statics.model.tips_at
    if tips_at < _TIPS_AT:
        text = (
            f"{100.0 * tips_at:.2g} % of its weight tip it over on its stand, and cables that "
            "become tight one after the other pull with more: hold it until all are tight, or give "
            "it a foot, which platform.body tells"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=False)
