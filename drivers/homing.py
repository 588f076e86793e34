"""Homing of one axis as CiA 402 has it, advanced once per cycle."""

from __future__ import annotations

import math
from enum import Enum, auto

from drivers.axis_group import AxisGroup
from drivers.cia402 import START_HOMING
from drivers.errors import DriveFaultError

_ATTAINED, _REACHED, _ERROR = 1 << 12, 1 << 10, 1 << 13
_SPEED_RAD_S = math.radians(30.0)
_ACCELERATION_RAD_S2 = math.radians(360.0)
# the start bit is read with the next SYNC, its answer comes one later
_ANSWER_CYCLES = 4


class _Step(Enum):
    START = auto()
    RUNNING = auto()
    DONE = auto()


class Homing:
    """The homing mode's handshake: start bit, then statusword bits 13, 12 and 10.

    The axis must be enabled in homing mode when `update` is called first. Methods 33 and 34 turn
    the motor to its index in negative or positive direction, by a turn at most.
    """

    def __init__(self, group: AxisGroup, axis: int, method: int) -> None:
        drive = group.axes[axis].drive
        if method not in drive.homing_methods:
            raise DriveFaultError(
                f"drive profile {drive.name!r}: homing method {method} is not among "
                f"{list(drive.homing_methods)}"
            )
        self._group = group
        self._axis = axis
        self._method = method
        self._step = _Step.START
        self._waited = 0

    def configure(self) -> None:
        """Write method, speeds and offset by SDO, before cycles run; raises SdoError."""
        config = self._group.axes[self._axis]
        counts_per_rad = config.counts_per_turn / math.tau
        speed = max(1, round(_SPEED_RAD_S * counts_per_rad))
        acceleration = max(1, round(_ACCELERATION_RAD_S2 * counts_per_rad))
        write = self._group.network.write
        write(config.node_id, 0x6098, 0, self._wire_method())
        for sub in (1, 2):
            write(config.node_id, 0x6099, sub, speed)
        write(config.node_id, 0x609A, 0, acceleration)
        write(config.node_id, 0x607C, 0, 0)

    def _wire_method(self) -> int:
        """Return the method as this drive counts directions."""
        mirrored = {33: 34, 34: 33}
        if self._group.axes[self._axis].drive.homing_sign < 0:
            return mirrored.get(self._method, self._method)
        return self._method

    def update(self) -> bool:
        """Advance by one cycle; return whether the axis has found its index.

        Raises DriveFaultError when the drive reports a homing error.
        """
        word = int(self._group.feedback.statusword[self._axis])
        if self._step is _Step.START:
            self._group.set_extra_bits(self._axis, START_HOMING)
            self._step = _Step.RUNNING
            return False
        self._waited += 1
        if self._step is _Step.RUNNING and self._waited > _ANSWER_CYCLES:
            if word & _ERROR:
                self.abort()
                raise DriveFaultError(
                    f"node {self._group.axes[self._axis].node_id}: homing failed: the drive "
                    f"reports a homing error (statusword {word:04X}h)"
                )
            if word & _ATTAINED and word & _REACHED:
                self.abort()
                self._group.set_index(self._axis, 0.0)
                self._step = _Step.DONE
        return self._step is _Step.DONE

    def abort(self) -> None:
        """Take the start bit back, which ends the homing motion."""
        self._group.set_extra_bits(self._axis, 0)
