"""The platform as a rigid body, beside points of mass and their Newton's law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics.pose import Pose
from cdpr_rt.robots.platform import body_kernel

quick = settings(max_examples=60)


def points(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return masses (k,), places in the platform's frame (k, 3), and the body's row."""
    m, at = rng.uniform(0.1, 3.0, 7), rng.normal(size=(7, 3))
    body = np.zeros(body_kernel.BODY)
    centre = m @ at / m.sum()
    inertia = np.zeros((3, 3))
    for mass, r in zip(m, at - centre, strict=True):
        inertia += mass * (r @ r * np.eye(3) - np.outer(r, r))
    body[body_kernel.MASS] = m.sum()
    body[body_kernel.CENTRE : body_kernel.CENTRE + 3] = centre
    body[body_kernel.INERTIA : body_kernel.INERTIA + 9] = inertia.ravel()
    body[body_kernel.GRAVITY :] = rng.normal(size=3) * 10.0
    return m, at, body


@quick
@given(st.integers(0, 2**32 - 1))
def test_mass_matrix_and_wrench_are_those_of_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, at, body = points(rng)
    pose = Pose(rng.normal(size=3), Rotation.from_rotvec(rng.normal(size=3)).as_matrix())
    M, scratch = np.zeros((6, 6)), np.zeros((4, 3))
    body_kernel.write_mass_matrix(body, pose.array, scratch, M)
    r = at @ pose.Q.T
    twist, acceleration = rng.normal(size=(2, 6))
    omega = twist[3:]
    velocity = twist[:3] + np.cross(omega, r)
    assert 0.5 * twist @ M @ twist == pytest.approx(0.5 * m @ (velocity**2).sum(axis=1))
    np.testing.assert_allclose(M, M.T, atol=1e-12)
    wrench = np.zeros(6)
    body_kernel.write_wrench(body, M, scratch, twist, acceleration, wrench)
    pull = acceleration[:3] + np.cross(acceleration[3:], r) + np.cross(omega, np.cross(omega, r))
    forces = m[:, None] * (body[body_kernel.GRAVITY :] - pull)
    wanted = np.concatenate([forces.sum(axis=0), np.cross(r, forces).sum(axis=0)])
    np.testing.assert_allclose(wrench, wanted, atol=1e-10 * np.abs(wanted).max())
