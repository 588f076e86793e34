"""A folder of image files as a camera: each grab reads the next file, in name order."""

from __future__ import annotations

import io
import math
import re
import warnings
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import PIL.Image
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, Image
from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.clock import Clock

_READ = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
"""Read in sensor orientation, to which the intrinsics belong, even if a phone was rotated."""
_DEPTHS = 8, 10, 12, 14, 16
"""Possible bits of a grey level in 16-bit files."""
_SINGLE = 99.99
"""Percentile of an image's levels that decides the depth; it ignores single defective pixels."""
_MOST_IMAGES = 20_000
_MOST_BYTES = 1 << 28
_MOST_PIXELS = 120_000_000
_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


class FolderCamera(Camera):
    """Reads images in the order of their names, in which numbers count: 9.png is before 10.png."""

    def __init__(self, place: str, clock: Clock) -> None:
        """List the folder; raises CameraError if it has no image."""
        self.name = f"folder:{place}"
        self._clock = clock
        folder = Path(place).expanduser()
        try:
            found = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES]
        except OSError as error:
            raise CameraError(f"folder {folder}: {error.strerror}") from None
        if len(found) > _MOST_IMAGES:
            raise CameraError(f"folder {folder}: {len(found)} images; allowed: {_MOST_IMAGES}")
        if not found:
            allowed = ", ".join(_SUFFIXES)
            raise CameraError(f"folder {folder}: contains no image; allowed: {allowed}")
        self.files = sorted(found, key=_order)
        self._next = 0

    def grab(self) -> Image | None:
        """See `Camera.grab`."""
        if self._next >= len(self.files):
            return None
        path = self.files[self._next]
        self._next += 1
        levels = self._eight_bits(decoded_image(path), f"image {path}")
        return Image(levels, self._clock.now_s, None, path.name)

    def close(self) -> None:
        """See `Camera.close`."""
        self._next = len(self.files)

    def _eight_bits(self, pixels: NDArray[Any], name: str) -> NDArray[np.uint8]:
        """Return 8-bit grey levels; from 16-bit levels, take the upper 8 of the bits in use."""
        if pixels.dtype == np.uint8:
            return np.asarray(pixels, np.uint8)
        if pixels.dtype != np.uint16:
            raise CameraError(f"{name}: pixels of {pixels.dtype}; allowed: 8 or 16 bits")
        return np.asarray(np.minimum(pixels >> (self._bits - 8), 255), np.uint8)

    @cached_property
    def _bits(self) -> int:
        """Bits in use in 16-bit files: the brightest image of the folder decides for all.

        If each image had its own depth, a dark image would become as bright as the others.
        """
        top = 0
        for path in self.files:
            with suppress(CameraError):  # reported when this file is read
                pixels = decoded_image(path)
                if pixels.dtype == np.uint16:
                    top = max(top, int(np.percentile(pixels, _SINGLE)))
        return next(depth for depth in _DEPTHS if top < 1 << depth)


def decoded_image(path: Path) -> NDArray[Any]:
    """Return the grey levels of a file, (height, width).

    Raises CameraError, also if the path is no regular file or the image is too large to decode.
    """
    try:
        data = read_bytes(path, _MOST_BYTES)
    except ProfileError as error:
        raise CameraError(f"image {error}") from None
    _require_size(data, path)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), _READ)
    except cv2.error as error:
        raise CameraError(f"image {path}: cannot be decoded: {error}") from None
    if pixels is None:
        raise CameraError(f"image {path}: cannot be decoded")
    return np.asarray(pixels)


def _require_size(data: bytes, path: Path) -> None:
    """Read the header of an image; raise CameraError if the image has too many pixels.

    OpenCV cannot read only the header. Pillow is installed with Matplotlib.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PIL.Image.DecompressionBombWarning)
        try:
            with PIL.Image.open(io.BytesIO(data)) as image:
                count = math.prod(image.size)
        except PIL.Image.DecompressionBombError:
            count = _MOST_PIXELS + 1
        except (OSError, ValueError, SyntaxError):
            raise CameraError(f"image {path}: cannot be decoded") from None
    if count > _MOST_PIXELS:
        raise CameraError(f"image {path}: too many pixels; allowed: up to {_MOST_PIXELS}")


def _order(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
