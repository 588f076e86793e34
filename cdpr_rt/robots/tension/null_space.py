"""All tensions that carry a wrench: a particular solution and the null space of the wrench matrix.

W t + w_e = 0, eq. (3.80), holds for every t = t0 + N' lambda, where the rows of N (r, n) are an
orthonormal basis of the null space of W (d, n), r = n - rank(W).
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

_RANK = 1e-9
"""Share of the longest column below which what is left of the others counts as nothing."""
_HUGE = 1e100
"""Larger entries count as infinite, since their squares may be."""


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
    (d,): A = W/scale and b = -w_e/scale are written as `scaled` = [A b] (d, n + 1). Where W has not
    full rank, t0 carries of the wrench what can be carried, by least squares in the scaled norm.
    `scratch` (4, m, m), m >= n and 8, is overwritten. Returns the rank, or -1 where W, w_e or
    `bounds` (3, n), the lower and upper ones and the wanted tensions, is not finite or of
    another size, or where a lower bound is above its upper one.
    """
    n = space.shape[1]
    d = scale.size
    if W.shape != (d, n) or w_e.size != d or not _scale(W, w_e, scale, bounds, scaled):
        return -1
    M, R, order, z = scratch[0], scratch[1], scratch[2, 0], scratch[2, 1]
    rank = _factor(scaled, d, n, M, R, order, scratch[2, 2])
    if rank == d:
        _solve(R, order, scaled[:, n], z)
    else:
        _least_squares(R, order, scaled[:, n], rank, z, scratch[3])
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

    `matrices` (m, d, n) are the W of the poses, `hanging` (m, d) what besides acts at each of them
    under every wrench; `spaces` (m, n + 1, n) as of `null_space` for the
    first wrench, `particular` (m, k, n) the t0 of every one, `null_directions` (m,) how many there
    are, -1 where W is not finite or has not full rank. `scaled` (d, n + 1) and `scratch` are
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
    """Write the `t0` (n,) of another wrench (d,) right after `null_space`, where W has full rank.

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

    `A` has n columns that count. The vectors v are the first columns of `M` from the diagonal on, R
    (rank, d) is the upper part of `R`, `order` (d,) the permutation; `squares` (d,) is overwritten.
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
        square = 0.0  # anew: those carried along lose digits
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
    first, end = np.uint64(k), np.uint64(n)  # unsigned, else each index is tried for its sign
    product = 0.0
    for i in range(first, end):
        product += M[i, first] * x[i]
    for i in range(first, end):
        x[i] -= product * M[i, first]


@jit
def _solve(R: FloatArray, order: FloatArray, b: FloatArray, z: FloatArray) -> None:
    """Write the z (d,) with R'z = P'b."""
    for k in range(b.size):
        value = b[int(order[k])]
        for j in range(k):
            value -= R[j, k] * z[j]
        z[k] = value / R[k, k]


@jit
def _least_squares(
    R: FloatArray, order: FloatArray, b: FloatArray, rank: int, z: FloatArray, Q: FloatArray
) -> None:
    """Write the z (rank,) that misses R'z = P'b least: Gram and Schmidt on the columns of R'."""
    d = b.size
    for k in range(rank):  # R' = Q U with U upper triangular, kept in R's place below the diagonal
        for i in range(d):
            Q[i, k] = R[k, i] if i >= k else 0.0
        z[k] = 0.0
    for k in range(rank):
        for j in range(k):
            R[k, j] = 0.0
        for _ in range(2):
            for j in range(k):
                product = 0.0
                for i in range(d):
                    product += Q[i, j] * Q[i, k]
                R[k, j] += product
                for i in range(d):
                    Q[i, k] -= product * Q[i, j]
        square = 0.0
        for i in range(d):
            square += Q[i, k] * Q[i, k]
        R[k, k] = math.sqrt(square)
        for i in range(d):
            Q[i, k] /= R[k, k]
            z[k] += Q[i, k] * b[int(order[i])]
    for k in range(rank - 1, -1, -1):  # U z = Q'P'b, U[j, k] in R[k, j]
        for j in range(k + 1, rank):
            z[k] -= R[j, k] * z[j]
        z[k] /= R[k, k]
