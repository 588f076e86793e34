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
"""A row of N, or the remainder of a unit normal, shorter than this counts as zero."""
_BOUNDS = 1e-12
"""Share of the largest tension by which a tension may violate its bound."""


@jit
def project(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    t: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Write the tensions t = t0 + N' lambda (n,) within bounds nearest to the wanted ones.

    `space` (n + 1, n) and `bounds` (3, n) are those of `null_space`, with `r` null directions.
    `scratch` (4, m, m) is overwritten; m is at least n and at least 8. Returns False if no tensions
    are within their bounds. Then the tensions whose bounds contradict each other are at these
    bounds, and all other tensions are within theirs.
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
    """Write the margins of tensions to all their bounds, at m poses under k wrenches each.

    `spaces` (m, n + 1, n), `particular` (m, k, n) and `null_directions` (m,) are those of
    `null_spaces`, `bounds` (3, n) as in `project`. `margins` (m,) are those of the worst wrench, N,
    at most `most`. A negative margin is the amount by which some tension must be outside its
    bounds; -inf means that the cables cannot hold a direction. `tensions` (m, n) have that margin
    and carry that wrench. `shrunk` (3, n) and `scratch` (4, l, l), l >= n and 8, are overwritten.
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

    Tensions are written if the margin is less than `most`, or if `written` is true. Margins are
    tried from the highest. Each is a vertex of the dual problem, and the number of vertices is
    finite.
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
        if not margin < before:  # the difference is only rounding
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
    """Return the greatest margin by which contradicting bounds can be moved inward.

    The bounds are those of `_search`. The tension of `cable` is below (`side` 1.0) or above (-1.0)
    its bound. The contradiction has weights y, with sum of y_i (e_i + margin) = 0. Here e_i is how
    far t0 is inside bound i.
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
    """Write t = t0 + N'x nearest to the wanted tensions, adding violated bounds one by one.

    Returns the cable whose bound contradicts others, -1 if there is no contradiction, and the
    number of these other bounds. In `scratch`, [3, 7] has the cables of the others, the columns of
    [0] are their normals, and [3, 4] has the coefficients of the cable's normal in terms of these.
    The number is 0 if no null direction changes the cable's tension.
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
    """Write the lambda x (r,) of the tensions nearest to the wanted ones, ignoring the bounds.

    Returns the tolerance of the bounds.
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

    The amount is positive if the tension must grow. The cable is -1 if all tensions are within
    bounds.
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
    """Write c = Q'unit and z = unit - Q c by Gram-Schmidt, twice; return the length of z."""
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
    """Set tensions with contradicting bounds to these bounds, and clip all others to theirs."""
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

    Constraints whose multipliers would become negative are dropped first. Returns the number of
    active constraints, and False if the new one contradicts them. `scratch` contains: [0] the
    active normals as columns, [1] an orthonormal basis Q of these, [2] the factor U, normals = Q U,
    [3] vectors; the last one has the cables of the active constraints and of the new one.
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
    """Solve U step = c; return at which step a multiplier first falls to 0, and its index."""
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
    """Remove one active constraint and refactor those behind it; return how many are left."""
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


# Check of tensions; if no tensions within bounds carry the wrench, those that come nearest.

_ROUNDING = 1e-9
"""Allowed error of the wrench, as a share of its largest terms."""
_INDEPENDENT = 1e-9
"""Share of a column that must be independent of the columns of the free cables."""


@jit
def nearest_wrench(
    scaled: FloatArray,
    bounds: FloatArray,
    scale: FloatArray,
    found: bool,
    t: FloatArray,
    missing: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Check the tensions `t` (n,), or replace them by those with A t nearest to b.

    `scaled` = [A b] (d, n + 1), with A = W/scale and b = -w_e/scale, and `bounds` (3, n) are those
    of `null_space`. If `found`, `t` is only clipped to its bounds, because of rounding. Otherwise
    `t` is the start of the search, and the cables between their bounds are free at first. Writes
    `missing` = -(W t + w_e) (d,). `scratch` (4, m, m), m >= n and 8, is overwritten. Returns
    whether the wrench is exerted.
    """
    d, n = missing.size, t.size
    for i in range(n):
        t[i] = min(max(t[i], bounds[0, i]), bounds[1, i])
    if not found:
        _bounded_least_squares(scaled, bounds, t, missing, scratch)
    distance = _missing(scaled, t, missing)
    size = 0.0
    for k in range(d):
        size += abs(scaled[k, n])
        for i in range(n):
            size += abs(scaled[k, i] * t[i])
    for k in range(d):
        missing[k] *= scale[k]
    return distance <= _ROUNDING * size


@jit
def _missing(scaled: FloatArray, t: FloatArray, missing: FloatArray) -> float:
    """Write b - A t (d,) and return its length."""
    square = 0.0
    for k in range(missing.size):
        missing[k] = scaled[k, t.size]
        for i in range(t.size):
            missing[k] -= scaled[k, i] * t[i]
        square += missing[k] * missing[k]
    return math.sqrt(square)


@jit
def _gradient(scaled: FloatArray, missing: FloatArray, i: int) -> float:
    """Return a'(b - A t), where a is the column of cable `i`."""
    pull = 0.0
    for k in range(missing.size):
        pull += scaled[k, i] * missing[k]
    return pull


@jit
def _bounded_least_squares(
    scaled: FloatArray, bounds: FloatArray, t: FloatArray, missing: FloatArray, scratch: FloatArray
) -> None:
    """Move `t` to the tensions within bounds that minimise |A t - b|.

    The method is the active set of Lawson and Hanson (1974) with two bounds (Stark and Parker,
    1995). In each step it frees the cable with the largest gradient away from its bound. The free
    tensions move to their least-squares solution, or as far towards it as the bounds allow; then
    one of them is fixed again. |A t - b| falls strictly, so no set of free cables occurs twice.
    `scratch` contains: [0] an orthonormal basis Q of the free columns, as rows, [1] the factor U,
    columns = Q U, [2] vectors: free cables, barred cables, lengths of the columns, steps.
    """
    d, n = missing.size, t.size
    free, barred, length = scratch[2, 0], scratch[2, 1], scratch[2, 2]
    for i in range(n):
        square = 0.0
        for k in range(d):
            square += scaled[k, i] * scaled[k, i]
        length[i] = math.sqrt(square)
        barred[i] = 1.0 if bounds[0, i] == bounds[1, i] else 0.0
    count = _free_at_start(scaled, bounds, t, missing, scratch)
    for _ in range(10 * n):
        least = _ROUNDING * _missing(scaled, t, missing)
        cable, most = -1, 0.0
        for i in range(n):
            at_low, at_high = t[i] <= bounds[0, i], t[i] >= bounds[1, i]
            if barred[i] == 0.0 and (at_low or at_high):
                pull = _gradient(scaled, missing, i)
                wants = pull if at_low else -pull
                if wants > least * length[i] and wants > most * length[i]:
                    cable, most = i, wants / length[i]
        if cable < 0 or count == d:
            return
        was = t[cable]
        if _append(scaled, cable, count, d, scratch):
            free[count] = cable
            count = _step_towards(scaled, bounds, t, missing, count + 1, scratch)
        if t[cable] == was:  # due to rounding, this tension cannot leave its bound
            barred[cable] = 1.0
        else:
            for i in range(n):
                barred[i] = 1.0 if bounds[0, i] == bounds[1, i] else 0.0


@jit
def _free_at_start(
    scaled: FloatArray, bounds: FloatArray, t: FloatArray, missing: FloatArray, scratch: FloatArray
) -> int:
    """Free the cables between their bounds, and fix all whose solution would be outside.

    This is repeated with the remaining ones until all solutions are within bounds. Returns the
    number of free cables.
    """
    d, free, step = missing.size, scratch[2, 0], scratch[2, 3]
    while True:
        count, stopped = 0, False
        for i in range(t.size):
            if bounds[0, i] < t[i] < bounds[1, i]:
                if count < d and _append(scaled, i, count, d, scratch):
                    free[count] = i
                    count += 1
                else:
                    t[i] = bounds[0, i]
        _missing(scaled, t, missing)
        _least_squares(missing, count, scratch)
        for j in range(count):
            i = int(free[j])
            t[i] = min(max(t[i] + step[j], bounds[0, i]), bounds[1, i])
            stopped = stopped or t[i] == bounds[0, i] or t[i] == bounds[1, i]
        if not stopped:
            return count


@jit
def _append(scaled: FloatArray, cable: int, count: int, d: int, scratch: FloatArray) -> bool:
    """Add a cable's column to the factors Q U of `count` others; False if it depends on these."""
    Q, U = scratch[0], scratch[1]
    before = scratch[2, 2, cable]
    for k in range(d):
        Q[count, k] = scaled[k, cable]
    for m in range(count):
        U[m, count] = 0.0
    left = before
    while True:  # Gram-Schmidt, repeated if digits were lost
        square = 0.0
        for m in range(count):
            product = 0.0
            for k in range(d):
                product += Q[m, k] * Q[count, k]
            U[m, count] += product
            for k in range(d):
                Q[count, k] -= product * Q[m, k]
        for k in range(d):
            square += Q[count, k] * Q[count, k]
        lost = math.sqrt(square) < 0.5 * left
        left = math.sqrt(square)
        if left <= _INDEPENDENT * before:
            return False
        if not lost:
            break
    U[count, count] = left
    for k in range(d):
        Q[count, k] /= left
    return True


@jit
def _step_towards(
    scaled: FloatArray,
    bounds: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    count: int,
    scratch: FloatArray,
) -> int:
    """Move the free tensions towards their least-squares solution; return how many stay free."""
    free, step, d = scratch[2, 0], scratch[2, 3], missing.size
    while count > 0:
        _least_squares(missing, count, scratch)
        share, stopped = 1.0, -1
        for j in range(count):
            i = int(free[j])
            way = bounds[0 if step[j] < 0.0 else 1, i] - t[i]
            if abs(way) < share * abs(step[j]):
                share, stopped = way / step[j], j
        for j in range(count):
            t[int(free[j])] += share * step[j]
        if stopped < 0:
            break
        i = int(free[stopped])
        t[i] = bounds[0 if step[stopped] < 0.0 else 1, i]
        count -= 1
        for j in range(stopped, count):
            free[j] = free[j + 1]
            _append(scaled, int(free[j]), j, d, scratch)
        _missing(scaled, t, missing)
    return count


@jit
def _least_squares(missing: FloatArray, count: int, scratch: FloatArray) -> None:
    """Write the steps of the free tensions to their least-squares solution: U step = Q'missing."""
    Q, U, step = scratch[0], scratch[1], scratch[2, 3]
    for j in range(count - 1, -1, -1):
        step[j] = 0.0
        for k in range(missing.size):
            step[j] += Q[j, k] * missing[k]
        for m in range(j + 1, count):
            step[j] -= U[j, m] * step[m]
        step[j] /= U[j, j]
