"""Propagation of errors of measurement to exit points and initial lengths: model and trial.

Tremblay, section 3.5. With c = p + Q b - a and ρ = ρ_0 + Δρ, (3.40) is

    c^T δa + ρ δρ_0 = c^T δp + (b × Q^T c)^T δr - ρ δΔρ

of which (3.63) is the least-squares solution D^+ K δy; D is in blocks, one for each cable, and δr
turns about axes of the platform, as in (3.54). The trial solves (3.20) itself, by Gauss and Newton
with (3.25). δy is `unit` (N, n + 6), cables, position and turn at each pose, times what is told as
`Noise`. Errors (n, 4) are those of an exit point, and of its initial length, in m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray

_STEPS = 12


@dataclass(frozen=True)
class Noise:
    """Standard deviations of errors at each pose, or of a bias."""

    length_m: float = 0.0
    position_m: float = 0.0
    rotation_rad: float = 0.0

    def scaled(self, by: float) -> Noise:
        """Return so many times as much."""
        return Noise(by * self.length_m, by * self.position_m, by * self.rotation_rad)

    def __add__(self, other: Noise) -> Noise:
        """Return both, of different kinds."""
        return Noise(
            self.length_m + other.length_m,
            self.position_m + other.position_m,
            self.rotation_rad + other.rotation_rad,
        )

    def of(self, unit: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return δΔρ (N, n), δp (N, 3) and δr (N, 3) of `unit` (N, n + 6)."""
        lengths, positions, turns = np.split(unit, [-6, -3], axis=1)
        return lengths * self.length_m, positions * self.position_m, turns * self.rotation_rad


@dataclass(frozen=True)
class RmsErrors:
    """Root mean squares of the errors, (3.39a) and (3.39b)."""

    exit_m: float
    offset_m: float

    @classmethod
    def of(cls, errors_m: FloatArray) -> RmsErrors:
        """Return those of errors (..., n, 4)."""
        squares = errors_m**2
        return cls(float(np.sqrt(squares[..., :3].mean())), float(np.sqrt(squares[..., 3].mean())))


def predicted_spread(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, noise: Noise
) -> FloatArray:
    """Return the standard deviations (n, 4) by (3.63), of anchor points (n, 3), poses (N, 4, 3)."""
    D, by_turn = _linear(exits_m, anchors_m, poses)
    variance = D[..., 3] ** 2 * (noise.position_m**2 + noise.length_m**2)
    variance += (by_turn**2).sum(axis=2) * noise.rotation_rad**2
    inverse = np.linalg.inv(np.swapaxes(D, 1, 2) @ D)
    middle = np.swapaxes(D, 1, 2) @ (D * variance[..., None])
    return np.asarray(np.sqrt(np.diagonal(inverse @ middle @ inverse, axis1=1, axis2=2)))


def predicted_errors(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, noise: Noise, unit: FloatArray
) -> FloatArray:
    """Return the errors (n, 4) of one calibration by (3.63)."""
    D, by_turn = _linear(exits_m, anchors_m, poses)
    lengths, positions, turns = noise.of(unit)
    right = (D[..., :3] * positions).sum(axis=2) + (by_turn * turns).sum(axis=2)
    right -= D[..., 3] * lengths.T
    return np.asarray((np.linalg.pinv(D) @ right[..., None])[..., 0])


def _linear(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return D (n, N, 4), c and ρ of each cable and pose, and b × Q^T c (n, N, 3)."""
    arm = np.einsum("jab,ib->ija", poses[:, 1:], anchors_m)
    c = poses[:, 0] + arm - exits_m[:, None]
    D = np.concatenate([c, np.linalg.norm(c, axis=2)[..., None]], axis=2)
    return D, np.cross(anchors_m[:, None], np.einsum("jba,ijb->ija", poses[:, 1:], c))


def simulated_errors(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, noise: Noise, unit: FloatArray
) -> FloatArray:
    """Return the errors (n, 4) of one calibration."""
    rho = _linear(exits_m, anchors_m, poses)[0][..., 3].T
    lengths, positions, turns = noise.of(unit)
    Q = poses[:, 1:] @ Rotation.from_rotvec(turns).as_matrix()
    points = (poses[:, 0] + positions)[:, None] + np.einsum("jab,ib->jia", Q, anchors_m)
    a, offset = solve_thesis(points, rho - rho[0] + lengths, exits_m, rho[0])
    return np.column_stack([a - exits_m, offset - rho[0]])


def solve_thesis(
    points: FloatArray, told: FloatArray, exits_m: FloatArray, offset_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return exit points (n, 3) and initial lengths (n,) that minimise (3.20), from a start.

    `points` (N, n, 3) are the anchor points in the room, `told` (N, n) are Δρ.
    """
    v = np.concatenate([exits_m, offset_m[:, None]], axis=1)
    for _ in range(_STEPS):
        c = np.swapaxes(points - v[:, :3], 0, 1)
        rho = told.T + v[:, 3:]
        u = (c**2).sum(axis=2) - rho**2
        H = -2.0 * np.concatenate([c, rho[..., None]], axis=2)
        gradient = np.swapaxes(H, 1, 2) @ u[..., None]
        step = np.linalg.solve(np.swapaxes(H, 1, 2) @ H, gradient)[..., 0]
        v = v - step
        if float(np.abs(step).max()) < 1e-10:
            break
    return v[:, :3], v[:, 3]
