"""Set-points over time: a move with a trapezoidal velocity profile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.jit import bound, bound_to, jit


@jit
def _fill(
    start: FloatArray,
    velocity: FloatArray,
    ramp_s: float,
    cruise_s: float,
    position: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    t: float,
) -> None:
    end = cruise_s + 2.0 * ramp_s
    # travelled and shape are in units of the cruising velocity: one profile serves all axes
    if t <= 0.0:
        travelled, shape, slope = 0.0, 0.0, 0.0
    elif t < ramp_s:
        travelled, shape, slope = 0.5 * t * t / ramp_s, t / ramp_s, 1.0 / ramp_s
    elif t <= ramp_s + cruise_s:
        travelled, shape, slope = t - 0.5 * ramp_s, 1.0, 0.0
    elif t < end:
        left = end - t
        travelled = cruise_s + ramp_s - 0.5 * left * left / ramp_s
        shape, slope = left / ramp_s, -1.0 / ramp_s
    else:
        travelled, shape, slope = cruise_s + ramp_s, 0.0, 0.0
    for i in range(start.size):
        position[i] = start[i] + velocity[i] * travelled
        speed[i] = velocity[i] * shape
        acceleration[i] = velocity[i] * slope


class Motion(Protocol):
    """A set-point over time, such as a `TrapezoidalMove`."""

    duration_s: float

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s` after the start."""

    def brake(self, time_s: float) -> Motion:
        """Return the motion whose second half stops from the state at `time_s`; skip its first."""


class TrapezoidalMove:
    """A move of n axes at constant velocity, with a linear velocity ramp before and after.

    Parameters: `start_rad` (n,) and `velocity_rad_s` (n,), signed; `cruise_s` seconds at full
    velocity; `ramp_s` seconds for each ramp, positive; `settle_s` for which it stays at its end.
    """

    def __init__(
        self,
        start_rad: FloatArray,
        velocity_rad_s: FloatArray,
        cruise_s: float,
        ramp_s: float,
        settle_s: float = 0.0,
    ) -> None:
        if ramp_s <= 0.0 or cruise_s < 0.0:
            raise ValueError(f"ramp_s {ramp_s} must be positive, cruise_s {cruise_s} not negative")
        self.start_rad = np.array(start_rad, float)
        self.velocity_rad_s = np.array(velocity_rad_s, float)
        self.cruise_s = float(cruise_s)
        self.ramp_s = float(ramp_s)
        self.duration_s = self.cruise_s + 2.0 * self.ramp_s + settle_s
        self._kernel = bound_to(self._bind)

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s` after the move's start."""
        self._kernel(setpoint)(time_s)

    def _bind(self, setpoint: Setpoint) -> Callable[[float], None]:
        own = self.start_rad, self.velocity_rad_s, self.ramp_s, self.cruise_s
        return bound(_fill, *own, *setpoint.arrays, then=(0.0,))

    def end_rad(self) -> FloatArray:
        """Return where the move ends, (n,)."""
        return self.start_rad + self.velocity_rad_s * (self.cruise_s + self.ramp_s)

    def brake(self, time_s: float) -> TrapezoidalMove:
        """Return the move whose second ramp, from `ramp_s` on, stops the motion at `time_s`."""
        now = Setpoint(self.start_rad.size)
        self.fill(time_s, now)
        start = now.position_rad - 0.5 * self.ramp_s * now.velocity_rad_s
        return TrapezoidalMove(start, now.velocity_rad_s, 0.0, self.ramp_s)


class Hold(TrapezoidalMove):
    """Standing still at `position_rad` (n,) for `duration_s`."""

    def __init__(self, position_rad: FloatArray, duration_s: float) -> None:
        half = 0.5 * duration_s
        super().__init__(position_rad, np.zeros_like(np.asarray(position_rad, float)), 0.0, half)
