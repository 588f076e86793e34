"""Servo drives: PDOs, units, signs, timeouts and quirks of a drive type as data."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cdpr_profiles.reader import Profile, one_of

Sign = Annotated[int, one_of(-1, 1)]
Unsigned8 = Annotated[int, Field(ge=0, le=0xFF)]
Unsigned16 = Annotated[int, Field(ge=0, le=0xFFFF)]
Unsigned32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
Mode = Annotated[int, Field(ge=-128, le=127)]

TorqueUnit = Literal["per_mille_of_rated", "percent_of_rated", "mNm", "cNm", "mA_rms", "mA_peak"]
"""Unit of 6071h, 6072h, 6077h, 60B2h and, per second, of 6087h; mA are of the motor's current."""
RatedTorqueUnit = Literal["mNm", "uNm"]
"""Unit of 6076h, to which relative torque units refer."""
VelocityUnit = Literal["counts_per_s", "rpm"]
"""Unit of 6099h and the other velocities."""
AccelerationUnit = Literal["counts_per_s2", "rpm_per_s"]
"""Unit of 609Ah and the other accelerations."""

_PROFILE_TORQUE = 4


class PdoEntry(Profile):
    """One object in a PDO."""

    index: Unsigned16
    subindex: Unsigned8 = 0
    bits: Annotated[int, one_of(8, 16, 32)]

    @property
    def mapping(self) -> int:
        """The value of a mapping entry (CiA 301: index, sub-index, length)."""
        return self.index << 16 | self.subindex << 8 | self.bits


class Pdo(Profile):
    """One PDO as the master configures it; a time of 0 switches the timer off."""

    number: int = Field(ge=1, le=512)
    cob_id_offset: int = Field(ge=0x180, le=0x500)
    transmission_type: Unsigned8
    inhibit_time_s: float = Field(default=0.0, ge=0, le=6.5535)
    event_timer_s: float = Field(default=0.0, ge=0, le=65.535)
    entries: tuple[PdoEntry, ...] = Field(min_length=1, max_length=8)

    @model_validator(mode="after")
    def _fits_a_frame(self) -> Self:
        bits = sum(e.bits for e in self.entries)
        if bits > 64:
            raise ValueError(f"entries: {bits} bits; allowed: at most 64 in one frame")
        return self

    def cob_id(self, node_id: int) -> int:
        """Identifier of this PDO for a node."""
        return self.cob_id_offset + node_id


class Quirks(Profile):
    """Deviations of a drive from the state machine of CiA 402.

    The master never changes the mode of an enabled drive, so drives that reject such changes need
    no key.
    """

    halt_before_mode_change: bool = False
    """The drive accepts 6060h only while bit 8 of the controlword (halt) is set."""
    homing_done_by_bit_12_alone: bool = False
    """Bit 10 of the statusword has no meaning in homing mode; bit 12 is set only at standstill."""
    boot_ups: int = Field(default=1, ge=1, le=3)
    """Number of boot-up messages that the drive sends after one reset."""


class Evidence(Profile):
    """Evidence for one fact of a profile."""

    status: Literal["verified", "manual", "assumed"]
    how: str = Field(min_length=1)


class DriveProfile(Profile):
    """One CiA 402 drive type.

    `eds` is the path of its electronic data sheet. Objects that the EDS lacks are not read. Instead
    of 6076h the motor's rated torque applies, instead of 608Fh the winch's encoder resolution, and
    instead of 6502h `supported_modes`.

    `torque_unit`, `rated_torque_unit`, `velocity_unit` and `acceleration_unit` are units of the
    drive's objects. Each sign converts a direction of the drive into the motor's:
    `position_sign` is -1 if 6064h falls while the motor turns forward, `torque_sign` if a positive
    6071h drives it backward, and `homing_sign` if method 34 seeks the index backward.

    `torque_slope_Nm_s` is written to 6087h for modes with a torque ramp (PT, 4). It should be as
    steep as the drive accepts, because a ramp adds a lag to the loop. `torque_delay_s` is the
    nominal lag of its current loop, `feedback_delay_s` the nominal age of the reported position.
    `rpdos` must carry 6040h and 6071h, in one PDO or in two; `tpdos` 6041h, 6064h and 6077h, in
    any number of PDOs that answer every SYNC (transmission type 1).
    """

    name: str = Field(min_length=1)
    eds: Path = Field(strict=False)
    vendor_id: Unsigned32
    product_code: Unsigned32
    revision: Unsigned32
    serial: Unsigned32 | None = None
    supported_modes: tuple[Mode, ...] = Field(min_length=1)
    mode_torque: Mode = 10
    homing_methods: tuple[Mode, ...] = ()
    torque_unit: TorqueUnit = "per_mille_of_rated"
    rated_torque_unit: RatedTorqueUnit = "mNm"
    torque_slope_Nm_s: float | None = Field(default=None, gt=0)
    velocity_unit: VelocityUnit = "counts_per_s"
    acceleration_unit: AccelerationUnit = "counts_per_s2"
    position_sign: Sign = 1
    torque_sign: Sign = 1
    homing_sign: Sign = 1
    mode_display_timeout_s: float = Field(gt=0, le=10)
    state_timeout_s: float = Field(gt=0, le=60)
    feedback_delay_s: float = Field(ge=0, le=0.1)
    torque_delay_s: float = Field(ge=0, le=0.1)
    heartbeat_producer_s: float = Field(ge=0.001, le=65.535)
    heartbeat_consumer_s: float = Field(ge=0.001, le=65.535)
    rpdos: tuple[Pdo, ...] = Field(min_length=1)
    tpdos: tuple[Pdo, ...] = Field(min_length=1)
    quirks: Quirks = Quirks()
    verified: dict[str, Evidence] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.mode_torque not in self.supported_modes:
            raise ValueError(
                f"mode_torque: value {self.mode_torque}; allowed: one of supported_modes"
            )
        if self.mode_torque == _PROFILE_TORQUE and self.torque_slope_Nm_s is None:
            raise ValueError(
                "torque_slope_Nm_s: is missing, but mode_torque = 4 (PT) needs it for 6087h; "
                "allowed: above 0"
            )
        for kind, pdos in (("rpdos", self.rpdos), ("tpdos", self.tpdos)):
            for key in ("number", "cob_id_offset"):
                values = [getattr(pdo, key) for pdo in pdos]
                if len(set(values)) < len(values):
                    raise ValueError(f"{kind}: {key} {values}; allowed: each value once")
        both = {p.cob_id_offset for p in self.rpdos} & {p.cob_id_offset for p in self.tpdos}
        if both:
            raise ValueError(
                f"rpdos: cob_id_offset {min(both):03X}h is also that of a TPDO; allowed: each "
                "value once, because two senders of one identifier destroy each other's frames"
            )
        unknown = [fact for fact in self.verified if fact not in type(self).model_fields]
        if unknown:
            raise ValueError(f"verified.{unknown[0]}: unknown key; allowed: a key of this file")
        return self
