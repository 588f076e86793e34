"""What every camera can do, and the image it gives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.errors import DriverError


class CameraError(DriverError):
    """A camera cannot be found, opened or used any more; the message names it and what helps."""


@dataclass(frozen=True)
class Image:
    """One image and when it was taken."""

    pixels: NDArray[np.uint8]
    """Grey levels (height, width), row by row from above."""
    time_s: float
    """By the clock that the camera was given, when the image had come."""
    device_time_s: float | None
    """By the camera's own clock, where it has one: bus time of a simulated one."""
    name: str
    """Of the image, for messages: a file's, or a number."""


class Camera(ABC):
    """A source of images; open it with `cdpr_drivers.camera.open_camera.open_camera`."""

    name: str
    """What it was opened by."""

    @abstractmethod
    def grab(self) -> Image | None:
        """Return an image taken after the call; None where a folder has no further one.

        Raises CameraError where none comes.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of the camera; safe to repeat."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def grey(pixels: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
    """Return an image's grey levels (height, width); raises CameraError for another kind.

    Colours blue, green, red are weighted 0.114, 0.587 and 0.299 (ITU-R BT.601).
    """
    if pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4):
        raise CameraError(f"{name}: pixels {pixels.shape}; allowed: grey, or 3 colours")
    if pixels.shape[2] == 1:
        return np.ascontiguousarray(pixels[:, :, 0])
    levels: NDArray[np.float64] = pixels[:, :, :3] @ np.array([0.114, 0.587, 0.299])
    return np.rint(levels).astype(np.uint8)
