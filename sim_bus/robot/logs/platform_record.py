"""The platform of a simulated robot as it truly is: its profile, and a plant's errors on top."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdpr_sim_bus.robot.platform import MOST_CABLES, MOST_FEET, PLATFORM_DTYPE, PlatformArray
from cdpr_sim_bus.robot.robot_plant import FloorPlant, PlatformPlant, RobotPlant, StartPlant

_EVEN_m = 1e-6
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RobotShape:
    """Nominal robot from its profile; points are (n, 2) in a plane or (n, 3), m.

    A plane's vectors of rotation and inertias have one number, about the axis across the plane.
    """

    exit_points_m: ArrayLike
    anchor_points_m: ArrayLike
    """In the platform's frame."""
    mass_kg: float
    home_m: Sequence[float]
    """Where the platform's origin is at power-up, unless the plant says otherwise."""
    weights_N_m: Sequence[float]
    """Of each cable."""
    home_rotation_rad: Sequence[float] = (0.0,)
    """Rotation vector of the platform's frame at power-up, likewise."""
    inertia_kg_m2: Sequence[float] | None = None
    """Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass, in the platform's frame; that of a plate
    whose corners are the anchor points where left out."""
    centre_of_mass_m: Sequence[float] = (0.0, 0.0)
    """In the platform's frame."""
    pulley_radii_m: Sequence[float] | None = None
    """Of the pulley at each exit point; points where left out."""
    pulley_axes: ArrayLike | None = None
    """Unit vector along which each cable comes to its pulley, which swivels about it; upward where
    left out."""
    feet_m: ArrayLike | None = None
    """What the platform stands on, in its frame; the corners of a box around its anchor points
    where left out."""


def build_platform(
    shape: RobotShape, plant: RobotPlant, n: int, chance: np.random.Generator
) -> PlatformArray:
    """Return the record of a platform on `n` cables at rest; shape (1,), dtype PLATFORM_DTYPE.

    Raises ValueError where there is not one point for each axis.
    """
    exits = _points(shape.exit_points_m, n, "exit points")
    anchors = _points(shape.anchor_points_m, n, "anchor points")
    planar = np.shape(shape.exit_points_m)[1] == 2
    errors = plant.geometry
    exits = _with_errors(exits, errors.exit_errors_m, errors.exit_sigma_m, planar, chance)
    anchors = _with_errors(anchors, errors.anchor_errors_m, errors.anchor_sigma_m, planar, chance)
    platform: PlatformArray = np.zeros(1, PLATFORM_DTYPE)
    p: Any = platform[0]
    p["cables"], p["planar"] = n, planar
    p["gravity"] = (0.0, -9.80665, 0.0) if planar else (0.0, 0.0, -9.80665)
    com = p["com"] = _vector(plant.platform.centre_of_mass_m or shape.centre_of_mass_m)
    p["exit"][:n] = exits
    p["anchor"][:n] = anchors - com
    p["pulley_radius"][:n] = 0.0 if shape.pulley_radii_m is None else shape.pulley_radii_m
    up = -p["gravity"] / np.linalg.norm(p["gravity"])
    p["pulley_axis"][:n] = (
        up if shape.pulley_axes is None else _points(shape.pulley_axes, n, "pulley axes")
    )
    _put_mass(p, shape, plant.platform, anchors)
    _put_start(p, shape, plant.start)
    feet = _default_feet(anchors) if shape.feet_m is None else _points(shape.feet_m, None, "feet")
    _put_floor(p, feet, up, plant.floor)
    return platform


def _put_mass(p: Any, shape: RobotShape, plant: PlatformPlant, anchors: FloatArray) -> None:
    """Set mass and inertia; one that is known grows with the mass."""
    p["mass"] = shape.mass_kg * (1.0 + plant.mass_error)
    if plant.radius_of_gyration_m is None and shape.inertia_kg_m2 is not None:
        p["inertia"] = (1.0 + plant.mass_error) * _tensor(shape.inertia_kg_m2)
    else:
        reach = plant.radius_of_gyration_m or _plate_radius(anchors)
        p["inertia"] = p["mass"] * reach**2 * np.eye(3)
    p["inverse_inertia"] = np.linalg.inv(p["inertia"])
    smallest = float(np.linalg.eigvalsh(p["inertia"])[0])
    p["reach"], p["air"] = math.sqrt(np.trace(p["inertia"]) / 3.0 / p["mass"]), plant.air_Ns_m
    longest = float(np.linalg.norm(p["anchor"], axis=1).max())
    p["mobility"] = 1.0 / p["mass"] + longest**2 / smallest


def _put_start(p: Any, shape: RobotShape, plant: StartPlant) -> None:
    """Set the pose at power-up."""
    turn = list(shape.home_rotation_rad)
    if plant.rotation_deg is not None:
        turn = [math.radians(angle) for angle in plant.rotation_deg]
    elif plant.angle_deg is not None:
        turn = [math.radians(plant.angle_deg)]
    p["rotation"] = rotation_of((0.0, 0.0, turn[0]) if len(turn) == 1 else turn)
    p["position"] = _vector(plant.position_m or shape.home_m) + p["rotation"] @ p["com"]


def _put_floor(p: Any, feet: FloatArray, up: FloatArray, plant: FloorPlant) -> None:
    p["feet"] = len(feet)
    p["foot"][: len(feet)] = feet - p["com"]
    heights = (p["position"] + p["foot"][: len(feet)] @ p["rotation"].T) @ up
    carried_by = np.count_nonzero(heights < heights.min() + _EVEN_m)
    weight = p["mass"] * np.linalg.norm(p["gravity"])
    sunk = weight / (carried_by * plant.stiffness_N_m)
    p["floor"] = heights.min() + sunk if plant.height_m is None else plant.height_m
    if not plant.present:
        p["floor"] = -math.inf
    p["floor_stiffness"], p["floor_damping"] = plant.stiffness_N_m, plant.damping_Ns_m
    p["floor_friction"] = plant.friction


def _with_errors(
    points: FloatArray,
    errors: Sequence[Sequence[float]],
    sigma: float,
    planar: bool,
    chance: np.random.Generator,
) -> FloatArray:
    drawn = chance.normal(0.0, sigma, points.shape)
    if planar:
        drawn[:, 2] = 0.0
    known = _points(errors, len(points), "errors") if errors else np.zeros_like(points)
    return points + known + drawn


def _points(values: ArrayLike, n: int | None, what: str) -> FloatArray:
    points = np.asarray(values, float)
    most = MOST_CABLES if n is not None else MOST_FEET
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not 0 < len(points) <= most:
        raise ValueError(f"{what}: {points.shape}; allowed: (n, 2) or (n, 3), n up to {most}")
    if n is not None and len(points) != n:
        raise ValueError(f"{what}: {len(points)}; allowed: one for each of {n} axes")
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _default_feet(points: FloatArray) -> FloatArray:
    low, high = points.min(axis=0), points.max(axis=0)
    corners = [np.where(pick, high, low) for pick in np.ndindex(2, 2, 2)]
    return np.unique(corners, axis=0)


def _vector(values: Sequence[float]) -> FloatArray:
    return np.pad(np.asarray(values, float), (0, 3 - len(values)))


def _tensor(values: Sequence[float]) -> FloatArray:
    """Return an inertia of six numbers, or one about the axis across a plane, as a matrix."""
    if len(values) == 1:
        return values[0] * np.eye(3)
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def rotation_of(vector: ArrayLike) -> FloatArray:
    """Return the matrix of a rotation vector, by Rodrigues' formula."""
    v = np.asarray(vector, float)
    angle = float(np.linalg.norm(v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * across @ across
    return np.asarray(matrix)


def _plate_radius(anchors: FloatArray) -> float:
    """Return the radius of gyration of a plate about its centre, from its corners' distance."""
    spread = float(np.sqrt(np.mean(np.sum((anchors - anchors.mean(axis=0)) ** 2, axis=1))))
    return max(0.01, spread / 2.0)
