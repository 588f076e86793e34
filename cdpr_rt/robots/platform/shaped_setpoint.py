"""A platform's set-point, as programs write it and as its control follows it."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import bound
from cdpr_rt.robots.free_rotation import SHAPING_s
from cdpr_rt.robots.platform import loop_kernel as loop


class ShapedSetpoint:
    """Position, velocity and acceleration (d,) of a set-point, and their mean, (3, d)."""

    def __init__(self, home: FloatArray, period_s: float) -> None:
        self.rows, self.shaped = np.zeros((2, 3, home.size))
        """Position, velocity and acceleration, to be written; and their mean over `SHAPING_s`."""
        self._past, self._place = np.zeros((max(1, round(SHAPING_s / period_s)), 3, home.size)), 0
        self._shape = bound(loop.shape, self._past, then=(0, self.rows, self.shaped))
        self.stand_at(home)

    def stand_at(self, position: FloatArray) -> None:
        """Stand at a position (d,), and have stood there before."""
        self.rows[:] = self._past[:] = self.shaped[:] = 0.0
        self.rows[0] = self.shaped[0] = self._past[:, 0] = position

    def shape(self) -> None:
        """Bring the mean up to date, by one cycle."""
        self._place = self._shape(self._place, self.rows, self.shaped)
