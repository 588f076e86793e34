"""Sensors on one RS-485 line: amplifiers of load cells and an inclinometer, and their registers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.places import require
from cdpr_profiles.reader import Profile, one_of, read_toml_model, require_unique

_LAST_ADDRESS = 0xFFFF
Address = Annotated[int, Field(ge=0, le=_LAST_ADDRESS)]
RegisterKind = Literal["input", "holding"]
DataType = Literal["int16", "uint16", "int32", "uint32", "float32"]
REGISTERS: dict[DataType, int] = {"int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2}
"""Number of 16-bit registers of each type."""
MOST_REGISTERS = 32


class RawValue(Profile):
    """Location of a measured value."""

    kind: RegisterKind
    address: Address
    type: DataType
    word_order: Literal["big", "little"] = "big"
    """Word of a 32-bit value that comes first: the high one (big) or the low one."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        most = _LAST_ADDRESS + 1 - REGISTERS[self.type]
        if self.address > most:
            raise ValueError(f"address: {self.address} for {self.type}; allowed: up to {most}")
        return self


class AngleValue(RawValue):
    """Location of a measured angle: rad = raw value × scale - zero."""

    scale_rad: float = Field(ge=-1.0, le=1.0)
    """Scale; negative if the sensor counts in the opposite direction."""
    zero_rad: float = Field(default=0.0, ge=-1.0, le=1.0)

    @model_validator(mode="after")
    def _scaled(self) -> Self:
        if self.scale_rad == 0.0:
            raise ValueError("scale_rad: value 0; allowed: another number from -1 to 1")
        return self


class Inclinometer(Profile):
    """An inclinometer or AHRS on the platform."""

    unit: int = Field(ge=1, le=247)
    roll: AngleValue
    pitch: AngleValue
    angles: Literal["roll-pitch", "inclinations"] = "roll-pitch"
    """roll-pitch: roll about x, then pitch about y. inclinations: roll is the angle of y above the
    horizontal, pitch the angle of x below it."""
    mounting_rad: Annotated[tuple[float, ...], Field(min_length=3, max_length=3)] = (0.0, 0.0, 0.0)
    """Rotation vector from the sensor's frame to the platform's."""


class ValueMap(RawValue):
    """Location of the measured value: newton = raw value × scale."""

    scale_N: float = Field(gt=0, le=1e6)
    broken_wire_raw: tuple[float, ...] = ()
    """Raw values by which some amplifiers report a broken wire."""


class StatusMap(Profile):
    """A register with fault bits; bit 0 is the lowest."""

    kind: RegisterKind
    address: Address
    over_range_bit: int | None = Field(default=None, ge=0, le=15)
    broken_wire_bit: int | None = Field(default=None, ge=0, le=15)


class TareMap(Profile):
    """A holding register that makes the amplifier use its present reading as zero."""

    address: Address
    value: int = Field(default=1, ge=0, le=0xFFFF)
    settle_s: float = Field(default=0.5, ge=0, le=60)
    """Time that the amplifier needs to tare."""


class Amplifier(Profile):
    """Properties common to all amplifiers of the line."""

    value: ValueMap
    status: StatusMap | None = None
    tare: TareMap | None = None
    lowest_N: float = Field(default=-1e6, ge=-1e6, le=1e6)
    highest_N: float = Field(ge=-1e6, le=1e6)
    """Readings outside these are over range, even if the status register reports no fault."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.lowest_N >= self.highest_N:
            raise ValueError(f"lowest_N = {self.lowest_N} must be below {self.highest_N}")
        status = self.status
        if status is not None and status.over_range_bit is status.broken_wire_bit is None:
            raise ValueError("status: allowed: at least one of over_range_bit, broken_wire_bit")
        return self


class Sensor(Profile):
    """One load cell: `newton = gain × raw × scale − zero`."""

    cable: str = Field(min_length=1)
    """Name of its cable in messages, such as "winch 1"."""
    unit: int = Field(ge=1, le=247)
    gain: float = Field(default=1.0, gt=0, le=100)
    zero_N: float = Field(default=0.0, ge=-1e6, le=1e6)


class TensionSensors(Profile):
    """Sensors on one serial line: load cells, one per cable in the order of the axes, an
    inclinometer, or both."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    baudrate: Annotated[
        int, one_of(1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800)
    ] = 115200
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: Annotated[int, one_of(1, 2)] = 1
    answer_timeout_s: float = Field(default=0.05, ge=0.005, le=5)
    retries: int = Field(default=1, ge=0, le=5)
    period_s: float = Field(default=0.05, ge=0.002, le=10)
    """Time between readings of each sensor, if the line is fast enough."""
    stale_after_s: float = Field(default=0.25, ge=0.01, le=60)
    """Age above which a reading is not valid."""
    stop_above_N: float = Field(default=1e6, gt=0, le=1e6)
    """Tension above which a motion is stopped."""
    amplifier: Amplifier | None = None
    sensors: tuple[Sensor, ...] = Field(default=(), max_length=64)
    inclinometer: Inclinometer | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for key in ("cable", "unit"):
            require_unique(f"sensors: {key}", [getattr(sensor, key) for sensor in self.sensors])
        tilt = self.inclinometer
        if (self.amplifier is None) is not (not self.sensors):
            raise ValueError("amplifier and sensors: give both or neither")
        if self.amplifier is None and tilt is None:
            raise ValueError("amplifier: is missing; omit it only if there is an inclinometer")
        if tilt is not None and tilt.unit in [sensor.unit for sensor in self.sensors]:
            raise ValueError(f"inclinometer.unit: {tilt.unit} is that of a load cell")
        if self.stale_after_s < 2 * self.period_s:
            raise ValueError(
                f"stale_after_s: value {self.stale_after_s}; allowed: at least two periods "
                f"({2 * self.period_s:g})"
            )
        return self


def load_tension_sensors(name: str | Path) -> TensionSensors:
    """Return tension sensors by name or path; raises ProfileError."""
    return read_toml_model(require("tension_sensors", name), TensionSensors)


def load_load_cells(name: str | Path) -> tuple[TensionSensors, Amplifier]:
    """Return tension sensors with load cells, and their amplifier; raises ProfileError."""
    profile = load_tension_sensors(name)
    if profile.amplifier is None:
        raise ProfileError(str(name), "sensors", "is missing; allowed here: one or more load cells")
    return profile, profile.amplifier
