"""A simulated rail on a positioning drive with Modbus TCP: registers, ramp, brake, worn brake."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from enum import IntFlag

from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_profiles.rail import ModbusRail, RailProfile
from cdpr_sim_bus.devices.modbus_servers import AnswerFaults, Panel

_STEP_S = 1e-3
_BRAKE_S = 0.05
_ENABLE_S = 0.03
_SLIP_M_S = 0.01
"""Speed of a carriage with a worn brake, if pushed at full torque."""


class RailFault(IntFlag):
    """Register 1 of the panel: active faults."""

    SILENT = 1
    TRUNCATED = 2
    BRAKE_WORN = 4
    BRAKE_STUCK = 8
    DRIVE_FAULT = 16
    TARGET_LOST = 32
    """The target register stores 0 instead of any written value."""


class SimRail:
    """The positioning drive, its brake and carriage. Panel registers: 0 unused, 1 faults.

    Its time is `bus_time`, that of a bus in lockstep, or CLOCK_MONOTONIC, in steps of 1 ms.
    """

    def __init__(self, rail: RailProfile, bus_time: Callable[[], float] | None = None) -> None:
        assert rail.modbus is not None  # checked by the command
        self._rail, self._map, self._clock = rail, rail.modbus, bus_time or time.monotonic
        self.line = AnswerFaults(self._map.unit, lockstep=bus_time is not None)
        self.fault = RailFault(0)
        self.panel = Panel(self._map.unit, {0: lambda _: None, 1: self._set_faults})
        self.position_m = rail.travel_min_m
        self._speed = 0.0
        self._target = rail.travel_min_m
        self._moving = False
        self._push = 0.0
        self._enabled = self._brake_released = False
        self._brake_due = self._enable_due = math.inf
        self._fed_at = self._watchdog_s = math.inf
        self._start, self._steps = self._clock(), 0
        self._time = self._start
        self._words: dict[int, int] = {}

    def _set_faults(self, bits: int) -> None:
        self.step()
        self.fault = RailFault(bits)
        self.line.silent = RailFault.SILENT in self.fault
        self.line.truncated = RailFault.TRUNCATED in self.fault

    # -- physics

    def step(self) -> None:
        """Advance to now in steps of 1 ms, so that the time of the call has no effect."""
        now = self._clock()
        while (time_s := self._start + (self._steps + 1) * _STEP_S) <= now:
            self._steps += 1
            self._time = time_s
            self._step()

    def _step(self) -> None:
        silent = self._time - self._fed_at > self._watchdog_s
        if silent or RailFault.DRIVE_FAULT in self.fault:
            self._words[self._map.command_register] = 0
        bits = self._map.command
        self._enabled, self._enable_due = self._delayed(
            self._enabled, self._command_bit(bits.enable), self._enable_due, _ENABLE_S
        )
        if RailFault.BRAKE_STUCK not in self.fault:
            self._brake_released, self._brake_due = self._delayed(
                self._brake_released,
                self._command_bit(bits.release_brake),
                self._brake_due,
                _BRAKE_S,
            )
        self._move(_STEP_S)

    def _delayed(self, on: bool, asked: bool, due: float, delay_s: float) -> tuple[bool, float]:
        if asked == on:
            return on, math.inf
        due = min(due, self._time + delay_s)
        return (asked, math.inf) if self._time >= due else (on, due)

    def _move(self, dt: float) -> None:
        worn = RailFault.BRAKE_WORN in self.fault
        free = self._brake_released or worn
        if not self._enabled or not free:
            self._speed = 0.0
            self._moving = self._moving and self._enabled
            return
        if not self._moving:
            self.position_m += self._push / 100.0 * _SLIP_M_S * dt
        ramp = self._rail.acceleration_m_s2
        left = self._target - self.position_m if self._moving else 0.0
        target_speed = self._words.get(self._map.speed_register, 0) * self._map.metre_per_unit
        if self._command_bit(self._map.command.halt) or not self._moving:
            target_speed = 0.0
        braking = math.sqrt(2.0 * ramp * abs(left))
        aim = math.copysign(min(target_speed, braking), left)
        self._speed += max(-ramp * dt, min(ramp * dt, aim - self._speed))
        step = self._speed * dt
        if self._moving and abs(left) <= max(abs(step), 0.5 * self._map.metre_per_unit):
            self.position_m, self._speed, self._moving = self._target, 0.0, False
        else:
            self.position_m += step

    def _command_bit(self, bit: int) -> bool:
        return bool(self._words.get(self._map.command_register, 0) >> bit & 1)

    # -- the device

    def units(self) -> list[SimDevice]:
        """Return the units to serve: the drive and its panel."""
        known = _registers(self._map)
        block = [0] * (1 + max(known) - min(known))
        data = SimData(min(known), values=block, datatype=DataType.REGISTERS)
        return [SimDevice(self._map.unit, data, action=self._act), self.panel.device()]

    async def _act(
        self,
        _code: int,
        start: int,
        address: int,
        _count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if RailFault.TARGET_LOST in self.fault and values and address == self._map.target_register:
            values[:] = [False] * len(values)
        self.step()
        for register, value in enumerate(values or (), address):
            self._take(register, int(value))
        there = self._map
        counts = round(self.position_m / there.metre_per_unit) & 0xFFFFFFFF
        registers[there.position_register - start] = counts >> 16
        registers[there.position_register + 1 - start] = counts & 0xFFFF
        registers[there.status_register - start] = self._status()
        return None

    def _take(self, register: int, value: int) -> None:
        there, before = self._map, self._words.get(register, 0)
        self._words[register] = value
        if register == there.command_register:
            start = 1 << there.command.start
            if value & start and not before & start and self._enabled:
                high, low = (self._words.get(there.target_register + i, 0) for i in (0, 1))
                counts = high << 16 | low
                self._target = (counts - (1 << 32 if high >> 15 else 0)) * there.metre_per_unit
                self._moving = True
        elif register == there.push_register:
            self._push = float(value - (1 << 16 if value >> 15 else 0))
        watchdog = there.watchdog
        if watchdog is not None and register == watchdog.timeout_register:
            self._watchdog_s = value * watchdog.timeout_unit_s
        if watchdog is not None and register == watchdog.trigger_register:
            self._fed_at = self._clock()

    def _status(self) -> int:
        bits = self._map.status
        flags = {
            bits.enabled: self._enabled,
            bits.moving: self._speed != 0.0,
            bits.in_position: not self._moving,
            bits.fault: RailFault.DRIVE_FAULT in self.fault,
            bits.brake_released: self._brake_released,
        }
        return sum(1 << bit for bit, on in flags.items() if on)


def _registers(there: ModbusRail) -> list[int]:
    known = [
        *(there.target_register, there.target_register + 1, there.speed_register),
        *(there.position_register, there.position_register + 1),
        *(there.command_register, there.status_register),
    ]
    more = [there.push_register]
    if there.watchdog is not None:
        more += [there.watchdog.timeout_register, there.watchdog.trigger_register]
    return known + [register for register in more if register is not None]
