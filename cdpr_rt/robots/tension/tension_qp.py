"""The tensions within bounds that deviate least from wanted ones, eq. (3.80), in the null space.

With t = t0 + N' lambda and N orthonormal, min |t - t_wanted|, W t + w_e = 0, low <= t <= high is
the projection of a point on a polyhedron of r = n - rank(W) dimensions. The dual active-set method
of Goldfarb and Idnani (1983), whose Hessian is the identity here, ends after finitely many steps,
with the projection or with bounds that contradict each other.
"""

from __future__ import annotations

import math
from typing import Final

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

NOTHING: Final = 1e-9
"""A row of N, or what is left of a unit normal, shorter than this does not reach anywhere."""
_BOUNDS = 1e-12
"""Share of the largest tension by which a bound may be missed."""


@jit
def project(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    t: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Write the tensions t = t0 + N' lambda (n,) within bounds nearest to the wanted ones.

    `space` (n + 1, n) is that of `null_space` with `r` null directions, as are `bounds` (3, n).
    `scratch` (4, m, m), m >= n and 8, is overwritten. Returns False where there are none: those
    cables are at their bounds then whose bounds contradict each other, and all others between
    theirs.
    """
    cable, active = _search(space, r, bounds, t, scratch)
    if cable < 0:
        return True
    _contradict(t, bounds, cable, active, scratch[3, 4], scratch[3, 7])
    return False


@jit
def write_margins(
    spaces: FloatArray,
    particular: FloatArray,
    null_directions: IntArray,
    bounds: FloatArray,
    most: float,
    margins: FloatArray,
    tensions: FloatArray,
    shrunk: FloatArray,
    scratch: FloatArray,
) -> None:
    """Write how far tensions can stay from all their bounds, at m poses under k wrenches each.

    `spaces` (m, n + 1, n), `particular` (m, k, n) and `null_directions` (m,) are those of
    `null_spaces`, `bounds` (3, n) as of `project`. `margins` (m,) are those of the worst wrench, at
    the most `most`, N: below zero by how much some tension must be outside, -inf where the cables
    cannot hold one direction. `tensions` (m, n) are that wrench's, with that margin. `shrunk`
    (3, n) and `scratch` (4, l, l), l >= n and 8, are overwritten.
    """
    n = spaces.shape[2]
    for j in range(margins.size):
        margins[j] = most
        if null_directions[j] < 0:
            margins[j] = -math.inf
            for i in range(n):
                tensions[j, i] = math.nan
            continue
        for k in range(particular.shape[1]):
            for i in range(n):
                spaces[j, 0, i] = particular[j, k, i]
            margin = _margin(
                spaces[j], null_directions[j], bounds, margins[j], tensions[j], shrunk, scratch,
                k == 0,
            )  # fmt: skip
            margins[j] = min(margins[j], margin)


@jit
def _margin(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    most: float,
    t: FloatArray,
    shrunk: FloatArray,
    scratch: FloatArray,
    written: bool,
) -> float:
    """Return the greatest margin up to `most` to all bounds, and write tensions (n,) that have it.

    Tensions are written where the margin is less than `most`, or `written`. Margins are tried from
    above, each a vertex of the dual, of which there are finitely many.
    """
    n = space.shape[1]
    found, margin = shrunk[3], most
    for i in range(n):
        margin = min(margin, 0.5 * (bounds[1, i] - bounds[0, i]))
        shrunk[2, i] = bounds[2, i]
    while True:
        for i in range(n):
            shrunk[0, i], shrunk[1, i] = bounds[0, i] + margin, bounds[1, i] - margin
        cable, active = _search(space, r, shrunk, found, scratch)
        if cable < 0:
            break
        side = 1.0 if found[cable] < shrunk[0, cable] else -1.0
        before, margin = margin, _most_margin(space, r, bounds, cable, side, active, scratch)
        if not margin < before:  # by less than rounding
            margin = before
            break
    if margin < most or written:
        for i in range(n):
            t[i] = found[i]
    return margin


@jit
def _most_margin(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    cable: int,
    side: float,
    active: int,
    scratch: FloatArray,
) -> float:
    """Return the greatest margin that bounds leave which contradict each other, moved inward by it.

    They are those of `_search`, the `cable`'s that is below (`side` 1.0) or above (-1.0) among
    them. By the weights y with which they do, sum of y_i (e_i + margin) = 0, e_i being how far
    inside t0 bound i lies.
    """
    length = 0.0
    for k in range(r):
        length += space[1 + k, cable] ** 2
    weight = 1.0 / math.sqrt(length) if active > 0 else 1.0
    total = weight
    error = weight * side * (bounds[0 if side > 0.0 else 1, cable] - space[0, cable])
    for j in range(active):
        i = int(scratch[3, 7, j])
        along, length = 0.0, 0.0
        for k in range(r):
            along += scratch[0, k, j] * space[1 + k, i]
            length += space[1 + k, i] ** 2
        weight = max(-scratch[3, 4, j], 0.0) / math.sqrt(length)
        side = 1.0 if along > 0.0 else -1.0
        total += weight
        error += weight * side * (bounds[0 if side > 0.0 else 1, i] - space[0, i])
    margin: float = -error / total
    return margin


@jit
def _search(
    space: FloatArray, r: int, bounds: FloatArray, t: FloatArray, scratch: FloatArray
) -> tuple[int, int]:
    """Write t = t0 + N'x nearest to what is wanted while bounds are still missed, one by one.

    Returns the cable of the bound that contradicts others, -1 where none does, and how many those
    are: in `scratch`, [3, 7] has their cables, [3, 4] the parts of its normal along theirs, which
    are columns of [0]. 0 where it is no null direction that moves the cable.
    """
    x, unit = scratch[3, 0], scratch[3, 1]
    tolerance = start(space, r, bounds, x)
    active, cable = 0, -1
    for _ in range(20 * space.shape[1]):
        cable, violation = furthest_outside(space, r, bounds, x, t, tolerance)
        if cable < 0:
            return -1, active
        length = 0.0
        for k in range(r):
            length += space[1 + k, cable] * space[1 + k, cable]
        length = math.sqrt(length)
        side = 1.0 if violation > 0.0 else -1.0
        if length <= NOTHING:
            return cable, 0
        for k in range(r):
            unit[k] = side * space[1 + k, cable] / length
        scratch[3, 7, active] = cable
        active, added = _add(x, unit, r, abs(violation) / length, active, scratch)
        if not added:
            break
    return cable, active


@jit
def start(space: FloatArray, r: int, bounds: FloatArray, x: FloatArray) -> float:
    """Write the lambda x (r,) of the tensions nearest to the wanted ones, whatever their bounds.

    Returns by how much a bound may be missed.
    """
    n = space.shape[1]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(space[0, i]), abs(bounds[0, i]), abs(bounds[1, i]))
    for k in range(r):
        x[k] = 0.0
        for i in range(n):
            x[k] += space[1 + k, i] * (bounds[2, i] - space[0, i])
    return _BOUNDS * largest


@jit
def furthest_outside(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    x: FloatArray,
    t: FloatArray,
    tolerance: float,
) -> tuple[int, float]:
    """Write t = t0 + N'x; return the cable furthest outside its bounds and by how much.

    Positive where the tension must grow. The cable is -1 where all are within.
    """
    cable, worst = -1, 0.0
    for i in range(space.shape[1]):
        t[i] = space[0, i]
        for k in range(r):
            t[i] += space[1 + k, i] * x[k]
        outside = max(bounds[0, i] - t[i], 0.0) + min(bounds[1, i] - t[i], 0.0)
        if abs(outside) > max(tolerance, abs(worst)):
            cable, worst = i, outside
    return cable, worst


@jit
def gram_schmidt(
    unit: FloatArray, r: int, Q: FloatArray, active: int, c: FloatArray, z: FloatArray
) -> float:
    """Write c = Q'unit and z = unit - Q c, by Gram and Schmidt twice; return the length of z."""
    for k in range(r):
        z[k] = unit[k]
    for j in range(active):
        c[j] = 0.0
    for _ in range(2):
        for j in range(active):
            product = 0.0
            for k in range(r):
                product += Q[k, j] * z[k]
            c[j] += product
            for k in range(r):
                z[k] -= product * Q[k, j]
    square = 0.0
    for k in range(r):
        square += z[k] * z[k]
    return math.sqrt(square)


@jit
def _contradict(
    t: FloatArray,
    bounds: FloatArray,
    cable: int,
    active: int,
    step: FloatArray,
    cables: FloatArray,
) -> None:
    """Put the cables that contradict each other on their bounds, all others between theirs."""
    for i in range(t.size):
        bound = bounds[0, i] if t[i] < 0.5 * (bounds[0, i] + bounds[1, i]) else bounds[1, i]
        contradicts = i == cable
        for j in range(active):
            contradicts = contradicts or (i == int(cables[j]) and step[j] < -NOTHING)
        t[i] = bound if contradicts else 0.5 * (bounds[0, i] + bounds[1, i])


@jit
def _add(
    x: FloatArray, unit: FloatArray, r: int, distance: float, active: int, scratch: FloatArray
) -> tuple[int, bool]:
    """Move `x` (r,) until the constraint with normal `unit`, `distance` away, holds and is active.

    Constraints that would have to push the other way are dropped before. Returns how many are
    active then, and False where those that are leave no room for it. In `scratch`: [0] the active
    normals as columns, [1] an orthonormal basis Q of them, [2] the U by which they are Q U, [3]
    vectors, the last of which has the cables of the active ones and of this one.
    """
    normals, Q, U = scratch[0], scratch[1], scratch[2]
    multipliers, c, step, z = scratch[3, 2], scratch[3, 3], scratch[3, 4], scratch[3, 5]
    own = 0.0
    while True:
        left = gram_schmidt(unit, r, Q, active, c, z)
        first, drop = _first_to_drop(U, c, active, multipliers, step)
        whole = distance / (left * left) if left > NOTHING else math.inf
        reach = min(first, whole)
        if reach == math.inf:
            return active, False
        for j in range(active):
            multipliers[j] -= reach * step[j]
        own += reach
        if whole < math.inf:
            for k in range(r):
                x[k] += reach * z[k]
            distance -= reach * left * left
        if whole <= first:
            break
        active = _drop(normals, Q, U, scratch[3], r, drop, active)
    for k in range(r):
        normals[k, active] = unit[k]
        Q[k, active] = z[k] / left
    for j in range(active):
        U[j, active] = c[j]
    U[active, active] = left
    multipliers[active] = own
    return active + 1, True


@jit
def _first_to_drop(
    U: FloatArray, c: FloatArray, active: int, multipliers: FloatArray, step: FloatArray
) -> tuple[float, int]:
    """Solve U step = c; return when the first multiplier falls to 0 along -step, and which."""
    first, drop = math.inf, -1
    for j in range(active - 1, -1, -1):
        step[j] = c[j]
        for k in range(j + 1, active):
            step[j] -= U[j, k] * step[k]
        step[j] /= U[j, j]
        if step[j] > NOTHING and multipliers[j] < first * step[j]:
            first, drop = multipliers[j] / step[j], j
    return first, drop


@jit
def _drop(
    normals: FloatArray,
    Q: FloatArray,
    U: FloatArray,
    vectors: FloatArray,
    r: int,
    drop: int,
    active: int,
) -> int:
    """Take one active constraint out and factor those behind it anew; return how many are left."""
    multipliers, c, cables = vectors[2], vectors[6], vectors[7]
    for j in range(drop, active):
        cables[j] = cables[j + 1]
    for j in range(drop, active - 1):
        multipliers[j] = multipliers[j + 1]
        for k in range(r):
            normals[k, j] = normals[k, j + 1]
        left = gram_schmidt(normals[:, j], r, Q, j, c, Q[:, j])
        for k in range(r):
            Q[k, j] /= left
        for i in range(j):
            U[i, j] = c[i]
        U[j, j] = left
    return active - 1
