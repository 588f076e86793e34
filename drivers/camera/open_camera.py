"""Opens a camera by what it is called on the command line and in files."""

from __future__ import annotations

import importlib
from typing import Any

from cdpr_drivers.camera.camera import Camera, CameraError
from cdpr_rt.core.clock import Clock

_KINDS = {
    "opencv": ("opencv_camera", "OpencvCamera", "opencv:0 or opencv:rtsp://HOST/PATH"),
    "folder": ("folder_camera", "FolderCamera", "folder:DIRECTORY"),
    "genicam": ("genicam_camera", "GenicamCamera", "genicam:PRODUCER.cti, with #SERIAL of one"),
    "sim": ("sim_camera", "SimulatedCamera", "sim:SOCKET"),
}
_EXTRAS = {"cv2": "camera", "harvesters": "genicam", "genicam": "genicam"}


def open_camera(url: str, clock: Clock) -> Camera:
    """Return the camera of a URL, opened; `clock` stamps its images. Raises CameraError.

    Only the library of the kind that is asked for is imported.
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
