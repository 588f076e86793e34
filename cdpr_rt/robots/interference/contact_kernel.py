"""Kernels that find the first contact on a straight way of a platform, and miss none between.

Tremblay (thesis), eqs. (3.27), (3.36), (3.37), by conservative advancement: at a place of the way
each pair has a distance d, along the unit vector n between its nearest points. Both its things are
convex, and stay apart by more than the clearance c for as long as no end has moved further along n
than d - c and what it stays behind. With the speed g of an end along n and a bound h of its
acceleration, both by the share s of the way, that is so for

    s up to 2 m / (g + √(g² + 2 h m)),  m = d - c + what it stays behind

    way  (7, 3)   rows START and STEP of the position, TURNED and TURN of the rotation vector,
                  and a rotation BASE: p = START + s STEP, Q = exp(TURNED + s TURN) BASE

Of points at b in the platform's frame the speed is |STEP| + |TURN| |b| at most, and by Duhamel's
formula the acceleration |TURN|² |b| at most.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interference.clearance_kernel import (
    ANCHOR,
    BODY_BOX,
    CABLE_BODY,
    CABLES,
    EXIT,
    FIRST,
    KIND,
    SECOND,
    TRIMMED,
    Scene,
    depth,
    distance,
    write_ends,
)
from cdpr_rt.robots.kinematics.cable_kernel import (
    ANCHOR as ANCHORS,
)
from cdpr_rt.robots.kinematics.cable_kernel import (
    AXIS,
    CABLE_ROWS,
    FREE,
    RADIUS,
    TINY,
)
from cdpr_rt.robots.kinematics.pose import exponential

START, STEP, TURNED, TURN, BASE, WAY_ROWS = 0, 1, 2, 3, 4, 7
TOUCH_m: Final = 1e-6
"""Distance above the clearance below which a pair is in contact."""
_LEAVING: Final = 0.9
"""Share of its distance that a pair which is in contact at the start has to keep."""
_LEAVES: Final = 4.0
"""Clearances by which the platform moves at most until what touches altogether has come apart."""
_WATCHES: Final = 32
"""Number of checks meanwhile."""
_DEEPER: Final = 0.05
"""Clearances by which it may get deeper, for rounding and play."""
_SPEED, _ACCELERATION, _EXIT, _FAR, _FREE, _HOLDS, _RATES = range(7)
_TOGETHER = 0.02
"""Share of the way by which pairs are looked at early, since others are looked at anyway."""
MOST_LOOKS: Final = 20_000
_SMALL = 1e-4


class _Look(NamedTuple):
    """Arrays of one place of the way, overwritten at each."""

    pose: FloatArray
    twist: FloatArray
    """(2, 3)"""
    points: FloatArray
    """(4, 3), and `near` (2, 3), of the pair that is looked at, as of `distance`."""
    near: FloatArray
    rates: FloatArray
    """(7, n): bounds of speeds and accelerations of each cable's ends."""
    moves: FloatArray
    """(4, 3): for both ends of both things of the pair by how much they stay behind, their speed
    along n, and their acceleration."""


@jit
def first_contact(scene: Scene, way: FloatArray, most_looks: int) -> tuple[float, int, float, bool]:
    """Return the share of the way at which a pair comes into contact, which pair, and its distance.

    Returns 2.0 and -1 where none does. What is in contact at the start has to stay about as far
    apart, and to be clear at the end; what touches altogether there must not get deeper, has to be
    clear before the platform has moved by _LEAVES clearances, and to stay so. A pair that
    `most_looks` do not prove clear counts as in contact; last is whether it is known to be.
    """
    allowed = np.empty(scene.pairs.shape[0])
    allowed[:] = scene.clearance
    share, pair, apart, known = _advance(scene, way, most_looks, allowed)
    if pair < 0:
        pair, apart = _still_near(scene, way, allowed)
        share = 2.0 if pair < 0 else 1.0
    return share, pair, apart, known


@jit
def _advance(
    scene: Scene, way: FloatArray, most_looks: int, allowed: FloatArray
) -> tuple[float, int, float, bool]:
    """Return the first contact on the way; write how far apart each pair has to stay, `allowed`."""
    geometry, clearance = scene.geometry, scene.clearance
    n, count = geometry.shape[1], scene.pairs.shape[0]
    look = _Look(
        np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3)), np.empty((2, 3)),
        np.empty((_RATES, n)), np.empty((4, 3)),
    )  # fmt: skip
    pose, twist, points, near, rates, _ = look
    cables, ends = np.empty((CABLE_ROWS, n)), np.empty((2, n, 3))
    corners, scratch = np.empty((8, 3)), np.empty((4, 3))
    until, least = np.zeros(count), np.empty(count)
    least[:] = -math.inf
    body_speed = _write_speeds(geometry, scene.boxes, way, rates)
    share, looks, fastest = 0.0, 0, body_speed
    for i in range(n):
        fastest = max(fastest, rates[_SPEED, i])
    leaves = _LEAVES * clearance / (fastest + TINY)
    while share < 1.0:
        place_on(way, share, scratch, pose, twist)
        write_ends(geometry, pose, cables, ends)
        _write_exit_speeds(geometry, pose, way, cables, ends, rates)
        for k in range(count):
            if until[k] > share + _TOGETHER:
                continue
            apart = distance(scene, k, pose, ends, points, near, corners)
            if looks == 0:
                allowed[k] = _to_keep(apart, clearance)
            if allowed[k] < 0.0 and share < leaves:
                if not apart > 0.0:
                    apart = -depth(scene, k, pose, ends, points)
                if apart < least[k]:
                    return share, k, max(apart, 0.0), True
                least[k] = max(least[k], apart - _DEEPER * clearance)
                until[k] = min(share + leaves / _WATCHES, leaves)
                continue
            if allowed[k] < 0.0:
                allowed[k] = clearance  # has to have come apart
            if apart - allowed[k] >= TOUCH_m and looks < most_looks:
                kept = _clear_for(scene, k, apart, allowed[k], way, body_speed, look)
                until[k] = share + kept
            elif until[k] <= share:
                return share, k, apart, apart - allowed[k] < TOUCH_m
        share = 1.0
        for k in range(count):
            share = min(share, until[k])
        looks += 1
    return 2.0, -1, math.inf, True


@jit
def _still_near(scene: Scene, way: FloatArray, allowed: FloatArray) -> tuple[int, float]:
    """Return the first pair in contact at the start that is not clear at the end, -1 for none."""
    n, clearance = scene.geometry.shape[1], scene.clearance
    pose, twist, scratch, points = (
        np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3)), np.empty((4, 3)),
    )  # fmt: skip
    near, corners, ends = np.empty((2, 3)), np.empty((8, 3)), np.empty((2, n, 3))
    place_on(way, 1.0, scratch, pose, twist)
    write_ends(scene.geometry, pose, np.empty((CABLE_ROWS, n)), ends)
    for k in range(scene.pairs.shape[0]):
        if allowed[k] < clearance:
            apart = distance(scene, k, pose, ends, points, near, corners)
            if not apart >= clearance:
                return k, apart
    return -1, math.inf


@jit
def _to_keep(apart: float, clearance: float) -> float:
    """Return how far apart a pair has to stay, below 0 where it touches at the start."""
    return clearance if apart >= clearance + TOUCH_m else _LEAVING * apart - TOUCH_m


@jit
def place_on(
    way: FloatArray, share: float, scratch: FloatArray, pose: FloatArray, twist: FloatArray
) -> None:
    """Write the pose at a share of the way, and its derivative there: twist (2, 3).

    `scratch` (4, 3) is overwritten.

    For a rotation vector φ with derivative φ' the angular velocity is φ' + (1 - cos θ)/θ² φ × φ' +
    (θ - sin θ)/θ³ φ × (φ × φ').
    """
    phi, turn = scratch[0], scratch[1:4]
    for k in range(3):
        phi[k] = way[TURNED, k] + share * way[TURN, k]
        twist[0, k] = way[STEP, k]
        pose[0, k] = way[START, k] + share * way[STEP, k]
    exponential(phi, turn)
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += turn[i, k] * way[BASE + k, j]
            pose[1 + i, j] = entry
    x, y, z = phi[0], phi[1], phi[2]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    first, second = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    if angle > _SMALL:
        first, second = (1.0 - math.cos(angle)) / square, (angle - math.sin(angle)) / square / angle
    tx, ty, tz = way[TURN, 0], way[TURN, 1], way[TURN, 2]
    cx, cy, cz = y * tz - z * ty, z * tx - x * tz, x * ty - y * tx
    twist[1, 0] = tx + first * cx + second * (y * cz - z * cy)
    twist[1, 1] = ty + first * cy + second * (z * cx - x * cz)
    twist[1, 2] = tz + first * cz + second * (x * cy - y * cx)


@jit
def size_of(vector: FloatArray) -> float:
    """Return the length of a vector (3,)."""
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@jit
def _write_speeds(
    geometry: FloatArray, boxes: FloatArray, way: FloatArray, rates: FloatArray
) -> float:
    """Write bounds of anchor points' speeds and accelerations; return that of the body's speed."""
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    for i in range(geometry.shape[1]):
        arm = size_of(geometry[ANCHORS : ANCHORS + 3, i])
        rates[_SPEED, i], rates[_ACCELERATION, i] = step + turn * arm, turn * turn * arm
    furthest = 0.0
    for k in range(3):
        furthest += max(abs(boxes[0, 0, k]), abs(boxes[0, 1, k])) ** 2
    return step + turn * math.sqrt(furthest)


@jit
def _write_exit_speeds(
    geometry: FloatArray,
    pose: FloatArray,
    way: FloatArray,
    cables: FloatArray,
    ends: FloatArray,
    rates: FloatArray,
) -> None:
    """Write bounds of how fast free parts begin elsewhere, and for how far all bounds hold.

    Over a pulley of radius r, an anchor that moves at v beside its swivel axis by e, with a free
    part l, moves the place where the cable leaves by r (2 v/e + v/l) at most. The bounds hold while
    e and l are half of what they are. In the platform's frame that place moves as the platform
    turns as well.
    """
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    for i in range(geometry.shape[1]):
        v, r, free = rates[_SPEED, i], geometry[RADIUS, i], cables[FREE, i]
        speed, least = 0.0, free
        if r > 0.0:
            along, square = 0.0, 0.0
            for k in range(3):
                apart = ends[1, i, k] - geometry[k, i]
                along += apart * geometry[AXIS + k, i]
                square += apart * apart
            beside = math.sqrt(max(square - along * along, 0.0))
            if beside > 0.0 and free > 0.0:
                speed = r * v * (4.0 / beside + 2.0 / free)
                least = min(beside, free) / (1.0 + 2.0 * r / free)
            else:
                least = 0.0
        rates[_EXIT, i] = speed
        rates[_HOLDS, i], rates[_FREE, i] = 0.5 * least / (v + speed + TINY), free
        far = 0.0
        for k in range(3):
            far += (ends[0, i, k] - pose[0, k]) ** 2
        rates[_FAR, i] = speed + step + turn * (math.sqrt(far) + step + speed)


@jit
def _clear_for(
    scene: Scene,
    k: int,
    apart: float,
    allowed: float,
    way: FloatArray,
    body_speed: float,
    look: _Look,
) -> float:
    """Return for which share of the way, from here, pair `k` stays further apart than allowed."""
    pair, rates, moves = scene.pairs[k], look.rates, look.moves
    if pair[KIND] == BODY_BOX:
        return (apart - allowed) / (body_speed + TINY)
    moves[:] = 0.0
    least, others = float(rates[_HOLDS, pair[FIRST]]), 1
    _write_moves(pair, 0, apart, scene.trim, way, look)
    if pair[KIND] == CABLES:
        least, others = min(least, rates[_HOLDS, pair[SECOND]]), 2
        _write_moves(pair, 1, apart, scene.trim, way, look)
    for a in range(2):
        for b in range(2, 2 + others):
            left = apart - allowed + moves[a, 0] + moves[b, 0]
            g, h = moves[a, 1] + moves[b, 1], moves[a, 2] + moves[b, 2]
            if a == 1 and b == 3 and pair[TRIMMED] & ANCHOR != 0:
                g = min(g, _apart_at_anchor(scene, pair, way, rates))
            least = min(least, 2.0 * left / (g + math.sqrt(g * g + 2.0 * h * left) + TINY))
    return least


@jit
def _swings(rates: FloatArray, i: int, trim: float) -> float:
    """Return a bound of how fast a point `trim` from an end of a cable moves about that end."""
    return trim * 2.0 * float(rates[_SPEED, i] + rates[_EXIT, i]) / float(rates[_FREE, i])


@jit
def _apart_at_anchor(scene: Scene, pair: IntArray, way: FloatArray, rates: FloatArray) -> float:
    """Return how fast two cables that end in one point may come nearer there: that point is common.

    Otherwise a way of many metres would take as many looks as its length has of what is left out.
    """
    speed = size_of(way[TURN]) * scene.clearance
    for row in range(2):
        i = pair[FIRST + row]
        if 4.0 * scene.trim > rates[_FREE, i]:
            return math.inf
        speed += _swings(rates, i, scene.trim)
    return speed


@jit
def _write_moves(
    pair: IntArray, row: int, apart: float, trim: float, way: FloatArray, look: _Look
) -> None:
    """Write how both ends of a pair's first or second (`row` 1) thing, a cable, may move."""
    pose, twist, points, near, rates, moves = look
    i, sign = pair[FIRST + row], (1.0 - 2.0 * row) / apart
    nx, ny = sign * (near[1, 0] - near[0, 0]), sign * (near[1, 1] - near[0, 1])
    nz = sign * (near[1, 2] - near[0, 2])
    own, both = near[row], rates[_SPEED, i] + rates[_EXIT, i]
    for end in range(2):
        x = points[2 * row + end]
        behind = nx * (own[0] - x[0]) + ny * (own[1] - x[1]) + nz * (own[2] - x[2])
        trimmed = pair[TRIMMED] & (ANCHOR if end else EXIT) != 0
        speed, bend = 0.0, 0.0
        if pair[KIND] == CABLE_BODY:
            if end == 0:
                speed = rates[_FAR, i]
            elif trimmed:
                speed = trim * (size_of(way[TURN]) + 2.0 * both / rates[_FREE, i])
                if 4.0 * trim > rates[_FREE, i]:
                    speed = rates[_FAR, i]
        elif trimmed:
            speed = 2.0 * both
            if 4.0 * trim <= rates[_FREE, i]:
                speed = (rates[_SPEED, i] if end else rates[_EXIT, i]) + _swings(rates, i, trim)
        elif end == 0:
            speed = rates[_EXIT, i]
        else:
            rx, ry, rz = x[0] - pose[0, 0], x[1] - pose[0, 1], x[2] - pose[0, 2]
            wx, wy, wz = twist[1, 0], twist[1, 1], twist[1, 2]
            along = nx * (twist[0, 0] + wy * rz - wz * ry)
            along += ny * (twist[0, 1] + wz * rx - wx * rz)
            along += nz * (twist[0, 2] + wx * ry - wy * rx)
            speed, bend = max(along, 0.0), rates[_ACCELERATION, i]
        moves[2 * row + end, 0] = max(behind, 0.0)
        moves[2 * row + end, 1], moves[2 * row + end, 2] = speed, bend
