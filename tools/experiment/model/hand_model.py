"""Model of the operator's hand at the master: intended motion and motor noise."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_tools.experiment.model.parameters import OperatorParameters

_TREMOR_WIDTH_Hz = 4.0
_JOLT_FADES_S = 0.2


class HandModel:
    """A hand with minimum-jerk strokes, tremor, drift, and jolts by a button.

    Strokes after Flash & Hogan (1985); tremor is band noise about `tremor_Hz`, drift first-order
    noise. Advance it by `period_s` with `step`; `measured_m` is the master's reading.
    """

    def __init__(
        self, parameters: OperatorParameters, period_s: float, random: np.random.Generator
    ) -> None:
        self._p = parameters
        self._period_s = period_s
        self._random = random
        self._from = np.zeros(2)
        self._way = np.zeros(2)
        self._began_s = self._lasts_s = 0.0
        self._jolt = np.zeros(2)
        self._jolt_closes_s = -math.inf
        self._time_s = 0.0
        turn = complex(-math.pi * _TREMOR_WIDTH_Hz, 2.0 * math.pi * parameters.tremor_Hz)
        self._tremor_step = np.exp(turn * period_s)
        self._tremor_kick = math.sqrt(1.0 - abs(self._tremor_step) ** 2)
        # a complex process of variance 2 has a real part of variance 1
        self._tremor = self._circular()
        self._drift_step = math.exp(-period_s / parameters.drift_s)
        self._drift = random.standard_normal(2)

    def _circular(self) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
        real, imaginary = self._random.standard_normal((2, 2))
        return np.asarray(real + 1j * imaginary)

    def step(self) -> None:
        """Let one period pass."""
        self._time_s += self._period_s
        self._tremor = self._tremor_step * self._tremor + self._tremor_kick * self._circular()
        kick = math.sqrt(1.0 - self._drift_step**2)
        self._drift = self._drift_step * self._drift + kick * self._random.standard_normal(2)

    @property
    def meant_m(self) -> FloatArray:
        """Where the hand is meant to be, (2,)."""
        if self._lasts_s == 0.0:
            return self._from
        share = min((self._time_s - self._began_s) / self._lasts_s, 1.0)
        return np.asarray(self._from + self._way * _minimum_jerk(share))

    @property
    def measured_m(self) -> FloatArray:
        """Where the master finds it, (2,), in its steps."""
        p = self._p
        really = self.meant_m + p.tremor_m * self._tremor.real + p.drift_m * self._drift
        really = really + self._jolt * self._jolt_share()
        return np.asarray(np.round(really / p.master_step_m) * p.master_step_m)

    @property
    def moves(self) -> bool:
        """Whether a stroke is under way."""
        return self._time_s < self._began_s + self._lasts_s

    def stroke(self, way_m: FloatArray) -> None:
        """Begin to move by `way_m` (2,); it becomes shorter, and ends somewhat beside it."""
        p = self._p
        length = float(np.hypot(*way_m))
        noise = p.amplitude_noise * length * self._random.standard_normal(2)
        self._from = self.meant_m
        self._way = (1.0 - p.undershoot) * way_m + noise
        self._began_s = self._time_s
        self._lasts_s = max(p.shortest_move_s, length / p.hand_speed_m_s)

    def press(self) -> None:
        """Begin to press or release a button, which closes or opens after `press_s`."""
        self._jolt = self._p.press_jolt_m * self._random.standard_normal(2)
        self._jolt_closes_s = self._time_s + self._p.press_s

    def _jolt_share(self) -> float:
        left = self._jolt_closes_s - self._time_s
        if left > 0.0:
            return _minimum_jerk(1.0 - min(left / self._p.press_s, 1.0))
        return math.exp(left / _JOLT_FADES_S)


def _minimum_jerk(share: float) -> float:
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


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
