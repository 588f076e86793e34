"""Which column of a table holds which quantity, and how its numbers become SI units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from cdpr_profiles import Winch
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reader import Profile
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_tools.imports.tables import Table

_Finite = Annotated[float, Field(ge=-1e9, le=1e9)]
TIMES: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
LENGTHS: Final = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ANGLES: Final = {"rad": 1.0, "deg": math.pi / 180.0, "turns": math.tau}
FORCES: Final = {"N": 1.0, "kN": 1e3, "kgf": 9.80665}
NUMBERS: Final = {"": 1.0}
_MOST_LATE: Final = 0.01
"""Largest share of rows that are left out because their time does not increase."""


class Column(Profile):
    """One quantity: value = sign · gain · number + offset, in `unit`."""

    name: str
    unit: str = ""
    """Unit of the numbers; by default the one that the file states, or else the SI unit."""
    sign: Annotated[int, Field(ge=-1, le=1)] = 1
    gain: _Finite = 1.0
    offset: _Finite = 0.0
    time_offset_s: Annotated[float, Field(ge=-1e6, le=1e6)] = 0.0
    """Time of the value minus the time of its row."""

    def read(self, table: Table, units: Mapping[str, float]) -> FloatArray:
        """Return the values in SI units, (rows,), nan for empty cells; raises ProfileError.

        The first of `units`, by name, is the default.
        """
        numbers = table.column(self.name)
        unit = self.unit or table.units.get(self.name, next(iter(units)))
        if unit not in units:
            allowed = ", ".join(units)
            problem = f"column {self.name!r} has the unit {unit!r}; allowed as `unit`: {allowed}"
            raise ProfileError(table.path, "", problem)
        if self.sign == 0:
            raise ProfileError(
                table.path, "", f"column {self.name!r} has the sign 0; allowed: 1 and -1"
            )
        return np.asarray(units[unit] * (self.sign * self.gain * numbers + self.offset))

    def read_all(self, table: Table, units: Mapping[str, float]) -> FloatArray:
        """Return the values as `read`; raises ProfileError also for an empty cell."""
        values = self.read(table, units)
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise table.fault(self.name, row, "is empty; allowed: a number in every row")
        return values

    def late_by_s(self, time: Column) -> float:
        """Return the time of the values minus the times that the column `time` gives."""
        return self.time_offset_s - time.time_offset_s


def shifted(time: FloatArray, values: FloatArray, by_s: float) -> FloatArray:
    """Return values that belong to times later by `by_s`, interpolated at the times of the rows."""
    return np.interp(time, time + by_s, values) if by_s else values


def usable(table: Table, time: Column | None, needed: Iterable[Column], notes: list[str]) -> Table:
    """Return the rows with a number in each needed column, and with increasing times.

    Adds a note for rows that are left out. If many times do not increase, no row is left out for
    that; `read_time` then rejects the table.
    """
    filled = np.ones(table.lines.size, bool)
    for column in (*([] if time is None else [time]), *needed):
        filled &= np.isfinite(table.column(column.name))
    if filled.any():
        table = _kept(table, filled, "with an empty cell", notes)
    if time is not None:
        times = time.read(table, TIMES)
        in_order = np.ones(times.size, bool)
        in_order[1:] = times[1:] > np.fmax.accumulate(times)[:-1]
        if np.count_nonzero(~in_order) <= _MOST_LATE * times.size:
            table = _kept(table, in_order, "whose time does not increase", notes)
    return table


def _kept(table: Table, rows: BoolArray, why: str, notes: list[str]) -> Table:
    count = int(np.count_nonzero(~rows))
    if not count:
        return table
    first = int(table.lines[int(np.argmin(rows))])
    notes.append(
        f"{table.path}: left out {count} of {rows.size} rows {why}, the first in line {first}"
    )
    return table.some(rows)


def read_time(column: Column, table: Table) -> FloatArray:
    """Return the time in s, (rows,); raises ProfileError if it does not increase."""
    time = column.read_all(table, TIMES)
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if late.size:
        row = int(late[0]) + 1
        problem = f"the time does not increase: {time[row - 1]:.6f} s, then {time[row]:.6f} s"
        raise table.fault(column.name, row, f"{problem}; remove the row, or split the file")
    return time


class MotorColumns(Profile):
    """Columns of a motor's recording; without time, it is a static map of angle after angle."""

    time: Column | None = None
    angle: Column
    """Motor angle from the encoder index; units rad, deg, turns, counts."""
    torque: Column
    """Units Nm, mNm, A_rms, A_peak, permille (of the rated torque)."""


class MotorMapping(Profile):
    """Mapping of a motor's recording."""

    columns: MotorColumns
    torque_lag_s: Annotated[float, Field(ge=0.0, le=2.0)] | Literal["fit"] | None = None
    """Time constant of the low-pass filter in the drive's reading of torque or current.

    By default none is removed, but the recording is searched for one.
    """
    from_s: float = -math.inf
    until_s: float = math.inf


def motor_units(winch: Winch) -> tuple[dict[str, float], dict[str, float]]:
    """Return the units of angle and torque of a motor."""
    motor = winch.motor
    per_A = motor.torque_constant_Nm_per_Arms
    angles = {**ANGLES, "counts": math.tau / winch.encoder_counts_per_turn}
    torques = {
        "Nm": 1.0,
        "mNm": 1e-3,
        "A_rms": per_A,
        "A_peak": per_A / math.sqrt(2.0),
        "permille": 1e-3 * motor.rated_torque_Nm,
    }
    return angles, torques


def speed_units(winch: Winch) -> dict[str, float]:
    """Return the units of speed of a motor."""
    angles, _ = motor_units(winch)
    return {**{f"{name}/s": value for name, value in angles.items()}, "rpm": math.tau / 60.0}


class CableColumns(Profile):
    """Columns of the cables: one of each kind for every axis, in the order of the robot's file."""

    time: Column
    lengths: tuple[Column, ...]
    """Units m, cm, mm."""
    tensions: tuple[Column, ...] = ()
    """Units N, kN, kgf; may be omitted."""


class PoseColumns(Profile):
    """Columns of a pose that a motion capture system measured, in its own frame."""

    time: Column
    position: Annotated[tuple[Column, ...], Field(min_length=3, max_length=3)]
    """x, y, z of the frame of the file; units m, cm, mm."""
    quaternion: Annotated[tuple[Column, ...], Field(min_length=4, max_length=4)] | None = None
    """x, y, z, w."""
    rotation_vector: Annotated[tuple[Column, ...], Field(min_length=3, max_length=3)] | None = None
    """x, y, z, as in exports of Vicon and Qualisys; units rad, deg."""
    axes: tuple[str, str, str] = ("x", "y", "z")
    """The axis of the file's frame along each axis of the robot's room, such as "-x"."""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Offset that is added to the position, in the room."""
    position_std_m: Annotated[float, Field(gt=0.0, le=1.0)] = 0.001
    rotation_std_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 0.5


class CalibrationMapping(Profile):
    """Mapping of recorded cable lengths and poses."""

    cables: CableColumns
    pose: PoseColumns
    from_s: float = -math.inf
    until_s: float = math.inf
    rate_Hz: Annotated[float, Field(gt=0.0, le=1e4)] = 100.0
    """Highest rate at which readings are used."""


class AxisColumns(Profile):
    """Columns of the axes for a recording: of each kind none, or one for every axis."""

    time: Column
    angles: tuple[Column, ...] = ()
    angle_setpoints: tuple[Column, ...] = ()
    speeds: tuple[Column, ...] = ()
    torques: tuple[Column, ...] = ()
    """Torque or current that the drive reports."""
    torque_setpoints: tuple[Column, ...] = ()
    lengths: tuple[Column, ...] = ()
    tensions: tuple[Column, ...] = ()


class RecordingMapping(Profile):
    """Mapping of a recording of a whole machine; mappings of the other imports are valid too."""

    cables: AxisColumns | None = None
    columns: MotorColumns | None = None
    """Of a single motor, in place of `cables`."""
    pose: PoseColumns | None = None
    target: PoseColumns | None = None
    """Set-point of the pose, in the file of the cables."""
    from_s: float = -math.inf
    until_s: float = math.inf
    rate_Hz: float = math.inf
    torque_lag_s: float | str | None = None
    """Ignored, as is `rate_Hz`: a recording keeps the values as they are."""

    def axis_columns(self) -> AxisColumns | None:
        """Return the columns of the axes; a motor counts as a single axis."""
        motor = self.columns
        if motor is None or motor.time is None:
            return self.cables
        return AxisColumns(time=motor.time, angles=(motor.angle,), torques=(motor.torque,))
