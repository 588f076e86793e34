"""The interface of all cameras, the images they return, and how to open one by its name."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.errors import DriverError
from cdpr_rt.core.clock import Clock


class CameraError(DriverError):
    """A camera cannot be found, opened or used; the message names it and says what to do."""


@dataclass(frozen=True)
class Image:
    """One image and when it was taken."""

    pixels: NDArray[np.uint8]
    """Grey levels (height, width), rows from top to bottom."""
    time_s: float
    """When the image arrived, by the clock given to the camera."""
    device_time_s: float | None
    """When the image was taken, by the camera's clock, if any; bus time for a simulated camera."""
    name: str
    """Name of the image for messages: a file name, or a number."""


class Camera(ABC):
    """A source of images; open it with `cdpr_drivers.camera.camera.open_camera`."""

    name: str
    """The URL with which the camera was opened."""

    @abstractmethod
    def grab(self) -> Image | None:
        """Return an image taken after the call; None at the end of a folder.

        Raises CameraError if no image arrives.
        """

    @abstractmethod
    def close(self) -> None:
        """Close the camera; safe to repeat."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def grey(pixels: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
    """Return an image's grey levels (height, width); raises CameraError for other kinds of images.

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


# Opening a camera by its name on the command line and in files.

_KINDS = {
    "opencv": ("opencv_camera", "OpencvCamera", "opencv:0 or opencv:rtsp://HOST/PATH"),
    "folder": ("folder_camera", "FolderCamera", "folder:DIRECTORY"),
    "genicam": (
        "genicam_camera",
        "GenicamCamera",
        "genicam:PRODUCER.cti, with #SERIAL for one of several",
    ),
    "sim": ("sim_camera", "SimulatedCamera", "sim:SOCKET"),
}
_EXTRAS = {"cv2": "camera", "harvesters": "genicam", "genicam": "genicam"}


def open_camera(url: str, clock: Clock) -> Camera:
    """Return the opened camera of a URL; `clock` stamps its images. Raises CameraError.

    Only the library of the requested kind is imported.
    """
    kind, colon, place = url.partition(":")
    if not colon or kind not in _KINDS or not place:
        known = "; ".join(example for _, _, example in _KINDS.values())
        raise CameraError(f"camera {url!r}; allowed: {known}")
    module, name, _ = _KINDS[kind]
    try:
        made: Any = getattr(importlib.import_module(f"cdpr_drivers.camera.{module}"), name)
    except ModuleNotFoundError as error:
        extra = _EXTRAS.get((error.name or "").partition(".")[0])
        if extra is None:
            raise
        raise CameraError(
            f"camera {url}: needs {error.name}, which comes with: pip install 'cdpr-rt[{extra}]'"
        ) from None
    camera: Camera = made(place, clock)
    return camera
