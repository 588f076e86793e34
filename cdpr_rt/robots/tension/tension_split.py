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
from cdpr_rt.robots.tension.nearest_wrench import nearest_wrench
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
    scratch: FloatArray,
) -> tuple[int, float, int]:
    """Write tensions `t` (n,) that exert `force` (d,) besides carrying the wrench `known` (d,).

    `plan` (2, n) are the planned bounds. `slow` (n,), kept from cycle to cycle, follows with `pace`
    what the force needs; `carried` (n,) is written, or taken where it is `given`. `missing` (d,) is
    what of the wrench they leave out; where they do, `t` comes nearest to it. The arrays behind are
    overwritten, as of `null_space`. Returns OK, INFEASIBLE where no tensions within the plan carry
    what is known, or SINGULAR; the share of the force exerted; the null directions in `space`.
    """
    d, n = W.shape
    for k in range(d):
        missing[k] = known[k] - force[k]
    _widen(plan, 0.0, bounds)
    _copy(plan[0], bounds[2])
    if null_space(W, known, scale, bounds, scaled, space, scratch) < d:
        _copy(plan[0], t)
        _copy(plan[0], carried)
        return SINGULAR, 0.0, 0
    r = n - d
    _copy(space[0], particular[0])
    other_wrench(missing, scale, scaled, scratch, particular[1])
    outcome = OK
    if not given:
        outcome = _carry(
            known, scale, plan, reserve, pace, r, slow, carried, t, missing, bounds, particular,
            scaled, space, scratch,
        )  # fmt: skip
    _widen(plan, reserve if outcome == INFEASIBLE else FAST * reserve, bounds)
    _copy(carried, bounds[2])
    _copy(particular[1], space[0])
    found = project(space, r, bounds, t, scratch)
    for k in range(d):
        scaled[k, n] = (force[k] - known[k]) / scale[k]
    nearest_wrench(scaled, bounds, scale, found, t, missing, scratch)
    if found:
        return outcome, 1.0, r
    left = _square(missing, scale) / max(_square(force, scale), 1e-300)
    return outcome, max(0.0, 1.0 - math.sqrt(left)), r


@jit
def _square(wrench: FloatArray, scale: FloatArray) -> float:
    total = 0.0
    for k in range(scale.size):
        total += (wrench[k] / scale[k]) ** 2
    return total


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
    scratch: FloatArray,
) -> int:
    """Write the tensions that carry what is known; `t` is overwritten. Returns the outcome."""
    n = t.size
    _widen(plan, _SLOW * reserve, bounds)
    _copy(particular[1], space[0])
    if project(space, r, bounds, t, scratch):
        for i in range(n):
            slow[i] += pace * (t[i] - slow[i])
    _widen(plan, 0.0, bounds)
    _copy(slow, bounds[2])
    _copy(particular[0], space[0])
    if project(space, r, bounds, carried, scratch):
        return OK
    for k in range(scale.size):
        scaled[k, n] = -known[k] / scale[k]
    nearest_wrench(scaled, bounds, scale, False, carried, missing, scratch)
    return INFEASIBLE


@jit
def _widen(plan: FloatArray, by: float, bounds: FloatArray) -> None:
    for i in range(plan.shape[1]):
        bounds[0, i], bounds[1, i] = plan[0, i] - by, plan[1, i] + by


@jit
def _copy(values: FloatArray, into: FloatArray) -> None:
    for i in range(values.size):
        into[i] = values[i]
