"""Images of the simulated camera agree with geometry, as found by OpenCV's detector."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_sim_bus.camera.scene import build_scene
from cdpr_sim_bus.camera.sim_camera import SimCamera, ray_table, seen_at
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.physics_board import PlatformState
from cdpr_sim_bus.robot.camera_plant import (
    CameraPlant,
    LensPlant,
    MarkerPlant,
    MountPlant,
    OccluderPlant,
    PrintPlant,
    SensorPlant,
)

LENS = LensPlant(
    width_px=320, height_px=256, focal_px=(280.0, 282.0), centre_px=(158.0, 130.0), blur_px=0.5
)
FLAT = PrintPlant(scale_error=0.0, scale_sigma=0.0, bend_sigma_m=0.0)
MOUNT = MountPlant(position_m=(0.0, 0.0, 0.0))
CORNERS = np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)])
STILL = (0.0, 0.0, 0.0)


def plant(**more: object) -> CameraPlant:
    marker = MarkerPlant(id=3, size_m=0.3, position_m=(0.05, 0.02, 0.0), rotation_deg=(0, 0, 20.0))
    made = {"lens": LENS, "mount": MOUNT, "printing": FLAT, "markers": (marker,)}
    return CameraPlant(**{**made, **more})


def above(
    turn_deg: tuple[float, float, float] = STILL,
    velocity: tuple[float, float, float] = STILL,
    spin: tuple[float, float, float] = STILL,
) -> PlatformState:
    turn = Rotation.from_rotvec(turn_deg, degrees=True).as_matrix()
    return PlatformState(1.0, (0.0, 0.0, 1.2), tuple(turn.ravel().tolist()), velocity, spin)


def corners_of(camera: SimCamera, image: np.ndarray) -> np.ndarray:
    """Return the corners that OpenCV finds, to some tenths of a pixel."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.cornerRefinementWinSize = 3
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, settings).detectMarkers(image)
    assert ids.ravel().tolist() == [3]
    return np.array(corners).reshape(4, 2)


def expected(camera: SimCamera, state: PlatformState) -> np.ndarray:
    pose, sheet = camera.camera_pose(state), camera.sheets[0]
    at = 0.3 * CORNERS @ sheet.rotation.T + sheet.position_m - pose.position_m
    return seen_at(at @ pose.rotation, camera.plant.lens)


def test_rays_of_pixels_agree_with_opencv() -> None:
    rays = ray_table(LENS)
    pixels = np.array([(0.0, 0.0), (319.0, 255.0), (100.0, 30.0), (7.0, 200.0)])
    matrix = np.array([[280.0, 0.0, 158.0], [0.0, 282.0, 130.0], [0.0, 0.0, 1.0]])
    picked = np.array([rays[int(v), int(u)] for u, v in pixels])
    back, _ = cv2.projectPoints(
        np.column_stack([picked, np.ones(4)]), np.zeros(3), np.zeros(3), matrix,
        np.array(LENS.distortion),
    )  # fmt: skip
    np.testing.assert_allclose(back.reshape(-1, 2), pixels, atol=1e-7)


@pytest.mark.parametrize("turn_deg", [(0.0, 0.0, 0.0), (12.0, -9.0, 30.0)])
def test_a_marker_appears_at_the_projection_of_its_pose(
    turn_deg: tuple[float, float, float],
) -> None:
    camera, state = SimCamera(plant()), above(turn_deg)
    off = corners_of(camera, camera.grab(state)) - expected(camera, state)
    assert np.abs(off).max() < 0.4


def test_motion_blurs_an_image_and_a_rolling_shutter_shears_it() -> None:
    state = above(velocity=(0.4, 0.0, 0.0))
    still, moving, rolling = (
        SimCamera(plant(sensor=SensorPlant(exposure_s=0.03, noise=0.0, shot_noise=0.0, **more)))
        for more in ({}, {}, {"shutter": "rolling", "readout_s": 0.15})
    )
    sharp, blurred = still.grab(above()), moving.grab(state)
    slope = [np.abs(np.diff(image.astype(float), axis=1)).max() for image in (sharp, blurred)]
    assert slope[1] < 0.8 * slope[0]
    # the blur is centred on the position in the middle of the exposure
    assert np.abs(corners_of(moving, blurred) - expected(moving, state)).max() < 0.5
    seen, rest = corners_of(rolling, rolling.grab(state)), expected(rolling, above())
    rate = -0.4 * 280.0 / 1.2 * 0.15 / 256.0  # px to the right per row
    sheared = rest[:, 0] + rate * (rest[:, 1] - 128.0)
    assert np.abs(seen[:, 0] - sheared).max() < 0.5
    assert np.abs(seen[:, 0] - rest[:, 0]).max() > 1.0


def test_noise_depends_only_on_the_number_of_the_image() -> None:
    first, second = SimCamera(plant()), SimCamera(plant())
    images = [first.grab(above()), first.grab(above())]
    np.testing.assert_array_equal(images[0], second.grab(above()))
    assert (images[0] != images[1]).mean() > 0.3


def test_darkness_defocus_occlusion_and_moved_markers_are_visible() -> None:
    camera = SimCamera(plant())
    good = camera.grab(above()).astype(float)
    camera.dark = True
    assert camera.grab(above()).max() < 15
    camera.dark, camera.defocus_px = False, 6.0
    soft = camera.grab(above()).astype(float)
    assert (
        np.abs(np.diff(cv2.blur(soft, (3, 3)), axis=1)).max()
        < 0.4 * np.abs(np.diff(cv2.blur(good, (3, 3)), axis=1)).max()
    )
    ball = OccluderPlant(position_m=(0.05, 0.02, 0.1), radius_m=0.1)
    hidden = SimCamera(plant(occluders=(ball,))).grab(above())
    assert hidden[100:150, 140:180].mean() < 0.8 * good[100:150, 140:180].mean()
    moved = MarkerPlant(id=3, size_m=0.3, position_m=STILL, moves_after_image=1)
    pushed = SimCamera(plant(markers=(moved,)))
    places = [corners_of(pushed, pushed.grab(above())) for _ in range(2)]
    assert (places[1] - places[0])[:, 0].mean() == pytest.approx(0.05 * 280.0 / 1.2, abs=0.5)


def test_faults_of_the_plant_affect_only_their_images(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(
        "seed = 3\n[camera]\nsamples = 4\n"
        + "".join(
            f'[[camera.faults]]\nkind = "{kind}"\nfrom_image = {k}\nimages = {count}\n'
            for kind, k, count in (("dark", 1, 1), ("defocus", 2, 1), ("unplugged", 3, 2))
        )
    )
    faults = CameraPlant.load_file(path).faults
    camera, whole = SimCamera(plant(faults=faults)), SimCamera(plant())
    images = []
    for _ in range(6):
        reference = whole.grab(above())
        if camera.skip_unplugged():
            images.append(None)
        else:
            images.append(camera.grab(above()))
    assert [image is None for image in images] == [False, False, False, True, True, False]
    good, dark, soft, last = (image.astype(float) for image in images if image is not None)
    assert dark.max() < 15 < good.max()
    edges = [np.abs(np.diff(cv2.blur(x, (3, 3)), axis=1)).max() for x in (soft, good)]
    assert edges[0] < 0.4 * edges[1]
    np.testing.assert_array_equal(last, reference)


def test_sheets_are_printed_with_the_errors_of_the_plant() -> None:
    printing = PrintPlant(scale_error=0.01, scale_sigma=0.0, bend_sigma_m=0.0)
    (true,), (flat,) = build_scene(plant(printing=printing)), build_scene(plant())
    assert true.half_m[0] == pytest.approx(1.01 * flat.half_m[0])
    with pytest.raises(SimulatorError, match="marker 100; allowed: 0 to 99"):
        build_scene(plant(markers=(MarkerPlant(id=100, size_m=0.1, position_m=STILL),)))
    assert len(build_scene(CameraPlant())) == 42
