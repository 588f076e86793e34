"""Kernel of a loop's design: whether a loop keeps its margin at all frequencies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

ComplexArray = NDArray[np.complex128]


@jit
def keeps_margin(
    plants: ComplexArray,
    of_speed: ComplexArray,
    of_place: ComplexArray,
    damping: FloatArray,
    stiffness: FloatArray,
    least: float,
    scratch: ComplexArray,
) -> bool:
    """Return whether no singular value of any return difference S = 1 + C G is below `least`.

    `plants` (m, k, f, d, d) are G at m poses with k stiffnesses, and C is diagonal: `of_speed`
    (f,) times `damping` (m, d) and `of_place` (f,) times `stiffness` (m, d). They are not while
    S^H S - least² 1 has a Cholesky factor, nor, which is quicker to see, where each |s_aa| is above
    half the sum of what is beside it in its row and its column by `least` (C. R. Johnson, A
    Gersgorin-type lower bound for the smallest singular value, 1989). `scratch` (2, d, d) is
    overwritten.
    """
    m, k, f, d, _ = plants.shape
    S, H = scratch[0], scratch[1]
    for j in range(m):
        for i in range(k):
            for w in range(f):
                for a in range(d):
                    C = of_speed[w] * damping[j, a] + of_place[w] * stiffness[j, a]
                    for b in range(d):
                        S[a, b] = C * plants[j, i, w, a, b]
                    S[a, a] += 1.0
                if not _is_dominated(S, least) and not _is_positive_definite(S, H, least * least):
                    return False
    return True


@jit
def _is_dominated(S: ComplexArray, least: float) -> bool:
    """Return whether the diagonal of `S` (d, d) bounds its singular values by `least` from below.

    |re| + |im| stands for the amounts beside it, which takes no roots and is never less.
    """
    d = S.shape[0]
    for a in range(d):
        beside = 0.0
        for b in range(d):
            if b != a:
                row, column = S[a, b], S[b, a]
                beside += abs(row.real) + abs(row.imag) + abs(column.real) + abs(column.imag)
        bound = least + 0.5 * beside
        if not S[a, a].real ** 2 + S[a, a].imag ** 2 > bound * bound:
            return False
    return True


@jit
def _is_positive_definite(S: ComplexArray, H: ComplexArray, square: float) -> bool:
    """Return whether S^H S - square 1 is positive definite; its factor goes into `H`."""
    d = S.shape[0]
    for b in range(d):
        for a in range(b, d):
            entry = 0j
            for k in range(d):
                entry += S[k, a] * S[k, b].conjugate()
            for k in range(b):
                entry -= H[a, k] * H[b, k].conjugate()
            if a == b:
                pivot = entry.real - square
                if not pivot > 0.0:
                    return False
                H[b, b] = np.sqrt(pivot)
            else:
                H[a, b] = entry / H[b, b].real
    return True
