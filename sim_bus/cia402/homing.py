"""Homing mode (HM): methods 1 to 14 (switches and index), 33 and 34 (index), 35 and 37 (in place).

Every method with a switch ends the same way: the switch's edge is crossed in one final direction
and the first index pulse beyond it is home. The table says on which side and how to get there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto

from typing_extensions import override

from cdpr_sim_bus.cia402.axis import Axis
from cdpr_sim_bus.cia402.modes import Mode
from cdpr_sim_bus.cia402.words import BIT_4, BIT_12, BIT_13, TARGET_REACHED, ModeNumber
from cdpr_sim_bus.robot import motor_physics, servo

_TURNS_WITHOUT_INDEX = 2


@dataclass(frozen=True)
class Method:
    """How a method finds home; directions are +1 or −1."""

    switch: int
    """Servo flag of the switch it works with, 0 for none."""
    search: int
    """Direction in which the switch is looked for."""
    final: int
    """Direction of the last move, which crosses the edge and meets the index."""
    leaving: bool = False
    """Whether that crossing leaves the switch (else it enters it)."""
    reverses: bool = False
    """Whether a limit switch met while searching turns the search round."""

    def mirrored(self) -> Method:
        """Return the same method with all directions the other way."""
        switch = {_NEG: _POS, _POS: _NEG}.get(self.switch, self.switch)
        return replace(self, switch=switch, search=-self.search, final=-self.final)


_NEG, _POS, _HOME = servo.SWITCH_NEGATIVE, servo.SWITCH_POSITIVE, servo.SWITCH_HOME
METHODS = {
    1: Method(_NEG, -1, +1, leaving=True),
    2: Method(_POS, +1, -1, leaving=True),
    3: Method(_HOME, +1, -1, leaving=True),
    4: Method(_HOME, +1, +1),
    5: Method(_HOME, -1, +1, leaving=True),
    6: Method(_HOME, -1, -1),
    7: Method(_HOME, +1, -1, leaving=True, reverses=True),
    8: Method(_HOME, +1, +1, reverses=True),
    9: Method(_HOME, +1, -1, reverses=True),
    10: Method(_HOME, +1, +1, leaving=True, reverses=True),
    11: Method(_HOME, -1, +1, leaving=True, reverses=True),
    12: Method(_HOME, -1, -1, reverses=True),
    13: Method(_HOME, -1, +1, reverses=True),
    14: Method(_HOME, -1, -1, leaving=True, reverses=True),
    33: Method(0, -1, -1),
    34: Method(0, +1, +1),
}
"""Methods that move the motor (CiA 402, homing method 6098h)."""
IN_PLACE = frozenset({35, 37})
"""Methods that take the present position as home."""


class _Phase(Enum):
    IDLE = auto()
    SEARCH = auto()
    BACK_OUT = auto()
    CROSS = auto()
    INDEX = auto()
    STOPPING = auto()
    FAILED = auto()


class Homing(Mode):
    """HM: a rising edge of bit 4 starts, a falling edge interrupts."""

    number = ModeNumber.HOMING
    torque_mode = False
    watch = -1

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._reversed = axis.quirks.homing_reversed
        self._bit_10_shown = axis.quirks.bit_10_in_homing
        self._phase = _Phase.IDLE
        self._method = METHODS[33]
        self._direction = 0
        self._sought_from = 0
        self._turned = False
        self.homed = False
        """Whether the last homing procedure was completed."""

    @property
    @override
    def ramp(self) -> int:
        """Object that holds the deceleration of the slow-down ramp."""
        return 0x609A

    @override
    def start(self) -> None:
        self._phase = _Phase.IDLE
        self.reconfigure()
        self.axis.motor["torque_offset"] = 0.0
        self.axis.drive(servo.VELOCITY, 0.0)

    @override
    def reconfigure(self) -> None:
        ramp = self.axis.velocity(0x609A)
        self.axis.set_ramps(ramp, ramp)

    @override
    def command(self, old: int, new: int) -> None:
        if new & ~old & BIT_4:
            self._begin()
        elif old & ~new & BIT_4 and self._phase not in (_Phase.IDLE, _Phase.FAILED):
            if self._phase is not _Phase.STOPPING:
                self._phase = _Phase.IDLE
            self.axis.drive(servo.VELOCITY, 0.0)

    def _begin(self) -> None:
        self.homed = False
        number = self.axis.object(0x6098)
        if number in IN_PLACE:
            self._set_home(self.axis.sample[1])
            return
        method = METHODS.get(number)
        if method is None:
            self._fail()
            return
        self._method = method = method.mirrored() if self._reversed else method
        self._turned = False
        if method.switch == 0:
            self._seek_index()
        elif not self.axis.flags & method.switch:
            self._move(_Phase.SEARCH, method.search, fast=True)
        elif method.leaving:
            self._move(_Phase.CROSS, method.final, fast=False)
        else:
            self._move(_Phase.BACK_OUT, -method.final, fast=False)

    def _move(self, phase: _Phase, direction: int, *, fast: bool) -> None:
        self._phase = phase
        self._direction = direction
        speed = self.axis.velocity(0x6099, 1 if fast else 2)
        self.axis.drive(servo.VELOCITY, direction * min(speed, self.axis.speed_limit))

    def _seek_index(self) -> None:
        self._sought_from = self.axis.sample[1]
        self._move(_Phase.INDEX, self._method.final, fast=False)

    def _fail(self) -> None:
        self._phase = _Phase.FAILED
        self.axis.drive(servo.VELOCITY, 0.0)

    @override
    def tick(self) -> None:
        flags, method = self.axis.flags, self._method
        active = bool(flags & method.switch)
        if self._phase is _Phase.SEARCH:
            self._search(flags, active)
        elif self._phase is _Phase.BACK_OUT:
            if not active:
                self._move(_Phase.CROSS, method.final, fast=False)
        elif self._phase is _Phase.CROSS:
            if active != method.leaving:
                self._seek_index()
        elif self._phase is _Phase.INDEX:
            self._find_index(flags)
        elif self._phase is _Phase.STOPPING and _stands(flags):
            self._phase = _Phase.IDLE

    def _search(self, flags: int, active: bool) -> None:
        method = self._method
        if active:
            if method.leaving:
                self._move(_Phase.CROSS, method.final, fast=False)
            elif self._direction == method.final:
                self._seek_index()
            else:
                self._move(_Phase.BACK_OUT, -method.final, fast=False)
            return
        limit = _POS if self._direction > 0 else _NEG
        if flags & limit:
            if self._turned or not method.reverses:
                self._fail()
            else:
                self._turned = True
                self._move(_Phase.SEARCH, -self._direction, fast=True)

    def _find_index(self, flags: int) -> None:
        axis = self.axis
        if flags & motor_physics.INDEX_ROSE:
            self._set_home(int(axis.motor["rise_count"][0]))
            return
        travelled = abs(axis.sample[1] - self._sought_from)
        if travelled > _TURNS_WITHOUT_INDEX * axis.plant.encoder.counts_per_turn:
            self._fail()

    def _set_home(self, counts: int) -> None:
        # The zero position lies at the home offset (607Ch) from home.
        self.axis.position_offset = -self.axis.object(0x607C) - counts
        self.homed = True
        self._phase = _Phase.STOPPING
        self.axis.drive(servo.VELOCITY, 0.0)

    def forget(self) -> None:
        """Forget that home was found."""
        self.homed = False
        self._phase = _Phase.IDLE

    @property
    @override
    def busy(self) -> bool:
        """Whether a homing procedure runs."""
        return self._phase not in (_Phase.IDLE, _Phase.FAILED)

    @override
    def status(self) -> int:
        word = self._progress()
        if self._bit_10_shown:
            return word
        if self._phase is _Phase.STOPPING:
            word &= ~BIT_12
        return word & ~TARGET_REACHED

    def _progress(self) -> int:
        if self._phase is _Phase.FAILED:
            return BIT_13 | (TARGET_REACHED if self.axis.flags & servo.STANDSTILL else 0)
        if self._phase is _Phase.STOPPING:
            return BIT_12
        if self._phase is _Phase.IDLE:
            return self.idle_status()
        return 0

    @override
    def idle_status(self) -> int:
        rest = TARGET_REACHED if self._bit_10_shown else 0
        return rest | (BIT_12 if self.homed else 0)


def _stands(flags: int) -> bool:
    both = servo.REFERENCE_DONE | servo.STANDSTILL
    return flags & both == both
