"""Motions between the poses of a calibration: speed, time allowed, and how they ended."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import TripError
from cdpr_rt.procedures.calibration.measure_poses import NotThePoseError, TargetNotReached
from cdpr_rt.runtime.control_loop.stop_requests import EMERGENCY_STOP
from cdpr_tools.trials.directions import Directions

_SLOWED: Final = 1.5
_LATE_S: Final = 10.0
"""A motion may take so many times as long as planned, and that much longer."""
_SPEED_SHARE: Final = 0.5
"""Of the speed of the robot's file: a robot that is not calibrated yet is not hurried."""
_NO_POSE_MAKES: Final = frozenset(
    limit.key
    for limit in (
        Limit.SAFETY_STOP, Limit.SAFETY_ALARM, Limit.STALE, Limit.MISSED, Limit.MISSED_IN_WINDOW,
        Limit.LATE,
    )
)  # fmt: skip
"""Limits that are exceeded wherever the platform is."""


class StoppedError(Exception):
    """Somebody wants an end; what was read is kept."""


def place_of(progress: dict[str, Any]) -> FloatArray:
    """Return the place (d,) at which the controller has the platform."""
    return np.array([*progress["position_m"], *progress.get("rotation_rad", ())])


def speed_m_s(directions: Directions) -> float:
    """Return how fast the platform goes from pose to pose."""
    return _SPEED_SHARE * float(directions.speed[0])


def within_s(directions: Directions, start: FloatArray, place: FloatArray) -> float:
    """Return for how long a platform may be on its way between two places (d,), from rest to rest.

    Planned are speeds and accelerations of all directions that share their time, as `pose` does.
    """
    way = np.abs(place - start)
    share = float(directions.speed[0]) / speed_m_s(directions)
    planned_s = float((way / directions.speed).max()) * share
    square_s2 = float((way / directions.acceleration).max())
    if square_s2 > planned_s**2:  # it does not come to its speed
        planned_s = 2.0 * math.sqrt(square_s2)
    else:
        planned_s += square_s2 / max(planned_s, 1e-9)
    return _SLOWED * planned_s + _LATE_S


def not_reached(
    directions: Directions,
    place: FloatArray,
    start: FloatArray,
    allowed_s: float,
    progress: dict[str, Any],
) -> TargetNotReached:
    """Return what is told of a platform that stands at `start` and not at a place (d,).

    `progress` is that of its motion when the time allowed was over.
    """
    k = directions.k
    apart = f"{1e3 * float(np.linalg.norm((start - place)[:k])):.0f} mm"
    if directions.turns:
        apart += f" and {math.degrees(float(np.linalg.norm((start - place)[k:]))):.1f} deg"
    kept = progress["trouble"] or progress["held_back"] or progress["missing"]
    why = f"{apart} off after {allowed_s:.0f} s: {kept or 'still on its way'}"
    return TargetNotReached(start, why)


def motion_ended(text: str, reason: str, details: Mapping[str, Any] | None) -> TripError:
    """Return that the motion was ended, and whether a pose can have had a part in it.

    `reason` and `details` are those of the loop's state.
    """
    if (details or {}).get("limit") in _NO_POSE_MAKES or EMERGENCY_STOP in reason:
        return NotThePoseError(text)
    return TripError(text)
