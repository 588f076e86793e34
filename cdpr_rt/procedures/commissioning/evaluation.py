"""Judges recorded validation runs, on the encoder or on an angle that is known better."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.tuning import PidDesign
from cdpr_rt.control.validation import ValidationMetrics, evaluate, floor, ratios, worst
from cdpr_rt.identification.rawlog import RawLog, read_raw_log
from cdpr_rt.procedures.measurement import Recording, recording

METHODS = ("none", "thesis", "better")
"""Compensations that are compared: without, the thesis' and the harmonic model."""

FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")

AngleOf = Callable[[RawLog, Recording], FloatArray]
"""Gives the angle from the index on which a recorded pass is judged, (samples,)."""


def judge(paths: Sequence[Path], angle_of: AngleOf | None) -> ValidationMetrics:
    """Return the figures of the passes, the worst of each; on the encoder's angle by default."""
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
    """Return the figures of each method and how many times smaller than without each is."""
    metrics = {method: judge(paths, angle_of) for method, paths in runs.items()}
    return {
        method: {**_figures(m), "ratios": asdict(ratios(metrics["none"], m))}
        for method, m in metrics.items()
    }


def lowest(
    design: PidDesign, counts_per_turn: int, torque_step_Nm: float, period_s: float
) -> dict[str, Any]:
    """Return what the encoder's and the torque's steps alone leave in this loop."""
    step_rad = math.tau / counts_per_turn
    return _figures(
        floor(
            design.gains, design.inertia_kg_m2, design.latency_s, period_s, step_rad, torque_step_Nm
        )
    )


def _figures(metrics: ValidationMetrics) -> dict[str, float]:
    return {name: getattr(metrics, name) for name in FIGURES}
