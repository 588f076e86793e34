"""Checks what the report is made of, and writes its files."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from cdpr_tools.errors import BadInputError, WorkFailedError

_FIGURES = ("rms_position_error_deg", "peak_pid_effort_Nm", "peak_velocity_error_deg_s")
_RATIOS = ("rms_position_error", "peak_pid_effort", "peak_velocity_error")
_TOP = (
    "winch", "drive", "date", "bus", "pid", "latency_s", "bandwidth_Hz", "bandwidths_Hz",
    "encoder_counts_per_turn", "rated_torque_Nm", "torque_step_Nm",
)  # fmt: skip
_IDENTIFICATION = (
    "orders", "amplitudes_Nm", "confidence_Nm", "phases_deg", "per_pole_pair", "hints",
    "residual_rms_Nm", "repaired_fraction", "coverage", "excluded_fraction", "held_back_error_Nm",
)  # fmt: skip


def save(path: Path, text: str) -> None:
    """Write a file at once or not at all; raises WorkFailedError where it cannot be written."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):  # the first error tells what is wrong
            part.unlink(missing_ok=True)
        raise WorkFailedError(
            f"{path}: the report cannot be written: {error.strerror or error}; the raw data are "
            "kept, and the report can be made from them again"
        ) from error


def check(results: Any, path: Path) -> None:
    """Raise BadInputError naming the first key that a report needs and `results` has not."""
    for keys in _needed():
        value = results
        for depth, key in enumerate(keys):
            if not isinstance(value, dict) or key not in value:
                missing = ".".join(keys[: depth + 1])
                raise BadInputError(f"{path}: not the results of a commissioning: no {missing}")
            value = value[key]


def _needed() -> list[tuple[str, ...]]:
    needed: list[tuple[str, ...]] = [(key,) for key in _TOP]
    needed += [("identification", key) for key in _IDENTIFICATION]
    judged: list[tuple[str, ...]] = [("validation", "judged_on"), ("validation", "bandwidths")]
    for method in ("none", "thesis", "better"):
        for where in (("validation",), ("validation", "encoder")):
            judged += [(*where, method, key) for key in _FIGURES]
            judged += [(*where, method, "ratios", key) for key in _RATIOS]
    for method in ("thesis", "better"):
        judged += [("validation", "targets", method, key) for key in _RATIOS]
    return needed + judged + [("validation", "floor", key) for key in _FIGURES]
