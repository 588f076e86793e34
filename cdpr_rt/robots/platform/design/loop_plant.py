"""The linear plant of a platform's loop at a pose: rotors, cables, and what their tension stiffens.

Deviations of the rotors x (n,), as paid-out cable, from a platform q (d,) that stands under the
tensions t obey, with cables of stiffness k_i = EA/ρ_i and damping b k_i,

    m_r s² x = T - τ      M_p s² q = -J^T T - K_G q      T = diag(k (1 + b s)) (J q - x)

K_G = ∂(J^T t - w)/∂q, w the weight, is the geometric stiffness (`CableKinematics`): turned, cables
pull the platform elsewhere, whatever their elasticity. With T eliminated, κ = k (1 + b s),

    x = -G τ      G = diag(1/(m_r s² + κ)) + a J (M_p s² + K_G + J^T diag(m_r s² a) J)^-1 J^T a

a = diag(κ/(m_r s² + κ)). All is taken along the modes of the platform without cables' stretch: J =
Q R and R^-T M_p R^-1 = U λ U^T, so that the tensions' directions P = Q U are orthonormal, λ is what
each mode has of mass, and the loop's damping and stiffness are diagonal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.cable import ASSUMED_DAMPING_s
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform.body_kernel import body_of, write_mass_matrix, write_wrench
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.tension.tension_distribution import tension_distribution

ComplexArray = NDArray[np.complex128]

CABLE_DAMPING_s, LITTLE_DAMPING_s = ASSUMED_DAMPING_s, 5e-4
"""b, as it is assumed, and of cables that damp little: 5 % of critical at 30 Hz."""
_TAUT_N = 1.0
"""Least tension at which a cable's sag is taken for a flat parabola."""
_OF_LEAST = (0.0, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 0.875, 0.625, 0.0)
_OF_GREATEST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.125, 0.375, 1.0)
NONE, LEAST, BETWEEN, GREATEST, LEVELS = 0, 5, 7, 8, 9
"""Tensions whose geometric stiffness is looked at: none, and from little to the greatest that may
be planned at a pose, by some doubling a step: a loop that keeps its margin all the way from one
that is stable without them is stable with them."""


class LinearPlant(NamedTuple):
    """The plant along the modes of the platform at one pose."""

    mass_kg: FloatArray
    """λ of each mode, (d,)."""
    pulls: FloatArray
    """P, (n, d): by how much each cable becomes longer along each mode."""
    stiffness_N_m: FloatArray
    """k of each cable, with its sag where it weighs something, (LEVELS, n)."""
    geometric_N_m: FloatArray
    """K_G, (LEVELS, d, d)."""
    response_m_N: ComplexArray
    """G, (LEVELS, stiffnesses, frequencies, d, d)."""


def planned_tensions(model: PlatformModel, pose: Pose) -> FloatArray:
    """Return the least and the greatest tensions (2, n) that carry the weight at a pose, N.

    Within the planned bounds; where none carry it, those that come nearest.
    """
    low, high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
    W, planned = model.kinematics.wrench_matrix(pose), np.zeros((2, model.kinematics.n))
    weight = weight_at(model, pose)[0][list(model.kinematics.directions)]
    weight += model.kinematics.hanging_wrenches(pose.array[None])[0]
    for wanted, t in zip((low, high), planned, strict=True):
        scale = model.wrench_scale
        tension_distribution("minimum-deviation", low, high, scale, wanted).solve(W, weight, t)
    return planned


def geometric_stiffness(model: PlatformModel, pose: Pose, tension_N: FloatArray) -> FloatArray:
    """Return `whole_stiffness` of the controlled directions, K_G (d, d)."""
    directions = list(model.kinematics.directions)
    return whole_stiffness(model, pose, tension_N)[np.ix_(directions, directions)]


def whole_stiffness(model: PlatformModel, pose: Pose, tension_N: FloatArray) -> FloatArray:
    """Return ∂(J^T t - w)/∂x (6, 6) of a platform that stands under tensions t (n,).

    In N/m, N/rad, Nm/m and Nm/rad, of all directions: that of the cables, and of the weight m g at
    r from the origin, -[m g]× [r]× about the axes. Symmetric where t carries the weight, and made
    so elsewhere.
    """
    K = model.kinematics.geometric_stiffness(pose, tension_N)
    weight, r = weight_at(model, pose)
    K[3:, 3:] -= np.outer(r, weight[:3]) - (weight[:3] @ r) * np.eye(3)
    return np.asarray(0.5 * (K + K.T))


def linear_plant(
    model: PlatformModel,
    q: FloatArray,
    rotors_kg: FloatArray,
    stiffness_N: FloatArray,
    s: ComplexArray,
    shares: Sequence[float],
) -> LinearPlant:
    """Return the plant at a set-point (d,) for frequencies s (f,) and shares of the stiffness.

    Raises GeometryError where the cables do not hold the platform.
    """
    pose, kinematics = model.pose(q), model.kinematics
    directions = list(kinematics.directions)
    M, _ = _mass_matrix(model, pose)
    J = kinematics.jacobian(pose)
    if np.linalg.matrix_rank(J) < J.shape[1]:
        raise GeometryError("the cables cannot hold one direction, whatever their tensions")
    orthogonal, R = np.linalg.qr(J)
    inverse = np.linalg.inv(R)
    mass_kg, modes = np.linalg.eigh(inverse.T @ M[np.ix_(directions, directions)] @ inverse)
    P, along = orthogonal @ modes, inverse @ modes
    least, greatest = (
        along.T @ geometric_stiffness(model, pose, t) @ along for t in planned_tensions(model, pose)
    )
    shares_of = zip(_OF_LEAST, _OF_GREATEST, strict=True)
    geometric = np.array([a * least + b * greatest for a, b in shares_of])
    stiffness = cable_stiffness(model, pose, stiffness_N)
    responses = [
        [_response(P, mass_kg, K_G, rotors_kg, share * k, s) for share in shares]
        for K_G, k in zip(geometric, stiffness, strict=True)
    ]
    return LinearPlant(mass_kg, P, stiffness, geometric, np.array(responses))


def cable_stiffness(model: PlatformModel, pose: Pose, stiffness_N: FloatArray) -> FloatArray:
    """Return k of cables of EA `stiffness_N` (n,) at the tensions of all levels, (LEVELS, n).

    EA/ρ, and in series, where cables have a weight w per length that counts, what a flat parabola
    yields under its tension t: 12 t³/((w a)² ρ) with a across (Ernst, 1965). Below the least
    tensions, which no cable is planned with, that of the least.
    """
    kinematics = model.kinematics
    elastic = stiffness_N / kinematics.lengths(pose)
    sag = kinematics.sag_N3_m(pose)
    if not sag.any():
        return np.tile(elastic, (LEVELS, 1))
    least, greatest = planned_tensions(model, pose)
    shares_of = zip(_OF_LEAST[LEAST:], _OF_GREATEST[LEAST:], strict=True)
    levels = [least] * LEAST + [a * least + b * greatest for a, b in shares_of]
    return np.array([1.0 / (1.0 / elastic + sag / np.maximum(t, _TAUT_N) ** 3) for t in levels])


def _response(
    P: FloatArray,
    mass_kg: FloatArray,
    K_G: FloatArray,
    rotors_kg: FloatArray,
    k: FloatArray,
    s: ComplexArray,
) -> ComplexArray:
    """Return G (f, d, d) along the modes, for which J is P (n, d) and M_p diag(λ)."""
    s = s[:, None]
    elastic, rotors = k * (1.0 + CABLE_DAMPING_s * s), rotors_kg * s**2
    together = 1.0 / (rotors + elastic)
    a = elastic * together
    H = (P.T * (rotors * a)[:, None]) @ P + K_G
    H[:, range(len(mass_kg)), range(len(mass_kg))] += mass_kg * s**2
    pulled = (P.T * a[:, None]) @ P
    return np.asarray((P.T * together[:, None]) @ P + pulled.mT @ np.linalg.solve(H, pulled))


def _mass_matrix(model: PlatformModel, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """Return the mass matrix (6, 6), and centre of mass r and inertia (4, 3) in the room."""
    M, about = np.zeros((6, 6)), np.zeros((4, 3))
    write_mass_matrix(body_of(model.platform), pose.array, about, M)
    return M, about


def weight_at(model: PlatformModel, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """Return the wrench of the weight (6,), and the centre of mass from the origin r (3,)."""
    M, about = _mass_matrix(model, pose)
    wrench, rest = np.zeros(6), np.zeros(6)
    write_wrench(body_of(model.platform), M, about, rest, rest, wrench)
    return wrench, about[0]
