"""The results of a commissioning: its files, the identified motor, and one table for the report."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from cdpr_profiles import Winch
from cdpr_profiles.bounded_input import read_json
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reader import read_json_model
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.tuning import PidDesign, design_pid
from cdpr_rt.control.validation import ValidationMetrics, evaluate, floor, ratios, worst
from cdpr_rt.errors import InvalidRequestError, RawLogError
from cdpr_rt.identification.cogging_profile import (
    CoggingProfile,
    DriveIdentity,
    stored_harmonic_model,
    stored_harmonics,
    stored_thesis,
)
from cdpr_rt.identification.harmonic_model import MOST_ROUNDS, SecondPass, identify_harmonic_model
from cdpr_rt.identification.rawlog import RawLog, read_raw_log
from cdpr_rt.identification.result import HarmonicResult
from cdpr_rt.identification.thesis import ThesisResult, identify_thesis
from cdpr_rt.identification.windows import SweepData

# The recordings of passes.


@dataclass(frozen=True)
class Recording:
    """One recorded pass of one axis, angles from the index; arrays are (samples,)."""

    sweep: SweepData
    effort_Nm: FloatArray
    cycle: FloatArray
    judged: BoolArray
    """Samples to evaluate: at full speed after the lead-in."""
    period_s: float
    complete: bool
    """Whether the pass is complete; False if the recording ends before the pass."""


def recording(log: RawLog) -> Recording:
    """Return the recording of a pass from a raw log, with angles from the encoder index.

    Raises RawLogError if the log is of another kind, ends before the part to evaluate, or does not
    contain the index.
    """
    try:
        period = float(log.header["period_s"])
        begin, end = float(log.header["measured_from_s"]), float(log.header["measured_until_s"])
        first_cycle = int(log.header["first_cycle"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{log.path}: not the recording of a pass ({error})") from error
    answered = log.column("valid") != 0.0
    since_start = (log.column("cycle") - first_cycle) * period
    judged = ((since_start >= begin) & (since_start < end))[answered]
    if not judged.any():
        raise RawLogError(
            f"{log.path}: ends after {since_start[-1]:.1f} s; the part to be measured begins at "
            f"{begin:.1f} s"
        )
    if not log.column("index_known")[answered].all():
        raise RawLogError(f"{log.path}: the encoder index is not known in this recording")
    index = log.column("index_rad")[answered]
    sweep = SweepData(
        time_s=log.column("time_s")[answered],
        angle_rad=log.column("position_rad")[answered] - index,
        torque_Nm=log.column("torque_sent_Nm")[answered],
        setpoint_rad=log.column("setpoint_rad")[answered] - index,
        setpoint_velocity_rad_s=log.column("setpoint_velocity_rad_s")[answered],
    )
    if not all(np.isfinite(getattr(sweep, field.name)).all() for field in fields(sweep)):
        raise RawLogError(f"{log.path}: contains numbers that are not finite")
    return Recording(
        sweep=sweep,
        effort_Nm=log.column("effort_Nm")[answered],
        cycle=log.column("cycle")[answered],
        judged=judged,
        period_s=period,
        complete=bool(since_start[-1] >= end - 2 * period),
    )


# Evaluation of recorded validation runs, by the encoder or by a more accurate angle.

METHODS = ("none", "thesis", "harmonic")
"""Compensations that are compared: none, the thesis' method and the harmonic model."""

FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")

AngleOf = Callable[[RawLog, Recording], FloatArray]
"""Function that returns the angle from the index, (samples,), with which a recorded pass is
evaluated."""


def judge(paths: Sequence[Path], angle_of: AngleOf | None) -> ValidationMetrics:
    """Return the worst value of each figure over the passes; by default by the encoder."""
    figures = []
    for path in paths:
        log = read_raw_log(path)
        run = recording(log)
        sweep = run.sweep
        angle = sweep.angle_rad if angle_of is None else angle_of(log, run)
        figures.append(
            evaluate(
                angle,
                sweep.setpoint_rad,
                sweep.setpoint_velocity_rad_s,
                run.effort_Nm,
                run.period_s,
                run.judged,
            )
        )
    return worst(figures)


def compare(runs: Mapping[str, Sequence[Path]], angle_of: AngleOf | None = None) -> dict[str, Any]:
    """Return the figures of each method, and their ratios to those without compensation."""
    metrics = {method: judge(paths, angle_of) for method, paths in runs.items()}
    return {
        method: {**_figures(m), "ratios": asdict(ratios(metrics["none"], m))}
        for method, m in metrics.items()
    }


def lowest(
    design: PidDesign, counts_per_turn: int, torque_step_Nm: float, period_s: float
) -> dict[str, Any]:
    """Return the figures that encoder and torque steps alone cause in this loop."""
    step_rad = math.tau / counts_per_turn
    return _figures(
        floor(
            design.gains, design.inertia_kg_m2, design.latency_s, period_s, step_rad, torque_step_Nm
        )
    )


def _figures(metrics: ValidationMetrics) -> dict[str, float]:
    return {name: getattr(metrics, name) for name in FIGURES}


# The files of a commissioning.


class Paths:
    """Files of a commissioning in the folder `out`."""

    def __init__(self, out: Path) -> None:
        self.out, self.raw_folder = out, out / "raw"
        self.profile = out / "cogging-profile.json"
        self.run = out / "run.json"
        """Data of the report that are not in the recordings."""
        self.results, self.page = out / "report.json", out / "report.html"
        self.truth = out / "simulator-truth.log"
        """The simulator's log of the truth, which only the report reads."""

    def raw(self, name: str) -> Path:
        """Return the file of one recorded pass."""
        return self.raw_folder / f"{name}.raw"

    def passes(self, name: str) -> list[Path]:
        """Return the recorded passes whose names begin with `name`, in the order they were run."""
        found = self.raw_folder.glob(f"{name}-[0-9]*.raw")
        return sorted(found, key=lambda path: int(path.stem.rsplit("-", 1)[1]))


# Identification of a motor from the recorded passes of a commissioning; its cogging profile.


@dataclasses.dataclass(frozen=True)
class Identified:
    """Results of both methods."""

    thesis: ThesisResult
    harmonic: HarmonicResult


def legs(paths: list[Path]) -> list[SweepData]:
    """Return recorded passes in the form that the identification needs; raises RawLogError."""
    # only the sweep stays in memory, because a recording is large
    return [recording(read_raw_log(path)).sweep for path in paths]


def identify(winch: Winch, latency_s: float, paths: Paths) -> Identified:
    """Identify from the recorded passes in `paths`, including all rounds of the second pass.

    Raises RawLogError and IdentificationError.
    """
    found = identify_first(winch, latency_s, paths)
    second = SecondPass(found.harmonic, legs(paths.passes("fast")))
    for number in range(MOST_ROUNDS):
        recorded = paths.passes(round_name(number))
        if not recorded or second.done:
            break
        second.add(legs(recorded))
    return dataclasses.replace(found, harmonic=second.best)


def identify_first(winch: Winch, latency_s: float, paths: Paths) -> Identified:
    """Identify from the sweeps and the fast legs alone."""
    sweep, fast = (legs(paths.passes(name)) for name in ("sweep", "fast"))
    motor = winch.motor
    harmonic = identify_harmonic_model(
        sweep + fast, motor.rotor_inertia_kg_m2, latency_s, motor.pole_pairs, motor.slots
    )
    return Identified(identify_thesis(sweep), harmonic)


def round_name(number: int) -> str:
    """Return the name under which a round of the second pass is recorded."""
    return f"round{number}"


def store_profile(winch: Winch, identity: DriveIdentity, found: Identified, paths: Paths) -> None:
    """Write the cogging profile."""
    harmonic = found.harmonic
    names = ("sweep", "fast", *(round_name(number) for number in range(MOST_ROUNDS)))
    recorded = [path for name in names for path in paths.passes(name)]
    raw = [path.name for path in recorded]
    imported = any("source" in read_raw_log(path).header for path in recorded[:1])
    CoggingProfile(
        motor=winch.motor.model,
        drive=winch.drive.name,
        identity=identity,
        created=datetime.now(UTC).replace(microsecond=0),
        raw_data=raw,
        inertia_kg_m2=harmonic.inertia_kg_m2.value,
        harmonics=stored_harmonics(harmonic),
        residual_rms_Nm=harmonic.residual_rms_Nm,
        repaired_fraction=found.thesis.repaired_fraction,
        coverage=harmonic.coverage,
        thesis=stored_thesis(found.thesis),
        harmonic=stored_harmonic_model(harmonic, winch.latency_s if imported else None),
    ).save(paths.profile)


def validation_name(method: str, bandwidth_Hz: float) -> str:
    """Return the name under which a validation run is recorded."""
    return f"validate-{bandwidth_Hz:g}Hz-{method}"


TARGETS = {
    "thesis": {"rms_position_error": 3.0, "peak_pid_effort": 6.0, "peak_velocity_error": 5.0},
    "harmonic": {"rms_position_error": 10.0, "peak_pid_effort": 10.0, "peak_velocity_error": 8.0},
}
"""Target ratios to the figures without compensation: of the thesis, and of this project."""


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
    """Gain margin; None if the loop is stable with every gain."""
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
            raise ValueError("bandwidths_Hz: must contain bandwidth_Hz")
        if len(self.pid) != len(self.bandwidths_Hz):
            raise ValueError("pid: allowed: one for each of bandwidths_Hz")
        return self


def read_run(paths: Paths) -> dict[str, Any]:
    """Return the data of the commissioning run; raises InvalidRequestError if a part is missing."""
    try:
        read_json_model(paths.run, _Run)
        run: dict[str, Any] = read_json(paths.run)
    except ProfileError as error:
        raise InvalidRequestError(
            f"{error}; {paths.out} contains no finished commissioning"
        ) from None
    return run


def assemble(
    paths: Paths, run: dict[str, Any], found: Identified, true_angle: AngleOf | None
) -> dict[str, Any]:
    """Return all data of the report; raises RawLogError and the errors of `true_angle`.

    The validation uses `true_angle` of a simulator if there is one, else the encoder's angle.
    """
    # older runs do not contain this; all of them used drives with torque in per mille
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
    """Return the identified values for JSON."""
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
        "directions": list(harmonic.directions),
        "dropped_fraction": harmonic.dropped_fraction,
        "excluded_fraction": harmonic.excluded_fraction,
        "error_by_orders_Nm": harmonic.error_by_orders_Nm,
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
