"""Rotation vectors and unit quaternions (w x y z), compiled."""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

_SMALL_rad = 1e-9


@jit
def to_quaternion(phi: FloatArray, q: FloatArray) -> None:
    """Write the quaternion `q` (4,) of the rotation by the vector `phi` (3,), rad."""
    angle = math.sqrt(phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2)
    share = math.sin(0.5 * angle) / angle if angle > _SMALL_rad else 0.5
    q[0] = math.cos(0.5 * angle)
    for i in range(3):
        q[1 + i] = share * phi[i]


@jit
def to_rotation_vector(q: FloatArray, phi: FloatArray) -> None:
    """Write the rotation vector `phi` (3,), rad, up to π long, of the quaternion `q` (4,)."""
    size = math.sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    sign = 1.0 if q[0] >= 0.0 else -1.0
    share = 2.0
    if size > _SMALL_rad:
        share = 2.0 * math.atan2(size, sign * q[0]) / size
    for i in range(3):
        phi[i] = sign * share * q[1 + i]


@jit
def multiply(p: FloatArray, q: FloatArray, inverted: bool, out: FloatArray) -> None:
    """Write p q, or with `inverted` p q*, into `out` (4,), which is neither: first q, then p."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    if inverted:
        x, y, z = -x, -y, -z
    out[0] = p[0] * w - p[1] * x - p[2] * y - p[3] * z
    out[1] = p[0] * x + p[1] * w + p[2] * z - p[3] * y
    out[2] = p[0] * y - p[1] * z + p[2] * w + p[3] * x
    out[3] = p[0] * z + p[1] * y - p[2] * x + p[3] * w
