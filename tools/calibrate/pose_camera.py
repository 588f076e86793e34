"""The camera of a calibration: store an image of each pose and detect the markers in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, Image, open_camera
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets, MarkerSize
from cdpr_rt.calibration.marker_detection import Board, MarkerDetector, fit_intrinsics
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import CameraSetup
from cdpr_rt.core.clock import Clock
from cdpr_sim_bus.camera.sim_camera import Box, SimCamera, random_poses
from cdpr_sim_bus.robot.camera_plant import DEFAULT_SCENE, BoardPlant, CameraPlant, MountPlant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.calibrate.measure_poses import NotThePoseError
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output

_TRIES, _AGAIN_S = 3, 2.0
"""Attempts to take an image, and the wait between them."""
_MOST_BAD = 5


class PoseCamera:
    """Takes an image at each pose; tries again twice if there is no usable image.

    Images go into `folder`. Raises CameraError if the camera cannot be opened.
    """

    def __init__(
        self,
        url: str,
        clock: Clock,
        intrinsics: CameraIntrinsics,
        sheets: MarkerSheets,
        folder: Path,
        note: Callable[[str], None],
    ) -> None:
        self._url, self._clock, self._note = url, clock, note
        self._size = (intrinsics.width_px, intrinsics.height_px)
        self._detector = MarkerDetector(sheets.dictionary)
        self._folder = folder
        self._camera: Camera | None = open_camera(url, clock)
        self._bad = 0
        self._noted: set[str] = set()

    def see(self, number: int, wait: Callable[[float], None]) -> Sighting:
        """Return the markers seen at a pose, counted from 1; none if the image is bad.

        `wait` lets time pass. Raises CameraError if no image comes, NotThePoseError after five bad
        ones in a row, BadInputError if the image size is not that of the intrinsics.
        """
        for left in reversed(range(_TRIES)):
            image = self._grab(left)
            if image is not None:
                seen = self._detector.detect(image.pixels, f"pose {number}", mirrors=True)
                if seen.problem is None or not left:
                    break
            wait(_AGAIN_S)
        assert image is not None  # otherwise the last try has raised
        self._keep(number, image)
        self._tell(seen)
        if seen.problem is None:
            self._bad = 0
            return seen
        self._bad += 1
        self._note(f"pose {number}: its image is not used: {seen.problem}")
        if self._bad >= _MOST_BAD:
            raise NotThePoseError(
                f"{self._bad} images in a row cannot be used, the last: {seen.problem}; check "
                "light, lens and exposure of the camera"
            )
        return replace(seen, corners_px={})

    def _tell(self, seen: Sighting) -> None:
        """Note the problem of each marker, once."""
        for markers, what in (
            (
                seen.repeated,
                "is twice in an image: its id was printed twice; it is left out of that image",
            ),
            (seen.mirrored, "is printed as a mirror image, and is left out"),
        ):
            for text in (f"marker {marker} {what}" for marker in markers):
                if text not in self._noted:
                    self._noted.add(text)
                    self._note(f"{seen.name}: {text}")

    def _grab(self, left: int) -> Image | None:
        """Return an image; None if the camera failed and will be opened again."""
        try:
            if self._camera is None:
                self._camera = open_camera(self._url, self._clock)
            image = self._camera.grab()
        except CameraError as error:
            self.close()
            if not left:
                raise
            self._note(f"{error}; opening it again")
            return None
        if image is None:
            raise CameraError(f"camera {self._url}: has no more images")
        if image.pixels.shape[::-1] != self._size:
            width, height = image.pixels.shape[::-1]
            raise BadInputError(
                f"camera {self._url} gives {width} x {height} pixels, but the intrinsics are "
                f"for {self._size[0]} x {self._size[1]}: is it another camera or resolution?"
            )
        return image

    def _keep(self, number: int, image: Image) -> None:
        path = self._folder / f"pose-{number:04d}.png"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            _, data = cv2.imencode(".png", image.pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])
            path.write_bytes(np.asarray(data).tobytes())
        except OSError as error:
            raise BadInputError(f"{path}: cannot be written: {error.strerror}") from error

    def close(self) -> None:
        """Release the camera; safe to repeat."""
        camera, self._camera = self._camera, None
        if camera is not None:
            with suppress(CameraError):
                camera.close()


# What a calibration knows beforehand about a simulated camera: its lens, fitted to images of a
# board, and the marker sheets.

_BOARD_IMAGES = 30
_BOARD_BOX = Box((-0.08, -0.06, 0.25), (0.08, 0.06, 0.5), 40.0)
"""Camera positions over the board, and the largest tilt."""


def camera_setup(
    out: Output, plant: Path | None, intrinsics: Path | None, markers: Path | None
) -> CameraSetup:
    """Return the camera's setup: intrinsics and sheets from their files, else from the simulation.

    Without a file, intrinsics are fitted as `cdpr camera calibrate` does, to images that the
    simulated camera takes of a board. Dictionary, ids and sizes of the markers are those that were
    ordered from the printer. Raises ProfileError, CalibrationError.
    """
    scene = CameraPlant() if plant is None else RobotPlant.load_file(plant).camera
    lens = CameraIntrinsics.load_file(intrinsics) if intrinsics else _by_board(out, scene)
    sheets = MarkerSheets.load_file(markers) if markers else ordered_sheets(scene)
    return CameraSetup.of(lens, sheets)


def images_of_board(
    out: Output, scene: CameraPlant, count: int = _BOARD_IMAGES
) -> list[tuple[str, NDArray[np.uint8]]]:
    """Return images, with names, that a simulated camera takes of a ChArUco board."""
    before_board = scene.model_copy(
        update={
            "board": BoardPlant(), "grids": (), "markers": (), "occluders": (), "faults": (),
            "mount": MountPlant(position_m=(0.0, 0.0, 0.0)),
        }
    )  # fmt: skip
    with out.stage("camera: starting the simulated camera"):
        camera = SimCamera(before_board)
    images = []
    with out.progress("camera: images of a ChArUco board", float(count)) as advance:
        for k, state in enumerate(random_poses(_BOARD_BOX, count, scene.seed)):
            images.append((f"board {k + 1}", camera.grab(state)))
            advance(k + 1.0)
    return images


def _by_board(out: Output, scene: CameraPlant) -> CameraIntrinsics:
    board, images = BoardPlant(), images_of_board(out, scene)
    known = Board(board.columns, board.rows, board.square_m, board.marker_m, board.dictionary)
    with out.stage("camera: calibrating its lens with these images"):
        found = fit_intrinsics(images, known)
    one = found.intrinsics
    out.say(
        f"camera: intrinsics from {len(found.used)} images of a ChArUco board, corners fit to "
        f"{one.rms_px:.3f} px; focal lengths {one.focal_px[0]:.1f} and {one.focal_px[1]:.1f} px",
        *(f"camera: missing: {text}" for text in found.missing),
    )
    return one


def ordered_sheets(scene: CameraPlant) -> MarkerSheets:
    """Return the sheets as ordered: their positions and printed sizes are not known."""
    grids = scene.grids or (() if scene.markers else DEFAULT_SCENE)
    sizes = [
        (grid.first_id + k, grid.size_m) for grid in grids for k in range(grid.rows * grid.columns)
    ]
    sizes += [(one.id, one.size_m) for one in scene.markers]
    usual = Counter(size for _, size in sizes).most_common(1)[0][0]
    others = sorted({size for _, size in sizes} - {usual})
    return MarkerSheets(
        dictionary=scene.dictionary,
        size_m=usual,
        sizes=tuple(MarkerSize(ids=_ids(sizes, other), size_m=other) for other in others),
        placed=_ids(sizes, None),
    )


def _ids(sizes: list[tuple[int, float]], size_m: float | None) -> tuple[int, ...]:
    """Return the ids of markers of one size (None: all sizes), without repetition."""
    return tuple(sorted({marker for marker, size in sizes if size_m is None or size == size_m}))
