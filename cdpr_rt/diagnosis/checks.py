"""Check whether a cable robot can work as its file describes it, and say what to change if not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cdpr_profiles import ProfileError, Robot
from cdpr_profiles.motor_bounds import MOST_SPEED_RATIO
from cdpr_profiles.platform import DIRECTIONS, Platform
from cdpr_profiles.safety_io import load_safety_io
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.shared_block import MOST_AXES
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.diagnosis import turning_checks as turning
from cdpr_rt.diagnosis.loop_checks import loop_findings
from cdpr_rt.diagnosis.subject import Finding, Subject, point_text
from cdpr_rt.model.interference import in_words
from cdpr_rt.model.platform_model import PlatformModel, platform_model, platform_model_of
from cdpr_rt.model.standing_tensions import StandingTensions
from cdpr_rt.model.statics import NONE_rad, PlatformStatics
from cdpr_rt.platform.motor_learning import (
    COGGING_SHARE,
    FRICTION_SHARE,
    MOST_SHARE,
)

# Whether winches of a platform at home can pull more than their friction, and hold their cables.

_RUBS = 0.6
"""Share of the winches' largest friction that the pretension must exceed: 1.3 times the usual
friction of a winch without load."""
_RUBS_LITTLE = 0.5
"""Ratio of the friction of some winches to the usual friction."""
_TIMES = 1.1 ** np.arange(1, 15)
"""Factors with which higher tensions and torques are tried."""


def stand_findings(s: Subject) -> Iterator[Finding]:
    """Check whether `tighten` can pull each cable on the stand by more than winch friction."""
    taken_up_N = (MOST_SHARE + COGGING_SHARE) * s.rated_Nm / s.arm_m
    needed_N = _RUBS * taken_up_N

    def pretension_N(model: PlatformModel, torque_Nm: FloatArray) -> FloatArray:
        planned_N = model.low_N + model.reserve_N
        standing = StandingTensions(model, planned_N, torque_Nm / s.arm_m, taken_up_N)
        return standing.at(model.home_pose)[0]

    pulled_N = pretension_N(s.model, s.torque_Nm)
    weak = pulled_N < needed_N
    if not weak.any():
        return
    i = int((pulled_N / needed_N).argmin())
    names = ", ".join(s.axes[j].name for j in np.flatnonzero(weak))
    text = (
        f"value {s.model.high_N[i]:g}; the platform on its stand withstands a pull of only "
        f"{pulled_N[i]:.2g} N by {names}, but the friction of such winches is usually up to "
        f"{needed_N[i]:.2g} N: tighten may fail because cables stay slack"
    )
    remedy = "winches with less friction, or a home where cables pull less against each other, help"
    for times in _TIMES:
        high_N, torque_Nm = times * np.asarray(s.limits.tension_max_N), times * s.torque_Nm
        higher = replace(s.limits, tension_max_N=high_N, torque_Nm=torque_Nm)
        if (pretension_N(platform_model_of(s.robot, higher), torque_Nm) >= needed_N).all():
            most_Nm = float(np.max(high_N * s.arm_m))
            remedy = (
                f"use {np.max(high_N):.0f} or more, which is {most_Nm:.2g} Nm at the motor; or "
            )
            remedy += "winches with less friction"
            break
    yield Finding("limits.tension_max_N", f"{text}; {remedy}", impossible=False)


def unwinding(s: Subject) -> Iterator[Finding]:
    """Check whether slack cables may unwind their drums by their weight while power is off.

    A slack cable pulls at its exit with the weight of a piece as long as the exit's height above
    the anchor.
    """
    hangs_N = 2.0 * np.maximum(s.statics.rises_N(np.array(s.platform.home_m)), 0.0)
    rubs_N = _RUBS_LITTLE * FRICTION_SHARE * s.rated_N
    unwinds = (hangs_N > rubs_N) & ~_braked(s.robot)
    if not unwinds.any():
        return
    i = int(np.where(unwinds, hangs_N / rubs_N, 0.0).argmax())
    names = ", ".join(s.axes[j].name for j in np.flatnonzero(unwinds))
    text = (
        f"without power the weight of a slack cable, up to {hangs_N[i]:.2g} N, may "
        f"unwind the drums of {names}, whose friction may be only {rubs_N[i]:.2g} N; a "
        "brake for each (safety_io) prevents this"
    )
    yield Finding(f"axes[{i}].winch", text, impossible=False)


def _braked(robot: Robot) -> BoolArray:
    """Return which axes have a brake on the safety I/O, (n,)."""
    points = () if robot.safety_io is None else load_safety_io(robot.safety_io).axes
    nodes = {point.node_id for point in points if point.brake is not None}
    return np.array([axis.node_id in nodes for axis in robot.axes])


_GRID = 25
LONGEST_PERIOD_s = 0.005
"""Longest cycle at which the platform's control is stiff enough to overcome friction."""
_NEAREST_m = 0.1
"""The cable might pull an anchor point into an exit point that is closer than this."""
_ALIKE_m = 0.01
"""Two cables closer than this at both ends act as one: an axis was described twice."""
_SAGS_m_N = 0.01
"""Largest allowed change of length by sag per newton; a motor's friction is some newtons."""
_ROUNDED_UP = 1.05
"""Factor with which a value is still sufficient after rounding to two digits."""
_FRICTION_SHARE = 0.06
"""Largest sum of friction and cogging of a servo winch, as a share of the motor's rated torque."""
_WIDE_ARMS = 0.5
"""Anchor points further apart than this share of the exit points are probably not in metres."""


def diagnose(robot: Robot, limits: Limits | None = None) -> list[Finding]:
    """Return impossible or doubtful properties of a robot's platform, the worst first.

    `limits` defaults to those of the robot's file.
    """
    if robot.platform is None:
        return []
    s = Subject(robot, limits)
    statics = s.statics
    found = [*_cycle(robot), *_shape(s)]
    if not any(finding.impossible for finding in found):
        # implausible points also cause the faults of tensions and torques
        found += [*_tensions(statics), *_motors(s), *_cable_speeds(s), *_lengths(s), *_sagging(s)]
        if statics.turns_freely:
            found += turning.free_rotation(statics)
        turned = list(turning.angles(statics))
        if not turned:
            # the loop's design includes such turned poses, and its failure would only repeat this
            # finding
            found += loop_findings(s)
        found += [
            *turned,
            *turning.uncontrolled_rotation(statics, s.limits.lengths_disagree_m),
            *turning.stand_clearance(statics),
            *_contact(statics),
            *turning.upright(statics),
            *_friction(s),
            *stand_findings(s),
            *unwinding(s),
        ]
    return sorted(found, key=lambda finding: not finding.impossible)


def refuse_impossible(robot: Robot, limits: Limits | None = None) -> list[str]:
    """Return doubtful properties of a robot within `limits`, as `diagnose` does, a line each.

    Raises ProfileError if the robot is impossible: a line for each key, with the change to make.
    """
    found = diagnose(robot, limits)
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
            f"value {robot.sync_period_s:g}; allowed: up to {LONGEST_PERIOD_s:g} for a "
            "platform, because its control would be too soft to overcome the friction of "
            "the winches"
        )
        yield Finding("sync_period_s", text, impossible=True)


def _shape(s: Subject) -> Iterator[Finding]:
    statics, a, b, n = s.statics, s.statics.exits_m, s.statics.anchors_m, s.n
    apart = [(i, j, float(np.linalg.norm(a[i] - a[j]))) for i in range(n) for j in range(i)]
    for i, j, distance in apart:
        if max(distance, float(np.linalg.norm(b[i] - b[j]))) < _ALIKE_m:
            text = f"{distance:.3g} m from that of axes[{j}], and so are their anchor points; "
            text += "allowed: one cable at each place"
            yield Finding(f"axes[{i}].exit_point_m", text, impossible=True)
    span = max(distance for _, _, distance in apart)
    if span < _NEAREST_m:
        text = f"exit points are up to {span:.3g} m apart; allowed: {_NEAREST_m:g} m or more"
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
        (box, "workspace_min_m", "the box of targets reaches"),
        (home, "home_m", "the platform at rest reaches"),
    ):
        free_m = statics.free_lengths(points).reshape(-1, n)
        for i, nearest in enumerate(free_m.min(axis=0)):
            if nearest < _NEAREST_m:
                text = (
                    f"{what} up to {nearest:.2g} m from the exit point of "
                    f"axes[{i}] ({s.axes[i].name}); allowed: {_NEAREST_m:g} m or more"
                )
                yield Finding(f"platform.{key}", text, impossible=True)


def _tensions(statics: PlatformStatics) -> Iterator[Finding]:
    platform = statics.platform
    home = np.array(platform.home_m)
    way = np.linspace(home, np.clip(home, statics.box.low_m, statics.box.high_m), _GRID)
    for place, where in ((home[None], ""), (way, "on the way to the box of targets, ")):
        missing = ~statics.is_target(place)
        if missing.any():
            why, helps = why_not_held(statics, place[missing.argmax()], NONE_rad)
            yield Finding("platform.home_m", where + why, impossible=True, helps=helps)
            break
    points, turns = statics.points(), statics.orientations
    moving_N = np.array([statics.margin_N(points, platform.acceleration_m_s2, t) for t in turns])
    taken = float(np.mean(moving_N >= statics.model.reserve_N))
    if taken < 1.0:
        # do not round 99.9 % up to all
        text = f"targets are accepted in {math.floor(100 * taken)} % of the box; "
        if (smaller := statics.largest_box(statics.box)) is not None:
            low, high = point_text(smaller.low_m), point_text(smaller.high_m)
            text += f"they would be in all of {low} to {high} m; "
        worst = np.unravel_index(moving_N.argmin(), moving_N.shape)
        why, helps = why_not_held(statics, points[worst[1:]], turns[worst[0]])
        text += f"at the worst place, {why}"
        yield Finding("platform.workspace_min_m", text, taken == 0.0, helps)


def standing_tensions_N(statics: PlatformStatics) -> FloatArray:
    """Return the largest tensions (n,) at the winches, N, at rest anywhere in its box."""
    points = statics.points()
    taken = points[statics.is_target(points)]
    held_N = statics.least_tensions_N(taken, reserve_N=statics.model.reserve_N)
    held_N += statics.rises_N(taken)
    return np.asarray(held_N.max(axis=0, initial=0.0))


def _motors(s: Subject) -> Iterator[Finding]:
    arm_m, allowed_Nm, rated_Nm, high_N = s.arm_m, s.torque_Nm, s.rated_Nm, s.model.high_N
    needed_Nm = high_N * arm_m
    i = int((needed_Nm / allowed_Nm).argmax())
    if needed_Nm[i] > allowed_Nm[i]:
        text = (
            f"{high_N[i]:g} N are {needed_Nm[i]:.3g} Nm at the motor of axes[{i}], whose "
            f"torque_Nm is {allowed_Nm[i]:g}; allowed: up to {allowed_Nm[i] / arm_m[i]:.0f} N, "
            "less friction"
        )
        yield Finding("limits.tension_max_N", text, impossible=True)
    held_N = standing_tensions_N(s.statics)
    i = int((held_N * arm_m / rated_Nm).argmax())
    if held_N[i] * arm_m[i] > rated_Nm[i]:
        text = (
            f"to hold the platform at some places of the box, axes[{i}] needs "
            f"{held_N[i] * arm_m[i]:.3g} Nm, but its motor is rated for {rated_Nm[i]:g} Nm and "
            "cannot sustain this: a smaller box or a larger gear ratio helps"
        )
        yield Finding("platform.workspace_max_m", text, impossible=False)


def _cable_speeds(s: Subject) -> Iterator[Finding]:
    platform, arm_m = s.platform, s.arm_m
    # each direction has its own speed limit, so the diagonal of all directions is faster
    cable_m_s = math.sqrt(len(platform.home_m)) * platform.speed_m_s
    turning = ""
    if platform.workspace_angle_rad > 0.0:
        reach_m = float(np.linalg.norm(s.statics.anchors_m, axis=1).max())
        angles = len(platform.controlled) - len(platform.home_m)
        cable_m_s += math.sqrt(angles) * platform.angular_speed_rad_s * reach_m
        turning = " and about"
    i = int((arm_m * s.speed_rad_s).argmin())
    share = float(arm_m[i] * s.speed_rad_s[i]) / cable_m_s
    if share < 1.0:
        text = (
            f"value {platform.speed_m_s:g}; in a move along{turning} all directions, cables run at "
            f"up to {cable_m_s:.3g} m/s, but the speed limit of axes[{i}] allows only "
            f"{share * cable_m_s:.3g} m/s; allowed: up to "
            f"{rounded_down(share * platform.speed_m_s)}"
        )
        if turning:
            angular = rounded_down(share * platform.angular_speed_rad_s)
            text += f" with angular_speed_rad_s up to {angular}"
        needed = cable_m_s / arm_m[i]
        if needed <= MOST_SPEED_RATIO * s.axes[i].winch.motor.rated_speed_rad_s:
            text += f", or limits.speed_rad_s from {math.ceil(needed)}"
        yield Finding("platform.speed_m_s", text, impossible=True)


def _friction(s: Subject) -> Iterator[Finding]:
    kept_N, rated_N = s.model.reserve_N, float(s.rated_N.max())
    if 0.0 < kept_N < _FRICTION_SHARE * rated_N:
        text = (
            f"tensions keep {kept_N:.2g} N from their bounds for the control, but friction "
            f"and cogging of such winches may need {_FRICTION_SHARE * rated_N:.2g} N: the "
            "platform sticks and overshoots its targets; smaller winches, or a mass that "
            "brings tensions to the middle of their bounds, help"
        )
        yield Finding("platform.mass_kg", text, impossible=False)


def _lengths(s: Subject) -> Iterator[Finding]:
    limits, lengths = s.limits, s.statics.lengths(s.statics.points()).reshape(-1, s.n)
    for key, needed, allowed, sign in (
        ("cable_length_min_m", lengths.min(axis=0), limits.cable_length_min_m, 1.0),
        ("cable_length_max_m", lengths.max(axis=0), limits.cable_length_max_m, -1.0),
    ):
        bound = np.broadcast_to(allowed, (s.n,))
        i = int((sign * (bound - needed)).argmax())
        if sign * (bound[i] - needed[i]) > 0.0:
            text = f"{bound[i]:g} m; in the box of targets axes[{i}] has {needed[i]:.3g} m of cable"
            yield Finding(f"limits.{key}", text, impossible=True)


def _sagging(s: Subject) -> Iterator[Finding]:
    """Check the slope of w² a² L/(24 T²), by which sag lengthens a cable of span a."""
    statics, points = s.statics, s.statics.points()
    spans = (statics.exits_m - points[..., None, :] - statics.anchors_m)[..., :-1]
    square_m3 = (spans**2).sum(axis=-1) * statics.free_lengths(points)
    weights = np.array([axis.winch.cable.weight_per_length_N_m for axis in s.axes])
    moment = weights**2 * square_m3.reshape(-1, s.n).max(axis=0) / 12.0
    # with the least planned tension
    m_per_N = moment / (statics.low_N + statics.model.reserve_N) ** 3
    i = int(m_per_N.argmax())
    if m_per_N[i] > _SAGS_m_N:
        enough_N = _ROUNDED_UP * math.cbrt(moment[i] / _SAGS_m_N)
        text = (
            f"value {statics.low_N[i]:g}; at the lowest planned tension the cable of "
            f"axes[{i}] sags so much that one more newton shortens it by {m_per_N[i]:.2g} "
            f"m, and lengths do not determine the position well; use {enough_N:.2g} or more"
        )
        yield Finding("limits.tension_min_N", text, impossible=False)


def _contact(statics: PlatformStatics) -> Iterator[Finding]:
    """Check where in the box of targets cables, platform or obstacles touch, at home's orientation.

    The file is impossible if they touch everywhere in some orientation.
    """
    points, interference = statics.points(), statics.model.interference
    clearances_m, pairs = interference.clearances(statics.poses(points))
    touching, i = clearances_m < interference.clearance_m, int(clearances_m.argmin())
    if not touching.any():
        return
    things = in_words(interference.things(int(pairs[i])), float(clearances_m[i]))
    share = math.floor(100 * touching.mean()) or "less than 1"
    text = (
        f"value {interference.clearance_m:g}; in {share} % of the box, at home's "
        "orientation, parts are nearer, so moves there are rejected: at "
        f"{point_text(points.reshape(-1, points.shape[-1])[i])} m {things}"
    )
    everywhere = bool(touching.all()) and all(
        (interference.clearances(statics.poses(points, turn))[0] < interference.clearance_m).all()
        for turn in statics.orientations
    )
    yield Finding("platform.clearance_m", text, impossible=everywhere)


def rounded_down(value: float) -> str:
    """Return a value as text, rounded down to three digits."""
    digits = 2 - math.floor(math.log10(value))
    return f"{math.floor(value * 10.0**digits) / 10.0**digits:g}"


# Why a pose is not feasible, and which value of the robot's file would make it feasible.

_FLAT = 1e-3
"""Largest distance at which points count as in a line or plane, as a share of their span."""
_FACTORS = np.concatenate([np.linspace(0.99, 0.03, 97), np.geomspace(0.0295, 1e-5, 120)])
"""Decreasing factors on a value, tried in turn until one helps."""
_MORE = np.geomspace(1.02, 100.0, 230)
"""Increasing factors on a value, tried in turn until one helps."""


def why_not_held(
    statics: PlatformStatics, position_m: FloatArray, turn_rad: FloatArray
) -> tuple[str, str]:
    """Return why a position (k,) with a rotation (3,) is not feasible, and what would help.

    The result is a text, and the key of the value that would help, "" if this is the position.
    """
    where = f"at {point_text(position_m)} m"
    reserve = float(statics.margin_N(position_m, 0.0, turn_rad))
    if turn_rad.any():
        where += f", turned by {_turn(turn_rad, position_m.size)}"
    if not math.isfinite(reserve):
        return f"{where} {_singular(statics)}", "axes[0].anchor_point_m"
    needed = ", ".join(str(round(value)) for value in statics.tensions_N(position_m, turn_rad))
    allowed = f"{statics.low_N.min():g} to {statics.model.torque_limited_N.max():.4g} N are allowed"
    if reserve < 0.0:
        text = f"{where} the cables would need {needed} N; {allowed}"
    else:
        text = (
            f"{where} the cables have {needed} N; {allowed}, which leaves too little "
            "reserve for motion"
        )
    helps, key = _what_helps(statics, position_m, turn_rad)
    return f"{text}; {helps}", key


def _singular(statics: PlatformStatics) -> str:
    """Return a text that says which direction cables cannot hold, and which points cause it."""
    text = "the cables cannot hold one direction with any tensions"
    for name, points in (("exit points", statics.exits_m), ("anchor points", statics.anchors_m)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        dimensions = int(np.sum(spread > _FLAT * max(float(spread[0]), _FLAT)))
        if dimensions == 1:
            left_out = _free_axis(statics) if points is statics.anchors_m else ""
            return f"{text}: all {name} lie in one line{left_out}"
        in_plane = dimensions == 2 and len(spread) == 3
        if in_plane and points is statics.exits_m and _is_upright(points):
            return f"{text}: all {name} lie in one vertical plane"
    return f"{text}: anchor points elsewhere on the platform help"


def _free_axis(statics: PlatformStatics) -> str:
    """Return the axis to leave uncontrolled if anchor points in space lie in a line along it."""
    along = np.abs(np.linalg.svd(statics.anchors_m - statics.anchors_m.mean(axis=0))[2][0])
    if len(along) < 3 or along.max() < 1.0 - _FLAT:
        return ""
    return f"; allowed: platform.controlled without {DIRECTIONS[3][3 + int(along.argmax())]}"


def _is_upright(points: FloatArray) -> bool:
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
    return abs(float(normal[2])) < _FLAT


def _what_helps(
    statics: PlatformStatics, position_m: FloatArray, turn_rad: FloatArray
) -> tuple[str, str]:
    """Return how much one value of the robot's file must change for a target there, and its key."""
    platform, low_N = statics.platform, statics.low_N
    acceleration, mass_kg = platform.acceleration_m_s2, platform.mass_kg

    def helps(platform: Platform, low_N: FloatArray) -> bool:
        bounds = (low_N, statics.high_N, statics.model.torque_limited_N)
        changed = PlatformStatics(platform_model(platform, *bounds))
        return bool(changed.is_target(position_m, turn_rad))

    for share in _FACTORS if turn_rad.any() else ():
        if bool(statics.is_target(position_m, share * turn_rad)):
            angle = share * platform.workspace_angle_rad
            text = f"workspace_angle_rad up to {angle:.3g} is possible there"
            return text, "platform.workspace_angle_rad"
    slowest = replace(platform, acceleration_m_s2=_FACTORS[-1] * acceleration)
    for share in _FACTORS if helps(slowest, low_N) else ():
        if helps(replace(platform, acceleration_m_s2=share * acceleration), low_N):
            text = f"acceleration_m_s2 up to {share * acceleration:.3g} is possible there"
            return text, "platform.acceleration_m_s2"
    for share in _FACTORS:
        if helps(replace(platform, mass_kg=share * mass_kg), low_N):
            text = f"a platform of up to {share * mass_kg:.3g} kg is possible there"
            return text, "platform.mass_kg"
    loose = next((share for share in _FACTORS if helps(platform, share * low_N)), None)
    heavier = (replace(platform, mass_kg=times * mass_kg) for times in _MORE)
    heavy = next((changed.mass_kg for changed in heavier if helps(changed, low_N)), None)
    if heavy is not None:
        text = f"a platform of {heavy:.3g} kg or more is possible there"
        if loose is not None:
            text += (
                f", or tension_min_N up to {loose * low_N.min():.3g} with correspondingly small "
                "winches"
            )
        return text, "platform.mass_kg"
    if loose is not None:
        text = f"tension_min_N up to {loose * low_N.min():.3g} is possible there"
        return text, "limits.tension_min_N"
    turned = len(platform.controlled) > len(platform.home_m)
    others = (
        ", or other anchor points, whose cables can turn the platform both ways about each axis"
    )
    return f"only a place farther inside the exit points helps{others if turned else ''}", ""


def _turn(turn_rad: FloatArray, coordinates: int) -> str:
    if coordinates == 2:
        return f"{math.degrees(turn_rad[2]):.0f} deg"
    angle = float(np.linalg.norm(turn_rad))
    # + 0: show a rounded -0 as 0
    axis = ", ".join(f"{value:.2g}" for value in np.round(turn_rad / angle, 2) + 0.0)
    return f"{math.degrees(angle):.0f} deg about ({axis})"
