"""Kinematics of a planar robot with m cables whose platform keeps its orientation.

Tremblay (thesis), section 2.3. Arrays over cables have shape (m, 2), in the robot's plane, m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.errors import ControlError
from cdpr_rt.exchange import FloatArray
from cdpr_rt.jit import jit

MOST_ITERATIONS = 30
_STEP_TOLERANCE_m = 1e-10
# a platform this far from all exit points is no robot any more: the iteration has run away
_FAR_m = 1e4


class GeometryError(ControlError):
    """A geometry no robot can have; the message names the cable and the value."""


@jit
def lengths(p: FloatArray, a: FloatArray, b: FloatArray, rho: FloatArray) -> None:
    """Write the cable lengths at position `p` (2,) into `rho` (m,): eq. (2.2)."""
    for i in range(rho.size):
        x = p[0] + b[i, 0] - a[i, 0]
        y = p[1] + b[i, 1] - a[i, 1]
        rho[i] = np.sqrt(x * x + y * y)


@jit
def jacobian(p: FloatArray, a: FloatArray, b: FloatArray, J: FloatArray) -> bool:
    """Write dρ/dp at `p` into `J` (m, 2): eq. (2.5); False where a cable has no length."""
    for i in range(J.shape[0]):
        x = p[0] + b[i, 0] - a[i, 0]
        y = p[1] + b[i, 1] - a[i, 1]
        rho = np.sqrt(x * x + y * y)
        if not rho > 0.0:
            return False
        J[i, 0] = x / rho
        J[i, 1] = y / rho
    return True


@jit
def solve_position(
    rho: FloatArray, a: FloatArray, b: FloatArray, p: FloatArray, J: FloatArray
) -> tuple[int, float, bool]:
    """Find the position whose lengths are next to `rho` (m,), from the guess in `p` (2,).

    Gauss-Newton, eqs. (2.6) to (2.9), each step halved while it makes the residual larger. Writes
    `p` and, as room, `J` (m, 2). Returns iterations, residual (root mean square, m) and whether it
    converged.
    """
    m = rho.size
    cost = _cost(rho, a, b, p[0], p[1])
    for k in range(1, MOST_ITERATIONS + 1):
        if not jacobian(p, a, b, J):
            return k, np.sqrt(cost / m), False
        xx, xy, yy, gx, gy = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(m):
            x = p[0] + b[i, 0] - a[i, 0]
            y = p[1] + b[i, 1] - a[i, 1]
            f = np.sqrt(x * x + y * y) - rho[i]
            xx += J[i, 0] * J[i, 0]
            xy += J[i, 0] * J[i, 1]
            yy += J[i, 1] * J[i, 1]
            gx += J[i, 0] * f
            gy += J[i, 1] * f
        det = xx * yy - xy * xy
        if not det > 1e-12 * (xx + yy) * (xx + yy):
            return k, np.sqrt(cost / m), False  # all cables in one line: one direction is free
        dx = -(yy * gx - xy * gy) / det
        dy = -(xx * gy - xy * gx) / det
        share = 1.0
        for _ in range(20):
            new = _cost(rho, a, b, p[0] + share * dx, p[1] + share * dy)
            if new <= cost:
                break
            share *= 0.5
        p[0] += share * dx
        p[1] += share * dy
        cost = _cost(rho, a, b, p[0], p[1])
        if not abs(p[0]) + abs(p[1]) < _FAR_m:
            return k, np.sqrt(cost / m), False
        if abs(dx) + abs(dy) < _STEP_TOLERANCE_m * (1.0 + abs(p[0]) + abs(p[1])):
            return k, np.sqrt(cost / m), True
        if share < 1e-5:
            # what is left to win is less than rounding takes
            return k, np.sqrt(cost / m), abs(dx) + abs(dy) < 1e3 * _STEP_TOLERANCE_m
    return MOST_ITERATIONS, np.sqrt(cost / m), False


@jit
def _cost(rho: FloatArray, a: FloatArray, b: FloatArray, px: float, py: float) -> float:
    total = 0.0
    for i in range(rho.size):
        x = px + b[i, 0] - a[i, 0]
        y = py + b[i, 1] - a[i, 1]
        f = np.sqrt(x * x + y * y) - rho[i]
        total += f * f
    return total


@dataclass(frozen=True)
class ForwardResult:
    """A position from cable lengths, and how well they agree with it."""

    position_m: FloatArray
    """(..., 2)"""
    iterations: NDArray[np.int64]
    residual_m: FloatArray
    """Root mean square over the cables, (...)."""
    converged: NDArray[np.bool_]


class PlanarGeometry:
    """Exit points `a` in the frame and anchor points `b` on the platform, (m, 2) each, m."""

    def __init__(self, exit_points_m: FloatArray, anchor_points_m: FloatArray) -> None:
        self.a = np.ascontiguousarray(exit_points_m, float)
        self.b = np.ascontiguousarray(anchor_points_m, float)
        if self.a.ndim != 2 or self.a.shape[1] != 2 or self.a.shape != self.b.shape:
            raise GeometryError(
                f"exit points {self.a.shape}, anchor points {self.b.shape}; allowed: (m, 2) both"
            )
        if self.a.shape[0] < 2:
            raise GeometryError(f"{self.a.shape[0]} cable; allowed: 2 and more")
        if not (np.isfinite(self.a).all() and np.isfinite(self.b).all()):
            raise GeometryError("exit and anchor points must be finite numbers")
        self.m = self.a.shape[0]

    def lengths(self, position_m: FloatArray) -> FloatArray:
        """Return cable lengths (..., m) at positions (..., 2): eq. (2.2)."""
        return np.asarray(np.linalg.norm(self._vectors(position_m), axis=-1))

    def jacobian(self, position_m: FloatArray) -> FloatArray:
        """Return dρ/dp, (..., m, 2), at positions (..., 2): eq. (2.5).

        Raises GeometryError where an anchor point lies in its exit point.
        """
        vectors = self._vectors(position_m)
        rho = np.linalg.norm(vectors, axis=-1, keepdims=True)
        if not (rho > 0.0).all():
            raise GeometryError("an anchor point lies in its cable's exit point")
        return np.asarray(vectors / rho)

    def forward(self, lengths_m: FloatArray, guess_m: FloatArray) -> ForwardResult:
        """Return positions from lengths (..., m), starting at `guess_m` (2,) or (..., 2)."""
        rho = np.asarray(lengths_m, float)
        shape = rho.shape[:-1]
        flat = np.ascontiguousarray(rho.reshape(-1, self.m))
        p = np.array(np.broadcast_to(guess_m, (*shape, 2)), float).reshape(-1, 2)
        J = np.empty((self.m, 2))
        iterations = np.zeros(len(p), np.int64)
        residual = np.zeros(len(p))
        converged = np.zeros(len(p), np.bool_)
        for i in range(len(p)):
            iterations[i], residual[i], converged[i] = solve_position(
                flat[i], self.a, self.b, p[i], J
            )
        return ForwardResult(
            p.reshape(*shape, 2),
            iterations.reshape(shape),
            residual.reshape(shape),
            converged.reshape(shape),
        )

    def _vectors(self, position_m: FloatArray) -> FloatArray:
        return np.asarray(np.asarray(position_m, float)[..., None, :] + self.b - self.a)
