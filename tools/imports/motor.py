"""A motor's recording by another program, as passes that `cdpr cogging fit` reads."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import Winch
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging_profile import IMPORTED_SERIAL
from cdpr_rt.identification.commissioning_results import Paths
from cdpr_rt.identification.rawlog import AXIS_COLUMNS, RawLogWriter, column_names
from cdpr_rt.identification.torque_lag import (
    MOST_RESIDUAL,
    Reading,
    fit_torque_lag,
    resampled,
)
from cdpr_rt.identification.windows import SweepData
from cdpr_tools.errors import BadInputError
from cdpr_tools.imports.logs import read_any
from cdpr_tools.imports.mapping import (
    MotorColumns,
    MotorMapping,
    motor_units,
    read_time,
    shifted,
    usable,
)
from cdpr_tools.imports.tables import Table

_LONGEST_STEP_S: Final = 2.5e-3
"""Longest period of the imported passes: shorter than the windows of the identification."""
_GAP_S: Final = 0.05
"""Longer gaps between samples are not interpolated."""
_REVERSAL_RAD: Final = math.radians(10.0)
_STANDING_RAD: Final = math.radians(0.5)
_LEAST_TURNS: Final = 0.5
_FAST_RAD_S: Final = math.radians(60.0)
_FEWEST_SAMPLES: Final = 100
_FEWEST_ANGLES: Final = 10
"""Of a static map."""
_MOST_SPEED: Final = 2.0
"""Highest plausible speed over the motor's rated speed."""
_LATE: Final = 0.8
"""A fitted filter is reported if it leaves less than this share of the residual without it."""


@dataclass(frozen=True)
class _Piece:
    """A motion in one direction, and its source."""

    table: Table
    reading: Reading


@dataclass(frozen=True)
class Imported:
    """Files that an import wrote, and notes on parts that it left out."""

    written: list[Path]
    notes: list[str]
    torque_lag_s: float
    passes: list[dict[str, Any]]


def import_motor(files: Sequence[Path], mapping_path: Path, winch: Winch, paths: Paths) -> Imported:
    """Convert recordings of one motor into passes in `paths`.

    Each motion in one direction becomes one pass: resampled at a constant rate, without the filter
    of the torque reading, and with a set-point of its mean speed. Raises ProfileError and
    BadInputError.
    """
    mapping = MotorMapping.load_file(mapping_path)
    notes: list[str] = []
    if mapping.columns.time is None:
        return _import_maps(files, mapping_path, mapping, winch, paths)
    pieces = [
        piece
        for path in files
        for piece in _pieces(read_any(path, {"": winch}), mapping, winch, notes)
    ]
    if not pieces:
        raise BadInputError(
            f"{files[0]}: no motion of at least half a turn in one direction; "
            f"{'; '.join(notes) or 'check the column and the unit of the angle'}"
        )
    steps = [float(np.median(np.diff(piece.reading.time_s))) for piece in pieces]
    period = min(_LONGEST_STEP_S, *steps)
    lag_s = _lag(mapping, [piece.reading for piece in pieces], period, notes)
    written, passes, count = [], [], {"sweep": 0, "fast": 0}
    for piece in pieces:
        run = resampled(piece.reading, lag_s, period)
        speed = float(run.setpoint_velocity_rad_s[0])
        what = "fast" if abs(speed) > _FAST_RAD_S else "sweep"
        path = paths.raw(f"{what}-{count[what]}")
        count[what] += 1
        valid = _near_samples(run.time_s, piece.reading.time_s)
        _write(path, what, run, valid, _meta(piece.table, mapping_path, winch, speed, lag_s))
        written.append(path)
        passes.append(_facts(path, piece, run, valid))
    if not count["sweep"]:
        notes.append(
            f"all motions are faster than {math.degrees(_FAST_RAD_S):g} deg/s: `cdpr cogging fit` "
            "needs a slower one too"
        )
    return Imported(written, notes, lag_s, passes)


def _pieces(table: Table, mapping: MotorMapping, winch: Winch, notes: list[str]) -> list[_Piece]:
    """Return the motions in one direction; add a note for each part that is left out."""
    columns = mapping.columns
    angles, torques = motor_units(winch)
    assert columns.time is not None
    table = usable(table, columns.time, (columns.angle, columns.torque), notes)
    time = read_time(columns.time, table)
    angle = columns.angle.read_all(table, angles)
    torque = columns.torque.read_all(table, torques)
    if np.ptp(angle) <= math.tau:  # an angle that begins again after each turn
        angle = np.unwrap(angle)
    angle = shifted(time, angle, columns.angle.late_by_s(columns.time))
    torque = shifted(time, torque, columns.torque.late_by_s(columns.time))
    inside = np.flatnonzero((time >= mapping.from_s) & (time <= mapping.until_s))
    if inside.size < _FEWEST_SAMPLES:
        problem = (
            f"{inside.size} rows between from_s and until_s; allowed: {_FEWEST_SAMPLES} or more"
        )
        raise ProfileError(table.path, "", problem)
    time, angle, torque = time[inside], angle[inside], torque[inside]
    _require_plausible(table, columns, time, angle, torque, winch)
    found = []
    for start, stop in _one_way(angle):
        part = slice(start, stop)
        turns = abs(angle[stop - 1] - angle[start]) / math.tau
        if turns < _LEAST_TURNS or stop - start < _FEWEST_SAMPLES:
            notes.append(
                f"{table.path}: left out {time[start]:.2f} s to {time[stop - 1]:.2f} s, "
                f"{turns:.2f} turns in one direction; a pass needs {_LEAST_TURNS} turns"
            )
            continue
        found.append(_Piece(table, Reading(time[part], angle[part], torque[part])))
    return found


def _require_plausible(
    table: Table,
    columns: MotorColumns,
    time: FloatArray,
    angle: FloatArray,
    torque: FloatArray,
    winch: Winch,
) -> None:
    """Raise ProfileError for a wrong unit of time or angle, or a column that is not the torque."""
    assert columns.time is not None
    step_s = float(np.median(np.diff(time)))
    if step_s > _GAP_S:
        problem = (
            f"column {columns.time.name!r}: the rows are {step_s:.3g} s apart; allowed: up to "
            f"{_GAP_S:g} s; check the unit of the time"
        )
        raise ProfileError(table.path, "", problem)
    speed_rad_s, most_rad_s = np.ptp(angle) / np.ptp(time), winch.motor.rated_speed_rad_s
    if speed_rad_s > _MOST_SPEED * most_rad_s:
        problem = (
            f"the motor turns at {speed_rad_s:.3g} rad/s, but its rated speed is "
            f"{most_rad_s:.3g} rad/s; check the units of time and angle"
        )
        raise ProfileError(table.path, "", problem)
    if np.ptp(torque) == 0.0:
        problem = f"column {columns.torque.name!r}: {torque[0]:g} Nm in all rows; choose another"
        raise ProfileError(table.path, "", problem)


def _one_way(angle: FloatArray) -> list[tuple[int, int]]:
    """Return start and stop of each motion in one direction, without standstill at its ends."""
    turning = [0]
    extreme, sign = 0, 0.0
    for i, value in enumerate(angle):
        ahead = value - angle[extreme]
        if sign == 0.0:
            sign = math.copysign(1.0, ahead) if abs(ahead) > _REVERSAL_RAD else 0.0
            extreme = i if sign else 0
        elif sign * ahead > 0.0:
            extreme = i
        elif sign * ahead < -_REVERSAL_RAD:
            turning.append(extreme)
            extreme, sign = i, -sign
    parts = []
    for start, stop in zip(turning, [*turning[1:], angle.size], strict=True):
        part = angle[start:stop]
        away = np.flatnonzero(np.abs(part - part[0]) > _STANDING_RAD)
        before = np.flatnonzero(np.abs(part - part[-1]) > _STANDING_RAD)
        if away.size and before.size:
            parts.append((start + max(int(away[0]) - 1, 0), start + int(before[-1]) + 2))
    return [(start, min(stop, angle.size)) for start, stop in parts]


def _lag(
    mapping: MotorMapping, readings: Sequence[Reading], period_s: float, notes: list[str]
) -> float:
    """Return the time constant to remove; add a note about a filter that the recording shows."""
    given = mapping.torque_lag_s
    if isinstance(given, float):
        return given
    fitted = fit_torque_lag(readings, period_s)
    lag = fitted.lag_s
    shown = f"{lag.value:.3g} ± {lag.half_width:.2g} s"
    if given == "fit" and not fitted.reliable:
        raise BadInputError(
            f"torque_lag_s: cannot be fitted, because harmonics of the angle leave "
            f"{fitted.residual:.0%} of the torque (allowed: {MOST_RESIDUAL:.0%}; the motor sticks "
            "and slips, or a column is wrong); write the time constant of the drive's filter, or 0"
        )
    if given == "fit":
        notes.append(f"the torque reading is low-passed with a time constant of {shown}")
        return lag.value
    if fitted.reliable and fitted.gain < _LATE and lag.value > 3.0 * lag.half_width:
        notes.append(
            f"the torque reading seems to be low-passed with {shown}, and amplitudes of high "
            'orders come out too small: write torque_lag_s = "fit", or the time constant of the '
            "drive's filter, 0 for none"
        )
    return 0.0


def _near_samples(grid: FloatArray, time: FloatArray) -> FloatArray:
    """Return 1 for times of the grid that lie between samples without a gap, else 0."""
    after = np.clip(np.searchsorted(time, grid), 1, time.size - 1)
    return np.where(time[after] - time[after - 1] <= _GAP_S, 1.0, 0.0)


def _meta(
    table: Table, mapping_path: Path, winch: Winch, speed_rad_s: float, lag_s: float
) -> dict[str, Any]:
    drive = winch.drive
    return {
        "identity": {
            "winch": winch.reference,
            "motor": winch.motor.model,
            "vendor_id": drive.vendor_id,
            "product_code": drive.product_code,
            "revision": drive.revision,
            "serial": IMPORTED_SERIAL,
            "encoder_counts_per_turn": winch.encoder_counts_per_turn,
        },
        "latency_s": 0.0,
        "speed_rad_s": speed_rad_s,
        "torque_lag_s": lag_s,
        "source": {
            "file": table.path.name,
            "sha256": table.sha256,
            "mapping_sha256": hashlib.sha256(mapping_path.read_bytes()).hexdigest(),
        },
    }


def _write(path: Path, what: str, run: SweepData, valid: FloatArray, meta: dict[str, Any]) -> None:
    """Write one pass; the index is at zero."""
    period = float(run.time_s[1] - run.time_s[0])
    columns = {
        "setpoint_rad": run.setpoint_rad,
        "setpoint_velocity_rad_s": run.setpoint_velocity_rad_s,
        "position_rad": run.angle_rad,
        "torque_actual_Nm": run.torque_Nm,
        "torque_sent_Nm": run.torque_Nm,
        "effort_Nm": run.torque_Nm,
        "valid": valid,
        "index_known": np.ones(run.time_s.size),
    }
    zero = np.zeros(run.time_s.size)
    rows = [np.arange(run.time_s.size), run.time_s, *(columns.get(c, zero) for c in AXIS_COLUMNS)]
    facts = {"axes": 1, "period_s": period, "measured_from_s": 0.0, "first_cycle": 0}
    facts["measured_until_s"] = (run.time_s.size + 1) * period
    log = RawLogWriter(path, column_names(1), {"what": what, **facts, **meta})
    try:
        log.write(np.ascontiguousarray(np.stack(rows, axis=1), float))
    finally:
        log.close()


def _facts(path: Path, piece: _Piece, run: SweepData, valid: FloatArray) -> dict[str, Any]:
    speed = float(run.setpoint_velocity_rad_s[0])
    return {
        "pass": path.name,
        "source": piece.table.path.name,
        "turns": abs(float(run.angle_rad[-1] - run.angle_rad[0])) / math.tau,
        "speed_deg_s": math.degrees(speed),
        "samples": int(piece.reading.time_s.size),
        "in_gaps": float(1.0 - valid.mean()),
    }


def _import_maps(
    files: Sequence[Path], mapping_path: Path, mapping: MotorMapping, winch: Winch, paths: Paths
) -> Imported:
    """Write static maps, torques at standstill, as passes `map` for `cdpr cogging compare`."""
    angles, torques = motor_units(winch)
    written, passes = [], []
    notes: list[str] = []
    for k, path in enumerate(files):
        table = read_any(path, {"": winch})
        table = usable(table, None, (mapping.columns.angle, mapping.columns.torque), notes)
        angle = mapping.columns.angle.read_all(table, angles)
        torque = mapping.columns.torque.read_all(table, torques)
        count = angle.size
        if count < _FEWEST_ANGLES:
            problem = f"{count} rows; allowed: {_FEWEST_ANGLES} or more"
            raise ProfileError(table.path, "", problem)
        run = SweepData(np.arange(count, dtype=float), angle, torque, angle, np.ones(count))
        to = paths.raw(f"map-{k}")
        _write(to, "map", run, np.ones(count), _meta(table, mapping_path, winch, 1.0, 0.0))
        written.append(to)
        passes.append({"pass": to.name, "source": path.name, "samples": count})
    return Imported(written, notes, 0.0, passes)
