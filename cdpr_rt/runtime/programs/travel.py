"""Ways of all axes to their targets."""

from __future__ import annotations

import numpy as np

from cdpr_rt.approach import approach
from cdpr_rt.exchange import FloatArray, Setpoint
from cdpr_rt.runtime.programs.model import RobotModel

_LEAST_SHARE = 1e-6
_LEAST_WAY_RAD = 1e-9
"""Below that nobody sees who arrives first, and shares of it may exceed what a float holds."""


class Travel:
    """Takes the set-point to a target; axes that set out from standstill arrive together.

    Then all keep to the straight line between start and target. Axes that are moving already go
    on within the bounds of each.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self.target_rad = np.zeros(model.n)
        self._way = np.zeros(model.n)
        self._speed = np.ones(model.n)
        self._acceleration = np.ones(model.n)

    def stay(self, setpoint: Setpoint) -> None:
        """Have the target where the set-point is."""
        self.target_rad[:] = setpoint.position_rad
        self._way[:] = 0.0

    def set_out(self, target_rad: FloatArray, setpoint: Setpoint, speed_rad_s: FloatArray) -> None:
        """Go to `target_rad` (n,) at `speed_rad_s` (n,) at the most."""
        self.target_rad[:] = target_rad
        self._way[:] = np.abs(target_rad - setpoint.position_rad)
        self._speed[:] = speed_rad_s
        self._acceleration[:] = self._model.acceleration_rad_s2
        if self._way.max() > _LEAST_WAY_RAD and not setpoint.velocity_rad_s.any():
            way = np.maximum(self._way, _LEAST_SHARE * self._way.max())
            self._speed[:] = way * np.min(speed_rad_s / way)
            self._acceleration[:] = way * np.min(self._model.acceleration_rad_s2 / way)

    def move(self, setpoint: Setpoint) -> bool:
        """Write the next set-point; return whether it has arrived."""
        return bool(
            approach(
                self.target_rad,
                self._speed,
                self._acceleration,
                self._model.period_s,
                setpoint.position_rad,
                setpoint.velocity_rad_s,
                setpoint.acceleration_rad_s2,
            )
        )

    def part_done(self, setpoint: Setpoint) -> float:
        """Return how much of the way has been run, from 0 to 1."""
        whole = float(self._way.max())
        left = float(np.abs(self.target_rad - setpoint.position_rad).max())
        return 1.0 if whole == 0.0 else min(max(1.0 - left / whole, 0.0), 1.0)
