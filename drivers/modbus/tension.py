"""Load cells and an inclinometer on one serial line, sampled by a task in parallel to the cycle."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from cdpr_drivers.modbus.channel import LineError, ModbusError, ModbusLine
from cdpr_profiles.tension_sensor import (
    MOST_REGISTERS,
    REGISTERS,
    Amplifier,
    AngleValue,
    DataType,
    Inclinometer,
    RawValue,
    RegisterKind,
    TensionSensors,
)
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.clock import Clock, Task
from cdpr_rt.core.exchange import TensionExchange, TensionFault
from cdpr_rt.model.rigid_body import rotation

_FORMATS: Final[dict[DataType, str]] = {
    "int16": ">h",
    "uint16": ">H",
    "int32": ">i",
    "uint32": ">I",
    "float32": ">f",
}
_REOPEN_S = 0.5


@dataclass(frozen=True)
class Reading:
    """One reading of one load cell."""

    cable: str
    tension_N: float
    fault: TensionFault


def raw_value(value: RawValue, registers: list[int]) -> float:
    """Return the number that registers hold, in the units of the amplifier."""
    words = registers if value.word_order == "big" else registers[::-1]
    packed = struct.pack(f">{len(words)}H", *words)
    return float(struct.unpack(_FORMATS[value.type], packed)[0])


class LoadCells:
    """The load cells of a profile on an open line; reads and tares them individually.

    Methods raise ModbusError. Only one task of `clock` may use it at a time.
    """

    def __init__(self, profile: TensionSensors, port: str, clock: Clock) -> None:
        self.profile = profile
        self.line = ModbusLine(
            port,
            profile.baudrate,
            clock,
            parity=profile.parity,
            stop_bits=profile.stop_bits,
            timeout_s=profile.answer_timeout_s,
            retries=profile.retries,
        )
        amplifier = profile.amplifier
        self._requests = [] if amplifier is None else _requests(amplifier)

    def read(self, number: int) -> Reading:
        """Read one load cell, counted from 0."""
        sensor, amplifier = self.profile.sensors[number], self.profile.amplifier
        assert amplifier is not None  # there are sensors
        got = {
            (kind, start + i): word
            for kind, start, count in self._requests
            for i, word in enumerate(self.line.registers(kind, sensor.unit, start, count))
        }
        value, status = amplifier.value, amplifier.status
        words = [got[value.kind, value.address + i] for i in range(REGISTERS[value.type])]
        raw = raw_value(value, words)
        tension = sensor.gain * raw * value.scale_N - sensor.zero_N
        bits = 0 if status is None else got[status.kind, status.address]
        broken = None if status is None else status.broken_wire_bit
        over = None if status is None else status.over_range_bit
        fault = TensionFault.NONE
        if raw != raw or raw in value.broken_wire_raw or _is_set(bits, broken):  # noqa: PLR0124
            fault = TensionFault.BROKEN_WIRE  # a load cell never measures NaN
        elif _is_set(bits, over) or not amplifier.lowest_N <= tension <= amplifier.highest_N:
            fault = TensionFault.OVER_RANGE
        return Reading(sensor.cable, tension, fault)

    def upward(self, tilt: Inclinometer) -> FloatArray:
        """Read the inclinometer; return the upward direction in the platform's frame, (3,)."""
        roll, pitch = self._angle(tilt.unit, tilt.roll), self._angle(tilt.unit, tilt.pitch)
        x, y = -math.sin(pitch), math.sin(roll)
        if tilt.angles == "roll-pitch":
            y *= math.cos(pitch)
        below = math.cos(roll) < 0.0
        z = math.sqrt(max(1.0 - x * x - y * y, 0.0)) * (-1.0 if below else 1.0)
        return np.asarray(rotation(np.array(tilt.mounting_rad)) @ [x, y, z])

    def _angle(self, unit: int, value: AngleValue) -> float:
        words = self.line.registers(value.kind, unit, value.address, REGISTERS[value.type])
        angle = raw_value(value, words) * value.scale_rad - value.zero_rad
        if not abs(angle) <= math.pi:
            raise ModbusError(
                f"inclinometer: an angle of {angle:.4g} rad; check type and scale_rad"
            )
        return angle

    def tare(self, number: int) -> None:
        """Set an amplifier's present reading as its zero; needs `amplifier.tare`."""
        amplifier = self.profile.amplifier
        assert amplifier is not None and amplifier.tare is not None
        tare = amplifier.tare
        self.line.write_register(self.profile.sensors[number].unit, tare.address, tare.value)

    def close(self) -> None:
        """Close the line."""
        self.line.close()


def _is_set(bits: int, bit: int | None) -> bool:
    return bit is not None and bool(bits >> bit & 1)


def _requests(amplifier: Amplifier) -> list[tuple[RegisterKind, int, int]]:
    """Return (kind, start, count) of each read request; a single one if it covers all."""
    value, status = amplifier.value, amplifier.status
    size = REGISTERS[value.type]
    if status is None:
        return [(value.kind, value.address, size)]
    first = min(value.address, status.address)
    count = max(value.address + size, status.address + 1) - first
    if value.kind == status.kind and count <= MOST_REGISTERS:
        return [(value.kind, first, count)]
    return [(value.kind, value.address, size), (status.kind, status.address, 1)]


class TensionSampler:
    """Reads all load cells in turn in a task of `clock` and publishes the readings.

    The cycle reads `exchange`. Failed sensors are polled again in turn, and a lost port is opened
    again. `errors` has the last error of each sensor.
    """

    def __init__(self, profile: TensionSensors, port: str, clock: Clock) -> None:
        names = [sensor.cable for sensor in profile.sensors]
        self.exchange = TensionExchange(names, profile.stale_after_s, clock)
        self.errors = [""] * len(names)
        self.readings = [0] * len(names)
        """Good answers of each sensor so far."""
        self.tilt_error = ""
        """The last error of the inclinometer."""
        self._tilt = profile.inclinometer
        if self._tilt is not None:
            self.exchange.publish_upward(None, 0.0)
        self._cells = LoadCells(profile, port, clock)
        self._clock = clock
        self._rounds = 0
        self._task: Task[None] | None = None

    def start(self) -> Self:
        """Open the line and start to sample. Raises LineError if the port does not open."""
        self._cells.line.open()
        self._task = self._clock.start(self._run)
        return self

    def await_readings(self, timeout_s: float) -> None:
        """Wait until every sensor has been read at least once; raises ModbusError."""
        upward = self.exchange.feedback.upward

        def read() -> bool:
            return all(self.readings) and (self._tilt is None or bool(upward[1:].any()))

        if not self._clock.wait(read, self._clock.now_s + timeout_s):
            if all(self.readings):
                why = self.tilt_error or f"inclinometer: no reading within {timeout_s:g} s"
                raise ModbusError(why)
            missing = self.readings.index(0)
            cable = self.exchange.cables[missing]
            why = self.errors[missing] or f"no reading within {timeout_s:g} s"
            raise ModbusError(f"{cable}: {why}")

    def stop(self) -> None:
        """End the task and close the line."""
        if self._task is not None:
            self._clock.cancel(self._task)
        self._cells.close()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _run(self) -> None:
        clock = self._clock
        due_s = clock.now_s
        while True:
            pause_s = self._round()
            due_s = max(due_s + self._cells.profile.period_s, clock.now_s + pause_s)
            clock.wait(None, due_s)

    def _round(self) -> float:
        """Read every sensor once; return the minimum wait before the next round.

        Only one of the sensors that failed last time is polled, and only once, so that silent
        sensors do not delay the readings of the others.
        """
        failing = [number for number, error in enumerate(self.errors) if error]
        again = failing[self._rounds % len(failing)] if failing else -1
        self._rounds += 1
        for number in range(self.exchange.n):
            if number in failing and number != again:
                continue
            asked_s = self._clock.now_s
            try:
                self._cells.line.retrying = number not in failing
                reading = self._cells.read(number)
            except LineError as error:
                self.errors = [str(error)] * self.exchange.n
                return _REOPEN_S
            except ModbusError as error:
                self.errors[number] = str(error)
                continue
            self.errors[number] = ""
            self.exchange.publish(number, reading.tension_N, asked_s, reading.fault)
            self.readings[number] += 1
        if self._tilt is not None:
            asked_s = self._clock.now_s
            try:
                self._cells.line.retrying = not self.tilt_error
                self.exchange.publish_upward(self._cells.upward(self._tilt), asked_s)
                self.tilt_error = ""
            except LineError:
                return _REOPEN_S
            except ModbusError as error:
                self.tilt_error = str(error)
        return 0.0
