"""Kernels of the least squares over cable lengths: normal equations and their solution.

Arrays besides those of `cable_kernel`, of float64:

    solver    (24, 6)     scratch: NORMAL, FACTOR, GRADIENT, STEP; DIRECTIONS: 1 for those of the
                          twist that are solved for, 0 for those that stay as they are; ACCEPTED,
                          the sum of squares up to which lengths agree; and from SAVED_POSES on four
                          poses (4, 4, 3), of which the last one's rotation is that at home
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit, jit_inlined
from cdpr_rt.robots.kinematics.cable_kernel import ANCHOR, ARC, ERROR, FREE, TINY

FACTOR, GRADIENT, STEP, DIRECTIONS, ACCEPTED, SAVED_POSES, SOLVER_ROWS = 6, 12, 13, 14, 15, 16, 24
_LEAST_PIVOT = 1e-13
_LEAST_REDUNDANCY = 1e-4
_DISTINCT = 0.8


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
    """Take directions that are not solved for out of N and the gradient."""
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
    """Add Σ f ∂²ρ to N, of straight cables: Newton's method instead of Gauss-Newton.

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
    """Write the FACTOR of N + damping · diag(N) = L D L^T; False where that is singular.

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
    """Solve L D L^T x = g in place; `x` (6,) is g beforehand."""
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
    """Write the STEP for the gradient; return its size and by how much the cost is to fall."""
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
def covariance(cables: FloatArray, solver: FloatArray, variance: float, result: FloatArray) -> None:
    """Write variance · N^-1 into `result` (6, 6), 0 where a direction is not solved for.

    All is nan where N is singular.
    """
    assemble(cables, solver)
    certain = factorise(solver, 0.0)
    for j in range(6):
        column = result[j]
        for k in range(6):
            column[k] = 0.0
        if not certain:
            for k in range(6):
                column[k] = math.nan
        elif solver[DIRECTIONS, j] != 0.0:
            column[j] = variance
            substitute(solver, column)


@jit
def largest_residual(
    lengths: FloatArray, cables: FloatArray, solver: FloatArray
) -> tuple[float, int]:
    """Return the largest |r_i| / sqrt(p_ii) of cables at the pose that `lengths` (n,) have, in m.

    r are the residuals, p_ii = 1 - J_i N^-1 J_i^T the redundancy numbers, of a FACTOR of N that is
    not damped (data snooping: Baarda, A testing procedure for use in geodetic networks, 1968). One
    length that is wrong by s has s sqrt(p_ii) of it, and more than every other. Returns its index
    besides, -1 where another cable comes near: then they do not tell which one it is.
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
        if redundancy < _LEAST_REDUNDANCY:
            continue
        residual = abs(cables[FREE, i] + cables[ARC, i] - lengths[i]) / math.sqrt(redundancy)
        if residual > largest:
            largest, second, index = residual, largest, i
        else:
            second = max(second, residual)
    return largest, index if second < _DISTINCT * largest else -1
