"""Recorded cable lengths and poses of motion capture, as data for `cdpr calibrate fit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from cdpr_profiles import Robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.calibration.readings import CalibrationData, PoseReading
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.imports.logs import read_any
from cdpr_tools.imports.mapping import (
    ANGLES,
    FORCES,
    LENGTHS,
    NUMBERS,
    CalibrationMapping,
    Column,
    PoseColumns,
    read_time,
    shifted,
    usable,
)
from cdpr_tools.imports.tables import Table

_GAP_S, _GAP_STEPS = 0.05, 3.0
"""Rows farther apart in time than this, and than this number of usual steps, leave a gap."""
_FEWEST: Final = 3
_CLOCK_STEP_S: Final = 0.02
_LEAST_S: Final = 1.0
"""Shortest recording that shows whether the clocks agree."""
_ALIKE: Final = 0.8
"""Smallest correlation of rates at which another difference of the clocks is suggested."""
_BETTER: Final = 0.2
"""Smallest increase of the correlation by that difference at which it is suggested."""


@dataclass(frozen=True)
class Poses:
    """Measured poses over time, in the room: positions (k, 3), rotations of length k or None."""

    time_s: FloatArray
    position_m: FloatArray
    rotation: Rotation | None

    def known_at(self, time: FloatArray) -> BoolArray:
        """Return whether these times, (m,), lie between two poses without a gap."""
        after = np.clip(np.searchsorted(self.time_s, time), 1, self.time_s.size - 1)
        first, second = self.time_s[after - 1], self.time_s[after]
        gap_s = _shortest_gap_s(self.time_s)
        return np.asarray((time >= first) & (time <= second) & (second - first <= gap_s))

    def position_at(self, time: FloatArray) -> FloatArray:
        """Return interpolated positions, (m, 3)."""
        return np.column_stack([np.interp(time, self.time_s, one) for one in self.position_m.T])

    def turned_at(self, time: FloatArray) -> Rotation:
        """Return interpolated rotations of length m; the file must have rotations."""
        assert self.rotation is not None
        return Slerp(self.time_s, self.rotation)(time)


def import_calibration(
    cables: Path, poses: Path, mapping_path: Path, robot: Robot
) -> tuple[CalibrationData, list[str]]:
    """Return the readings at the times of the cable lengths, with the poses interpolated there.

    Rotations are relative to the first reading, where the platform is at home. Also returns notes
    on what was left out. Raises ProfileError and BadInputError.
    """
    mapping = CalibrationMapping.load_file(mapping_path)
    model = platform_model_of(robot)
    table = read_any(cables)
    notes: list[str] = []
    measured = read_poses(table if poses == cables else read_any(poses), mapping.pose, notes)
    time, lengths, tensions = _read_cables(table, mapping, len(robot.axes), notes)
    notes += _require_same_clock(mapping_path, time, lengths, measured, model)
    row = _rows(time, measured, mapping)
    if row.size < _FEWEST:
        raise BadInputError(
            f"{cables}: {row.size} rows lie within the time of the poses, {measured.time_s[0]:.2f} "
            f"to {measured.time_s[-1]:.2f} s (of the cables: {time[0]:.2f} to {time[-1]:.2f} s); "
            "check the unit of the times, and correct the difference of the clocks by `offset`"
        )
    at = time[row]
    position = measured.position_at(at)
    turned = None
    if measured.rotation is not None:
        turned = measured.turned_at(at)
        turned = turned * turned[0].inv() * Rotation.from_matrix(model.home_pose.Q)
    _require_home(poses, position[0], model)
    readings = [
        _reading(
            mapping.pose, float(at[i]), lengths[j], None if tensions is None else tensions[j],
            position[i], None if turned is None else turned[i], model,
        )
        for i, j in enumerate(row)
    ]  # fmt: skip
    notes += [f"{row.size} of {time.size} rows are used, at most {mapping.rate_Hz:g} a second"]
    data = CalibrationData(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=False,
        date=datetime.now(UTC).replace(microsecond=0).isoformat(),
        poses=tuple(readings),
    )
    return data, notes


def _reading(
    columns: PoseColumns,
    time_s: float,
    length_m: FloatArray,
    tension_N: FloatArray | None,
    position_m: FloatArray,
    turned: Rotation | None,
    model: PlatformModel,
) -> PoseReading:
    """Return the reading of one instant."""
    values: dict[str, Any] = {
        "target": tuple(_target(model, position_m)),
        "length_m": tuple(length_m.tolist()),
        "time_s": time_s,
        "position_m": tuple(position_m.tolist()),
        "position_std_m": columns.position_std_m,
    }
    if tension_N is not None:
        values["tension_N"] = tuple(tension_N.tolist())
    if turned is not None:
        values["rotation"] = tuple(map(tuple, turned.as_matrix().tolist()))
        values["rotation_std_rad"] = float(np.radians(columns.rotation_std_deg))
    return PoseReading.model_validate(values)


def _read_cables(
    table: Table, mapping: CalibrationMapping, cables: int, notes: list[str]
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return times, lengths (rows, n), and tensions (rows, n) or None."""
    columns = mapping.cables
    for what, given in (("lengths", columns.lengths), ("tensions", columns.tensions)):
        if len(given) != cables and (given or what == "lengths"):
            raise ProfileError(
                table.path,
                f"cables.{what}",
                f"{len(given)} columns; allowed: {cables}, one for each cable",
            )
    table = usable(table, columns.time, (*columns.lengths, *columns.tensions), notes)
    time = read_time(columns.time, table)

    def values(some: Sequence[Column], units: Mapping[str, float]) -> FloatArray:
        each = (
            shifted(time, one.read_all(table, units), one.late_by_s(columns.time)) for one in some
        )
        return np.column_stack(list(each))

    lengths = values(columns.lengths, LENGTHS)
    return time, lengths, values(columns.tensions, FORCES) if columns.tensions else None


def read_poses(table: Table, columns: PoseColumns, notes: list[str]) -> Poses:
    """Return the poses in the room; skip rows with an empty cell, where the body was hidden.

    Add to `notes` how many rows were left out.
    """
    table = usable(table, columns.time, (), notes)
    time = read_time(columns.time, table)
    turning = (*(columns.quaternion or ()), *(columns.rotation_vector or ()))
    late_s = {one.late_by_s(columns.time) for one in (*columns.position, *turning)}
    if len(late_s) > 1:
        problem = f"values {sorted(late_s)}; allowed: the same for all columns of a pose"
        raise ProfileError(table.path, "pose: time_offset_s", problem)
    time = time + late_s.pop()
    to_room = _to_room(table, columns)
    position = np.column_stack([one.read(table, LENGTHS) for one in columns.position])
    seen = np.isfinite(position).all(axis=1)
    turns = None
    for given, units in ((columns.quaternion, NUMBERS), (columns.rotation_vector, ANGLES)):
        if given is not None:
            turns = np.column_stack([one.read(table, units) for one in given])
            seen &= np.isfinite(turns).all(axis=1)
            if units is NUMBERS:  # a quaternion of zeros: the body was hidden
                seen &= turns.any(axis=1)
    if np.count_nonzero(seen) < _FEWEST:
        problem = f"{np.count_nonzero(seen)} rows with a pose; allowed: {_FEWEST} or more"
        raise ProfileError(table.path, "", problem)
    if hidden := np.count_nonzero(~seen):
        notes.append(f"{table.path}: left out {hidden} of {seen.size} rows without a pose")
    rotation = None
    if turns is not None:
        by_quaternion = columns.rotation_vector is None
        basis, measured = Rotation.from_matrix(to_room), turns[seen]
        of_body = Rotation.from_quat(measured) if by_quaternion else Rotation.from_rotvec(measured)
        rotation = basis * of_body * basis.inv()
    return Poses(time[seen], position[seen] @ to_room.T + columns.offset_m, rotation)


def _to_room(table: Table, columns: PoseColumns) -> FloatArray:
    """Return the rotation matrix from the file's frame to the room; raises ProfileError."""
    matrix = np.zeros((3, 3))
    for i, axis in enumerate(columns.axes):
        name = axis.removeprefix("-")
        if name not in ("x", "y", "z"):
            problem = f"value {axis!r}; allowed: x, y, z, -x, -y, -z"
            raise ProfileError(table.path, f"pose.axes[{i}]", problem)
        matrix[i, "xyz".index(name)] = -1.0 if axis.startswith("-") else 1.0
    if not np.isclose(np.linalg.det(matrix), 1.0):
        problem = f"value {list(columns.axes)}; allowed: each axis once, as a right-handed frame"
        raise ProfileError(table.path, "pose.axes", problem)
    return matrix


def _rows(time: FloatArray, measured: Poses, mapping: CalibrationMapping) -> FloatArray:
    """Return the rows of the cables that lie between two poses, thinned to the highest rate."""
    inside = measured.known_at(time) & (time >= mapping.from_s) & (time <= mapping.until_s)
    kept, last = [], -np.inf
    for i in np.flatnonzero(inside):
        if time[i] - last >= (1.0 - 1e-3) / mapping.rate_Hz:
            kept.append(i)
            last = time[i]
    return np.array(kept, int)


def _require_same_clock(
    path: Path, time: FloatArray, lengths: FloatArray, poses: Poses, model: PlatformModel
) -> list[str]:
    """Raise BadInputError if lengths and poses agree much better at another difference of clocks.

    The rates of the lengths are compared with those of the distances to the exit points. Returns a
    note if they do not agree at any difference.
    """
    from scipy.signal import correlate, correlation_lags  # noqa: PLC0415  # slow to load

    if min(np.ptp(time), np.ptp(poses.time_s)) < _LEAST_S:
        return []
    exits = np.array(model.platform.exit_points_m)
    k = exits.shape[1]
    apart = np.linalg.norm(exits[None] - poses.position_m[:, None, :k], axis=2)
    of_cables, first = (_rates(*one) for one in ((time, lengths), (poses.time_s, apart)))
    products = sum(correlate(a, b) for a, b in zip(of_cables[0], first[0], strict=True))
    both = [np.ones_like(of_cables[0][0]), np.ones_like(first[0][0])]
    cable_power = correlate((of_cables[0] ** 2).sum(axis=0), both[1])
    pose_power = correlate(both[0], (first[0] ** 2).sum(axis=0))
    enough = (cable_power > 0.3 * cable_power.max()) & (pose_power > 0.3 * pose_power.max())
    alike = np.where(enough, products / np.sqrt(np.maximum(cable_power * pose_power, 1e-12)), 0.0)
    later_s = _CLOCK_STEP_S * correlation_lags(of_cables[0].shape[1], first[0].shape[1])
    later_s += of_cables[1] - first[1]
    now, best = int(np.abs(later_s).argmin()), int(alike.argmax())
    if alike[best] > _ALIKE and alike[best] - alike[now] > _BETTER:
        raise BadInputError(
            f"{path}: pose.time: the clocks differ: rates of lengths and poses have a correlation "
            f"of {alike[now]:.2f}, but {alike[best]:.2f} if the poses are {later_s[best]:+.2f} s "
            f"later; add {later_s[best]:.2f} s to `offset`"
        )
    if alike[now] > _ALIKE - _BETTER:
        return []
    return [
        f"rates of lengths and poses have a correlation of only {alike[now]:.2f}: check `axes`, "
        "the order and signs of the lengths, and the exit points"
    ]


def _shortest_gap_s(time: FloatArray) -> float:
    """Return the shortest distance in time, s, across which rows are not interpolated."""
    return max(_GAP_S, _GAP_STEPS * float(np.median(np.diff(time))))


def _rates(time: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    """Return rates of values (m, n) at equal steps, (n, r), 0 in gaps; and the first time."""
    grid = np.arange(time[0], time[-1], _CLOCK_STEP_S)
    after = np.clip(np.searchsorted(time, grid), 1, time.size - 1)
    gap = time[after] - time[after - 1] > _shortest_gap_s(time)
    rates = np.array([np.gradient(np.interp(grid, time, one), _CLOCK_STEP_S) for one in values.T])
    rates[:, gap] = 0.0
    return rates, float(grid[0])


def _target(model: PlatformModel, position_m: FloatArray) -> list[float]:
    """Return the coordinates (d,) where a search begins: at this position, turned as at home.

    The fit keeps the rotation near its target. So a measured rotation must not be the target: it
    would verify itself.
    """
    vector = np.zeros(6)
    vector[:3] = position_m
    return [float(vector[i]) for i in model.kinematics.directions]


def _require_home(path: Path, first_m: FloatArray, model: PlatformModel) -> None:
    """Raise BadInputError if the first pose is not home."""
    k = model.positions
    if np.abs(first_m[:k] - model.home[:k]).max() > model.platform.home_tolerance_m:
        at = np.round(first_m[:k], 5).tolist()
        raise BadInputError(
            f"{path}: the platform is at {at} m in the first row that is used, but home_m is "
            f"{list(model.platform.home_m)}; write home_m = {at} into the robot's file, or select "
            "another part of the recording by from_s"
        )
