"""All tensions that carry a wrench: a particular solution and the null space of the wrench matrix.

W t + w_e = 0, eq. (3.80), holds for every t = t0 + N' lambda, where the rows of N (r, n) are an
orthonormal basis of the null space of W (d, n), r = n - rank(W).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

_RANK = 1e-9
"""Share of the longest column below which the remainder of the others counts as zero."""
_HUGE = 1e100
"""Larger entries count as infinite, because their squares may overflow."""


@jit
def null_space(
    W: FloatArray,
    w_e: FloatArray,
    scale: FloatArray,
    bounds: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    scratch: FloatArray,
) -> int:
    """Write the tensions that carry a wrench: `space` (n + 1, n), t0 first, then the rows of N.

    t0 has the least norm; n - rank rows of N are valid. Rows of W t = -w_e are divided by `scale`
    (d,): A = W/scale and b = -w_e/scale are written as `scaled` = [A b] (d, n + 1). If W is rank
    deficient, `space` is not written. `scratch` (4, m, m), m >= n and 8, is overwritten. The rows
    of `bounds` (3, n) are lower bounds, upper bounds and wanted tensions. Returns the rank, or -1
    if W, w_e or `bounds` is not finite or has another size, or if a lower bound is above its upper
    bound.
    """
    n = space.shape[1]
    d = scale.size
    if W.shape != (d, n) or w_e.size != d or not _scale(W, w_e, scale, bounds, scaled):
        return -1
    M, R, order, z = scratch[0], scratch[1], scratch[2, 0], scratch[2, 1]
    rank = _factor(scaled, d, n, M, R, order, scratch[2, 2])
    if rank < d:
        return rank
    _solve(R, order, scaled[:, n], z)
    for j in range(n - rank + 1):  # Q (z, 0) and Q's last columns
        for i in range(n):
            space[j, i] = 0.0 if j > 0 or i >= rank else z[i]
        if j > 0:
            space[j, rank + j - 1] = 1.0
        for k in range(rank - 1, -1, -1):
            _reflect(M, k, n, space[j])
    return rank


@jit
def null_spaces(
    matrices: FloatArray,
    hanging: FloatArray,
    wrenches: FloatArray,
    scale: FloatArray,
    bounds: FloatArray,
    spaces: FloatArray,
    particular: FloatArray,
    null_directions: IntArray,
    scaled: FloatArray,
    scratch: FloatArray,
) -> None:
    """Write the tensions that carry each of k wrenches (k, d) at each of m poses.

    `matrices` (m, d, n) has W of each pose. `hanging` (m, d) is a wrench per pose that is added to
    every wrench. Written are `spaces` (m, n + 1, n), as in `null_space` for the first wrench,
    `particular` (m, k, n), t0 of each wrench, and `null_directions` (m,), the number of null
    directions, -1 if W is not finite or rank deficient. `scaled` (d, n + 1) and `scratch` are
    overwritten.
    """
    m, d, n = matrices.shape
    whole = scratch[3, 0, :d]
    for j in range(m):
        add(wrenches[0], hanging[j], whole)
        rank = null_space(matrices[j], whole, scale, bounds, scaled, spaces[j], scratch)
        null_directions[j] = n - rank if rank == d else -1
        if rank < d:
            continue
        for i in range(n):
            particular[j, 0, i] = spaces[j, 0, i]
        for k in range(1, wrenches.shape[0]):
            add(wrenches[k], hanging[j], whole)
            other_wrench(whole, scale, scaled, scratch, particular[j, k])


@jit
def add(wrench: FloatArray, other: FloatArray, both: FloatArray) -> None:
    """Write the sum of two wrenches into `both`, (d,) each."""
    for i in range(both.size):
        both[i] = wrench[i] + other[i]


@jit
def other_wrench(
    w_e: FloatArray, scale: FloatArray, scaled: FloatArray, scratch: FloatArray, t0: FloatArray
) -> None:
    """Write the `t0` (n,) of another wrench (d,) directly after `null_space`, if W has full rank.

    `scaled` and `scratch` are those of that call; the wrench's column of `scaled` is overwritten.
    """
    d, n = scale.size, t0.size
    for i in range(d):
        scaled[i, n] = -w_e[i] / scale[i]
    z = scratch[2, 1]
    _solve(scratch[1], scratch[2, 0], scaled[:, n], z)
    for i in range(n):
        t0[i] = z[i] if i < d else 0.0
    for i in range(d - 1, -1, -1):
        _reflect(scratch[0], i, n, t0)


@jit
def _scale(
    W: FloatArray, w_e: FloatArray, scale: FloatArray, bounds: FloatArray, scaled: FloatArray
) -> bool:
    """Write [W -w_e] divided by the scale; return whether all is finite and bounds are in order."""
    d, n = W.shape
    total, ordered = 0.0, True
    for k in range(d):
        share = 1.0 / scale[k]
        for i in range(n):
            scaled[k, i] = W[k, i] * share
            total += abs(scaled[k, i])
        scaled[k, n] = -w_e[k] * share
        total += abs(scaled[k, n])
    for i in range(n):
        ordered = ordered and bounds[0, i] <= bounds[1, i]
        for row in range(3):
            total += abs(bounds[row, i])
    return ordered and total < _HUGE


@jit
def _factor(
    A: FloatArray,
    d: int,
    n: int,
    M: FloatArray,
    R: FloatArray,
    order: FloatArray,
    squares: FloatArray,
) -> int:
    """Factor A'P = Q R by Householder reflections I - v v' with column pivots; return the rank.

    Only the first n columns of `A` are used. The vectors v are written to the first columns of `M`,
    from the diagonal down, R (rank, d) to the upper part of `R`, and the permutation to `order`
    (d,). `squares` (d,) is overwritten.
    """
    for k in range(d):
        order[k], squares[k] = k, 0.0
        for i in range(n):
            M[i, k] = A[k, i]
            squares[k] += M[i, k] * M[i, k]
    longest, rank = 0.0, 0
    for k in range(d):
        best = k
        for j in range(k + 1, d):
            if squares[j] > squares[best]:
                best = j
        square = 0.0  # computed again, because updated values lose digits
        for i in range(k, n):
            square += M[i, best] * M[i, best]
        norm = math.sqrt(square)
        longest = max(longest, norm)
        if norm <= _RANK * longest:
            break
        rank += 1
        if best != k:
            order[k], order[best] = order[best], order[k]
            squares[best] = squares[k]
            for i in range(n):
                M[i, k], M[i, best] = M[i, best], M[i, k]
            for i in range(k):
                R[i, k], R[i, best] = R[i, best], R[i, k]
        R[k, k] = -norm if M[k, k] > 0.0 else norm
        M[k, k] -= R[k, k]
        length = 1.0 / math.sqrt(-R[k, k] * M[k, k])
        for i in range(k, n):
            M[i, k] *= length
        for j in range(k + 1, d):
            _reflect(M, k, n, M[:, j])
            R[k, j] = M[k, j]
            squares[j] -= R[k, j] * R[k, j]
    return rank


@jit
def _reflect(M: FloatArray, k: int, n: int, x: FloatArray) -> None:
    """Apply I - v v', v the column `k` of `M` from the diagonal on, to `x` (n,)."""
    first, end = np.uint64(k), np.uint64(n)  # signed indices would each be tested for their sign
    product = 0.0
    for i in range(first, end):
        product += M[i, first] * x[i]
    for i in range(first, end):
        x[i] -= product * M[i, first]


@jit
def _solve(R: FloatArray, order: FloatArray, b: FloatArray, z: FloatArray) -> None:
    """Write the solution z (d,) of R'z = P'b."""
    for k in range(b.size):
        value = b[int(order[k])]
        for j in range(k):
            value -= R[j, k] * z[j]
        z[k] = value / R[k, k]


# Capacity margin of tensions in closed form, for up to d + 2 cables. The solutions of W t + w_e =
# 0, eq. (3.80), are t = t0 + N' lambda with r = n - d rows of N. A circuit is a y (n,) with y N' =
# 0 and as few entries as possible: r + 1 of them, the determinants of r columns of N each. Along it
# y t = y t0 for all lambda, so tensions that keep a margin m from bounds can exist only if sum
# min(y_i low_i, y_i high_i) + m |y|_1 <= y t0 <= sum max(y_i low_i, y_i high_i) - m |y|_1. By
# Helly's theorem they do exist if that holds for all circuits. The circuits are the normals of the
# facets of the wrenches that the cables can exert (the hyperplane shifting method of Bouchard,
# Moore and Gosselin, 2010), found without a determinant of more than two rows. For wrenches w_0 +
# sum a_k g_k, |a_k| <= 1, the worst along a circuit changes y t0 by the sum of |y t(g_k)|, so the
# corners of that set are not needed.

MOST_NULL_DIRECTIONS: Final = 2
_NO_CIRCUIT = 1e-9
"""Two columns of N with a smaller determinant count as parallel; rows of N have length 1."""


class WrenchSets(NamedTuple):
    """Wrenches about one point of the platform that tensions within bounds have to carry."""

    centre: FloatArray
    """That point in the platform's frame, (3,)."""
    wrenches: FloatArray
    """(k, d): first w_0 of each set of wrenches, then the generators g_k that all sets share."""
    generators: int
    """Number of the g_k."""
    scale: FloatArray
    """Scale of wrenches, (d,), as in `TensionDistribution`."""
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
    """Write the margins (m,) of m poses for the worst wrench, N; -inf if W is rank deficient.

    `matrices` (m, d, n) has W of each pose, with n at most d + 2. `hanging` (m, d) acts in addition
    to the wrenches of each set. If a margin is below `least`, the true one may be lower still,
    because the search stops there. `carrying` (k, n), `space` (n + 1, n), `scaled` (d, n + 1) and
    `scratch` as in `null_space` are overwritten.
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
    """Return the lesser of `margin` and that of the circuit with u, v, w at cables a, b, c."""
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
