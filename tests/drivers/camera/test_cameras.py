"""Folders, videos, streams and simulated cameras behind one interface, and their errors."""

from __future__ import annotations

import io
import multiprocessing
import sys
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any
from unittest import mock

import cv2
import numpy as np
import pytest

from cdpr_drivers.camera.camera import CameraError, grey, open_camera
from cdpr_drivers.camera.opencv_camera import OpencvCamera
from cdpr_rt.core.clock import LockstepClock
from cdpr_sim_bus.camera.camera_server import CameraServer
from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_sim_bus.physics_board import PhysicsBoard, PlatformState
from cdpr_sim_bus.robot.camera_plant import CameraFaultPlant, CameraPlant, LensPlant

TINY = CameraPlant(
    samples=4,
    lens=LensPlant(width_px=80, height_px=64, focal_px=(70.0, 70.0), centre_px=(40.0, 32.0)),
    faults=(CameraFaultPlant(kind="unplugged", from_image=2),),
)
LEVEL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def write_images(folder: Path, count: int) -> None:
    folder.mkdir(exist_ok=True)
    for k in range(count):
        cv2.imwrite(str(folder / f"{k + 1}.png"), np.full((64, 80), 10 * k, np.uint8))


def test_a_folder_is_read_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    write_images(tmp_path / "images", 12)
    (tmp_path / "images" / "notes.txt").write_text("none of them")
    with open_camera(f"folder:{tmp_path / 'images'}", LockstepClock()) as camera:
        names = []
        while (image := camera.grab()) is not None:
            names.append(image.name)
            assert image.pixels.shape == (64, 80)
    assert names == [f"{k + 1}.png" for k in range(12)]


def test_a_video_is_read_by_opencv_and_its_end_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (80, 64))
    for level in (40, 200):
        writer.write(np.full((64, 80, 3), level, np.uint8))
    writer.release()
    with open_camera(f"opencv:{path}", LockstepClock()) as camera:
        first, second = camera.grab(), camera.grab()
        assert first is not None and second is not None
        assert abs(int(first.pixels.mean()) - 40) < 5 < second.pixels.mean() - 150
        with pytest.raises(CameraError, match="sends no more images: it was unplugged"):
            camera.grab()


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("webcam", "allowed: opencv:0 or"),
        ("folder:", "allowed: opencv:0 or"),
        ("folder:/nowhere/at/all", "No such file"),
        ("opencv:/nowhere.avi", "cannot be opened"),
        ("sim:/nowhere.sock", "`cdpr sim camera` starts one"),
    ],
)
def test_a_camera_that_cannot_be_opened_is_reported(url: str, said: str) -> None:
    with pytest.raises(CameraError, match=said):
        open_camera(url, LockstepClock())


def test_error_for_a_missing_library_names_its_extra() -> None:
    with (
        mock.patch.dict(sys.modules, {"harvesters": None, "harvesters.core": None}),
        pytest.raises(CameraError, match=r"pip install 'cdpr-rt\[genicam\]'"),
    ):
        open_camera("genicam:/opt/some.cti", LockstepClock())


def test_error_for_an_invalid_image_names_its_file(tmp_path: Path) -> None:
    (tmp_path / "1.png").write_bytes(b"not a picture")
    with (
        open_camera(f"folder:{tmp_path}", LockstepClock()) as camera,
        pytest.raises(CameraError, match=r"1\.png: cannot be decoded"),
    ):
        camera.grab()
    with pytest.raises(CameraError, match="allowed: grey, or 3 colours"):
        grey(np.zeros((4, 4, 2), np.uint8), "x")


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_images_of_up_to_16_bits_are_reduced_to_their_upper_8_bits(
    tmp_path: Path, bits: int
) -> None:
    pixels = np.linspace(0, (1 << bits) - 1, 80 * 64).reshape(64, 80).astype(np.uint16)
    cv2.imwrite(str(tmp_path / "1.png"), np.tile(pixels, (4, 4)))
    defective = np.tile(pixels, (4, 4))
    defective[100, 100] = 65535
    cv2.imwrite(str(tmp_path / "2.png"), defective)
    expected = np.tile(pixels >> (bits - 8), (4, 4)).astype(int)
    with open_camera(f"folder:{tmp_path}", LockstepClock()) as camera:
        image, other = camera.grab(), camera.grab()
    assert image is not None and image.pixels.dtype == np.uint8 and other is not None
    np.testing.assert_array_equal(image.pixels, expected)
    assert (other.pixels != expected).sum() <= 1 and other.pixels[100, 100] == 255


def test_a_dark_16_bit_image_stays_dark_after_a_bright_one(tmp_path: Path) -> None:
    pixels = np.linspace(0, 4095, 80 * 64).reshape(64, 80).astype(np.uint16)
    for name, share in (("1", 16), ("2", 1), ("4", 16)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), pixels // share)
    (tmp_path / "3.png").write_bytes(b"not a picture")
    with open_camera(f"folder:{tmp_path}", LockstepClock()) as camera:
        dark, bright = camera.grab(), camera.grab()
        assert dark is not None and bright is not None
        np.testing.assert_array_equal(dark.pixels, pixels // 16 // 16)
        np.testing.assert_array_equal(bright.pixels, pixels // 16)
        with pytest.raises(CameraError, match=r"3\.png: cannot be decoded"):
            camera.grab()
        last = camera.grab()
    assert last is not None and last.pixels.max() == 15


def test_the_exif_orientation_of_an_image_is_ignored(tmp_path: Path) -> None:
    _, coded = cv2.imencode(".jpg", np.full((64, 80, 3), 90, np.uint8))
    turned = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    data = coded.tobytes()
    marked = data[:2] + b"\xff\xe1" + (len(turned) + 2).to_bytes(2, "big") + turned + data[2:]
    assert cv2.imdecode(np.frombuffer(marked, np.uint8), cv2.IMREAD_COLOR).shape[:2] == (80, 64)
    (tmp_path / "1.jpg").write_bytes(marked)
    cv2.imwrite(
        str(tmp_path / "2.png"), np.full((64, 80, 4), 90, np.uint8)
    )  # with an alpha channel
    cv2.imwrite(str(tmp_path / "3.tif"), np.full((64, 80), 0.5, np.float32))
    with open_camera(f"folder:{tmp_path}", LockstepClock()) as camera:
        for _ in range(2):
            image = camera.grab()
            assert image is not None and image.pixels.shape == (64, 80)
            assert abs(image.pixels.astype(int) - 90).max() <= 1
        with pytest.raises(CameraError, match="pixels of float32; allowed: 8 or 16 bits"):
            camera.grab()


class Stream:
    """Stand-in for cv2.VideoCapture on a stream: five images wait, each further one takes 40 ms."""

    def __init__(self) -> None:
        self.now_s, self._taken = 0.0, 0

    isOpened = set = lambda *_: True

    def grab(self) -> bool:
        self._taken += 1
        self.now_s += 0.04 if self._taken > 5 else 0.0001
        return True

    def read(self) -> tuple[bool, Any]:
        return self.grab(), np.full((4, 4), self._taken, np.uint8)


def test_buffered_frames_are_not_used_as_current_images() -> None:
    stream: Any = Stream()
    with mock.patch.object(cv2, "VideoCapture", lambda _: stream):
        assert OpencvCamera("rtsp://10.0.0.9/stream", stream).grab().pixels[0, 0] > 5


def test_error_for_a_too_large_image_names_its_file(tmp_path: Path) -> None:
    write_images(tmp_path, 1)
    with (
        mock.patch.object(cv2, "imdecode", side_effect=cv2.error("too many pixels")),
        open_camera(f"folder:{tmp_path}", LockstepClock()) as camera,
        pytest.raises(CameraError, match=r"1\.png: cannot be decoded: too many pixels"),
    ):
        camera.grab()


class Told(io.StringIO):
    """Standard output of the server. Its first line shows that the server is ready."""

    def __init__(self, ready: Event) -> None:
        super().__init__()
        self._ready = ready

    def flush(self) -> None:
        if "ready" in self.getvalue():
            self._ready.set()


def serve(board: Path, path: Path, ready: Event) -> None:
    sys.stdout = Told(ready)
    with PhysicsBoard.attach(board) as shared:
        CameraServer(SimCamera(TINY), shared.platform, path).serve(False, {})


def test_a_simulated_camera_shows_the_platform_until_it_is_unplugged(tmp_path: Path) -> None:
    path = tmp_path / "camera"
    with PhysicsBoard.create(tmp_path / "board", 3) as board:
        platform = board.platform
        assert platform.state() is None
        state = PlatformState(2.5, (0.0, 0.1, 1.5), LEVEL, (0.0,) * 3, (0.0,) * 3)
        platform.publish(state)
        assert platform.state() == state
        context = multiprocessing.get_context(
            "spawn"
        )  # a fork could hang because OpenCV runs threads
        ready = context.Event()
        server = context.Process(target=serve, args=(tmp_path / "board", path, ready))
        server.start()
        clock = LockstepClock()
        assert ready.wait(60.0)
        with open_camera(f"sim:{path}", clock) as camera:
            image = camera.grab()
            assert image is not None
            assert image.device_time_s == 2.5
            platform.publish(state._replace(time_s=3.0, position_m=(0.0, 0.1, 1.3)))
            np.testing.assert_array_equal(
                image.pixels, SimCamera(TINY).grab(state), "the same seed, the same image"
            )
            later = camera.grab()
            assert later is not None
            assert later.device_time_s == 3.0
            assert np.abs(later.pixels.astype(float) - image.pixels).max() > 50
            with pytest.raises(CameraError, match=r"sends no more images.*unplugged\?"):
                camera.grab()
        with open_camera(f"sim:{path}", clock) as camera:  # plugged in again
            again = camera.grab()
            assert again is not None and again.device_time_s == 3.0
            server.terminate()
            server.join()
            with pytest.raises(CameraError, match=r"sends no more images.*unplugged\?"):
                camera.grab()
    assert not path.exists()
