"""Model of the operator's vision: delayed camera images of the platform."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_tools.experiment.model.parameters import OperatorParameters

_REMEMBERED = 64


@dataclass(frozen=True)
class CameraImage:
    """One image: when it was taken, and the true position (2,) of the platform then."""

    taken_s: float
    platform_m: FloatArray


class VisionModel:
    """Sees the images of two cameras `delay_s` after they were taken, in pixels.

    The sight's camera shows what is near the target, the overview the rest (Tremblay, section
    2.5.1). A judgement is the mean of the pictures looked at, each rounded to whole pixels, and is
    uncertain by a pixel.
    """

    def __init__(
        self, parameters: OperatorParameters, delay_s: float, random: np.random.Generator
    ) -> None:
        self._p = parameters
        self.delay_s = delay_s
        self._random = random
        self._taken: deque[CameraImage] = deque()
        self._next_s = 0.0
        self.seen: deque[CameraImage] = deque(maxlen=_REMEMBERED)
        """The pictures that have arrived, the newest last."""

    def show(self, time_s: float, platform_m: FloatArray) -> None:
        """Take an image if the next is due, and move those that have arrived to `seen`."""
        if time_s >= self._next_s - 1e-9:
            self._next_s = time_s + self._p.frame_s
            self._taken.append(CameraImage(time_s, platform_m.copy()))
        while self._taken and self._taken[0].taken_s <= time_s - self.delay_s + 1e-9:
            self.seen.append(self._taken.popleft())

    def since(self, time_s: float) -> list[CameraImage]:
        """Return the pictures seen that were taken at `time_s` or later."""
        return [picture for picture in self.seen if picture.taken_s >= time_s - 1e-9]

    def judge(self, pictures: list[CameraImage], target_m: FloatArray) -> FloatArray:
        """Return the apparent displacement from the platform to the target, (2,)."""
        offs = target_m - np.array([picture.platform_m for picture in pictures])
        near = bool(np.all(np.abs(offs[-1]) < self._p.sight_reach_m))
        pixel = self._p.sight_pixel_m if near else self._p.overview_pixel_m
        seen = (np.round(offs / pixel) * pixel).mean(axis=0)
        return np.asarray(seen + pixel * self._random.standard_normal(2))
