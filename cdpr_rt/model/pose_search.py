"""Kernels that find the pose from cable lengths."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit, jit_inlined
from cdpr_rt.model.cable_kernel import ANCHOR, ARC, ERROR, FREE, TINY, compare, run_cables

# Kernels of least squares over cable lengths: normal equations and their solution. Besides the
# arrays of `cable_kernel` they use `solver` (24, 6), float64. Its rows are NORMAL, FACTOR, GRADIENT
# and STEP; DIRECTIONS, 1 for directions of the twist that are solved for, 0 for directions that
# stay unchanged; ACCEPTED, the sum of squares below which lengths agree; and, from SAVED_POSES on,
# four poses (4, 4, 3); the last one has the rotation at home.

FACTOR, GRADIENT, STEP, DIRECTIONS, ACCEPTED, SAVED_POSES, SOLVER_ROWS = 6, 12, 13, 14, 15, 16, 24
_LEAST_PIVOT = 1e-13
_LEAST_REDUNDANCY = 1e-4
DISTINCT = 0.8
"""Another cable is also suspect if its normalised residual exceeds this share of the largest."""


@jit
def assemble(cables: FloatArray, solver: FloatArray) -> None:
    """Write the NORMAL matrix N = J^T J (lower half) and the GRADIENT -J^T f."""
    n = cables.shape[1]
    for j in range(6):
        entry = 0.0
        for i in range(n):
            entry -= cables[j, i] * cables[ERROR, i]
        solver[GRADIENT, j] = entry
        for k in range(j + 1):
            entry = 0.0
            for i in range(n):
                entry += cables[j, i] * cables[k, i]
            solver[j, k] = entry
    _hold(solver)


@jit_inlined
def _hold(solver: FloatArray) -> None:
    """Remove directions that are not solved for from N and the gradient."""
    for j in range(6):
        if solver[DIRECTIONS, j] == 0.0:
            solver[GRADIENT, j] = 0.0
            for k in range(6):
                solver[max(j, k), min(j, k)] = 0.0
            solver[j, j] = 1.0


@jit
def add_curvature(
    geometry: FloatArray, pose: FloatArray, cables: FloatArray, solver: FloatArray
) -> None:
    """Add Σ f ∂²ρ to N, for straight cables: Newton's method instead of Gauss-Newton.

    With r = Q b, c = free · u, and a change of pose (δ, φ) that moves an anchor by v = δ + φ × r,
    ρ ∂²ρ = |v|² - (u·v)² + ρ ((u·φ)(r·φ) - (u·r) |φ|²).
    """
    for i in range(cables.shape[1]):
        error = cables[ERROR, i]
        share = error / (cables[FREE, i] + TINY)
        r, u = solver[STEP, 0:3], cables[0:3, i]
        square, along = 0.0, 0.0
        for j in range(3):
            r[j] = 0.0
            for k in range(3):
                r[j] += pose[1 + j, k] * geometry[ANCHOR + k, i]
            square += r[j] * r[j]
            along += u[j] * r[j]
        for j in range(6):
            for k in range(j + 1):
                solver[j, k] -= share * cables[j, i] * cables[k, i]
        for j in range(3):
            solver[j, j] += share
            solver[3 + j, 3 + j] += share * square - error * along
            after, last = (j + 1) % 3, (j + 2) % 3
            solver[3 + j, after] -= share * r[last]
            solver[3 + j, last] += share * r[after]
            for k in range(j + 1):
                solver[3 + j, 3 + k] += 0.5 * error * (u[j] * r[k] + r[j] * u[k])
                solver[3 + j, 3 + k] -= share * r[j] * r[k]
    _hold(solver)


@jit_inlined
def factorise(solver: FloatArray, damping: float) -> bool:
    """Write the FACTOR of N + damping · diag(N) = L D L^T; return False if the sum is singular.

    L is below the diagonal, 1/D on it, (L D)^T above.
    """
    for j in range(6):
        pivot = solver[j, j] * (1.0 + damping)
        for k in range(j):
            pivot -= solver[FACTOR + j, k] * solver[FACTOR + k, j]
        if not pivot > _LEAST_PIVOT * solver[j, j]:
            return False
        inverse = 1.0 / pivot
        solver[FACTOR + j, j] = inverse
        for i in range(j + 1, 6):
            entry = solver[i, j]
            for k in range(j):
                entry -= solver[FACTOR + i, k] * solver[FACTOR + k, j]
            solver[FACTOR + j, i] = entry
            solver[FACTOR + i, j] = entry * inverse
    return True


@jit_inlined
def substitute(solver: FloatArray, x: FloatArray) -> None:
    """Solve L D L^T x = g in place; on entry `x` (6,) is g."""
    for j in range(6):
        entry = x[j]
        for k in range(j):
            entry -= solver[FACTOR + j, k] * x[k]
        x[j] = entry
    for j in range(5, -1, -1):
        entry = x[j] * solver[FACTOR + j, j]
        for k in range(j + 1, 6):
            entry -= solver[FACTOR + k, j] * x[k]
        x[j] = entry


@jit_inlined
def find_step(solver: FloatArray) -> tuple[float, float]:
    """Write the STEP for the gradient; return its size and the expected decrease of the cost."""
    x = solver[STEP]
    for j in range(6):
        x[j] = solver[GRADIENT, j]
    substitute(solver, x)
    size, gain = 0.0, 0.0
    for j in range(6):
        size += x[j] * x[j]
        gain += x[j] * solver[GRADIENT, j]
    return math.sqrt(size), gain


@jit
def largest_residual(
    lengths: FloatArray, cables: FloatArray, solver: FloatArray, normalised: FloatArray
) -> tuple[float, int]:
    """Return the largest |r_i| / sqrt(p_ii) of cables, m, at the pose found from `lengths` (n,).

    r are the residuals, p_ii = 1 - J_i N^-1 J_i^T the redundancy numbers, with an undamped FACTOR
    of N (data snooping: Baarda, A testing procedure for use in geodetic networks, 1968). If a
    single length is wrong by s, its normalised residual is s sqrt(p_ii), the largest of all. Also
    returns the index of that cable, or -1 if another cable comes near, so that the cause is
    uncertain. Writes r_i / sqrt(p_ii) to `normalised` (n,), 0 for cables that contradict no other.
    """
    largest, second, index = 0.0, 0.0, -1
    x = solver[STEP]
    for i in range(lengths.size):
        for j in range(6):
            x[j] = cables[j, i] * solver[DIRECTIONS, j]
        substitute(solver, x)
        redundancy = 1.0
        for j in range(6):
            redundancy -= cables[j, i] * x[j]
        normalised[i] = 0.0
        if redundancy < _LEAST_REDUNDANCY:
            continue
        off = cables[FREE, i] + cables[ARC, i] - lengths[i]
        normalised[i] = off / math.sqrt(redundancy)
        residual = abs(normalised[i])
        if residual > largest:
            largest, second, index = residual, largest, i
        else:
            second = max(second, residual)
    return largest, index if second < DISTINCT * largest else -1


@jit
def largest_jump(normalised: FloatArray, settled: FloatArray, share: float) -> tuple[float, int]:
    """Return the largest change of residuals from their low-passed values, m, and its cable.

    `normalised` (n,) are those of `largest_residual`; `settled` (n,) follow them by `share` per
    cycle and start from them if NaN. The cable is -1 if another residual changes almost as much.
    """
    largest, second, index = 0.0, 0.0, -1
    for i in range(normalised.size):
        if math.isnan(settled[i]):
            settled[i] = normalised[i]
        jump = normalised[i] - settled[i]
        settled[i] += share * jump
        if abs(jump) > largest:
            largest, second, index = abs(jump), largest, i
        else:
            second = max(second, abs(jump))
    return largest, index if second < DISTINCT * largest else -1


HOME = 3
_BEFORE, _START, _BEST = 0, 1, 2

CONVERGED, UNFINISHED, SINGULAR, STALLED = 0, 1, 2, 3
"""Outcome of a search: converged; out of steps; rank deficient; stalled in a local minimum."""

TOLERANCE = 1e-9
"""A search ends if the remaining distance to the solution, m and rad, is below this."""
MOST_STEPS = 30
_SMALL_STEP = 3e-5
_NEAR = 0.05
_SLOW_SHARE = 0.1
_AGREE = 1e-6
_REGULAR_DAMPING = 1e-6
_LEAST_SHARE = 0.6
_RELAXED_STEPS = 2
_FAR_FROM_HOME_rad = 0.7
_RESTART_TURN_rad = 1.0


@jit
def descend(
    geometry: FloatArray,
    lengths: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    solver: FloatArray,
    kept: FloatArray,
    accepted: float,
) -> tuple[int, int, float]:
    """Move `pose` to the nearest minimum of the squared errors, by Gauss-Newton, eq. (3.15).

    If convergence is slow, as with lengths that disagree, the search uses Newton's method. A step
    that increases the cost is undone and damped (Levenberg-Marquardt). The search ends when the
    last two steps show that the remaining distance is below TOLERANCE. It ends as STALLED if the
    cost is above `accepted` and the next step would reduce it only a little. A step towards lengths
    that agree would remove nearly all of the cost. Returns outcome, number of steps, and cost. If a
    length is nan, the outcome is SINGULAR.
    """
    cost = compare(geometry, lengths, pose, cables)
    if not cost < math.inf:
        return SINGULAR, 0, cost
    damping, before, fresh, slow, k = 0.0, 0.0, True, False, 0
    for k in range(1, MOST_STEPS + 1):
        if fresh:
            assemble(cables, solver)
            if slow:
                add_curvature(geometry, pose, cables, solver)
        singular, damping = _factorise_damped(cables, solver, damping)
        if damping < 0.0:
            return SINGULAR, k, cost
        size, gain = find_step(solver)
        if k > 1 and cost > accepted and gain < _LEAST_SHARE * cost:
            return STALLED, k, cost
        copy_pose(pose, kept[_BEFORE])
        move(pose, solver[STEP])
        if damping == 0.0 and _converged(size, before, cost - gain):
            return CONVERGED, k, max(cost - gain, 0.0)
        new = compare(geometry, lengths, pose, cables)
        fresh = new <= cost or size < TOLERANCE
        if not fresh:
            if damping > 1e6:
                break
            copy_pose(kept[_BEFORE], pose)
            damping = max(10.0 * damping, 1e-3)
            continue
        if size < TOLERANCE:
            return SINGULAR if singular else CONVERGED, k, new
        slow = 0.0 < _SLOW_SHARE * before < size < _NEAR
        before, cost = size if damping == 0.0 else 0.0, new
        damping = 0.1 * damping if damping > 1e-5 else 0.0
    return UNFINISHED, k, cost


@jit_inlined
def _factorise_damped(cables: FloatArray, solver: FloatArray, damping: float) -> tuple[bool, float]:
    """Factorise the equations; return whether a direction is free, and the damping used.

    The damping is negative if the factorisation fails with every value.
    """
    if factorise(solver, damping):
        return False, damping
    # the cost is concave here, unless a direction is free
    assemble(cables, solver)
    singular = not factorise(solver, damping)
    damping = max(damping, _REGULAR_DAMPING)
    return singular, damping if factorise(solver, damping) else -1.0


@jit_inlined
def _converged(size: float, before: float, cost: float) -> bool:
    """Return whether the remaining distance after a step of this size is negligible.

    It is assumed to shrink as in the last two steps, or faster if the cost shows that lengths
    agree.
    """
    shrunk = size / before if cost < _AGREE * size * size and before > 0.0 else 1.0
    return size < _SMALL_STEP and size * size * shrunk < TOLERANCE * (before - size)


@jit
def find_pose(
    geometry: FloatArray,
    cables: FloatArray,
    solver: FloatArray,
    lengths: FloatArray,
    pose: FloatArray,
    restarts: int,
) -> tuple[int, int, float]:
    """Find the pose whose lengths are nearest to `lengths` (n,), from the start in `pose`.

    If the sum of squared errors stays above ACCEPTED, the search starts again from up to `restarts`
    other poses. Writes `pose`. Returns the outcome, the number of all steps, and the sum.
    """
    kept = solver[SAVED_POSES:].reshape(4, 4, 3)
    accepted = solver[ACCEPTED, 0]
    if restarts == 0:
        status, steps, cost = descend(geometry, lengths, pose, cables, solver, kept, math.inf)
        _orthonormalise(pose)
        return status, steps, cost
    copy_pose(pose, kept[_START])
    status, steps, cost = descend(geometry, lengths, pose, cables, solver, kept, accepted)
    attempt, best = 0, math.inf
    while attempt < restarts and cost > accepted:
        if cost < best:
            copy_pose(pose, kept[_BEST])
            best = cost
        _restart(geometry, lengths, pose, cables, solver, kept, attempt)
        status, more, cost = descend(geometry, lengths, pose, cables, solver, kept, accepted)
        steps += more
        attempt += 1
    if cost > accepted:
        if not cost < best:
            copy_pose(kept[_BEST], pose)
        status, more, cost = descend(geometry, lengths, pose, cables, solver, kept, math.inf)
        steps += more
    _orthonormalise(pose)
    return status, steps, cost


@jit
def _restart(
    geometry: FloatArray,
    lengths: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    solver: FloatArray,
    kept: FloatArray,
    attempt: int,
) -> None:
    """Write the pose of the `attempt`-th restart, counted from 0.

    The first two restarts begin at the start's position, with the rotation of the start and with
    that at home. Later ones begin at the best pose so far, and then at the start turned to either
    side about each axis. Each restart takes some steps towards the minimum of the relaxed problem.
    """
    copy_pose(kept[_BEST if attempt == 2 else _START], pose)
    if attempt < 2:
        trace = 0.0
        for i in range(1, 4):
            for j in range(3):
                trace += pose[i, j] * kept[HOME, i, j]
        far = trace < 1.0 + 2.0 * math.cos(_FAR_FROM_HOME_rad)
        if far == (attempt == 0):
            for i in range(1, 4):
                for j in range(3):
                    pose[i, j] = kept[HOME, i, j]
    elif attempt > 2:
        x = solver[STEP]
        for j in range(6):
            x[j] = 0.0
        axis = 3 + (attempt - 3) // 2 % 3
        x[axis] = _RESTART_TURN_rad * solver[DIRECTIONS, axis] * (1.0 if attempt % 2 else -1.0)
        move(pose, x)
    for _ in range(_RELAXED_STEPS):
        _relax(geometry, lengths, pose, cables)
        assemble(cables, solver)
        if not factorise(solver, _REGULAR_DAMPING):
            return
        size, _ = find_step(solver)
        move(pose, solver[STEP])
        if size < _NEAR:
            return


@jit
def _relax(geometry: FloatArray, lengths: FloatArray, pose: FloatArray, cables: FloatArray) -> None:
    """Write rows and errors of the relaxed problem, in which |p|² is a separate unknown.

    (|c|² - ρ²)/2 is linear in p except for the term |p|²/2. This term is the same for all cables,
    so it cancels in the differences from their mean. The mirror image of a pose in the plane of the
    exit points has nearly the same lengths; it is not a minimum of the relaxed problem.
    """
    n = lengths.size
    run_cables(geometry, pose, cables)
    for i in range(n):
        free, wanted = cables[FREE, i], lengths[i] - cables[ARC, i]
        cables[ERROR, i] = 0.5 * (free * free - wanted * wanted)
        for k in range(6):
            cables[k, i] *= free
    for k in (0, 1, 2, 3, 4, 5, ERROR):
        mean = 0.0
        for i in range(n):
            mean += cables[k, i]
        mean /= n
        for i in range(n):
            cables[k, i] -= mean


@jit_inlined
def move(pose: FloatArray, x: FloatArray) -> None:
    """Change the pose by `x` (6,): p + x_p, and Q turned by the Cayley map of x_φ.

    The Cayley map agrees with the exponential map up to second order, gives a rotation for every x,
    and needs no trigonometric functions. A search ends in the same pose with either map.
    """
    i, j, k = 0.5 * x[3], 0.5 * x[4], 0.5 * x[5]
    w = 1.0 / math.sqrt(1.0 + i * i + j * j + k * k)
    i, j, k = i * w, j * w, k * w
    for c in range(3):
        pose[0, c] += x[c]
        qx, qy, qz = pose[1, c], pose[2, c], pose[3, c]
        tx, ty, tz = 2.0 * (j * qz - k * qy), 2.0 * (k * qx - i * qz), 2.0 * (i * qy - j * qx)
        pose[1, c] = qx + w * tx + j * tz - k * ty
        pose[2, c] = qy + w * ty + k * tx - i * tz
        pose[3, c] = qz + w * tz + i * ty - j * tx


@jit_inlined
def copy_pose(pose: FloatArray, into: FloatArray) -> None:
    """Copy a pose."""
    for i in range(4):
        for j in range(3):
            into[i, j] = pose[i, j]


@jit_inlined
def _orthonormalise(pose: FloatArray) -> None:
    """Remove the rounding errors of many steps from the rotation: Q ← Q (3·1 - Q^T Q) / 2."""
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(1, 4):
        x, y, z = pose[i, 0], pose[i, 1], pose[i, 2]
        xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
        yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
    for i in range(1, 4):
        x, y, z = pose[i, 0], pose[i, 1], pose[i, 2]
        pose[i, 0] = 1.5 * x - 0.5 * (x * xx + y * xy + z * xz)
        pose[i, 1] = 1.5 * y - 0.5 * (x * xy + y * yy + z * yz)
        pose[i, 2] = 1.5 * z - 0.5 * (x * xz + y * yz + z * zz)
