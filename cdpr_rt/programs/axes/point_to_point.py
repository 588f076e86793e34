"""Synchronised point-to-point motion of all axes."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.motion.approach import approach
from cdpr_rt.programs.model import AxesModel

_LEAST_SHARE = 1e-6
_LEAST_DISTANCE_RAD = 1e-9
"""Shorter moves are not synchronised: ratios of their distances may overflow."""


class PointToPoint:
    """Takes the set-points to a target; axes that start from standstill arrive together.

    The path is then the straight line from start to target. Axes that are moving already go on
    within the bounds of each.
    """

    def __init__(self, model: AxesModel) -> None:
        self._model = model
        self.target_rad = np.zeros(model.n)
        self._distance = np.zeros(model.n)
        self._speed = np.ones(model.n)
        self._acceleration = np.ones(model.n)

    def stay(self, setpoint: Setpoint) -> None:
        """Make the present set-point the target."""
        self.target_rad[:] = setpoint.position_rad
        self._distance[:] = 0.0

    def set_out(self, target_rad: FloatArray, setpoint: Setpoint, speed_rad_s: FloatArray) -> None:
        """Go to `target_rad` (n,) at `speed_rad_s` (n,) at the most."""
        self.target_rad[:] = target_rad
        self._distance[:] = np.abs(target_rad - setpoint.position_rad)
        self._speed[:] = speed_rad_s
        self._acceleration[:] = self._model.acceleration_rad_s2
        if self._distance.max() > _LEAST_DISTANCE_RAD and not setpoint.velocity_rad_s.any():
            distance = np.maximum(self._distance, _LEAST_SHARE * self._distance.max())
            self._speed[:] = distance * np.min(speed_rad_s / distance)
            self._acceleration[:] = distance * np.min(self._model.acceleration_rad_s2 / distance)

    def move(self, setpoint: Setpoint) -> bool:
        """Write the next set-point; return whether it has arrived."""
        bounds = self._speed, self._acceleration, self._model.period_s
        return bool(approach(self.target_rad, *bounds, *setpoint.arrays))

    def part_done(self, setpoint: Setpoint) -> float:
        """Return the share of the distance that has been covered, 0 to 1."""
        whole = float(self._distance.max())
        left = float(np.abs(self.target_rad - setpoint.position_rad).max())
        return 1.0 if whole == 0.0 else min(max(1.0 - left / whole, 0.0), 1.0)
