"""Kernels that prove for how much of a straight way cables hold a platform.

At a place of the way let tensions t carry a wrench within bounds, a margin m inside of them. A
share s further on the wrench matrix is W + E, and t + δ carries it there if δ = -W⁺E (t + δ). With
the derivative D of W by the share, and a bound of what is left, |E - s D| of each column at most
first s + second s²/2, no entry of δ is larger than m, and so t + δ within bounds, while

    l s + k s²/2 <= m (1 - a s - b s²/2),  that is  s up to 2 m / (g + √(g² + 2 h m))

with g = l + m a, h = k + m b, where l, a are the largest row sums of |W⁺D| with tensions and
without, and k, b those of |W⁺| times the bound of what is left. The margin is that of the worst
wrench, so one such s is right for all of them. W⁺ = W'(W W')⁻¹ does not depend on the units of its
rows. Where cables have weight the wrench changes too, by half that of what becomes free of each:
by no more than a bound of first order, which then is added to E (t + δ). See `contact_kernel` for
the way.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interference.contact_kernel import STEP, TURN, place_on, size_of
from cdpr_rt.robots.kinematics.cable_kernel import (
    ANCHOR,
    AXIS,
    CABLE_ROWS,
    FREE,
    RADIUS,
    TINY,
    WEIGHT,
    hang,
    run_cables,
)
from cdpr_rt.robots.tension.circuit_margin import WrenchSets, circuit_margin
from cdpr_rt.robots.tension.null_space import null_space, other_wrench

LEAST_N: Final = 1e-3
"""A way ends where its margin is less."""
_MOST_LOOKS = 2000
_SHARE_OF_LENGTH = 0.25
"""By which a cable's length may change from one look to the next."""
_CLOSER = 1.0 / (1.0 - _SHARE_OF_LENGTH)
"""What a length is divided by may so become larger by this."""
_FORCE, _MOMENT = 0, 1


@jit
def held_until(
    geometry: FloatArray, chosen: IntArray, sets: WrenchSets, way: FloatArray, until: float
) -> tuple[float, int]:
    """Return up to which share of the way, `until` at most, all wrenches are carried.

    And how many places were looked at. `geometry` is that about the centre of the wrenches,
    `chosen` (d,) are the controlled directions.
    """
    centre, wrenches, generators, scale, bounds = sets
    d, n = scale.size, geometry.shape[1]
    cables, W, D = np.empty((CABLE_ROWS, n)), np.empty((d, n)), np.empty((6, n))
    space, scaled, side = np.zeros((n + 1, n)), np.empty((d, n + 1)), max(n, 8)
    scratch, inverse, unit = np.zeros((4, side, side)), np.zeros((6, n)), np.zeros(d)
    carrying, left = np.zeros((wrenches.shape[0], n)), np.zeros((2, 2, 2))
    pose, twist, turns = np.empty((4, 3)), np.empty((2, 3)), np.empty((4, 3))
    whole, shifted = np.zeros(6), wrenches.shape[0] - generators
    share, looks = 0.0, 0
    while share < until:
        place_on(way, share, turns, pose, twist)
        looks += 1
        _about(pose, twist, centre)
        run_cables(geometry, pose, cables)
        whole[:] = 0.0
        hang(geometry, pose, cables, whole)
        for k in range(d):
            for i in range(n):
                W[k, i] = -cables[chosen[k], i]
        if null_space(W, wrenches[0], scale, bounds, scaled, space, scratch) < d:
            break
        for k in range(d):
            unit[:] = 0.0
            unit[k] = -1.0
            other_wrench(unit, scale, scaled, scratch, inverse[chosen[k]])
        for j in range(wrenches.shape[0]):
            for i in range(n):
                carrying[j, i] = 0.0
                for k in range(d):
                    acting = wrenches[j, k] + (whole[chosen[k]] if j < shifted else 0.0)
                    carrying[j, i] -= inverse[chosen[k], i] * acting
        margin = circuit_margin(space, n - d, bounds, carrying, generators, LEAST_N)
        if not margin >= LEAST_N or looks > _MOST_LOOKS:
            break
        reach = _write_changes(geometry, centre, pose, twist, way, cables, bounds, D, left)
        share += min(reach, _kept_for(margin, inverse, D, left, bounds))
    return min(share, until), looks


@jit
def _about(pose: FloatArray, twist: FloatArray, centre: FloatArray) -> None:
    """Make pose and twist those of a point of the platform."""
    x, y, z = (
        pose[1, 0] * centre[0] + pose[1, 1] * centre[1] + pose[1, 2] * centre[2],
        pose[2, 0] * centre[0] + pose[2, 1] * centre[1] + pose[2, 2] * centre[2],
        pose[3, 0] * centre[0] + pose[3, 1] * centre[1] + pose[3, 2] * centre[2],
    )
    pose[0, 0], pose[0, 1], pose[0, 2] = pose[0, 0] + x, pose[0, 1] + y, pose[0, 2] + z
    twist[0, 0] += twist[1, 1] * z - twist[1, 2] * y
    twist[0, 1] += twist[1, 2] * x - twist[1, 0] * z
    twist[0, 2] += twist[1, 0] * y - twist[1, 1] * x


@jit
def _write_changes(
    geometry: FloatArray,
    centre: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    way: FloatArray,
    cables: FloatArray,
    bounds: FloatArray,
    D: FloatArray,
    left: FloatArray,
) -> float:
    """Write the derivative `D` (6, n) of W, and bounds of what is left; return how far they hold.

    `left` (2, 2, 2) is summed over the cables: of forces and of moments, that of first and that of
    second order, as it is and times the highest tension, to which what changes of the cables'
    weight is added. With the anchor's speed v and acceleration h over a length l the direction u
    changes by v/l, and its change by h/l + 3 v²/l². Over a pulley beside whose axis the anchor is
    by e only a first bound is taken, v/l + v/e.
    """
    step, turn = size_of(way[STEP]), size_of(way[TURN])
    left[:] = 0.0
    reach = math.inf
    for i in range(geometry.shape[1]):
        bx, by, bz = geometry[ANCHOR, i], geometry[ANCHOR + 1, i], geometry[ANCHOR + 2, i]
        arm = size_of(geometry[ANCHOR : ANCHOR + 3, i])
        whole = math.sqrt((bx + centre[0]) ** 2 + (by + centre[1]) ** 2 + (bz + centre[2]) ** 2)
        speed, bend, free = step + turn * whole, turn * turn * whole, cables[FREE, i]
        radius, first, second = geometry[RADIUS, i], 0.0, 0.0
        half = 0.5 * size_of(geometry[WEIGHT : WEIGHT + 3, i])
        longer = half * speed * (1.0 + 2.0 * radius / (free + TINY))
        left[_FORCE, 0, 1] += longer
        left[_MOMENT, 0, 1] += arm * (longer + turn * half * free * _CLOSER)
        if radius > 0.0:
            least = min(free, _beside(geometry, pose, i))
            reach = min(reach, _SHARE_OF_LENGTH * least / (speed * (1.0 + 2.0 * radius / free)))
            first = 2.0 * _CLOSER * speed / (least + TINY)
            for k in range(6):
                D[k, i] = 0.0
            first_moment, second_moment = arm * (turn + first), 0.0
        else:
            reach = min(reach, _SHARE_OF_LENGTH * free / (speed + TINY))
            speed = min(speed, _write_derivative(geometry, pose, twist, cables, i, D) + bend)
            rate = _CLOSER * speed / free
            second = _CLOSER * bend / free + 3.0 * rate * rate
            first_moment, second_moment = 0.0, arm * (turn * turn + 2.0 * turn * rate + second)
        for k in range(2):
            tension = bounds[1, i] if k else 1.0
            left[_FORCE, 0, k] += first * tension
            left[_FORCE, 1, k] += second * tension
            left[_MOMENT, 0, k] += first_moment * tension
            left[_MOMENT, 1, k] += second_moment * tension
    return reach


@jit
def _write_derivative(
    geometry: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    cables: FloatArray,
    i: int,
    D: FloatArray,
) -> float:
    """Write the column of `D` of a cable without a pulley; return its anchor's speed."""
    bx, by, bz = geometry[ANCHOR, i], geometry[ANCHOR + 1, i], geometry[ANCHOR + 2, i]
    wx, wy, wz = twist[1, 0], twist[1, 1], twist[1, 2]
    rx = pose[1, 0] * bx + pose[1, 1] * by + pose[1, 2] * bz
    ry = pose[2, 0] * bx + pose[2, 1] * by + pose[2, 2] * bz
    rz = pose[3, 0] * bx + pose[3, 1] * by + pose[3, 2] * bz
    mx, my, mz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
    ux, uy, uz, free = cables[0, i], cables[1, i], cables[2, i], cables[FREE, i]
    cx, cy, cz = twist[0, 0] + mx, twist[0, 1] + my, twist[0, 2] + mz
    speed = math.sqrt(cx * cx + cy * cy + cz * cz)
    along = ux * cx + uy * cy + uz * cz
    cx, cy, cz = (cx - along * ux) / free, (cy - along * uy) / free, (cz - along * uz) / free
    D[0, i], D[1, i], D[2, i] = -cx, -cy, -cz
    D[3, i] = -(my * uz - mz * uy + ry * cz - rz * cy)
    D[4, i] = -(mz * ux - mx * uz + rz * cx - rx * cz)
    D[5, i] = -(mx * uy - my * ux + rx * cy - ry * cx)
    return speed


@jit
def _beside(geometry: FloatArray, pose: FloatArray, i: int) -> float:
    """Return how far an anchor point is from the swivel axis of its pulley."""
    square, along = 0.0, 0.0
    for k in range(3):
        x = pose[0, k] - geometry[k, i]
        for j in range(3):
            x += pose[1 + k, j] * geometry[ANCHOR + j, i]
        square += x * x
        along += x * geometry[AXIS + k, i]
    return math.sqrt(max(square - along * along, 0.0))


@jit
def _kept_for(
    margin: float, inverse: FloatArray, D: FloatArray, left: FloatArray, bounds: FloatArray
) -> float:
    """Return for which share of the way tensions stay within bounds.

    `inverse` (6, n) is W⁺ transposed, 0 for what is not controlled.
    """
    n = D.shape[1]
    a, b = 0.0, 0.0
    share = math.inf
    for turn in range(2):
        for i in range(n):
            force = math.sqrt(inverse[0, i] ** 2 + inverse[1, i] ** 2 + inverse[2, i] ** 2)
            moment = math.sqrt(inverse[3, i] ** 2 + inverse[4, i] ** 2 + inverse[5, i] ** 2)
            total, spread, middle = 0.0, 0.0, 0.0
            for j in range(n):
                entry = 0.0
                for k in range(6):
                    entry += inverse[k, i] * D[k, j]
                total += abs(entry)
                spread += abs(entry) * 0.5 * (bounds[1, j] - bounds[0, j])
                middle += entry * 0.5 * (bounds[1, j] + bounds[0, j])
            if turn == 0:
                a = max(a, total + force * left[_FORCE, 0, 0] + moment * left[_MOMENT, 0, 0])
                b = max(b, force * left[_FORCE, 1, 0] + moment * left[_MOMENT, 1, 0])
                continue
            g = spread + abs(middle) + margin * a
            g += force * left[_FORCE, 0, 1] + moment * left[_MOMENT, 0, 1]
            h = force * left[_FORCE, 1, 1] + moment * left[_MOMENT, 1, 1] + margin * b
            share = min(share, 2.0 * margin / (g + math.sqrt(g * g + 2.0 * h * margin) + TINY))
    return share
