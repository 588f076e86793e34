"""Lens, squares seen through it and sparse derivatives, against OpenCV and differences."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from marker_room import LENS, room
from scipy.spatial.transform import Rotation

from cdpr_rt.calibration.markers.geometry.lens import directions, project
from cdpr_rt.calibration.markers.geometry.rotations import angles
from cdpr_rt.calibration.markers.geometry.square_pose import square_poses
from cdpr_rt.calibration.markers.reprojection import Estimate, residuals, residuals_and_jacobian
from cdpr_rt.calibration.markers.seen_markers import CORNERS, SeenMarkers

MATRIX = np.array([[LENS[0], 0, LENS[2]], [0, LENS[1], LENS[3]], [0, 0, 1.0]])


def test_points_are_seen_where_opencv_has_them_and_directions_lead_back() -> None:
    chance = np.random.default_rng(3)
    points = np.column_stack([chance.uniform(-0.4, 0.4, (50, 2)), chance.uniform(0.9, 2.0, 50)])
    seen = project(points, LENS)
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, LENS[4:])
    np.testing.assert_allclose(seen, theirs.reshape(-1, 2), atol=1e-9)
    np.testing.assert_allclose(directions(seen, LENS), points[:, :2] / points[:, 2:], atol=1e-9)


def test_one_of_a_squares_two_poses_is_the_true_one_and_the_other_is_tilted_otherwise() -> None:
    chance = np.random.default_rng(4)
    truth, rows = [], []
    for i in range(80):
        turn = (
            Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec(chance.normal(0.0, 0.4, 3))
        ).as_matrix()
        place = chance.uniform((-0.3, -0.25, 0.9), (0.3, 0.25, 1.5))
        truth.append((turn, place))
        rows.append((i, 7, project(0.15 * CORNERS @ turn.T + place, LENS)))
    seen = SeenMarkers.of(map(str, range(80)), rows, {7: 0.15})
    poses, flips = square_poses(seen, LENS), 0
    for i, (turn, place) in enumerate(truth):
        off = angles(poses.rotation[i] @ turn.T)
        assert off[0] < 1e-6
        np.testing.assert_allclose(poses.position_m[i, 0], place, atol=1e-7)
        if off[1] < 1e-3:
            continue  # so near that there is no other
        flips += 1
        _, turns, _, _ = cv2.solvePnPGeneric(
            *(0.15 * CORNERS, seen.corners_px[i].reshape(4, 1, 2), MATRIX, LENS[4:]),
            flags=cv2.SOLVEPNP_IPPE_SQUARE,
        )
        # theirs is not refined: it is not quite in the same place, but it is the same flip
        other = cv2.Rodrigues(turns[1])[0]
        assert angles(poses.rotation[i, 1] @ other.T) < 0.5 * off[1]
    assert flips > 40


def test_the_sparse_jacobian_is_that_of_the_residuals() -> None:
    one = room(5, rows=3, columns=3, images=4)
    estimate = Estimate(one.truth, LENS.copy())
    off, jacobian = residuals_and_jacobian(estimate, one.seen)
    np.testing.assert_allclose(off, residuals(estimate, one.seen).ravel(), atol=1e-12)
    dense = jacobian.toarray()
    for k in range(estimate.parameters):
        step = np.zeros(estimate.parameters)
        step[k] = 1e-6
        there, back = (residuals(estimate.changed(s), one.seen).ravel() for s in (step, -step))
        numeric = (there - back) / 2e-6
        assert np.abs(numeric - dense[:, k]).max() <= 1e-5 * max(1.0, np.abs(numeric).max())


def test_what_is_seen_twice_in_an_image_or_has_no_size_is_refused() -> None:
    corners = np.zeros((4, 2))
    with pytest.raises(Exception, match="marker 3 is there twice in image number 0"):
        SeenMarkers.of(["a"], [(0, 3, corners), (0, 3, corners)], {3: 0.1})
    with pytest.raises(Exception, match="marker 4 was seen, but has no size"):
        SeenMarkers.of(["a"], [(0, 3, corners), (0, 4, corners)], {3: 0.1})
