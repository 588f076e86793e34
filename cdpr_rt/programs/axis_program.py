"""Base class of the programs that move the set-points of single axes."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.control.pid import Pid
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.motion.trajectory import approach, ramp_velocity
from cdpr_rt.programs.base import BumplessTransfer, CommandedProgram
from cdpr_rt.programs.model import AxesModel


class PositionLoop:
    """One PID for all programs that follow a position; its state survives a change of program."""

    def __init__(self, model: AxesModel) -> None:
        known = None
        if any(axis is not None for axis in model.compensation):
            known = Compensation(list(model.compensation), model.period_s)
        self.controller = Pid(list(model.gains), model.torque_Nm, model.period_s, known)
        self._cycle = -2
        self._torque_Nm = np.zeros(model.n)

    def take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Keep the state if this loop ran in the last cycle, else begin with the torques (n,)."""
        next_cycle = feedback.cycle - self._cycle in (0, 1)
        if not (next_cycle and np.array_equal(torque_Nm, self._torque_Nm)):
            self.controller.take_over(torque_Nm)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""
        self._cycle = feedback.cycle
        self.controller.update(feedback, setpoint, torque_Nm)
        self._torque_Nm[:] = torque_Nm


BumplessController = PositionLoop | BumplessTransfer
"""Controller of the axes, which starts without a torque step."""


class AxisProgram(CommandedProgram):
    """Moves the axes' set-points within the model's bounds.

    An instance of this class is the program `hold`, which brakes moving axes and holds them where
    they come to rest. Subclasses override `_move`, and also `check` and `_apply` if they take
    commands.
    """

    name = "hold"
    needs_lease = False

    def __init__(self, model: AxesModel, loop: BumplessController) -> None:
        self._model = model
        self._loop = loop
        self.controller = loop.controller
        self._setpoint = Setpoint(model.n)
        self._zero_velocity = np.zeros(model.n)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last cycle's set-point and torque, (n,) each."""
        self._setpoint = setpoint
        self._stopping = self._at_rest = False
        self._loop.take_over(feedback, torque_Nm)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        if self._stopping:
            self._at_rest = self._brake(setpoint)
        else:
            self._at_rest = self._move(setpoint)
        self._loop.update(feedback, setpoint, torque_Nm)

    def _move(self, setpoint: Setpoint) -> bool:
        """Write the next set-point; return whether nothing is left to do."""
        return self._brake(setpoint)

    def _brake(self, setpoint: Setpoint) -> bool:
        return self._ramp(self._zero_velocity, setpoint)

    def _ramp(self, velocity_rad_s: FloatArray, setpoint: Setpoint) -> bool:
        """Ramp the set-point's velocity to a given one (n,); return whether all axes rest."""
        model = self._model
        bounds = model.acceleration_rad_s2, model.period_s
        return ramp_velocity(velocity_rad_s, *bounds, *setpoint.arrays)


# Synchronised point-to-point motion of all axes.

_LEAST_SHARE = 1e-6
_LEAST_DISTANCE_RAD = 1e-9
"""Shorter moves are not synchronised, because ratios of their distances may overflow."""


class PointToPoint:
    """Moves the set-points to a target; axes that start from standstill arrive together.

    In this case the path is the straight line from start to target. Axes that are already moving
    continue within their own bounds.
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
        """Start towards `target_rad` (n,), with `speed_rad_s` (n,) at most."""
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
