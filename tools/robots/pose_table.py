"""Poses of a table of cable lengths, and their errors against measured poses."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles.bounded_input import read_text
from cdpr_rt.arrays import FloatArray
from cdpr_rt.offline import Model
from cdpr_tools.errors import BadInputError

_MOST_BYTES: Final = 64 << 20
POSITION: Final = ("x_m", "y_m", "z_m")
QUATERNION: Final = ("qw", "qx", "qy", "qz")
_TILT: Final = ("roll_rad", "pitch_rad")
_FEWEST: Final = 32
_LEAST_PERIODS: Final = 3
"""Smallest number of periods of a swing in a table."""
_SLOWEST_Hz: Final = 0.1
"""Frequency of a pendulum of 25 m."""
_ABOVE: Final = 3.0


@dataclass(frozen=True)
class PoseTable:
    """The columns of a table with m rows; None for those that it does not have."""

    length_m: FloatArray
    """(m, n)"""
    tension_N: FloatArray | None
    """At the winches, (m, n)."""
    tilt_rad: FloatArray | None
    """Roll and pitch, (m, 2)."""
    position_m: FloatArray | None
    """Measured positions, (m, 3)."""
    quaternion: FloatArray | None
    """Measured rotations, w x y z, (m, 4)."""
    time_s: FloatArray | None
    """Times of the rows, (m, 1)."""


def read_pose_table(path: Path, n: int) -> PoseTable:
    """Read a CSV table for a robot with n cables; raises BadInputError and ProfileError.

    Its columns are length_1_m to length_n_m, and if they were measured tension_1_N to tension_n_N,
    roll_rad and pitch_rad, x_m y_m z_m, qw qx qy qz, time_s. Others are ignored.
    """
    lines = [row for row in csv.reader(io.StringIO(read_text(path, _MOST_BYTES))) if row]
    if len(lines) < 2:
        raise BadInputError(f"{path}: allowed: a line of column names and at least one row")
    names = [name.strip() for name in lines[0]]

    def column(name: str) -> list[float]:
        at, found = names.index(name), []
        for number, row in enumerate(lines[1:], 2):
            try:
                found.append(float(row[at]))
            except (ValueError, IndexError):
                cell = row[at] if at < len(row) else ""
                raise BadInputError(
                    f"{path}: row {number}, {name}: {cell!r} is not a number"
                ) from None
        if not np.isfinite(found).all():
            bad = int(np.argmin(np.isfinite(found))) + 2
            raise BadInputError(f"{path}: row {bad}, {name}: allowed: a finite number")
        return found

    def columns(*wanted: str) -> FloatArray | None:
        missing = [name for name in wanted if name not in names]
        if missing and len(missing) < len(wanted):
            raise BadInputError(
                f"{path}: column {missing[0]} is missing; required: {', '.join(wanted)}"
            )
        return None if missing else np.transpose([column(name) for name in wanted])

    each = range(1, n + 1)
    lengths = columns(*(f"length_{i}_m" for i in each))
    if lengths is None:
        raise BadInputError(f"{path}: columns length_1_m to length_{n}_m are missing")
    tensions, tilt = columns(*(f"tension_{i}_N" for i in each)), columns(*_TILT)
    poses = columns(*POSITION), columns(*QUATERNION)
    return PoseTable(lengths, tensions, tilt, *poses, columns("time_s"))


def swing(table: PoseTable) -> dict[str, float]:
    """Return amplitude and period of a swing that the inclinometer shows; empty for none.

    The period is that of the strongest frequency in roll and pitch. Its peak must stand out from
    neighbouring frequencies; other motions have no such peak.
    """
    if table.time_s is None or table.tilt_rad is None or len(table.time_s) < _FEWEST:
        return {}
    time = table.time_s[:, 0]
    step_s = float(np.median(np.diff(time)))
    if not (np.diff(time) > 0.0).all():
        return {}
    grid = np.arange(time[0], time[-1], step_s)
    tilt = np.column_stack([np.interp(grid, time, one) for one in table.tilt_rad.T])
    tilt -= tilt.mean(axis=0)
    window = np.hanning(grid.size)
    power = (np.abs(np.fft.rfft(tilt * window[:, None], axis=0)) ** 2).sum(axis=1)
    first = max(_LEAST_PERIODS, math.ceil(_SLOWEST_Hz * grid.size * step_s))
    k = int(power.argmax())
    if not first < k < power.size - 6:
        return {}
    near, beside = power[k - 2 : k + 3], (*power[max(k - 5, 0) : k - 2], *power[k + 3 : k + 6])
    if not near.mean() > _ABOVE * max(beside):
        return {}
    peak = k + float(near @ np.arange(-2, near.size - 2)) / float(near.sum())
    frequency_Hz = peak / (grid.size * step_s)
    phase = 2.0 * np.pi * frequency_Hz * grid
    waves = np.column_stack([np.cos(phase), np.sin(phase)])
    found = np.linalg.lstsq(waves, tilt, rcond=None)[0]
    amplitude = float(np.degrees(np.linalg.svd(found, compute_uv=False)[0]))
    return {"amplitude_deg": amplitude, "period_s": 1.0 / frequency_Hz}


def estimates(model: Model, table: PoseTable) -> dict[str, FloatArray]:
    """Return the poses (m, 7) from each set of sensors; the set of all sensors comes last."""
    found = {"lengths": model.pose(table.length_m)}
    if not model.hangs_freely:
        return found
    with_cells = {"tension_N": table.tension_N}
    with_tilt = {"tilt_rad": table.tilt_rad}
    for name, given in (
        ("lengths, load cells", with_cells),
        ("lengths, inclinometer", with_tilt),
        ("lengths, load cells, inclinometer", with_cells | with_tilt),
    ):
        if all(values is not None for values in given.values()):
            found[name] = model.pose(table.length_m, **given)
    return found


def errors(poses: FloatArray, table: PoseTable) -> dict[str, dict[str, float]]:
    """Return mean, root mean square and largest error of poses (m, 7) against measured ones.

    These are errors of the position, of the tilt, and of the rotation about the vertical axis.
    Poses that were not found are left out.
    """
    known = np.isfinite(poses).all(axis=1)
    found: dict[str, FloatArray] = {}
    if table.position_m is not None:
        off = poses[known, :3] - table.position_m[known]
        found["position, mm"] = 1e3 * np.linalg.norm(off, axis=1)
    if table.quaternion is not None:
        computed, true = (
            Rotation.from_quat(np.roll(q[known], -1, axis=1))
            for q in (poses[:, 3:], table.quaternion)
        )
        turn = (computed * true.inv()).as_rotvec(degrees=True)
        found["tilt, deg"] = np.linalg.norm(turn[:, :2], axis=1)
        found["about z, deg"] = np.abs(turn[:, 2])
    return {
        what: {
            "mean": float(off.mean()),
            "rms": float(np.sqrt((off**2).mean())),
            "largest": float(off.max()),
        }
        for what, off in found.items()
        if off.size
    }


def write_pose_table(path: Path, poses: FloatArray) -> None:
    """Write poses (m, 7) as CSV; raises OSError."""
    lines = [",".join((*POSITION, *QUATERNION))]
    lines += [",".join(f"{value:.6f}" for value in pose) for pose in poses]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
