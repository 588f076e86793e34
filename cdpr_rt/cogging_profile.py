"""The stored result of a motor's commissioning: one JSON file, valid for one drive and motor."""

from __future__ import annotations

import json
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cdpr_rt.compensation import AxisCompensation, FrictionFeedforward
from cdpr_rt.errors import ControlError
from cdpr_rt.identification import BetterResult, ThesisResult

Method = Literal["thesis", "better"]


class CoggingProfileError(ControlError):
    """A profile that cannot be read, or must not be applied to this axis."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class DriveIdentity(_Part):
    """Which drive and encoder a profile belongs to (CANopen object 1018h)."""

    vendor_id: int
    product_code: int
    revision: int
    serial: int
    encoder_counts_per_turn: Annotated[int, Field(gt=0)]


class StoredFriction(_Part):
    """As compensation.FrictionFeedforward."""

    coulomb_forward_Nm: float
    coulomb_backward_Nm: float
    stribeck_forward_Nm: float
    stribeck_backward_Nm: float
    stribeck_speed_rad_s: Annotated[float, Field(gt=0.0)]
    viscous_Nms_rad: float


class StoredHarmonic(_Part):
    """One order of the cogging; half-widths are of 95 % confidence intervals."""

    order: Annotated[int, Field(gt=0)]
    amplitude_Nm: float
    amplitude_half_width_Nm: float
    phase_deg: float
    phase_half_width_deg: float
    per_pole_pair: float
    hint: str


class StoredMethod(_Part):
    """Tables over the turn from the index, rows: increasing angle, decreasing angle."""

    table_Nm: tuple[list[float], list[float]]
    friction: StoredFriction
    look_ahead_s: Annotated[float, Field(ge=0.0)]
    observer_s: Annotated[float, Field(ge=0.0)]

    def compensation(self) -> AxisCompensation:
        """Return what an axis' compensation needs."""
        return AxisCompensation(
            table_Nm=np.array(self.table_Nm, float),
            friction=FrictionFeedforward(**self.friction.model_dump()),
            look_ahead_s=self.look_ahead_s,
            observer_s=self.observer_s,
        )


class CoggingProfile(_Part):
    """All that was learnt about one motor, and whose it is."""

    format: Literal[1] = 1
    motor: str
    drive: str
    identity: DriveIdentity
    temperature_C: float | None = None
    created: datetime
    raw_data: list[str]
    inertia_kg_m2: Annotated[float, Field(gt=0.0)]
    harmonics: list[StoredHarmonic]
    residual_rms_Nm: float
    repaired_fraction: float
    coverage: float
    thesis: StoredMethod
    better: StoredMethod

    def save(self, path: Path) -> None:
        """Write the profile; a file of that name is replaced at once or not at all."""
        part = path.with_suffix(path.suffix + ".part")
        part.write_text(self.model_dump_json(indent=1) + "\n", encoding="utf-8")
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> CoggingProfile:
        """Read a profile.

        Raises CoggingProfileError naming file, key and value for anything but a sound profile.
        """
        try:
            text = path.read_text(encoding="utf-8")
            json.loads(text)
        except OSError as error:
            raise CoggingProfileError(f"{path}: cannot be read: {error.strerror}") from error
        except ValueError as error:
            raise CoggingProfileError(f"{path}: is not a cogging profile: {error}") from error
        try:
            profile = cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            key = ".".join(str(k) for k in first["loc"])
            raise CoggingProfileError(
                f"{path}: {key} = {str(first['input'])[:60]}: {first['msg']}"
            ) from error
        for name, method in (("thesis", profile.thesis), ("better", profile.better)):
            forward, backward = method.table_Nm
            if len(forward) != len(backward) or len(forward) < 2:
                raise CoggingProfileError(
                    f"{path}: {name}.table_Nm has rows of {len(forward)} and {len(backward)} "
                    "values; both must have the same number, at least 2"
                )
        return profile

    def compensation(
        self,
        method: Method,
        identity: DriveIdentity,
        motor: str,
        *,
        index_will_be_seen: bool = True,
    ) -> AxisCompensation:
        """Return what the axis' compensation needs.

        Raises CoggingProfileError where motor or drive is another one than at commissioning, or
        where no index will tell the angle (`index_will_be_seen` False).
        """
        if motor != self.motor:
            raise CoggingProfileError(
                f"the cogging profile is of motor {self.motor}, this axis has {motor}"
            )
        for key, mine in self.identity.model_dump().items():
            other = getattr(identity, key)
            if other != mine:
                raise CoggingProfileError(
                    f"the cogging profile is of a drive with {key} = {mine}, "
                    f"this axis has {other}: commission it anew"
                )
        if not index_will_be_seen:
            raise CoggingProfileError(
                "the encoder index of this axis is not known: home it, or latch the index with the "
                "touch probe, before its cogging profile can be applied"
            )
        return (self.thesis if method == "thesis" else self.better).compensation()


TABLE_SAMPLES = 4096
OBSERVER_s = 0.003


def stored_thesis(result: ThesisResult) -> StoredMethod:
    """Return the thesis' curves as stored: read off at the encoder's angle, without look-ahead."""
    return _stored(result.tables(TABLE_SAMPLES), result.friction, 0.0, 0.0)


def stored_better(result: BetterResult) -> StoredMethod:
    """Return the better method's tables, friction and timing as stored."""
    ahead = max(0.0, result.latency_s.value)
    return _stored(result.tables(TABLE_SAMPLES), result.friction, ahead, OBSERVER_s)


def stored_harmonics(result: BetterResult) -> list[StoredHarmonic]:
    """Return the orders found, as stored."""
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


def _stored(
    table: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    friction: FrictionFeedforward,
    look_ahead_s: float,
    observer_s: float,
) -> StoredMethod:
    rounded = np.round(table, 9)
    return StoredMethod(
        table_Nm=(rounded[0].tolist(), rounded[1].tolist()),
        friction=StoredFriction(**asdict(friction)),
        look_ahead_s=look_ahead_s,
        observer_s=observer_s,
    )
