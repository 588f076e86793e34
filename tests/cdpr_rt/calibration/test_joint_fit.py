"""The joint fit of cables, camera and markers: derivatives, accuracy and verification."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.camera_model import CameraModel, corner_residuals, corner_terms
from cdpr_rt.calibration.camera_start import camera_start, locate_by_camera, turned_camera
from cdpr_rt.calibration.fit import fit, moved
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.parameters import Knowledge
from cdpr_rt.calibration.readings import Images, Observations
from cdpr_rt.calibration.verification import every_fifth, relative_errors, verifies
from cdpr_rt.errors import InvalidRequestError
from tests.cdpr_rt.calibration.camera_robot import FEW, CameraRobot, camera_robot
from tests.cdpr_rt.calibration.synthetic_readings import ErrorBudget, HAND_EYE_m

_FREE = (0, 1, 2, 3, 4, 5)
_STEP = 1e-6
NOTHING_WRONG = ErrorBudget(
    elongation=0.0, encoder_m=1e-6, tension_N=0.0, corner_px=0.01, focal=0.0, centre_px=0.0,
    distortion=0.0, print_scale=0.0, sheet_scale=0.0, bend_m=0.0, known_m=0.0,
)  # fmt: skip
plain = cache(camera_robot)


def outcome_of(what: CameraRobot, seen: Observations, images: Images) -> Outcome:
    return calibrate(what.robot, what.geometry, seen, "camera", images)


def off_mm(what: CameraRobot, poses: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm(relative_errors(poses, what.made.poses)[0], axis=1).mean())


def test_derivatives_agree_with_finite_differences() -> None:
    start = plain(8).start()
    camera, poses, seen = start.camera, start.seen.start, start.seen.markers
    assert seen is not None
    rng = np.random.default_rng(2)
    camera = camera.changed(0.01 * rng.normal(size=camera.size))

    def residual(model: CameraModel, at: np.ndarray) -> np.ndarray:
        off = corner_residuals(model, seen, at) / camera.knowledge.sigma_px
        return np.asarray(off.reshape(len(seen), 8))

    terms = corner_terms(camera, seen, poses)
    assert terms.residual == pytest.approx(residual(camera, poses))
    for k in range(6):
        step = np.zeros((len(poses), 6))
        step[:, k] = _STEP
        there, back = moved(poses, step, _FREE), moved(poses, -step, _FREE)
        told = (residual(camera, there) - residual(camera, back)) / (2 * _STEP)
        assert terms.by_pose[..., k] == pytest.approx(told, rel=1e-4, abs=1e-3)
    for k in range(camera.first_marker + 12):
        move = np.zeros(camera.size)
        move[k] = _STEP
        told = residual(camera.changed(move), poses) - residual(camera.changed(-move), poses)
        told /= 2 * _STEP
        if k < camera.first_marker:
            assert terms.by_shared[..., k] == pytest.approx(told, rel=1e-4, abs=1e-3)
        else:
            number, column = divmod(k - camera.first_marker, 6)
            own = seen.marker == number
            assert terms.by_marker[own, :, column] == pytest.approx(told[own], rel=1e-4, abs=1e-3)
            assert not told[~own].any()


def test_the_truth_is_found_without_noise_and_without_known_camera_position() -> None:
    sharp = Knowledge(exit_m=0.1, length_m=1e-5, tension_N=0.01, drum=0.02)
    what = camera_robot(15, 5, NOTHING_WRONG, hand_eye_known=False, knowledge=sharp)
    start = what.start()
    found = fit(what.geometry, start.seen, start=start.geometry, camera=start.camera)
    assert found.converged and found.camera is not None
    assert off_mm(what, found.poses) < 0.3
    exits = what.geometry.kernel_geometry()[:3].T + found.geometry.cable[:, :3]
    apart = np.linalg.norm(exits[:, None] - exits, axis=2)
    true = np.linalg.norm(what.made.exits_m[:, None] - what.made.exits_m, axis=2)
    assert apart == pytest.approx(true, abs=3e-3)
    assert found.camera.position_m == pytest.approx(HAND_EYE_m, abs=0.02)


def test_the_fit_agrees_with_an_independent_solver() -> None:
    # exit points and offsets by (3.18), corners by OpenCV, with markers and all poses unknown
    errors = ErrorBudget(elongation=0.0, drum=0.0)
    sheets = replace(FEW, rows=2, columns=2)
    what = camera_robot(7, 7, errors, sheets, identified=("exit", "offset"))
    setup = what.images.setup
    held = setup.intrinsics.model_copy(update={"sigmas": None})
    images = Images(setup.model_copy(update={"intrinsics": held}), what.images.sightings)
    what = replace(what, images=images)
    start = what.start()
    ours = fit(what.geometry, start.seen, robust=False, start=start.geometry, camera=start.camera)
    assert ours.camera is not None
    theirs = _plain_solution(what, start.seen, start.camera, ours.poses, ours.camera)
    n = what.geometry.n
    assert ours.geometry.cable[:, :4] == pytest.approx(theirs[: 4 * n].reshape(n, 4), abs=3e-5)
    assert ours.camera.position_m == pytest.approx(theirs[4 * n : 4 * n + 3], abs=3e-5)


def _plain_solution(
    what: CameraRobot,
    seen: Observations,
    first: CameraModel,
    poses: np.ndarray,
    camera: CameraModel,
) -> np.ndarray:
    """Return exit points, offsets, camera and other unknowns by SciPy with numeric derivatives."""
    markers, known, file = seen.markers, first.knowledge, what.geometry
    assert markers is not None
    n, count, m = file.n, seen.poses, len(first.ids)
    a, b = file.kernel_geometry()[:3].T, file.kernel_geometry()[3:6].T
    stretch = 1.0 + file.compliance_1_N * seen.tension_N
    tape, reading = file.knowledge, file.knowledge
    std = np.hypot(reading.length_m, seen.length_m * file.compliance_1_N * reading.tension_N)
    lens = known.lens
    matrix = np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]])
    corners = markers.corners_m

    def rotations(x: np.ndarray, about: np.ndarray) -> np.ndarray:
        return np.asarray(Rotation.from_rotvec(x).as_matrix() @ about)

    def residuals(x: np.ndarray) -> np.ndarray:
        v, hand, size = x[: 4 * n].reshape(n, 4), x[4 * n : 4 * n + 6], x[4 * n + 6]
        rest = x[4 * n + 7 :].reshape(-1, 6)
        at, sheets = rest[:count], rest[count:]
        Q = rotations(at[:, 3:], poses[:, 1:])
        c = at[:, None, :3] + np.einsum("jab,ib->jia", Q, b) - a - v[:, :3]
        closure = ((seen.length_m + v[:, 3]) * stretch - np.linalg.norm(c, axis=2)) / std
        X = rotations(hand[3:], camera.rotation)
        R = rotations(sheets[:, 3:], camera.marker_rotation)
        out = [closure.ravel(), v[:, :3].ravel() / tape.exit_m, v[:, 3] / tape.offset_m]
        for j in range(count):
            rows = markers.image == j
            k = markers.marker[rows]
            points = (1.0 + size) * corners[rows] @ R[k].transpose(0, 2, 1) + sheets[k, None, :3]
            back = (Q[j] @ X).T
            turn = Rotation.from_matrix(back).as_rotvec()
            place = -back @ (at[j, :3] + Q[j] @ hand[:3])
            pixels, _ = cv2.projectPoints(points.reshape(-1, 3), turn, place, matrix, lens[4:])
            off_px = pixels.ravel() - markers.corners_px[rows].ravel()
            out.append(off_px / known.sigma_px)
        off = Rotation.from_matrix(X @ known.rotation.T).as_rotvec()
        out.append((hand[:3] - known.position_m) / known.hand_eye_std[:3])
        out.append(off / known.hand_eye_std[3:])
        out.append(np.array([size / known.size_std]))
        return np.concatenate(out)

    # rotations start at our solution, compared values at those of the file
    begin = np.concatenate([
        np.zeros(4 * n), known.position_m, np.zeros(3), [0.0],
        np.hstack([poses[:, 0], np.zeros((count, 3))]).ravel(),
        np.hstack([camera.marker_position_m, np.zeros((m, 3))]).ravel(),
    ])  # fmt: skip
    found = least_squares(residuals, begin, x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-14)
    return np.asarray(found.x)


def test_errors_agree_with_their_predicted_covariance() -> None:
    # only errors in the model: noise of corners and encoders, drums, tape, lens, size
    errors = ErrorBudget(sheet_scale=0.0, bend_m=0.0, tension_N=0.0, elongation=0.0)
    chi, freedom = 0.0, 0
    for seed in range(3):
        what = camera_robot(15, 20 + seed, errors, hand_eye_known=True,
                            identified=("exit", "offset", "drum"))  # fmt: skip
        images = replace(what.images, setup=what.images.setup.model_copy(update={"sigma_px": 0.1}))
        start = replace(what, images=images).start()
        found = fit(what.geometry, start.seen, robust=False, start=start.geometry,
                    camera=start.camera)  # fmt: skip
        cable, n = found.geometry.cable, what.geometry.n
        file = what.geometry.kernel_geometry()[:3].T
        off = np.column_stack(
            [file + cable[:, :3] - what.made.exits_m, cable[:, 4] - what.made.drums]
        )
        chosen = np.array([5 * i + k for i in range(n) for k in (0, 1, 2, 4)])
        covariance = found.covariance[np.ix_(chosen, chosen)]
        chi += float(off.ravel() @ np.linalg.solve(covariance, off.ravel()))
        freedom += chosen.size
    # chi squared of 96 degrees of freedom: 1 in 10^4 on both sides
    assert 0.55 < chi / freedom < 1.65


def test_a_camera_alone_locates_the_platform_in_the_map_of_the_fit() -> None:
    what = plain(20)
    start = what.start()
    found = fit(what.geometry, start.seen, start=start.geometry, camera=start.camera)
    assert found.camera is not None
    there = locate_by_camera(found.geometry, found.camera, replace(found.seen, start=found.poses))
    assert off_mm(what, there.poses) < 3.0


def test_hand_eye_is_required_for_a_camera_on_a_platform_that_does_not_turn() -> None:
    turns = Rotation.from_rotvec(np.outer(np.linspace(0.0, 0.3, 8), (0.0, 0.0, 1.0))).as_matrix()
    with pytest.raises(InvalidRequestError, match="hand_eye"):
        turned_camera(turns, turns)


def test_a_contradictory_camera_orientation_is_rejected() -> None:
    what = plain(15)
    setup = what.images.setup
    assert setup.hand_eye is not None
    wrong = setup.hand_eye.model_copy(update={"rotation_deg": (0.0, 0.0, 0.0)})
    setup = setup.model_copy(update={"hand_eye": wrong})
    with pytest.raises(
        InvalidRequestError, match=r"hand_eye\.rotation_deg: .*differs by 1[78][0-9] deg"
    ):
        camera_start(what.geometry, what.seen, setup, what.images.sightings)


def test_measured_points_verify_if_three_poses_have_complete_points() -> None:
    seen = plain(15).seen.some(np.arange(5))
    for std_m, enough in (
        (np.full((5, 3), np.nan), False),
        (np.array([[1e-3, 1e-3, np.nan]] * 5), False),
        (np.array([[1e-3] * 3] * 2 + [[np.nan] * 3] * 3), False),
        (np.array([[1e-3] * 3] * 3 + [[np.nan] * 3] * 2), True),
    ):
        assert verifies(replace(seen, position_std_m=std_m)) == enough


def test_a_fit_without_held_out_verification_is_not_adopted() -> None:
    what = plain(20)
    blind = [
        replace(one, corners_px={}) if out else one
        for one, out in zip(what.images.sightings, every_fifth(20), strict=True)
    ]
    done = outcome_of(what, what.seen, replace(what.images, sightings=blind))
    assert done.as_json()["verification"]["reference"] == "none"
    assert any("the calibration is not verified" in text for text in done.objections())
