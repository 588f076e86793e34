"""Synthetic robots whose true geometry differs from their files, and their observations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.parameters import USUAL, CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.model.cable_kernel import ARC, CABLE_ROWS, FREE, run_poses, write_unstretched_lengths
from cdpr_rt.model.kinematics import CableKinematics
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.rigid_body import G_m_s2


@dataclass(frozen=True)
class MadeUp:
    """The geometry of the file, the true one, and the true poses."""

    file: CableGeometry
    true: CableGeometry
    poses: list[Pose]
    seen: Observations


def made_up(
    robot: str,
    poses: int,
    seed: int,
    *,
    exit_m: float = 0.008,
    drum: float = 0.003,
    elongation: float = -0.3,
    noise_m: float = 0.0,
    offset_m: float = 0.01,
    identified: tuple[str, ...] = USUAL,
    first: float = 1.0,
    home_first: bool = False,
    in_balance: bool = False,
) -> MadeUp:
    """Return a robot with normally distributed errors and noisy lengths.

    Tensions are random. With `in_balance`, they are the nearest ones that hold the platform.
    """
    profile = load_robot(robot)
    rng = np.random.default_rng(seed)
    file = CableGeometry.of(profile, identified)
    n, k = file.n, file.coordinates
    cable = np.zeros((n, 9))
    cable[:, :k] = rng.normal(0.0, exit_m, (n, k))
    cable[:, 4] = rng.normal(0.0, drum, n)
    cable[:, 3] = rng.normal(0.0, offset_m, n)
    true = replace(file, cable=cable, elongation=elongation)
    model = file.model
    places = _places(model, poses, first, rng)
    if home_first:
        places[0] = model.home
    tension = rng.uniform(model.low_N, model.high_N, (poses, n))
    exits, anchors = true.kernel_geometry()[:3].T, true.kernel_geometry()[3:6].T
    soft = float(true.compliance()[0])
    geometry = CableKinematics(exits, anchors).geometry
    lengths, told = np.zeros((2, poses, n))
    held, up = [], file.coordinates - 1
    for j, array in enumerate(model.poses(places)):
        pose = Pose(array[0], array[1:])
        if file.turns_freely:
            pose = _balanced(pose, exits, anchors, tension[j])
        if file.hangs_freely:
            planned, _ = model.planned_tensions(array[None], model.weight()[None])
            pose, tension[j] = _hung(true, pose, planned[0] + rng.normal(0.0, 0.5, n))
        if in_balance:
            tension[j] = _holding(true, pose, tension[j])
        held.append(pose)
        cables = np.empty((1, CABLE_ROWS, n))
        run_poses(geometry, pose.array[None], cables)
        write_unstretched_lengths(
            cables[0, :3], cables[0, FREE], cables[0, ARC], np.eye(3)[up], tension[j], soft,
            float(file.weight_N_m[0]), lengths[j],
        )  # fmt: skip
        # tension at the winch exceeds that at the platform by the weight of the cable between
        height = (exits - pose.p - anchors @ pose.Q.T)[:, up]
        told[j] = tension[j] + file.weight_N_m * height
    # readings of the encoders: without offset and drum error
    reference = lengths[0] - cable[:, 3]
    reading = (lengths - cable[:, 3] + cable[:, 4] * reference) / (1.0 + cable[:, 4])
    reading += rng.normal(0.0, 1.0, reading.shape) * noise_m
    start = model.poses(places)
    seen = Observations.of_lengths(reading, told, start)
    return MadeUp(file, true, held, replace(seen, reference_m=reference))


def _places(model: PlatformModel, poses: int, first: float, rng: np.random.Generator) -> FloatArray:
    low, high = model.platform.workspace_min_m, model.platform.workspace_max_m
    k = len(low)
    places = np.zeros((poses, model.size))
    places[:, :k] = rng.uniform(low, high, (poses, k))
    turns = model.size - k
    places[:, k:] = rng.uniform(-1, 1, (poses, turns)) * model.angle_rad * first / np.sqrt(3)
    return places


def _holding(true: CableGeometry, pose: Pose, wanted_N: FloatArray) -> FloatArray:
    cables = np.empty((1, CABLE_ROWS, true.n))
    run_poses(true.kernel_geometry(), pose.array[None], cables)
    wrench = -cables[0, :6]
    load = np.zeros(6)
    load[2] = -true.model.platform.mass_kg * G_m_s2
    return np.asarray(wanted_N - np.linalg.pinv(wrench) @ (wrench @ wanted_N + load))


def _hung(true: CableGeometry, pose: Pose, t: FloatArray) -> tuple[Pose, FloatArray]:
    """Return the pose at this position, and the tensions, at rest; the last tension is given."""
    exits, anchors = true.kernel_geometry()[:3].T, true.kernel_geometry()[3:6].T
    platform = true.model.platform
    weight = np.array([0.0, 0.0, -platform.mass_kg * G_m_s2])

    def unbalanced(unknown: FloatArray) -> FloatArray:
        turn, pulls = Rotation.from_rotvec(unknown[:3]), unknown[3:]
        arms = turn.apply(anchors)
        away = exits - pose.p - arms
        pull = pulls[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
        moment = np.cross(arms, pull).sum(axis=0)
        moment += np.cross(turn.apply(platform.centre_of_mass_m), weight)
        return np.concatenate([pull.sum(axis=0) + weight, 10.0 * moment, [pulls[-1] - t[-1]]])

    found = root(unbalanced, np.append(np.zeros(3), t), tol=1e-12)
    assert found.success
    return Pose(pose.p, Rotation.from_rotvec(found.x[:3]).as_matrix()), found.x[3:]


def _balanced(pose: Pose, exits: FloatArray, anchors: FloatArray, t: FloatArray) -> Pose:
    def moment(angle: float) -> float:
        c, s = np.cos(angle), np.sin(angle)
        arm = anchors[:, :2] @ np.array([[c, s], [-s, c]])
        u = pose.p[:2] + arm - exits[:, :2]
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        return float((t * (arm[:, 0] * u[:, 1] - arm[:, 1] * u[:, 0])).sum())

    angle = brentq(moment, -0.5, 0.5, xtol=1e-14)
    return Pose(pose.p).plus(np.array([0, 0, 0, 0, 0, angle]))


def measured(what: MadeUp, std_m: float, std_rad: float | None, seed: int) -> Observations:
    """Return the observations with noisy positions, and rotations unless `std_rad` is None."""
    rng = np.random.default_rng(seed)
    k = what.file.coordinates
    p = np.array([pose.p for pose in what.poses]) + rng.normal(0, std_m, (len(what.poses), 3))
    p[:, k:] = np.nan
    seen = what.seen.with_positions(p, std_m)
    if std_rad is None:
        return seen
    Q = np.array(
        [pose.plus(np.append(np.zeros(3), rng.normal(0, std_rad, 3))).Q for pose in what.poses]
    )
    return seen.with_rotations(Q, std_rad)
