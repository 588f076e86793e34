"""Convert recordings of other programs for `cdpr log`, which lists, draws and exports them."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles import Robot, Winch
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.core.cycle_row import AXES, POSES, Row, cycle_dtype
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.recording import Recorder
from cdpr_rt.service.rows import WallClock
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.imports.calibration import Poses, read_poses
from cdpr_tools.imports.logs import read_any
from cdpr_tools.imports.mapping import (
    FORCES,
    LENGTHS,
    AxisColumns,
    RecordingMapping,
    motor_units,
    read_time,
    shifted,
    speed_units,
)
from cdpr_tools.imports.tables import Table

_FIELDS: Final = {
    "position_rad": "angles",
    "setpoint_rad": "angle_setpoints",
    "velocity_rad_s": "speeds",
    "torque_actual_Nm": "torques",
    "torque_sent_Nm": "torque_setpoints",
    "cable_length_m": "lengths",
    "tension_N": "tensions",
}
"""Field of a recording by the columns from which it comes."""
_BATCH: Final = 2048
"""Rows written before the recorder takes them; fewer than its memory holds."""
_EPOCH_S: Final = 1e9
"""Larger times are times of day, in s since 1970."""
_WHOLE: Final = 1 << 62
_PROGRAM: Final = "imported"


@dataclass(frozen=True)
class ImportedRows:
    """Rows of a recording, with the time of day of the first, if the file has it."""

    rows: Row
    start_ns: int | None
    sources: tuple[str, ...]


def import_recording(
    path: Path, poses: Path, mapping_path: Path, robot: Robot
) -> tuple[ImportedRows, list[str]]:
    """Return the rows of recorded files, and the names of the quantities in them.

    A quantity that is not recorded stays unknown. Rows have the times of the axes' columns, or of
    the poses without such columns. Raises ProfileError and BadInputError.
    """
    mapping = RecordingMapping.load_file(mapping_path)
    columns = mapping.axis_columns()
    winches = {f"{axis.name}.": axis.winch for axis in robot.axes}
    if robot.is_winch:
        winches = {"": robot.axes[0].winch}
    table = read_any(path, winches)
    measured = None
    if mapping.pose is not None:
        measured = read_poses(table if poses == path else read_any(poses), mapping.pose, [])
    if columns is not None:
        time = read_time(columns.time, table)
    elif measured is not None:
        time = measured.time_s
    else:
        raise ProfileError(mapping_path, "", "contains no tables; allowed: cables, columns, pose")
    chosen = np.flatnonzero((time >= mapping.from_s) & (time <= mapping.until_s))
    if not chosen.size:
        raise BadInputError(
            f"{path}: no rows between from_s and until_s; the times are {time[0]:.2f} s to "
            f"{time[-1]:.2f} s"
        )
    rows = _empty(time[chosen], len(robot.axes))
    if columns is not None:
        _fill_axes(rows, columns, table, robot, chosen)
    if measured is not None:
        rows["pose"] = _pose_rows(measured, time[chosen], robot)
    if mapping.target is not None:
        target = read_poses(table, mapping.target, [])
        rows["pose_setpoint"] = _pose_rows(target, time[chosen], robot)
    start_ns = round(1e9 * time[chosen[0]]) if time[chosen[0]] > _EPOCH_S else None
    sources = dict.fromkeys((path.name, poses.name))
    known = [name for name in (*_FIELDS, *POSES) if np.isfinite(rows[name]).any()]
    return ImportedRows(rows, start_ns, tuple(sources)), known


def _empty(time: FloatArray, axes: int) -> Row:
    """Return rows of an active robot at these times, with all quantities unknown."""
    rows = np.zeros(time.size, cycle_dtype(axes))
    for name in (*AXES, *POSES, "lateness_s", "exchange_s", "compute_s", "stream_age_s"):
        if rows.dtype[name].base.kind == "f":
            rows[name] = np.nan
    rows["cycle"] = np.arange(time.size)
    rows["time_s"] = time - time[0]
    rows["state"] = LoopState.ACTIVE
    rows["limit_axis"] = -1
    return rows


def _fill_axes(
    rows: Row, columns: AxisColumns, table: Table, robot: Robot, chosen: IntArray
) -> None:
    """Write the axes' quantities into the rows."""
    time = read_time(columns.time, table)
    for field, kind in _FIELDS.items():
        given = getattr(columns, kind)
        if len(given) not in (0, len(robot.axes)):
            problem = f"{len(given)} columns; allowed: {len(robot.axes)}, one for each axis"
            raise ProfileError(table.path, f"cables.{kind}", problem)
        for k, (column, axis) in enumerate(zip(given, robot.axes, strict=bool(given))):
            values = column.read(table, _units(kind, axis.winch))
            values = shifted(time, values, column.late_by_s(columns.time))
            rows[field][:, k] = values[chosen]
    rows["valid"] = np.isfinite(rows["position_rad"])


def _units(kind: str, winch: Winch) -> Mapping[str, float]:
    angles, torques = motor_units(winch)
    return {"lengths": LENGTHS, "tensions": FORCES, "speeds": speed_units(winch)}.get(
        kind, torques if kind.startswith("torque") else angles
    )


def _pose_rows(poses: Poses, time: FloatArray, robot: Robot) -> FloatArray:
    """Return poses at these times as x, y, z and quaternion w, x, y, z, nan if unknown."""
    found = np.full((time.size, 7), np.nan)
    known = poses.known_at(time)
    found[known, :3] = poses.position_at(time[known])
    if robot.platform is not None and len(robot.platform.home_m) == 2:
        found[known, 2] = 0.0  # in a plane
    if poses.rotation is not None and known.any():
        turned = poses.turned_at(time[known]).as_quat()
        found[known, 3:] = turned[:, [3, 0, 1, 2]]
    return found


def write_recording(imported: ImportedRows, robot: Robot, path: Path) -> None:
    """Write the rows into one recording file; raises WorkFailedError."""
    rows = imported.rows
    block = SharedBlock.create(len(robot.axes), 2 * _BATCH, 1.0)
    wall = WallClock(block)
    block.counters["start_monotonic_ns"] = wall.start_monotonic_ns
    block.counters["start_realtime_ns"] = imported.start_ns or wall.start_ns
    rows["stamp_ns"] = wall.start_monotonic_ns + np.round(1e9 * rows["time_s"]).astype(np.int64)
    block.write_description(
        {
            "robot": robot.name,
            "reference": robot.reference,
            "period_s": float(np.median(np.diff(rows["time_s"]))) if rows.size > 1 else None,
            "axes": [{"name": axis.name} for axis in robot.axes],
            "programs": [_PROGRAM],
        }
    )
    block.write_status({"state": LoopState.ACTIVE.label, "program": _PROGRAM})
    with os_error_as(WorkFailedError, f"{path}: cannot be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            recorder = Recorder(block, Path(folder), robot.name, most_bytes=_WHOLE)
            recorder.begin()
            recorder.remark(f"imported from {', '.join(imported.sources)}")
            _record(rows, block, recorder)
            recorder.finish()
            status = recorder.status()
            if status["error"]:
                raise WorkFailedError(status["error"])
            shutil.move(status["file"], path)


def _record(rows: Row, block: SharedBlock, recorder: Recorder) -> None:
    writer = RowWriter(block)
    for first in range(0, rows.size, _BATCH):
        for k in range(first, min(first + _BATCH, rows.size)):
            writer.slot()[:] = rows[k]
            writer.commit()
        recorder.look()
