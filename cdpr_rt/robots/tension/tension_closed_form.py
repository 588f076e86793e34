"""Tensions without search: Pott's closed form (2009), improved (2013)."""

from __future__ import annotations

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.tension.tension_qp import NOTHING, furthest_outside, gram_schmidt, start


@jit
def closed_form(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    t: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Write the tensions t_m - W^+(w_e + W t_m) (n,) nearest to wanted ones t_m.

    While one is outside its bounds, the one furthest outside is put on the bound and the others are
    computed anew, until none of the `r` null directions of `space` (n + 1, n) is left, which is
    that of `null_space`, as are `bounds` (3, n). `scratch` (4, m, m), m >= n and 8, is overwritten.
    Returns False where that leads to no tensions within bounds, which does not prove that there are
    none.
    """
    Q, x, column, c, free = scratch[0], scratch[1, 0], scratch[1, 1], scratch[1, 2], scratch[1, 3]
    tolerance = start(space, r, bounds, x)
    for fixed in range(r + 1):
        cable, violation = furthest_outside(space, r, bounds, x, t, tolerance)
        if cable < 0:
            return True
        if fixed == r:
            return False
        for k in range(r):
            column[k] = space[1 + k, cable]
        # what moves this cable's tension and none of those that are fixed
        length = gram_schmidt(column, r, Q, fixed, c, free)
        if length <= NOTHING:
            return False
        for k in range(r):
            Q[k, fixed] = free[k] / length
            x[k] += violation / length * Q[k, fixed]
    return False
