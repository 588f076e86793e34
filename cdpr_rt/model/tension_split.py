"""Tensions of a control loop in one cycle: those that carry the platform, plus the loop's force.

The feed-forward tensions carry the known wrench of weight and acceleration. They are within the
planned bounds, and as near as possible to wanted tensions that vary slowly. The tensions that also
exert the loop's force are as near as possible to these, within bounds that are wider by a reserve.
Within the reserve, tensions follow the force immediately. Further tightening follows slowly,
because tensions that followed each oscillation of the force would form a second loop.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.model.null_space import null_space, other_wrench
from cdpr_rt.model.tension_qp import nearest_wrench, project

FAST = 0.85
"""Share of the reserve that a loop's force may use immediately."""
_SLOW = 0.5
"""Share of the reserve beyond which the force makes the loop tighten or slacken the cables."""
OK, INFEASIBLE, SINGULAR = 0, 1, 2


@jit
def split(
    W: FloatArray,
    feedforward: FloatArray,
    force: FloatArray,
    scale: FloatArray,
    plan: FloatArray,
    reserve: float,
    slow_share: float,
    external: bool,
    slow_tensions: FloatArray,
    feedforward_tensions: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    bounds: FloatArray,
    particular: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    scratch: FloatArray,
) -> tuple[int, float, int]:
    """Write tensions `t` (n,) that exert `force` (d,) in addition to carrying `feedforward` (d,).

    `plan` (2, n) are the planned bounds. `slow_tensions` (n,) are kept from cycle to cycle; each
    cycle moves them by `slow_share` of the distance to the tensions that the force needs.
    `feedforward_tensions` (n,) are written, or read if they are `external`. `missing` (d,) is the
    part of the wrench that is not exerted; if it is not 0, `t` exerts the nearest wrench. The
    arrays after it are overwritten, as in `null_space`. Returns OK, INFEASIBLE if no tensions
    within the plan carry `feedforward`, or SINGULAR; the share of the force exerted; and the number
    of null directions in `space`.
    """
    d, n = W.shape
    for k in range(d):
        missing[k] = feedforward[k] - force[k]
    _widen(plan, 0.0, bounds)
    _copy(plan[0], bounds[2])
    if null_space(W, feedforward, scale, bounds, scaled, space, scratch) < d:
        _copy(plan[0], t)
        _copy(plan[0], feedforward_tensions)
        return SINGULAR, 0.0, 0
    r = n - d
    _copy(space[0], particular[0])
    other_wrench(missing, scale, scaled, scratch, particular[1])
    outcome = OK
    if not external:
        outcome = _carry(
            feedforward, scale, plan, reserve, slow_share, r, slow_tensions, feedforward_tensions,
            t, missing, bounds, particular, scaled, space, scratch,
        )  # fmt: skip
    _widen(plan, reserve if outcome == INFEASIBLE else FAST * reserve, bounds)
    _copy(feedforward_tensions, bounds[2])
    _copy(particular[1], space[0])
    found = project(space, r, bounds, t, scratch)
    for k in range(d):
        scaled[k, n] = (force[k] - feedforward[k]) / scale[k]
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
    feedforward: FloatArray,
    scale: FloatArray,
    plan: FloatArray,
    reserve: float,
    slow_share: float,
    r: int,
    slow_tensions: FloatArray,
    feedforward_tensions: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    bounds: FloatArray,
    particular: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    scratch: FloatArray,
) -> int:
    """Write tensions that carry `feedforward`; `t` is overwritten. Returns the outcome."""
    n = t.size
    _widen(plan, _SLOW * reserve, bounds)
    _copy(particular[1], space[0])
    if project(space, r, bounds, t, scratch):
        for i in range(n):
            slow_tensions[i] += slow_share * (t[i] - slow_tensions[i])
    _widen(plan, 0.0, bounds)
    _copy(slow_tensions, bounds[2])
    _copy(particular[0], space[0])
    if project(space, r, bounds, feedforward_tensions, scratch):
        return OK
    for k in range(scale.size):
        scaled[k, n] = -feedforward[k] / scale[k]
    nearest_wrench(scaled, bounds, scale, False, feedforward_tensions, missing, scratch)
    return INFEASIBLE


@jit
def _widen(plan: FloatArray, by: float, bounds: FloatArray) -> None:
    for i in range(plan.shape[1]):
        bounds[0, i], bounds[1, i] = plan[0, i] - by, plan[1, i] + by


@jit
def _copy(values: FloatArray, into: FloatArray) -> None:
    for i in range(values.size):
        into[i] = values[i]
