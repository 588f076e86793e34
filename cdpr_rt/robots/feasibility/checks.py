"""Whether a cable robot can work as its file describes it, and what to change where it cannot."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cdpr_profiles import ProfileError, Robot
from cdpr_profiles.limits.motor_bounds import MOST_SPEED_RATIO
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.shared_block import MOST_AXES
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.robots.feasibility import turning_checks as turning
from cdpr_rt.robots.feasibility.finding import Finding, rounded_down
from cdpr_rt.robots.feasibility.loop_checks import loop_findings
from cdpr_rt.robots.feasibility.not_held import point_text, why_not_held
from cdpr_rt.robots.feasibility.stand_checks import stand_findings, unwinding
from cdpr_rt.robots.feasibility.uncontrolled_rotation import uncontrolled_rotation
from cdpr_rt.robots.interference.interference import in_words
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_rt.robots.statics import NONE_rad, PlatformStatics, statics_of

_GRID = 25
LONGEST_PERIOD_s = 0.005
"""Longest cycle at which the platform's control is stiff enough to overcome friction."""
_NEAREST_m = 0.1
"""An anchor point closer than this to an exit point is about to be pulled into it."""
_ALIKE_m = 0.01
"""Two cables nearer to each other at both their ends pull alike: an axis was described twice."""
_SAGS_m_N = 0.01
"""Largest change of length by sag for a newton: a motor's friction is some newtons."""
_ROUNDED_UP = 1.05
"""So that two digits are not less."""
_FRICTION_SHARE = 0.06
"""Friction and cogging of a servo winch together over the motor's rated torque, at most."""
_WIDE_ARMS = 0.5
"""Anchor points further apart than this share of the exit points are probably not in metres."""


def findings(robot: Robot, limits: Limits | None = None) -> list[Finding]:
    """Return what is impossible or doubtful about a robot's platform, the worst first.

    Its `limits` are those of its file if left out.
    """
    if robot.platform is None:
        return []
    limits = limits or limits_of(robot)
    statics = statics_of(robot, limits)
    found = [*_cycle(robot), *_shape(robot, statics)]
    if not any(finding.impossible for finding in found):
        # with points that cannot be meant, tensions and torques only repeat it
        found += [*_tensions(statics), *_motors(robot, limits, statics)]
        found += [*_cable_speeds(robot, limits, statics), *_lengths(robot, limits, statics)]
        found += _sagging(robot, statics)
        if statics.turns_freely:
            found += turning.free_rotation(statics)
        turned = list(turning.angles(statics))
        if not turned:
            # a loop is designed turned so far as well: that none holds it there says nothing more
            found += loop_findings(robot, statics)
        found += [
            *turned,
            *uncontrolled_rotation(statics, limits.lengths_disagree_m),
            *turning.stand_clearance(statics),
        ]
        found += [*_contact(statics), *turning.upright(statics)]
        found += [*_friction(robot, statics), *stand_findings(robot, limits, statics)]
        found += unwinding(robot, statics)
    return sorted(found, key=lambda finding: not finding.impossible)


def refuse_impossible(robot: Robot, limits: Limits | None = None) -> list[str]:
    """Return what is doubtful about a robot within `limits`, as `findings`, a line each.

    Raises ProfileError where it is impossible: a line for each key, with what to change.
    """
    found = findings(robot, limits)
    wrong = [finding for finding in found if finding.impossible]
    if wrong:
        further = "".join(f"\n{robot.path}: {f.key}: {f.text}" for f in wrong[1:])
        raise ProfileError(robot.path, wrong[0].key, wrong[0].text + further)
    return [f"{robot.path}: {finding.key}: {finding.text}" for finding in found]


def _cycle(robot: Robot) -> Iterator[Finding]:
    if len(robot.axes) > MOST_AXES:
        text = f"{len(robot.axes)}; allowed: up to {MOST_AXES}, as many as a daemon runs"
        yield Finding("axes", text, impossible=True)
    if robot.sync_period_s > LONGEST_PERIOD_s:
        text = (
            f"value {robot.sync_period_s:g}; allowed: up to {LONGEST_PERIOD_s:g} for a platform, "
            "whose control would be too soft to overcome its winches' friction"
        )
        yield Finding("sync_period_s", text, impossible=True)


def _shape(robot: Robot, statics: PlatformStatics) -> Iterator[Finding]:
    a, b, n = statics.exits_m, statics.anchors_m, len(robot.axes)
    apart = [(i, j, float(np.linalg.norm(a[i] - a[j]))) for i in range(n) for j in range(i)]
    for i, j, distance in apart:
        if max(distance, float(np.linalg.norm(b[i] - b[j]))) < _ALIKE_m:
            text = f"{distance:.3g} m from that of axes[{j}], and so are their anchor points; "
            text += "allowed: one cable in one place"
            yield Finding(f"axes[{i}].exit_point_m", text, impossible=True)
    span = max(distance for _, _, distance in apart)
    if span < _NEAREST_m:
        text = f"exit points are up to {span:.3g} m apart; allowed: {_NEAREST_m:g} m and more"
        yield Finding("axes[0].exit_point_m", text, impossible=True)
        return
    wide = max(float(np.linalg.norm(b[i] - b[j])) for i in range(n) for j in range(i))
    if wide > _WIDE_ARMS * span:
        text = (
            f"anchor points are up to {wide:.4g} m apart, exit points {span:.4g} m; allowed: half "
            "of that (is one of them in millimetres?)"
        )
        yield Finding("axes[0].anchor_point_m", text, impossible=True)
        return
    box, home = statics.points(), np.array(statics.platform.home_m)
    for points, key, what in (
        (box, "workspace_min_m", "the box of targets goes"),
        (home, "home_m", "the platform at rest comes"),
    ):
        free_m = statics.free_lengths(points).reshape(-1, n)
        for i, nearest in enumerate(free_m.min(axis=0)):
            if nearest < _NEAREST_m:
                text = (
                    f"{what} up to {nearest:.2g} m from the exit point of "
                    f"axes[{i}] ({robot.axes[i].name}); allowed: {_NEAREST_m:g} m and more"
                )
                yield Finding(f"platform.{key}", text, impossible=True)


def _tensions(statics: PlatformStatics) -> Iterator[Finding]:
    platform = statics.platform
    home = np.array(platform.home_m)
    way = np.linspace(home, np.clip(home, statics.box.low_m, statics.box.high_m), _GRID)
    for place, where in ((home[None], ""), (way, "on the way to the box of targets, ")):
        missing = ~statics.is_target(place)
        if missing.any():
            text = where + why_not_held(statics, place[missing.argmax()], NONE_rad)
            yield Finding("platform.home_m", text, impossible=True)
            break
    points, turns = statics.points(), statics.orientations
    moving_N = np.array([statics.margin_N(points, platform.acceleration_m_s2, t) for t in turns])
    taken = float(np.mean(moving_N >= statics.model.reserve_N))
    if taken < 1.0:
        # 99.9 % is not all
        text = f"in {math.floor(100 * taken)} % of the box targets are taken; "
        if (smaller := statics.largest_box(statics.box)) is not None:
            low, high = point_text(smaller.low_m), point_text(smaller.high_m)
            text += f"in all of {low} to {high} m they would be; "
        worst = np.unravel_index(moving_N.argmin(), moving_N.shape)
        text += why_not_held(statics, points[worst[1:]], turns[worst[0]])
        yield Finding("platform.workspace_min_m", text, impossible=taken == 0.0)


def standing_tensions_N(statics: PlatformStatics) -> FloatArray:
    """Return the greatest tensions (n,) at winches, N, with which it stands in its box."""
    points = statics.points()
    taken = points[statics.is_target(points)]
    held_N = statics.least_tensions_N(taken, reserve_N=statics.model.reserve_N)
    held_N += statics.rises_N(taken)
    return np.asarray(held_N.max(axis=0, initial=0.0))


def _motors(robot: Robot, limits: Limits, statics: PlatformStatics) -> Iterator[Finding]:
    arm_m = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in robot.axes])
    allowed_Nm = np.broadcast_to(limits.torque_Nm, arm_m.shape)
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
    held_N = standing_tensions_N(statics)
    i = int((held_N * arm_m / rated_Nm).argmax())
    if held_N[i] * arm_m[i] > rated_Nm[i]:
        text = (
            f"to stand somewhere in the box axes[{i}] needs {held_N[i] * arm_m[i]:.3g} Nm, its "
            f"motor is rated for {rated_Nm[i]:g} Nm; the drive will not bear it for long: a "
            "smaller box or a larger gear helps"
        )
        yield Finding("platform.workspace_max_m", text, impossible=False)


def _cable_speeds(robot: Robot, limits: Limits, statics: PlatformStatics) -> Iterator[Finding]:
    platform, winches = statics.platform, [axis.winch for axis in robot.axes]
    arm_m = np.array([abs(winch.cable_m_per_motor_rad) for winch in winches])
    # each direction has the speed of its own, so that all together are faster along a diagonal
    cable_m_s = math.sqrt(len(platform.home_m)) * platform.speed_m_s
    turning = ""
    if platform.workspace_angle_rad > 0.0:
        reach_m = float(np.linalg.norm(statics.anchors_m, axis=1).max())
        angles = len(platform.controlled) - len(platform.home_m)
        cable_m_s += math.sqrt(angles) * platform.angular_speed_rad_s * reach_m
        turning = " and about"
    most_rad_s = np.broadcast_to(limits.speed_rad_s, arm_m.shape)
    i = int((arm_m * most_rad_s).argmin())
    share = float(arm_m[i] * most_rad_s[i]) / cable_m_s
    if share < 1.0:
        text = (
            f"value {platform.speed_m_s:g}; along{turning} all directions at once cables run at "
            f"up to {cable_m_s:.3g} m/s, axes[{i}] at {share * cable_m_s:.3g} m/s by its limit of "
            f"speed; allowed: up to {rounded_down(share * platform.speed_m_s)}"
        )
        if turning:
            angular = rounded_down(share * platform.angular_speed_rad_s)
            text += f" with angular_speed_rad_s up to {angular}"
        needed = cable_m_s / arm_m[i]
        if needed <= MOST_SPEED_RATIO * winches[i].motor.rated_speed_rad_s:
            text += f", or limits.speed_rad_s from {math.ceil(needed)}"
        yield Finding("platform.speed_m_s", text, impossible=True)


def _friction(robot: Robot, statics: PlatformStatics) -> Iterator[Finding]:
    winches, kept_N = [axis.winch for axis in robot.axes], statics.model.reserve_N
    rated_N = max(w.motor.rated_torque_Nm / abs(w.cable_m_per_motor_rad) for w in winches)
    if 0.0 < kept_N < _FRICTION_SHARE * rated_N:
        text = (
            f"tensions keep {kept_N:.2g} N from their bounds for the control, friction and cogging "
            f"of such winches may take up {_FRICTION_SHARE * rated_N:.2g} N: it sticks, and runs "
            "over its targets; smaller winches, or a mass for tensions mid of their bounds, help"
        )
        yield Finding("platform.mass_kg", text, impossible=False)


def _lengths(robot: Robot, limits: Limits, statics: PlatformStatics) -> Iterator[Finding]:
    lengths = statics.lengths(statics.points()).reshape(-1, len(robot.axes))
    for key, needed, allowed, sign in (
        ("cable_length_min_m", lengths.min(axis=0), limits.cable_length_min_m, 1.0),
        ("cable_length_max_m", lengths.max(axis=0), limits.cable_length_max_m, -1.0),
    ):
        bound = np.broadcast_to(allowed, (len(robot.axes),))
        i = int((sign * (bound - needed)).argmax())
        if sign * (bound[i] - needed[i]) > 0.0:
            text = f"{bound[i]:g} m; in the box of targets axes[{i}] has {needed[i]:.3g} m of cable"
            yield Finding(f"limits.{key}", text, impossible=True)


def _sagging(robot: Robot, statics: PlatformStatics) -> Iterator[Finding]:
    """Look at the slope of w² a² L/(24 T²), by which sag lengthens a cable of span a."""
    points = statics.points()
    spans = (statics.exits_m - points[..., None, :] - statics.anchors_m)[..., :-1]
    square_m3 = (spans**2).sum(axis=-1) * statics.free_lengths(points)
    weights = np.array([axis.winch.cable.weight_per_length_N_m for axis in robot.axes])
    moment = weights**2 * square_m3.reshape(-1, len(robot.axes)).max(axis=0) / 12.0
    # with the least that is planned
    m_per_N = moment / (statics.low_N + statics.model.reserve_N) ** 3
    i = int(m_per_N.argmax())
    if m_per_N[i] > _SAGS_m_N:
        enough_N = _ROUNDED_UP * math.cbrt(moment[i] / _SAGS_m_N)
        text = (
            f"value {statics.low_N[i]:g}; with the least tension that is planned the cable of "
            f"axes[{i}] sags so much that a newton more takes {m_per_N[i]:.2g} m of it in, and "
            f"lengths tell little of where the platform is; enough: {enough_N:.2g}"
        )
        yield Finding("limits.tension_min_N", text, impossible=False)


def _contact(statics: PlatformStatics) -> Iterator[Finding]:
    """Look where in its box cables, platform or obstacles touch, at home's orientation.

    Impossible is what touches everywhere, whichever way it is turned.
    """
    points, interference = statics.points(), statics.model.interference
    clearances_m, pairs = interference.clearances(statics.poses(points))
    touching, i = clearances_m < interference.clearance_m, int(clearances_m.argmin())
    if not touching.any():
        return
    things = in_words(interference.things(int(pairs[i])), float(clearances_m[i]))
    share = math.floor(100 * touching.mean()) or "less than 1"
    text = (
        f"value {interference.clearance_m:g}; in {share} % of the box, turned as at home, "
        "something is nearer, and no move goes there: at "
        f"{point_text(points.reshape(-1, points.shape[-1])[i])} m {things}"
    )
    everywhere = bool(touching.all()) and all(
        (interference.clearances(statics.poses(points, turn))[0] < interference.clearance_m).all()
        for turn in statics.orientations
    )
    yield Finding("platform.clearance_m", text, impossible=everywhere)
