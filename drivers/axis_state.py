"""The arrays in which a group of axes keeps its state from cycle to cycle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.exchange import AxisCommand, AxisFeedback
from drivers import axis_codec as codec
from drivers.axis_layout import AxisConfig
from drivers.cia402 import State

NO_MODE = -1000
"""Wanted mode of an axis that was not asked for any."""

_PACED_SILENT_CYCLES = 3
# a heartbeat that is most of a period late is lost: CAN repeats what was disturbed by itself
_HEARTBEAT_PATIENCE = 1.75


class GroupState:
    """State of n axes; `feedback` and `command` are views into the arrays of the kernels."""

    def __init__(self, axes: Sequence[AxisConfig], period_s: float, lockstep: bool) -> None:
        n = len(axes)
        self.ints = ints = np.zeros((codec.INT_ROWS, n), np.int64)
        self.floats = floats = np.zeros((codec.FLOAT_ROWS, n))
        self.flags = flags = np.zeros((codec.FLAG_ROWS, n), np.bool_)
        self.words = np.zeros((1, n), np.uint16)
        self.feedback = AxisFeedback(n)
        self.feedback.position_rad = floats[codec.POSITION_RAD]
        self.feedback.torque_Nm = floats[codec.TORQUE_NM]
        self.feedback.index_rad = floats[codec.INDEX_RAD]
        self.feedback.valid = flags[codec.VALID]
        self.feedback.index_known = flags[codec.INDEX_KNOWN]
        self.feedback.statusword = self.words[0]
        self.command = AxisCommand(n)
        self.command.torque_Nm = floats[codec.COMMAND_NM]
        self.command.sent_torque_Nm = floats[codec.SENT_NM]
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.STATE] = State.UNKNOWN
        ints[codec.MODE_WANTED] = NO_MODE
        # in lockstep time stands still until the answer is given up for good
        ints[codec.SILENCE_LIMIT] = 1 if lockstep else _PACED_SILENT_CYCLES
        for i, axis in enumerate(axes):
            floats[codec.RAD_PER_COUNT, i] = axis.rad_per_count
            floats[codec.NM_PER_UNIT, i] = axis.Nm_per_unit
            most = int(axis.torque_limit_Nm / abs(axis.Nm_per_unit) + 1e-9)
            floats[codec.LIMIT_UNITS, i] = min(most, 0x7FFF)
            patience_s = _HEARTBEAT_PATIENCE * axis.drive.heartbeat_producer_s
            ints[codec.HEARTBEAT_LIMIT, i] = max(2, round(patience_s / period_s))
