"""A folder of image files as a camera: each grab reads the next, in the order of their names."""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, Image
from cdpr_rt.core.clock import Clock

_READ = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
"""As the sensor had it: intrinsics are of the sensor, however a telephone was held."""
_DEPTHS = 8, 10, 12, 14, 16
"""Bits of a grey level that files of 16 bits are written with."""
_SINGLE = 99.99
"""Percentile of an image's levels: single pixels that are defective tell no depth."""
_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


class FolderCamera(Camera):
    """Names are ordered with their numbers as numbers: 9.png comes before 10.png."""

    def __init__(self, place: str, clock: Clock) -> None:
        """List the folder; raises CameraError where there is no image in it."""
        self.name = f"folder:{place}"
        self._clock = clock
        folder = Path(place).expanduser()
        try:
            found = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES]
        except OSError as error:
            raise CameraError(f"folder {folder}: {error.strerror}") from None
        if not found:
            allowed = ", ".join(_SUFFIXES)
            raise CameraError(f"folder {folder}: holds no image; allowed: {allowed}")
        self.files = sorted(found, key=_order)
        self._next = 0

    def grab(self) -> Image | None:
        """See `Camera.grab`."""
        if self._next >= len(self.files):
            return None
        path = self.files[self._next]
        self._next += 1
        levels = self._eight_bits(_decoded(path), f"image {path}")
        return Image(levels, self._clock.now_s, None, path.name)

    def close(self) -> None:
        """See `Camera.close`."""
        self._next = len(self.files)

    def _eight_bits(self, pixels: NDArray[Any], name: str) -> NDArray[np.uint8]:
        """Return grey levels of 8 bits, of 16-bit ones the upper 8 of those in use."""
        if pixels.dtype == np.uint8:
            return np.asarray(pixels, np.uint8)
        if pixels.dtype != np.uint16:
            raise CameraError(f"{name}: pixels of {pixels.dtype}; allowed: 8 or 16 bits")
        return np.asarray(np.minimum(pixels >> (self._bits - 8), 255), np.uint8)

    @cached_property
    def _bits(self) -> int:
        """Bits in use of files of 16: the brightest image of the folder tells, for all alike.

        One that is dark would be made as bright as the others by a depth of its own.
        """
        top = 0
        for path in self.files:
            with suppress(CameraError):  # is told once it is that file's turn
                pixels = _decoded(path)
                if pixels.dtype == np.uint16:
                    top = max(top, int(np.percentile(pixels, _SINGLE)))
        return next(depth for depth in _DEPTHS if top < 1 << depth)


def _decoded(path: Path) -> NDArray[Any]:
    """Return the pixels of a file; raises CameraError."""
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise CameraError(f"image {path}: {error.strerror}") from None
    try:
        pixels = cv2.imdecode(data, _READ) if data.size else None
    except cv2.error as error:  # more pixels than the library takes
        raise CameraError(f"image {path}: cannot be decoded: {error}") from None
    if pixels is None:
        raise CameraError(f"image {path}: cannot be decoded")
    return np.asarray(pixels)


def _order(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
