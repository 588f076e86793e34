"""The arrays in which a group of axes keeps its state from cycle to cycle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.exchange import AxisCommand, AxisFeedback, BoolArray, FloatArray, WordArray
from drivers import axis_codec as codec
from drivers.axis_codec import Ints
from drivers.axis_layout import AxisConfig
from drivers.cia402 import State
from drivers.drive_units import whole_units

NO_MODE = -1000
"""Wanted mode of an axis that was not asked for any."""

_PACED_SILENT_CYCLES = 3
# a heartbeat that is most of a period late is lost: CAN repeats what was disturbed by itself
_HEARTBEAT_PATIENCE = 1.75

# what one drive may send; a bus of 1 Mbit/s carries some 9000 frames a second in all
_FRAMES_A_CYCLE, _FRAMES_A_SECOND = 8, 4000


class StateArrays:
    """Room for the state of n axes: the rows named in `axis_codec`, one column per axis."""

    def __init__(self, n: int) -> None:
        self.ints: Ints = np.zeros((codec.INT_ROWS, n), np.int64)
        self.floats: FloatArray = np.zeros((codec.FLOAT_ROWS, n))
        self.flags: BoolArray = np.zeros((codec.FLAG_ROWS, n), np.bool_)
        self.words: WordArray = np.zeros((1, n), np.uint16)
        self.columns = slice(0, n)
        self.width = n

    def part(self, first: int, last: int) -> StateArrays:
        """Return the axes `first` up to `last` as views into the same arrays."""
        part = StateArrays(0)
        part.ints, part.floats = self.ints[:, first:last], self.floats[:, first:last]
        part.flags, part.words = self.flags[:, first:last], self.words[:, first:last]
        part.columns = slice(first, last)
        part.width = self.width
        return part

    def spare(self) -> StateArrays:
        """Return other room that lies in memory as this does, so that kernels serve both."""
        return StateArrays(self.width).part(self.columns.start, self.columns.stop)

    def feedback(self) -> AxisFeedback:
        """Return the feedback whose arrays are rows of these."""
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

    def command(self) -> AxisCommand:
        """Return the command whose arrays are rows of these."""
        command = AxisCommand(self.ints.shape[1])
        command.torque_Nm = self.floats[codec.COMMAND_NM]
        command.sent_torque_Nm = self.floats[codec.SENT_NM]
        return command


class GroupState:
    """State of n axes; `feedback` and `command` are views into the arrays of the kernels.

    `room` holds them, where the axes are part of a larger device.
    """

    def __init__(
        self,
        axes: Sequence[AxisConfig],
        period_s: float,
        lockstep: bool,
        room: StateArrays | None = None,
    ) -> None:
        room = room or StateArrays(len(axes))
        self.ints = ints = room.ints
        self.floats = floats = room.floats
        self.words, self.flags = room.words, room.flags
        self.feedback, self.command = room.feedback(), room.command()
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.STATE] = State.UNKNOWN
        ints[codec.MODE_WANTED] = NO_MODE
        # in lockstep time stands still until the answer is given up for good
        ints[codec.SILENCE_LIMIT] = 1 if lockstep else _PACED_SILENT_CYCLES
        for i, axis in enumerate(axes):
            floats[codec.RAD_PER_COUNT, i] = axis.rad_per_count
            floats[codec.NM_PER_UNIT, i] = axis.Nm_per_unit
            ints[codec.AWAITED, i] = axis.awaited_tpdos
            most = whole_units(axis.torque_limit_Nm, abs(axis.Nm_per_unit))
            # 6071h has 16 bits: in mNm no more than 32.767 Nm can be asked for
            floats[codec.LIMIT_UNITS, i] = min(most, 0x7FFF)
            ints[codec.FRAMES_ALLOWED, i] = max(_FRAMES_A_CYCLE, round(_FRAMES_A_SECOND * period_s))
            patience_s = _HEARTBEAT_PATIENCE * axis.drive.heartbeat_producer_s
            ints[codec.HEARTBEAT_LIMIT, i] = max(2, round(patience_s / period_s))
