"""The results of a commissioning as one table of plain values, from the files it left."""

from __future__ import annotations

import json
import math
from typing import Any

from cdpr_rt.tuning import PidDesign, design_pid
from tools.commissioning import METHODS, Paths
from tools.errors import BadInputError
from tools.evaluation import compare, lowest
from tools.procedure import Identified, validation_name
from tools.truth import Truth

TARGETS = {
    "thesis": {"rms_position_error": 3.0, "peak_pid_effort": 6.0, "peak_velocity_error": 5.0},
    "better": {"rms_position_error": 10.0, "peak_pid_effort": 10.0, "peak_velocity_error": 8.0},
}
"""Times smaller than without compensation: what the thesis reached, and what is aimed at here."""


def read_run(paths: Paths) -> dict[str, Any]:
    """Return what the run on the bus left; raises BadInputError when it is not there."""
    try:
        run: dict[str, Any] = json.loads(paths.run.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        why = (isinstance(error, OSError) and error.strerror) or error
        raise BadInputError(
            f"{paths.run}: cannot be read ({why}); {paths.out} holds no finished commissioning"
        ) from error
    return run


def assemble(paths: Paths, run: dict[str, Any], found: Identified) -> dict[str, Any]:
    """Return everything the report tells; raises RawLogError and BadInputError."""
    truth = Truth(paths.truth) if paths.truth.exists() else None
    # runs from before this was noted are all of drives that take per mille
    run = {"torque_step_Nm": run["rated_torque_Nm"] / 1000.0, **run}
    return {
        "ok": True,
        **run,
        "identification": identification(found),
        "validation": _validation(paths, run, truth),
        "files": {
            "report": str(paths.page),
            "profile": str(paths.profile),
            "raw": str(paths.out / "raw"),
        },
    }


def identification(found: Identified) -> dict[str, Any]:
    """Return what was identified, in plain values."""
    better, thesis = found.better, found.thesis
    harmonics = better.harmonics
    friction = better.friction
    return {
        "orders": list(better.orders),
        "amplitudes_Nm": list(better.amplitudes_Nm),
        "confidence_Nm": [h.amplitude_Nm.half_width for h in harmonics],
        "phases_deg": [h.phase_deg.value for h in harmonics],
        "per_pole_pair": [h.per_pole_pair for h in harmonics],
        "hints": [h.hint for h in harmonics],
        "residual_rms_Nm": better.residual_rms_Nm,
        "repaired_fraction": thesis.repaired_fraction,
        "coverage": better.coverage,
        "excluded_fraction": better.excluded_fraction,
        "held_back_error_Nm": better.held_back_error_Nm,
        "coulomb_forward_Nm": better.coulomb_forward_Nm.value,
        "coulomb_backward_Nm": better.coulomb_backward_Nm.value,
        "viscous_Nms_rad": better.viscous_Nms_rad.value,
        "stribeck_forward_Nm": friction.stribeck_forward_Nm,
        "stribeck_backward_Nm": friction.stribeck_backward_Nm,
        "stribeck_speed_rad_s": friction.stribeck_speed_rad_s,
        "inertia_kg_m2": better.inertia_kg_m2.value,
        "inertia_measured": better.inertia_measured,
        "latency_s": better.latency_s.value,
        "lag_deg": math.degrees(better.lag_rad.value),
        "thesis_mean_Nm": thesis.mean_Nm,
    }


def _validation(paths: Paths, run: dict[str, Any], truth: Truth | None) -> dict[str, Any]:
    counts, period = run["encoder_counts_per_turn"], run["bus"]["period_s"]
    step_Nm = run["torque_step_Nm"]
    default: float = run["bandwidth_Hz"]
    rows = []
    for wanted in run["bandwidths_Hz"]:
        runs = {m: paths.passes(validation_name(m, wanted)) for m in METHODS}
        design: PidDesign = design_pid(run["inertia_kg_m2"], run["latency_s"], wanted, period)
        row = {"bandwidth_Hz": wanted, **compare(runs, truth)}
        row["floor"] = lowest(design, counts, step_Nm, period)
        rows.append((row, runs))
    at_default, runs = next((row, runs) for row, runs in rows if row["bandwidth_Hz"] == default)
    return {
        "judged_on": "encoder" if truth is None else "true angle",
        **at_default,
        "encoder": compare(runs, None),
        "bandwidths": sorted((row for row, _ in rows), key=lambda row: row["bandwidth_Hz"]),
        "targets": TARGETS,
    }
