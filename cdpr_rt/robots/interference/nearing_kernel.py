"""Kernel that tells in every cycle whether a short straight way leads into contact.

Of a pair that is clear at both ends of a part of the way, d0 and d1 apart, and whose things' points
move by l at most together, the least distance between is (d0 + d1 - l) / 2 at least. Where that is
not enough for all of the way, it is looked at in some parts.
"""

from __future__ import annotations

from typing import Final

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interference.clearance_kernel import (
    BODY_BOX,
    CABLE_BOX,
    KIND,
    Scene,
    depth,
    distance,
    write_ends,
)
from cdpr_rt.robots.interference.contact_kernel import STEP, TURN, place_on, size_of

_NOTHING_m: Final = 1e-9


@jit
def nears(
    scene: Scene,
    way: FloatArray,
    arm: float,
    cables: FloatArray,
    ends: FloatArray,
    poses: FloatArray,
    scratch: FloatArray,
    before: FloatArray,
    parts: int,
) -> int:
    """Return a pair that comes into contact on a `way`, as of `contact_kernel`, -1 for none.

    What is in contact at its start may leave, but not get nearer. With no `parts` only its end is
    looked at. `arm` is that of the platform's farthest point. Overwritten are `cables`, `ends`
    (2, 2, n, 3), `poses` (3, 4, 3), `scratch` (5, 8, 3) and `before` (pairs,), of the last part.
    """
    points, near, corners, scratch, twist = (
        scratch[0, :4], scratch[1, :2], scratch[2], scratch[3, :4], scratch[4, :2],
    )  # fmt: skip
    pairs, clearance = scene.pairs, scene.clearance
    moved = size_of(way[STEP]) + arm * size_of(way[TURN])
    for j in range(2):
        place_on(way, float(j), scratch, poses[j], twist)
        write_ends(scene.geometry, poses[j], cables, ends[j])
    close = False
    for k in range(pairs.shape[0]):
        now = distance(scene, k, poses[0], ends[0], points, near, corners)
        then = distance(scene, k, poses[1], ends[1], points, near, corners)
        before[k] = -1.0
        if now >= clearance and then >= clearance:
            if parts > 0 and now + then - _together(pairs[k], moved) < 2.0 * clearance:
                before[k], close = now, True
            continue
        if now <= 0.0 and then <= 0.0:
            now = -depth(scene, k, poses[0], ends[0], points)
            then = -depth(scene, k, poses[1], ends[1], points)
        if then < clearance and not then >= now - _NOTHING_m:
            return k
    for j in range(1, parts + 1 if close else 0):
        place_on(way, j / parts, scratch, poses[2], twist)
        write_ends(scene.geometry, poses[2], cables, ends[0])
        for k in range(pairs.shape[0]):
            if before[k] >= 0.0:
                now = distance(scene, k, poses[2], ends[0], points, near, corners)
                if now + before[k] - _together(pairs[k], moved / parts) < 2.0 * clearance:
                    return k
                before[k] = now
    return -1


@jit
def _together(pair: IntArray, moved: float) -> float:
    """Return how far two things move together where the platform's points move so far at most."""
    return moved if pair[KIND] in (BODY_BOX, CABLE_BOX) else 2.0 * moved
