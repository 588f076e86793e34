"""From recorded masses or a pulled cable to the calibration file of a winch."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from cdpr_profiles import Winch
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.errors import InvalidRequestError, RawLogError
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.identification.tension_gain import (
    CalibrationRefusedError,
    TorquePoint,
    identify_tension_gain,
)
from cdpr_rt.procedures.tension.anchor import anchored_points
from cdpr_rt.procedures.tension.masses import mass_points

FILE_NAME, PICTURE = "winch-calibration.toml", "winch-calibration.png"
_PULL = "pull.raw"


def raw_folder(folder: Path) -> Path:
    """Return where the recordings of a calibration are."""
    return folder / "raw"


def pull_file(folder: Path) -> Path:
    """Return the recording of a made-fast cable."""
    return raw_folder(folder) / _PULL


def recorded_winch(folder: Path) -> str:
    """Return the winch whose recordings a folder holds; raises InvalidRequestError, RawLogError."""
    return str(_identity(_recordings(folder)[0])["winch"])


def discard(folder: Path) -> None:
    """Remove the recordings and the result of an earlier calibration, nothing else."""
    for path in (*_found(folder), folder / FILE_NAME, folder / PICTURE):
        path.unlink(missing_ok=True)


def _found(folder: Path) -> list[Path]:
    return sorted(raw_folder(folder).glob("mass-*.raw")) + sorted(raw_folder(folder).glob(_PULL))


def _recordings(folder: Path) -> list[Path]:
    found = _found(folder)
    if not found:
        raise InvalidRequestError(f"{folder}: holds no recordings of a calibration (raw/...)")
    return found


def _identity(path: Path) -> Mapping[str, Any]:
    whose = read_raw_log(path).header.get("identity")
    if (
        not isinstance(whose, dict)
        or not {"winch", "motor"} <= whose.keys()
        or not isinstance(whose.get("serial"), int)
    ):
        raise RawLogError(f"{path}: does not say which winch it is of")
    return whose


def calibrate(folder: Path, winch: Winch) -> tuple[WinchCalibration, list[TorquePoint]]:
    """Identify from the recordings in `folder` and write the file beside them.

    Returns it with the points it was fitted to. Raises CalibrationRefusedError where the recordings
    do not support it, and then writes nothing.
    """
    recorded = _recordings(folder)
    whose = _identity(recorded[0])
    nominal = abs(winch.cable_m_per_motor_rad)
    method: Literal["masses", "sensors"]
    if recorded[0].name == _PULL:
        method = "sensors"
        points, order = anchored_points(recorded[0])
        found = identify_tension_gain(points, nominal, order)
    else:
        method = "masses"
        points = mass_points(recorded)
        found = identify_tension_gain(points, nominal)
    calibration = WinchCalibration(
        winch=str(whose["winch"]),
        motor=str(whose["motor"]),
        drive_serial=whose["serial"],
        date=datetime.now(UTC).replace(microsecond=0),
        method=method,
        gain_m=found.gain_m.value,
        gain_half_width_m=found.gain_m.half_width,
        nominal_gain_m=nominal,
        bias_Nm=found.bias_Nm.value,
        bias_half_width_Nm=found.bias_Nm.half_width,
        friction_Nm=found.friction_Nm.value,
        friction_half_width_Nm=found.friction_Nm.half_width,
        friction_per_N_m=found.friction_per_N_m.value,
        friction_per_N_half_width_m=found.friction_per_N_m.half_width,
        residual_rms_Nm=found.residual_rms_Nm,
        lowest_tension_N=found.lowest_N,
        highest_tension_N=found.highest_N,
        raw_data=tuple(str(path.relative_to(folder)) for path in recorded),
    )
    for key, problem in calibration.faults(winch):
        raise CalibrationRefusedError(f"{key}: {problem}")
    calibration.save(folder / FILE_NAME)
    return calibration, points
