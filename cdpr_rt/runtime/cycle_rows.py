"""Writes the row of each cycle straight into the shared ring."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from cdpr_rt.cycle import Cycle
from cdpr_rt.exchange import BoolArray, FloatArray, Setpoint, WordArray
from cdpr_rt.jit import jit
from cdpr_rt.runtime.estimate import AxisEstimate
from cdpr_rt.runtime.programs.base import Program
from cdpr_rt.runtime.shared_block import RowWriter, SharedBlock

_SCALARS = struct.Struct("<QdqdddQQdQBBBBhH")
_UNKNOWN = np.full(7, np.nan)


@jit
def _fill(
    rows: Any,
    k: int,
    pose: FloatArray,
    pose_setpoint: FloatArray,
    setpoint: FloatArray,
    setpoint_velocity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    actual: FloatArray,
    asked: FloatArray,
    sent: FloatArray,
    effort: FloatArray,
    compensation: FloatArray,
    tension: FloatArray,
    length: FloatArray,
    index: FloatArray,
    statusword: WordArray,
    valid: BoolArray,
    alive: BoolArray,
    rate_ok: BoolArray,
    index_known: BoolArray,
    measured: BoolArray,
) -> None:
    row = rows[k]
    for i in range(position.size):
        row.setpoint_rad[i] = setpoint[i]
        row.setpoint_velocity_rad_s[i] = setpoint_velocity[i]
        row.position_rad[i] = position[i]
        row.velocity_rad_s[i] = velocity[i]
        row.torque_actual_Nm[i] = actual[i]
        row.torque_asked_Nm[i] = asked[i]
        row.torque_sent_Nm[i] = sent[i]
        row.effort_Nm[i] = effort[i]
        row.compensation_Nm[i] = compensation[i]
        row.tension_N[i] = tension[i]
        row.cable_length_m[i] = length[i]
        row.index_rad[i] = index[i]
        row.statusword[i] = statusword[i]
        row.valid[i] = valid[i]
        row.alive[i] = alive[i]
        row.rate_ok[i] = rate_ok[i]
        row.index_known[i] = index_known[i]
        row.tension_measured[i] = measured[i]
    for i in range(7):
        row.pose[i] = pose[i]
        row.pose_setpoint[i] = pose_setpoint[i]


def _with_bytes(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type of a row with its flags as bytes, since kernels know no arrays of flags."""
    fields: list[Any] = []
    for name in dtype.names or ():
        kind, shape = dtype[name].base, dtype[name].shape
        fields.append((name, np.uint8 if kind == np.bool_ else kind, shape))
    return np.dtype(fields)


class CycleRows:
    """One row a cycle, filled where it lies; nothing is allocated.

    The scalars, which come first in a row, are packed at once.
    """

    def __init__(self, block: SharedBlock) -> None:
        self._writer = RowWriter(block)
        self._raw = memoryview(block.rows.view(np.uint8).data)
        self._rows = block.rows.view(_with_bytes(block.rows.dtype))
        self._size = block.rows.dtype.itemsize
        self._capacity = block.capacity
        self._written = int(block.counters["rows"][0])
        n = block.n
        self._axes: Any = (
            *(np.zeros(n) for _ in range(12)),
            np.zeros(n, np.uint16),
            *(np.zeros(n, np.bool_) for _ in range(5)),
        )
        # compiled here, not in a cycle; the next row to be written takes this one's place
        _fill(self._rows, self._written % self._capacity, _UNKNOWN, _UNKNOWN, *self._axes)

    def follow(
        self,
        cycle: Cycle,
        setpoint: Setpoint,
        estimate: AxisEstimate,
        program: Program,
        asked_Nm: FloatArray,
    ) -> None:
        """Take the axes' values from these arrays from now on; `asked_Nm` before its limits."""
        feedback, command = cycle.device.feedback, cycle.device.command
        self._axes = (
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            feedback.position_rad,
            estimate.velocity_rad_s,
            feedback.torque_Nm,
            asked_Nm,
            command.sent_torque_Nm,
            program.controller.effort_Nm,
            program.controller.compensation_Nm,
            estimate.tension_N,
            estimate.cable_length_m,
            feedback.index_rad,
            feedback.statusword,
            feedback.valid,
            feedback.alive,
            feedback.rate_ok,
            feedback.index_known,
            estimate.tension_measured,
        )

    def write(self, program: Program, *scalars: float) -> None:
        """Write and publish one row; `scalars` are a row's first fields, in their order."""
        k = self._written % self._capacity
        _SCALARS.pack_into(self._raw, k * self._size, *scalars)
        pose, wanted = program.pose, program.pose_setpoint
        _fill(
            self._rows,
            k,
            _UNKNOWN if pose is None else pose,
            _UNKNOWN if wanted is None else wanted,
            *self._axes,
        )
        self._written += 1
        self._writer.commit()
