"""Filter of a hand's position against tremor."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.core.exchange import FloatArray

_SLOWEST_Hz: Final = 1.0
_PER_SPEED_Hz_s_m: Final = 100.0
_SPEED_CUTOFF_Hz: Final = 1.0


class PositionFilter:
    """The 1-euro filter (Casiez, Roussel & Vogel 2012): a low-pass whose cutoff rises with speed.

    cutoff = 1 Hz + 100 Hz/(m/s)·speed: at rest tremor of 8 to 12 Hz and a button's jolt hardly
    pass; at 0.2 m/s the cutoff is 21 Hz. `update` is called every `period_s`.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last: FloatArray | None = None
        self._speed = np.zeros(2)
        self._filtered = np.zeros(2)

    def update(self, position_m: FloatArray) -> FloatArray:
        """Return the filtered position, (2,), of `position_m` (2,)."""
        if self._last is None:
            self._last = position_m
            self._filtered = position_m.copy()
            return self._filtered
        speed = (position_m - self._last) / self._period_s
        self._last = position_m
        self._speed = self._speed + self._weight(_SPEED_CUTOFF_Hz) * (speed - self._speed)
        cutoff_Hz = _SLOWEST_Hz + _PER_SPEED_Hz_s_m * float(np.hypot(*self._speed))
        self._filtered = self._filtered + self._weight(cutoff_Hz) * (position_m - self._filtered)
        return self._filtered

    def _weight(self, cutoff_Hz: float) -> float:
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff_Hz * self._period_s))
