"""The wrenches that tensions within bounds exert, as half-spaces: facets of a zonotope."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

_FLAT: Final = 1e-9


@jit
def _largest(scratch: FloatArray, r: int) -> tuple[int, int]:
    """Return row and column of the entry that is farthest from 0, from r on, of (d - 1, d)."""
    row, column = r, r
    for i in range(r, scratch.shape[0] - 1):
        for k in range(r, scratch.shape[1]):
            if abs(scratch[i, k]) > abs(scratch[row, column]):
                row, column = i, k
    return row, column


@jit
def _normal(W: FloatArray, columns: IntArray, scratch: FloatArray, normal: FloatArray) -> bool:
    """Write the direction (d,) at right angles to d - 1 columns of W; False where there are more.

    Gauss' elimination with full pivoting.
    """
    d = W.shape[0]
    order = np.arange(d)
    for r in range(d - 1):
        for k in range(d):
            scratch[r, k] = W[k, columns[r]]
    for r in range(d - 1):
        row, column = _largest(scratch, r)
        if abs(scratch[row, column]) < _FLAT:
            return False
        for k in range(d):
            scratch[r, k], scratch[row, k] = scratch[row, k], scratch[r, k]
        for i in range(d - 1):
            scratch[i, r], scratch[i, column] = scratch[i, column], scratch[i, r]
        order[r], order[column] = order[column], order[r]
        for i in range(d - 1):
            if i != r:
                factor = scratch[i, r] / scratch[r, r]
                for k in range(r, d):
                    scratch[i, k] -= factor * scratch[r, k]
    size = 1.0
    for r in range(d - 1):
        normal[order[r]] = -scratch[r, d - 1] / scratch[r, r]
        size += normal[order[r]] ** 2
    normal[order[d - 1]] = 1.0
    normal /= np.sqrt(size)
    return True


@jit
def write_facets(
    matrices: FloatArray,
    scale: FloatArray,
    combinations: IntArray,
    low: FloatArray,
    high: FloatArray,
    normals: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Write normals (m, f, d) and bounds (m, f) of the wrenches W t at m poses, low <= t <= high.

    Each d - 1 cables of `combinations` (f, d - 1) span a facet on both sides: hyperplane shifting
    (Bouchard, Gosselin, Moore 2010; Gouttefarde, Krut 2010). Combinations that span less get a
    normal of 0 within 0. `matrices` (m, d, n) are those by which tensions act, `scale` (d,) what of
    each direction counts as much as 1 N.
    """
    m, d, n = matrices.shape
    W, scratch = np.zeros((d, n)), np.zeros((d, d))
    for j in range(m):
        for k in range(d):
            for i in range(n):
                W[k, i] = matrices[j, k, i] / scale[k]
        for f in range(combinations.shape[0]):
            normal = normals[j, f]
            lower[j, f] = upper[j, f] = 0.0
            if not _normal(W, combinations[f], scratch, normal):
                normal[:] = 0.0
                continue
            for i in range(n):
                along = 0.0
                for k in range(d):
                    along += normal[k] * W[k, i]
                lower[j, f] += min(along * low[i], along * high[i])
                upper[j, f] += max(along * low[i], along * high[i])
            for k in range(d):
                normal[k] /= scale[k]
