"""A rigid platform on cables: its motion under their tensions, gravity and the floor (compiled)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdpr_profiles.jit import jit
from cdpr_sim_bus.robot.robot_plant import FloorPlant, PlatformPlant, RobotPlant, StartPlant

MOST_CABLES = 16
MOST_FEET = 16
_F8 = np.float64
_BLOCK_s = 0.01
"""Damping of an obstacle over its stiffness."""
PLATFORM_DTYPE = np.dtype(
    [
        # parameters
        ("cables", np.int64),
        ("feet", np.int64),
        ("planar", np.int64),  # 1: moves only in x and y and turns only about z
        ("mass", _F8),
        ("inertia", _F8, (3, 3)),  # kg m2, about the centre of mass, in the platform's frame
        ("inverse_inertia", _F8, (3, 3)),
        ("gravity", _F8, (3,)),  # m/s2
        ("air", _F8),  # N s/m, and N m s/rad times `reach` squared
        ("reach", _F8),  # m
        ("mobility", _F8),  # 1/kg, acceleration of an anchor point by a unit force along its cable
        ("exit", _F8, (MOST_CABLES, 3)),  # m, in the room
        ("pulley_radius", _F8, (MOST_CABLES,)),  # m; 0: a point
        ("pulley_axis", _F8, (MOST_CABLES, 3)),  # unit vector along which a cable comes to it
        ("com", _F8, (3,)),  # m, centre of mass from the origin, in the platform's frame
        ("anchor", _F8, (MOST_CABLES, 3)),  # m, from the centre of mass, in the platform's frame
        ("foot", _F8, (MOST_FEET, 3)),  # m, likewise; a foot that stands on the floor
        ("floor", _F8),  # m, height of the floor against gravity; -inf without
        ("floor_stiffness", _F8),  # N/m of each foot
        ("floor_damping", _F8),  # N s/m
        ("standing", np.int64),  # whether a foot touched the floor in the last step
        ("floor_friction", _F8),  # friction coefficient of a foot on the floor
        # injected faults
        ("push", _F8, (3,)),  # N, force on the centre of mass
        ("block_stiffness", _F8),  # N/m, of a damped obstacle that holds the centre of mass; 0 none
        ("block", _F8, (3,)),  # m, where it holds it
        # state
        ("position", _F8, (3,)),  # m, of the centre of mass
        ("velocity", _F8, (3,)),
        ("rotation", _F8, (3, 3)),  # from the platform's frame to the room
        ("spin", _F8, (3,)),  # rad/s, in the room
        ("bent", _F8, (MOST_FEET, 3)),  # m, spring deflection of feet that stick
        ("arm", _F8, (MOST_CABLES, 3)),  # m, anchor points from the centre of mass, in the room
        ("way", _F8, (MOST_CABLES, 3)),  # unit vectors from anchor points along the cables
    ]
)

PlatformArray = NDArray[np.void]


@jit
def update_cable_ends(p: Any, motors: Any) -> None:
    """Update the distance from each motor to the far end of its cable, and the rate of change."""
    g = math.sqrt(p.gravity[0] ** 2 + p.gravity[1] ** 2 + p.gravity[2] ** 2)
    for i in range(p.cables):
        m = motors[i]
        for k in range(3):
            arm = 0.0
            for j in range(3):
                arm += p.rotation[k, j] * p.anchor[i, j]
            p.arm[i, k] = arm
        free, wound = lead_cable(p, i)
        vx, vy, vz = anchor_velocity(p, i)
        way = p.way[i]
        rise = way[0] * p.gravity[0] + way[1] * p.gravity[1] + way[2] * p.gravity[2]
        level2 = 1.0 if g == 0.0 else 1.0 - (rise / g) ** 2
        m.far_distance = free + wound
        m.far_rate = -(vx * way[0] + vy * way[1] + vz * way[2])
        m.far_level = math.sqrt(max(0.0, level2))
        m.far_wound = wound
        m.far_drop = 0.0 if g == 0.0 else -free * rise / g
        if wound > 0.0:  # only the free part sags, in proportion to the cube of its length
            m.far_level *= (free / (free + wound)) ** 1.5


@jit
def lead_cable(p: Any, i: int) -> tuple[float, float]:
    """Update the direction of cable i; return its free length and the length on its pulley, m.

    The pulley swivels about the axis along which the cable arrives, so that its plane contains the
    anchor point. Relative to the pulley's centre, the cable arrives at -r along the axis; the
    anchor point is at distance D and at an angle φ from the axis. The wound angle is θ = φ + asin(r
    / D), the free length sqrt(D² - r²) along the tangent at θ. Moving the anchor point along the
    tangent changes only the free length; moving it across rotates the tangent point. So the cable's
    direction is the gradient of the whole length, and a pulley creates no energy.
    """
    r = p.pulley_radius[i]
    way = p.way[i]
    for k in range(3):
        way[k] = p.exit[i, k] - p.position[k] - p.arm[i, k]
    if r <= 0.0:
        free = max(1e-6, math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2))
        for k in range(3):
            way[k] /= free
        return free, 0.0
    axis = p.pulley_axis[i]
    along = -(way[0] * axis[0] + way[1] * axis[1] + way[2] * axis[2])
    for k in range(3):
        way[k] = -way[k] - along * axis[k]
    beside = max(1e-9, math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2))
    distance = max(r + 1e-6, math.hypot(beside - r, along))
    angle = math.atan2(beside - r, along) + math.asin(r / distance)
    if angle < -0.5 * math.pi:
        angle += 2.0 * math.pi
    sine, cosine = math.sin(angle), math.cos(angle)
    for k in range(3):
        way[k] = -sine * way[k] / beside - cosine * axis[k]
    return math.sqrt(distance * distance - r * r), r * angle


@jit
def anchor_velocity(p: Any, i: int) -> tuple[float, float, float]:
    """Return the velocity of the anchor point of cable i in the room, m/s."""
    w, r = p.spin, p.arm[i]
    return (
        p.velocity[0] + w[1] * r[2] - w[2] * r[1],
        p.velocity[1] + w[2] * r[0] - w[0] * r[2],
        p.velocity[2] + w[0] * r[1] - w[1] * r[0],
    )


@jit
def step_platform(p: Any, motors: Any, h: float) -> None:
    """Advance the platform by `h` seconds under the tensions of its motors' last step.

    Symplectic Euler for the translation; the rotation is exact, so that its matrix stays
    orthogonal.
    """
    fx = p.mass * p.gravity[0] - p.air * p.velocity[0]
    fy = p.mass * p.gravity[1] - p.air * p.velocity[1]
    fz = p.mass * p.gravity[2] - p.air * p.velocity[2]
    for k in range(3):
        if p.push[k] != 0.0 or p.block_stiffness > 0.0:
            stop = p.block_stiffness * (p.block[k] - p.position[k] - _BLOCK_s * p.velocity[k])
            if k == 0:
                fx += p.push[k] + stop
            elif k == 1:
                fy += p.push[k] + stop
            else:
                fz += p.push[k] + stop
    drag = p.air * p.reach * p.reach
    tx, ty, tz = -drag * p.spin[0], -drag * p.spin[1], -drag * p.spin[2]
    g = math.sqrt(p.gravity[0] ** 2 + p.gravity[1] ** 2 + p.gravity[2] ** 2)
    for i in range(p.cables):
        t, load = motors[i].tension, 0.0 if g == 0.0 else motors[i].hung_load / g
        x = t * p.way[i, 0] + load * p.gravity[0]
        y = t * p.way[i, 1] + load * p.gravity[1]
        z = t * p.way[i, 2] + load * p.gravity[2]
        r = p.arm[i]
        fx += x
        fy += y
        fz += z
        tx += r[1] * z - r[2] * y
        ty += r[2] * x - r[0] * z
        tz += r[0] * y - r[1] * x
    if p.floor > -math.inf:
        gx, gy, gz, hx, hy, hz = floor_force(p, h)
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + hx, ty + hy, tz + hz
    p.velocity[0] += h * fx / p.mass
    p.velocity[1] += h * fy / p.mass
    if p.planar:
        p.spin[2] += h * tz * p.inverse_inertia[2, 2]
        p.velocity[2] = p.spin[0] = p.spin[1] = 0.0
    else:
        p.velocity[2] += h * fz / p.mass
        turn(p, h, tx, ty, tz)
    for k in range(3):
        p.position[k] += h * p.velocity[k]
    rotate(p, h)


@jit
def turn(p: Any, h: float, tx: float, ty: float, tz: float) -> None:
    """Advance the spin by Euler's equation, in the platform's frame."""
    R = p.rotation
    w = np.zeros(3)
    t = np.zeros(3)
    for k in range(3):
        w[k] = R[0, k] * p.spin[0] + R[1, k] * p.spin[1] + R[2, k] * p.spin[2]
        t[k] = R[0, k] * tx + R[1, k] * ty + R[2, k] * tz
    l0 = p.inertia[0, 0] * w[0] + p.inertia[0, 1] * w[1] + p.inertia[0, 2] * w[2]
    l1 = p.inertia[1, 0] * w[0] + p.inertia[1, 1] * w[1] + p.inertia[1, 2] * w[2]
    l2 = p.inertia[2, 0] * w[0] + p.inertia[2, 1] * w[1] + p.inertia[2, 2] * w[2]
    t[0] -= w[1] * l2 - w[2] * l1
    t[1] -= w[2] * l0 - w[0] * l2
    t[2] -= w[0] * l1 - w[1] * l0
    for k in range(3):
        n = p.inverse_inertia
        w[k] += h * (n[k, 0] * t[0] + n[k, 1] * t[1] + n[k, 2] * t[2])
    for k in range(3):
        p.spin[k] = R[k, 0] * w[0] + R[k, 1] * w[1] + R[k, 2] * w[2]


@jit
def rotate(p: Any, h: float) -> None:
    """Turn the platform by its spin during `h` with Rodrigues' formula, one column at a time."""
    sx, sy, sz = p.spin[0], p.spin[1], p.spin[2]
    speed = math.sqrt(sx * sx + sy * sy + sz * sz)
    angle = h * speed
    if angle < 1e-15:
        return
    x, y, z = sx / speed, sy / speed, sz / speed
    sine, rest = math.sin(angle), 2.0 * math.sin(0.5 * angle) ** 2
    R = p.rotation
    for j in range(3):
        a, b, c = R[0, j], R[1, j], R[2, j]
        u, v, w = y * c - z * b, z * a - x * c, x * b - y * a
        R[0, j] = a + sine * u + rest * (y * w - z * v)
        R[1, j] = b + sine * v + rest * (z * u - x * w)
        R[2, j] = c + sine * w + rest * (x * v - y * u)


@jit
def floor_force(p: Any, h: float) -> tuple[float, float, float, float, float, float]:
    """Return force and moment of the floor over the next `h` s: each foot on a damped spring.

    While dry friction holds a foot, a second spring acts along the floor. A foot that sticks stays
    in place; a foot that slides drags its spring along.
    """
    g = math.sqrt(p.gravity[0] ** 2 + p.gravity[1] ** 2 + p.gravity[2] ** 2)
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if g == 0.0:
        return fx, fy, fz, tx, ty, tz
    nx, ny, nz = -p.gravity[0] / g, -p.gravity[1] / g, -p.gravity[2] / g
    R, w = p.rotation, p.spin
    p.standing = 0
    for i in range(p.feet):
        q = p.foot[i]
        rx = R[0, 0] * q[0] + R[0, 1] * q[1] + R[0, 2] * q[2]
        ry = R[1, 0] * q[0] + R[1, 1] * q[1] + R[1, 2] * q[2]
        rz = R[2, 0] * q[0] + R[2, 1] * q[1] + R[2, 2] * q[2]
        height = (p.position[0] + rx) * nx + (p.position[1] + ry) * ny + (p.position[2] + rz) * nz
        depth = p.floor - height
        bent = p.bent[i]
        if depth <= 0.0:
            bent[0] = bent[1] = bent[2] = 0.0
            continue
        p.standing = 1
        vx = p.velocity[0] + w[1] * rz - w[2] * ry
        vy = p.velocity[1] + w[2] * rx - w[0] * rz
        vz = p.velocity[2] + w[0] * ry - w[1] * rx
        sinking = -(vx * nx + vy * ny + vz * nz)
        load = max(0.0, p.floor_stiffness * depth + p.floor_damping * sinking)
        sx, sy, sz = vx + sinking * nx, vy + sinking * ny, vz + sinking * nz
        k, d = p.floor_stiffness, p.floor_damping
        bent[0], bent[1], bent[2] = bent[0] + h * sx, bent[1] + h * sy, bent[2] + h * sz
        x, y, z = k * bent[0] + d * sx, k * bent[1] + d * sy, k * bent[2] + d * sz
        most, pull = p.floor_friction * load, math.sqrt(x * x + y * y + z * z)
        if pull > most:
            x, y, z = x * most / pull, y * most / pull, z * most / pull
            bent[0], bent[1], bent[2] = (x - d * sx) / k, (y - d * sy) / k, (z - d * sz) / k
        x, y, z = load * nx - x, load * ny - y, load * nz - z
        fx, fy, fz = fx + x, fy + y, fz + z
        tx += ry * z - rz * y
        ty += rz * x - rx * z
        tz += rx * y - ry * x
    return fx, fy, fz, tx, ty, tz


# Builds the true record of a platform from its profile and the errors in a plant file.

_EVEN_m = 1e-6
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RobotShape:
    """Nominal robot from its profile; points are (n, 2) in a plane or (n, 3), m.

    In a plane, rotation vectors and inertias have one number, about the normal of the plane.
    """

    exit_points_m: ArrayLike
    anchor_points_m: ArrayLike
    """Anchor points in the platform's frame."""
    mass_kg: float
    home_m: Sequence[float]
    """Position of the platform's origin at power-up, unless the plant gives another."""
    weights_N_m: Sequence[float]
    """Weight of each cable."""
    home_rotation_rad: Sequence[float] = (0.0,)
    """Rotation vector of the platform's frame at power-up, unless the plant gives another."""
    inertia_kg_m2: Sequence[float] | None = None
    """Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass, in the platform's frame; by default that of
    a plate whose corners are the anchor points."""
    centre_of_mass_m: Sequence[float] = (0.0, 0.0)
    """Centre of mass in the platform's frame."""
    pulley_radii_m: Sequence[float] | None = None
    """Radius of the pulley at each exit point; 0 by default."""
    pulley_axes: ArrayLike | None = None
    """Unit vector along which each cable arrives at its pulley, the swivel axis; by default
    upward."""
    feet_m: ArrayLike | None = None
    """Feet of the platform, in its frame; by default the corners of a box around its anchor
    points."""


def build_platform(
    shape: RobotShape, plant: RobotPlant, n: int, chance: np.random.Generator
) -> PlatformArray:
    """Return the record of a platform on `n` cables at rest; shape (1,), dtype PLATFORM_DTYPE.

    Raises ValueError if there is not one point for each axis.
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
    """Set mass and inertia; an inertia from the profile scales with the mass."""
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
        raise ValueError(f"{what}: shape {points.shape}; allowed: (n, 2) or (n, 3), n up to {most}")
    if n is not None and len(points) != n:
        raise ValueError(f"{what}: {len(points)} points; allowed: {n}, one for each axis")
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _default_feet(points: FloatArray) -> FloatArray:
    low, high = points.min(axis=0), points.max(axis=0)
    corners = [np.where(pick, high, low) for pick in np.ndindex(2, 2, 2)]
    return np.unique(corners, axis=0)


def _vector(values: Sequence[float]) -> FloatArray:
    return np.pad(np.asarray(values, float), (0, 3 - len(values)))


def _tensor(values: Sequence[float]) -> FloatArray:
    """Return an inertia as a matrix: of six numbers, or of one about the normal of a plane."""
    if len(values) == 1:
        return values[0] * np.eye(3)
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def rotation_of(vector: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a rotation vector, by Rodrigues' formula."""
    v = np.asarray(vector, float)
    angle = float(np.linalg.norm(v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * across @ across
    return np.asarray(matrix)


def _plate_radius(anchors: FloatArray) -> float:
    """Return the radius of gyration of a plate about its centre, given its corners."""
    spread = float(np.sqrt(np.mean(np.sum((anchors - anchors.mean(axis=0)) ** 2, axis=1))))
    return max(0.01, spread / 2.0)
