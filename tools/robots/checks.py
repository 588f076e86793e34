"""Whether a cable robot can work as its file describes it, and what to change where it cannot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.robot_arrays import limits_of
from profiles import ProfileError, Robot
from profiles.platform import Platform
from tools.robots.statics import CABLES, PlanarStatics, can_be_computed, statics_of

_GRID = 25
_SHARES = np.concatenate([np.linspace(0.99, 0.03, 97), np.geomspace(0.0295, 1e-5, 120)])
_TIMES = np.geomspace(1.02, 20.0, 150)
_LONGEST_PERIOD_s = 0.005
"""Of a cycle, with which the platform's control is still stiff enough to overcome friction."""
_NEAREST_m = 0.1
"""An anchor point closer than this to an exit point is about to be pulled into it."""
_FAR_TURNED_deg, _TIPPED_deg = 10.0, 4.0
_WIDE_ARMS = 0.5
"""Anchor points further apart than this share of the exit points are probably not in metres."""


@dataclass(frozen=True)
class Finding:
    """Something about a key of a robot's file: what is wrong, and what to change."""

    key: str
    text: str
    impossible: bool
    """Whether the robot cannot work like this; else it can, less well than it seems."""


def findings(robot: Robot) -> list[Finding]:
    """Return what is impossible or doubtful about a robot's platform, the worst first."""
    if robot.platform is None:
        return []
    if not can_be_computed(robot):
        kind = "plane" if robot.platform.is_planar else "room"
        text = (
            f"{len(robot.axes)} cables in a {kind}: tensions are known, and the platform is moved, "
            f"with {CABLES} cables in a plane; here axes are moved one by one"
        )
        return [Finding("axes", text, impossible=False)]
    statics = statics_of(robot)
    found = [*_cycle(robot), *_shape(robot, statics)]
    if not any(finding.impossible for finding in found):
        # with points that cannot be meant, tensions and torques only repeat it
        found += [*_tensions(statics), *_motors(robot, statics), *_turning(statics)]
        found += _lengths(robot, statics)
    return sorted(found, key=lambda finding: not finding.impossible)


def refuse_impossible(robot: Robot) -> list[str]:
    """Return what is doubtful about a robot, a line each.

    Raises ProfileError where it is impossible: a line for each key, with what to change.
    """
    found = findings(robot)
    wrong = [finding for finding in found if finding.impossible]
    if wrong:
        further = "".join(f"\n{robot.path}: {f.key}: {f.text}" for f in wrong[1:])
        raise ProfileError(robot.path, wrong[0].key, wrong[0].text + further)
    return [f"{robot.path}: {finding.key}: {finding.text}" for finding in found]


def _cycle(robot: Robot) -> Iterator[Finding]:
    if robot.sync_period_s > _LONGEST_PERIOD_s:
        text = (
            f"value {robot.sync_period_s:g}; allowed: up to {_LONGEST_PERIOD_s:g} for a platform, "
            "whose control would be too soft to overcome its winches' friction"
        )
        yield Finding("sync_period_s", text, impossible=True)


def _shape(robot: Robot, statics: PlanarStatics) -> Iterator[Finding]:
    a, b = statics.geometry.a, statics.geometry.b
    apart = [(i, j, float(np.linalg.norm(a[i] - a[j]))) for i in range(3) for j in range(i)]
    for i, j, distance in apart:
        if distance < _NEAREST_m:
            text = f"{distance:.3g} m from that of axes[{j}]; allowed: {_NEAREST_m:g} m and more"
            yield Finding(f"axes[{i}].exit_point_m", text, impossible=True)
    span = max(distance for _, _, distance in apart)
    wide = max(float(np.linalg.norm(b[i] - b[j])) for i in range(3) for j in range(i))
    if wide > _WIDE_ARMS * span:
        text = (
            f"anchor points are up to {wide:.3g} m apart, exit points {span:.3g} m; allowed: half "
            "of that (is one of them in millimetres?)"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return
    lengths = statics.geometry.lengths(statics.box.grid(_GRID, _GRID))
    for i, nearest in enumerate(lengths.min(axis=(0, 1))):
        if nearest < _NEAREST_m:
            text = (
                f"the box of targets goes up to {nearest:.2g} m from the exit point of "
                f"axes[{i}] ({robot.axes[i].name}); allowed: {_NEAREST_m:g} m and more"
            )
            yield Finding("platform.workspace_min_m", text, impossible=True)


def _tensions(statics: PlanarStatics) -> Iterator[Finding]:
    platform = statics.platform
    home = np.array(platform.home_m)
    way = np.linspace(home, np.clip(home, statics.box.low_m, statics.box.high_m), _GRID)
    for place, where in ((home[None], ""), (way, "on the way to the box of targets, ")):
        missing = ~statics.is_target(place)
        if missing.any():
            text = where + _not_held(statics, place[missing.argmax()])
            yield Finding("platform.home_m", text, impossible=True)
            break
    points = statics.box.grid(_GRID, _GRID)
    taken = float(np.mean(statics.is_target(points)))
    if taken < 1.0:
        text = f"in {100 * taken:.0f} % of the box targets are taken; "
        smaller = statics.largest_box(statics.box)
        if smaller is not None:
            text += f"in all of {_point(smaller.low_m)} to {_point(smaller.high_m)} m they would be"
        else:
            worst = statics.controlled.reserve_N(points, platform.acceleration_m_s2).argmin()
            text += _not_held(statics, points.reshape(-1, 2)[worst])
        yield Finding("platform.workspace_min_m", text, impossible=taken == 0.0)


def _not_held(statics: PlanarStatics, position_m: FloatArray) -> str:
    """Say why the platform is not moved there, and what would help."""
    where, reserve = f"at {_point(position_m)} m", float(statics.reserve_N(position_m))
    if not math.isfinite(reserve):
        return f"{where} the cables cannot hold one direction, whatever their tensions"
    needed = ", ".join(f"{value:.0f}" for value in statics.tensions_N(position_m))
    allowed = f"{statics.low_N.min():g} to {statics.high_N.max():g} N are allowed"
    if reserve < 0.0:
        text = f"{where} the cables would need {needed} N; {allowed}"
    else:
        text = f"{where} the cables have {needed} N; {allowed}, which leaves too little for motion"
    return f"{text}; {_what_helps(statics, position_m)}"


def _what_helps(statics: PlanarStatics, position_m: FloatArray) -> str:
    """Say by how much one figure would have to change for a target there."""
    platform, low_N = statics.platform, statics.low_N
    most, mass_kg = platform.acceleration_m_s2, platform.mass_kg

    def helps(platform: Platform, low_N: FloatArray) -> bool:
        return bool(PlanarStatics(platform, low_N, statics.high_N).is_target(position_m))

    for share in _SHARES:
        if helps(replace(platform, acceleration_m_s2=share * most), low_N):
            return f"acceleration_m_s2 up to {share * most:.3g} is possible there"
    for share in _SHARES:
        if helps(replace(platform, mass_kg=share * mass_kg), low_N):
            return f"a platform of up to {share * mass_kg:.3g} kg is possible there"
    for share in _SHARES:
        if helps(platform, share * low_N):
            return f"tension_min_N up to {share * low_N.min():.3g} is possible there"
    for times in _TIMES:
        if helps(replace(platform, mass_kg=times * mass_kg), low_N):
            return f"a platform of {times * mass_kg:.3g} kg and more is possible there"
    return "only a place further inside the exit points helps"


def _motors(robot: Robot, statics: PlanarStatics) -> Iterator[Finding]:
    limits, platform = limits_of(robot), statics.platform
    arm_m = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in robot.axes])
    allowed_Nm = np.broadcast_to(limits.torque_Nm, (3,))
    needed_Nm = statics.high_N * arm_m
    i = int((needed_Nm / allowed_Nm).argmax())
    if needed_Nm[i] > allowed_Nm[i]:
        text = (
            f"{statics.high_N[i]:g} N are {needed_Nm[i]:.3g} Nm at the motor of axes[{i}], whose "
            f"torque_Nm is {allowed_Nm[i]:g}; allowed: up to {allowed_Nm[i] / arm_m[i]:.0f} N, "
            "less friction"
        )
        yield Finding("limits.tension_max_N", text, impossible=True)
    rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in robot.axes])
    points = statics.box.grid(_GRID, _GRID)
    taken = points[statics.is_target(points)]
    held_N = statics.controlled.least_tensions_N(taken).max(axis=0, initial=0.0)
    i = int((held_N * arm_m / rated_Nm).argmax())
    if held_N[i] * arm_m[i] > rated_Nm[i]:
        text = (
            f"to stand somewhere in the box axes[{i}] needs {held_N[i] * arm_m[i]:.3g} Nm, its "
            f"motor is rated for {rated_Nm[i]:g} Nm; the drive will not bear it for long: a "
            "smaller box or a larger gear helps"
        )
        yield Finding("platform.workspace_max_m", text, impossible=False)
    # each direction has the speed of its own, so that both together are faster along a diagonal
    cable_m_s = math.sqrt(2.0) * platform.speed_m_s
    most_m_s = arm_m * np.broadcast_to(limits.speed_rad_s, (3,))
    i = int(most_m_s.argmin())
    if cable_m_s > most_m_s[i]:
        text = (
            f"value {platform.speed_m_s:g}; allowed: up to {most_m_s[i] / math.sqrt(2.0):.3g}, "
            f"where axes[{i}] reaches the limit of its speed"
        )
        yield Finding("platform.speed_m_s", text, impossible=True)


def _turning(statics: PlanarStatics) -> Iterator[Finding]:
    home = np.array(statics.platform.home_m)
    places = np.concatenate([home[None], statics.box.grid(_GRID, _GRID).reshape(-1, 2)])
    angle = np.where(statics.is_target(places), statics.angle_rad(places), 0.0)
    if np.isnan(angle).any():
        where = _point(places[int(np.isnan(angle).argmax())])
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
        where = _point(places[int(degrees.argmax())])
        text = (
            f"at {where} m the platform turns by {degrees.max():.0f} deg, which no cable can "
            "prevent; anchor points that lie towards their exit points let it turn less"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=False)


def _lengths(robot: Robot, statics: PlanarStatics) -> Iterator[Finding]:
    limits = limits_of(robot)
    lengths = statics.geometry.lengths(statics.box.grid(_GRID, _GRID))
    for key, needed, allowed, sign in (
        ("cable_length_min_m", lengths.min((0, 1)), limits.cable_length_min_m, 1.0),
        ("cable_length_max_m", lengths.max((0, 1)), limits.cable_length_max_m, -1.0),
    ):
        bound = np.broadcast_to(allowed, (3,))
        i = int((sign * (bound - needed)).argmax())
        if sign * (bound[i] - needed[i]) > 0.0:
            text = f"{bound[i]:g} m; in the box of targets axes[{i}] has {needed[i]:.3g} m of cable"
            yield Finding(f"limits.{key}", text, impossible=True)


def _point(position_m: FloatArray | tuple[float, float]) -> str:
    return f"({position_m[0]:.2f}, {position_m[1]:.2f})"
