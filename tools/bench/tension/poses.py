"""The two robots of the bench, their poses and their wrench matrices, by NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CableRobot:
    """Geometry, load and tension bounds of a robot with n cables and six directions, SI units."""

    name: str
    exit_points: FloatArray
    anchor_points: FloatArray
    mass_kg: float
    low_N: float
    high_N: float
    least_position: FloatArray
    greatest_position: FloatArray
    angle_deg: float

    @property
    def wrench_N_Nm(self) -> FloatArray:
        """The weight (6,), which acts at the platform's reference point."""
        return np.array([0.0, 0.0, -9.81 * self.mass_kg, 0.0, 0.0, 0.0])

    @property
    def wrench_scale(self) -> FloatArray:
        """1 for forces, the anchor points' mean distance (root of squares) for moments (6,)."""
        length = np.sqrt((self.anchor_points**2).sum(axis=1).mean())
        return np.array([1.0, 1.0, 1.0, length, length, length])

    def wrench_matrix(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return W (..., 6, n) for positions (..., 3) and rotations (..., 3, 3).

        A cable's column is its direction from anchor to exit point, and the moment of that.
        """
        anchors = np.einsum("...jk,ik->...ij", rotation, self.anchor_points)
        cables = self.exit_points - position[..., None, :] - anchors
        u = cables / np.linalg.norm(cables, axis=-1, keepdims=True)
        columns = np.concatenate([u, np.cross(anchors, u)], axis=-1)
        return np.ascontiguousarray(np.swapaxes(columns, -1, -2))

    def poses(self, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
        """Return positions (count, 3) and rotations (count, 3, 3), whether feasible or not."""
        rng = np.random.default_rng(seed)
        position = rng.uniform(self.least_position, self.greatest_position, (count, 3))
        angles = rng.uniform(-self.angle_deg, self.angle_deg, (count, 3))
        return position, Rotation.from_euler("xyz", angles, degrees=True).as_matrix()


def _prism(side: float, height: float) -> FloatArray:
    """Return the anchor points (8, 3) of `spatial-8`: lower cables below, upper cables above.

    Each cable goes to the corner beside that which is nearest to its exit point, lower cables to
    the one and upper cables to the other neighbour: so they turn the platform both ways about the
    vertical. Of all such choices this keeps the most poses feasible at 45 degrees.
    """
    corners = 0.5 * side * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
    flat = np.vstack([np.roll(corners, 3, axis=0), np.roll(corners, 1, axis=0)])
    return np.column_stack([flat, np.repeat([-0.5 * height, 0.5 * height], 4)])


SPATIAL = CableRobot(
    "spatial-8",
    # thesis, table D.1
    1e-3
    * np.array(
        [
            [-1813.3, -2159.4, 824.0], [-1678.2, 2125.0, 787.9],
            [1508.3, 2046.1, 865.7], [1523.3, -2233.5, 835.3],
            [-2087.3, -1725.4, 2960.2], [-1492.1, 2442.0, 2880.9],
            [1692.4, 2143.8, 2860.1], [873.2, -2428.2, 3004.5],
        ]
    ),
    _prism(0.2, 0.6),
    8.0,
    20.0,
    150.0,
    np.array([-1.0, -1.2, 1.1]),
    np.array([1.0, 1.2, 2.5]),
    20.0,
)  # fmt: skip

SUSPENDED = CableRobot(
    "suspended-8",
    # CoGiRo, as published by Mahnke and Caverly (2025), table 1
    np.array(
        [
            [-7.20, -5.44, 5.39], [-7.48, -5.15, 5.40], [-7.41, 5.19, 5.40], [-7.12, 5.47, 5.41],
            [7.22, 5.37, 5.41], [7.51, 5.08, 5.42], [7.43, -5.26, 5.39], [7.14, -5.54, 5.40],
        ]
    ),
    np.array(
        [
            [0.503, -0.493, 0.0], [-0.510, 0.351, 0.998],
            [-0.503, -0.270, 0.0], [0.496, 0.356, 1.0],
            [-0.503, 0.493, 0.0], [0.500, -0.340, 0.999],
            [0.502, 0.275, -0.001], [-0.505, -0.346, 0.998],
        ]
    ),
    100.0,
    10.0,
    6000.0,
    np.array([-6.75, -4.75, 0.0]),
    np.array([6.75, 4.75, 4.75]),
    30.0,
)  # fmt: skip

ROBOTS = (SPATIAL, SUSPENDED)
