"""Kernels that find the pose from cable lengths; arrays as in the kernels of cables, equations."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit, jit_inlined
from cdpr_rt.robots.kinematics.cable_kernel import ARC, ERROR, FREE, compare, run_cables
from cdpr_rt.robots.kinematics.normal_equations import (
    ACCEPTED,
    DIRECTIONS,
    SAVED_POSES,
    STEP,
    add_curvature,
    assemble,
    factorise,
    find_step,
)

HOME = 3
_BEFORE, _START, _BEST = 0, 1, 2

CONVERGED, UNFINISHED, SINGULAR, STALLED = 0, 1, 2, 3
"""How a search ended: converged; out of steps; rank deficient; in a local minimum."""

TOLERANCE = 1e-9
"""A search ends where what is left to go, in m and rad, is less."""
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
    """Go from `pose` to the next minimum of the errors' squares, by Gauss-Newton, eq. (3.15).

    Where that gets slowly on, as lengths that disagree make it do, by Newton's method; a step
    that makes things worse is taken back and damped (Levenberg-Marquardt). It ends where the last
    two steps show that less than TOLERANCE is left to go; and, STALLED, where the next step is to
    win little of a cost above `accepted`: on the way to where lengths agree it wins all. Returns
    how it ended, steps, and the cost; lengths that are no numbers end as SINGULAR.
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
    """Factorise the equations; return whether a direction is free, and the damping it has taken.

    That is negative where none helps.
    """
    if factorise(solver, damping):
        return False, damping
    # curved downwards, if it is not a direction that is free
    assemble(cables, solver)
    singular = not factorise(solver, damping)
    damping = max(damping, _REGULAR_DAMPING)
    return singular, damping if factorise(solver, damping) else -1.0


@jit_inlined
def _converged(size: float, before: float, cost: float) -> bool:
    """Return whether the remaining distance after a step of this size, and cost, is negligible.

    It shrinks as the last two steps did, faster where lengths agree.
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
    """Find the pose whose lengths are next to `lengths` (n,), from the start in `pose`.

    Where the sum of the errors' squares stays above ACCEPTED it is tried again from up to
    `restarts` other poses. Writes `pose`; returns how the search ended, all steps, and the sum.
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
    """Write the pose from which to try again for the `attempt`-th time, from 0.

    It is the start with the rotation it had or that at home, the one nearer to the start's first;
    then the best pose so far; then the start turned to and fro about each axis. Each goes some
    steps towards the minimum of the relaxed problem.
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
    """Write rows and errors of the relaxed problem, in which |p|² is an unknown of its own.

    (|c|² - ρ²)/2 is linear in p but for |p|²/2, which all cables have in common: differences to
    the mean over the cables do not contain it. The mirror image of a pose in the plane of the exit
    points, nearly the same to the lengths, is a minimum no more.
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

    That agrees with the exponential map up to the second order, is a rotation for every x and
    takes no trigonometry; a search ends in the same pose with either.
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
    """Take the rounding of many steps off the rotation: Q ← Q (3·1 - Q^T Q) / 2."""
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
