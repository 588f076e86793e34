"""Poses of a platform: a position and a rotation; exponential and logarithm of rotations.

A change of pose x (6,) is (change of position, rotation vector), both in the room's frame:

    pose ⊞ x = (p + x_p, exp(x_φ) Q)          pose ⊟ other = (p - p', log(Q Q'^T))

so that other ⊞ (pose ⊟ other) = pose. Euler angles are not used.
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import jit

_MOST_SKEW = 1e-6
_SMALL = 1e-4


@jit
def exponential(phi: FloatArray, Q: FloatArray) -> None:
    """Write the rotation by the vector `phi` (3,), in rad, into `Q` (3, 3): Rodrigues' formula.

    Q = cos θ 1 + sin θ/θ [φ]× + (1 - cos θ)/θ² φ φ^T with θ = |φ|.
    """
    x, y, z = phi[0], phi[1], phi[2]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL:
        sine, versine = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        half = math.sin(0.5 * angle) / angle
        sine, versine = math.sin(angle) / angle, 2.0 * half * half
    cosine = 1.0 - versine * square
    Q[0, 0], Q[1, 1], Q[2, 2] = (
        cosine + versine * x * x,
        cosine + versine * y * y,
        cosine + versine * z * z,
    )
    Q[0, 1], Q[1, 0] = versine * x * y - sine * z, versine * x * y + sine * z
    Q[0, 2], Q[2, 0] = versine * x * z + sine * y, versine * x * z - sine * y
    Q[1, 2], Q[2, 1] = versine * y * z - sine * x, versine * y * z + sine * x


@jit
def logarithm(Q: FloatArray, phi: FloatArray) -> None:
    """Write the rotation vector of `Q` (3, 3) into `phi` (3,): 0 to π rad long.

    It is computed from the quaternion (s, v), whose largest component is found first: φ = 2
    atan2(|v|, s) v/|v|. For half a turn the result is either of the two possible vectors.
    """
    trace = Q[0, 0] + Q[1, 1] + Q[2, 2]
    if trace >= max(Q[0, 0], Q[1, 1], Q[2, 2]):
        s = 1.0 + trace
        x, y, z = Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]
    elif Q[0, 0] >= Q[1, 1] and Q[0, 0] >= Q[2, 2]:
        s, x = Q[2, 1] - Q[1, 2], 1.0 + 2.0 * Q[0, 0] - trace
        y, z = Q[0, 1] + Q[1, 0], Q[0, 2] + Q[2, 0]
    elif Q[1, 1] >= Q[2, 2]:
        s, y = Q[0, 2] - Q[2, 0], 1.0 + 2.0 * Q[1, 1] - trace
        x, z = Q[0, 1] + Q[1, 0], Q[1, 2] + Q[2, 1]
    else:
        s, z = Q[1, 0] - Q[0, 1], 1.0 + 2.0 * Q[2, 2] - trace
        x, y = Q[0, 2] + Q[2, 0], Q[1, 2] + Q[2, 1]
    if s < 0.0:
        s, x, y, z = -s, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(size, s) / size if size > 0.0 else 0.0
    phi[0], phi[1], phi[2] = factor * x, factor * y, factor * z


class Pose:
    """Position `p` (3,), in m, and rotation matrix `Q` (3, 3) of a platform in the room.

    Both are views of `array` (4, 3), the form in which kernels take a pose.
    """

    def __init__(self, position_m: FloatArray, rotation: FloatArray | None = None) -> None:
        """Copy position and rotation (default: none); raises GeometryError for invalid values."""
        self.array: FloatArray = np.zeros((4, 3))
        self.p = self.array[0]
        self.Q = self.array[1:]
        Q = np.eye(3) if rotation is None else np.asarray(rotation, float)
        p = np.asarray(position_m, float)
        if p.shape != (3,) or not np.isfinite(p).all():
            raise GeometryError(f"position {p.tolist()}; allowed: three finite numbers, in m")
        if Q.shape != (3, 3) or not (
            np.abs(Q @ Q.T - np.eye(3)).max() < _MOST_SKEW and np.linalg.det(Q) > 0.0
        ):
            raise GeometryError(f"rotation {Q.tolist()}; allowed: a rotation matrix (3, 3)")
        self.p[:] = p
        self.Q[:] = Q

    def plus(self, x: FloatArray) -> Pose:
        """Return this pose ⊞ `x` (6,)."""
        turn = np.empty((3, 3))
        exponential(np.ascontiguousarray(x[3:], float), turn)
        return Pose(self.p + x[:3], turn @ self.Q)

    def minus(self, other: Pose) -> FloatArray:
        """Return this pose ⊟ `other`: the change from `other` to this pose, (6,)."""
        x = np.empty(6)
        x[:3] = self.p - other.p
        logarithm(self.Q @ other.Q.T, x[3:])
        return x


def place_text(position: FloatArray, coordinates: int) -> str:
    """Return the `position` (d,) of a platform as text, in mm and deg.

    It begins with this number of `coordinates`, in m; a rotation vector follows, in rad.
    """
    text = f"at {', '.join(f'{1e3 * x:z.1f}' for x in position[:coordinates])} mm"
    turned = position[coordinates:]
    if not turned.any():
        return text
    return f"{text} turned by {', '.join(f'{math.degrees(x):z.1f}' for x in turned)} deg"
