"""Columns of the regression over windows, and its normal equations by turn and kind of row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.identification.sweep import TWO_PI
from cdpr_rt.identification.windows import Windows
from cdpr_rt.jit import jit

STRIBECK_SPEEDS_rad_s = (0.05, 0.1, 0.2, 0.4, 0.8)
_CHUNK = 1024

INERTIA, INERTIA_SLOW, LATENCY = 0, 1, 2
COULOMB = 3  # forward, backward
VISCOUS = 5
CREEP = 6  # forward, backward
FIXED = 8


@dataclass(frozen=True)
class Layout:
    """Which column is what: the fixed ones, two for each Stribeck speed, two for each order."""

    orders: tuple[int, ...]
    stribeck_rad_s: tuple[float, ...] = STRIBECK_SPEEDS_rad_s

    @property
    def columns(self) -> int:
        """How many columns there are."""
        return self.first_order + 2 * len(self.orders)

    @property
    def first_order(self) -> int:
        """The column of the first order's cosine."""
        return FIXED + 2 * len(self.stribeck_rad_s)

    def stribeck(self, which: int) -> list[int]:
        """Return the columns, forward and backward, of one Stribeck speed."""
        return [FIXED + 2 * which, FIXED + 2 * which + 1]

    def order(self, which: int) -> list[int]:
        """Return the columns, cosine and sine, of one order."""
        return [self.first_order + 2 * which, self.first_order + 2 * which + 1]


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

    layout: Layout
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
    rows = out.shape[0]
    top = int(orders.max()) if orders.size else 0
    wanted = np.full(top + 1, -1)
    for j in range(orders.size):
        wanted[int(orders[j])] = j
    for s in range(first * stride, (first + rows + 4) * stride):
        if s >= angle.size:
            break
        c1, s1 = np.cos(angle[s]), np.sin(angle[s])
        c, d = 1.0, 0.0
        block = s // stride
        for n in range(1, top + 1):
            c, d = c * c1 - d * s1, d * c1 + c * s1
            j = wanted[n]
            if j >= 0:
                for r in range(max(block - 4, first), min(block, first + rows - 1) + 1):
                    w = s - r * stride
                    if w <= 4 * stride:
                        out[r - first, 2 * j] += bump[w] * c
                        out[r - first, 2 * j + 1] += bump[w] * d


def matrix(windows: Windows, layout: Layout, first: int, last: int) -> FloatArray:
    """Return the regression's columns for windows `first` up to `last`, (last - first, columns)."""
    rows = slice(first, last)
    out = np.zeros((last - first, layout.columns))
    sliding = windows.sliding[rows].astype(float)
    creeping = windows.creeping[rows].astype(float)
    direction = windows.direction[rows]
    up, down = np.maximum(direction, 0.0), np.minimum(direction, 0.0)
    out[:, INERTIA if windows.fast else INERTIA_SLOW] = windows.acceleration_rad_s2[rows]
    out[:, LATENCY] = windows.torque_rate_Nm_s[rows] * sliding
    out[:, COULOMB], out[:, COULOMB + 1] = up * sliding, down * sliding
    out[:, CREEP], out[:, CREEP + 1] = up * creeping, down * creeping
    speeds = [windows.velocity_rad_s]
    speeds += [np.exp(-((windows.velocity_rad_s / vs) ** 2)) for vs in layout.stribeck_rad_s]
    averaged = _average(np.column_stack(speeds), windows, first, last)
    out[:, VISCOUS] = averaged[:, 0] * sliding
    for i in range(len(layout.stribeck_rad_s)):
        forward, backward = layout.stribeck(i)
        out[:, forward] = averaged[:, 1 + i] * up * sliding
        out[:, backward] = averaged[:, 1 + i] * down * sliding
    harmonics = np.zeros((last - first, 2 * len(layout.orders)))
    orders = np.array(layout.orders, float)
    _harmonics(windows.angle_rad, windows.bump, windows.stride, first, orders, harmonics)
    out[:, layout.first_order :] = harmonics
    return out


def _average(values: FloatArray, windows: Windows, first: int, last: int) -> FloatArray:
    """Return the windows' averages of values given at the thinned samples, (rows, columns)."""
    out = np.zeros((last - first, values.shape[1]))
    for k, weight in enumerate(windows.bump):
        place = np.arange(first, last) * windows.stride + k
        out += weight * values[np.minimum(place, values.shape[0] - 1)]
    return out


def kinds(windows: Sequence[Windows]) -> list[FloatArray]:
    """Number the rows of each run by their noise: run class, sliding or not; -1 is left out."""
    speeds = sorted({round(float(np.rad2deg(w.cruise_rad_s)), 1) for w in windows})
    numbered = []
    for w in windows:
        base = 2 * speeds.index(round(float(np.rad2deg(w.cruise_rad_s)), 1))
        numbered.append(np.where(w.sliding, base, np.where(w.creeping, base + 1, -1)))
    return numbered


def folds(windows: Sequence[Windows], most: int = 6) -> list[FloatArray]:
    """Number the rows of each run by the turn they lie in, whole turns together."""
    numbered, offset = [], 0
    for w in windows:
        turn = np.floor(np.abs(w.centre_rad - w.centre_rad[0]) / TWO_PI).astype(int)
        numbered.append((turn + offset) % most)
        offset += int(turn.max()) + 1
    return numbered


def accumulate(windows: Sequence[Windows], layout: Layout) -> Equations:
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
                part.xx += x[mask].T @ x[mask]
                part.xy += x[mask].T @ y[mask]
                part.yy += float(y[mask] @ y[mask])
                part.rows += int(mask.sum())
    equations.folds = 1 + max((key[0] for key in equations.parts), default=-1)
    equations.kinds = 1 + max((key[1] for key in equations.parts), default=-1)
    return equations
