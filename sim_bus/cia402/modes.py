"""Modes of operation, homing apart: how each drives the axis and what it reports."""

from __future__ import annotations

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
from cdpr_sim_bus.robot import servo


class Mode:
    """One mode of operation. The state machine calls it only while the drive is enabled."""

    number = ModeNumber.NONE
    torque_mode = True
    """Whether a halt takes the torque back along its slope rather than braking the motion."""
    watch = 0
    """Servo flags that change the statusword."""
    cyclic = False
    """Whether `sync` wants to be called at every SYNC."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self._limit = 0.0

    def _limited(self, velocity: float) -> float:
        return max(-self._limit, min(self._limit, velocity))

    def start(self) -> None:
        """Take the axis over, from rest or from motion."""
        self.axis.set_torque_slope(self.axis.object(0x6087))
        self.axis.drive(servo.TORQUE, 0.0)

    def resume(self) -> None:
        """Go on after a halt."""
        self.start()

    def command(self, old: int, new: int) -> None:
        """Learn of a controlword that differs from the last one."""

    def tick(self) -> None:
        """Act on the axis' flags after a step."""

    def sync(self) -> None:
        """Take the set-points of a new cycle."""

    def reconfigure(self) -> None:
        """Take changed ramps and windows from the dictionary."""

    def status(self) -> int:
        """Return bits 10, 12 and 13 of the statusword."""
        return 0

    def idle_status(self) -> int:
        """Return the same bits while the drive is not enabled."""
        return 0

    @property
    def busy(self) -> bool:
        """Whether `tick` wants to be called after every step."""
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
    """CST: target torque plus torque offset, at once."""

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
    """CSV: target velocity plus velocity offset, at once; torque offset fed forward."""

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
    """PP: set-points by the handshake of bits 4 and 12, one waiting behind the active one."""

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
