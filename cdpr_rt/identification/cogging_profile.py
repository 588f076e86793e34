"""The stored result of a motor's commissioning: one JSON file, valid for one drive and motor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from cdpr_profiles.bounded_input import replacing
from cdpr_profiles.drive import Unsigned32
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_profiles.reader import read_json_model
from cdpr_rt.control.compensation import AxisCompensation, FrictionFeedforward
from cdpr_rt.errors import ControlError
from cdpr_rt.identification.result import HarmonicResult
from cdpr_rt.identification.thesis import ThesisResult

CompensationMethod = Literal["thesis", "harmonic"]

_MOST_SAMPLES = 1 << 16
_LONGEST_s = 0.5
_Text = Annotated[str, Field(max_length=100)]
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Row = Annotated[list[float], Field(min_length=2, max_length=_MOST_SAMPLES)]


class CoggingProfileError(ControlError):
    """A profile cannot be read, or must not be applied to this axis."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class DriveIdentity(_Part):
    """Identity of drive (CANopen object 1018h) and encoder of a profile."""

    vendor_id: Unsigned32
    product_code: Unsigned32
    revision: Unsigned32
    serial: Unsigned32
    encoder_counts_per_turn: Annotated[Unsigned32, Field(gt=0)]


class StoredFriction(_Part):
    """`FrictionFeedforward` in the form of the file."""

    coulomb_forward_Nm: float
    coulomb_backward_Nm: float
    stribeck_forward_Nm: float
    stribeck_backward_Nm: float
    stribeck_speed_rad_s: Annotated[float, Field(gt=0.0)]
    viscous_Nms_rad: float

    @property
    def biases_Nm(self) -> tuple[float, float]:
        """Half the difference of forward and backward friction: at speed, and at standstill."""
        coulomb = 0.5 * (self.coulomb_forward_Nm - self.coulomb_backward_Nm)
        stribeck = 0.5 * (self.stribeck_forward_Nm - self.stribeck_backward_Nm)
        return coulomb, coulomb + stribeck

    @property
    def dry_friction_Nm(self) -> float:
        """The largest magnitude without the viscous part."""
        return max(
            abs(self.coulomb_forward_Nm) + abs(self.stribeck_forward_Nm),
            abs(self.coulomb_backward_Nm) + abs(self.stribeck_backward_Nm),
        )


class StoredHarmonic(_Part):
    """One order of the cogging; half-widths belong to 95 % confidence intervals."""

    order: Annotated[int, Field(gt=0)]
    amplitude_Nm: float
    amplitude_half_width_Nm: float
    phase_deg: float
    phase_half_width_deg: float
    per_pole_pair: float
    hint: str


class StoredMethod(_Part):
    """Tables over the turn from the index, rows: increasing angle, decreasing angle."""

    table_Nm: tuple[_Row, _Row]
    friction: StoredFriction
    look_ahead_s: Annotated[float, Field(ge=0.0, le=_LONGEST_s)]
    observer_s: Annotated[float, Field(ge=0.0, le=_LONGEST_s)]

    def faults(self, bounds: MotorBounds) -> Iterator[tuple[str, str]]:
        """Yield (key, problem) for values that are impossible for a motor with these bounds."""
        forward, backward = (max(map(abs, row)) for row in self.table_Nm)
        for i, peak in enumerate((forward, backward)):
            yield from bounds.compensation(f"table_Nm[{i}]", peak)
        friction = self.friction
        yield from bounds.compensation("friction", friction.dry_friction_Nm)
        yield from bounds.compensation(
            "table_Nm and friction together", max(forward, backward) + friction.dry_friction_Nm
        )
        of_table = math.fsum(map(math.fsum, self.table_Nm)) / (2 * len(self.table_Nm[0]))
        for of_friction in friction.biases_Nm:
            yield from bounds.bias(
                "mean of table_Nm and friction over both directions", of_table + of_friction
            )
        yield from bounds.viscous("friction.viscous_Nms_rad", friction.viscous_Nms_rad)
        yield from bounds.stribeck_speed(
            "friction.stribeck_speed_rad_s", friction.stribeck_speed_rad_s
        )

    def compensation(self, bounds: MotorBounds) -> AxisCompensation:
        """Return the compensation of an axis."""
        return AxisCompensation(
            table_Nm=np.array(self.table_Nm, float),
            most_Nm=bounds.compensation_Nm,
            friction=FrictionFeedforward(**self.friction.model_dump()),
            look_ahead_s=self.look_ahead_s,
            observer_s=self.observer_s,
        )


class CoggingProfile(_Part):
    """An identified motor, and the drive, motor and encoder for which it holds."""

    format: Literal[1] = 1
    motor: _Text
    drive: _Text
    identity: DriveIdentity
    temperature_C: Annotated[float, Field(ge=-60.0, le=200.0)] | None = None
    created: datetime
    raw_data: list[str]
    inertia_kg_m2: Annotated[float, Field(gt=0.0)]
    harmonics: list[StoredHarmonic]
    residual_rms_Nm: Annotated[float, Field(ge=0.0)]
    repaired_fraction: _Share
    coverage: _Share
    thesis: StoredMethod
    harmonic: StoredMethod

    def save(self, path: Path) -> None:
        """Write the profile atomically; it replaces a file of that name."""
        with replacing(path) as file:
            file.write(self.model_dump_json(by_alias=True, indent=1).encode() + b"\n")

    @classmethod
    def load(cls, path: Path) -> CoggingProfile:
        """Read a profile.

        Raises CoggingProfileError with file, key and value if the profile is not sound.
        """
        try:
            profile = read_json_model(path, cls)
        except ProfileError as error:
            raise CoggingProfileError(str(error)) from None
        for name, method in (("thesis", profile.thesis), ("harmonic", profile.harmonic)):
            forward, backward = method.table_Nm
            if len(forward) != len(backward):
                raise CoggingProfileError(
                    f"{path}: {name}.table_Nm: rows of {len(forward)} and {len(backward)} values; "
                    "allowed: rows of the same length"
                )
        return profile

    def require_true_of(self, bounds: MotorBounds) -> None:
        """Raise CoggingProfileError if the profile cannot be of this motor.

        The message gives key, value and allowed values.
        """
        motor = bounds.motor.model
        if motor != self.motor:
            raise CoggingProfileError(f"motor: value {self.motor!r}; allowed: {motor}")
        for key, problem in self._faults(bounds):
            raise CoggingProfileError(f"{key}: {problem}")

    def _faults(self, bounds: MotorBounds) -> Iterator[tuple[str, str]]:
        yield from bounds.inertia("inertia_kg_m2", self.inertia_kg_m2)
        total = math.fsum(abs(harmonic.amplitude_Nm) for harmonic in self.harmonics)
        yield from bounds.compensation("harmonics: sum of amplitude_Nm", total)
        for name, method in (("harmonic", self.harmonic), ("thesis", self.thesis)):
            for key, problem in method.faults(bounds):
                yield f"{name}.{key}", problem

    def compensation(
        self, method: CompensationMethod, identity: DriveIdentity, bounds: MotorBounds
    ) -> AxisCompensation:
        """Return the compensation of the axis.

        Raises CoggingProfileError if motor or drive differ from those at commissioning, or if
        the profile is impossible for the motor.
        """
        self.require_true_of(bounds)
        for key, mine in self.identity.model_dump().items():
            other = getattr(identity, key)
            if other != mine and key == "serial" and mine == IMPORTED_SERIAL:
                raise CoggingProfileError(
                    "identity.serial: is 0, because the cogging profile comes from an imported "
                    f"recording, but this axis has {other}: if the recording is of this motor, "
                    f"write {other} into the profile; else commission the motor"
                )
            if other != mine:
                raise CoggingProfileError(
                    f"the cogging profile is for a drive with {key} = {mine}, but this axis has "
                    f"{other}: commission it again"
                )
        return (self.thesis if method == "thesis" else self.harmonic).compensation(bounds)


IMPORTED_SERIAL = 0
"""Serial number of the drive in a profile from an imported recording, which does not have it."""
TABLE_SAMPLES = 4096
OBSERVER_s = 0.003


def stored_thesis(result: ThesisResult) -> StoredMethod:
    """Return the thesis' curves for storage; they apply at the encoder's angle."""
    return _stored(result, 0.0, 0.0)


def stored_harmonic_model(result: HarmonicResult, latency_s: float | None = None) -> StoredMethod:
    """Return the harmonic model's tables, friction and timing for storage.

    `latency_s` replaces the identified latency, because that of imported recordings is not the
    drive's.
    """
    return _stored(result, result.latency_s.value if latency_s is None else latency_s, OBSERVER_s)


def _stored(
    result: ThesisResult | HarmonicResult, look_ahead_s: float, observer_s: float
) -> StoredMethod:
    forward, backward = np.round(result.tables(TABLE_SAMPLES), 9).tolist()
    return StoredMethod(
        table_Nm=(forward, backward),
        friction=StoredFriction(**asdict(result.friction)),
        look_ahead_s=max(0.0, look_ahead_s),
        observer_s=observer_s,
    )


def stored_harmonics(result: HarmonicResult) -> list[StoredHarmonic]:
    """Return the identified orders for storage."""
    return [
        StoredHarmonic(
            order=h.order,
            amplitude_Nm=h.amplitude_Nm.value,
            amplitude_half_width_Nm=h.amplitude_Nm.half_width,
            phase_deg=h.phase_deg.value,
            phase_half_width_deg=h.phase_deg.half_width,
            per_pole_pair=h.per_pole_pair,
            hint=h.hint,
        )
        for h in result.harmonics
    ]
