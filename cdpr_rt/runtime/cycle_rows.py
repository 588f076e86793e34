"""Writes the row of each cycle straight into the shared ring."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from cdpr_rt.cycle import Cycle
from cdpr_rt.exchange import FloatArray, Setpoint
from cdpr_rt.runtime.cycle_row import POSES
from cdpr_rt.runtime.estimate import AxisEstimate
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.runtime.shared_block import RowWriter, SharedBlock

_SCALARS = struct.Struct("<QdqdddQQdBBBBhH")
_UNKNOWN = np.full(7, np.nan)


class CycleRows:
    """One row a cycle; every field is an array copied into its place, nothing is allocated.

    The scalars, which come first in a row, are packed at once.
    """

    def __init__(self, block: SharedBlock) -> None:
        self._writer = RowWriter(block)
        self._raw = memoryview(block.rows.view(np.uint8).data)
        self._size = block.rows.dtype.itemsize
        self._capacity = block.capacity
        self._written = int(block.counters["rows"][0])
        self._fields = {name: block.rows[name] for name in block.rows.dtype.names or ()}
        self._axes: list[tuple[Any, Any]] = []
        self._controlled: list[tuple[Any, Any]] = []

    def follow(self, cycle: Cycle, setpoint: Setpoint, estimate: AxisEstimate) -> None:
        """Take the axes' values from these arrays from now on."""
        feedback, command = cycle.device.feedback, cycle.device.command
        sources = {
            "setpoint_rad": setpoint.position_rad,
            "setpoint_velocity_rad_s": setpoint.velocity_rad_s,
            "position_rad": feedback.position_rad,
            "velocity_rad_s": estimate.velocity_rad_s,
            "torque_actual_Nm": feedback.torque_Nm,
            "torque_sent_Nm": command.sent_torque_Nm,
            "tension_N": estimate.tension_N,
            "cable_length_m": estimate.cable_length_m,
            "index_rad": feedback.index_rad,
            "statusword": feedback.statusword,
            "valid": feedback.valid,
            "alive": feedback.alive,
            "rate_ok": feedback.rate_ok,
            "index_known": feedback.index_known,
            "tension_measured": estimate.tension_measured,
        }
        self._axes = [(self._fields[name], source) for name, source in sources.items()]

    def control(self, program: Program, asked_Nm: FloatArray) -> None:
        """Take effort, compensation and the torque asked for from these from now on."""
        self._controlled = [
            (self._fields["torque_asked_Nm"], asked_Nm),
            (self._fields["effort_Nm"], program.controller.effort_Nm),
            (self._fields["compensation_Nm"], program.controller.compensation_Nm),
        ]

    def write(self, program: Program, *scalars: float) -> None:
        """Write and publish one row; `scalars` are a row's first fields, in their order."""
        k = self._written % self._capacity
        _SCALARS.pack_into(self._raw, k * self._size, *scalars)
        for field, source in self._axes:
            field[k] = source
        for field, source in self._controlled:
            field[k] = source
        for name, pose in zip(POSES, (program.pose, program.pose_setpoint), strict=True):
            self._fields[name][k] = _UNKNOWN if pose is None else pose
        self._written += 1
        self._writer.commit()
