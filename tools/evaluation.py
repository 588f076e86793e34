"""Judges recorded validation runs, on the encoder and, where a simulator kept it, on the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cdpr_rt.measurement import recording
from cdpr_rt.rawlog import read_raw_log
from cdpr_rt.tuning import PidDesign
from cdpr_rt.validation import Metrics, evaluate, floor, ratios, worst
from tools.truth import Truth

FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")


def judge(paths: Sequence[Path], truth: Truth | None) -> Metrics:
    """Return the figures of the passes, the worst of each; on the true angle with `truth`."""
    figures = []
    for path in paths:
        log = read_raw_log(path)
        run = recording(log)
        sweep = run.sweep
        angle = sweep.angle_rad
        if truth is not None:
            angle = truth.angle_at(run.cycle + log.header["sync_offset"] - 1, angle)
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


def compare(runs: dict[str, list[Path]], truth: Truth | None) -> dict[str, Any]:
    """Return the figures of each method and how many times smaller than without each is."""
    metrics = {method: judge(paths, truth) for method, paths in runs.items()}
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


def _figures(metrics: Metrics) -> dict[str, float]:
    return {name: getattr(metrics, name) for name in FIGURES}
