"""Kernel that finds how far a platform gets on straight ways, held and without contact."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interference.clearance_kernel import Scene
from cdpr_rt.robots.interference.contact_kernel import (
    BASE,
    MOST_LOOKS,
    START,
    STEP,
    TURNED,
    WAY_ROWS,
    first_contact,
)
from cdpr_rt.robots.reach.held_kernel import held_until
from cdpr_rt.robots.tension.circuit_margin import WrenchSets

WHOLE, CONTACT, NOT_HELD = range(3)
"""Why a way ends: at its target, at a contact, or where tensions are not feasible."""


@jit
def reach_all(
    home: FloatArray,
    start: FloatArray,
    ends: FloatArray,
    chosen: IntArray,
    scene: Scene,
    centred: FloatArray,
    sets: WrenchSets,
    shares: FloatArray,
    why: IntArray,
) -> None:
    """Write for which share of each straight way a platform is held and clear, eq. (3.38).

    Ways lead from the position `start` (d,) to each of `ends` (m, d); all else is that of
    `first_contact` and `held_until`, whose geometry `centred` is.
    """
    way = np.zeros((WAY_ROWS, 3))
    for k in range(3):
        way[START, k] = home[0, k]
        for i in range(3):
            way[BASE + i, k] = home[1 + i, k]
    for j in range(ends.shape[0]):
        for k in range(start.size):
            row, column = START, chosen[k]
            if chosen[k] > 2:
                row, column = TURNED, chosen[k] - 3
            way[row, column], way[row + STEP, column] = start[k], ends[j, k] - start[k]
        touches, pair, _, _ = first_contact(scene, way, MOST_LOOKS)
        until = min(touches, 1.0)
        why[j] = WHOLE if pair < 0 else CONTACT
        shares[j], _ = held_until(centred, chosen, sets, way, until)
        if shares[j] < until:
            why[j] = NOT_HELD
