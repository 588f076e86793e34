"""Tensions of a loop in one cycle: those that carry the platform, and the loop's force on top.

The tensions of what is known beforehand, weight and acceleration, are the ones within the planned
bounds nearest to slowly varying wanted ones. Those of the loop's force are the ones nearest to
them, within bounds that a reserve makes wider: what the force has to change between the cables
moves within the reserve at once, what they have to be tightened for follows slowly, since tensions
that followed the force's every swing would be a loop of their own.
"""

from __future__ import annotations

import math

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.tension.nearest_wrench import settle
from cdpr_rt.robots.tension.null_space import null_space, other_wrench
from cdpr_rt.robots.tension.tension_projection import project

FAST = 0.85
"""Share of the reserve that a loop's force may use at once."""
_SLOW = 0.5
"""Share of it beyond which the cables are tightened or slackened for it."""
OK, INFEASIBLE, SINGULAR = 0, 1, 2


@jit
def split(
    W: FloatArray,
    known: FloatArray,
    force: FloatArray,
    scale: FloatArray,
    plan: FloatArray,
    reserve: float,
    pace: float,
    given: bool,
    slow: FloatArray,
    carried: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    bounds: FloatArray,
    particular: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    room: FloatArray,
) -> tuple[int, float, int]:
    """Write tensions `t` (n,) that exert `force` (d,) besides carrying the wrench `known` (d,).

    `plan` (2, n) are the planned bounds. `slow` (n,), kept from cycle to cycle, follows with `pace`
    what the force needs; `carried` (n,) is written, or taken where it is `given`. `missing` (d,) is
    what of the wrench they leave out; where they do, `t` comes nearest to it. The arrays behind are
    overwritten, as of `null_space`. Returns OK, or INFEASIBLE where no tensions within the
    plan carry what is known, or SINGULAR; the share of the force that is exerted; and how many
    null directions `space` has, from its row 1 on.
    """
    d, n = W.shape
    size = 0.0
    for k in range(d):
        size += (force[k] / scale[k]) ** 2
        missing[k] = known[k] - force[k]
    _widen(plan, 0.0, bounds)
    for i in range(n):
        bounds[2, i] = plan[0, i]
    rank = null_space(W, known, scale, bounds, scaled, space, room)
    if rank < d:
        for i in range(n):
            t[i] = carried[i] = plan[0, i]
        return SINGULAR, 0.0, 0
    r = n - rank
    for i in range(n):
        particular[0, i] = space[0, i]
    other_wrench(missing, scale, scaled, room, particular[1])
    outcome = OK
    if not given:
        outcome = _carry(
            known, scale, plan, reserve, pace, r, slow, carried, t, missing, bounds, particular,
            scaled, space, room,
        )  # fmt: skip
    _widen(plan, reserve if outcome == INFEASIBLE else FAST * reserve, bounds)
    for i in range(n):
        bounds[2, i] = carried[i]
    _start_from(particular[1], space)
    found = project(space, r, bounds, t, room)
    for k in range(d):
        scaled[k, n] = (force[k] - known[k]) / scale[k]
    settle(scaled, bounds, scale, found, t, missing, room)
    if found:
        return outcome, 1.0, r
    left = 0.0
    for k in range(d):
        left += (missing[k] / scale[k]) ** 2
    return outcome, max(0.0, 1.0 - math.sqrt(left / max(size, 1e-300))), r


@jit
def _carry(
    known: FloatArray,
    scale: FloatArray,
    plan: FloatArray,
    reserve: float,
    pace: float,
    r: int,
    slow: FloatArray,
    carried: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    bounds: FloatArray,
    particular: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    room: FloatArray,
) -> int:
    """Write the tensions that carry what is known; `t` is overwritten. Returns the outcome."""
    n = t.size
    _widen(plan, _SLOW * reserve, bounds)
    _start_from(particular[1], space)
    if project(space, r, bounds, t, room):
        for i in range(n):
            slow[i] += pace * (t[i] - slow[i])
    _widen(plan, 0.0, bounds)
    for i in range(n):
        bounds[2, i] = slow[i]
    _start_from(particular[0], space)
    if project(space, r, bounds, carried, room):
        return OK
    for k in range(scale.size):
        scaled[k, n] = -known[k] / scale[k]
    settle(scaled, bounds, scale, False, carried, missing, room)
    return INFEASIBLE


@jit
def _widen(plan: FloatArray, by: float, bounds: FloatArray) -> None:
    for i in range(plan.shape[1]):
        bounds[0, i], bounds[1, i] = plan[0, i] - by, plan[1, i] + by


@jit
def _start_from(particular: FloatArray, space: FloatArray) -> None:
    for i in range(particular.size):
        space[0, i] = particular[i]
