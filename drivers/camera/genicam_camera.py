"""Industrial cameras over GenICam (GigE Vision, USB3 Vision) by the library harvesters.

Not tried with a camera: it is written against the library's documentation. It needs the vendor's
GenTL producer, a file that ends in .cti. Software trigger is used where the camera has one, so that
an image is taken after it is asked for.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from harvesters.core import Harvester

from cdpr_drivers.camera.camera import Camera, CameraError, Image, grey
from cdpr_rt.core.clock import Clock

_TIMEOUT_S = 5.0
_NS = 1e-9


class GenicamCamera(Camera):
    """`genicam:/opt/vendor/producer.cti`, or with #SERIAL the camera of this serial number."""

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
            wanted = {"serial_number": serial} if serial else 0
            self._acquirer: Any = self._harvester.create(wanted)
            self._triggered = self._use_software_trigger()
            self._acquirer.start()
        except Exception as error:  # each producer has errors of its own
            self._harvester.reset()
            raise CameraError(f"camera {self.name} cannot be opened: {error}") from None

    def _use_software_trigger(self) -> bool:
        nodes = self._acquirer.remote_device.node_map
        try:
            nodes.TriggerSelector.value = "FrameStart"
            nodes.TriggerSource.value = "Software"
            nodes.TriggerMode.value = "On"
        except Exception:  # a camera without it runs free
            return False
        return True

    def grab(self) -> Image:
        """See `Camera.grab`."""
        try:
            if self._triggered:
                self._acquirer.remote_device.node_map.TriggerSoftware.execute()
            else:
                self._acquirer.fetch(timeout=_TIMEOUT_S).queue()  # exposed before it was asked for
            with self._acquirer.fetch(timeout=_TIMEOUT_S) as buffer:
                component = buffer.payload.components[0]
                shape = (component.height, component.width, -1)
                data = np.asarray(component.data).reshape(shape)
                pixels = data.astype(np.uint8)
                if data.dtype != np.uint8:
                    raise ValueError(f"pixels of {data.dtype}; set PixelFormat to Mono8")
                stamp = buffer.timestamp_ns
        except Exception as error:  # each producer has errors of its own
            raise CameraError(f"camera {self.name} gives no image: {error}") from None
        self._number += 1
        name = f"image {self._number}"
        device_s = None if stamp is None else stamp * _NS
        return Image(grey(pixels, name), self._clock.now_s, device_s, name)

    def close(self) -> None:
        """See `Camera.close`."""
        with suppress(Exception):  # it may have gone already
            self._acquirer.stop()
            self._acquirer.destroy()
        self._harvester.reset()
