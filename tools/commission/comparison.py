"""How well the identified curves explain the torque of runs that were not used for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging_profile import CoggingProfile
from cdpr_rt.identification.commissioning_results import Paths, recording
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.identification.torque_lag import with_lag
from cdpr_rt.identification.windows import SweepData

LEAST_SQUARES_ORDERS: Final = 40
CURVES: Final = ("harmonic", "thesis", "least squares")
_SETTLED_LAGS: Final = 3.0
_SHIFTS_RAD: Final = np.radians(np.linspace(-1.0, 1.0, 41))


@dataclass(frozen=True)
class Run:
    """One recorded pass, and the time constant of its torque reading."""

    path: Path
    sweep: SweepData
    torque_lag_s: float

    @property
    def direction(self) -> int:
        """0 for increasing angles, 1 for decreasing ones: the rows of a profile's tables."""
        return int(self.sweep.setpoint_velocity_rad_s.mean() < 0.0)

    @property
    def is_static(self) -> bool:
        """Whether it is a map of torques at standstill, approached from an unknown direction."""
        return self.path.stem.startswith("map")


def runs_of(folder: Path) -> list[Run]:
    """Return the sweeps and static maps of a folder of recordings; raises RawLogError."""
    paths = Paths(folder)
    found = []
    for path in [*paths.passes("sweep"), *paths.passes("map")]:
        log = read_raw_log(path)
        found.append(Run(path, recording(log).sweep, float(log.header.get("torque_lag_s", 0.0))))
    return found


def explained(table_Nm: FloatArray, run: Run) -> float:
    """Return R2 of a run: the share of the torque's variance that a table over the turn explains.

    Table and run are compared after the filter of the drive's torque reading. Their means are left
    out, because the mean torque is friction.
    """
    sweep, count = run.sweep, table_Nm.size
    place = np.mod(sweep.angle_rad / (2.0 * np.pi), 1.0) * count
    curve = np.interp(place, np.arange(count + 1), np.append(table_Nm, table_Nm[0]))
    settled = sweep.time_s >= sweep.time_s[0] + _SETTLED_LAGS * run.torque_lag_s
    left, torque = (
        with_lag(sweep.time_s, values, run.torque_lag_s)[settled]
        for values in (sweep.torque_Nm - curve, sweep.torque_Nm)
    )
    return float(1.0 - np.var(left) / np.var(torque))


def best_shift(table_Nm: FloatArray, run: Run) -> tuple[float, float]:
    """Return the largest R2 of a run, and the shift of the curve by up to 1 deg, rad, for it.

    Hysteresis shifts the cogging between the directions of motion. Runs in one direction do not
    determine this shift.
    """
    r2, shift = -np.inf, 0.0
    for by in _SHIFTS_RAD:
        moved = replace(run.sweep, angle_rad=run.sweep.angle_rad - by)
        r2, shift = max((r2, shift), (explained(table_Nm, replace(run, sweep=moved)), float(by)))
    return r2, shift


def tables(profile: CoggingProfile, used: Sequence[Run]) -> dict[str, FloatArray]:
    """Return each method's table over the turn; rows: increasing angle, decreasing angle."""
    return {
        "harmonic": np.array(profile.harmonic.table_Nm),
        "thesis": np.array(profile.thesis.table_Nm),
        "least squares": least_squares(used, len(profile.thesis.table_Nm[0])),
    }


def least_squares(runs: Sequence[Run], samples: int) -> FloatArray:
    """Return tables by least squares over all samples: orders 1 to 40, and a constant per run."""
    order = np.arange(1, LEAST_SQUARES_ORDERS + 1)
    angle = np.concatenate([run.sweep.angle_rad for run in runs])
    torque = np.concatenate([run.sweep.torque_Nm - run.sweep.torque_Nm.mean() for run in runs])
    number = np.repeat(np.arange(len(runs)), [run.sweep.time_s.size for run in runs])
    constants = (number[:, None] == np.arange(len(runs))).astype(float)
    phase = angle[:, None] * order
    x = np.column_stack([np.cos(phase), np.sin(phase), constants])
    found = np.linalg.lstsq(x, torque, rcond=None)[0][: 2 * order.size]
    grid = np.arange(samples)[:, None] * (2.0 * np.pi / samples) * order
    curve = np.column_stack([np.cos(grid), np.sin(grid)]) @ found
    return np.vstack([curve, curve])
