"""Detection in rendered images to hundredths of a pixel, and reports of faulty images."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from cdpr_rt.calibration.marker_detection import (
    Board,
    CalibrationError,
    MarkerDetector,
    fit_intrinsics,
)
from cdpr_rt.errors import InvalidRequestError
from cdpr_sim_bus.camera.sim_camera import Box, SimCamera, random_poses, seen_at
from cdpr_sim_bus.robot.camera_plant import (
    BoardPlant,
    CameraPlant,
    GridPlant,
    LensPlant,
    MarkerPlant,
    MountPlant,
    PrintPlant,
)

LENS = LensPlant(
    width_px=480, height_px=384, focal_px=(415.0, 416.0), centre_px=(242.0, 189.0), blur_px=0.6
)
FLAT = PrintPlant(scale_error=0.0, scale_sigma=0.0, bend_sigma_m=0.0)
MOUNT = MountPlant(position_m=(0.0, 0.0, 0.0))
BOX = Box((-0.1, -0.1, 1.0), (0.1, 0.1, 1.2), 15.0)
GRID = GridPlant(rows=3, columns=3, pitch_m=0.3, origin_m=(0.0, 0.0, 0.0), position_sigma_m=0.01)
CORNERS = np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)])


def plant(**more: object) -> CameraPlant:
    made = {"lens": LENS, "mount": MOUNT, "printing": FLAT, "grids": (GRID,)}
    return CameraPlant(**{**made, **more})


def test_corners_are_ten_times_as_accurate_as_those_of_opencv() -> None:
    camera, detector = SimCamera(plant()), MarkerDetector("4X4_100")
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    theirs_detector = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100), settings
    )
    ours, theirs = [], []
    for state in random_poses(BOX, 3, 5):
        image, pose = camera.grab(state), camera.camera_pose(state)
        truth = {}
        for sheet in camera.sheets:
            at = 0.15 * CORNERS @ sheet.rotation.T + sheet.position_m - pose.position_m
            truth[int(sheet.name)] = seen_at(at @ pose.rotation, LENS)
        sight = detector.detect(image, "one")
        assert sight.problem is None
        ours += [corners - truth[marker] for marker, corners in sight.corners_px.items()]
        corners, ids, _ = theirs_detector.detectMarkers(image)
        theirs += [
            c.reshape(4, 2) - truth[int(i)] for c, i in zip(corners, ids.ravel(), strict=True)
        ]
    off, other = (np.linalg.norm(one, axis=-1) for one in (np.array(ours), np.array(theirs)))
    assert len(ours) >= 12
    assert np.median(off) < 0.05
    assert np.median(off) < 0.4 * np.median(other)


def test_an_image_without_markers_is_reported_with_the_reason() -> None:
    camera, detector = SimCamera(plant()), MarkerDetector("4X4_100")
    state = next(iter(random_poses(BOX, 1, 6)))
    camera.dark = True
    assert "black" in str(detector.detect(camera.grab(state), "dark").problem)
    camera.dark, camera.defocus_px = False, 9.0
    assert "blurred" in str(detector.detect(camera.grab(state), "soft").problem)
    assert "contrast" in str(detector.detect(np.full((60, 80), 90, np.uint8), "flat").problem)
    white = np.full((60, 80), 255, np.uint8)
    white[:5] = 0
    assert "overexposed" in str(detector.detect(white, "white").problem)
    with pytest.raises(InvalidRequestError, match="dictionary '4x4'"):
        MarkerDetector("4x4")


def test_mirrored_and_duplicate_sheets_are_detected() -> None:
    at = [(-0.2, 0.1, 0.0), (0.2, 0.1, 0.0), (0.0, -0.2, 0.0)]
    markers = (
        MarkerPlant(id=5, size_m=0.2, position_m=at[0]),
        MarkerPlant(id=5, size_m=0.2, position_m=at[1]),
        MarkerPlant(id=7, size_m=0.2, position_m=at[2], mirrored=True),
    )
    camera = SimCamera(plant(markers=markers, grids=()))
    image = camera.grab(next(iter(random_poses(BOX, 1, 7))))
    sight = MarkerDetector("4X4_100").detect(image, "one", mirrors=True)
    assert sight.repeated == (5,)
    assert sight.mirrored == (7,)
    assert not sight.corners_px


def test_intrinsics_from_a_board_are_true_within_their_uncertainty() -> None:
    camera = SimCamera(plant(grids=(), board=BoardPlant(), samples=16))
    states = random_poses(Box((-0.06, -0.05, 0.3), (0.06, 0.05, 0.55), 45.0), 14, 8)
    images = [(f"{k}", camera.grab(state)) for k, state in enumerate(states)]
    fit = fit_intrinsics(images, Board())
    one = fit.intrinsics
    assert one.rms_px is not None and one.rms_px < 0.3
    assert one.sigmas is not None
    truth = (*LENS.focal_px, *LENS.centre_px)
    for found, true, sigma in zip(one.parameters, truth, one.sigmas, strict=False):
        assert abs(found - true) < 4.0 * sigma + 0.5
    assert any("take 15 or more" in line for line in fit.missing)
    level = random_poses(Box((-0.02, -0.02, 0.5), (0.02, 0.02, 0.55), 8.0), 5, 8)
    alike = [(f"{k}", camera.grab(state)) for k, state in enumerate(level)]
    said = " ".join(fit_intrinsics(alike, Board()).missing)
    assert "tilted" in said and "corner" in said and "nearer or farther" in said
    with pytest.raises(CalibrationError, match="0 images show the board; 5 are needed"):
        fit_intrinsics([("a", np.full((384, 480), 90, np.uint8))], Board())
    with pytest.raises(InvalidRequestError, match="images differ in size"):
        fit_intrinsics([images[0], ("b", images[1][1][1:])], Board())


@pytest.mark.parametrize(
    ("board", "flipped", "said"),
    [
        (Board(dictionary="6X6_100"), False, "markers of 5X5_50 are read, none of 6X6_100"),
        (
            Board(6, 9),
            False,
            "columns and 9 rows has this arrangement: were columns and rows exchanged",
        ),
        (Board(), True, "markers read as mirror images: is the board or the image mirrored"),
    ],
)
def test_a_board_that_differs_from_its_description_is_reported(
    board: Board, flipped: bool, said: str
) -> None:
    camera = SimCamera(plant(grids=(), board=BoardPlant(), samples=16))
    states = random_poses(Box((-0.02, -0.02, 0.4), (0.02, 0.02, 0.45), 15.0), 2, 8)
    images = [camera.grab(state)[:, :: -1 if flipped else 1] for state in states]
    with pytest.raises(CalibrationError, match=f"0 images show the board.*{said}"):
        fit_intrinsics([(f"{k}", np.ascontiguousarray(one)) for k, one in enumerate(images)], board)


@pytest.mark.parametrize("name", ["DICT_6X6_250", "6x6_250", "nonsense"])
def test_an_unknown_marker_dictionary_is_reported_with_a_suggestion(name: str) -> None:
    said = "did you mean '6X6_250'" if "6" in name else "allowed: 4X4_50, 4X4_100"
    for made in (lambda: MarkerDetector(name), Board(dictionary=name).made):
        with pytest.raises(InvalidRequestError, match=said):
            made()
