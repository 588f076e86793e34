"""Motors: one with the values a controller needs, and a manufacturer's tables of a series."""

import math
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from cdpr_profiles.reader import Profile

Positive = Annotated[float, Field(gt=0)]
Plausible = Annotated[float, Field(ge=1e-9, le=1e6)]
"""A plausible value of a motor in its unit; others are typing errors."""
Dashed = Annotated[float, Field(gt=0)] | None

RAD_S_PER_RPM = 2.0 * math.pi / 60.0
_DASH = "—"
_TORQUE_RATIO = 2.0
"""Largest factor between the rated torque and the product of torque constant and rated current."""


def dash_to_none(value: Any) -> Any:
    """Return None if the source has a dash, else the value."""
    return None if value == _DASH else value


def records(columns: tuple[Any, ...], rows: tuple[Any, ...]) -> tuple[dict[str, Any], ...]:
    """Return the rows keyed by column name; raises ValueError for a row of another length."""
    for number, row in enumerate(rows):
        if not isinstance(row, tuple) or len(row) != len(columns):
            raise ValueError(f"row {number} is {row!r}; allowed: {len(columns)} values, as columns")
    return tuple(
        {str(name): dash_to_none(value) for name, value in zip(columns, row, strict=True)}
        for row in rows
    )


class Motor(Profile):
    """One synchronous servo motor.

    Torques in Nm at the shaft; currents in A rms; resistance and inductance line to line.
    """

    model: str = Field(min_length=1, max_length=64)
    manufacturer: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()
    poles: int = Field(ge=2, le=1000, multiple_of=2)
    slots: int | None = Field(default=None, ge=3, le=1000)
    """Number of stator slots, which explains the cogging orders."""
    torque_constant_Nm_per_Arms: Plausible
    rated_torque_Nm: Plausible
    stall_torque_Nm: Plausible
    peak_torque_Nm: Plausible
    rated_current_Arms: Plausible
    stall_current_Arms: Plausible
    peak_current_Arms: Plausible
    rated_speed_rpm: Plausible
    resistance_ohm: Plausible
    inductance_H: Plausible
    rotor_inertia_kg_m2: Plausible
    max_dc_bus_voltage_V: Plausible | None = None
    max_winding_temperature_degC: float | None = Field(default=None, ge=0, le=1000)
    mass_kg: Plausible | None = None

    @property
    def pole_pairs(self) -> int:
        """Electrical periods per turn."""
        return self.poles // 2

    @property
    def rated_speed_rad_s(self) -> float:
        """Rated speed in rad/s."""
        return self.rated_speed_rpm * RAD_S_PER_RPM

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for what, rated, peak in (
            ("torque_Nm", self.rated_torque_Nm, self.peak_torque_Nm),
            ("torque_Nm", self.stall_torque_Nm, self.peak_torque_Nm),
            ("current_Arms", self.rated_current_Arms, self.peak_current_Arms),
            ("current_Arms", self.stall_current_Arms, self.peak_current_Arms),
        ):
            if peak < rated:
                raise ValueError(
                    f"peak_{what}: value {peak}; allowed: at least the rated or stall value "
                    f"({rated})"
                )
        rated_Nm = self.torque_constant_Nm_per_Arms * self.rated_current_Arms
        if not rated_Nm / _TORQUE_RATIO <= self.rated_torque_Nm <= rated_Nm * _TORQUE_RATIO:
            raise ValueError(
                f"rated_torque_Nm: value {self.rated_torque_Nm:g}; allowed: "
                f"{rated_Nm / _TORQUE_RATIO:.4g} to {rated_Nm * _TORQUE_RATIO:.4g}, about "
                "torque_constant_Nm_per_Arms times rated_current_Arms"
            )
        return self


class MotorRatings(Profile):
    """One row of a series' table of all models, as printed; None if the source has a dash."""

    model: str
    rated_speed_rpm: Positive
    rated_power_kW: Positive
    rated_power_HP: Positive
    mpp_inertia_lb_in_s2: Positive
    mpp_inertia_kg_m2: Positive
    mpj_inertia_lb_in_s2: Dashed
    mpj_inertia_kg_m2: Dashed
    stall_torque_Nm: Positive
    stall_torque_lb_in: Positive
    peak_torque_Nm: Positive
    peak_torque_lb_in: Positive
    stall_current_Arms: Positive
    peak_current_Arms: Positive


class RatingsTable(Profile):
    """The table of all models; its rows in the file are arrays in the order of `columns`."""

    columns: tuple[str, ...]
    models_230_VAC: tuple[MotorRatings, ...]
    models_460_VAC: tuple[MotorRatings, ...]

    @model_validator(mode="before")
    @classmethod
    def _rows_to_records(cls, table: Any) -> Any:
        if not isinstance(table, dict) or not isinstance(table.get("columns"), tuple):
            return table
        models = {
            key: records(table["columns"], rows)
            for key, rows in table.items()
            if key.startswith("models_") and isinstance(rows, tuple)
        }
        return {**table, **models}


class MotorDetail(Profile):
    """One column of a size sheet, as printed; None if the source has NA."""

    stall_torque_Nm: Positive
    stall_torque_in_lb: Positive
    stall_current_Arms: Positive
    peak_torque_Nm: Positive
    peak_torque_in_lb: Positive
    peak_current_Arms: Positive
    rated_speed_rpm: Positive
    rated_torque_Nm: Positive
    rated_torque_in_lb: Positive
    rated_power_kW: Positive
    rated_current_Arms: Positive
    voltage_constant_Vrms_per_krpm: Positive
    torque_constant_Nm_per_Arms: Positive
    resistance_ohm: Positive
    inductance_mH: Positive
    mpp_inertia_kg_m2: Positive
    mpp_inertia_in_lb_s2: Positive
    mpj_inertia_kg_m2: Dashed
    mpj_inertia_in_lb_s2: Dashed
    mass_kg: Positive
    mass_lb: Positive

    @model_validator(mode="before")
    @classmethod
    def _dash_to_none(cls, table: Any) -> Any:
        return {k: dash_to_none(v) for k, v in table.items()} if isinstance(table, dict) else table


class CommonSpecifications(Profile):
    """Specifications common to all models of a series."""

    poles: int = Field(ge=2, multiple_of=2)
    ambient_temperature_at_rating_degC: float
    max_winding_temperature_degC: float
    winding_temperature_at_rating_degC: float
    ul_class: str
    ip_rating: str
    max_dc_bus_voltage_of_230_VAC_models_V: Positive
    max_dc_bus_voltage_of_460_VAC_models_V: Positive
    max_ac_voltage_of_230_VAC_models_V: Positive
    max_ac_voltage_of_460_VAC_models_V: Positive
    mpp_frame_sizes_mm: tuple[int, ...]
    mpj_frame_sizes_mm: tuple[int, ...]


class MotorSeries(Profile):
    """A manufacturer's family of motors: its table of ratings and the size sheets it has."""

    series: str
    manufacturer: str
    source: str
    notes: tuple[str, ...]
    common: CommonSpecifications
    ratings: RatingsTable
    detail: dict[str, MotorDetail]

    def names(self) -> dict[str, MotorRatings]:
        """Return the ratings of every motor by its full name, such as "MPP0923D"."""
        rows = self.ratings.models_230_VAC + self.ratings.models_460_VAC
        low = {f"MPP{row.model}": row for row in rows}
        high = {f"MPJ{row.model}": row for row in rows if row.mpj_inertia_kg_m2 is not None}
        return low | high

    def motor(self, name: str) -> Motor | None:
        """Return a motor by its full name, or None if the series has no size sheet for it."""
        row = self.names()[name]
        sheet = self.detail.get(row.model)
        if sheet is None:
            return None
        inertia = sheet.mpp_inertia_kg_m2 if name.startswith("MPP") else sheet.mpj_inertia_kg_m2
        if inertia is None:
            return None
        common, names = self.common, set(Motor.model_fields)
        alike = common.model_dump(include=names) | sheet.model_dump(include=names)
        is_230_VAC = row in self.ratings.models_230_VAC
        return Motor(
            model=name,
            manufacturer=self.manufacturer,
            source=self.source,
            notes=self.notes,
            inductance_H=sheet.inductance_mH * 1e-3,
            rotor_inertia_kg_m2=inertia,
            max_dc_bus_voltage_V=common.max_dc_bus_voltage_of_230_VAC_models_V
            if is_230_VAC
            else common.max_dc_bus_voltage_of_460_VAC_models_V,
            **alike,
        )
