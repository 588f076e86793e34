"""What the operator sees: pictures of the platform, some time after they were taken."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from cdpr_rt.exchange import FloatArray
from tools.experiment.parameters import OperatorParameters

_REMEMBERED = 64


@dataclass(frozen=True)
class Picture:
    """Where the platform was when it was taken, (2,), true; nobody sees it that well."""

    taken_s: float
    platform_m: FloatArray


class Eyes:
    """Sees pictures `delay_s` after they were taken, in pixels, of two cameras.

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
        self._taken: deque[Picture] = deque()
        self._next_s = 0.0
        self.seen: deque[Picture] = deque(maxlen=_REMEMBERED)
        """The pictures that have arrived, the newest last."""

    def show(self, time_s: float, platform_m: FloatArray) -> None:
        """Take a picture if the next is due, and let the operator see what has arrived."""
        if time_s >= self._next_s - 1e-9:
            self._next_s = time_s + self._p.frame_s
            self._taken.append(Picture(time_s, platform_m.copy()))
        while self._taken and self._taken[0].taken_s <= time_s - self.delay_s + 1e-9:
            self.seen.append(self._taken.popleft())

    def since(self, time_s: float) -> list[Picture]:
        """Return the pictures seen that were taken at `time_s` or later."""
        return [picture for picture in self.seen if picture.taken_s >= time_s - 1e-9]

    def judge(self, pictures: list[Picture], target_m: FloatArray) -> FloatArray:
        """Return the way from the platform to the target as it appears, (2,)."""
        offs = target_m - np.array([picture.platform_m for picture in pictures])
        near = bool(np.all(np.abs(offs[-1]) < self._p.sight_reach_m))
        pixel = self._p.sight_pixel_m if near else self._p.overview_pixel_m
        seen = (np.round(offs / pixel) * pixel).mean(axis=0)
        return np.asarray(seen + pixel * self._random.standard_normal(2))
