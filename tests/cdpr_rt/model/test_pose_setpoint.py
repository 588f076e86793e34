"""A platform's set-points: poses, derivatives and motor references, compared with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model import pose_tracking as tracking
from cdpr_rt.model.cable_kernel import CABLE_ROWS
from cdpr_rt.model.pose import Pose
from tests.cdpr_rt.platform.platform_physics import planar, spatial

PERIOD_S = 1e-3
quick = settings(max_examples=60)
seeds = st.integers(0, 2**32 - 1)
CHOSEN = ((0, 1), (0, 1, 5), (0, 1, 2), (0, 1, 2, 3, 4, 5), (0, 2, 4))


def vector(rng: np.random.Generator, most: float) -> FloatArray:
    way = rng.normal(size=3)
    return np.asarray(way / np.linalg.norm(way) * rng.uniform(0.0, most))


def drawn(
    seed: int, directions: tuple[int, ...], most: float = 3.0
) -> tuple[np.random.Generator, Pose, FloatArray]:
    """Return a home, and a set-point (d,) whose rotation is below half a turn."""
    rng = np.random.default_rng(seed)
    home = Pose(rng.normal(size=3), Rotation.from_rotvec(vector(rng, 3.0)).as_matrix())
    whole = np.concatenate([rng.normal(size=3), vector(rng, most)])
    return rng, home, whole[list(directions)]


def placed(q: FloatArray, directions: tuple[int, ...], home: Pose) -> Pose:
    pose = Pose(np.zeros(3))
    tracking.pose_of_coordinates(q, np.array(directions), home.array, np.zeros((4, 3)), pose.array)
    return pose


@quick
@given(seeds, st.sampled_from(CHOSEN))
def test_a_pose_is_home_turned_by_the_rotation_vector(seed: int, chosen: tuple[int, ...]) -> None:
    _, home, q = drawn(seed, chosen)
    whole = np.concatenate([home.p, np.zeros(3)])
    whole[list(chosen)] = q
    pose = placed(q, chosen, home)
    assert pose.p == pytest.approx(whole[:3], abs=1e-14)
    wanted = Rotation.from_rotvec(whole[3:]).as_matrix() @ home.Q
    assert pytest.approx(wanted, abs=1e-13) == pose.Q


@quick
@given(seeds, st.sampled_from(CHOSEN))
def test_coordinates_are_recovered_from_the_pose(seed: int, chosen: tuple[int, ...]) -> None:
    _, home, q = drawn(seed, chosen)
    found = np.zeros(len(chosen))
    pose = placed(q, chosen, home).array
    tracking.coordinates_of_pose(pose, np.array(chosen), home.array, np.zeros((4, 3)), found)
    assert found == pytest.approx(q, abs=1e-9)


@quick
@given(seeds, st.sampled_from(CHOSEN))
def test_twist_and_acceleration_are_the_poses_derivatives(
    seed: int, chosen: tuple[int, ...]
) -> None:
    rng, home, q = drawn(seed, chosen, 2.0)
    rate, slope = rng.normal(size=(2, len(chosen)))
    shaped = np.array([q, rate, slope])
    twist, acceleration = np.zeros(6), np.zeros(6)

    def moved(t: float) -> Pose:
        return placed(q + t * rate + 0.5 * t * t * slope, chosen, home)

    def twist_at(t: float, by: float = 1e-5) -> FloatArray:
        return moved(t + by).minus(moved(t - by)) / (2.0 * by)

    tracking.move_with(shaped, np.array(chosen), 1e-6, np.zeros((4, 3)), twist, acceleration)
    assert twist == pytest.approx(twist_at(0.0), abs=1e-6)
    by = 1e-3
    assert acceleration == pytest.approx(
        (twist_at(by) - twist_at(-by)) / (2.0 * by), abs=1e-3 * (1.0 + np.abs(rate).max() ** 3)
    )


@quick
@given(seeds)
def test_pose_difference_equals_scipys_rotation_vector(seed: int) -> None:
    rng, one, _ = drawn(seed, CHOSEN[0])
    turn = vector(rng, 3.0)
    other = Pose(rng.normal(size=3), Rotation.from_rotvec(turn).as_matrix() @ one.Q)
    x = np.zeros(6)
    tracking.subtract(other.array, one.array, np.zeros((4, 3)), x)
    assert x[:3] == pytest.approx(other.p - one.p, abs=1e-14)
    assert x[3:] == pytest.approx(turn, abs=1e-8)


@quick
@given(seeds)
def test_the_quaternion_equals_scipys(seed: int) -> None:
    _, pose, _ = drawn(seed, CHOSEN[0])
    out = np.zeros(7)
    tracking.write_quaternion(pose.array, out)
    x, y, z, w = Rotation.from_matrix(pose.Q).as_quat()
    wanted = np.array([w, x, y, z]) * (1.0 if w >= 0.0 else -1.0)
    assert out[:3] == pytest.approx(pose.p)
    assert out[3:] == pytest.approx(wanted, abs=1e-8)


@pytest.mark.parametrize("make", [planar, spatial])
def test_motor_references_follow_from_the_kinematics(make: object) -> None:
    machine = make()  # type: ignore[operator]
    model, n = machine.model(), machine.n
    kinematics, d = model.kinematics, model.size
    chosen = np.array(kinematics.directions)
    rng = np.random.default_rng(3)
    motors = np.zeros((tracking.MOTOR_ROWS, n))
    motors[tracking.M_PER_RAD] = rng.uniform(-0.05, 0.05, n)
    motors[tracking.STRETCH] = rng.uniform(1.0, 1.01, n)
    motors[tracking.AT_ZERO] = rng.uniform(1.0, 3.0, n)
    low, high = (
        np.array(machine.platform.workspace_min_m),
        np.array(machine.platform.workspace_max_m),
    )
    for _ in range(20):
        q = np.concatenate([rng.uniform(low, high), 0.1 * rng.normal(size=d - len(low))])
        shaped = np.array([q, rng.normal(size=d), rng.normal(size=d)])
        here = model.pose(q).plus(np.concatenate([0.01 * rng.normal(size=3), np.zeros(3)]))
        wanted, moves = Pose(np.zeros(3)), np.zeros((3, 6))
        asked = np.zeros((3, n))
        tracking.motor_references(
            shaped, chosen, model.home_pose.array, PERIOD_S, kinematics.geometry, motors,
            here.array, np.zeros((4, 3)), wanted.array, np.zeros((CABLE_ROWS, n)),
            moves[0], moves[1], moves[2], asked[0], asked[1], asked[2],
        )  # fmt: skip
        target = model.pose(q)
        assert wanted.array == pytest.approx(target.array, abs=1e-12)
        lengths = motors[tracking.AT_ZERO] + motors[tracking.M_PER_RAD] * asked[0]
        assert lengths * motors[tracking.STRETCH] == pytest.approx(kinematics.lengths(target))
        J = kinematics.jacobian(target)
        assert motors[tracking.M_PER_RAD] * asked[1] == pytest.approx(J @ moves[0][chosen])
        assert motors[tracking.M_PER_RAD] * asked[2] == pytest.approx(J @ moves[1][chosen])
        assert moves[2] == pytest.approx(target.minus(here), abs=1e-9)
