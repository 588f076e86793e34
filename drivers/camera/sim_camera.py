"""Client of the simulated camera, a separate process that answers on a Unix socket."""

from __future__ import annotations

import socket

import numpy as np

from cdpr_drivers.camera.camera import Camera, CameraError, Image
from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.clock import Clock

_TIMEOUT_S = 60.0
_MOST_HEADER, _MOST_PIXELS = 4096, 100_000_000


class SimulatedCamera(Camera):
    """Requests one image at a time; the device time of images is bus time."""

    def __init__(self, place: str, clock: Clock) -> None:
        """Connect; raises CameraError."""
        self.name = f"sim:{place}"
        self._clock = clock
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(_TIMEOUT_S)
        try:
            self._socket.connect(place)
        except OSError as error:
            self._socket.close()
            raise CameraError(
                f"camera {self.name}: {error.strerror or error}; `cdpr sim camera` starts one"
            ) from None
        self._answers = self._socket.makefile("rb")

    def grab(self) -> Image:
        """See `Camera.grab`."""
        try:
            self._socket.sendall(b'{"do": "grab"}\n')
            header = self._answers.readline(_MOST_HEADER)
            if not header:
                raise ConnectionResetError("the connection has ended")
            answer = parse_json(header, self.name)
            if "error" in answer:
                raise CameraError(f"camera {self.name}: {answer['error']}")
            height, width, size = (int(answer[key]) for key in ("height", "width", "bytes"))
            if size != height * width or not 0 < size <= _MOST_PIXELS:
                raise ValueError(f"{width} x {height} pixels in {size} bytes")
            data = self._answers.read(size)
            if len(data) < size:
                raise ConnectionResetError("the connection has ended")
            number, time_s = int(answer["number"]), float(answer["time_s"])
        except OSError as error:
            raise CameraError(
                f"camera {self.name} sends no more images: {error.strerror or error}; is it "
                "unplugged?"
            ) from None
        except (ProfileError, KeyError, ValueError, TypeError) as error:
            raise CameraError(f"camera {self.name} sent an invalid image: {error}") from None
        pixels = np.frombuffer(data, np.uint8).reshape(height, width)
        return Image(pixels, self._clock.now_s, time_s, f"image {number + 1}")

    def close(self) -> None:
        """See `Camera.close`."""
        self._answers.close()
        self._socket.close()
