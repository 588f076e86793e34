"""What is impossible or doubtful about how a platform turns, or tips over."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.feasibility.not_held import point_text
from cdpr_rt.robots.rigid_body import in_space
from cdpr_rt.robots.statics import NONE_rad, PlatformStatics

_TURNED_rad = np.concatenate([[0.01, 0.02, 0.03], 0.04 * np.arange(1, 80)])
"""Angles by which a platform is looked at turned: its cables may touch at small ones alone."""
_TIPS_AT = 0.05
"""Share of its weight that any cable which becomes tight pulls with."""
_FAR_TURNED_deg, _TIPPED_deg = 10.0, 4.0


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
