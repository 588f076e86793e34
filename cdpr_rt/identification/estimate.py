"""The final fit over windows with chosen orders: coefficients, lags, and their confidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.identification import design
from cdpr_rt.identification.design import Layout
from cdpr_rt.identification.sweep import TWO_PI
from cdpr_rt.identification.windows import IntArray, Windows

CLUSTERS_PER_TURN = 24
_ROUNDS = 5
_SPREAD_OF_MEDIAN = 1.4826
_LEAST_SPREAD_Nm = 1e-5
_TAIL = 2.5
_EMPTY = 1e-20
_FEWEST_ROWS = 20


@dataclass(frozen=True)
class Prior:
    """Knowledge from before about one column's coefficient."""

    column: int
    mean: float
    deviation: float


@dataclass
class Rows:
    """All rows of the fit: columns `x` (r, p), torque `y` and the rest (r,)."""

    x: FloatArray
    y: FloatArray
    acceleration: FloatArray
    """rad/s² where the inertia is not to be estimated, 0 elsewhere."""
    kind: IntArray
    direction: FloatArray
    cluster: IntArray


@dataclass(frozen=True)
class Fit:
    """Coefficients of the used columns and of the static lag (last), with their covariance."""

    layout: Layout
    used: list[int]
    beta: FloatArray
    covariance: FloatArray
    lag_rad: float
    residual_Nm: FloatArray

    def value(self, column: int) -> float:
        """Return a column's coefficient, 0 where it was not used."""
        return float(self.beta[self.used.index(column)]) if column in self.used else 0.0

    def deviation(self, column: int) -> float:
        """Return the standard error of a column's coefficient, 0 where it was not used."""
        if column not in self.used:
            return 0.0
        i = self.used.index(column)
        return float(np.sqrt(max(self.covariance[i, i], 0.0)))


def gather(windows: Sequence[Windows], layout: Layout) -> Rows:
    """Collect the rows in which the rotor moves with the ramp."""
    xs, ys, accelerations, ks, ds, cs = [], [], [], [], [], []
    clusters = 0
    for w, kind in zip(windows, design.kinds(windows), strict=True):
        keep = np.flatnonzero(kind >= 0)
        place = np.floor(w.centre_rad * (CLUSTERS_PER_TURN / TWO_PI)).astype(int)
        place += clusters - int(place.min())
        clusters = int(place.max()) + 1
        xs.append(design.matrix(w, layout, 0, w.torque_Nm.size)[keep])
        ys.append(w.torque_Nm[keep])
        accelerations.append(w.acceleration_rad_s2[keep] * (not w.quick))
        ks.append(kind[keep])
        ds.append(w.direction[keep])
        cs.append(place[keep])
    parts = (np.concatenate(a) for a in (xs, ys, accelerations, ks, ds, cs))
    return Rows(*parts)


def fit(
    windows: Sequence[Windows],
    layout: Layout,
    used: list[int],
    priors: list[Prior],
    lag_prior: tuple[float, float],
    inertia_kg_m2: float,
) -> Fit:
    """Fit the used columns, all harmonics and the static lag by Gauss-Newton steps.

    `lag_prior` is mean and standard deviation in rad. In slow runs the noise of the acceleration
    would pull the inertia down, so there it takes the value found from the others, or the one
    handed in where there are none. The covariance is the sandwich over clusters
    of neighbouring windows, so that errors may depend on one another within a cluster.
    """
    rows = gather(windows, layout)
    weight, inertia = np.ones(rows.y.size), inertia_kg_m2
    harmonics = list(range(design.FIXED, layout.columns))
    columns = [*used, *harmonics]
    orders = np.repeat(np.array(layout.orders, float), 2)
    precision, mean = np.zeros(len(columns) + 1), np.zeros(len(columns) + 1)
    for p in priors:
        if p.column in columns:
            i = columns.index(p.column)
            precision[i], mean[i] = p.deviation**-2, p.mean
    precision[-1] = lag_prior[1] ** -2
    lag = lag_prior[0]
    beta = np.zeros(len(columns) + 1)
    for step in range(_ROUNDS):
        x = rows.x[:, columns].copy()
        turned = _turned(x[:, len(used) :], orders, rows.direction * lag)
        x[:, len(used) :] = turned
        slope = _slope(turned, orders, beta[len(used) : -1])
        x = np.column_stack([x, -rows.direction * slope])
        mean[-1] = lag_prior[0] - lag
        a = (x * weight[:, None]).T @ x
        size = np.diag(a) + precision
        # a column that no row tells gets the coefficient zero
        scale = np.sqrt(np.where(size > _EMPTY * size.max(), size, np.inf))
        scaled = (a + np.diag(precision)) / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
        inverse = np.linalg.inv(scaled) / np.outer(scale, scale)
        y = rows.y - inertia * rows.acceleration
        right = x.T @ (weight * y) + precision * mean
        beta = inverse @ right
        residual = y - x @ beta
        if step < _ROUNDS - 1:
            lag += float(beta[-1])
            weight = _weights(rows, residual)
            inertia = float(beta[0]) if used[0] == design.INERTIA else inertia
    meat = _meat(x * (weight * residual)[:, None], rows.cluster)
    covariance = inverse @ (meat + np.diag(precision)) @ inverse
    return Fit(layout, columns, beta[:-1], covariance, lag + float(beta[-1]), residual)


def _turned(harmonics: FloatArray, orders: FloatArray, by: FloatArray) -> FloatArray:
    """Return the cosine and sine columns of angles reduced by `by` (r,)."""
    turn = by[:, None] * orders[None, ::2]
    c, s = harmonics[:, ::2], harmonics[:, 1::2]
    out = np.empty_like(harmonics)
    out[:, ::2] = c * np.cos(turn) + s * np.sin(turn)
    out[:, 1::2] = s * np.cos(turn) - c * np.sin(turn)
    return out


def _slope(harmonics: FloatArray, orders: FloatArray, beta: FloatArray) -> FloatArray:
    """Return the derivative of the cogging by the angle, (r,)."""
    n = orders[::2]
    return np.asarray(harmonics[:, ::2] @ (n * beta[1::2]) - harmonics[:, 1::2] @ (n * beta[::2]))


def _weights(rows: Rows, residual: FloatArray) -> FloatArray:
    """Return each row's weight by Huber's rule, with a spread for each kind; 0 for rare kinds."""
    weight = np.zeros(rows.kind.size)
    for kind in np.unique(rows.kind):
        mine = rows.kind == kind
        if np.count_nonzero(mine) >= _FEWEST_ROWS:
            size = np.abs(residual[mine])
            spread = max(_SPREAD_OF_MEDIAN * float(np.median(size)), _LEAST_SPREAD_Nm)
            weight[mine] = np.minimum(1.0, _TAIL * spread / np.maximum(size, 1e-12)) / spread**2
    return weight


def _meat(score: FloatArray, cluster: IntArray) -> FloatArray:
    """Return the sum over clusters of the outer product of their score."""
    order = np.argsort(cluster, kind="stable")
    edges = np.flatnonzero(np.diff(cluster[order])) + 1
    sums = np.add.reduceat(score[order], np.concatenate([[0], edges]), axis=0)
    count = sums.shape[0]
    return np.asarray(sums.T @ sums * (count / max(1, count - score.shape[1] // 8)))
