"""From recorded masses or a pulled cable to the calibration file of a winch."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from cdpr_rt.errors import RawLogError
from cdpr_rt.rawlog import read_raw_log
from cdpr_rt.tension_gain import CalibrationRefusedError, identify_tension_gain
from profiles import Winch
from profiles.winch_calibration import WinchCalibration
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output
from tools.tension.anchor import anchored_points
from tools.tension.masses import mass_points

FILE_NAME, PICTURE = "winch-calibration.toml", "winch-calibration.png"
_PULL = "pull.raw"


def raw_folder(folder: Path) -> Path:
    """Return where the recordings of a calibration are."""
    return folder / "raw"


def pull_file(folder: Path) -> Path:
    """Return the recording of a made-fast cable."""
    return raw_folder(folder) / _PULL


def recorded_winch(folder: Path) -> str:
    """Return the winch whose recordings a folder holds; raises BadInputError, RawLogError."""
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
        raise BadInputError(f"{folder}: holds no recordings of a calibration (raw/...)")
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


def calibrate(folder: Path, winch: Winch) -> WinchCalibration:
    """Identify from the recordings in `folder` and write the file and its picture beside them.

    Raises CalibrationRefusedError where they do not support it, and then writes nothing.
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
    from tools.tension.picture import draw_calibration  # noqa: PLC0415  # slow to load

    try:
        draw_calibration(folder / PICTURE, points, calibration)
    except OSError as error:
        raise WorkFailedError(f"{folder / PICTURE}: cannot be written: {error.strerror}") from error
    return calibration


def show(out: Output, found: WinchCalibration, path: Path) -> None:
    """Say what was found."""
    gain, half = found.gain_m * 1e3, found.gain_half_width_m * 1e3
    apart = 100.0 * (found.gain_m / found.nominal_gain_m - 1.0)
    out.say(f"gain K_t         {gain:.3f} ± {half:.3f} mNm/N ({apart:+.1f} % from the geometry)")
    out.say(
        f"friction         {found.friction_Nm:.3f} ± {found.friction_half_width_Nm:.3f} Nm, and "
        f"{found.friction_per_N_m * 1e3:.2f} ± {found.friction_per_N_half_width_m * 1e3:.2f} mNm/N"
    )
    top = found.highest_tension_N
    share = 100.0 * found.friction_at_Nm(top) / found.torque_Nm(top)
    out.say(f"                 {share:.1f} % of the torque at {top:.0f} N")
    out.say(f"bias             {found.bias_Nm:+.3f} ± {found.bias_half_width_Nm:.3f} Nm")
    out.say(f"residual         {found.residual_rms_Nm * 1e3:.1f} mNm rms")
    out.say(f"calibration      {path}")
