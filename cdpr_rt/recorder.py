"""Records every cycle into a ring; whoever has time drains it into a file."""

from __future__ import annotations

import numpy as np

from cdpr_rt.controllers.base import Controller
from cdpr_rt.exchange import AxisCommand, AxisFeedback, BoolArray, FloatArray, Setpoint, WordArray
from cdpr_rt.jit import jit
from cdpr_rt.rawlog import RawLogWriter

_AXIS_COLUMNS = (
    "setpoint_rad",
    "setpoint_velocity_rad_s",
    "position_rad",
    "torque_actual_Nm",
    "torque_sent_Nm",
    "effort_Nm",
    "compensation_Nm",
    "statusword",
    "valid",
    "index_rad",
    "index_known",
)


def column_names(n: int) -> list[str]:
    """Return the names of a row's columns for n axes."""
    return ["cycle", "time_s", *(f"{name}[{i}]" for i in range(n) for name in _AXIS_COLUMNS)]


@jit
def _write_row(
    row: FloatArray,
    cycle: int,
    time_s: float,
    setpoint: FloatArray,
    velocity: FloatArray,
    position: FloatArray,
    actual: FloatArray,
    sent: FloatArray,
    effort: FloatArray,
    compensation: FloatArray,
    statusword: WordArray,
    valid: BoolArray,
    index: FloatArray,
    index_known: BoolArray,
) -> None:
    row[0] = cycle
    row[1] = time_s
    k = 2
    for i in range(setpoint.size):
        row[k] = setpoint[i]
        row[k + 1] = velocity[i]
        row[k + 2] = position[i]
        row[k + 3] = actual[i]
        row[k + 4] = sent[i]
        row[k + 5] = effort[i]
        row[k + 6] = compensation[i]
        row[k + 7] = statusword[i]
        row[k + 8] = valid[i]
        row[k + 9] = index[i]
        row[k + 10] = index_known[i]
        k += 11


class Recorder:
    """A ring of rows with one writer (the cycle) and one reader (`drain`).

    `capacity` rows are kept; a row that would overwrite one not yet drained is counted in
    `lost` and not recorded, so that the cycle never waits.
    """

    def __init__(self, n: int, capacity: int = 8192) -> None:
        self._rows: FloatArray = np.zeros((capacity, len(column_names(n))))
        self._capacity = capacity
        self._head = 0
        self._tail = 0
        self.lost = 0

    def append(
        self,
        feedback: AxisFeedback,
        setpoint: Setpoint,
        command: AxisCommand,
        controller: Controller,
    ) -> None:
        """Record one cycle."""
        if self._head - self._tail >= self._capacity:
            self.lost += 1
            return
        _write_row(
            self._rows[self._head % self._capacity],
            feedback.cycle,
            feedback.time_s,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            feedback.position_rad,
            feedback.torque_Nm,
            command.sent_torque_Nm,
            controller.effort_Nm,
            controller.compensation_Nm,
            feedback.statusword,
            feedback.valid,
            feedback.index_rad,
            feedback.index_known,
        )
        self._head += 1

    def pending(self) -> int:
        """Return how many rows wait to be drained."""
        return self._head - self._tail

    def clear(self) -> None:
        """Drop what was not drained."""
        self._tail = self._head

    def drain(self, log: RawLogWriter) -> None:
        """Move what was recorded so far into the file."""
        head = self._head
        while self._tail < head:
            first = self._tail % self._capacity
            count = min(head - self._tail, self._capacity - first)
            log.write(self._rows[first : first + count])
            self._tail += count
