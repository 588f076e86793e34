"""A simulated safety I/O: contactor, brakes, limit switches, and its plant file."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Annotated

from pydantic import Field
from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_profiles.reader import Profile
from cdpr_profiles.safety_io import DigitalInput, SafetyIoProfile
from cdpr_sim_bus.devices.modbus_servers import AnswerFaults, Panel
from cdpr_sim_bus.physics_board import BoardAxis, SafetyIoFault, Window
from cdpr_sim_bus.plant_file import PlantFile

Delay = Annotated[float, Field(ge=0.0, le=10.0)]


class SafetyAxisPlant(Profile):
    """Positions of one axis' limit switches, as true motor angle over all turns."""

    limit_negative_deg: float | None = None
    """Angle below which the negative switch is active."""
    limit_positive_deg: float | None = None
    """Angle above which the positive switch is active."""


class SafetyPlant(PlantFile):
    """Delays of the devices wired to the I/O, and its axes in the order of its profile."""

    contactor_close_s: Delay = 0.03
    contactor_open_s: Delay = 0.015
    brake_release_s: Delay = 0.05
    brake_apply_s: Delay = 0.03
    axes: tuple[SafetyAxisPlant, ...] = ()


_ALWAYS, _NEVER = (-math.inf, math.inf), (-math.inf, -math.inf)
_READ_COILS, _READ_INPUTS, _WRITE_COIL, _WRITE_COILS = 1, 2, 5, 15


class DelayedContact:
    """A contactor or brake that follows its coil after a delay, unless it is stuck."""

    def __init__(self, on_delay_s: float, off_delay_s: float) -> None:
        self._delays = {True: on_delay_s, False: off_delay_s}
        self.on = False
        self.stuck = False
        self._until: float | None = None

    def step(self, coil: bool, now: float) -> None:
        """Advance to `now`; `coil` is its value since the last step."""
        if self.stuck:
            return
        if coil == self.on:
            self._until = None
        elif self._until is None:
            self._until = now + self._delays[coil]
        if self._until is not None and now >= self._until:
            self.on, self._until = coil, None

    def window(self, drop_s: float) -> Window:
        """Return the times between which the contact is on if the coil drops at `drop_s`."""
        if self.stuck:
            return (-math.inf, math.inf if self.on else -math.inf)
        since = -math.inf if self.on else math.inf
        until = drop_s + self._delays[False]
        if self._until is not None and self.on:
            until = self._until
        elif self._until is not None and self._until <= drop_s:
            since = self._until
        return since, until


class SimSafetyIo:
    """The safety I/O and its outputs; `axes` of the board are those of the profile, in order.

    Its time is `bus_time`, that of the axes' buses in lockstep, or CLOCK_MONOTONIC. In lockstep it
    acts only on requests, while bus time stands still. So it writes to the board, in advance and
    with their bus times, the changes that will occur before the next request.
    """

    def __init__(
        self,
        profile: SafetyIoProfile,
        plant: SafetyPlant,
        axes: Sequence[BoardAxis] = (),
        bus_time: Callable[[], float] | None = None,
    ) -> None:
        self._profile, self._board = profile, axes
        self._lockstep, self._clock = bus_time is not None, bus_time or time.monotonic
        self.line = AnswerFaults(profile.unit, lockstep=self._lockstep)
        self.fault = SafetyIoFault(0)
        self._panel_faults = self._board_faults = SafetyIoFault(0)
        self._panel_pressed = False
        self._coils = [False] * (1 + max(output.coil for _, output in profile.outputs()))
        self._contactor = DelayedContact(plant.contactor_close_s, plant.contactor_open_s)
        self._brakes = [
            DelayedContact(plant.brake_release_s, plant.brake_apply_s) for _ in profile.axes
        ]
        missing = len(profile.axes) - len(plant.axes)
        self._switches = (*plant.axes, *[SafetyAxisPlant()] * missing)
        self._fed_at = math.inf
        self._watchdog_s = math.inf
        self._dropped = False
        self._stuck_feedback = False
        self._inputs = [False] * (1 + max(point.input for _, point in profile.inputs()))
        self.panel = Panel(profile.unit, {0: self._press, 1: self._set_faults})
        self.step()

    # -- panel

    def _press(self, pressed: int) -> None:
        self.step()
        self._panel_pressed = bool(pressed)
        self.step()

    def _set_faults(self, bits: int) -> None:
        self.step()
        self._panel_faults = SafetyIoFault(bits)
        self._apply_faults()
        self.step()

    @property
    def _pressed(self) -> bool:
        return self._panel_pressed or SafetyIoFault.PRESSED in self.fault

    def _apply_faults(self) -> None:
        self.fault = self._panel_faults | self._board_faults
        self._contactor.stuck = SafetyIoFault.CONTACTOR_WELDED in self.fault and self._contactor.on
        for brake in self._brakes:
            brake.stuck = SafetyIoFault.BRAKES_STUCK in self.fault
        self.line.silent = SafetyIoFault.SILENT in self.fault
        self.line.truncated = SafetyIoFault.TRUNCATED in self.fault
        self.line.wrong_unit = SafetyIoFault.WRONG_UNIT in self.fault
        self._stuck_feedback = self._contactor.on

    # -- physics

    def step(self) -> None:
        """Advance contactor, brakes and inputs to now, and write them to the board."""
        if self._board and self._board[0].io_faults != self._board_faults:
            self._board_faults = self._board[0].io_faults
            self._apply_faults()
        now, drop_s = self._clock(), self._watchdog_drop_s
        if now > drop_s:  # the device accepts no outputs until its watchdog is fed again
            if not self._dropped:
                self._switch(drop_s)
            self._coils = [False] * len(self._coils)
            if not self._dropped:
                self._switch(drop_s)
            self._dropped = True
        self._switch(now)
        self._publish(now)
        self._read_switches()

    @property
    def _watchdog_drop_s(self) -> float:
        """Return when the device's own watchdog drops the outputs if nobody feeds it."""
        return self._fed_at + self._watchdog_s

    def _switch(self, at_s: float) -> None:
        profile = self._profile
        self._contactor.step(self._coil_on, at_s)
        if SafetyIoFault.CONTACTOR_WELDED in self.fault:
            self._contactor.stuck = self._contactor.on
        for axis, brake in zip(profile.axes, self._brakes, strict=True):
            if axis.brake is not None:
                brake.step(self._coils[axis.brake.output.coil], at_s)

    @property
    def _coil_on(self) -> bool:
        """Whether the contactor's coil has current."""
        return self._coils[self._profile.contactor.output.coil] and not self._pressed

    def _publish(self, now: float) -> None:
        """Write power and brakes to the board; in lockstep, with their future changes."""
        power = _NEVER if self._pressed else self._contactor.window(self._watchdog_drop_s)
        worn = SafetyIoFault.BRAKES_WORN in self.fault
        for place, axis, brake in zip(self._board, self._profile.axes, self._brakes, strict=False):
            free = _ALWAYS if worn else brake.window(self._watchdog_drop_s)
            if not self._lockstep:
                place.power_allowed = power[0] <= now < power[1]
                if axis.brake is not None:
                    place.brake_released = free[0] <= now < free[1]
                continue
            ahead_s = place.time_s - now  # the times of the buses differ
            place.allow_power((power[0] + ahead_s, power[1] + ahead_s))
            if axis.brake is not None:
                place.release_brake((free[0] + ahead_s, free[1] + ahead_s))

    def switch_off(self) -> None:
        """Remove the supply: the contactor opens, the brakes hold."""
        for i, place in enumerate(self._board[: len(self._profile.axes)]):
            place.power_allowed = False
            if self._profile.axes[i].brake is not None:
                place.brake_released = False

    def _read_switches(self) -> None:
        profile = self._profile
        self._show(profile.chain, not self._pressed)
        stuck = SafetyIoFault.FEEDBACK_STUCK in self.fault
        self._show(
            profile.contactor.feedback, self._stuck_feedback if stuck else self._contactor.on
        )
        for i, (axis, brake) in enumerate(zip(profile.axes, self._brakes, strict=True)):
            if axis.brake is not None:
                self._show(axis.brake.feedback, brake.on)
            angle = math.degrees(self._board[i].state().motor_rad) if i < len(self._board) else 0.0
            low, high = self._switches[i].limit_negative_deg, self._switches[i].limit_positive_deg
            if axis.limit_negative is not None:
                self._show(axis.limit_negative, low is not None and angle < low)
            if axis.limit_positive is not None:
                self._show(axis.limit_positive, high is not None and angle > high)

    def _show(self, point: DigitalInput, on: bool) -> None:
        self._inputs[point.input] = on != point.inverted

    # -- the device

    def units(self) -> list[SimDevice]:
        """Return the units to serve: the I/O and its panel."""
        watchdog = self._profile.watchdog
        given = (watchdog.timeout_register, watchdog.trigger_register) if watchdog else ()
        known = [register for register in given if register is not None] or [0]
        registers = [0] * (1 + max(known) - min(known))
        device = SimDevice(
            self._profile.unit,
            (
                [SimData(0, values=[False] * len(self._coils), datatype=DataType.BITS)],
                [SimData(0, values=[False] * len(self._inputs), datatype=DataType.BITS)],
                [SimData(min(known), values=registers, datatype=DataType.REGISTERS)],
                [SimData(0, values=[0], datatype=DataType.REGISTERS)],
            ),
            action=self._act,
        )
        return [device, self.panel.device()]

    async def _act(
        self,
        code: int,
        _start: int,
        address: int,
        _count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if SafetyIoFault.EXCEPTIONS in self.fault:
            return ExcCodes.DEVICE_FAILURE
        self.step()
        if code in (_WRITE_COIL, _WRITE_COILS):
            if address + len(values or ()) > len(self._coils):
                return ExcCodes.ILLEGAL_ADDRESS
            for offset, value in enumerate(values or ()):
                self._coils[address + offset] = bool(value)
        elif values is not None:
            self._set_register(address, [int(value) for value in values])
        self.step()
        if code == _READ_COILS:
            _fill(registers, self._coils)
        elif code == _READ_INPUTS:
            _fill(registers, self._inputs)
        return None

    def _set_register(self, start: int, values: list[int]) -> None:
        watchdog = self._profile.watchdog
        for address, value in enumerate(values, start):
            if watchdog is None:
                return
            if address == watchdog.timeout_register:
                self._watchdog_s = value * watchdog.timeout_unit_s
            if address == watchdog.trigger_register:
                self._fed_at, self._dropped = self._clock(), False


def _fill(registers: list[int], bits: list[bool]) -> None:
    """Write bits into the words from which the server takes its answers."""
    for word in range((len(bits) + 15) // 16):
        part = bits[16 * word : 16 * word + 16]
        registers[word] = sum(1 << i for i, bit in enumerate(part) if bit)
