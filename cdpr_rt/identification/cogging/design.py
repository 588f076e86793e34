"""Design matrix of the regression over windows, and its normal equations by fold and kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging.friction import FrictionShape, relative_friction, sliding
from cdpr_rt.identification.cogging.sweep import TWO_PI
from cdpr_rt.identification.cogging.windows import Windows, average
from cdpr_rt.jit import jit

_CHUNK = 1024
_QUICK_rad_s = 1.0
_FOLDS = 6

INERTIA, LATENCY = 0, 1
COULOMB = 2  # forward, backward
VISCOUS = 4
CREEP = 5  # forward, backward
FIXED = 7


@dataclass(frozen=True)
class ColumnLayout:
    """Order of the columns: the fixed ones, then cosine and sine of each order."""

    orders: tuple[int, ...]
    shape: FrictionShape

    @property
    def columns(self) -> int:
        """Number of columns."""
        return FIXED + 2 * len(self.orders)

    def order(self, which: int) -> list[int]:
        """Return the columns, cosine and sine, of one order."""
        return [FIXED + 2 * which, FIXED + 2 * which + 1]


@dataclass
class Normal:
    """Sums of one fold and kind of row: X'X, X'y, y'y and the number of rows."""

    xx: FloatArray
    xy: FloatArray
    yy: float = 0.0
    rows: int = 0


@dataclass
class Equations:
    """Normal equations by (fold, kind); kinds are numbered by run class and sliding or creeping."""

    layout: ColumnLayout
    folds: int = 0
    kinds: int = 0
    parts: dict[tuple[int, int], Normal] = field(default_factory=dict)


@jit
def _harmonics(
    angle: FloatArray,
    bump: FloatArray,
    stride: int,
    first: int,
    orders: FloatArray,
    out: FloatArray,
) -> None:
    """Add the windows' averages of sines and cosines to the columns from FIXED on."""
    rows = out.shape[0]
    waves = np.zeros(2 * orders.size)
    for s in range(first * stride, (first + rows + 4) * stride):
        if s >= angle.size:
            break
        c1, s1 = np.cos(angle[s]), np.sin(angle[s])
        c, d, last = 1.0, 0.0, 0.0
        block = s // stride
        for j in range(orders.size):
            ahead = orders[j] - last
            last = orders[j]
            if ahead == 1.0:
                c, d = c * c1 - d * s1, d * c1 + c * s1
            else:
                c, d = np.cos(last * angle[s]), np.sin(last * angle[s])
            waves[2 * j], waves[2 * j + 1] = c, d
        for r in range(max(block - 4, first), min(block, first + rows - 1) + 1):
            w = s - r * stride
            if w <= 4 * stride:
                for column in range(waves.size):
                    out[r - first, FIXED + column] += bump[w] * waves[column]


def matrix(windows: Windows, layout: ColumnLayout, first: int, last: int) -> FloatArray:
    """Return the regression's columns for windows `first` up to `last`, (last - first, columns)."""
    rows = slice(first, last)
    out = np.zeros((last - first, layout.columns))
    _harmonics(
        windows.angle_rad, windows.bump, windows.stride, first, np.array(layout.orders, float), out,
    )  # fmt: skip
    if windows.quasi_static:
        out[:, CREEP] = np.maximum(windows.direction[rows], 0.0)
        out[:, CREEP + 1] = np.minimum(windows.direction[rows], 0.0)
        return out
    if windows.quick:
        out[:, INERTIA] = windows.acceleration_rad_s2[rows]
    out[:, LATENCY] = windows.torque_rate_Nm_s[rows] * (
        np.abs(windows.speed_rad_s[rows]) > _QUICK_rad_s
    )
    slid = sliding(windows.angle_rad, windows.play_rad)
    friction = relative_friction(slid, windows.velocity_rad_s, layout.shape)
    values = (np.maximum(friction, 0.0), np.minimum(friction, 0.0), windows.velocity_rad_s)
    out[:, COULOMB : VISCOUS + 1] = average(np.column_stack(values), windows, first, last)
    return out


def kinds(windows: Sequence[Windows]) -> list[FloatArray]:
    """Number the rows of each run by the run's speed, as noise differs; -1 is left out."""
    speeds = sorted({round(float(np.rad2deg(w.cruise_rad_s)), 1) for w in windows})
    numbered = []
    for w in windows:
        kind = speeds.index(round(float(np.rad2deg(w.cruise_rad_s)), 1))
        numbered.append(np.where(w.moving, kind, -1))
    return numbered


def folds(windows: Sequence[Windows]) -> list[FloatArray]:
    """Number the rows of each run by the turn they lie in, whole turns together."""
    numbered, offset = [], 0
    for w in windows:
        turn = np.floor(np.abs(w.centre_rad - w.centre_rad[0]) / TWO_PI).astype(int)
        numbered.append((turn + offset) % _FOLDS)
        offset += int(turn.max()) + 1
    return numbered


def accumulate(windows: Sequence[Windows], layout: ColumnLayout) -> Equations:
    """Sum the normal equations of all runs, by fold and kind, in chunks of bounded memory."""
    kind, fold = kinds(windows), folds(windows)
    equations = Equations(layout)
    for w, k, f in zip(windows, kind, fold, strict=True):
        for first in range(0, w.torque_Nm.size, _CHUNK):
            last = min(first + _CHUNK, w.torque_Nm.size)
            x, y = matrix(w, layout, first, last), w.torque_Nm[first:last]
            for key in {
                (int(a), int(b)) for a, b in zip(f[first:last], k[first:last], strict=True)
            }:
                if key[1] < 0:
                    continue
                mask = (f[first:last] == key[0]) & (k[first:last] == key[1])
                part = equations.parts.get(key)
                if part is None:
                    p = layout.columns
                    part = equations.parts[key] = Normal(np.zeros((p, p)), np.zeros(p))
                x_part, y_part = x[mask], y[mask]
                part.xx += x_part.T @ x_part
                part.xy += x_part.T @ y_part
                part.yy += float(y_part @ y_part)
                part.rows += y_part.size
    equations.folds = 1 + max((key[0] for key in equations.parts), default=-1)
    equations.kinds = 1 + max((key[1] for key in equations.parts), default=-1)
    return equations
