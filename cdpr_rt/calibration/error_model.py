"""How errors of measurement become errors of exit points and initial lengths: model and trial.

Tremblay, section 3.5. With c = p + Q b - a and ρ = ρ_0 + Δρ, (3.40) is

    c^T δa + ρ δρ_0 = c^T δp + (Q b × c)^T δr - ρ δΔρ

of which (3.63) is the least-squares solution D^+ K δy; D is in blocks, one for each cable. The
trial solves (3.20) itself, by Gauss and Newton with (3.25), for many draws at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray

_STEPS = 12


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured at each pose, on each coordinate."""

    length_m: float = 0.0
    position_m: float = 0.0
    rotation_rad: float = 0.0

    def scaled(self, by: float) -> Noise:
        """Return so many times as much."""
        return Noise(by * self.length_m, by * self.position_m, by * self.rotation_rad)


@dataclass(frozen=True)
class Errors:
    """Root mean squares of the errors, (3.39a) and (3.39b)."""

    exit_m: float
    offset_m: float

    @property
    def ratio(self) -> float:
        """That of the initial lengths over that of the exit points: √3 along one direction."""
        return self.offset_m / self.exit_m


def predicted_errors(
    exits_m: FloatArray, anchors_m: FloatArray, poses: FloatArray, noise: Noise
) -> Errors:
    """Return the errors by (3.63), for exit and anchor points (n, 3) and poses (N, 4, 3)."""
    arm = np.einsum("jab,ib->ija", poses[:, 1:], anchors_m)
    c = poses[:, 0] + arm - exits_m[:, None]
    rho = np.linalg.norm(c, axis=2)
    D = np.concatenate([c, rho[..., None]], axis=2)
    turned = (np.cross(arm, c) ** 2).sum(axis=2)
    variance = rho**2 * (noise.position_m**2 + noise.length_m**2) + turned * noise.rotation_rad**2
    inverse = np.linalg.inv(np.swapaxes(D, 1, 2) @ D)
    middle = np.swapaxes(D, 1, 2) @ (D * variance[..., None])
    covariance = inverse @ middle @ inverse
    spread = np.diagonal(covariance, axis1=1, axis2=2)
    return Errors(float(np.sqrt(spread[:, :3].mean())), float(np.sqrt(spread[:, 3].mean())))


def simulated_errors(
    exits_m: FloatArray,
    anchors_m: FloatArray,
    poses: FloatArray,
    noise: Noise,
    draws: int,
    rng: np.random.Generator,
) -> Errors:
    """Return the errors of so many calibrations with noise drawn anew for each."""
    count = len(poses)
    arm = np.einsum("jab,ib->jia", poses[:, 1:], anchors_m)
    rho = np.linalg.norm(poses[:, None, 0] + arm - exits_m, axis=2)
    exit_squares = offset_squares = 0.0
    for _ in range(draws):
        p = poses[:, 0] + rng.normal(0.0, 1.0, (count, 3)) * noise.position_m
        turn = Rotation.from_rotvec(rng.normal(0.0, 1.0, (count, 3)) * noise.rotation_rad)
        Q = turn.as_matrix() @ poses[:, 1:]
        told = rho - rho[0] + rng.normal(0.0, 1.0, rho.shape) * noise.length_m
        points = p[:, None] + np.einsum("jab,ib->jia", Q, anchors_m)
        a, offset = solve_thesis(points, told, exits_m, rho[0])
        exit_squares += float(((a - exits_m) ** 2).mean())
        offset_squares += float(((offset - rho[0]) ** 2).mean())
    return Errors(float(np.sqrt(exit_squares / draws)), float(np.sqrt(offset_squares / draws)))


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
