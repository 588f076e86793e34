"""Geometries of cable robots as they were published, and two robots of them with their poses.

For benches and tests, by NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics.pose import Pose


@dataclass(frozen=True)
class Geometry:
    """Exit points in the room and anchor points on the platform, (n, 3) each, m."""

    exit_points_m: FloatArray
    anchor_points_m: FloatArray
    home: Pose


def _spatial_8() -> Geometry:
    """Tremblay (thesis), table D.1; its anchors are not printed: corners of the platform.

    The platform is 200 x 200 x 600 mm, and each cable goes to the corner at the other end of its
    height, the upper ones to the lower corners, so that it can be turned.
    """
    exits = np.array(
        [
            [-1.8133, -2.1594, 0.8240],
            [-1.6782, 2.1250, 0.7879],
            [1.5083, 2.0461, 0.8657],
            [1.5233, -2.2335, 0.8353],
            [-2.0873, -1.7254, 2.9602],
            [-1.4921, 2.4420, 2.8809],
            [1.6924, 2.1438, 2.8601],
            [0.8732, -2.4282, 3.0045],
        ]
    )
    corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    anchors = np.zeros((8, 3))
    anchors[:, :2] = 0.1 * np.vstack([corners, corners])
    anchors[:4, 2], anchors[4:, 2] = 0.3, -0.3
    return Geometry(exits, anchors, Pose(exits.mean(axis=0)))


SPATIAL_8 = _spatial_8()
COGIRO = Geometry(
    np.array(
        [
            [-7.20, -5.44, 5.39],
            [-7.48, -5.15, 5.40],
            [-7.41, 5.19, 5.40],
            [-7.12, 5.47, 5.41],
            [7.22, 5.37, 5.41],
            [7.51, 5.08, 5.42],
            [7.43, -5.26, 5.39],
            [7.14, -5.54, 5.40],
        ]
    ),
    np.array(
        [
            [0.503, -0.493, 0.000],
            [-0.510, 0.351, 0.998],
            [-0.503, -0.270, 0.000],
            [0.496, 0.356, 1.000],
            [-0.503, 0.493, 0.000],
            [0.500, -0.340, 0.999],
            [0.502, 0.275, -0.001],
            [-0.505, -0.346, 0.998],
        ]
    ),
    Pose(np.array([0.0, 0.0, 2.0])),
)
"""Mahnke and Caverly (2025), table 1."""


def held_tensions(W: FloatArray, wrench: FloatArray, low: float, high: float) -> FloatArray | None:
    """Return tensions within bounds that hold `wrench` by W (6, 8), or None: W t + wrench = 0.

    They are the corner with the least sum of the polygon that all such tensions are.
    """
    inner = np.linalg.svd(W)[2][6:].T
    t0 = -np.linalg.pinv(W) @ wrench
    sides = np.vstack([inner, -inner])
    room = np.concatenate([t0 - low, high - t0])
    i, j = np.triu_indices(len(room), 1)
    pairs = np.stack([sides[i], sides[j]], axis=1)
    crossing = np.abs(np.linalg.det(pairs)) > 1e-12
    corners = np.linalg.solve(
        pairs[crossing], -np.stack([room[i], room[j]], 1)[crossing][..., None]
    )
    corners = corners[..., 0]
    inside = (corners @ sides.T + room >= -1e-9).all(axis=1)
    if not inside.any():
        return None
    t = t0 + corners[inside] @ inner.T
    return np.asarray(t[np.argmin(t.sum(axis=1))])


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
    SPATIAL_8.exit_points_m,
    _prism(0.2, 0.6),
    8.0,
    20.0,
    150.0,
    np.array([-1.0, -1.2, 1.1]),
    np.array([1.0, 1.2, 2.5]),
    20.0,
)
SUSPENDED = CableRobot(
    "suspended-8",
    COGIRO.exit_points_m,
    COGIRO.anchor_points_m,
    100.0,
    10.0,
    6000.0,
    np.array([-6.75, -4.75, 0.0]),
    np.array([6.75, 4.75, 4.75]),
    30.0,
)
ROBOTS = (SPATIAL, SUSPENDED)
