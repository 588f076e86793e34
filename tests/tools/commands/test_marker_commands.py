"""`cdpr markers`, `cdpr camera` and `cdpr sim photos`."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from cdpr_here import cdpr_here
from matplotlib.backends.backend_agg import FigureCanvasAgg

from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.calibration.marker_detection import Board, MarkerDetector
from cdpr_tools.commands.markers import board_page, marker_page

SCENE = """
samples = 8
[lens]
width_px = 480
height_px = 384
focal_px = [415.0, 416.0]
centre_px = [242.0, 189.0]
[mount]
position_m = [0.0, 0.0, 0.0]
[[grids]]
rows = 3
columns = 3
pitch_m = 0.3
origin_m = [0.0, 0.0, 0.0]
"""
BOX = ("--low", "-0.3 -0.3 0.9", "--high", "0.3 0.3 1.2")


def drawn(figure: object, dots_per_mm: float) -> np.ndarray:
    """Return a page as an image with `dots_per_mm`."""
    figure.set_dpi(25.4 * dots_per_mm)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return cv2.cvtColor(np.asarray(canvas.buffer_rgba()), cv2.COLOR_RGBA2GRAY)


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("photos")
    (folder / "scene.toml").write_text(SCENE)
    done = cdpr_here(
        *("sim", "photos", folder / "images", "--plant", folder / "scene.toml", "--count", "10"),
        *(*BOX, "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["images"] == 10
    return folder / "images"


def test_markers_map_writes_verdict_picture_and_file(photos: Path, tmp_path: Path) -> None:
    done = cdpr_here(
        *("markers", "map", photos, "--size-mm", "150", "--png", tmp_path / "map.png"),
        *("--out", tmp_path / "map.toml", "--json"),
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["ok"] and told["verdict"].startswith("good: 9 markers from 10 images")
    assert told["rms_px"] < 0.2
    assert (tmp_path / "map.png").stat().st_size > 10_000
    written = MarkerSheets.load_file(tmp_path / "map.toml")
    assert len(written.known) == 9
    again = cdpr_here("markers", "map", photos, "--markers", tmp_path / "map.toml", "--json")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout.splitlines()[-1])["scale_to_known"] == pytest.approx(1, abs=1e-3)


def test_intrinsics_of_a_different_lens_are_rejected_with_the_reason(
    photos: Path, tmp_path: Path
) -> None:
    true = CameraIntrinsics.load_file(photos / "camera.toml")
    wrong = true.model_copy(update={"focal_px": tuple(1.05 * f for f in true.focal_px)})
    (tmp_path / "wrong.toml").write_text(wrong.toml_text())
    done = cdpr_here(
        "markers", "map", photos, "--size-mm", "150", "--camera", tmp_path / "wrong.toml"
    )
    assert done.returncode == 1
    assert "the intrinsics do not fit the camera" in done.stdout
    (tmp_path / "small.toml").write_text(true.model_copy(update={"width_px": 640}).toml_text())
    done = cdpr_here(
        "markers", "map", photos, "--size-mm", "150", "--camera", tmp_path / "small.toml"
    )
    assert done.returncode == 2
    assert "has 480 x 384 pixels, but the intrinsics are for 640 x 384" in done.stderr


def test_mirrored_images_are_reported(photos: Path, tmp_path: Path) -> None:
    for path in photos.glob("*.png"):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(tmp_path / path.name), image[:, ::-1])
    done = cdpr_here(
        *("markers", "map", tmp_path, "--size-mm", "150", "--camera", photos / "camera.toml")
    )
    assert done.returncode == 2
    assert "7 are mirror images: are all sheets, or the images, mirrored?" in done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("map", "{photos}"), "--size-mm is missing"),
        (("map", "{photos}", "--size-mm", "150", "--dictionary", "4x4"), "did you mean"),
        (("map", "{photos}", "--size-mm", "150", "--reference", "77"), "is not in the map"),
        (("map", "{photos}", "--size-mm", "150", "--dictionary", "6X6_50"), "markers of 4X4_50"),
        (("map", "/nowhere", "--size-mm", "150"), "a folder with images"),
        (("print", "0-3", "--size-mm", "190"), "150 mm is the largest"),
        (("print", "3-x", "--size-mm", "100"), "allowed: such as 0-39"),
        (("print", "99-100", "--size-mm", "100"), "allowed: 0 to 99"),
        (("print", "0", "--size-mm", "100", "--page", "B7"), "allowed: A4, A3"),
        (("board", "--square-mm", "40"), "does not fit on A4"),
        (("board", "--marker-mm", "28"), "smaller markers"),
    ],
)
def test_invalid_input_is_reported(
    photos: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    done = cdpr_here("markers", *(word.format(photos=photos) for word in words), cwd=tmp_path)
    assert done.returncode == 2, done.stdout
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_sheets_have_true_size_and_are_not_overwritten(tmp_path: Path) -> None:
    target = tmp_path / "sheets.pdf"
    words = ("markers", "print", "0,7", "--size-mm", "120", "--out", target)
    assert cdpr_here(*words).returncode == 0
    pages = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", target.read_bytes())
    assert len(pages) == 2
    np.testing.assert_allclose(np.array(pages, float) / 72.0 * 25.4, [(210.0, 297.0)] * 2, atol=0.1)
    assert cdpr_here(*words).returncode == 2
    sheets = MarkerSheets(size_m=0.12)
    image = drawn(marker_page(sheets, 7, "A4"), 4.0)
    corners = MarkerDetector("4X4_100").detect(image, "page").corners_px[7]
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    np.testing.assert_allclose(sides / 4.0, 120.0, atol=0.05)
    assert corners[0, 0] < corners[1, 0] and corners[0, 1] < corners[3, 1]


def test_a_printed_board_is_detected_with_its_true_size(tmp_path: Path) -> None:
    assert cdpr_here("markers", "board", "--out", tmp_path / "board.pdf").returncode == 0
    board = Board()
    image = drawn(board_page(board, "A4"), 4.0)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board.made()).detectBoard(image)
    assert len(ids) == 40
    on_board, in_image = board.made().matchImagePoints(corners, ids)
    size = np.ptp(in_image.reshape(-1, 2), axis=0) / 4.0
    np.testing.assert_allclose(size, 1e3 * np.ptp(on_board.reshape(-1, 3)[:, :2], axis=0), atol=0.2)


def test_intrinsics_are_computed_from_a_folder_or_its_gaps_reported(tmp_path: Path) -> None:
    scene = SCENE.split("[[grids]]", maxsplit=1)[0] + "[board]\n"
    (tmp_path / "scene.toml").write_text(scene)
    made = cdpr_here(
        *("sim", "photos", tmp_path / "images", "--plant", tmp_path / "scene.toml"),
        *("--count", "8", "--low", "-0.06 -0.05 0.3", "--high", "0.06 0.05 0.5"),
        *("--tilt-deg", "40"),
    )
    assert made.returncode == 0, made.stderr
    done = cdpr_here(
        "camera", "calibrate", tmp_path / "images", "--out", tmp_path / "lens.toml", "--json"
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["rms_px"] < 0.3
    assert any("take 15 or more" in line for line in told["missing"])
    found = CameraIntrinsics.load_file(tmp_path / "lens.toml")
    assert found.focal_px[0] == pytest.approx(415.0, rel=0.02)
    few = cdpr_here("camera", "calibrate", tmp_path, "--out", tmp_path / "few.toml")
    assert few.returncode == 1 and "contains no image" in few.stderr


def test_images_of_a_camera_are_stored_with_their_times(photos: Path, tmp_path: Path) -> None:
    words = ("camera", "grab", f"folder:{photos}", "--count", "3", "--interval-s", "0")
    done = cdpr_here(*words, "--out", tmp_path / "taken", "--json")
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "taken").glob("*.png"))) == 3
    assert len((tmp_path / "taken" / "times.csv").read_text().splitlines()) == 4
    assert cdpr_here(*words, "--out", tmp_path / "taken").returncode == 2
    gone = cdpr_here("camera", "grab", "sim:/nowhere", "--out", tmp_path / "none")
    assert gone.returncode == 1 and "cdpr sim camera" in gone.stderr
