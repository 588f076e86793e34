"""Find the encoder index: CiA 402 homing of one axis, or touch probe during ordinary motion."""

from __future__ import annotations

import math
from enum import Enum, auto

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.cia402 import HALT, START_HOMING
from cdpr_drivers.errors import DriveFaultError

_REACHED, _ATTAINED, _ERROR = 1 << 10, 1 << 12, 1 << 13
_SPEED_RAD_S = math.radians(30.0)
_ACCELERATION_RAD_S2 = math.radians(360.0)
# after this time a drive has seen the start bit, so its status belongs to this homing
_ANSWER_S = 0.02
# CiA 402-2: limit switches, home switch from either side, home switch between limits, index only;
# 17 to 30 are 1 to 14 without the index
_WITH_INDEX = ((1, 2), (3, 5), (4, 6), (7, 11), (8, 12), (9, 13), (10, 14))
_PAIRS = (*_WITH_INDEX, *((a + 16, b + 16) for a, b in _WITH_INDEX), (33, 34))
MIRRORED = dict(_PAIRS) | {b: a for a, b in _PAIRS}
"""The homing method that does the same in the opposite direction."""
_FINDING_INDEX = (*range(1, 15), 33, 34)


class HomingStep(Enum):
    """State of a homing procedure."""

    READY = auto()
    RUNNING = auto()
    DONE = auto()
    FAILED = auto()


class Homing:
    """The homing mode's handshake: start bit, then statusword bits 13, 12 and 10.

    Call `configure` before cycles run; then, with the axis enabled in homing mode, call `update` in
    every cycle. Methods 33 and 34 turn the motor to its index in negative or positive direction, by
    one turn at most. Raises DriveFaultError for a method that is not in the drive's profile.
    """

    def __init__(self, group: AxisGroup, axis: int, method: int, timeout_s: float = 30.0) -> None:
        drive = group.axes[axis].drive
        if method not in drive.homing_methods:
            raise DriveFaultError(
                f"drive profile {drive.name!r}: homing method {method} is not supported; "
                f"allowed: {', '.join(map(str, drive.homing_methods))}"
            )
        self.step = HomingStep.READY
        self._group = group
        self._axis = axis
        self._node_id = group.axes[axis].node_id
        self._method = method
        self._timeout_s = timeout_s
        self._started_s = 0.0
        self._seen_running = False
        alone = drive.quirks.homing_done_by_bit_12_alone
        self._telling = _ERROR | _ATTAINED if alone else _ERROR | _ATTAINED | _REACHED
        self._done = self._telling & ~_ERROR

    def configure(self) -> None:
        """Write method, speeds and, if the drive has them, acceleration and offset by SDO.

        Raises SdoError.
        """
        config = self._group.axes[self._axis]
        speed = config.speed_units(_SPEED_RAD_S)
        network = self._group.network
        network.write(self._node_id, 0x6098, 0, self._drive_method())
        for sub in (1, 2):
            network.write(self._node_id, 0x6099, sub, speed)
        acceleration = config.acceleration_units(_ACCELERATION_RAD_S2)
        for index, value in ((0x609A, acceleration), (0x607C, 0)):
            if index in network.dictionary(self._node_id):
                network.write(self._node_id, index, 0, value)

    def _drive_method(self) -> int:
        """Return the method for the direction in which this drive counts."""
        if self._group.axes[self._axis].drive.homing_sign > 0:
            return self._method
        return MIRRORED.get(self._method, self._method)

    def update(self) -> bool:
        """Advance by one cycle, after its `receive`; return whether homing is done.

        Raises DriveFaultError if the drive reports a homing error or exceeds the timeout in bus
        time; the motion has then been halted.
        """
        now = self._group.feedback.time_s
        if self.step is HomingStep.READY:
            self._started_s = now
            self._group.set_extra_bits(self._axis, START_HOMING)
            self.step = HomingStep.RUNNING
        elif self.step is HomingStep.RUNNING:
            self._look(int(self._group.feedback.statusword[self._axis]), now - self._started_s)
        return self.step is HomingStep.DONE

    def _look(self, word: int, elapsed_s: float) -> None:
        bits = word & self._telling
        self._seen_running |= bits == 0
        # before that, the bits may belong to an earlier homing
        current = self._seen_running or elapsed_s > _ANSWER_S
        if bits & _ERROR and current:
            self._fail(f"the drive reports a homing error (statusword {word:04X}h)")
        if bits == self._done and current:
            self._group.set_extra_bits(self._axis, 0)
            if self._method in _FINDING_INDEX:
                self._group.set_index(self._axis, 0.0)
            self.step = HomingStep.DONE
        elif elapsed_s > self._timeout_s:
            self._fail(f"not done within {self._timeout_s:g} s (statusword {word:04X}h)")

    def _fail(self, problem: str) -> None:
        self.abort()
        raise DriveFaultError(
            f"node {self._node_id}: homing method {self._method} failed: {problem}; the encoder "
            "index is not known"
        )

    def abort(self) -> None:
        """Clear the start bit and halt the motion; the caller disables the drive."""
        if self.step is not HomingStep.DONE:
            self.step = HomingStep.FAILED
            self._group.set_extra_bits(self._axis, HALT)


# Finding the encoder index during ordinary motion, with the drive's touch probe.

_OFF = 0
# CiA 402-2, 60B8h: probe 1 on, first event only, zero pulse as trigger, positive edge
_NEXT_ZERO_PULSE = 0x15
_ON, _LATCHED = 0x01, 0x02


def arm(group: AxisGroup, axis: int) -> None:
    """Have the drive latch its position at the next zero pulse.

    The position arrives in a TPDO in any cycle after it is latched, and `feedback.index_known`
    reports it; no SDO is needed then. Raises DriveFaultError if the drive does not arm or its
    PDOs do not carry the result, SdoError if it rejects the request.
    """
    node = group.axes[axis].node_id
    if 0x60B8 not in group.network.dictionary(node):
        raise DriveFaultError(
            f"node {node}: the drive has no touch probe (60B8h is not in its EDS); find its index "
            "by homing"
        )
    write = group.network.write
    group.expect_index(axis, False)
    write(node, 0x60B8, 0, _OFF)
    write(node, 0x60B8, 0, _NEXT_ZERO_PULSE)
    status = group.network.read_int(node, 0x60B9)
    if not status & _ON or (status & _LATCHED and not group.feedback.valid[axis]):
        raise DriveFaultError(
            f"node {node}: the touch probe did not arm (60B9h = {status:04X}h after 60B8h = "
            f"{_NEXT_ZERO_PULSE:04X}h)"
        )
    group.expect_index(axis, True)
