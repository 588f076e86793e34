"""The camera of a calibration retries bad images, reports them and finally fails."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, Image
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.core.clock import LockstepClock
from cdpr_tools.calibrate import pose_camera
from cdpr_tools.calibrate.measure_poses import NotThePoseError
from cdpr_tools.calibrate.pose_camera import PoseCamera
from cdpr_tools.errors import BadInputError

LENS = CameraIntrinsics(
    width_px=320, height_px=240, focal_px=(300.0, 300.0), centre_px=(160.0, 120.0)
)
Pixels = NDArray[np.uint8]


def scene(*markers: int) -> Pixels:
    """Return an image of markers in a row."""
    image = np.full((240, 320), 210, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    for k, marker in enumerate(markers):
        image[70:142, 20 + 100 * k : 92 + 100 * k] = cv2.aruco.generateImageMarker(
            dictionary, marker, 72
        )
    return cv2.GaussianBlur(image, (0, 0), 0.6)


GOOD, DARK = scene(3, 7), np.full((240, 320), 5, np.uint8)
BLURRED = cv2.GaussianBlur(GOOD, (0, 0), 12.0)
GONE = None


class Scripted(Camera):
    """Return images one after another. None stands for a disconnected camera."""

    def __init__(self, images: list[Pixels | None]) -> None:
        self.name, self._images = "scripted", images

    def grab(self) -> Image:
        image = self._images.pop(0)
        if image is None:
            raise CameraError("camera scripted sends no more images")
        return Image(image, 0.0, None, "x")

    def close(self) -> None:
        pass


def opened(
    images: Sequence[Pixels | None], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[PoseCamera, list[str], list[str]]:
    """Return a camera with these images, the list of its openings, and its notes."""
    left, opens, said = list(images), [], []

    def open_one(url: str, _: object) -> Camera:
        opens.append(url)
        return Scripted(left)

    monkeypatch.setattr(pose_camera, "open_camera", open_one)
    sheets = MarkerSheets(size_m=0.1)
    camera = PoseCamera("scripted:", LockstepClock(), LENS, sheets, folder / "images", said.append)
    return camera, opens, said


@pytest.mark.parametrize(
    ("images", "waits", "opens"),
    [([GOOD], 0, 1), ([DARK, GOOD], 1, 1), ([BLURRED, DARK, GOOD], 2, 1), ([GONE, GOOD], 1, 2)],
)
def test_a_bad_or_missing_image_is_taken_again(
    images: list[Pixels | None],
    waits: int,
    opens: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    camera, opened_urls, _ = opened(images, tmp_path, monkeypatch)
    waited: list[float] = []
    seen = camera.see(2, waited.append)
    assert sorted(seen.corners_px) == [3, 7] and seen.problem is None
    assert len(waited) == waits and len(opened_urls) == opens
    kept = cv2.imread(str(tmp_path / "images" / "pose-0002.png"), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(kept, GOOD)


def test_one_bad_pose_is_reported_and_five_in_a_row_end_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, _, said = opened([DARK] * 3 + [GOOD] + [DARK] * 15, tmp_path, monkeypatch)
    seen = camera.see(2, lambda _: None)
    assert not seen.corners_px and seen.problem is not None and "black" in seen.problem
    assert "pose 2: its image is not used: black" in said[0]
    assert camera.see(3, lambda _: None).corners_px
    for number in range(4, 8):
        camera.see(number, lambda _: None)
    with pytest.raises(NotThePoseError, match=r"5 images in a row cannot be used.*light, lens"):
        camera.see(8, lambda _: None)


def test_a_camera_that_stays_disconnected_ends_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, opens, said = opened([GOOD] + [GONE] * 3, tmp_path, monkeypatch)
    camera.see(1, lambda _: None)
    with pytest.raises(CameraError, match="no more images"):
        camera.see(2, lambda _: None)
    assert len(opens) == 3 and "opening it again" in said[0]


def test_a_wrong_resolution_and_duplicate_ids_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, _, said = opened([scene(3, 7, 3), scene(3, 7, 3), GOOD[:200]], tmp_path, monkeypatch)
    assert list(camera.see(1, lambda _: None).corners_px) == [7]
    camera.see(2, lambda _: None)
    assert [text for text in said if "twice" in text] == [
        "pose 1: marker 3 is twice in an image: its id was printed twice; it is left out of that "
        "image"
    ]
    with pytest.raises(
        BadInputError, match="320 x 200 pixels, but the intrinsics are for 320 x 240"
    ):
        camera.see(3, lambda _: None)
