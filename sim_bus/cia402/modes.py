"""Modes of operation except homing: how each drives the axis and what it reports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Any

from typing_extensions import override

from cdpr_sim_bus.cia402.axis import Axis
from cdpr_sim_bus.cia402.words import (
    BIT_4,
    BIT_5,
    BIT_6,
    BIT_12,
    BIT_13,
    TARGET_REACHED,
    ModeNumber,
)
from cdpr_sim_bus.robot import motor as motor_physics
from cdpr_sim_bus.robot import servo


class Mode:
    """One mode of operation. The state machine calls it only while the drive is enabled."""

    number = ModeNumber.NONE
    torque_mode = True
    """Whether a halt reduces the torque along its slope instead of braking the motion."""
    watch = 0
    """Servo flags that change the statusword."""
    cyclic = False
    """Whether `sync` must be called at every SYNC."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self._limit = 0.0

    def _limited(self, velocity: float) -> float:
        return max(-self._limit, min(self._limit, velocity))

    def start(self) -> None:
        """Take over the axis, at rest or in motion."""
        self.axis.set_torque_slope(self.axis.object(0x6087))
        self.axis.drive(servo.TORQUE, 0.0)

    def resume(self) -> None:
        """Continue after a halt."""
        self.start()

    def command(self, old: int, new: int) -> None:
        """Handle a controlword that differs from the last one."""

    def tick(self) -> None:
        """React to the axis' flags after a step."""

    def sync(self) -> None:
        """Apply the set-points of a new cycle."""

    def reconfigure(self) -> None:
        """Read changed ramps and windows from the dictionary."""

    def status(self) -> int:
        """Return bits 10, 12 and 13 of the statusword."""
        return 0

    def idle_status(self) -> int:
        """Return the same bits while the drive is not enabled."""
        return 0

    @property
    def busy(self) -> bool:
        """Whether `tick` must be called after every step."""
        return False

    @property
    def ramp(self) -> int:
        """Object that holds the deceleration of the slow-down ramp."""
        return 0x6084


class ProfileTorque(Mode):
    """PT: target torque along the torque slope."""

    number = ModeNumber.PROFILE_TORQUE
    watch = servo.ON_TARGET

    @override
    def start(self) -> None:
        self.axis.drive(servo.TORQUE, 0.0)
        target: Any = self.axis.od.entry(0x6071)
        self.axis.setpoint = lambda: float(target.value)
        self.reconfigure()

    @override
    def reconfigure(self) -> None:
        self.axis.set_torque_slope(self.axis.object(0x6087))

    @override
    def status(self) -> int:
        return TARGET_REACHED if self.axis.flags & servo.ON_TARGET else 0


class _Cyclic(Mode):
    """A mode that follows a new target at every SYNC."""

    watch = servo.LIMITED

    @override
    def status(self) -> int:
        return 0 if self.axis.flags & (servo.LIMITED | servo.FOLLOWING_ERROR) else BIT_12


class CyclicTorque(_Cyclic):
    """CST: target torque plus torque offset, applied without a ramp."""

    number = ModeNumber.CYCLIC_TORQUE

    @override
    def start(self) -> None:
        axis = self.axis
        axis.set_torque_slope(float("inf"))
        axis.drive(servo.TORQUE, 0.0)
        target: Any = axis.od.entry(0x6071)
        offset: Any = axis.od.entry(0x60B2)
        axis.setpoint = lambda: float(target.value + offset.value)


class ProfileVelocity(Mode):
    """PV: target velocity along the profile's ramps."""

    number = ModeNumber.PROFILE_VELOCITY
    torque_mode = False
    watch = servo.ON_TARGET | servo.STANDSTILL

    @override
    def start(self) -> None:
        axis = self.axis
        axis.drive(servo.VELOCITY, 0.0)
        target: Any = axis.od.entry(0x60FF)
        self.reconfigure()
        axis.setpoint = lambda: self._limited(target.value * axis.velocity_unit)

    @override
    def reconfigure(self) -> None:
        axis = self.axis
        self._limit = axis.speed_limit
        axis.set_ramps(axis.velocity(0x6083), axis.velocity(0x6084))
        axis.set_window(axis.velocity(0x606D), axis.object(0x606E) * 1e-3)
        axis.motor["torque_offset"] = 0.0

    @override
    def status(self) -> int:
        flags = self.axis.flags
        return (TARGET_REACHED if flags & servo.ON_TARGET else 0) | (
            BIT_12 if flags & servo.STANDSTILL else 0
        )


class CyclicVelocity(_Cyclic):
    """CSV: target velocity plus velocity offset, without a ramp; torque offset fed forward."""

    number = ModeNumber.CYCLIC_VELOCITY
    torque_mode = False
    cyclic = True

    @override
    def start(self) -> None:
        axis = self.axis
        axis.drive(servo.VELOCITY, 0.0)
        axis.set_steps()
        self._limit = axis.speed_limit
        target: Any = axis.od.entry(0x60FF)
        offset: Any = axis.od.entry(0x60B1)
        axis.setpoint = lambda: self._limited((target.value + offset.value) * axis.velocity_unit)

    @override
    def sync(self) -> None:
        _feed_torque_offset(self.axis)


class CyclicPosition(_Cyclic):
    """CSP: target position, interpolated over 60C2h; torque offset fed forward."""

    number = ModeNumber.CYCLIC_POSITION
    torque_mode = False
    watch = servo.LIMITED | servo.FOLLOWING_ERROR
    cyclic = True

    @override
    def start(self) -> None:
        axis = self.axis
        axis.set_window(0.0, 0.0)
        axis.drive(servo.FOLLOW_POSITION, self._target())
        axis.motor["interpolation_left"] = self._period()

    @override
    def sync(self) -> None:
        self.axis.target = self._target()
        self.axis.motor["interpolation_left"] = self._period()
        _feed_torque_offset(self.axis)

    def _target(self) -> float:
        axis = self.axis
        return axis.clip_position(axis.object(0x607A) + axis.object(0x60B0))

    def _period(self) -> float:
        return self.axis.object(0x60C2, 1) * 10.0 ** self.axis.object(0x60C2, 2)

    @override
    def status(self) -> int:
        late = self.axis.flags & servo.FOLLOWING_ERROR
        return super().status() | (BIT_13 if late else 0)


class ProfilePosition(Mode):
    """PP: set-points by the handshake of bits 4 and 12; one may wait while another is active."""

    number = ModeNumber.PROFILE_POSITION
    torque_mode = False
    watch = servo.ON_TARGET | servo.REFERENCE_DONE | servo.FOLLOWING_ERROR

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._goal = 0.0
        self._waiting: float | None = None
        self._requested = False

    @override
    def start(self) -> None:
        self._waiting = None
        self._requested = False
        self._goal = round(self.axis.read("observed_position")) + self.axis.position_offset
        self._go()

    @override
    def resume(self) -> None:
        self._go()

    @override
    def reconfigure(self) -> None:
        axis = self.axis
        axis.set_window(axis.object(0x6067), axis.object(0x6068) * 1e-3)

    @override
    def command(self, old: int, new: int) -> None:
        self._requested = bool(new & BIT_4) and (self._requested or self._accept(old, new))

    def _accept(self, old: int, new: int) -> bool:
        if old & BIT_4:
            return False
        target = float(self.axis.object(0x607A))
        if new & BIT_6:
            target += self._goal
        if new & BIT_5 or (self._waiting is None and self.axis.flags & servo.REFERENCE_DONE):
            self._goal, self._waiting = target, None
            self._go()
        elif self._waiting is None:
            self._waiting = target
        else:
            return False
        return True

    @override
    def tick(self) -> None:
        if self._waiting is not None and self.axis.flags & servo.REFERENCE_DONE:
            self._goal, self._waiting = self._waiting, None
            self._go()

    def _go(self) -> None:
        axis = self.axis
        axis.set_ramps(axis.velocity(0x6083), axis.velocity(0x6084))
        axis.motor["profile_velocity"] = min(axis.velocity(0x6081), axis.speed_limit)
        axis.motor["torque_offset"] = 0.0
        self.reconfigure()
        axis.drive(servo.PROFILE_POSITION, axis.clip_position(self._goal))

    @override
    def status(self) -> int:
        flags = self.axis.flags
        acknowledged = self._requested or self._waiting is not None
        return (
            (TARGET_REACHED if flags & servo.ON_TARGET and self._waiting is None else 0)
            | (BIT_12 if acknowledged else 0)
            | (BIT_13 if flags & servo.FOLLOWING_ERROR else 0)
        )


def _feed_torque_offset(axis: Axis) -> None:
    axis.motor["torque_offset"] = axis.object(0x60B2) * axis.read("torque_unit")


# Homing mode (HM): methods 1 to 14 (switches and index), 33 and 34 (index), 35 and 37 (in
# place). Every method with a switch ends in the same way: it crosses the switch's edge in a
# final direction, and the first index pulse beyond the edge is home. The table gives the search
# for the switch and the last move of each method.

_TURNS_WITHOUT_INDEX = 2


@dataclass(frozen=True)
class Method:
    """How a method finds home; directions are +1 or −1."""

    switch: int
    """Servo flag of the switch that it uses; 0 for none."""
    search: int
    """Direction of the search for the switch."""
    final: int
    """Direction of the last move, which crosses the edge and reaches the index."""
    leaving: bool = False
    """Whether the last move leaves the switch; otherwise it enters the switch."""
    reverses: bool = False
    """Whether a limit switch reached during the search reverses the search."""

    def mirrored(self) -> Method:
        """Return the same method with all directions reversed."""
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
        # The zero position is at the home offset (607Ch) from home.
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
