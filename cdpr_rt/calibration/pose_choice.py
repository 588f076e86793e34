"""Which of many poses to use: spread out, or those that tell most about the geometry.

Both take one pose after the other, each the best beside those that are taken already.
"""

from __future__ import annotations

import numpy as np

from cdpr_rt.core.exchange import FloatArray, IntArray

EXIT_m = OFFSET_m = 0.1
"""What exit points and initial lengths are taken to be uncertain by before: a tape's measure."""
LENGTH_m, POSITION_m, ROTATION_rad = 1e-3, 5e-3, 5e-3
"""Standard deviations of what is measured at a pose: lengths, and by a camera the pose."""


def spread(positions: FloatArray, arms: FloatArray, count: int) -> IntArray:
    """Return which `count` of the positions (m, d) lie furthest from each other.

    The first one is the furthest from their middle, each further one the one whose nearest among
    those taken is furthest (Gonzalez, 1985: no choice has twice its least distance). A distance is
    the norm of differences times `arms` (d,), which makes angles lengths.
    """
    scaled = np.asarray(positions, float) * arms
    nearest = np.linalg.norm(scaled - scaled.mean(axis=0), axis=1)
    taken = [int(nearest.argmax())]
    nearest = np.linalg.norm(scaled - scaled[taken[0]], axis=1)
    while len(taken) < count:
        taken.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(scaled - scaled[taken[-1]], axis=1))
    return np.array(taken)


def informative(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, count: int
) -> IntArray:
    """Return which `count` of the poses (m, 4, 3) tell most of exit points and initial lengths.

    Greedily D-optimal: each raises log det of the information most. A pose tells of cable i, after
    Tremblay (thesis), eqs. (3.16), (3.40), as length: u δa + δρ_0 = u δp + (Q b × u) δr - δΔρ, with
    u the unit vector from exit point a to anchor point b. So the information about its four
    unknowns grows by (u, 1) (u, 1)' over the variance of the right-hand side.
    """
    rows = information_rows(exits_m, anchors_m, poses)
    n = rows.shape[1]
    inverse = np.tile(np.diag([EXIT_m**2] * 3 + [OFFSET_m**2]), (n, 1, 1))
    left, taken = np.ones(len(rows), bool), []
    for _ in range(count):
        seen = np.einsum("mia,iab,mib->mi", rows, inverse, rows)
        gains = np.where(left, np.log1p(seen).sum(axis=1), -np.inf)
        taken.append(int(gains.argmax()))
        left[taken[-1]] = False
        for i, row in enumerate(rows[taken[-1]]):
            told = inverse[i] @ row
            inverse[i] -= np.outer(told, told) / (1.0 + row @ told)
    return np.array(taken)


def predicted_deviation_m(exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray) -> float:
    """Return the deviation of exit points' coordinates after poses (m, 4, 3), root mean square."""
    rows = information_rows(exits_m, anchors_m, poses)
    before = np.diag([EXIT_m**-2] * 3 + [OFFSET_m**-2])
    covariance = np.linalg.inv(before + np.einsum("mia,mib->iab", rows, rows))
    return float(np.sqrt(np.mean(np.einsum("iaa->ia", covariance)[:, :3])))


def information_rows(exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray) -> FloatArray:
    """Return what each pose tells of each cable, (m, n, 4), over its standard deviation."""
    arm = np.einsum("mab,ib->mia", poses[:, 1:], anchors_m)
    u = poses[:, None, 0] + arm - exits_m
    u /= np.linalg.norm(u, axis=2)[..., None]
    turned = (np.cross(arm, u) ** 2).sum(axis=2)
    variance = LENGTH_m**2 + POSITION_m**2 + turned * ROTATION_rad**2
    rows = np.concatenate([u, np.ones((*u.shape[:2], 1))], axis=2)
    return np.asarray(rows / np.sqrt(variance)[..., None])
