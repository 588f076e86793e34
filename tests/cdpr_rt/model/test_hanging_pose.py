"""The pose of a platform that hangs on too few cables: lengths, equilibrium, and sensors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

import cdpr_rt as cdpr
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.offline import Model
from tests.cdpr_rt.platform.platform_physics import hung, planar, spatial

STANDARD_GRAVITY = 9.80665
ROBOTS = {
    "mass in the middle": hung(),
    "mass beside the middle": hung(centre_m=(0.03, -0.02, -0.06)),
    "one exit point elsewhere": hung(moved_m=(0.3, -0.2, 0.25)),
}
PLACES_m = ((0.0, 0.0, 0.9), (0.35, 0.2, 0.6), (-0.3, 0.35, 1.15))


def hanging(
    model: PlatformModel, place_m: tuple[float, ...], first_N: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return rotation (3, 3), lengths (4,) and tensions (4,) at rest, and quaternion w x y z.

    The first cable has a given tension, since four tensions and three angles are determined by six
    conditions only up to one number.
    """
    platform = model.platform
    a, b = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    weight = np.array([0.0, 0.0, -platform.mass_kg * STANDARD_GRAVITY])

    def cables(rotation: Rotation) -> tuple[FloatArray, FloatArray]:
        arms = rotation.apply(b)
        return arms, a - np.array(place_m) - arms

    def unbalanced(unknown: FloatArray) -> FloatArray:
        rotation, t = Rotation.from_rotvec(unknown[:3]), unknown[3:]
        arms, away = cables(rotation)
        pulls = t[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
        moment = np.cross(arms, pulls).sum(axis=0)
        moment += np.cross(rotation.apply(platform.centre_of_mass_m), weight)
        return np.concatenate([pulls.sum(axis=0) + weight, 10.0 * moment, [t[0] - first_N]])

    found = root(unbalanced, np.concatenate([np.zeros(3), np.full(4, 45.0)]), tol=1e-12)
    assert found.success and found.x[3:].min() > 0.0
    rotation = Rotation.from_rotvec(found.x[:3])
    lengths = np.linalg.norm(cables(rotation)[1], axis=1)
    return rotation.as_matrix(), lengths, found.x[3:], np.roll(rotation.as_quat(canonical=True), 1)


def model_of(name: str) -> tuple[PlatformModel, Model]:
    model = ROBOTS[name].model()
    return model, Model(model, ["1", "2", "3", "4"])


def error_of(pose: FloatArray, place_m: tuple[float, ...], q: FloatArray) -> tuple[float, float]:
    """Return the errors of a pose (7,) in mm and deg."""
    cosine = min(abs(float(pose[3:] @ q)), 1.0)
    off_mm = 1e3 * float(np.linalg.norm(pose[:3] - place_m))
    return off_mm, 2.0 * float(np.degrees(np.arccos(cosine)))


@pytest.mark.parametrize("name", ROBOTS)
def test_exact_lengths_and_tensions_give_the_pose_of_the_equilibrium(name: str) -> None:
    model, offline = model_of(name)
    for place in PLACES_m:
        for first_N in (40.0, 50.0):
            _, lengths, t, q = hanging(model, place, first_N)
            pose = offline.pose(lengths, tension_N=t)
            assert error_of(pose, place, q) == pytest.approx((0.0, 0.0), abs=1e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_lengths_alone_give_most_of_the_tilt_and_an_inclinometer_the_rest(name: str) -> None:
    model, offline = model_of(name)
    random = np.random.default_rng(5)
    for place in PLACES_m:
        rotation, lengths, _, q = hanging(model, place, 45.0)
        up = rotation.T @ [0.0, 0.0, 1.0]
        tilt = [np.arctan2(up[1], up[2]), -np.arcsin(up[0])]
        lengths += 5e-4 * random.standard_normal(4)
        off_mm, turned_deg = error_of(offline.pose(lengths), place, q)
        assert off_mm < 7.0 and turned_deg < 3.0
        read_mm, _ = error_of(offline.pose(lengths, tilt_rad=tilt), place, q)
        assert read_mm < 1.5
        still = model.kinematics.pose_from_lengths(lengths, model.home_pose)
        unturned_mm = 1e3 * float(np.linalg.norm(still.pose.p - place))
        if place != PLACES_m[0]:
            assert unturned_mm > 2.0 * off_mm


def test_position_is_that_of_the_pose_for_arrays_of_lengths() -> None:
    model, offline = model_of("mass beside the middle")
    lengths = np.array([[hanging(model, place, 45.0)[1] for place in PLACES_m]])
    poses = offline.pose(lengths)
    assert poses.shape == (1, 3, 7)
    assert offline.position(lengths) == pytest.approx(poses[..., :3])


def test_sensors_are_rejected_if_the_cables_control_the_rotation() -> None:
    for machine in (planar(), spatial()):
        model = machine.model()
        offline = Model(model, ["cable"] * machine.n)
        lengths = offline.lengths(offline.home)
        assert offline.pose(lengths)[:3] == pytest.approx(model.home_pose.p)
        with pytest.raises(cdpr.InvalidArgument, match="hangs freely"):
            offline.pose(lengths, tilt_rad=[0.0, 0.0])


def test_readings_of_a_wrong_shape_are_rejected() -> None:
    model, offline = model_of("mass in the middle")
    lengths = hanging(model, PLACES_m[0], 45.0)[1]
    with pytest.raises(cdpr.InvalidArgument, match=r"tension_N: shape \(3,\); .* of shape \(4,\)"):
        offline.pose(lengths, tension_N=[1.0, 2.0, 3.0])
    with pytest.raises(cdpr.InvalidArgument, match=r"tilt_rad: shape \(2,\); .* of shape \(1, 2\)"):
        offline.pose([lengths], tilt_rad=[0.0, 0.0])
