"""Simulated load-cell amplifiers: filter, noise, converter and registers of each."""

from __future__ import annotations

import math
import random
import struct
from typing import Annotated

from pydantic import Field
from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_profiles.tension_sensor import REGISTERS, RawValue, Sensor, TensionSensors
from cdpr_sim_bus.physics_board import BoardAxis, TensionFault
from cdpr_sim_bus.plant_file import PlantFile

HOLDING_CODES = (3, 6, 16, 22, 23)
_BEYOND = 1.02
"""Ratio of a converter's range to the specified range."""


class AmplifierPlant(PlantFile):
    """The truth about the simulated amplifiers, which no controller may read."""

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 7
    filter_Hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 15.0
    """Frequency of both poles of the low-pass filter before the converter."""
    noise_N: Annotated[float, Field(ge=0.0, le=100.0)] = 0.1
    """Standard deviation of a reading."""
    bits: Annotated[int, Field(ge=12, le=24)] = 18
    """Bits of the converter, over the range from lowest_N to highest_N."""
    gain_error: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.001
    """Relative error of every load cell."""
    zero_spread_N: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.5
    """Standard deviation of the zeros of the load cells."""
    tilt_noise_rad: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0005
    """Standard deviation of a reading of the inclinometer."""
    tilt_zero_spread_rad: Annotated[float, Field(ge=0.0, le=0.1)] = 0.001
    """Standard deviation of the inclinometer's zeros."""


class SimAmplifier:
    """One amplifier: follows the true tension of its cable and answers as `device`.

    Its time is the bus time of its cable's drive. At each reading, the filter has followed the
    tension up to that time. The noise depends only on the number of the reading.
    """

    def __init__(
        self, profile: TensionSensors, sensor: Sensor, plant: AmplifierPlant, axis: BoardAxis
    ) -> None:
        self.unit = sensor.unit
        self._fault = TensionFault.NONE
        assert profile.amplifier is not None  # there are sensors
        self._map = profile.amplifier
        self._plant = plant
        self._axis = axis
        self._random = random.Random(plant.seed * 1000 + sensor.unit)
        self._zero_N = self._random.gauss(0.0, plant.zero_spread_N)
        self._tare_N = 0.0
        state = axis.state()
        self._time_s = state.time_s
        self._first = self._second = state.tension_N
        self._samples, _ = axis.tension_history(0)
        span = self._map.highest_N - self._map.lowest_N
        self._quantum_N = span / 2.0**plant.bits

    @property
    def fault(self) -> TensionFault:
        """The fault that was set here, or else that of the physics board."""
        if self._fault is TensionFault.NONE:
            return self._axis.cell_fault
        return self._fault

    @fault.setter
    def fault(self, fault: TensionFault) -> None:
        self._fault = fault

    def _follow(self) -> None:
        """Advance the filter to the present bus time."""
        self._samples, tension_history = self._axis.tension_history(self._samples)
        rate = -2.0 * math.pi * self._plant.filter_Hz
        for time_s, tension_N in tension_history:
            share = 1.0 - math.exp(rate * max(time_s - self._time_s, 0.0))
            self._time_s = time_s
            self._first += share * (tension_N - self._first)
            self._second += share * (self._first - self._second)

    def measured_N(self) -> float:
        """Return a new reading before tare, with filter, zero, gain error, noise, quantisation."""
        self._follow()
        plant = self._plant
        true = self._second * (1.0 + plant.gain_error) + self._zero_N
        noisy = true + self._random.gauss(0.0, plant.noise_N)
        return round(noisy / self._quantum_N) * self._quantum_N

    def device(self) -> SimDevice:
        """Return the unit to serve."""
        spare = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        holding, inputs = (
            [SimData(0, values=[0] * self._size(kind), datatype=DataType.REGISTERS)]
            for kind in ("holding", "input")
        )
        return SimDevice(self.unit, (spare, list(spare), holding, inputs), action=self._act)

    def _size(self, kind: str) -> int:
        """Return the number of registers of a kind."""
        value, status, tare = self._map.value, self._map.status, self._map.tare
        ends = [1]
        if value.kind == kind:
            ends.append(value.address + REGISTERS[value.type])
        if status is not None and status.kind == kind:
            ends.append(status.address + 1)
        if tare is not None and kind == "holding":
            ends.append(tare.address + 1)
        return max(ends)

    async def _act(
        self,
        code: int,
        _start: int,
        address: int,
        _count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if values:
            return self._write(address, [int(value) for value in values])
        kind = "holding" if code in HOLDING_CODES else "input"
        raw, status = self._show()
        value, where = self._map.value, self._map.status
        if value.kind == kind:
            registers[value.address : value.address + len(raw)] = raw
        if where is not None and where.kind == kind:
            registers[where.address] = status
        return None

    def _write(self, address: int, values: list[int]) -> ExcCodes | None:
        tare = self._map.tare
        if tare is None or address != tare.address or len(values) != 1:
            return ExcCodes.ILLEGAL_ADDRESS
        if values[0] != tare.value:
            return ExcCodes.ILLEGAL_VALUE
        self._follow()
        self._tare_N = self._second * (1.0 + self._plant.gain_error) + self._zero_N
        return None

    def _show(self) -> tuple[list[int], int]:
        """Return the value registers of a new reading, and the status."""
        map_ = self._map
        value, status = map_.value, map_.status
        reading = self.measured_N() - self._tare_N
        over = self.fault is TensionFault.OVER_RANGE or reading > map_.highest_N
        if self.fault is TensionFault.OVER_RANGE:
            reading = map_.highest_N * _BEYOND
        raw = reading / value.scale_N
        bits = 0
        if self.fault is TensionFault.BROKEN_WIRE:  # an open bridge saturates the converter
            raw = (value.broken_wire_raw or (map_.highest_N * _BEYOND / value.scale_N,))[0]
            bits = _bit(status.broken_wire_bit if status else None)
        elif over or reading < map_.lowest_N:
            bits = _bit(status.over_range_bit if status else None)
        return registers_of(raw, value), bits


def _bit(number: int | None) -> int:
    return 0 if number is None else 1 << number


def registers_of(raw: float, value: RawValue) -> list[int]:
    """Return a number as registers in the format of `value`, saturated."""
    if value.type == "float32":
        packed = struct.pack(">f", raw)
    else:
        size, signed = 2 * REGISTERS[value.type], value.type.startswith("int")
        top = (1 << 8 * size - signed) - 1
        bottom = -top - 1 if signed else 0
        packed = max(bottom, min(top, round(raw))).to_bytes(size, "big", signed=signed)
    words = [int.from_bytes(packed[i : i + 2], "big") for i in range(0, len(packed), 2)]
    return words if value.word_order == "big" else words[::-1]
