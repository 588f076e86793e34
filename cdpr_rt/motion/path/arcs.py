"""Arcs between two points of a plane, by their centre or by their radius."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.path.description import Arc

_OFF_m: Final = 2e-5
_OFF_SHARE: Final = 2e-3
"""By so much a file's rounding may put the end of an arc off its circle; the larger counts."""
_NOTHING_m: Final = 1e-9
_LARGEST_m: Final = 1000.0


def arc_by_centre(start: FloatArray, end: FloatArray, centre: FloatArray, clockwise: bool) -> Arc:
    """Return the arc (2,) around a centre; where it ends as it begins, the whole circle.

    The centre is moved by what the file was rounded by, so that it is as far from both ends.
    Raises ValueError where the ends are not as far from it.
    """
    first, last = start - centre, end - centre
    r, other = float(np.hypot(*first)), float(np.hypot(*last))
    if min(r, other) < _NOTHING_m:
        raise ValueError("its centre is one of its ends")
    if abs(r - other) > max(_OFF_m, _OFF_SHARE * r):
        raise ValueError(
            f"its ends are {1e3 * r:.4f} mm and {1e3 * other:.4f} mm from its centre; allowed: "
            "as far as each other"
        )
    chord = end - start
    length = float(np.hypot(*chord))
    if length < _NOTHING_m:
        return Arc(centre.copy(), -math.tau if clockwise else math.tau)
    middle = 0.5 * (start + end)
    normal = np.array([-chord[1], chord[0]]) / length
    centre = middle + float((centre - middle) @ normal) * normal
    angle = _turn(start - centre, end - centre)
    return Arc(centre, angle % math.tau - math.tau if clockwise else angle % math.tau)


def arc_by_radius(start: FloatArray, end: FloatArray, radius: float, clockwise: bool) -> Arc:
    """Return the arc of this radius, m; the longer of the two where it is negative.

    Raises ValueError where no such circle goes through both ends.
    """
    chord = end - start
    length = float(np.hypot(*chord))
    if length < _NOTHING_m:
        raise ValueError("R: it ends where it begins; allowed: I and J for a whole circle")
    if not abs(radius) <= _LARGEST_m:
        raise ValueError(f"R{1e3 * radius:g} mm; allowed: up to {1e3 * _LARGEST_m:g} mm")
    aside = radius**2 - 0.25 * length**2
    if aside < -max(_OFF_m, _OFF_SHARE * abs(radius)) * abs(radius):
        raise ValueError(
            f"R{1e3 * radius:g} mm: its ends are {1e3 * length:g} mm apart; allowed: at least "
            f"{5e2 * length:g} mm"
        )
    left = clockwise == (radius < 0.0)
    normal = np.array([-chord[1], chord[0]]) / length
    away = math.sqrt(max(aside, 0.0)) * (1.0 if left else -1.0)
    centre = 0.5 * (start + end) + away * normal
    angle = _turn(start - centre, end - centre) % math.tau
    return Arc(centre, angle - math.tau if clockwise else angle)


def _turn(first: FloatArray, last: FloatArray) -> float:
    """Return the angle from one vector (2,) to another."""
    return math.atan2(first[0] * last[1] - first[1] * last[0], float(first @ last))
