"""Wrenches that a motion along a path requires, and wrenches that the cables can exert there."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.jit import jit
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.rigid_body import G_m_s2, in_space, inertia_kg_m2

# The wrenches that tensions within bounds exert, as half-spaces: facets of a zonotope.

_FLAT: Final = 1e-9


@jit
def _largest(scratch: FloatArray, r: int) -> tuple[int, int]:
    """Return row and column of the entry of largest magnitude, from index r on, of (d - 1, d)."""
    row, column = r, r
    for i in range(r, scratch.shape[0] - 1):
        for k in range(r, scratch.shape[1]):
            if abs(scratch[i, k]) > abs(scratch[row, column]):
                row, column = i, k
    return row, column


@jit
def _normal(W: FloatArray, columns: IntArray, scratch: FloatArray, normal: FloatArray) -> bool:
    """Write the normal (d,) of d - 1 columns of W; return False if it is not unique.

    The method is Gaussian elimination with full pivoting.
    """
    d = W.shape[0]
    order = np.arange(d)
    for r in range(d - 1):
        for k in range(d):
            scratch[r, k] = W[k, columns[r]]
    for r in range(d - 1):
        row, column = _largest(scratch, r)
        if abs(scratch[row, column]) < _FLAT:
            return False
        for k in range(d):
            scratch[r, k], scratch[row, k] = scratch[row, k], scratch[r, k]
        for i in range(d - 1):
            scratch[i, r], scratch[i, column] = scratch[i, column], scratch[i, r]
        order[r], order[column] = order[column], order[r]
        for i in range(d - 1):
            if i != r:
                factor = scratch[i, r] / scratch[r, r]
                for k in range(r, d):
                    scratch[i, k] -= factor * scratch[r, k]
    size = 1.0
    for r in range(d - 1):
        normal[order[r]] = -scratch[r, d - 1] / scratch[r, r]
        size += normal[order[r]] ** 2
    normal[order[d - 1]] = 1.0
    normal /= np.sqrt(size)
    return True


@jit
def write_facets(
    matrices: FloatArray,
    scale: FloatArray,
    combinations: IntArray,
    low: FloatArray,
    high: FloatArray,
    normals: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Write normals (m, f, d) and bounds (m, f) of the wrenches W t at m poses, low <= t <= high.

    The d - 1 cables in a row of `combinations` (f, d - 1) span two parallel facets: hyperplane
    shifting (Bouchard, Gosselin, Moore 2010; Gouttefarde, Krut 2010). Combinations that span no
    facet get a normal and bounds of 0. `matrices` (m, d, n) map tensions to wrenches, `scale` (d,)
    is the size of a wrench in each direction that counts as 1 N.
    """
    m, d, n = matrices.shape
    W, scratch = np.zeros((d, n)), np.zeros((d, d))
    for j in range(m):
        for k in range(d):
            for i in range(n):
                W[k, i] = matrices[j, k, i] / scale[k]
        for f in range(combinations.shape[0]):
            normal = normals[j, f]
            lower[j, f] = upper[j, f] = 0.0
            if not _normal(W, combinations[f], scratch, normal):
                normal[:] = 0.0
                continue
            for i in range(n):
                along = 0.0
                for k in range(d):
                    along += normal[k] * W[k, i]
                lower[j, f] += min(along * low[i], along * high[i])
                upper[j, f] += max(along * low[i], along * high[i])
            for k in range(d):
                normal[k] /= scale[k]


_STEP = 1e-6
_SMALL_rad = 1e-4


@dataclass(frozen=True)
class AvailableWrenches:
    """Half-spaces of the wrenches that can accelerate a platform at m poses.

    A wrench F (d,) is available if lower <= normals · F <= upper. F is force and moment about the
    centre of mass, in addition to the wrench at rest.
    """

    normals: FloatArray
    """Normals of the f facets at each pose, (m, f, d)."""
    lower: FloatArray
    """Lower bounds, (m, f)."""
    upper: FloatArray

    @property
    def holds(self) -> BoolArray:
        """Whether the platform can be held at rest, (m,)."""
        return np.asarray(((self.lower <= 0.0) & (self.upper >= 0.0)).all(axis=1))

    def spare(self, most: FloatArray) -> BoolArray:
        """Return whether a box of wrenches is available, (m,); `most` (m, d) is half its sides."""
        needed = np.einsum("mfd,md->mf", np.abs(self.normals), most)
        return np.asarray(((needed <= self.upper) & (-needed >= self.lower)).all(axis=1))


def available_wrenches(model: PlatformModel, positions: FloatArray) -> AvailableWrenches:
    """Return the available wrenches at positions (m, d); tensions keep the model's reserve."""
    workspace, poses = model.workspace(0.0, 0.0), model.poses(positions)
    matrices, hanging = workspace.wrench_matrices(poses), workspace.hanging_wrenches(poses)
    m, d, n = matrices.shape
    chosen = np.array(list(itertools.combinations(range(n), d - 1)), np.int64)
    normals = np.zeros((m, len(chosen), d))
    lower, upper = np.zeros((2, m, len(chosen)))
    low, high = model.low_N + model.reserve_N, model.torque_limited_N - model.reserve_N
    write_facets(matrices, model.wrench_scale, chosen, low, high, normals, lower, upper)
    weight = np.zeros(6)
    weight[model.positions - 1] = -model.platform.mass_kg * G_m_s2
    rest = normals @ weight[list(model.kinematics.directions)]
    rest += np.matmul(normals, hanging[:, :, None])[..., 0]
    return AvailableWrenches(normals, lower + rest, upper + rest)


class InertialWrenches:
    """The wrench (d,) about the centre of mass that accelerates a platform along a path."""

    def __init__(self, model: PlatformModel, positions: FloatArray) -> None:
        """Take positions (m, d)."""
        platform = model.platform
        self._directions, self._k = list(model.kinematics.directions), model.positions
        self._mass_kg = platform.mass_kg
        Q = model.poses(positions)[:, 1:]
        self._centre = Q @ in_space(platform.centre_of_mass_m)
        self._inertia = Q @ inertia_kg_m2(platform) @ np.swapaxes(Q, 1, 2)
        self._turn = self._vectors(positions)

    def of(self, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return the wrenches (m, d) for velocities and accelerations of positions (m, d)."""
        linear = self._linear(acceleration)
        rate, slope = self._vectors(velocity), self._vectors(acceleration)
        # the angular velocity is J(φ) φ'
        spin = _angular_velocity(self._turn, rate)
        size = np.maximum(np.linalg.norm(rate, axis=1), 1.0)[:, None]
        step = _STEP / size
        ahead = _angular_velocity(self._turn + step * rate, rate)
        turning = _angular_velocity(self._turn, slope) + (ahead - spin) / step
        arm = self._centre
        linear = linear + np.cross(turning, arm) + np.cross(spin, np.cross(spin, arm))
        momentum = np.einsum("mij,mj->mi", self._inertia, spin)
        moment = np.einsum("mij,mj->mi", self._inertia, turning) + np.cross(spin, momentum)
        return np.hstack([self._mass_kg * linear, moment])[:, self._directions]

    def _linear(self, values: FloatArray) -> FloatArray:
        out = np.zeros((len(values), 3))
        out[:, : self._k] = values[:, : self._k]
        return out

    def _vectors(self, values: FloatArray) -> FloatArray:
        """Return the rotational entries of (m, d) as vectors (m, 3)."""
        out = np.zeros((len(values), 3))
        for column, direction in enumerate(self._directions):
            if direction >= 3:
                out[:, direction - 3] = values[:, column]
        return out


def _angular_velocity(turn: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the angular velocities (m, 3) of rotation vectors `turn` with derivatives `rate`.

    J(φ) = 1 + (1 - cos θ)/θ² [φ]× + (θ - sin θ)/θ³ [φ]×².
    """
    angle = np.linalg.norm(turn, axis=1)[:, None]
    small = angle < _SMALL_rad
    safe = np.where(small, 1.0, angle)
    one = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    two = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    across = np.cross(turn, rate)
    return np.asarray(rate + one * across + two * np.cross(turn, across))
