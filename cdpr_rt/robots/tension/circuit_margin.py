"""Capacity margin of tensions in closed form, for up to d + 2 cables.

W t + w_e = 0, eq. (3.80), leaves t = t0 + N' lambda with r = n - d rows of N. A circuit is a y (n,)
with y N' = 0 and as few entries as there can be: r + 1 of them, the determinants of r columns of N
each. Along it y t = y t0 whatever lambda is, so that tensions that keep a margin m from bounds can
exist only where

    sum min(y_i low_i, y_i high_i) + m |y|_1 <= y t0 <= sum max(y_i low_i, y_i high_i) - m |y|_1,

and by Helly's theorem they do where that holds for all circuits. They are the normals of the facets
of the wrenches that the cables can exert (the hyperplane shifting method of Bouchard, Moore and
Gosselin, 2010), found without a determinant of more than two rows. Of wrenches w_0 + sum a_k g_k,
|a_k| <= 1, the worst along a circuit has y t0 changed by the sum of |y t(g_k)|: no corner of that
set is ever built.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.tension.null_space import add, null_space, other_wrench

MOST_NULL_DIRECTIONS: Final = 2
_NO_CIRCUIT = 1e-9
"""Columns of N, whose rows are of length 1, that are parallel but for this have no determinant."""


class WrenchSets(NamedTuple):
    """Wrenches that tensions within bounds have to carry, about one point of the platform."""

    centre: FloatArray
    """That point in the platform's frame, (3,)."""
    wrenches: FloatArray
    """(k, d): w_0 of one or several sets of wrenches first, and last the g_k that all share."""
    generators: int
    """Number of the g_k."""
    scale: FloatArray
    """Scale of wrenches, (d,), as of `TensionDistribution`."""
    bounds: FloatArray
    """(3, n): lower bounds, upper bounds, and their middle."""


@jit
def write_circuit_margins(
    matrices: FloatArray,
    hanging: FloatArray,
    sets: WrenchSets,
    least: float,
    margins: FloatArray,
    carrying: FloatArray,
    space: FloatArray,
    scaled: FloatArray,
    scratch: FloatArray,
) -> None:
    """Write the margins (m,) of m poses: of the worst wrench, N, -inf without a rank of d.

    `matrices` (m, d, n) are the W, n at most d + 2; `hanging` (m, d) is what acts besides the
    wrenches of each set. A margin that is found to be below `least` may
    be less still: nothing more is looked for then.
    `carrying` (k, n), `space` (n + 1, n), `scaled` (d, n + 1) and `scratch` as of `null_space` are
    overwritten.
    """
    _, wrenches, generators, scale, bounds = sets
    d, n = scale.size, bounds.shape[1]
    whole, shifted = scratch[3, 0, :d], wrenches.shape[0] - generators
    for j in range(margins.size):
        add(wrenches[0], hanging[j], whole)
        rank = null_space(matrices[j], whole, scale, bounds, scaled, space, scratch)
        if rank < d:
            margins[j] = -math.inf
            continue
        for i in range(n):
            carrying[0, i] = space[0, i]
        for k in range(1, wrenches.shape[0]):
            add(wrenches[k], hanging[j], whole)
            acting = whole if k < shifted else wrenches[k]
            other_wrench(acting, scale, scaled, scratch, carrying[k])
        margins[j] = circuit_margin(space, n - d, bounds, carrying, generators, least)


@jit
def circuit_margin(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    carrying: FloatArray,
    generators: int,
    least: float,
) -> float:
    """Return the margin of one pose: the least over all circuits, of r + 1 cables each."""
    n = space.shape[1]
    margin = math.inf
    for i in range(n):
        margin = min(margin, 0.5 * (bounds[1, i] - bounds[0, i]))
    for a in range(n):
        if r == 0:
            margin = _along(bounds, carrying, generators, margin, a, a, a, 1.0, 0.0, 0.0)
        for b in range(a + 1, n if r > 0 else 0):
            if r == 1:
                margin = _along(
                    bounds, carrying, generators, margin, a, b, b, space[1, b], -space[1, a], 0.0
                )
            for c in range(b + 1, n if r > 1 else 0):
                margin = _along(
                    bounds, carrying, generators, margin, a, b, c,
                    space[1, b] * space[2, c] - space[2, b] * space[1, c],
                    space[1, c] * space[2, a] - space[2, c] * space[1, a],
                    space[1, a] * space[2, b] - space[2, a] * space[1, b],
                )  # fmt: skip
            if margin < least:
                return margin
    return margin


@jit
def _along(
    bounds: FloatArray,
    carrying: FloatArray,
    generators: int,
    margin: float,
    a: int,
    b: int,
    c: int,
    u: float,
    v: float,
    w: float,
) -> float:
    """Return the lesser of `margin` and that along the circuit with u, v, w at cables a, b, c."""
    size = abs(u) + abs(v) + abs(w)
    if size < _NO_CIRCUIT:
        return margin
    sets = carrying.shape[0] - generators
    spread = 0.0
    for k in range(sets, carrying.shape[0]):
        spread += abs(u * carrying[k, a] + v * carrying[k, b] + w * carrying[k, c])
    low = min(u * bounds[0, a], u * bounds[1, a]) + min(v * bounds[0, b], v * bounds[1, b])
    low += min(w * bounds[0, c], w * bounds[1, c])
    high = max(u * bounds[0, a], u * bounds[1, a]) + max(v * bounds[0, b], v * bounds[1, b])
    high += max(w * bounds[0, c], w * bounds[1, c])
    for k in range(sets):
        there = u * carrying[k, a] + v * carrying[k, b] + w * carrying[k, c]
        margin = min(margin, (min(there - low, high - there) - spread) / size)
    return margin
