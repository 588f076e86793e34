"""A small interpreter of G-code by the definition of RS-274, independent of the product's.

It returns points of the programmed path, in mm, close to each other. Lines are programs of the
tests: words with numbers, no comments, all of X, Y and Z known from the first line on.
"""

from __future__ import annotations

import cmath
import math
import re

import numpy as np
from scipy.spatial import KDTree

STEP_mm = 0.1
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


def programmed_mm(lines: list[str]) -> np.ndarray:
    """Return points (n, 3) of the path at most 0.1 mm apart; the first one is where it begins."""
    here, offset = [math.nan] * 3, [0.0] * 3
    points: list[list[float]] = []
    motion, plane, unit, relative = 0, 17, 1.0, False
    drilling: dict[str, float] = {}
    for text in lines:
        words = re.findall(r"([A-Z])\s*([-+]?[0-9.]+)", text.upper())
        codes = [float(value) for letter, value in words if letter == "G"]
        at = {letter: float(value) for letter, value in words if letter != "G"}
        for code in codes:
            plane = int(code) if code in PLANES else plane
            unit = {20: 25.4, 21: 1.0}.get(code, unit)
            relative = {90: False, 91: True}.get(code, relative)
            if code in (0, 1, 2, 3, 80, 81, 83):
                motion, drilling = int(code), {}
        named = {i: at[c] * unit for i, c in enumerate("XYZ") if c in at}
        if 92 in codes:
            for i, value in named.items():
                offset[i] += here[i] - value
                here[i] = value
            continue
        if motion in (81, 83):
            if set(at) & set("XYZR"):
                drilling |= {c: at[c] * unit for c in "ZR" if c in at}
                for _ in range(int(at.get("L", 1))):
                    here = _drill(points, here, named, offset, drilling, relative)
            continue
        target = here[:]
        for i, value in named.items():
            target[i] = value + (here[i] if relative else 0.0)
        centre = {i: at[c] * unit for i, c in enumerate("IJK") if c in at}
        if motion in (2, 3) and (named or centre or "R" in at):
            _arc(points, here, target, offset, PLANES[plane], motion == 2, centre,
                 at["R"] * unit if "R" in at else None, int(at.get("P", 1)))  # fmt: skip
        elif named and not any(map(math.isnan, here)):
            _line(points, here, target, offset)
        elif named and not any(map(math.isnan, target)):
            points.append([t + o for t, o in zip(target, offset, strict=True)])
        here = target
    return np.array(points)


def _drill(points, here, named, offset, drilling, relative) -> list[float]:
    """Drill once; retract to where it began (G98)."""
    level, there = here[2], here[:]
    for i in (0, 1):
        if i in named:
            there[i] = named[i] + (there[i] if relative else 0.0)
    r = drilling["R"] + (level if relative else 0.0)
    z = drilling["Z"] + (r if relative else 0.0)
    for to in (
        [*here[:2], max(r, level)], [*there[:2], max(r, level)], [*there[:2], r], [*there[:2], z],
        [*there[:2], max(r, level)],
    ):  # fmt: skip
        _line(points, here, to, offset)
        here = to
    return here


def _line(points, here, to, offset) -> None:
    a, b = np.add(here, offset), np.add(to, offset)
    count = max(int(np.ceil(np.linalg.norm(b - a) / STEP_mm)), 1)
    points.extend((a + (b - a) * share).tolist() for share in np.arange(1, count + 1) / count)


def _arc(points, here, to, offset, axes, clockwise, centre, radius, turns) -> None:
    u, v, w = axes
    a, b = complex(here[u], here[v]), complex(to[u], to[v])
    if radius is None:
        middle = a + complex(centre.get(u, 0.0), centre.get(v, 0.0))
    else:  # on the side of the chord that makes the arc the shorter or the longer one
        chord = b - a
        aside = math.sqrt(max(radius**2 - abs(chord / 2) ** 2, 0.0))
        side = -1j if clockwise == (radius > 0) else 1j
        middle = (a + b) / 2 + side * aside * chord / abs(chord)
    sense = -1.0 if clockwise else 1.0
    angle = (sense * cmath.phase((b - middle) / (a - middle))) % (2 * math.pi)
    if abs(b - a) < 1e-9:
        angle = 2 * math.pi
    angle += 2 * math.pi * (turns - 1)
    r0, r1 = abs(a - middle), abs(b - middle)
    count = max(int(np.ceil(angle / 0.004)), int(np.ceil(angle * r0 / STEP_mm)), 1)
    for share in np.arange(1, count + 1) / count:
        turned = (a - middle) * cmath.exp(1j * sense * angle * share)
        turned *= (r0 + share * (r1 - r0)) / r0
        place = [0.0] * 3
        place[u], place[v] = (middle + turned).real, (middle + turned).imag
        place[w] = here[w] + share * (to[w] - here[w])
        points.append(np.add(place, offset).tolist())


def distances_mm(places: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how far places (m, 3) are from the lines between points (n, 3)."""
    _, near = KDTree(points).query(places, k=min(12, len(points)))
    away = np.full(len(places), np.inf)
    for column in np.reshape(near, (len(places), -1)).T:
        for first in (np.maximum(column - 1, 0), np.minimum(column, len(points) - 2)):
            a, b = points[first], points[first + 1]
            square = np.maximum(((b - a) ** 2).sum(axis=1), 1e-18)
            share = np.clip(((places - a) * (b - a)).sum(axis=1) / square, 0.0, 1.0)
            nearest = a + share[:, None] * (b - a)
            away = np.minimum(away, np.linalg.norm(places - nearest, axis=1))
    return away
