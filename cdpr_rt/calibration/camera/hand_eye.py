"""Hand-eye calibration: a camera's place on a platform from poses of both, in closed form.

Platform poses (Q_j, p_j) in the room and camera poses (C_j, c_j) in the frame of a map go with the
camera's place on the platform (X, x) and the map's in the room (Z, z) as

    Q_j X = Z C_j    and    p_j + Q_j x = Z c_j + z

Of two poses, Q_j^T Q_k X = X C_j^T C_k; with the rotation vectors a of the platform's turn and b of
the camera's, a = X b (Park and Martin 1994), of which X is the rotation that fits best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.geometry.rotations import angles, logarithms
from cdpr_rt.errors import InvalidRequestError

_LEAST_TURN_rad = 0.02
_ROUNDS = 5


@dataclass(frozen=True)
class Rigid:
    """A rotation (3, 3) and a position (3,) of one frame in another."""

    rotation: FloatArray
    position_m: FloatArray


def turned_camera(platform: FloatArray, camera: FloatArray) -> FloatArray:
    """Return X of rotations (N, 3, 3) of platform and camera; poses that do not fit count less.

    Raises InvalidRequestError where the platform hardly turns, or about one axis alone.
    """
    j, k = np.triu_indices(len(platform), 1)
    a = logarithms(platform[j].transpose(0, 2, 1) @ platform[k])
    b = logarithms(camera[j].transpose(0, 2, 1) @ camera[k])
    spread = np.sqrt(np.linalg.eigvalsh(b.T @ b / max(len(b), 1))) if len(b) else np.zeros(3)
    if spread[1] < _LEAST_TURN_rad:
        raise InvalidRequestError(
            f"the platform turns by {np.degrees(spread[1]):.1f} deg only about a second axis, which"
            " does not tell how the camera sits on it; allowed: hand_eye in the data, as measured"
        )
    weight = np.ones(len(a))
    for _ in range(_ROUNDS):
        X = _nearest_rotation((a * weight[:, None]).T @ b)
        off = np.linalg.norm(a - b @ X.T, axis=1)
        weight = _weights(off)
    return X


def rigid_places(
    platform: FloatArray, camera: Rigid, turn: FloatArray, place_m: FloatArray | None
) -> tuple[Rigid, Rigid]:
    """Return the camera's place on the platform and the map's in the room.

    `platform` (N, 4, 3) and `camera` (N, 3, 3), (N, 3) are poses, `turn` is X; `place_m` is x where
    it is known. Least squares, reweighted so that poses that do not fit count less.
    """
    Q, p = platform[:, 1:], platform[:, 0]
    weight = np.ones(len(p))
    for _ in range(_ROUNDS):
        Z = _nearest_rotation(np.einsum("j,jab,bc,jdc->ad", weight, Q, turn, camera.rotation))
        weight = _weights(angles(Q @ turn @ camera.rotation.transpose(0, 2, 1) @ Z.T))
    right = camera.position_m @ Z.T - p
    weight = np.ones(len(p))
    for _ in range(_ROUNDS):
        if place_m is None:
            A = np.concatenate([Q, np.broadcast_to(-np.eye(3), Q.shape)], axis=2)
            both = np.linalg.lstsq(
                (weight[:, None, None] * A).reshape(-1, 6), (weight[:, None] * right).ravel(), None
            )[0]
            x, z = both[:3], both[3:]
        else:
            x = place_m
            z = np.average(Q @ x - right, axis=0, weights=weight**2)
        weight = np.sqrt(_weights(np.linalg.norm(Q @ x - z - right, axis=1)))
    return Rigid(turn, x), Rigid(Z, z)


def _weights(off: FloatArray) -> FloatArray:
    """Return weights for distances, half at twice their median."""
    scale = 2.0 * max(float(np.median(off)), 1e-9)
    return np.asarray(1.0 / (1.0 + (off / scale) ** 2))


def _nearest_rotation(M: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(M)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ (sign[:, None] * right))
