"""The arrays in which a group of axes keeps its state from cycle to cycle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_codec import Ints
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.cia402 import State
from cdpr_drivers.drive_units import whole_units
from cdpr_rt.arrays import BoolArray, FloatArray, WordArray
from cdpr_rt.core.exchange import AxisCommand, AxisFeedback

NO_MODE = -1000
"""Requested mode of an axis that was not asked for any."""

_PACED_SILENT_CYCLES = 3
# a heartbeat that is most of a period late is lost: CAN repeats what was disturbed by itself
_HEARTBEAT_TIMEOUT_PERIODS = 1.75

# what one drive may send; a bus of 1 Mbit/s carries some 9000 frames a second in all
_FRAMES_A_CYCLE, _FRAMES_A_SECOND = 8, 4000


class StateArrays:
    """State of n axes as arrays: the rows named in `axis_codec`, one column per axis."""

    def __init__(self, n: int) -> None:
        # one column is not used: so these are strided as views of some axes are, and kernels are
        # compiled once for both
        self.ints: Ints = np.zeros((codec.INT_ROWS, n + 1), np.int64)[:, :n]
        self.floats: FloatArray = np.zeros((codec.FLOAT_ROWS, n + 1))[:, :n]
        self.flags: BoolArray = np.zeros((codec.FLAG_ROWS, n + 1), np.bool_)[:, :n]
        self.words: WordArray = np.zeros((1, n), np.uint16)

    def view(self, first: int, last: int) -> StateArrays:
        """Return the axes `first` up to `last` as views into the same arrays."""
        view = StateArrays(0)
        view.ints, view.floats = self.ints[:, first:last], self.floats[:, first:last]
        view.flags, view.words = self.flags[:, first:last], self.words[:, first:last]
        return view

    @cached_property
    def feedback(self) -> AxisFeedback:
        """The feedback whose arrays are rows of these."""
        feedback = AxisFeedback(self.ints.shape[1])
        feedback.position_rad = self.floats[codec.POSITION_RAD]
        feedback.torque_Nm = self.floats[codec.TORQUE_NM]
        feedback.index_rad = self.floats[codec.INDEX_RAD]
        feedback.valid = self.flags[codec.VALID]
        feedback.index_known = self.flags[codec.INDEX_KNOWN]
        feedback.alive = self.flags[codec.ALIVE]
        feedback.rate_ok = self.flags[codec.RATE_OK]
        feedback.statusword = self.words[0]
        return feedback

    @cached_property
    def command(self) -> AxisCommand:
        """The command whose arrays are rows of these."""
        command = AxisCommand(self.ints.shape[1])
        command.torque_Nm = self.floats[codec.COMMAND_NM]
        command.sent_torque_Nm = self.floats[codec.SENT_NM]
        return command

    def begin(self, axes: Sequence[AxisConfig], period_s: float, lockstep: bool) -> None:
        """Write the initial state of the axes, and what their drives are made for."""
        ints, floats = self.ints, self.floats
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.STATE] = State.UNKNOWN
        ints[codec.MODE_REQUESTED] = NO_MODE
        # in lockstep time stands still until the answer is given up for good
        ints[codec.SILENCE_LIMIT] = 1 if lockstep else _PACED_SILENT_CYCLES
        for i, axis in enumerate(axes):
            floats[codec.RAD_PER_COUNT, i] = axis.rad_per_count
            floats[codec.NM_PER_UNIT, i] = axis.Nm_per_unit
            ints[codec.TPDOS_EXPECTED, i] = axis.expected_tpdos
            most = whole_units(axis.torque_limit_Nm, abs(axis.Nm_per_unit))
            # 6071h has 16 bits: in mNm no more than 32.767 Nm can be asked for
            floats[codec.LIMIT_UNITS, i] = min(most, 0x7FFF)
            ints[codec.FRAMES_ALLOWED, i] = max(_FRAMES_A_CYCLE, round(_FRAMES_A_SECOND * period_s))
            timeout_s = _HEARTBEAT_TIMEOUT_PERIODS * axis.drive.heartbeat_producer_s
            ints[codec.HEARTBEAT_LIMIT, i] = max(2, round(timeout_s / period_s))
