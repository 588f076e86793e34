"""What the operator leads: a real robot, or one that does exactly what the hand does."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.approach import approach
from cdpr_rt.motion.stream_buttons import CLUTCH

_PERIOD_S = 0.005


class TeleoperatedRobot(Protocol):
    """A robot that takes a hand's packets; it moves on only in `advance`."""

    @property
    def now_s(self) -> float:
        """Its time."""
        ...

    @property
    def cycle(self) -> int:
        """Number of the present cycle."""
        ...

    @property
    def truth_m(self) -> FloatArray:
        """Where its platform really is, (2,)."""
        ...

    def advance(self, until_s: float) -> None:
        """Let time pass."""
        ...

    def send(self, sent_s: float, hand_m: FloatArray, scale: float, buttons: int) -> None:
        """Take a packet that arrives now and was sent at `sent_s`."""
        ...


class PerfectRobot:
    """A platform that follows the hand within its speed and acceleration, and errs in nothing.

    As the program `pose` has it, each movement of the hand moves the target by `scale` times as
    much, unless the clutch was pressed at its begin.
    What an operator does with it is the operator's doing alone.
    """

    def __init__(self, platform: Platform, begin_m: FloatArray) -> None:
        self._target = begin_m.copy()
        self._hand: FloatArray | None = None
        self._leads = False
        self._speed = np.full(2, platform.speed_m_s)
        self._acceleration = np.full(2, platform.acceleration_m_s2)
        self._position = begin_m.copy()
        self._velocity, self._slope = np.zeros(2), np.zeros(2)
        self.track_m: list[tuple[float, float]] = [(float(begin_m[0]), float(begin_m[1]))]
        """Where the platform was in each cycle."""

    @property
    def cycle(self) -> int:
        """Number of the present cycle."""
        return len(self.track_m) - 1

    @property
    def now_s(self) -> float:
        """Its time."""
        return self.cycle * _PERIOD_S

    @property
    def truth_m(self) -> FloatArray:
        """Where its platform is, (2,)."""
        return self._position

    def advance(self, until_s: float) -> None:
        """Let time pass."""
        for _ in range(math.ceil((until_s - 1e-9) / _PERIOD_S) - self.cycle):
            approach(
                self._target,
                self._speed,
                self._acceleration,
                _PERIOD_S,
                self._position,
                self._velocity,
                self._slope,
            )
            self.track_m.append((self._position[0], self._position[1]))

    def send(self, _sent_s: float, hand_m: FloatArray, scale: float, buttons: int) -> None:
        """Take a packet that arrives now."""
        if self._hand is not None and self._leads:
            self._target += scale * (hand_m - self._hand)
        self._hand = hand_m
        self._leads = not buttons & CLUTCH
