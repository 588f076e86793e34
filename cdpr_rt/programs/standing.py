"""Checks, when cables have just become tight, whether a platform stands as `tighten` assumes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.model.rigid_body import G_m_s2
from cdpr_rt.model.standing_tensions import StandingTensions
from cdpr_rt.programs.platform_program import PlatformParts, distance_m
from cdpr_rt.refusal import CommandRefusal, RefusalCode

_TURNED_MORE_rad = math.radians(30.0)
"""Allowed rotation of a standing platform beyond the workspace angle."""
_MOST_LOOKS = 200
_CARRIED_SHARE = 0.8
"""Ratio of the sum of tensions to the weight below which the cables do not carry the platform."""
_FALLEN = (
    "the platform hung when the power went off, or when a drive or cable failed. "
    "It has come down, may have turned over, and cables may lie around it. Look at "
    "it. If it stands at home, upright, with all cables free: tighten from home"
)
_FALLEN_ELSEWHERE = "; if it stands like this elsewhere: from lengths"


def bad_source(asked: Mapping[str, Any], why: str, *allowed: str) -> CommandRefusal:
    """Return the refusal to use the source of cable lengths in `asked`."""
    arguments = {"why": why, "allowed": allowed}
    return CommandRefusal(RefusalCode.BAD_SOURCE, "tighten", asked, arguments)


def source_refusal(
    parts: PlatformParts, source: str, asked: Mapping[str, Any]
) -> CommandRefusal | None:
    """Return the refusal if lengths from this source cannot be used, else None.

    After a fall or a release of the platform the user must name the source (`asked`).
    """
    last = parts.last_stop
    if asked and parts.tight:
        return bad_source(asked, "the cables are already tight; lower the platform first")
    if last.fallen and not asked:
        elsewhere, allowed = (_FALLEN_ELSEWHERE, ("lengths",)) if parts.pose_known else ("", ())
        return bad_source(asked, _FALLEN + elsewhere, "home", *allowed)
    if source == "home" and last.displaced and not asked:
        why = "the platform was released elsewhere, and its place is not known; put it at home"
        return bad_source(asked, why, "home")
    if source == "lengths" and (last.contradicted or not parts.pose_known):
        why = last.contradicted or "the cables' lengths are not known"
        return bad_source(asked, why, "home")
    if source == "last" and last.lengths is None:
        return bad_source(asked, f"no lengths of the last stop: {last.why}")
    why = ""
    if source == "home" and parts.pose_known and not parts.tight and not last.contradicted:
        why = why_not_to_wind_in(parts, parts.estimator.estimate.cable_length_m)
    return bad_source(asked, why) if why else None


def why_not_to_wind_in(parts: PlatformParts, length_m: FloatArray) -> str:
    """Return the reason why slack must not be wound in at home, or "".

    Winding in may drag a platform that lies elsewhere. The platform is certainly not at home if
    cables of lengths `length_m` (n,) do not even reach home, within its tolerance and that of
    lengths. One cable may have slipped, as in `why_not_at_home`.
    """
    short_m = parts.control.lengths_at_home(np.zeros(length_m.size)) - length_m
    allowed_m = parts.platform.home_tolerance_m + parts.home_lengths_allowed_m
    many = np.count_nonzero(short_m > allowed_m)
    if many <= 1:
        return ""
    return _not_at_home(
        f"{many} cables are up to {1e3 * short_m.max():.0f} mm too short to reach it, "
        f"{1e3 * allowed_m:.0f} mm allowed"
    )


def why_not_at_home(
    parts: PlatformParts, length_m: FloatArray, tension_N: FloatArray, feedback: AxisFeedback
) -> str:
    """Return the reason why the cables must not be tightened at home, or "".

    The lengths `length_m` (n,) have been tracked since they were known. They have to be those at
    home with `tension_N` (n,), each within the tolerance of home and that of lengths. One length
    may be further off: its cable has slipped if the lengths disagree. If they agree, their pose has
    to be near home. No pose is searched far from home, because several poses may belong to the
    lengths.
    """
    control = parts.control
    off_m = np.abs(length_m - control.lengths_at_home(tension_N))
    allowed_m = parts.platform.home_tolerance_m + parts.home_lengths_allowed_m
    many = np.count_nonzero(off_m > allowed_m)
    if many > 1:
        return _not_at_home(
            f"the lengths of {many} cables are up to {1e3 * off_m.max():.0f} mm from those "
            "at home, "
            f"{1e3 * allowed_m:.0f} mm allowed"
        )
    control.take_lengths(length_m, feedback)
    control.begin(feedback, tension_N)
    here, home = control.estimated, parts.model.home
    near = distance_m(here, home, parts.scale_m) <= parts.platform.home_tolerance_m
    if near or disagreement(parts, "home"):
        return ""
    return _not_at_home(f"it is {_place(here, parts.model.positions)}")


def _not_at_home(why: str) -> str:
    return (
        f"the platform is not at home: by its cable lengths, {why}; put it at home, "
        "upright, with all cables free. If these lengths are wrong, end the daemon and "
        "start it again"
    )


def why_not_to_pull(
    parts: PlatformParts, length_m: FloatArray, tension_N: FloatArray, feedback: AxisFeedback
) -> str:
    """Return the reason why cables must not be tightened at the platform's present pose, or "".

    The pose is computed from the lengths `length_m` (n,) at `tension_N` (n,), which have to agree.
    The platform must not be turned much, and the straight line home must be free of contact.
    """
    control, k = parts.control, parts.model.positions
    control.take_lengths(length_m, feedback)
    control.begin(feedback, tension_N)
    if why := disagreement(parts):
        return why
    here, home = np.array(control.estimated), parts.model.home
    near = parts.model.contact_on_way(np.array([here, home]), _MOST_LOOKS)
    if not _turned_much(parts) and not near:
        return ""
    why = f"; on the way home from there, {near}" if near else ""
    return _not_pulled(here, k, why)


def would_move(parts: PlatformParts) -> str:
    """Return the message that tight cables would move the platform."""
    why = ", where tight cables would drag it"
    return _not_pulled(parts.control.estimated, parts.model.positions, why)


def hangs(parts: PlatformParts) -> bool:
    """Return whether the cables may carry the platform, at whatever pose."""
    carried_N = float(np.nansum(parts.estimator.estimate.tension_N))
    return carried_N > _CARRIED_SHARE * parts.platform.mass_kg * G_m_s2


def rests_at_home(parts: PlatformParts, length_m: FloatArray, feedback: AxisFeedback) -> bool:
    """Return whether a platform stands at home by its lengths (n,), not carried by the cables.

    After lowering, friction of the winches can leave tensions whose sum equals the weight, but
    which nearly cancel each other.
    """
    control, model = parts.control, parts.model
    control.take_lengths(length_m, feedback)
    control.begin(feedback)
    here = control.estimated
    if distance_m(here, model.home, parts.scale_m) > parts.platform.home_tolerance_m:
        return False
    pose, up = model.pose(here), model.positions - 1
    hanging, rise_N = model.kinematics.hanging(pose)
    tension_N = np.nan_to_num(parts.estimator.estimate.tension_N) - rise_N
    carried_N = (model.kinematics.wrench_matrix(pose) @ tension_N + hanging)[up]
    return bool(carried_N < _CARRIED_SHARE * parts.platform.mass_kg * G_m_s2)


def why_not_to_hold(
    parts: PlatformParts, standing: StandingTensions, length_m: FloatArray, feedback: AxisFeedback
) -> str:
    """Return the reason why a hanging platform must not be held at its pose, or "".

    The pose is computed from the lengths `length_m` (n,), which have to agree. The platform must
    not be turned much, and tensions within their bounds have to carry it at that pose.
    """
    control, model = parts.control, parts.model
    control.take_lengths(length_m, feedback)
    control.begin(feedback)
    why = _off(parts, parts.lengths_allowed_m)
    carried = standing.carry(model.pose(control.estimated))
    if not why and (_turned_much(parts) or not carried):
        place = _place(control.estimated, model.positions)
        why = f"by its cable lengths it is {place}, where its cables could not hold it"
    if not why:
        return ""
    return (
        f"the platform may hang on its cables, and {why}: each winch holds its cable; "
        "lower the platform, put it at home and tighten from home"
    )


def _turned_much(parts: PlatformParts) -> bool:
    turned_rad = float(np.linalg.norm(parts.control.estimated[parts.model.positions :]))
    return turned_rad > parts.model.angle_rad + _TURNED_MORE_rad


def _not_pulled(here: FloatArray, k: int, why: str) -> str:
    return (
        f"the platform is {_place(here, k)}{why}: the cables are not tightened; put it "
        "at home, upright, with all cables free, and tighten from home"
    )


def disagreement(parts: PlatformParts, source: str = "lengths") -> str:
    """Return a text that says by how much the control's lengths disagree, "" if not too much."""
    at_home = source == "home"
    off = _off(parts, parts.home_lengths_allowed_m if at_home else parts.lengths_allowed_m)
    if off and at_home:
        return f"{off}; the platform is not at home, or a point differs from the robot's file"
    return f"{off}; put the platform at home and tighten from home" if off else ""


def _off(parts: PlatformParts, allowed_m: float) -> str:
    off_m = parts.control.residual_m
    if off_m <= allowed_m:
        return ""
    return (
        f"the cables' lengths disagree by {1e3 * off_m:.0f} mm, {1e3 * allowed_m:.0f} mm allowed"
        f"{parts.suspects_text()}"
    )


def _place(here: FloatArray, k: int) -> str:
    place = "at " + ", ".join(f"{1e3 * x:.0f}" for x in here[:k]) + " mm"
    if here.size == k:
        return place
    return f"{place}, turned by {math.degrees(np.linalg.norm(here[k:])):.0f} deg"
