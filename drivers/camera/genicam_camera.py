"""Industrial cameras over GenICam (GigE Vision, USB3 Vision) with the library harvesters.

This was not tested with a real camera, only with those that the library's own producer, viky.cti,
simulates. It needs the vendor's GenTL producer, a file that ends in .cti. If the camera supports
them, it uses Mono8 and the software trigger, so that an image is taken after the request.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from harvesters.core import Harvester
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, Image, grey
from cdpr_rt.core.clock import Clock

_TIMEOUT_S = 5.0
_NS = 1e-9
_TO_GREY = {
    "BayerRG8": cv2.COLOR_BayerRGGB2GRAY, "BayerGR8": cv2.COLOR_BayerGRBG2GRAY,
    "BayerGB8": cv2.COLOR_BayerGBRG2GRAY, "BayerBG8": cv2.COLOR_BayerBGGR2GRAY,
    "RGB8": cv2.COLOR_RGB2GRAY, "BGR8": cv2.COLOR_BGR2GRAY,
    "RGBa8": cv2.COLOR_RGBA2GRAY, "BGRa8": cv2.COLOR_BGRA2GRAY,
}  # fmt: skip
"""Conversion by format name (Pixel Format Naming Convention), which for Bayer formats contains the
first colours of the first row."""


class GenicamCamera(Camera):
    """`genicam:/opt/vendor/producer.cti`, or with #SERIAL the camera with this serial number."""

    def __init__(self, place: str, clock: Clock) -> None:
        """Open the camera; raises CameraError."""
        self.name = f"genicam:{place}"
        self._clock = clock
        self._number = 0
        self._harvester: Any = Harvester()
        producer, _, serial = place.partition("#")
        if not Path(producer).is_file():
            raise CameraError(
                f"camera {self.name}: no file {producer}; it is the GenTL producer of the camera's "
                "vendor, whose name ends in .cti"
            )
        try:
            self._harvester.add_file(producer)
            self._harvester.update()
            self._require_one(serial)
            selection = {"serial_number": serial} if serial else 0
            self._acquirer: Any = self._harvester.create(selection)
            with suppress(Exception):  # another format is reported with the image
                self._acquirer.remote_device.node_map.PixelFormat.value = "Mono8"
            self._triggered = self._use_software_trigger()
            self._acquirer.start()
        except CameraError:
            self._harvester.reset()
            raise
        except Exception as error:  # each producer has its own errors
            self._harvester.reset()
            raise CameraError(
                f"camera {self.name} cannot be opened: {error}; is it used by another program?"
            ) from None

    def _require_one(self, serial: str) -> None:
        there = [str(one.serial_number) for one in self._harvester.device_info_list]
        if not there:
            raise CameraError(
                f"camera {self.name}: the GenTL producer finds no camera; is it plugged in and "
                "powered?"
            )
        if serial and serial not in there:
            raise CameraError(
                f"camera {self.name}: no camera {serial}; allowed: {', '.join(there)}"
            )

    def _use_software_trigger(self) -> bool:
        nodes = self._acquirer.remote_device.node_map
        try:
            nodes.TriggerSelector.value = "FrameStart"
            nodes.TriggerSource.value = "Software"
            nodes.TriggerMode.value = "On"
        except Exception:  # a camera without a trigger stays free-running
            return False
        return True

    def grab(self) -> Image:
        """See `Camera.grab`."""
        try:
            if self._triggered:
                self._acquirer.remote_device.node_map.TriggerSoftware.execute()
            else:
                exposed_before = self._acquirer.fetch(timeout=_TIMEOUT_S)
                if exposed_before is not None:
                    exposed_before.queue()
            buffer = self._acquirer.fetch(timeout=_TIMEOUT_S)
            if buffer is None:
                raise CameraError(
                    f"camera {self.name}: an image was incomplete; is the network overloaded?"
                )
            with buffer:
                component = buffer.payload.components[0]
                pixels = _grey(component, f"camera {self.name}")
                stamp = None
                with suppress(Exception):  # some producers give no time
                    stamp = buffer.timestamp_ns
        except CameraError:
            raise
        except Exception as error:  # each producer has its own errors
            raise CameraError(
                f"camera {self.name} sends no image: {str(error) or type(error).__name__}; is it "
                "unplugged, or used by another program?"
            ) from None
        self._number += 1
        device_s = None if stamp is None else stamp * _NS
        return Image(pixels, self._clock.now_s, device_s, f"image {self._number}")

    def close(self) -> None:
        """See `Camera.close`."""
        with suppress(Exception):  # the camera may be gone already
            self._acquirer.stop()
            self._acquirer.destroy()
        self._harvester.reset()


def _grey(component: Any, name: str) -> NDArray[np.uint8]:
    """Return a component's grey levels (height, width), copied; raises CameraError."""
    data, kind = np.asarray(component.data), str(component.data_format)
    if data.dtype != np.uint8 or kind not in {"Mono8", *_TO_GREY}:
        raise CameraError(
            f"{name}: PixelFormat {kind} of {data.dtype}; allowed: Mono8 ({', '.join(_TO_GREY)}), "
            "set it with the vendor's program"
        )
    levels = data.reshape(component.height, component.width, -1)
    if kind == "Mono8":
        return grey(levels.copy(), name)
    return np.asarray(cv2.cvtColor(levels.squeeze(), _TO_GREY[kind]), np.uint8)
