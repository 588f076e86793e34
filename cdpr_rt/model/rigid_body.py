"""A platform as a rigid body: its inertia, and the orientations that its targets may have."""

from __future__ import annotations

import itertools

import numpy as np

from cdpr_profiles.platform import DIRECTIONS, Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.pose import exponential

G_m_s2 = 9.80665
"""Standard gravity."""
LEAST_ARM_m = 0.01
"""If all anchor points are nearer to the centre of mass, the platform is a point without
orientation."""
_TWIST = {2: (0, 1, 5), 3: (0, 1, 2, 3, 4, 5)}


def in_space(vector: tuple[float, ...]) -> FloatArray:
    """Return a position in a plane or in space as (3,)."""
    return np.array((*vector, 0.0)[:3], float)


def rotation(vector_rad: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,)."""
    Q = np.empty((3, 3))
    exponential(np.ascontiguousarray(vector_rad, float), Q)
    return Q


def home_rotation(platform: Platform) -> FloatArray:
    """Return the rotation matrix (3, 3) of a platform at home."""
    given = platform.home_rotation_rad
    return rotation(np.array(given if len(given) == 3 else (0.0, 0.0, *given)))


def inertia_kg_m2(platform: Platform) -> FloatArray:
    """Return the inertia (3, 3) about the centre of mass, in the platform's frame.

    If the file gives no inertia, it is that of a ball. The radius of gyration is half the root mean
    square distance of the anchor points from their centroid.
    """
    given = platform.inertia_kg_m2
    if given is None:
        anchors = np.array(platform.anchor_points_m)
        away = ((anchors - anchors.mean(axis=0)) ** 2).sum(axis=1)
        radius = max(LEAST_ARM_m, 0.5 * float(np.sqrt(away.mean())))
        return np.asarray(platform.mass_kg * radius**2 * np.eye(3))
    if len(given) == 1:
        return np.asarray(given[0] * np.eye(3))
    xx, yy, zz, xy, xz, yz = given
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def is_point(platform: Platform) -> bool:
    """Return whether all cables end at the centre of mass, or nearly."""
    arms = np.array(platform.anchor_points_m) - np.array(platform.centre_of_mass_m)
    return bool(np.linalg.norm(arms, axis=1).max() < LEAST_ARM_m)


def free_directions(platform: Platform) -> tuple[int, ...]:
    """Return the components of the twist in which the platform could move without its cables."""
    size = len(platform.home_m)
    return tuple(range(size)) if is_point(platform) else _TWIST[size]


def directions_of(platform: Platform) -> tuple[int, ...]:
    """Return the components of the twist that the cables control."""
    size = len(platform.home_m)
    names = zip(DIRECTIONS[size], _TWIST[size], strict=True)
    return tuple(i for name, i in names if name in platform.controlled)


def orientations(platform: Platform) -> FloatArray:
    """Return rotation vectors (k, 3) from home that represent the orientations of all targets.

    The first is zero. The others have the largest angle, about each controlled axis and, if several
    axes are controlled, about the diagonals between them.
    """
    axes = [i - 3 for i in directions_of(platform) if i >= 3]
    angle = platform.workspace_angle_rad
    if angle == 0.0 or not axes:
        return np.zeros((1, 3))
    ways = [sign * np.eye(3)[axis] for axis in axes for sign in (1.0, -1.0)]
    if len(axes) > 1:
        for signs in itertools.product((1.0, -1.0), repeat=len(axes)):
            way = np.array(signs) @ np.eye(3)[axes]
            ways.append(way / np.linalg.norm(way))
    return np.concatenate([np.zeros((1, 3)), angle * np.array(ways)])
