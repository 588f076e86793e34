"""Cameras that OpenCV reads: V4L2 devices by number or path, streams and videos by URL."""

from __future__ import annotations

import cv2

from cdpr_drivers.camera.camera import Camera, CameraError, Image, grey
from cdpr_rt.core.clock import Clock

# errors are raised here, so the library need not print its own lines on standard error
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

_STREAMS = ("rtsp://", "rtsps://", "rtmp://", "udp://", "rtp://")
_STALE = 4
"""Maximum number of old images that may wait in a V4L2 device."""
_FRESH_S, _MOST_STALE = 0.005, 200
"""Delay after which a delivered image is new; maximum number of older images to skip."""


class OpencvCamera(Camera):
    """`opencv:0` is /dev/video0; anything that is not a number is a path or URL for OpenCV."""

    def __init__(self, place: str, clock: Clock) -> None:
        """Open the camera; raises CameraError."""
        self.name = f"opencv:{place}"
        self._clock = clock
        self._number = 0
        device = place.isdigit() or place.startswith("/dev/")
        self._device, self._stream = device, place.lower().startswith(_STREAMS)
        source = int(place) if place.isdigit() else place
        try:
            self._capture = cv2.VideoCapture(source)
        except cv2.error as error:
            raise CameraError(f"camera {self.name}: {error}") from None
        if not self._capture.isOpened():
            hint = "; `ls /dev/video*` lists the cameras" if device else ""
            raise CameraError(f"camera {self.name} cannot be opened{hint}")
        # by default a driver returns older images first
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def grab(self) -> Image:
        """See `Camera.grab`."""
        self._drop_stale()
        there, pixels = self._capture.read()
        if not there or pixels is None:
            raise CameraError(
                f"camera {self.name} sends no more images: it was unplugged, its stream ended, "
                "or another program uses it"
            )
        self._number += 1
        name = f"image {self._number}"
        return Image(grey(pixels.astype("uint8"), name), self._clock.now_s, None, name)

    def _drop_stale(self) -> None:
        """Discard old images; a stream may have any number waiting."""
        if self._device:
            for _ in range(_STALE):
                self._capture.grab()
        if not self._stream:
            return
        for _ in range(_MOST_STALE):
            asked_s = self._clock.now_s
            if not self._capture.grab() or self._clock.now_s - asked_s > _FRESH_S:
                break

    def close(self) -> None:
        """See `Camera.close`."""
        self._capture.release()
