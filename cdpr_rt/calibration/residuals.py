"""Residual model of all observations, with derivatives: loop closure, measured poses, balance.

Cable i at pose j has the unstretched length l_ij by the encoder, the offset o_i, and the drum error
s_i about the initial length l_i0. Its stretch S_ij is the ratio of straight to unstretched length
under the tension t_ij at the winch. Loop closure (Tremblay, (3.16) to (3.18)) is

    f_ij = (l_ij + o_i + s_i (l_ij - l_i0)) S_ij - ρ(a_i, b_i, r_i, x_j)

in metres. (3.18) is the difference of the squares: 2 ρ f, to first order. With ρ's unit
vector u from exit to anchor, angle θ on the pulley and compliance c_i (1 + κ):

    ∂f/∂a = u    ∂f/∂o = S    ∂f/∂s = (l - l_0) S    ∂f/∂b = -Q^T u    ∂f/∂r = sin θ - θ
    ∂f/∂κ = l c t    ∂f/∂x = -(u, Q b × u)

The residuals of measured positions are p + Q c - p~, those of measured rotations log(Q Q~^T). If a
platform turns freely in its plane, Σ t_i (Q b_i × u_i) and the moment of its weight are in balance.
A platform in space that hangs on too few cables is in equilibrium, W t^ + w = 0. Its tensions t^
agree best with the equilibrium and with the given tensions t, in weighted least squares:

    t^ = argmin |W t^ + w|² / σ_w² + |t^ - t|² / σ_t²

The rows are the residuals of both. Their derivatives omit those of the projection onto A = (W/σ_w,
1/σ_t), as in the method of Kaufman for separable least squares. Each row is divided by its standard
deviation, and by the root of the number of successive readings that count as one.

Lengths hardly determine the rotation of some platforms. For these the rotation is assumed to be
near its target: poses without a measured rotation have rows log(Q Q_t^T) with the target's rotation
Q_t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera_geometry import cross_matrices
from cdpr_rt.calibration.parameters import ANCHORS, CABLE_ROWS, DRUM, EXIT, OFFSET, CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.model.cable_kernel import (
    ANCHOR,
    ARC,
    AXIS,
    FREE,
    RADIUS,
    WEIGHT,
    hang,
    run_poses,
    write_tension_rises,
    write_unstretched_lengths,
)
from cdpr_rt.model.cable_kernel import CABLE_ROWS as KERNEL_ROWS
from cdpr_rt.model.equilibrium_kernel import FORCE_SHARE, CENTRE_STD_m
from cdpr_rt.model.rigid_body import G_m_s2, in_space

_MISSED = 0.3


@dataclass(frozen=True)
class Linearised:
    """Residuals over their standard deviations and their derivatives, R rows for each of N poses.

    The first n rows are those of the cables' lengths.
    """

    residual: FloatArray
    """Residuals, (N, R)."""
    by_parameter: FloatArray
    """Derivatives by the P parameters, (N, R, P)."""
    by_pose: FloatArray
    """Derivatives by the pose of the row, (N, R, d)."""

    @property
    def points(self) -> slice:
        """Rows of measured positions; those of measured rotations follow."""
        return slice(self.residual.shape[1] - 6, self.residual.shape[1] - 3)


def linearise(
    geometry: CableGeometry, seen: Observations, poses: FloatArray, jumps_m: FloatArray
) -> Linearised:
    """Return residuals and derivatives at poses (N, 4, 3); `jumps_m` are those of `seen.jumps`.

    P counts the geometry's parameters and then the jumps.
    """
    at = _At.of(geometry, seen, poses)
    count, size = seen.poses, geometry.size + len(seen.jumps)
    rows = geometry.n + geometry.balance_rows + 6
    out = Linearised(*(np.zeros((count, rows, *more)) for more in ((), (size,), (len(at.free),))))
    _closure(at, jumps_m, out)
    if geometry.turns_freely:
        _balance(at, out)
    elif geometry.hangs_freely:
        _equilibrium(at, out)
    _measured_poses(at, out)
    return out


@dataclass(frozen=True)
class _At:
    """The place of a linearisation: a geometry, observations, poses, and their cables."""

    geometry: CableGeometry
    seen: Observations
    poses: FloatArray
    kernel: FloatArray
    """The geometry for `cable_kernel`."""
    cables: FloatArray
    """Cables at the poses as by `run_poses`, (N, rows, n)."""
    free: list[int]
    """Components of the twist in which poses are estimated."""

    @classmethod
    def of(cls, geometry: CableGeometry, seen: Observations, poses: FloatArray) -> _At:
        kernel = geometry.kernel_geometry()
        cables = np.empty((len(poses), KERNEL_ROWS, geometry.n))
        run_poses(kernel, poses, cables)
        return cls(geometry, seen, poses, kernel, cables, [i for i in geometry.free if i < 6])


def length_std_m(geometry: CableGeometry, seen: Observations) -> FloatArray:
    """Return the standard deviation of each length, including the effect of tension, (N, n).

    It is multiplied by the root of the number of readings that count as one.
    """
    known = geometry.knowledge
    uncertain = known.yielding * seen.length_m * geometry.compliance_1_N * known.tension_N
    if seen.tension_free is not None:
        uncertain *= np.sqrt(np.diagonal(seen.tension_free, axis1=1, axis2=2))
    return np.asarray(math.sqrt(known.alike) * np.hypot(known.length_m, uncertain))


def encoder_lengths(
    geometry: CableGeometry, poses: FloatArray, tension_N: FloatArray
) -> FloatArray:
    """Return the encoder lengths (N, n) at poses (N, 4, 3), without drum errors."""
    cables = np.empty((len(poses), KERNEL_ROWS, geometry.n))
    run_poses(geometry.kernel_geometry(), poses, cables)
    straight = cables[:, FREE] + cables[:, ARC]
    return np.asarray(straight / _stretch(geometry, tension_N, cables) - geometry.cable[:, OFFSET])


def _stretch(geometry: CableGeometry, tension_N: FloatArray, cables: FloatArray) -> FloatArray:
    """Return the ratio of straight to unstretched length, (N, n).

    Tensions apply at the winches. At the platform, the tension is lower by the weight per length
    times the height of the exit point above the anchor point.
    """
    soft = geometry.compliance()
    if not geometry.weight_N_m.any():
        return np.asarray(1.0 + soft * tension_N)
    up = np.eye(3)[geometry.coordinates - 1]
    straight = cables[:, FREE] + cables[:, ARC]
    lengths = np.empty_like(straight)
    most_weight, most_soft = float(geometry.weight_N_m.max()), float(soft.mean())
    at_platform = tension_N + most_weight * cables[:, FREE] * (up @ cables[:, :3])
    for j in range(len(cables)):
        write_unstretched_lengths(
            cables[j, :3], cables[j, FREE], cables[j, ARC], up, at_platform[j],
            most_soft, most_weight, lengths[j],
        )  # fmt: skip
    return np.where(lengths > 0.0, straight / lengths, 1.0 + soft * tension_N)


def _closure(at: _At, jumps_m: FloatArray, out: Linearised) -> None:
    """Write the rows of the lengths."""
    geometry, seen, poses, cables = at.geometry, at.seen, at.poses, at.cables
    n, rows = geometry.n, list(geometry.rows)
    extra = np.zeros_like(seen.length_m)
    for (cable, pose), jump in zip(seen.jumps, jumps_m, strict=True):
        extra[pose:, cable] += jump
    paid_out = seen.length_m - seen.reference_m
    length = seen.length_m + geometry.cable[:, OFFSET] + geometry.cable[:, DRUM] * paid_out + extra
    stretch = _stretch(geometry, seen.tension_N, cables)
    u = np.swapaxes(cables[:, :3], 1, 2)
    weight = seen.used / length_std_m(geometry, seen)
    out.residual[:, :n] = weight * (length * stretch - cables[:, FREE] - cables[:, ARC])
    each = np.empty((*length.shape, CABLE_ROWS))
    each[..., EXIT] = u
    each[..., OFFSET] = stretch
    each[..., DRUM] = paid_out * stretch
    each[..., ANCHORS] = -np.einsum("jka,jik->jia", poses[:, 1:], u)
    theta = np.arccos(np.clip(np.einsum("jik,ki->ji", u, at.kernel[AXIS:WEIGHT]), -1.0, 1.0))
    each[..., CABLE_ROWS - 1] = np.sin(theta) - theta
    each *= weight[..., None]
    q = len(rows)
    for i in range(n):
        out.by_parameter[:, i, i * q : (i + 1) * q] = each[:, i, rows]
    if geometry.shared:
        by_elongation = length * geometry.compliance_1_N * seen.tension_N
        out.by_parameter[:, :n, geometry.size - 1] = weight * by_elongation
    for k, (cable, pose) in enumerate(seen.jumps):
        out.by_parameter[pose:, cable, geometry.size + k] = (weight * stretch)[pose:, cable]
    out.by_pose[:, :n] = -weight[..., None] * np.swapaxes(cables[:, at.free], 1, 2)


def _balance(at: _At, out: Linearised) -> None:
    """Write the row of the moment about z of a platform that turns freely in its plane."""
    geometry, seen, poses, cables = at.geometry, at.seen, at.poses, at.cables
    n, q = geometry.n, len(geometry.rows)
    Q = poses[:, 1:3, :2]
    arm = np.einsum("jab,bi->jia", Q, at.kernel[ANCHOR : ANCHOR + 2])
    u = np.swapaxes(cables[:, :2], 1, 2)
    t, rho = seen.tension_N, cables[:, FREE]
    across = arm[..., 0] * u[..., 1] - arm[..., 1] * u[..., 0]
    # derivative by the anchor's position with a constant arm: t r × (1 - u u^T) / ρ
    turned = np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
    square = turned - (turned * u).sum(axis=-1, keepdims=True) * u
    by_place = (t / rho)[..., None] * square
    platform = geometry.model.platform
    centre = Q @ in_space(platform.centre_of_mass_m)[:2]
    weight_N = platform.mass_kg * G_m_s2
    moment = (t * across).sum(axis=1) + weight_N * centre[:, 0]
    by_angle = (by_place * turned).sum(axis=(1, 2)) - (t * (arm * u).sum(axis=-1)).sum(axis=1)
    by_angle -= weight_N * centre[:, 1]
    # standard deviation of the moment: that of a tension, times a share of the arms
    arms = geometry.model.kinematics.geometry[ANCHOR : ANCHOR + 2]
    known = geometry.knowledge
    held = math.sqrt(known.alike) * known.tension_N * _MISSED * float(np.linalg.norm(arms))
    weight = np.asarray(seen.used.all(axis=1) / held)
    out.residual[:, n] = weight * moment
    by_pose = {0: by_place[..., 0].sum(axis=1), 1: by_place[..., 1].sum(axis=1), 5: by_angle}
    for k, direction in enumerate(at.free):
        out.by_pose[:, n, k] = weight * by_pose[direction]
    direct = t[..., None] * np.stack([u[..., 1], -u[..., 0]], axis=-1)
    by_anchor = np.einsum("jab,jia->jib", Q, by_place + direct)
    for place, row in enumerate(geometry.rows):
        columns = slice(place, n * q, q)
        if row < 2:
            out.by_parameter[:, n, columns] = -weight[:, None] * by_place[..., row]
        elif row - ANCHORS.start in (0, 1):
            by_this = by_anchor[..., row - ANCHORS.start]
            out.by_parameter[:, n, columns] = weight[:, None] * by_this


def _equilibrium(at: _At, out: Linearised) -> None:
    """Write the rows of a platform that hangs freely: forces, moments, tensions."""
    geometry, seen, poses, cables = at.geometry, at.seen, at.poses, at.cables
    n, q, platform = geometry.n, len(geometry.rows), geometry.model.platform
    weight_N = platform.mass_kg * G_m_s2
    known, Q = geometry.knowledge, poses[:, 1:]
    root = math.sqrt(known.alike)
    held = root * weight_N * np.repeat([FORCE_SHARE, CENTRE_STD_m], 3)
    told_N = geometry.model.reserve_N if seen.tension_assumed else known.tension_N
    rise = np.zeros(seen.tension_N.shape)
    load = np.zeros((len(poses), 6))
    pull, centre = np.array([0.0, 0.0, -weight_N]), Q @ in_space(platform.centre_of_mass_m)
    load[:, :3], load[:, 3:] = pull, np.cross(centre, pull)
    for j in range(len(poses)):
        hang(at.kernel, poses[j], cables[j], load[j])
        write_tension_rises(at.kernel, cables[j], rise[j])
    A = np.concatenate([-cables[:, :6] / held[:, None], np.tile(np.eye(n), (len(poses), 1, 1))], 1)
    A[:, 6:] /= root * told_N
    right = np.concatenate([load / held, (rise - seen.tension_N) / (root * told_N)], axis=1)
    basis = np.linalg.qr(A)[0]
    across = np.eye(6 + n) - basis @ np.swapaxes(basis, 1, 2)
    t = -np.linalg.solve(np.swapaxes(A, 1, 2) @ A, np.swapaxes(A, 1, 2) @ right[..., None])[..., 0]
    rows = slice(n, 2 * n + 6)
    weight = np.asarray(seen.used.all(axis=1), float)
    out.residual[:, rows] = weight[:, None] * (across @ right[..., None])[..., 0]
    # derivative of the wrench by the motion v of an anchor point with constant arm, (N, n, 6, 3)
    u, arm = np.swapaxes(cables[:, :3], 1, 2), np.einsum("jab,bi->jia", Q, at.kernel[ANCHOR:RADIUS])
    bent = (np.eye(3) - u[..., :, None] * u[..., None, :]) * (t / cables[:, FREE])[..., None, None]
    moved = -np.concatenate([bent, cross_matrices(arm) @ bent], axis=2)
    # and by the change d of the arm: -t d × u
    turned = np.zeros_like(moved)
    turned[..., 3:, :] = t[..., None, None] * cross_matrices(u)
    by_twist = np.zeros((len(poses), 6, 6))
    by_twist[..., :3] = moved.sum(axis=1)
    by_twist[..., 3:] = -((moved + turned) @ cross_matrices(arm)).sum(axis=1)
    by_twist[:, 3:, 3:] += cross_matrices(np.broadcast_to(pull, centre.shape)) @ cross_matrices(
        centre
    )
    part = weight[:, None, None] * across[..., :6] / held
    out.by_pose[:, rows] = part @ by_twist
    by_anchor = (moved + turned) @ Q[:, None]
    for place, row in enumerate(geometry.rows):
        columns = slice(place, n * q, q)
        if row in range(*EXIT.indices(CABLE_ROWS)):
            out.by_parameter[:, rows, columns] = -part @ np.swapaxes(moved[..., row], 1, 2)
        elif row in range(*ANCHORS.indices(CABLE_ROWS)):
            own = by_anchor[..., row - ANCHORS.start]
            out.by_parameter[:, rows, columns] = part @ np.swapaxes(own, 1, 2)


def _measured_poses(at: _At, out: Linearised) -> None:
    """Write the last six rows, for externally measured positions and rotations."""
    geometry, seen, poses = at.geometry, at.seen, at.poses
    arm = poses[:, 1:] @ seen.target_m
    first = out.points.start
    known = geometry.knowledge
    root = math.sqrt(known.alike)
    weight = 1.0 / (root * seen.position_std_m)
    out.residual[:, out.points] = weight * (poses[:, 0] + arm - seen.position_m)
    by_twist = np.zeros((len(poses), 6, 6))
    by_twist[:, :3, :3] = np.eye(3)
    by_twist[:, :3, 3:] = -cross_matrices(arm)
    by_twist[:, :3] *= weight[..., None]
    measured = np.asarray(np.isfinite(seen.rotation_std_rad).any(axis=1))[:, None]
    if measured.any() or math.isfinite(known.aim_rad):
        near = np.where(measured[..., None], seen.rotation, seen.target_rotation)
        std_rad = np.where(measured, root * seen.rotation_std_rad, known.aim_rad)
        phi = Rotation.from_matrix(poses[:, 1:] @ np.swapaxes(near, 1, 2)).as_rotvec()
        weight = 1.0 / std_rad
        out.residual[:, first + 3 :] = weight * phi
        skew = cross_matrices(phi)
        # inverse of the left Jacobian of SO(3), to second order
        by_twist[:, 3:, 3:] = weight[..., None] * (np.eye(3) - 0.5 * skew + skew @ skew / 12.0)
    out.by_pose[:, first:] = by_twist[:, :, at.free]
