"""A camera during a calibration: an image at each pose, kept as a file, and the markers in it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from cdpr_drivers.camera.camera import Camera, CameraError, Image
from cdpr_drivers.camera.open_camera import open_camera
from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.calibration.markers.images.detection import MarkerDetector
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.core.clock import Clock
from cdpr_rt.procedures.calibration.measure_poses import NotThePoseError
from cdpr_tools.errors import BadInputError

_TRIES, _AGAIN_S = 3, 2.0
"""How often an image is asked for, and how long it is waited in between."""
_MOST_BAD = 5


class PoseCamera:
    """Grabs an image where the platform stands, twice more where it is none or shows nothing.

    `wait` lets time pass. Images go into `folder`. Raises CameraError where it cannot be opened.
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
        """Return what is seen at a pose, counted from 1: no markers in an image that is bad.

        Raises CameraError where no image comes, NotThePoseError after five bad ones in turn,
        BadInputError for an image of another size than the intrinsics are of.
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
                f"{self._bad} images in turn are of no use, the last: {seen.problem}; look at the "
                "camera's light, lens and exposure"
            )
        return replace(seen, corners_px={})

    def _tell(self, seen: Sighting) -> None:
        """Say once of each marker what is wrong with it."""
        for markers, what in (
            (seen.repeated, "twice in an image: its id was printed twice; it is left out there"),
            (seen.mirrored, "printed as its mirror image, and is left out"),
        ):
            for text in (f"marker {marker} is {what}" for marker in markers):
                if text not in self._noted:
                    self._noted.add(text)
                    self._note(f"{seen.name}: {text}")

    def _grab(self, left: int) -> Image | None:
        """Return an image; None where the camera has gone and is tried again."""
        try:
            if self._camera is None:
                self._camera = open_camera(self._url, self._clock)
            image = self._camera.grab()
        except CameraError as error:
            self.close()
            if not left:
                raise
            self._note(f"{error}; it is opened again")
            return None
        if image is None:
            raise CameraError(f"camera {self._url}: has no further image")
        if image.pixels.shape[::-1] != self._size:
            width, height = image.pixels.shape[::-1]
            raise BadInputError(
                f"camera {self._url} gives {width} x {height} pixels, the intrinsics are of "
                f"{self._size[0]} x {self._size[1]}: another camera, or another resolution"
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
        """Let go of the camera; safe to repeat."""
        camera, self._camera = self._camera, None
        if camera is not None:
            with suppress(CameraError):
                camera.close()
