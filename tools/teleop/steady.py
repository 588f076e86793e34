"""Takes the trembling out of a hand's position before it is sent."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.exchange import FloatArray

_SLOWEST_Hz: Final = 1.0
_PER_SPEED_Hz_s_m: Final = 100.0
_SPEED_CUTOFF_Hz: Final = 1.0


class SteadyHand:
    """A low-pass whose cutoff rises with the hand's speed: firm at rest, quick on the way.

    The 1-euro filter (Casiez, Roussel & Vogel 2012): 1 Hz at rest, so that tremor of 8 to 12 Hz
    and a button's jolt hardly pass; 21 Hz at 0.2 m/s. It ends where the hand ends, whatever the
    way. `update` is called for each position that is read, `period_s` apart.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last: FloatArray | None = None
        self._speed = np.zeros(2)
        self._steady = np.zeros(2)

    def update(self, position_m: FloatArray) -> FloatArray:
        """Return the steadied position, (2,), of the hand at `position_m` (2,)."""
        if self._last is None:
            self._last = position_m
            self._steady = position_m.copy()
            return self._steady
        speed = (position_m - self._last) / self._period_s
        self._last = position_m
        self._speed = self._speed + self._share(_SPEED_CUTOFF_Hz) * (speed - self._speed)
        cutoff_Hz = _SLOWEST_Hz + _PER_SPEED_Hz_s_m * float(np.hypot(*self._speed))
        self._steady = self._steady + self._share(cutoff_Hz) * (position_m - self._steady)
        return self._steady

    def _share(self, cutoff_Hz: float) -> float:
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff_Hz * self._period_s))
