"""One cycle of a robot and its platform's loop, linearised at a pose in the time domain."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, null_space
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose
from cdpr_rt.platform.loop_design import LoopModel
from cdpr_rt.platform.loop_plant import DAMPING_RATIO, LoopGains, OBSERVER_rad_s, planned_tensions
from tests.cdpr_rt.platform.platform_physics import PERIOD_S, Machine

_LATE_S = 0.8e-3


def loop_model(machine: Machine, period_s: float = PERIOD_S) -> LoopModel:
    return LoopModel(*robot_of(machine), period_s)


def robot_of(machine: Machine) -> tuple[PlatformModel, FloatArray, FloatArray]:
    return machine.model(), rotors(machine), rigidity(machine)


def rotors(machine: Machine) -> FloatArray:
    motors = [axis.winch for axis in machine.axes]
    return np.array([w.motor.rotor_inertia_kg_m2 / w.cable_m_per_motor_rad**2 for w in motors])


def rigidity(machine: Machine) -> FloatArray:
    return np.array([axis.winch.cable.stiffness_N for axis in machine.axes])


def mass_matrix(machine: Machine, q: FloatArray) -> FloatArray:
    """Return M_p (d, d) of points on the platform that have its mass, centre and inertia."""
    model, platform = machine.model(), machine.platform
    pose, directions = model.pose(q), list(model.kinematics.directions)
    M = np.zeros((6, 6))
    for m, at in points_of(machine):
        r = pose.Q @ at
        X = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
        moved = np.hstack([np.eye(3), -X])
        M += m * moved.T @ moved
    assert M[0, 0] == pytest.approx(platform.mass_kg)
    return M[np.ix_(directions, directions)]


def points_of(machine: Machine) -> list[tuple[float, FloatArray]]:
    """Return six points, a mass and a place each, in the platform's frame."""
    platform = machine.platform
    m, centre = platform.mass_kg, np.zeros(3)
    centre[: len(platform.centre_of_mass_m)] = platform.centre_of_mass_m
    if platform.inertia_kg_m2 is None:  # a ball's, half the spread of the anchor points
        anchors = np.array(platform.anchor_points_m)
        spread = ((anchors - anchors.mean(axis=0)) ** 2).sum(axis=1).mean()
        inertia = m * max(0.01**2, 0.25 * spread) * np.eye(3)
    elif len(platform.inertia_kg_m2) == 1:
        inertia = platform.inertia_kg_m2[0] * np.eye(3)
    else:
        xx, yy, zz, xy, xz, yz = platform.inertia_kg_m2
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    squares, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    ways = (axes * np.sqrt(3.0 * squares / m)).T
    return [(m / 6.0, centre + way) for way in (*ways, *-ways)]


def turned_wrench(machine: Machine, q: FloatArray, tension_N: FloatArray) -> FloatArray:
    """Return ∂(J^T t - w)/∂q (d, d) by differences; w is the weight of points on the platform."""
    model, pose = machine.model(), machine.model().pose(q)

    def left_over(step: FloatArray) -> FloatArray:
        turn = Rotation.from_rotvec(step[3:]).as_matrix()
        there, weight = Pose(pose.p + step[:3], turn @ pose.Q), np.zeros(6)
        for m, at in points_of(machine):
            force = -9.80665 * m * np.eye(3)[model.positions - 1]
            weight += np.concatenate([force, np.cross(there.Q @ at, force)])
        wrench = model.kinematics.jacobian(there).T @ tension_N
        return np.asarray(wrench - weight[list(model.kinematics.directions)])

    steps = 1e-5 * np.eye(6)[list(model.kinematics.directions)]
    K = np.array([(left_over(step) - left_over(-step)) / 2e-5 for step in steps]).T
    return np.asarray(0.5 * (K + K.T))


def radius(
    machine: Machine, gains: LoopGains, q: FloatArray, share: float, period_s: float
) -> float:
    """Return the largest eigenvalue's magnitude of one cycle of robot and loop at any tensions."""
    tensions_N = planned_tensions(machine.model(), machine.model().pose(q))
    return max(radius_at(machine, gains, q, share, period_s, t) for t in tensions_N)


def radius_at(
    machine: Machine,
    gains: LoopGains,
    q: FloatArray,
    share: float,
    period_s: float,
    tension_N: FloatArray,
    cable_damping_s: float = 2e-3,
) -> float:
    """Return the largest eigenvalue's magnitude of one cycle of robot and loop.

    Cables and masses are discretised exactly. Torques are held for a cycle and act 0.8 ms and a
    cycle after the angles they come from. Observer, smoother, integral part, and tensions and
    stretch that follow the pose are as in the kernels, in separate code.
    """
    model = machine.model()
    pose = model.pose(q)
    J = model.kinematics.jacobian(pose)
    n, d = J.shape
    nominal = rigidity(machine) / model.kinematics.lengths(pose)
    mass = np.zeros((d + n, d + n))
    M_p = mass_matrix(machine, q)
    mass[:d, :d], mass[d:, d:] = M_p, np.diag(rotors(machine))
    stretch = np.hstack([J, -np.eye(n)])
    elastic = stretch.T * (share * nominal) @ stretch
    K_G, geometric = turned_wrench(machine, q, tension_N), np.zeros_like(mass)
    geometric[:d, :d] = K_G
    pull = np.linalg.solve(mass, np.vstack([np.zeros((d, n)), -np.eye(n)]))
    size = 2 * (d + n)
    F = np.zeros((size + n, size + n))
    F[: d + n, d + n : size] = np.eye(d + n)
    F[d + n : size, : d + n] = -np.linalg.solve(mass, elastic + geometric)
    F[d + n : size, d + n : size] = -cable_damping_s * np.linalg.solve(mass, elastic)
    F[d + n : size, size:] = pull
    early, rest = expm(F * _LATE_S), expm(F * (period_s - _LATE_S))
    M = M_p + gains.rotor_kg * J.T @ J
    inertial = 2.0 * DAMPING_RATIO * gains.bandwidth_rad_s * M
    limited = gains.damping_N_s_m * J.T @ J
    D = np.linalg.inv(np.linalg.inv(inertial) + np.linalg.inv(limited))
    K = D @ np.linalg.solve(M, D) / (4.0 * DAMPING_RATIO**2)
    back, N = np.linalg.pinv(J), null_space(J.T)
    following = -back.T @ K_G if gains.follows_pose else np.zeros((n, d))
    z = np.exp(-OBSERVER_rad_s * period_s)
    w = 1.0 - np.exp(-gains.smoother_rad_s * period_s)

    def cycle(state: FloatArray) -> FloatArray:
        plant, theta, omega, lagging, calm, integral, last, before, taken, stretched = np.split(
            state, np.cumsum([size, n, n, n, n, d, n, n, n])
        )
        predicted = theta + period_s * omega
        error = plant[d : d + n] - predicted
        theta, omega = predicted + (1.0 - z**2) * error, omega + (1.0 - z) ** 2 / period_s * error
        lagging = lagging + w * (omega - lagging)
        calm = calm + w * (lagging - calm)
        speed = omega + gains.smooth * (calm - omega)
        place = back @ (theta + stretched / nominal)
        proportional = K @ place
        integral = integral + gains.integral_1_s * period_s * proportional
        planned = following @ place
        tension = planned + back.T @ (proportional + D @ back @ speed + integral)
        tension = tension + gains.null_damping_N_s_m * N @ (N.T @ omega)
        plant = (early @ np.concatenate([plant, before]))[:size]
        plant = (rest @ np.concatenate([plant, last]))[:size]
        now = taken + 0.2 * (planned - taken)
        return np.concatenate(
            [plant, theta, omega, lagging, calm, integral, tension, last, now, taken]
        )

    whole = np.eye(size + 4 * n + d + 4 * n)
    return float(np.abs(np.linalg.eigvals(np.array([cycle(row) for row in whole]).T)).max())
