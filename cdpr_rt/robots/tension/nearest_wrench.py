"""Tensions checked, and where none within bounds carry the wrench those that come nearest to it."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

NO_LIMIT = 1 << 30
"""Returned by `nearest_wrench` where the whole wrench is exerted: no cable's number."""
_ROUNDING = 1e-9
"""Share of the terms of a wrench that may be missing of it."""
_INDEPENDENT = 1e-9
"""Share of a column that must be left of it beside those that are free already."""


@jit
def nearest_wrench(
    scaled: FloatArray,
    bounds: FloatArray,
    scale: FloatArray,
    found: bool,
    t: FloatArray,
    missing: FloatArray,
    scratch: FloatArray,
) -> int:
    """Check the tensions `t` (n,), or replace them by the ones of which A t is nearest to b.

    `scaled` = [A b] (d, n + 1), A = W/scale and b = -w_e/scale, is that of `null_space`, as are the
    `bounds` (3, n). Where `found` `t` is taken but for what rounding has put outside its bounds,
    else it is where to begin: cables between their bounds are those that may prove free. Writes
    `missing` = -(W t + w_e) (d,). `scratch` (4, m, m), m >= n and 8, is overwritten. Returns
    NO_LIMIT where the wrench is exerted, else the bound that limits most: moved by 1 N it would
    bring A t nearest to b. i + 1 is cable i's upper one, -i - 1 its lower one, 0 none.
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
    limit, most = NO_LIMIT, _ROUNDING * size
    if distance > most:
        limit = 0
        for i in range(n):
            pull = _gradient(scaled, missing, i)
            at_high, at_low = t[i] >= bounds[1, i], t[i] <= bounds[0, i]
            if (pull > most and at_high) or (-pull > most and at_low):
                limit, most = (i + 1 if pull > 0.0 else -i - 1), abs(pull)
    for k in range(d):
        missing[k] *= scale[k]
    return limit


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
    """Return a'(b - A t), a the column of cable `i`."""
    pull = 0.0
    for k in range(missing.size):
        pull += scaled[k, i] * missing[k]
    return pull


@jit
def _bounded_least_squares(
    scaled: FloatArray, bounds: FloatArray, t: FloatArray, missing: FloatArray, scratch: FloatArray
) -> None:
    """Move `t`, within its bounds, to the t within them of the least |A t - b|.

    The active set of Lawson and Hanson (1974) with two bounds (Stark and Parker, 1995): the cable
    whose tension wants off its bound most is let free; the free ones take the least-squares
    solution, or as much of the way to it as their bounds allow, which stops one of them again.
    |A t - b| falls strictly, so no set of free cables comes twice. In `scratch`: rows of [0] an
    orthonormal basis Q of the free columns, [1] the U by which they are Q U, [2] vectors: which
    cables are free, which are barred from it, how long their columns are, steps.
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
        if t[cable] == was:  # rounding: it is no way off after all
            barred[cable] = 1.0
        else:
            for i in range(n):
                barred[i] = 1.0 if bounds[0, i] == bounds[1, i] else 0.0


@jit
def _free_at_start(
    scaled: FloatArray, bounds: FloatArray, t: FloatArray, missing: FloatArray, scratch: FloatArray
) -> int:
    """Let the cables between their bounds free and stop all at once that do not stay there.

    Repeated with those that are left until all of them do. Returns how many are free.
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
    """Add a cable's column to the factors Q U of `count` others; False where it depends on them."""
    Q, U = scratch[0], scratch[1]
    before = scratch[2, 2, cable]
    for k in range(d):
        Q[count, k] = scaled[k, cable]
    for m in range(count):
        U[m, count] = 0.0
    left = before
    while True:  # Gram and Schmidt, again where digits were lost
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
    """Move the free tensions to their least-squares solution within bounds; return how many are."""
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
