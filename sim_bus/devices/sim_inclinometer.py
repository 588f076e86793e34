"""Simulated inclinometer on the platform: two angles in registers."""

from __future__ import annotations

import math
import random

from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from cdpr_profiles.tension_sensor import REGISTERS, AngleValue, Inclinometer
from cdpr_sim_bus.devices.sim_load_cells import (
    HOLDING_CODES,
    AmplifierPlant,
    registers_of,
)
from cdpr_sim_bus.physics_board import BoardPlatform, TensionFault

_LEVEL = (0.0, 0.0, 1.0)


class SimInclinometer:
    """An inclinometer: measures its tilt against gravity and answers as `device`."""

    def __init__(
        self, profile: Inclinometer, plant: AmplifierPlant, platform: BoardPlatform
    ) -> None:
        self.unit = profile.unit
        self.fault = TensionFault.NONE
        self._profile, self._plant, self._platform = profile, plant, platform
        self._random = random.Random(plant.seed * 1000 + profile.unit)
        self._zeros = [self._random.gauss(0.0, plant.tilt_zero_spread_rad) for _ in range(2)]

    def angles_rad(self) -> tuple[float, float]:
        """Return a new reading of roll and pitch."""
        x, y, z = _turned_back(self._upward(), self._profile.mounting_rad)
        pitch = math.atan2(-x, math.hypot(y, z))
        roll = math.atan2(y, z)
        if self._profile.angles == "inclinations":
            roll = math.atan2(y, math.hypot(x, z))
        angles = (
            true + zero + self._random.gauss(0.0, self._plant.tilt_noise_rad)
            for true, zero in zip((roll, pitch), self._zeros, strict=True)
        )
        return next(angles), next(angles)

    def _upward(self) -> tuple[float, ...]:
        """Return the upward direction in the platform's frame: the rotation's last row."""
        state = self._platform.state()
        return _LEVEL if state is None else state.rotation[6:]

    def device(self) -> SimDevice:
        """Return the unit to serve."""
        spare = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        last = max(v.address + REGISTERS[v.type] for v in (self._profile.roll, self._profile.pitch))
        holding, inputs = (
            [SimData(0, values=[0] * last, datatype=DataType.REGISTERS)] for _ in range(2)
        )
        return SimDevice(self.unit, (spare, list(spare), holding, inputs), action=self._act)

    async def _act(
        self,
        code: int,
        _start: int,
        _address: int,
        _count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if values:
            return ExcCodes.ILLEGAL_ADDRESS
        kind = "holding" if code in HOLDING_CODES else "input"
        maps = (self._profile.roll, self._profile.pitch)
        for value, angle in zip(maps, self.angles_rad(), strict=True):
            if value.kind == kind:
                self._show(value, angle, registers)
        return None

    @staticmethod
    def _show(value: AngleValue, angle_rad: float, registers: list[int]) -> None:
        words = registers_of((angle_rad + value.zero_rad) / value.scale_rad, value)
        registers[value.address : value.address + len(words)] = words


def _turned_back(vector: tuple[float, ...], by_rad: tuple[float, ...]) -> tuple[float, ...]:
    """Return a vector rotated by the inverse of a rotation vector, by Rodrigues' formula."""
    angle = math.sqrt(sum(x * x for x in by_rad))
    if angle == 0.0:
        return vector
    a, b, c = (x / angle for x in by_rad)
    x, y, z = vector
    along = a * x + b * y + c * z
    cosine, sine = math.cos(angle), -math.sin(angle)
    crossed = (b * z - c * y, c * x - a * z, a * y - b * x)
    axis = (a, b, c)
    return tuple(
        cosine * v + sine * w + (1.0 - cosine) * along * u
        for u, v, w in zip(axis, vector, crossed, strict=True)
    )
