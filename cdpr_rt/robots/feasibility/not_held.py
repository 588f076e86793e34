"""Reason why a pose is not feasible, and the figure of the robot's file that would change it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cdpr_profiles.platform import DIRECTIONS, Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.platform_model import platform_model
from cdpr_rt.robots.statics import PlatformStatics

_FLAT = 1e-3
"""Share of their span by which points may be off a line or a plane and still count as in it."""
_SHARES = np.concatenate([np.linspace(0.99, 0.03, 97), np.geomspace(0.0295, 1e-5, 120)])
"""Factors on a figure, tried one after the other until one helps: decreasing."""
_TIMES = np.geomspace(1.02, 100.0, 230)
"""Increasing factors, likewise."""


def why_not_held(statics: PlatformStatics, position_m: FloatArray, turn_rad: FloatArray) -> str:
    """Return why the platform is not moved to a position (k,), turned (3,), and what would help."""
    where = f"at {point_text(position_m)} m"
    reserve = float(statics.margin_N(position_m, 0.0, turn_rad))
    if turn_rad.any():
        where += f", turned by {_turn(turn_rad, position_m.size)}"
    if not math.isfinite(reserve):
        return f"{where} {_singular(statics)}"
    needed = ", ".join(str(round(value)) for value in statics.tensions_N(position_m, turn_rad))
    allowed = f"{statics.low_N.min():g} to {statics.model.torque_limited_N.max():.4g} N are allowed"
    if reserve < 0.0:
        text = f"{where} the cables would need {needed} N; {allowed}"
    else:
        text = f"{where} the cables have {needed} N; {allowed}, which leaves too little for motion"
    return f"{text}; {_what_helps(statics, position_m, turn_rad)}"


def _singular(statics: PlatformStatics) -> str:
    """Return that a direction is not held, and which points in a line or a plane are to blame."""
    text = "the cables cannot hold one direction, whatever their tensions"
    for name, points in (("exit points", statics.exits_m), ("anchor points", statics.anchors_m)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        dimensions = int(np.sum(spread > _FLAT * max(float(spread[0]), _FLAT)))
        if dimensions == 1:
            left_out = _free_axis(statics) if points is statics.anchors_m else ""
            return f"{text}: all {name} lie in one line{left_out}"
        in_plane = dimensions == 2 and len(spread) == 3
        if in_plane and points is statics.exits_m and _is_upright(points):
            return f"{text}: all {name} lie in one upright plane"
    return f"{text}: anchor points elsewhere on the platform help"


def _free_axis(statics: PlatformStatics) -> str:
    """Return which axis need not be controlled, of anchor points in a line along it in space."""
    along = np.abs(np.linalg.svd(statics.anchors_m - statics.anchors_m.mean(axis=0))[2][0])
    if len(along) < 3 or along.max() < 1.0 - _FLAT:
        return ""
    return f"; allowed: platform.controlled without {DIRECTIONS[3][3 + int(along.argmax())]}"


def _is_upright(points: FloatArray) -> bool:
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
    return abs(float(normal[2])) < _FLAT


def _what_helps(statics: PlatformStatics, position_m: FloatArray, turn_rad: FloatArray) -> str:
    """Return by how much one figure would have to change for a target there."""
    platform, low_N = statics.platform, statics.low_N
    acceleration, mass_kg = platform.acceleration_m_s2, platform.mass_kg

    def helps(platform: Platform, low_N: FloatArray) -> bool:
        bounds = (low_N, statics.high_N, statics.model.torque_limited_N)
        changed = PlatformStatics(platform_model(platform, *bounds))
        return bool(changed.is_target(position_m, turn_rad))

    for share in _SHARES if turn_rad.any() else ():
        if bool(statics.is_target(position_m, share * turn_rad)):
            angle = share * platform.workspace_angle_rad
            return f"workspace_angle_rad up to {angle:.3g} is possible there"
    slowest = replace(platform, acceleration_m_s2=_SHARES[-1] * acceleration)
    for share in _SHARES if helps(slowest, low_N) else ():
        if helps(replace(platform, acceleration_m_s2=share * acceleration), low_N):
            return f"acceleration_m_s2 up to {share * acceleration:.3g} is possible there"
    for share in _SHARES:
        if helps(replace(platform, mass_kg=share * mass_kg), low_N):
            return f"a platform of up to {share * mass_kg:.3g} kg is possible there"
    loose = next((share for share in _SHARES if helps(platform, share * low_N)), None)
    heavier = (replace(platform, mass_kg=times * mass_kg) for times in _TIMES)
    heavy = next((changed.mass_kg for changed in heavier if helps(changed, low_N)), None)
    if heavy is not None:
        text = f"a platform of {heavy:.3g} kg and more is possible there"
        if loose is not None:
            text += f", or tension_min_N up to {loose * low_N.min():.3g} with winches as small"
        return text
    if loose is not None:
        return f"tension_min_N up to {loose * low_N.min():.3g} is possible there"
    turned = len(platform.controlled) > len(platform.home_m)
    others = ", or other anchor points, which turn it both ways about each axis"
    return f"only a place further inside the exit points helps{others if turned else ''}"


def _turn(turn_rad: FloatArray, coordinates: int) -> str:
    if coordinates == 2:
        return f"{math.degrees(turn_rad[2]):.0f} deg"
    angle = float(np.linalg.norm(turn_rad))
    # + 0: a rounded -0 is shown as 0
    axis = ", ".join(f"{value:.2g}" for value in np.round(turn_rad / angle, 2) + 0.0)
    return f"{math.degrees(angle):.0f} deg about ({axis})"


def point_text(position_m: FloatArray | tuple[float, ...]) -> str:
    """Return a position (k,), m, in brackets, to the centimetre."""
    return "(" + ", ".join(f"{round(value, 2) + 0.0:.2f}" for value in position_m) + ")"
