"""Kernel of tension distribution: the tensions of one method, checked, or those that come nearest.

One call for all of it: from Python a call costs as much as a third of what it computes.
"""

from __future__ import annotations

from typing import Final

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.nearest_wrench import NO_LIMIT, nearest_wrench
from cdpr_rt.robots.tension.null_space import null_space
from cdpr_rt.robots.tension.tension_closed_form import closed_form
from cdpr_rt.robots.tension.tension_polygon import CENTROID, choose
from cdpr_rt.robots.tension.tension_qp import project

MINIMUM_DEVIATION: Final = CENTROID + 1
"""The tensions within bounds nearest to wanted ones; continuous in W, w_e and bounds."""
CLOSED_FORM: Final = CENTROID + 2
"""Pott's closed form about the wanted tensions; where it finds none, those nearest to them."""

_FEASIBLE: Final = int(TensionOutcome.FEASIBLE)
_SUBSTITUTED: Final = int(TensionOutcome.SUBSTITUTED)
_NEAREST: Final = int(TensionOutcome.NEAREST)
_SINGULAR: Final = int(TensionOutcome.SINGULAR)
REFUSED: Final = int(TensionOutcome.REFUSED)


@jit
def distribute(
    method: int,
    W: FloatArray,
    w_e: FloatArray,
    scale: FloatArray,
    bounds: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    scratch: FloatArray,
) -> tuple[int, int]:
    """Write the tensions `t` (n,) for W (d, n) and w_e (d,), and -(W t + w_e) as `missing` (d,).

    `method` is one of the above or a point of the polygon of `tension_polygon`. `bounds` (3, n) are
    the lower and upper ones and the wanted tensions, `scale` (d,) what of a direction counts as
    much as 1 N. `scaled` (d, n + 1), `space` (n + 1, n) and `scratch` (4, m, m), m >= n and 8, are
    overwritten. Returns the outcome, and what limits as of `nearest_wrench`.
    """
    n = space.shape[1]
    rank = null_space(W, w_e, scale, bounds, scaled, space, scratch) if t.size == n else -1
    if rank < 0:
        return REFUSED, NO_LIMIT
    r = n - rank
    own = found = method == CLOSED_FORM and closed_form(space, r, bounds, t, scratch)
    if not found:
        found = project(space, r, bounds, t, scratch)
        own = method == MINIMUM_DEVIATION
        if found and method <= CENTROID:
            own = choose(space, r, bounds, method, t, scratch)
    limit = nearest_wrench(scaled, bounds, scale, found, t, missing, scratch)
    if rank < scale.size:
        return _SINGULAR, limit
    if limit != NO_LIMIT:
        return _NEAREST, limit
    return (_SUBSTITUTED if found and not own else _FEASIBLE), limit
