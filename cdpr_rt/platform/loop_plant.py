"""The linear plant of a platform's loop at a pose: rotors, cables, and geometric stiffness.

Deviations of the rotors x (n,), as paid-out cable, from a platform q (d,) that stands under the
tensions t obey, with cables of stiffness k_i = EA/ρ_i and damping b k_i,

    m_r s² x = T - τ      M_p s² q = -J^T T - K_G q      T = diag(k (1 + b s)) (J q - x)

K_G = ∂(J^T t - w)/∂q, with the weight w, is the geometric stiffness (`CableKinematics`): cables of
a turned platform pull in other directions, even if they are rigid. After T is eliminated, with κ =
k (1 + b s),

    x = -G τ      G = diag(1/(m_r s² + κ)) + a J (M_p s² + K_G + J^T diag(m_r s² a) J)^-1 J^T a

a = diag(κ/(m_r s² + κ)). All matrices are expressed along the modes of the platform on rigid
cables: J = Q R and R^-T M_p R^-1 = U λ U^T. So the directions of tensions P = Q U are orthonormal,
λ is the mass of each mode, and the loop's damping and stiffness are diagonal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.cable import ASSUMED_DAMPING_s
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.tension_distribution import TensionSolver
from cdpr_rt.platform.body_kernel import body_of, write_mass_matrix, write_wrench

ComplexArray = NDArray[np.complex128]

CABLE_DAMPING_s, LITTLE_DAMPING_s = ASSUMED_DAMPING_s, 5e-4
"""b as assumed, and b of cables with little damping: 5 % of critical at 30 Hz."""
_TAUT_N = 1.0
"""Smallest tension at which a cable's sag is approximated by a flat parabola."""
_OF_LEAST = (0.0, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 0.875, 0.625, 0.0)
_OF_GREATEST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.125, 0.375, 1.0)
NONE, LEAST, BETWEEN, GREATEST, LEVELS = 0, 5, 7, 8, 9
"""Levels of tension for the geometric stiffness: zero, and from low tensions to the greatest that
may be planned at a pose, each about twice the previous one. A loop that is stable without tensions,
and keeps its margin on all these levels, is stable with tensions."""


class LinearPlant(NamedTuple):
    """The plant along the modes of the platform at one pose."""

    mass_kg: FloatArray
    """λ of each mode, (d,)."""
    pulls: FloatArray
    """P, (n, d): lengthening of each cable along each mode."""
    stiffness_N_m: FloatArray
    """k of each cable, with its sag if it has weight, (LEVELS, n)."""
    geometric_N_m: FloatArray
    """K_G, (LEVELS, d, d)."""
    response_m_N: ComplexArray
    """G, (LEVELS, stiffnesses, frequencies, d, d)."""


def planned_tensions(model: PlatformModel, pose: Pose) -> FloatArray:
    """Return the least and the greatest tensions (2, n), N, that carry the weight at a pose.

    They are within the planned bounds. If none of these carry the weight, they are the nearest
    ones.
    """
    low, high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
    W, planned = model.kinematics.wrench_matrix(pose), np.zeros((2, model.kinematics.n))
    weight = weight_at(model, pose)[0][list(model.kinematics.directions)]
    weight += model.kinematics.hanging_wrenches(pose.array[None])[0]
    for wanted, t in zip((low, high), planned, strict=True):
        scale = model.wrench_scale
        TensionSolver("minimum-deviation", low, high, scale, wanted).solve(W, weight, t)
    return planned


def geometric_stiffness(model: PlatformModel, pose: Pose, tension_N: FloatArray) -> FloatArray:
    """Return `whole_stiffness` of the controlled directions, K_G (d, d)."""
    directions = list(model.kinematics.directions)
    return whole_stiffness(model, pose, tension_N)[np.ix_(directions, directions)]


def whole_stiffness(model: PlatformModel, pose: Pose, tension_N: FloatArray) -> FloatArray:
    """Return ∂(J^T t - w)/∂x (6, 6) of a platform that stands under tensions t (n,).

    The result is in N/m, N/rad, Nm/m and Nm/rad, for all directions. It is the geometric stiffness
    of the cables, plus that of the weight m g at r from the origin, -[m g]× [r]× for rotations. It
    is symmetric if t carries the weight, otherwise made symmetric.
    """
    K = model.kinematics.geometric_stiffness(pose, tension_N)
    weight, r = weight_at(model, pose)
    K[3:, 3:] -= np.outer(r, weight[:3]) - (weight[:3] @ r) * np.eye(3)
    return np.asarray(0.5 * (K + K.T))


def swing_periods_s(
    model: PlatformModel, pose: Pose, jacobian: FloatArray, tension_N: FloatArray
) -> FloatArray:
    """Return the periods of the swings that leave all cable lengths unchanged, longest first.

    With J (n, 6), motions are x = B y with J B = 0: B^T M B y'' + B^T K B y = 0. Unstable motions
    are left out.
    """
    _, size, turned = np.linalg.svd(jacobian)
    B = turned[np.count_nonzero(size > 1e-6 * size.max()) :].T
    M, _ = _mass_matrix(model, pose)
    root = np.linalg.inv(np.linalg.cholesky(B.T @ M @ B))
    stiffness = B.T @ whole_stiffness(model, pose, tension_N) @ B
    squares = np.linalg.eigvalsh(root @ stiffness @ root.T)
    return np.asarray(2.0 * math.pi / np.sqrt(squares[squares > 0.0]))


def linear_plant(
    model: PlatformModel,
    q: FloatArray,
    rotors_kg: FloatArray,
    stiffness_N: FloatArray,
    s: ComplexArray,
    shares: Sequence[float],
) -> LinearPlant:
    """Return the plant at a set-point (d,) for frequencies s (f,) and shares of the stiffness.

    Raises GeometryError if the cables do not hold the platform.
    """
    pose, kinematics = model.pose(q), model.kinematics
    directions = list(kinematics.directions)
    M, _ = _mass_matrix(model, pose)
    J = kinematics.jacobian(pose)
    if np.linalg.matrix_rank(J) < J.shape[1]:
        raise GeometryError("the cables cannot hold one direction with any tensions")
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
    """Return the stiffness k (LEVELS, n) of cables with EA `stiffness_N` (n,) at all levels.

    It is EA/ρ. If cables have weight w per length, the stiffness of a flat parabola under tension t
    is in series: 12 t³/((w a)² ρ) with horizontal extent a (Ernst, 1965). For levels below the
    least tensions, which are never planned, it is that of the least tensions.
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
    """Return G (f, d, d) along the modes, with P (n, d) for J and diag(λ) for M_p."""
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


# The gains of a platform's loop in a cycle, its margins, and its delay. The drives' delay is
# assumed, the same for all robots: it is not read from their profiles.

OBSERVER_rad_s = 2.0 * math.pi * 400.0
DAMPING_RATIO = 0.55
DRIVE_LATENCY_s, _LATENCY_CYCLES = 0.8e-3, 1.5
"""Assumed delay of every drive, independent of its profile; number of cycles for transfer and for
holding."""


@dataclass(frozen=True)
class LoopGains:
    """Gains of the loop in a cycle; see `loop_kernel.SETTINGS`."""

    bandwidth_rad_s: float
    """Bandwidth of each mode of the platform; lower if the damping would be too large."""
    damping_N_s_m: float
    """Largest damping required of a cable in each mode."""
    smooth: float
    """Share of the low-passed velocity in the velocity that is damped."""
    smoother_rad_s: float
    """Double pole of the low-pass."""
    null_damping_N_s_m: float
    """Damping of cables that pull against each other."""
    integral_share: float
    """Largest rate of the integral part, as a share of 2 ζ ω of the slowest mode."""
    integral_1_s: float
    rotor_kg: float
    """Equivalent mass of a rotor on its cable."""
    follows_pose: bool = False
    """Whether tensions are planned for the platform's pose, not for the set-point."""


@dataclass(frozen=True)
class LoopMargins:
    """Margins of a loop at one of several poses, the worst over the stiffness."""

    modulus: float
    frequency_Hz: float
    """Frequency of the worst margin."""
    slowest_rad_s: float
    fastest_rad_s: float
    """Fastest of the platform's modes in closed loop, without delays."""

    @property
    def gain(self) -> float:
        """Gain margin, for an increase and for a decrease of the gain: at least 1/(1 - μ)."""
        return 1.0 / (1.0 - self.modulus)

    @property
    def phase_rad(self) -> float:
        """Phase margin: at least 2 asin(μ/2)."""
        return 2.0 * math.asin(0.5 * self.modulus)


def latency_s(period_s: float) -> float:
    """Return the delay of the loop: an assumed drive, transfer, and half a cycle of holding."""
    return DRIVE_LATENCY_s + _LATENCY_CYCLES * period_s
