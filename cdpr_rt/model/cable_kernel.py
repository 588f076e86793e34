"""Kernels of n cables that may stretch and sag: lengths, directions, wrenches on a platform.

Tremblay (thesis), eqs. (3.1) to (3.14), in m and rad. A twist is the velocity of the platform's
origin and its angular velocity, both along the axes of the room; a small change of pose likewise.
Arrays, all of float64:

    pose      (4, 3)      position p, and below it the rotation matrix Q
    geometry  (13, n)     rows EXIT, ANCHOR (in the platform's frame), RADIUS of a swivel pulley,
                          AXIS of its swivelling: unit vector along which the cable comes up to it;
                          WEIGHT per length as a vector in the room, N/m, 0 for weightless cables
    cables    (9, n)      J transposed (6, n), then rows FREE, ARC, ERROR
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

ANCHOR, RADIUS, AXIS, WEIGHT, GEOMETRY_ROWS = 3, 6, 7, 10, 13
FREE, ARC, ERROR, CABLE_ROWS = 6, 7, 8, 9
TINY = 1e-300


@jit
def run_cables(geometry: FloatArray, pose: FloatArray, cables: FloatArray) -> None:
    """Write J^T, FREE and ARC of all cables at the pose; a cable's length is FREE + ARC.

    Eqs. (3.2), (3.10): c = p + Q b - a, ρ = |c|, u = c/ρ, a row of J is (u, Q b × u). The row of a
    cable without length is zero.
    """
    px, py, pz = pose[0, 0], pose[0, 1], pose[0, 2]
    xx, xy, xz = pose[1, 0], pose[1, 1], pose[1, 2]
    yx, yy, yz = pose[2, 0], pose[2, 1], pose[2, 2]
    zx, zy, zz = pose[3, 0], pose[3, 1], pose[3, 2]
    for i in range(geometry.shape[1]):
        bx, by, bz = geometry[3, i], geometry[4, i], geometry[5, i]
        rx = xx * bx + xy * by + xz * bz
        ry = yx * bx + yy * by + yz * bz
        rz = zx * bx + zy * by + zz * bz
        ux, uy, uz = px + rx - geometry[0, i], py + ry - geometry[1, i], pz + rz - geometry[2, i]
        free = math.sqrt(ux * ux + uy * uy + uz * uz)
        inverse = 1.0 / (free + TINY)
        ux, uy, uz = ux * inverse, uy * inverse, uz * inverse
        cables[0, i], cables[1, i], cables[2, i] = ux, uy, uz
        cables[3, i], cables[4, i] = ry * uz - rz * uy, rz * ux - rx * uz
        cables[5, i] = rx * uy - ry * ux
        cables[FREE, i], cables[ARC, i] = free, 0.0
    for i in range(geometry.shape[1]):
        if geometry[RADIUS, i] > 0.0:
            _wind(geometry, pose, cables, i)


@jit
def run_poses(geometry: FloatArray, poses: FloatArray, cables: FloatArray) -> None:
    """Write all cables at each of m poses (m, 4, 3) into `cables` (m, 9, n), as `run_cables`."""
    for j in range(poses.shape[0]):
        run_cables(geometry, poses[j], cables[j])


@jit
def wrench_matrices(
    geometry: FloatArray, poses: FloatArray, chosen: IntArray, cables: FloatArray, W: FloatArray
) -> None:
    """Write -J^T of the chosen directions (d,) into `W` (m, d, n) for poses (m, 4, 3).

    The column of a cable without length is nan. `cables` is overwritten.
    """
    for j in range(W.shape[0]):
        run_cables(geometry, poses[j], cables)
        for i in range(W.shape[2]):
            for k in range(W.shape[1]):
                W[j, k, i] = -cables[chosen[k], i] if cables[FREE, i] > 0.0 else math.nan


@jit
def hang(geometry: FloatArray, pose: FloatArray, cables: FloatArray, wrench: FloatArray) -> None:
    """Add the wrench (6,) of the cables' own weight on the platform to `wrench`.

    A cable has weight w per length (a vector), free length ρ, and tension t in its middle. To
    second order in weight over tension, it pulls the platform with t towards its exit point and
    with half of its weight, ρ w/2, at Q b from the platform's origin. This approximates the
    catenary by a parabola; no derivative of t occurs. The tension at the winch is t +
    `tension_rise`. `cables` has the rows of `run_cables` at the pose.
    """
    for i in range(geometry.shape[1]):
        half = 0.5 * cables[FREE, i]
        fx, fy = half * geometry[WEIGHT, i], half * geometry[WEIGHT + 1, i]
        fz = half * geometry[WEIGHT + 2, i]
        if fx == 0.0 and fy == 0.0 and fz == 0.0:
            continue
        bx, by, bz = geometry[3, i], geometry[4, i], geometry[5, i]
        rx = pose[1, 0] * bx + pose[1, 1] * by + pose[1, 2] * bz
        ry = pose[2, 0] * bx + pose[2, 1] * by + pose[2, 2] * bz
        rz = pose[3, 0] * bx + pose[3, 1] * by + pose[3, 2] * bz
        wrench[0] += fx
        wrench[1] += fy
        wrench[2] += fz
        wrench[3] += ry * fz - rz * fy
        wrench[4] += rz * fx - rx * fz
        wrench[5] += rx * fy - ry * fx


@jit
def tension_rise(geometry: FloatArray, cables: FloatArray, i: int) -> float:
    """Return the excess of tension at a cable's exit over that in its middle: ρ u·w/2, N.

    The unit vector u points from exit to anchor, so this is half of the weight per length times the
    height of the exit above the anchor. The tension at the platform is lower than in the middle by
    the same amount.
    """
    along = 0.0
    for k in range(3):
        along += cables[k, i] * geometry[WEIGHT + k, i]
    return float(0.5 * cables[FREE, i] * along)


@jit
def write_tension_rises(geometry: FloatArray, cables: FloatArray, rise: FloatArray) -> None:
    """Write `tension_rise` of each cable into `rise` (n,)."""
    for i in range(rise.size):
        rise[i] = tension_rise(geometry, cables, i)


@jit
def hanging_wrenches(
    geometry: FloatArray, poses: FloatArray, chosen: IntArray, cables: FloatArray, out: FloatArray
) -> None:
    """Write the wrench of the cables' weight, as `hang`, into `out` (m, d) at poses (m, 4, 3).

    `cables` is overwritten.
    """
    whole = np.empty(6)
    for j in range(out.shape[0]):
        run_cables(geometry, poses[j], cables)
        whole[:] = 0.0
        hang(geometry, poses[j], cables, whole)
        for k in range(out.shape[1]):
            out[j, k] = whole[chosen[k]]


@jit
def _wind(geometry: FloatArray, pose: FloatArray, cables: FloatArray, i: int) -> None:
    """Change cable `i` from a straight line to one that runs over its swivel pulley.

    The cable arrives at the exit point along the swivel axis k. In the plane through k and the
    anchor, the anchor is at distance `beside` from the axis and at distance `along` from the exit
    point in the direction of k. With X = beside - r and d² = X² + along² the free length is l =
    √(d² - r²), and the wrap angle θ has sin θ = (X l + along r)/d² and cos θ = (along l - X r)/d².
    The length is l + r θ. Its derivative with respect to the anchor position is the direction of
    the free part. If the anchor is inside the pulley, l = 0.
    """
    r = geometry[RADIUS, i]
    kx, ky, kz = geometry[AXIS, i], geometry[AXIS + 1, i], geometry[AXIS + 2, i]
    straight = cables[FREE, i]
    cx, cy, cz = straight * cables[0, i], straight * cables[1, i], straight * cables[2, i]
    along = cx * kx + cy * ky + cz * kz
    ex, ey, ez = cx - along * kx, cy - along * ky, cz - along * kz
    beside = math.sqrt(ex * ex + ey * ey + ez * ez)
    x = beside - r
    square = max(x * x + along * along, TINY)
    free = math.sqrt(max(square - r * r, 0.0))
    sine, cosine = (x * free + along * r) / square, (along * free - x * r) / square
    angle = math.atan2(sine, cosine)
    if angle < -0.5 * math.pi:
        angle += 2.0 * math.pi
    sine /= max(beside, TINY)
    ux, uy, uz = sine * ex + cosine * kx, sine * ey + cosine * ky, sine * ez + cosine * kz
    # from the platform's origin to the anchor
    rx = cx + geometry[0, i] - pose[0, 0]
    ry = cy + geometry[1, i] - pose[0, 1]
    rz = cz + geometry[2, i] - pose[0, 2]
    cables[0, i], cables[1, i], cables[2, i] = ux, uy, uz
    cables[3, i], cables[4, i] = ry * uz - rz * uy, rz * ux - rx * uz
    cables[5, i] = rx * uy - ry * ux
    cables[FREE, i], cables[ARC, i] = free, r * angle


@jit
def compare(
    geometry: FloatArray, lengths: FloatArray, pose: FloatArray, cables: FloatArray
) -> float:
    """Write the cables at the pose, and their ERROR, eq. (3.13); return the sum of its squares."""
    run_cables(geometry, pose, cables)
    cost = 0.0
    for i in range(lengths.size):
        error = cables[FREE, i] + cables[ARC, i] - lengths[i]
        cables[ERROR, i] = error
        cost += error * error
    return cost


# Kernels of cables that stretch and sag.

_MOST_ITERATIONS = 100
_SOLVED = 1e-14


@jit
def unstretched_length(
    across: float, height: float, tension: float, compliance: float, weight: float
) -> float:
    """Return the unstretched length of a cable between two points, or nan if no cable fits.

    `tension` acts at one end. The other end is `height` below it and at the horizontal distance
    `across`. The cable is an elastic catenary: with H, V the components of `tension` t, T' = √(H² +
    (V - wL)²) the tension at the other end, k = 2/(t + T'), x = wL/(t + T'), compliance c = 1/EA

        across = H L (c + k artanh(x)/x)        height = (V - wL/2) L (c + k)

    These are eqs. (3.81) to (3.84), extended to stretch and to ends at any height. They give H and
    V in terms of L. H² + V² = t² is then a quadratic equation in L², and its smaller root is the
    taut cable. The two brackets hardly depend on L and are found by iteration. Without weight the
    cable is straight: L = √(across² + height²)/(1 + t/EA).
    """
    straight = math.sqrt(across * across + height * height)
    if weight == 0.0:
        return straight / (1.0 + tension * compliance)
    if not tension > 0.0:
        return math.nan
    beside = above = compliance + 1.0 / tension
    length = 0.0
    for _ in range(_MOST_ITERATIONS):
        h, v = across / beside, height / above
        middle = tension * tension - weight * v
        square = h * h + v * v
        discriminant = middle * middle - weight * weight * square
        if not (middle > 0.0 and discriminant >= 0.0):
            return math.nan
        before = length
        length = math.sqrt(2.0 * square / (middle + math.sqrt(discriminant)))
        if abs(length - before) <= _SOLVED * length:
            return length
        horizontal, vertical = h / length, v / length - 0.5 * weight * length
        ends = tension + math.sqrt(horizontal * horizontal + vertical * vertical)
        x = weight * length / ends
        beside = compliance + 2.0 / ends * (math.atanh(x) / x if x > 1e-5 else 1.0 + x * x / 3.0)
        above = compliance + 2.0 / ends
    return math.nan


@jit
def write_unstretched_lengths(
    direction: FloatArray,
    free: FloatArray,
    arc: FloatArray,
    up: FloatArray,
    tension: FloatArray,
    compliance: float,
    weight: float,
    lengths: FloatArray,
) -> None:
    """Write the unstretched `lengths` (n,) of cables with `tension` (n,) at the platform.

    `direction` (3, n) and `free` (n,) describe the free parts as straight lines. `arc` (n,) are the
    lengths on the pulleys. `up` is the unit vector against gravity.
    """
    for i in range(lengths.size):
        x, y, z = direction[0, i], direction[1, i], direction[2, i]
        sine = x * up[0] + y * up[1] + z * up[2]
        x, y, z = x - sine * up[0], y - sine * up[1], z - sine * up[2]
        across = free[i] * math.sqrt(x * x + y * y + z * z)
        lengths[i] = unstretched_length(
            across, free[i] * sine, tension[i], compliance, weight
        ) + arc[i] / (1.0 + tension[i] * compliance)
