"""Poses: exponential and logarithm compared with SciPy's rotations, and the group's laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cdpr_rt.errors import GeometryError
from cdpr_rt.model.pose import Pose, exponential, logarithm

coordinate = st.floats(-1.0, 1.0)
unit = (
    st.tuples(coordinate, coordinate, coordinate)
    .map(np.array)
    .filter(lambda v: np.linalg.norm(v) > 1e-3)
    .map(lambda v: v / np.linalg.norm(v))
)
angle = st.one_of(
    st.floats(0.0, np.pi - 1e-9),
    st.floats(-12.0, -1.0).map(lambda e: 10.0**e),
    st.floats(-9.0, -1.0).map(lambda e: np.pi - 10.0**e),
)
vectors = st.tuples(unit, angle).map(lambda ua: ua[0] * ua[1])


def turned(phi: np.ndarray) -> np.ndarray:
    Q = np.empty((3, 3))
    exponential(phi, Q)
    return Q


def vector_of(Q: np.ndarray) -> np.ndarray:
    phi = np.empty(3)
    logarithm(np.ascontiguousarray(Q), phi)
    return phi


@given(vectors)
@example(np.zeros(3))
@example(np.array([0.0, 0.0, 1e-4]))
def test_the_exponential_equals_scipys(phi: np.ndarray) -> None:
    Q = turned(phi)
    assert np.abs(Q - Rotation.from_rotvec(phi).as_matrix()).max() < 1e-14
    assert np.abs(Q @ Q.T - np.eye(3)).max() < 1e-14


@given(vectors)
@example(np.zeros(3))
def test_the_logarithm_inverts_the_exponential(phi: np.ndarray) -> None:
    assert np.abs(vector_of(turned(phi)) - phi).max() < 1e-7 * max(np.linalg.norm(phi), 1e-9)
    assert vector_of(turned(phi)) == pytest.approx(
        Rotation.from_matrix(turned(phi)).as_rotvec(), rel=1e-7, abs=1e-14
    )


@pytest.mark.parametrize("axis", [*np.eye(3), np.ones(3) / np.sqrt(3.0)])
def test_the_logarithm_of_half_a_turn_has_length_pi(axis: np.ndarray) -> None:
    Q = 2.0 * np.outer(axis, axis) - np.eye(3)
    found = vector_of(Q)
    assert np.linalg.norm(found) == pytest.approx(np.pi, abs=1e-12)
    assert turned(found) == pytest.approx(Q, abs=1e-12)


@given(vectors, vectors, vectors, vectors)
def test_minus_undoes_plus(
    p: np.ndarray, phi: np.ndarray, dp: np.ndarray, dphi: np.ndarray
) -> None:
    one, x = Pose(p, turned(phi)), np.concatenate([dp, dphi])
    other = one.plus(x)
    assert other.minus(one) == pytest.approx(x, abs=1e-6)
    back = one.plus(other.minus(one))
    assert back.array == pytest.approx(other.array, abs=1e-12)
    assert (
        pytest.approx((Rotation.from_rotvec(dphi) * Rotation.from_rotvec(phi)).as_matrix())
        == other.Q
    )


@pytest.mark.parametrize(
    ("p", "Q", "told"),
    [
        ([0.0, np.nan, 0.0], np.eye(3), "position"),
        ([0.0, 0.0], np.eye(3), "position"),
        ([0.0, 0.0, 0.0], 1.01 * np.eye(3), "rotation"),
        ([0.0, 0.0, 0.0], -np.eye(3), "rotation"),
        ([0.0, 0.0, 0.0], np.full((3, 3), np.nan), "rotation"),
        ([0.0, 0.0, 0.0], np.eye(2), "rotation"),
    ],
)
def test_invalid_poses_are_rejected(p: list[float], Q: np.ndarray, told: str) -> None:
    with pytest.raises(GeometryError, match=told):
        Pose(np.array(p), Q)
