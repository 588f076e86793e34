"""Cables: a single one with measured values, and a manufacturer's table of sizes."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from cdpr_profiles.motor import records
from cdpr_profiles.reader import Profile

Positive = Annotated[float, Field(gt=0)]
N_PER_KGF = 9.80665

ASSUMED_DAMPING_s = 2e-3
"""Assumed ratio of damping to stiffness of a cable that was not measured."""


class ElongationPoint(Profile):
    """Elastic elongation at a share of the breaking force."""

    force_percent_of_breaking: float = Field(gt=0, le=100)
    elongation_percent: float = Field(gt=0, le=100)


class Cable(Profile):
    """One cable; `elongation_percent_per_N` is valid for the tensions of its measurement."""

    name: str = Field(min_length=1)
    material: str
    source: str = ""
    notes: tuple[str, ...] = ()
    diameter_m: float = Field(gt=0, le=0.1)
    weight_per_length_N_m: float = Field(ge=1e-6, le=1e3)
    elongation_percent_per_N: float = Field(ge=1e-9, le=10)
    elongation_measured_up_to_N: Positive | None = None
    damping_s: float = Field(default=ASSUMED_DAMPING_s, ge=0, le=0.05)
    """Ratio of damping to stiffness: T = EA (strain + damping_s * strain rate)."""
    breaking_force_kgf: float = Field(ge=0.1, le=1e6)
    min_tension_N: float = Field(ge=0)
    data_sheet_code: str | None = None

    @property
    def breaking_force_N(self) -> float:
        """Average breaking force in N."""
        return self.breaking_force_kgf * N_PER_KGF

    @property
    def stiffness_N(self) -> float:
        """Axial stiffness EA in N: tension over strain."""
        return 100.0 / self.elongation_percent_per_N

    @model_validator(mode="after")
    def _holds(self) -> Self:
        if self.min_tension_N >= self.breaking_force_N:
            raise ValueError(
                f"min_tension_N: value {self.min_tension_N}; "
                f"allowed: below the breaking force ({self.breaking_force_N:.0f} N)"
            )
        return self


class CableSize(Profile):
    """One row of a manufacturer's table, as printed."""

    code: str
    diameter_mm: Positive
    diameter_in: str
    mass_kg_per_100_m: Positive
    mass_lb_per_100_ft: Positive
    breaking_force_kgf: Positive
    breaking_force_lbf: Positive


class CableSeries(Profile):
    """A manufacturer's table of sizes; its rows are arrays in the order of `columns`."""

    series: str
    manufacturer: str
    material: str
    source: str
    notes: tuple[str, ...]
    columns: tuple[str, ...]
    sizes: tuple[CableSize, ...]
    elongation: tuple[ElongationPoint, ...]

    @model_validator(mode="before")
    @classmethod
    def _rows_to_records(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        columns, rows = table.get("columns"), table.get("sizes")
        if not isinstance(columns, tuple) or not isinstance(rows, tuple):
            return table
        return {**table, "sizes": records(columns, rows)}
