"""The results of a commissioning as one table of plain values, from the files it left."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import read_json
from cdpr_profiles.reading.reader import read_json_model
from cdpr_rt.control.tuning import PidDesign, design_pid
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.commissioning.evaluation import METHODS, AngleOf, compare, lowest
from cdpr_rt.procedures.commissioning.identified import Identified, validation_name

TARGETS = {
    "thesis": {"rms_position_error": 3.0, "peak_pid_effort": 6.0, "peak_velocity_error": 5.0},
    "better": {"rms_position_error": 10.0, "peak_pid_effort": 10.0, "peak_velocity_error": 8.0},
}
"""Times smaller than without compensation: what the thesis reached, and what is aimed at here."""


_Positive = Annotated[float, Field(gt=0.0, le=1e9)]


_Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Count = Annotated[int, Field(ge=0, le=(1 << 63) - 1)]
_Word = Annotated[int, Field(ge=0, lt=1 << 32)]


class _Part(BaseModel):
    """Part of `run.json` that the report reads; the rest is for people."""

    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False)


class _Bus(_Part):
    url: str = ""
    period_s: _Positive
    cycles: _Count = 0
    wall_s: _Positive | None = None


class _Drive(_Part):
    name: str = ""
    vendor_id: _Word = 0
    product_code: _Word = 0
    revision: _Word = 0


class _Pid(_Part):
    inertia_kg_m2: _Positive
    latency_s: _Positive
    bandwidth_Hz: _Positive
    crossover_Hz: _Positive
    phase_margin_deg: _Number
    gain_margin_dB: _Number | None
    """None where no gain is too much."""
    sensitivity_peak: _Positive


class _Run(_Part):
    winch: str
    date: str
    drive: _Drive
    encoder_counts_per_turn: int = Field(gt=0, le=1 << 32)
    rated_torque_Nm: _Positive
    inertia_kg_m2: _Positive
    latency_s: _Positive
    bandwidth_Hz: _Positive
    bandwidths_Hz: list[_Positive]
    torque_step_Nm: _Positive | None = None
    pid: list[_Pid] = Field(min_length=1)
    bus: _Bus

    @model_validator(mode="after")
    def _has_its_default(self) -> Self:
        if self.bandwidth_Hz not in self.bandwidths_Hz:
            raise ValueError("bandwidths_Hz: allowed: bandwidth_Hz among them")
        if len(self.pid) != len(self.bandwidths_Hz):
            raise ValueError("pid: allowed: one for each of bandwidths_Hz")
        return self


def read_run(paths: Paths) -> dict[str, Any]:
    """Return the run on the bus; raises InvalidRequestError where a part of it is missing."""
    try:
        read_json_model(paths.run, _Run)
        run: dict[str, Any] = read_json(paths.run)
    except ProfileError as error:
        raise InvalidRequestError(f"{error}; {paths.out} holds no finished commissioning") from None
    return run


def assemble(
    paths: Paths, run: dict[str, Any], found: Identified, true_angle: AngleOf | None
) -> dict[str, Any]:
    """Return everything the report tells; raises RawLogError and what `true_angle` raises.

    Validation is judged on `true_angle` where a simulator has told it, else on the encoder.
    """
    # runs from before this was noted are all of drives that take per mille
    run = {"torque_step_Nm": run["rated_torque_Nm"] / 1000.0, **run}
    return {
        "ok": True,
        **run,
        "identification": identification(found),
        "validation": _validation(paths, run, true_angle),
        "files": {
            "report": str(paths.page),
            "profile": str(paths.profile),
            "raw": str(paths.raw_folder),
        },
    }


def identification(found: Identified) -> dict[str, Any]:
    """Return what was identified, in plain values."""
    harmonic, thesis = found.harmonic, found.thesis
    harmonics = harmonic.harmonics
    friction = harmonic.friction
    return {
        "orders": list(harmonic.orders),
        "amplitudes_Nm": list(harmonic.amplitudes_Nm),
        "confidence_Nm": [h.amplitude_Nm.half_width for h in harmonics],
        "phases_deg": [h.phase_deg.value for h in harmonics],
        "per_pole_pair": [h.per_pole_pair for h in harmonics],
        "hints": [h.hint for h in harmonics],
        "residual_rms_Nm": harmonic.residual_rms_Nm,
        "repaired_fraction": thesis.repaired_fraction,
        "coverage": harmonic.coverage,
        "excluded_fraction": harmonic.excluded_fraction,
        "held_back_error_Nm": harmonic.held_out_error_Nm,
        "coulomb_forward_Nm": harmonic.coulomb_forward_Nm.value,
        "coulomb_backward_Nm": harmonic.coulomb_backward_Nm.value,
        "viscous_Nms_rad": harmonic.viscous_Nms_rad.value,
        "stribeck_forward_Nm": friction.stribeck_forward_Nm,
        "stribeck_backward_Nm": friction.stribeck_backward_Nm,
        "stribeck_speed_rad_s": friction.stribeck_speed_rad_s,
        "inertia_kg_m2": harmonic.inertia_kg_m2.value,
        "inertia_measured": harmonic.inertia_measured,
        "latency_s": harmonic.latency_s.value,
        "lag_deg": math.degrees(harmonic.lag_rad.value),
        "thesis_mean_Nm": thesis.mean_Nm,
    }


def _validation(paths: Paths, run: dict[str, Any], true_angle: AngleOf | None) -> dict[str, Any]:
    counts, period = run["encoder_counts_per_turn"], run["bus"]["period_s"]
    step_Nm = run["torque_step_Nm"]
    default: float = run["bandwidth_Hz"]
    rows = []
    for wanted in run["bandwidths_Hz"]:
        runs = {m: paths.passes(validation_name(m, wanted)) for m in METHODS}
        design: PidDesign = design_pid(run["inertia_kg_m2"], run["latency_s"], wanted, period)
        row = {"bandwidth_Hz": wanted, **compare(runs, true_angle)}
        row["floor"] = lowest(design, counts, step_Nm, period)
        rows.append((row, runs))
    at_default, runs = next((row, runs) for row, runs in rows if row["bandwidth_Hz"] == default)
    return {
        "judged_on": "encoder" if true_angle is None else "true angle",
        **at_default,
        "encoder": compare(runs),
        "bandwidths": sorted((row for row, _ in rows), key=lambda row: row["bandwidth_Hz"]),
        "targets": TARGETS,
    }
