"""Rails: motorised linear axes on which winches stand (Tremblay (thesis), section 3.7.1)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cdpr_profiles.places import require
from cdpr_profiles.reader import Profile, one_of, read_toml_model, require_unique
from cdpr_profiles.safety_io import Address, DeviceWatchdog

Bit = Annotated[int, Field(ge=0, le=15)]


class BrakeCheck(Profile):
    """Test of the applied brake before a move: it must hold a push in both directions."""

    torque_percent: float = Field(default=10.0, gt=0, le=100)
    """Share of the rated torque; below the brake's holding torque, above the friction."""
    seconds: float = Field(default=0.2, gt=0, le=10)
    """Duration of the push in each direction."""
    allowed_m: float = Field(default=2e-4, gt=0, le=0.1)
    """Largest movement that counts as play."""


class Cia402Rail(Profile):
    """A CiA 402 drive in profile position mode, its brake behind a safety I/O."""

    drive: str
    node_id: int = Field(ge=1, le=127)
    master_node_id: int = Field(default=127, ge=1, le=127)
    travel_per_turn_m: float = Field(gt=0, le=10)
    """Travel of the carriage in one motor turn."""
    direction: Annotated[int, one_of(-1, 1)] = 1
    """-1 if a positive motor turn moves towards 0."""
    zero_counts: int = Field(default=0, ge=-(2**31), le=2**31 - 1)
    """The drive's position (6064h) at 0 m."""
    torque_limit_Nm: float = Field(gt=0, le=1000)
    brake_axis: str = Field(min_length=1)
    """Axis of the safety I/O with the brake."""


class CommandBits(Profile):
    """Bits of the command register."""

    enable: Bit
    start: Bit
    """Its rising edge starts a move to the target."""
    halt: Bit
    release_brake: Bit


class StatusBits(Profile):
    """Bits of the status register."""

    enabled: Bit
    moving: Bit
    in_position: Bit
    fault: Bit
    brake_released: Bit


class ModbusRail(Profile):
    """A position axis on Modbus TCP. All registers are holding registers; a position takes two,
    high word first."""

    host: str = Field(min_length=1)
    port: int = Field(default=502, ge=1, le=65535)
    unit: int = Field(default=1, ge=0, le=255)
    answer_timeout_s: float = Field(default=0.2, ge=0.01, le=5)
    metre_per_unit: float = Field(gt=0, le=1)
    """Unit of target and position; speed is in this unit per second."""
    target_register: Address
    speed_register: Address
    position_register: Address
    command_register: Address
    status_register: Address
    push_register: Address | None = None
    """Register for a torque in percent of rated torque (signed), while no move is running."""
    command: CommandBits
    status: StatusBits
    brake_timeout_s: float = Field(default=0.5, gt=0, le=10)
    watchdog: DeviceWatchdog | None = None

    @model_validator(mode="after")
    def _bits_once(self) -> Self:
        for key, bits in (("command", self.command), ("status", self.status)):
            require_unique(f"{key}: bits", list(bits.model_dump().values()))
        return self


class RailProfile(Profile):
    """One rail: its limits, and either `cia402` or `modbus`."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    robot: str = Field(min_length=1)
    """Robot whose calibration becomes invalid when the rail moves."""
    kind: Literal["cia402", "modbus"]
    travel_min_m: float
    travel_max_m: float
    speed_m_s: float = Field(gt=0, le=10)
    acceleration_m_s2: float = Field(default=0.5, gt=0, le=100)
    tolerance_m: float = Field(gt=0, le=0.1)
    slack_below_N: float = Field(default=5.0, gt=0, le=1000)
    """A cable with less tension counts as slack."""
    brake_check: BrakeCheck = BrakeCheck()
    cia402: Cia402Rail | None = None
    modbus: ModbusRail | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.travel_min_m >= self.travel_max_m:
            raise ValueError(
                f"travel_min_m: value {self.travel_min_m}; allowed: below travel_max_m "
                f"({self.travel_max_m})"
            )
        given = [kind for kind in ("cia402", "modbus") if getattr(self, kind) is not None]
        if given != [self.kind]:
            raise ValueError(
                f"kind: value {self.kind!r}; allowed: cia402 or modbus, with the table of that "
                f"name (given: {', '.join(given) or 'none'})"
            )
        return self


def load_rail(name: str | Path) -> RailProfile:
    """Return a rail by name or path; raises ProfileError."""
    return read_toml_model(require("rails", name), RailProfile)
