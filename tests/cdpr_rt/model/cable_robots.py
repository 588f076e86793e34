"""Wrench matrices of robots, and random ones, computed by NumPy alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

# CoGiRo, as published by Mahnke and Caverly (2025), table 1
SUSPENDED_EXITS = np.array(
    [
        [-7.20, -5.44, 5.39], [-7.48, -5.15, 5.40], [-7.41, 5.19, 5.40], [-7.12, 5.47, 5.41],
        [7.22, 5.37, 5.41], [7.51, 5.08, 5.42], [7.43, -5.26, 5.39], [7.14, -5.54, 5.40],
    ]
)  # fmt: skip
SUSPENDED_ANCHORS = np.array(
    [
        [0.503, -0.493, 0.0], [-0.510, 0.351, 0.998],
        [-0.503, -0.270, 0.0], [0.496, 0.356, 1.0],
        [-0.503, 0.493, 0.0], [0.500, -0.340, 0.999],
        [0.502, 0.275, -0.001], [-0.505, -0.346, 0.998],
    ]
)  # fmt: skip
WEIGHT = np.array([0.0, 0.0, -981.0, 0.0, 0.0, 0.0])
SCALE = np.array([1.0, 1.0, 1.0, 0.75, 0.75, 0.75])


def wrench_matrix(p: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return W (6, 8) of the suspended robot at a position (3,) and rotation (3, 3)."""
    anchors = SUSPENDED_ANCHORS @ rotation.T
    ways = SUSPENDED_EXITS - p - anchors
    u = ways / np.linalg.norm(ways, axis=1)[:, None]
    return np.ascontiguousarray(np.vstack([u.T, np.cross(anchors, u).T]))


def suspended_poses(count: int, seed: int) -> list[FloatArray]:
    """Return W of `count` poses; most of them carry 100 kg."""
    rng = np.random.default_rng(seed)
    at = rng.uniform([-6.5, -4.5, 0.2], [6.5, 4.5, 4.5], (count, 3))
    turned = Rotation.from_euler("xyz", rng.uniform(-25, 25, (count, 3)), degrees=True)
    return [wrench_matrix(p, r) for p, r in zip(at, turned.as_matrix(), strict=True)]


def made_up(
    seed: int, directions: int, cables: int, feasible: bool
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return W, w_e, low and high; if `feasible`, some tensions within the bounds carry w_e."""
    rng = np.random.default_rng(seed)
    W = rng.normal(size=(directions, cables))
    low = rng.uniform(0.0, 30.0, cables)
    high = low + rng.uniform(1.0, 100.0, cables)
    within = low + (high - low) * rng.beta(0.3, 0.3, cables)  # many close to a bound
    w_e = -W @ within if feasible else rng.normal(size=directions) * 100.0
    return W, w_e, low, high
