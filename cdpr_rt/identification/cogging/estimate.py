"""The final fit over windows with chosen orders: coefficients, lags, and their confidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging import design
from cdpr_rt.identification.cogging.design import ColumnLayout
from cdpr_rt.identification.cogging.sweep import TWO_PI
from cdpr_rt.identification.cogging.windows import IntArray, Windows

CLUSTERS_PER_TURN = 24
_ROUNDS = 5
_SPREAD_OF_MEDIAN = 1.4826
_LEAST_SPREAD_Nm = 1e-5
_TAIL = 2.5
_EMPTY = 1e-20
_EXTRA = 3
"""Columns after the harmonics: static lag, trend of the cogging, trend of the friction."""
_TREND_SD_1_s = 3e-4
_DRY = (design.COULOMB, design.COULOMB + 1, design.CREEP, design.CREEP + 1)
_FEWEST_ROWS = 20


@dataclass(frozen=True)
class Prior:
    """Gaussian prior of one column's coefficient."""

    column: int
    mean: float
    deviation: float


@dataclass
class Rows:
    """All rows of the fit: columns `x` (r, p), torque `y` (r,); all others (r,)."""

    x: FloatArray
    y: FloatArray
    acceleration: FloatArray
    """rad/s² where the inertia is not to be estimated, 0 elsewhere."""
    kind: IntArray
    direction: FloatArray
    time: FloatArray
    cluster: IntArray


@dataclass(frozen=True)
class HarmonicFit:
    """Coefficients of the used columns and the extra ones behind, with their covariance."""

    layout: ColumnLayout
    used: list[int]
    beta: FloatArray
    covariance: FloatArray
    lag_rad: float
    residual_Nm: FloatArray

    @property
    def lag_deviation_rad(self) -> float:
        """Standard error of the static lag."""
        return float(np.sqrt(max(self.covariance[-_EXTRA, -_EXTRA], 0.0)))

    @property
    def cogging_trend_1_s(self) -> float:
        """Relative change of the cogging in a second."""
        return float(self.beta[-_EXTRA + 1])

    def value(self, column: int) -> float:
        """Return a column's coefficient, 0 where it was not used."""
        return float(self.beta[self.used.index(column)]) if column in self.used else 0.0

    def deviation(self, column: int) -> float:
        """Return the standard error of a column's coefficient, 0 where it was not used."""
        if column not in self.used:
            return 0.0
        i = self.used.index(column)
        return float(np.sqrt(max(self.covariance[i, i], 0.0)))


def gather(windows: Sequence[Windows], layout: ColumnLayout) -> Rows:
    """Collect the rows in which the rotor moves with the ramp."""
    xs, ys, accelerations, ks, ds, ts, cs = [], [], [], [], [], [], []
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
        ts.append(w.centre_s[keep])
        cs.append(place[keep])
    parts = (np.concatenate(a) for a in (xs, ys, accelerations, ks, ds, ts, cs))
    return Rows(*parts)


def fit(
    windows: Sequence[Windows],
    layout: ColumnLayout,
    used: list[int],
    priors: list[Prior],
    lag_prior: tuple[float, float],
    inertia_kg_m2: float,
) -> HarmonicFit:
    """Fit the used columns, all harmonics and the static lag by Gauss-Newton steps.

    `lag_prior` is mean and standard deviation in rad. In slow runs the noise of the acceleration
    would bias the inertia low, so there the value of the other runs is used, or `inertia_kg_m2`
    where there are none. The covariance is the sandwich estimator over clusters of neighbouring
    windows, whose errors may be correlated.
    """
    rows = gather(windows, layout)
    columns = [*used, *range(design.FIXED, layout.columns)]
    precision, mean = _prior_arrays(columns, priors)
    precision[-_EXTRA:] = lag_prior[1] ** -2, _TREND_SD_1_s**-2, _TREND_SD_1_s**-2
    weight, inertia, lag = np.ones(rows.y.size), inertia_kg_m2, lag_prior[0]
    beta = np.zeros(len(columns) + _EXTRA)
    for step in range(_ROUNDS):
        x = _linearised(rows, layout, columns, beta, lag)
        mean[-_EXTRA] = lag_prior[0] - lag
        inverse = _inverse((x * weight[:, None]).T @ x + np.diag(precision))
        y = rows.y - inertia * rows.acceleration
        beta = inverse @ (x.T @ (weight * y) + precision * mean)
        residual = y - x @ beta
        if step < _ROUNDS - 1:
            lag += float(beta[-_EXTRA])
            weight = _weights(rows, residual)
            inertia = float(beta[0]) if used[0] == design.INERTIA else inertia
    score_covariance = _score_covariance(x * (weight * residual)[:, None], rows.cluster)
    covariance = inverse @ (score_covariance + np.diag(precision)) @ inverse
    return HarmonicFit(layout, columns, beta, covariance, lag + float(beta[-_EXTRA]), residual)


def _prior_arrays(columns: list[int], priors: list[Prior]) -> tuple[FloatArray, FloatArray]:
    """Return precision and mean of the priors, for columns and extra ones."""
    precision, mean = np.zeros(len(columns) + _EXTRA), np.zeros(len(columns) + _EXTRA)
    for p in priors:
        if p.column in columns:
            i = columns.index(p.column)
            precision[i], mean[i] = p.deviation**-2, p.mean
    return precision, mean


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse; a column that is zero in all rows gets zeros."""
    size = np.diag(matrix)
    scale = np.sqrt(np.where(size > _EMPTY * size.max(), size, np.inf))
    scaled = matrix / np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
    return np.asarray(np.linalg.inv(scaled) / np.outer(scale, scale))


def _linearised(
    rows: Rows, layout: ColumnLayout, columns: list[int], beta: FloatArray, lag: float
) -> FloatArray:
    """Return the used columns, harmonics shifted by the lag so far, and the extra columns.

    These are the derivatives by a further lag, and by the relative change of cogging and of
    friction per second: the motor warms up, and the coefficients hold for the end of the runs.
    """
    x = rows.x[:, columns]
    orders = np.repeat(np.array(layout.orders, float), 2)
    first = len(columns) - orders.size
    harmonics = _turned(x[:, first:], orders, rows.direction * lag)
    x[:, first:] = harmonics
    value = beta[first:-_EXTRA]
    since = rows.time - rows.time.max()
    dry = [i for i, c in enumerate(columns) if c in _DRY]
    extra = (
        -rows.direction * _slope(harmonics, orders, value),
        since * (harmonics @ value),
        since * (x[:, dry] @ beta[dry]),
    )
    return np.column_stack([x, *extra])


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


def _score_covariance(score: FloatArray, cluster: IntArray) -> FloatArray:
    """Return the sum over clusters of the outer product of their score."""
    order = np.argsort(cluster, kind="stable")
    edges = np.flatnonzero(np.diff(cluster[order])) + 1
    sums = np.add.reduceat(score[order], np.concatenate([[0], edges]), axis=0)
    count = sums.shape[0]
    return np.asarray(sums.T @ sums * (count / max(1, count - score.shape[1] // 8)))
