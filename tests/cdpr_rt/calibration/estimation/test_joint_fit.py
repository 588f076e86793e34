"""The fit of cables, camera and markers: derivatives, an independent solver, trials, and faults."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.camera.camera_start import camera_start
from cdpr_rt.calibration.camera.corner_terms import corner_normals, corner_residuals, corner_terms
from cdpr_rt.calibration.camera.hand_eye import turned_camera
from cdpr_rt.calibration.estimation.fit import fit, moved
from cdpr_rt.calibration.estimation.parameters import Knowledge
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.readings.camera_data import Images
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.calibration.verification.held_out import held_out
from cdpr_rt.calibration.verification.verification import (
    locate_by_camera,
    relative_errors,
    verifies,
)
from cdpr_rt.errors import InvalidRequestError
from cdpr_tools.calibrate.synthetic_readings import ErrorBudget, HAND_EYE_m
from tests.cdpr_rt.calibration.camera_robot import FEW, CameraRobot, camera_robot

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


def test_derivatives_are_those_of_differences() -> None:
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
            assert terms.by_camera[..., k] == pytest.approx(told, rel=1e-4, abs=1e-3)
        else:
            number, column = divmod(k - camera.first_marker, 6)
            own = seen.marker == number
            assert terms.by_marker[own, :, column] == pytest.approx(told[own], rel=1e-4, abs=1e-3)
            assert not told[~own].any()


def test_blocks_of_the_normal_equations_are_those_of_all_rows() -> None:
    start = plain(8).start()
    camera, seen = start.camera, start.seen.markers
    assert seen is not None
    count, n = start.seen.poses, len(seen)
    terms = corner_terms(camera, seen, start.seen.start)
    weights = np.random.default_rng(1).uniform(0.2, 1.0, (n, 4))
    J = np.zeros((n, 8, camera.size + 6 * count))
    J[..., : camera.first_marker] = terms.by_camera
    for row in range(n):
        first = camera.first_marker + 6 * seen.marker[row]
        J[row, :, first : first + 6] = terms.by_marker[row]
        first = camera.size + 6 * seen.image[row]
        J[row, :, first : first + 6] = terms.by_pose[row]
    flat = J.reshape(8 * n, -1)
    weighted = flat * np.repeat(weights.ravel(), 2)[:, None]
    normal, gradient = weighted.T @ flat, weighted.T @ terms.residual.ravel()
    got = corner_normals(camera, seen, terms, weights, count)
    size = camera.size
    assert pytest.approx(normal[:size, :size], rel=1e-9, abs=1e-6) == got.H
    across = got.E.transpose(1, 0, 2).reshape(size, -1)
    assert across == pytest.approx(normal[:size, size:], rel=1e-9, abs=1e-6)
    assert got.by_parameter == pytest.approx(gradient[:size], rel=1e-9, abs=1e-6)
    assert got.by_pose.ravel() == pytest.approx(gradient[size:], rel=1e-9, abs=1e-6)
    for j in range(count):
        own = slice(size + 6 * j, size + 6 * j + 6)
        assert got.C[j] == pytest.approx(normal[own, own], rel=1e-9, abs=1e-6)


def test_without_noise_the_truth_is_found_and_no_place_of_the_camera_need_be_known() -> None:
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


def test_it_agrees_with_an_independent_solver() -> None:
    # exit points and offsets by (3.18), corners by OpenCV; markers and all poses unknown
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
    """Return exit points, offsets, camera and what else there is by SciPy, numeric derivatives."""
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

    # the turns are told from ours, what is compared begins at the file's
    begin = np.concatenate([
        np.zeros(4 * n), known.position_m, np.zeros(3), [0.0],
        np.hstack([poses[:, 0], np.zeros((count, 3))]).ravel(),
        np.hstack([camera.marker_position_m, np.zeros((m, 3))]).ravel(),
    ])  # fmt: skip
    found = least_squares(residuals, begin, x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-14)
    return np.asarray(found.x)


def test_errors_are_as_large_as_predicted() -> None:
    # nothing that the model does not know: noise of corners and encoders, drums, tape, lens, size
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
    assert off_mm(what, there) < 3.0


def test_a_camera_on_a_platform_that_does_not_turn_has_to_be_told_where_it_is() -> None:
    turns = Rotation.from_rotvec(np.outer(np.linspace(0.0, 0.3, 8), (0.0, 0.0, 1.0))).as_matrix()
    with pytest.raises(InvalidRequestError, match="hand_eye"):
        turned_camera(turns, turns)


def test_a_camera_that_sits_otherwise_than_told_is_refused() -> None:
    what = plain(15)
    setup = what.images.setup
    assert setup.hand_eye is not None
    wrong = setup.hand_eye.model_copy(update={"rotation_deg": (0.0, 0.0, 0.0)})
    setup = setup.model_copy(update={"hand_eye": wrong})
    with pytest.raises(InvalidRequestError, match=r"hand_eye\.rotation_deg: .* 1[78][0-9] deg off"):
        camera_start(what.geometry, what.seen, setup, what.images.sightings)


def test_measured_points_verify_where_three_poses_have_all_of_theirs() -> None:
    seen = plain(15).seen.some(np.arange(5))
    for std_m, enough in (
        (np.full((5, 3), np.nan), False),
        (np.array([[1e-3, 1e-3, np.nan]] * 5), False),
        (np.array([[1e-3] * 3] * 2 + [[np.nan] * 3] * 3), False),
        (np.array([[1e-3] * 3] * 3 + [[np.nan] * 3] * 2), True),
    ):
        assert verifies(replace(seen, position_std_m=std_m)) == enough


def test_slipped_encoders_and_bad_markers_are_named_and_survived() -> None:
    what = plain(20)
    lengths = what.seen.length_m.copy()
    lengths[10:, 6] += 0.008
    lengths[15:, 1] -= 0.006
    sightings = [replace(one, corners_px=dict(one.corners_px)) for one in what.images.sightings]
    sightings[4] = replace(sightings[4], corners_px={}, problem="black")
    sightings[6] = replace(sightings[6], repeated=(11,))
    sightings[1] = replace(sightings[1], mirrored=(12,))
    for one in sightings[10:]:
        if 5 in one.corners_px:
            one.corners_px[5] = one.corners_px[5] + (45.0, 0.0)  # type: ignore[index]
    images = replace(what.images, sightings=sightings)
    done = outcome_of(what, replace(what.seen, length_m=lengths), images)
    words = "\n".join(fault.text for fault in done.faults)
    jumps = {(one.cable, one.pose): one.size for one in done.faults if one.kind == "jump"}
    assert jumps == pytest.approx({(6, 10): -0.008, (1, 15): 0.006}, abs=1e-3)
    assert "slipped" in words and "from pose 11 on" in words
    assert "pose 5: black" in words
    assert (
        "marker 11 is twice in 1 images" in words and "marker 12 is printed as its mirror" in words
    )
    assert "marker 5 was moved by" in words
    assert off_mm(what, done.found.poses) < 3.0


@pytest.mark.parametrize("layout", [FEW, replace(FEW, known=3)])
def test_a_wrong_size_of_all_sheets_is_told_by_the_cables(layout: object) -> None:
    what = camera_robot(20, 3, None, layout)  # type: ignore[arg-type]
    sheets = what.images.setup.sheets.model_copy(update={"size_m": 0.15 * 1.04})
    setup = what.images.setup.model_copy(update={"sheets": sheets})
    done = outcome_of(what, what.seen, replace(what.images, setup=setup))
    sized = [fault for fault in done.faults if fault.kind == "size"]
    assert len(sized) == 1 and "smaller than told" in sized[0].text
    assert sized[0].size == pytest.approx(-0.0385, abs=0.008)
    assert off_mm(what, done.found.poses) < 3.0
    assert ("places of markers are known" in done.as_json()["frame"]) == bool(layout.known)  # type: ignore[attr-defined]


@pytest.mark.parametrize("drums", [(0.02,) * 8, (0.0, 0.0, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0)])
def test_sheets_and_drums_that_are_wrong_together_are_told_apart(drums: tuple[float, ...]) -> None:
    what = plain(20)
    sheets = what.images.setup.sheets.model_copy(update={"size_m": 0.15 * 1.04})
    setup = what.images.setup.model_copy(update={"sheets": sheets})
    home = what.seen.length_m[0]
    lengths = home + (what.seen.length_m - home) / (1.0 + np.array(drums))
    done = outcome_of(what, replace(what.seen, length_m=lengths), replace(what.images, setup=setup))
    size, *others = (fault for fault in done.faults if fault.kind in ("size", "drum"))
    assert size.kind == "size" and size.size == pytest.approx(-0.0385, abs=0.004)
    assert [(one.kind, one.cable) for one in others] == [("drum", -1 if all(drums) else 2)]
    assert others[0].size == pytest.approx(max(drums), abs=0.004)
    assert off_mm(what, done.found.poses) < 3.5


def test_intrinsics_of_another_camera_are_named() -> None:
    what = plain(20)
    given = what.images.setup.intrinsics
    wrong = given.model_copy(update={"focal_px": tuple(1.03 * f for f in given.focal_px)})
    setup = what.images.setup.model_copy(update={"intrinsics": wrong})
    done = outcome_of(what, what.seen, replace(what.images, setup=setup))
    lens = [fault for fault in done.faults if fault.kind == "lens"]
    assert len(lens) == 1 and "the intrinsics are not this camera's" in lens[0].text
    assert lens[0].size == pytest.approx(-0.029, abs=0.004)
    assert off_mm(what, done.found.poses) < 3.0


def test_a_robot_that_is_as_its_file_says_is_not_calibrated_for_the_worse() -> None:
    right = ErrorBudget(exit_m=0.0, home_m=0.0, home_deg=0.0, drum=0.0, elongation=0.0)
    for errors, known_better in ((right, False), (ErrorBudget(), True)):
        what = camera_robot(20, errors=errors)
        done = outcome_of(what, what.seen, what.images)
        told = done.insignificance() or ""
        assert ("may be right already" in told) is not known_better, done.verdict()


def test_what_no_pose_held_out_verifies_is_not_taken_over() -> None:
    what = plain(20)
    blind = [
        replace(one, corners_px={}) if out else one
        for one, out in zip(what.images.sightings, held_out(20), strict=True)
    ]
    done = outcome_of(what, what.seen, replace(what.images, sightings=blind))
    assert done.as_json()["verification"]["reference"] == "none"
    assert any("nothing verifies it" in text for text in done.objections())


@pytest.mark.parametrize(("size", "drum"), [(1.04, 0.0), (1.0, 0.02)])
def test_a_lens_and_sheets_or_drums_that_are_wrong_together_are_told_apart(
    size: float, drum: float
) -> None:
    what = plain(20)
    given = what.images.setup
    focal_px = tuple(1.03 * f for f in given.intrinsics.focal_px)
    setup = given.model_copy(
        update={
            "sheets": given.sheets.model_copy(update={"size_m": 0.15 * size}),
            "intrinsics": given.intrinsics.model_copy(update={"focal_px": focal_px}),
        }
    )
    home = what.seen.length_m[0]
    lengths = home + (what.seen.length_m - home) / (1.0 + drum)
    done = outcome_of(what, replace(what.seen, length_m=lengths), replace(what.images, setup=setup))
    sizes = {one.kind: one.size for one in done.faults if one.kind in ("size", "drum", "lens")}
    other = {"drum": drum} if drum else {"size": 1.0 / size - 1.0}
    assert sizes == pytest.approx({**other, "lens": 1.0 / 1.03 - 1.0}, abs=0.005)
    assert off_mm(what, done.found.poses) < 3.5
